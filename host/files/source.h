/* A file as bytes in memory: whole, or, where it is packed, as a window over
 * what it unpacks to.
 *
 * Memory: a file as it is, at most half of what is available when reading
 * begins, for the points need the rest; of a packed one a window of 1 MiB, of
 * 16 where it has long lines; or, where a format needs all of it at once, at
 * most a quarter of what is available; or 16 MiB, if that is more.  Work: one
 * pass.
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

struct host_feed;

struct host_source {
    const char *path; /* as in messages */
    const uint8_t *data;
    size_t bytes;
    void *owned; /* what close gives back, `capacity` bytes */
    size_t capacity;
    size_t most;            /* that it may grow to; 0: not looked up yet */
    size_t bound;           /* of what its caller takes; 0: none */
    struct host_feed *feed; /* NULL: data has all of it; else the beginning */
    const char *what;
};

/* Whether a name ends in .gz, in letters of either case. */
bool host_is_packed(const char *path);

/* Opens it ("-": standard input).  One that is told to be packed has its
 * beginning in `data`; another one is there whole.  A missing, unreadable,
 * empty or damaged file, or one too large for the memory: HOST_INPUT. */
int host_source_begin(struct host_source *source, const char *path, bool packed,
                      struct host_error *error);

/* Has the rest of it in `data` as well; closes it where that fails. */
int host_source_hold(struct host_source *source, struct host_error *error);

/* Both. */
int host_source_open(struct host_source *source, const char *path, bool packed,
                     struct host_error *error);

/* Of the window of a packed file: keeps what is from *at to *end, at first a
 * part of `data`, puts more behind it, and says where both are now.  False:
 * there is no more, or a fault, which host_source_fault tells. */
bool host_source_more(const struct host_source *source, const uint8_t **at,
                      const uint8_t **end);

/* The same with all of the rest: 0, or HOST_INPUT where it is too large. */
int host_source_all(const struct host_source *source, const uint8_t **at,
                    const uint8_t **end, struct host_error *error);

/* What was wrong with a packed file, in the place of what a reader made of its
 * early end; returns error->code. */
int host_source_fault(const struct host_source *source,
                      struct host_error *error);

/* The same, not unpacked, of a file of at most so many bytes, the most that
 * `what` has; a longer one, or one without an end: HOST_INPUT. */
int host_source_open_bounded(struct host_source *source, const char *path,
                             size_t most, const char *what,
                             struct host_error *error);

/* Begins with bytes of the caller, which are packed if `path` ends in .gz. */
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
