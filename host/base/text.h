/* Texts that come from elsewhere - names of files, nodes and devices, what a
 * file or a peer says - on their way to a terminal and to a shell.
 *
 * Memory: the caller's; HOST_SAY_BYTES of stack to say something. */
#ifndef HOST_TEXT_H
#define HOST_TEXT_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "error.h"

enum { HOST_SAY_BYTES = 4096 };

/* What a terminal would obey becomes \xNN (cube_text_printable); as much of it
 * as fits into `size` bytes, at least 1, the final 0 included. */
void host_text_printable(char *out, size_t size, const char *text);

/* One word for a POSIX shell, quoted where it has to be, which stands for
 * `text` byte by byte and is printable but for line feeds.  0, or -1 where it
 * does not fit: out is empty then, as half a word would be another. */
int host_text_quote(char *out, size_t size, const char *text);

/* Prints a line, made printable; a line feed at the end of `format` stays. */
void host_say(FILE *stream, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* What a noun of so many has at its end: "s", or nothing for one. */
static inline const char *host_text_s(uint64_t count) {
    return count == 1 ? "" : "s";
}

/* Of the names that `name` gives from 0 up to NULL, the one that may have been
 * meant by `word`, by the fewest letters changed, left out, put in or swapped
 * (Damerau, CACM 7:171-176, 1964); NULL: none is near. */
const char *host_text_nearest(const char *word,
                              const char *(*name)(const void *context,
                                                  unsigned i),
                              const void *context);

/* Numbers and sizes as a user writes them: on a command line, in a cube file,
 * in the environment. */

/* A whole number in decimal, lo to hi, also as 1e6, 2.5e3, or 10k and 2M,
 * thousands and millions.  0, or -1: *number
 * stays as it is. */
int host_parse_number(const char *text, uint64_t lo, uint64_t hi,
                      uint64_t *number);

/* Bytes, with an optional K, M or G, which are powers of 1024 as memory comes,
 * of either case and with or without B or iB: 4M, 4MB, "4 MiB".  0, or -1:
 * *bytes stays as it is. */
int host_parse_bytes(const char *text, uint64_t *bytes);

/* The value of `option`, as --nodes: a power of two, up to `most`, which is
 * one.  `more`: what else to do for more nodes, or "". */
int host_parse_nodes(const char *option, const char *text, unsigned most,
                     const char *more, unsigned *nodes,
                     struct host_error *error);

#endif
