/* A file as bytes in memory: whole, or as a window over what it holds or, where
 * it is packed, unpacks to.  Files are read, never mapped: one that becomes
 * shorter is an error.
 *
 * Memory: for a plain file, at most half of the memory available when reading
 * begins, as the points need the rest.  For a packed file a window of 1 MiB,
 * or 16 MiB if it has long lines; if the format needs the whole file, at most
 * a quarter of the available memory.  16 MiB are always allowed.  In a call
 * that puts arrays aside (scratch.h), plain files have a window, too, and what
 * is held whole is put aside, as far as there is room. */
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
    size_t bound;           /* most bytes that its caller takes; 0: none */
    struct host_feed *feed; /* NULL: data is whole; else a beginning */
    const char *what;
};

/* Whether a name ends in .gz, in letters of either case. */
bool host_is_packed(const char *path);

/* Opens it ("-": standard input).  `data` has the beginning, or all of a plain
 * file where nothing is put aside.  A missing, unreadable, empty or damaged
 * file, or one too large for the memory: HOST_INPUT. */
int host_source_begin(struct host_source *source, const char *path, bool packed,
                      struct host_error *error);

/* Reads the rest of it into `data`; closes it if that fails. */
int host_source_hold(struct host_source *source, struct host_error *error);

/* host_source_begin and host_source_hold. */
int host_source_open(struct host_source *source, const char *path, bool packed,
                     struct host_error *error);

/* Moves the window over the file: keeps the bytes from *at to *end (at
 * first a part of `data`), appends more, and sets *at and *end to where they
 * are now. False: the file has ended, or has a fault, which host_source_fault
 * reports. */
bool host_source_more(const struct host_source *source, const uint8_t **at,
                      const uint8_t **end);

/* The same with all of the rest: 0, or HOST_INPUT if it is too large. */
int host_source_all(const struct host_source *source, const uint8_t **at,
                    const uint8_t **end, struct host_error *error);

/* If such a file had a fault, reports it in place of the reader's error,
 * which its early end has caused.  Returns error->code. */
int host_source_fault(const struct host_source *source,
                      struct host_error *error);

/* The first place of a word in `data`, or NULL. */
const char *host_source_find(const struct host_source *source,
                             const char *word);

/* The same as host_source_open, not unpacked, of a file of at most so many
 * bytes, the most that `what` has; a longer one, or one without an end:
 * HOST_INPUT. */
int host_source_open_bounded(struct host_source *source, const char *path,
                             size_t most, const char *what,
                             struct host_error *error);

/* The same for bytes of the caller, which are packed if `path` ends in .gz. */
int host_source_wrap(struct host_source *source, const char *path,
                     const void *data, size_t bytes, struct host_error *error);

/* Whether `bytes` that `packed` of the file's become, at once, are within the
 * same bounds; else HOST_INPUT. */
int host_source_unpacks(const struct host_source *source, uint64_t packed,
                        uint64_t bytes, struct host_error *error);

/* Whether bytes that are deflated become exactly `bytes`; of any size, as it
 * trims (parallel.h). */
bool host_source_inflate(const uint8_t *from, size_t packed, uint8_t *to,
                         size_t bytes);

void host_source_close(struct host_source *source);

/* "PATH: what" with HOST_INPUT. */
int host_source_fail(const struct host_source *source, struct host_error *error,
                     const char *what);

#endif
