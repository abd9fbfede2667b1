/* `incode bench peers`: this program and other triangulators on the same points
 * by turns, in classes, with medians, ratios and goals.
 *
 * Memory: the largest set, thrice.  Work: ROUNDS runs a program and set.
 *
 *     struct host_bench_peers_options options = {
 *         .rounds = 3, .limit_s = 60, .peers = "cgal"};
 *     if (host_bench_peers(&options, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_PEERS_H
#define HOST_BENCH_PEERS_H

#include <stdbool.h>

#include "host/base/error.h"

enum { HOST_BENCH_ROUNDS_MAX = 99, HOST_BENCH_NAMES_MAX = 256 };

struct host_bench_peers_options {
    const char *name[HOST_BENCH_NAMES_MAX]; /* files and directories */
    unsigned names;
    const char *class; /* its name, or NULL: all */
    const char *peers; /* names with commas between, or NULL: all */
    unsigned rounds, limit_s;
    bool large;
};

/* 0, whatever was measured; HOST_BROKEN where a run failed or gave other
 * tetrahedra than CGAL. */
int host_bench_peers(const struct host_bench_peers_options *options,
                     struct host_error *error);

#endif
