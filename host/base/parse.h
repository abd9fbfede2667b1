/* Numbers and sizes as a user writes them: on a command line, in a cube file,
 * in the environment.
 *
 * Memory: none.  Work: one pass over the text.
 *
 *     uint64_t nodes, memory;
 *     if (host_parse_number("8", 1, 64, &nodes) != 0 ||
 *         host_parse_bytes("4M", &memory) != 0)
 *         return -1;
 */
#ifndef HOST_PARSE_H
#define HOST_PARSE_H

#include <stdint.h>

#include "error.h"

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
