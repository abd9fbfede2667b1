/* Reading numbers and words from text in memory, with the place of a mistake
 * worked out only when there is one.
 *
 * Work: about 15 ns a number of up to 19 digits, correctly rounded; strtod
 * for the rest. */
#ifndef HOST_SCAN_H
#define HOST_SCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "host/formats/source.h"

struct host_scan {
    const char *path;
    const char *start, *at, *end;
    uint64_t lines_before; /* of the file, where this is a part of it */
    /* A file that is unpacked line by line; else NULL. */
    const struct host_source *source;
    const char *whole; /* then: start of the last line, perhaps cut off */
};

/* Scans all of a file.  If it is packed, the bytes from `at` on move whenever a
 * line is left. */
struct host_scan host_scan_source(const struct host_source *source);

/* A byte order mark at the start is skipped. */
struct host_scan host_scan_start(const char *path, const void *data,
                                 size_t bytes);

/* Skips blanks, commas and semicolons within the line; true if anything follows
 * before its end or a comment (# or //). */
bool host_scan_more(struct host_scan *s);

/* Whether a comment begins at `at`, which is before `end`. */
bool host_scan_is_comment(const char *at, const char *end);

/* Goes to the start of the next line that holds something; false at the end. */
bool host_scan_skip_blank_lines(struct host_scan *s);

/* Goes to the start of the next line, whatever is left of this one. */
void host_scan_next_line(struct host_scan *s);

/* The next number of the line: finite, in decimal.  0 or HOST_INPUT. */
int host_scan_double(struct host_scan *s, double *value,
                     struct host_error *error);

/* The same across line ends. */
int host_scan_double_anywhere(struct host_scan *s, double *value,
                              struct host_error *error);

/* A whole number from 0 to `most`, across line ends. */
int host_scan_unsigned(struct host_scan *s, uint64_t most, uint64_t *value,
                       struct host_error *error);

/* The next word of the line, cut to size - 1 bytes; "" where there is none. */
void host_scan_word(struct host_scan *s, char *word, size_t size);

/* Whether the word at hand is `word`, upper or lower case; takes it if so. */
bool host_scan_take(struct host_scan *s, const char *word);

/* HOST_INPUT with `what` where anything but comments is left. */
int host_scan_end(struct host_scan *s, struct host_error *error,
                  const char *what);

/* "PATH:LINE:COLUMN: what", for the place `at`; returns HOST_INPUT. */
int host_scan_fail(const struct host_scan *s, const char *at,
                   struct host_error *error, const char *what);

#endif
