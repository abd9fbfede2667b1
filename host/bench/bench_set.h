/* A set of points for several programs to read, as a .npy that has no name on
 * any disk and is gone with this process.
 *
 * Memory: 24 bytes a point, and the points once more while it is made.  Work:
 * a copy.
 *
 *     struct host_bench_set set;
 *     if (host_bench_set_made(&set, "torus", 20000, &error) == 0)
 *         printf("%s: %llu points\n", set.path,
 *                (unsigned long long)set.points);
 *     host_bench_set_free(&set);
 */
#ifndef HOST_BENCH_SET_H
#define HOST_BENCH_SET_H

#include <stdint.h>

#include "host/base/error.h"

struct host_bench_set {
    char name[64];
    char path[64]; /* by which other processes open it while this one lives */
    uint64_t points;
    int file;
};

/* Of host_gen, seed 1. */
int host_bench_set_made(struct host_bench_set *set, const char *kind,
                        uint64_t n, struct host_error *error);

/* Of a file that `incode run` reads; named as it, without its extensions. */
int host_bench_set_read(struct host_bench_set *set, const char *path,
                        struct host_error *error);

/* Also after a failure. */
void host_bench_set_free(struct host_bench_set *set);

#endif
