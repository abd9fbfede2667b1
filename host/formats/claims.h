/* Which files a command reads and which it will write, so that it writes over
 * no file that it reads, and writes no file twice.  Two names are one file if
 * they have the same device and inode, links followed.  For a file that does
 * not exist yet, the directory and the last name are compared, links followed.
 *
 * Memory: a name a file.  Work: a stat a file, and a comparison with each.
 *
 *     struct host_claims claims = {0};
 *     host_claims_read(&claims, "a.node", &error);
 *     if (host_claims_write(&claims, "-o ", "a.ele", NULL, &error) != 0)
 *         return error.code;
 *     host_claims_free(&claims);
 */
#ifndef HOST_CLAIMS_H
#define HOST_CLAIMS_H

#include "host/base/error.h"

struct host_claim;

struct host_claims {
    struct host_claim *claim;
    unsigned count, capacity;
};

/* Notes a file that is read; "-" is standard input. */
int host_claims_read(struct host_claims *claims, const char *path,
                     struct host_error *error);

/* Notes an output, which the command line gives as `option` and `path`, with
 * all files that belong to it; "-" is standard output.  `input`: as of
 * host_write.  HOST_USAGE where one of them is read, or written for another
 * output. */
int host_claims_write(struct host_claims *claims, const char *option,
                      const char *path, const char *input,
                      struct host_error *error);

void host_claims_free(struct host_claims *claims);

#endif
