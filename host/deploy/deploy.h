/* `incode deploy`: puts the node program on boards with Linux over ssh, starts
 * it there, shows whether it runs, updates and removes it; all boards of a cube
 * file at once, each with a line of its own.
 *
 * Memory: 6 KiB a board, and the programs of their processors.  Work: a process
 * of ssh a board, DEPLOY_AT_ONCE at a time. */
#ifndef HOST_DEPLOY_H
#define HOST_DEPLOY_H

#include <limits.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"

/* The whole command.  0; HOST_CUBE where any board failed, and the others did
 * what was asked for. */
int host_deploy(int argc, char **argv, struct host_error *error);

/* The node programs of `make nodes`, one a processor, as boards are sent them.
 *
 * Memory: the programs that boards asked for, some 500 KB each. */

enum { HOST_PROGRAMS_MAX = 4, HOST_SHA256_DIGITS = 64 };

struct host_program {
    const char *processor;
    uint8_t *bytes; /* NULL: not read yet */
    size_t size;
    char digest[HOST_SHA256_DIGITS + 1];
};

struct host_programs {
    char folder[PATH_MAX];
    char own[PATH_MAX]; /* of make, for this machine's processor; "": none */
    struct host_program program[HOST_PROGRAMS_MAX];
};

/* folder: NULL for nodes/ beside this program, or lib/incode/ where it is
 * installed; where these lack that of this machine's processor, incode-node
 * beside this program is taken, which make has made.  0, or HOST_BROKEN. */
int host_programs_open(struct host_programs *programs, const char *folder,
                       struct host_error *error);
void host_programs_free(struct host_programs *programs);

/* That for a machine as its `uname -m` says; NULL: as the error says. */
const struct host_program *host_programs_take(struct host_programs *programs,
                                              const char *machine,
                                              struct host_error *error);

/* SHA-256 of bytes, in hexadecimal digits. */
void host_digest_bytes(const void *bytes, size_t size,
                       char digits[HOST_SHA256_DIGITS + 1]);

#endif
