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

/* A whole number in decimal, lo to hi.  0, or -1: *number stays as it is. */
int host_parse_number(const char *text, uint64_t lo, uint64_t hi,
                      uint64_t *number);

/* Bytes, with an optional K, M or G, or KiB, MiB, GiB: 4M.  0, or -1: *bytes
 * stays as it is. */
int host_parse_bytes(const char *text, uint64_t *bytes);

#endif
