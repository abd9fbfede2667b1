/* `incode sign` and `incode image`: makes an image of a board's binary, or
 * signs one anew; says what is in one. */
#ifndef HOST_SIGN_H
#define HOST_SIGN_H

#include <stdint.h>

#include "host/formats/source.h"
#include "node/loader/image.h"
#include "host/base/error.h"
#include "transport/sign_suite.h"

/* An image as a file of the host's. */

struct host_image {
    struct host_source source; /* its bytes, the header first */
    struct loader_image image;
};

/* With a header and all of the code.  HOST_INPUT: it cannot be read, is none,
 * or not all of one. */
int host_image_open(struct host_image *file, const char *path,
                    struct host_error *error);
void host_image_close(struct host_image *file);

/* LOADER_WRONG_DIGEST, or what loader_image_signed says of its own key:
 * LOADER_UNSIGNED, LOADER_WRONG_SIGNATURE or LOADER_GOOD. */
enum loader_fault host_image_fault(const struct host_image *file);

/* Of a header's first LOADER_NAMED_BYTES, and the code. */
void host_image_digest(const uint8_t *header, const uint8_t *code, size_t size,
                       uint8_t digest[SIGN_DIGEST_BYTES]);

/* The whole commands. */
int host_sign(int argc, char **argv, struct host_error *error);
int host_image_show(int argc, char **argv, struct host_error *error);

/* A pair that images are signed with: the secret half in a file for its owner
 * alone, a word and 64 hexadecimal digits, and the public half beside it, in
 * FILE.pub, 64 digits. */

enum { HOST_SIGN_SECRET_BYTES = 64 };

struct host_sign_key {
    uint8_t secret[HOST_SIGN_SECRET_BYTES]; /* as libsodium has it */
    uint8_t public[SIGN_PUBLIC_BYTES];
};

/* `incode key --sign FILE`: neither file may be there already.  0, HOST_INPUT
 * or HOST_BROKEN: nothing is left then. */
int host_sign_key_make(const char *path, struct host_error *error);

/* The public half alone, from FILE.pub. */
int host_sign_public_read(uint8_t public[SIGN_PUBLIC_BYTES], const char *path,
                          struct host_error *error);

#endif
