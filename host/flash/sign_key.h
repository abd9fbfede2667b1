/* A pair that images are signed with: the secret half in a file for its owner
 * alone, a word and 64 hexadecimal digits, and the public half beside it, in
 * FILE.pub, 64 digits.
 *
 * Memory: the halves; the secret one is the caller's to wipe.  Work: a few
 * system calls; a scalar multiplication.
 *
 *     if (host_sign_key_make("lab.sign", &error) != 0 ||
 *         host_sign_key_read(&pair, "lab.sign", &error) != 0)
 *         return error.code;
 *     host_sign_key_wipe(&pair);
 */
#ifndef HOST_SIGN_KEY_H
#define HOST_SIGN_KEY_H

#include <stdint.h>

#include "host/base/error.h"
#include "transport/sign_suite.h"

enum { HOST_SIGN_SECRET_BYTES = 64 };

struct host_sign_key {
    uint8_t secret[HOST_SIGN_SECRET_BYTES]; /* as libsodium has it */
    uint8_t public[SIGN_PUBLIC_BYTES];
};

/* `incode key --sign FILE`: neither file may be there already.  0, HOST_INPUT
 * or HOST_BROKEN: nothing is left then. */
int host_sign_key_make(const char *path, struct host_error *error);

/* HOST_INPUT: also of a file that others can read, or that is a cube's key. */
int host_sign_key_read(struct host_sign_key *pair, const char *path,
                       struct host_error *error);
void host_sign_key_wipe(struct host_sign_key *pair);

/* The public half alone, from FILE.pub. */
int host_sign_public_read(uint8_t public[SIGN_PUBLIC_BYTES], const char *path,
                          struct host_error *error);

/* The signature of these bytes. */
void host_sign_key_sign(const struct host_sign_key *pair, const uint8_t *bytes,
                        size_t size, uint8_t signature[SIGN_BYTES]);

/* As text: 2 * size digits, and 0. */
void host_sign_hex(char *text, const uint8_t *bytes, size_t size);

#endif
