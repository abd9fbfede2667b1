/* A file as bytes in memory.
 *
 * Memory: the bytes (of a .gz, those packed and those unpacked).  Work: one
 * pass.
 *
 *     struct host_source source;
 *     if (host_source_open(&source, "a.xyz.gz", &error) != 0)
 *         return error.code;
 *     host_source_close(&source);
 */
#ifndef HOST_SOURCE_H
#define HOST_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"

struct host_source {
    const char *path; /* as in messages */
    const uint8_t *data;
    size_t bytes;
    void *owned; /* what close gives back, `capacity` bytes */
    size_t capacity;
};

/* Whether a name ends in .gz, in letters of either case. */
bool host_is_packed(const char *path);

/* Reads it whole ("-": standard input), unpacks .gz.  A missing, unreadable,
 * empty or damaged file: HOST_INPUT. */
int host_source_open(struct host_source *source, const char *path,
                     struct host_error *error);

/* Takes bytes of the caller, unpacks them if `path` ends in .gz. */
int host_source_wrap(struct host_source *source, const char *path,
                     const void *data, size_t bytes, struct host_error *error);

void host_source_close(struct host_source *source);

/* "PATH: what" with HOST_INPUT. */
int host_source_fail(const struct host_source *source, struct host_error *error,
                     const char *what);

#endif
