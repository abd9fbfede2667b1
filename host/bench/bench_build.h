/* The peers of `incode bench peers`: small programs about other triangulators,
 * of which those are made whose packages are here.
 *
 * Memory: their paths.  Work: a compiler's, the first time.
 *
 *     struct host_bench_builds builds;
 *     if (host_bench_build(&builds, "cgal,qhull", &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_BUILD_H
#define HOST_BENCH_BUILD_H

#include "bench_class.h"
#include "host/base/error.h"

struct host_bench_builds {
    bool there[HOST_BENCH_PEERS];
    char path[HOST_BENCH_PEERS][4096];
};

/* wanted: names with commas between; NULL: all.  One whose package is missing
 * is named on standard error and not there.  HOST_USAGE for an unknown name, or
 * where this is not the top of the source tree; HOST_BROKEN: make fails. */
int host_bench_build(struct host_bench_builds *builds, const char *wanted,
                     struct host_error *error);

/* Makes a file of build/peers, from tests/bench: 0 and its path, or as above.
 */
int host_bench_made(const char *name, char path[4096],
                    struct host_error *error);

#endif
