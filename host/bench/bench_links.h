/* `incode bench links`: what a link does over each driver, between two
 * processes.
 *
 * Memory: two links.  Work: some seconds a driver.
 *
 *     if (host_bench_links(&error) != 0)
 *         return error.code;
 */
#ifndef HOST_BENCH_LINKS_H
#define HOST_BENCH_LINKS_H

#include "host/base/error.h"

/* Measures all drivers and prints a line for each.  0, or HOST_CUBE where one
 * of them does not work here. */
int host_bench_links(struct host_error *error);

#endif
