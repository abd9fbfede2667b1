/* What a link does over a simulated serial line, both ends in this process and
 * in virtual time.
 *
 * Memory: two links and a wire.  Work: some milliseconds.
 *
 *     struct host_bench_row row = {0};
 *     if (host_bench_sim(&row, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_SIM_H
#define HOST_BENCH_SIM_H

#include "bench_end.h"
#include "host/base/error.h"

enum { HOST_BENCH_SIM_BYTES = 300000 }; /* a second, of the line */

/* 0, or HOST_BROKEN without memory. */
int host_bench_sim(struct host_bench_row *row, struct host_error *error);

#endif
