/* Which files a command reads and which it will write, so that none is written
 * over that it reads, and none is written twice.  Two names are one file where
 * device and inode are the same, links followed; or, of a file that is not
 * there yet, where its directory and its last name are, links followed as well.
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
