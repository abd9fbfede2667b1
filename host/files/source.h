/* A file as bytes in memory.
 *
 * Memory: the bytes (of a .gz, those packed and those unpacked): at most half
 * of what is available when reading or unpacking begins, for the points need
 * the rest; or 16 MiB, if that is more.  Work: one pass.
 *
 *     struct host_source source;
 *     if (host_source_open(&source, "a.xyz.gz", true, &error) != 0)
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
    size_t most;   /* that it may grow to; 0: not looked up yet */
    size_t packed; /* that it comes from; 0: it was not packed */
    size_t bound;  /* of what its caller takes; 0: none */
    const char *what;
};

/* Whether a name ends in .gz, in letters of either case. */
bool host_is_packed(const char *path);

/* Reads it whole ("-": standard input), unpacks it if it is told to be packed.
 * A missing, unreadable, empty or damaged file, or one too large for the
 * memory: HOST_INPUT. */
int host_source_open(struct host_source *source, const char *path, bool packed,
                     struct host_error *error);

/* The same, not unpacked, of a file of at most so many bytes, the most that
 * `what` has; a longer one, or one without an end: HOST_INPUT. */
int host_source_open_bounded(struct host_source *source, const char *path,
                             size_t most, const char *what,
                             struct host_error *error);

/* Takes bytes of the caller, unpacks them if `path` ends in .gz. */
int host_source_wrap(struct host_source *source, const char *path,
                     const void *data, size_t bytes, struct host_error *error);

/* Whether `bytes` that `packed` of the file's become, at once, are within the
 * same bounds; else HOST_INPUT. */
int host_source_unpacks(const struct host_source *source, uint64_t packed,
                        uint64_t bytes, struct host_error *error);

void host_source_close(struct host_source *source);

/* "PATH: what" with HOST_INPUT. */
int host_source_fail(const struct host_source *source, struct host_error *error,
                     const char *what);

#endif
