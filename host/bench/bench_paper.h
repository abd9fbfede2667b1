/* `incode bench paper`: Tables 2 and 4 of Cignoni, Laforenza, Perego, Scopigno
 * and Montani (1995) on this machine.
 *
 * Memory: that of a run of 20,000 points.  Work: some seconds.
 *
 *     host_run_defaults(&options);
 *     if (host_bench_paper(&options, 8, &error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_PAPER_H
#define HOST_BENCH_PAPER_H

#include "host/run/run.h"

/* For 1 to nodes_max nodes.  0, or what a run ends with. */
int host_bench_paper(const struct host_run_options *options, unsigned nodes_max,
                     struct host_error *error);

#endif
