/* `incode bench links`: what a link does over each driver, between two
 * processes.
 *
 * Memory: two links.  Work: some seconds a driver.
 *
 *     host_bench_links(&error);
 *
 * A driver that needs a program of its own measures its end there:
 *
 *     struct host_bench_end end = {pipe, idle, context, {0}};
 *     host_bench_end(&end, role, &row);
 */
#ifndef HOST_BENCH_LINKS_H
#define HOST_BENCH_LINKS_H

#include "transport/link.h"
#include "host/base/error.h"

/* One end's place on a wire. */
struct host_bench_end {
    struct link_pipe pipe;
    /* Sleeps until there are bytes or room, no longer than wait_us. */
    void (*idle)(void *context, uint64_t wait_us);
    void *context;
    struct link_config settings; /* window, frame_payload and so on */
};

struct host_bench_row {
    double bytes_per_s;   /* of payload, each way, both at once */
    double round_trip_us; /* of 16 bytes */
    double hop_us;        /* half of that, of 1,600 bytes: a page */
    double cpu_us;        /* both processes' time, a message of 1,600 bytes */
    double retransmitted; /* share of the frames */
};

/* Role 0 measures and fills the row, role 1 answers until role 0 has done.  0,
 * or -1 where the other does not answer. */
int host_bench_end(struct host_bench_end *end, unsigned role,
                   struct host_bench_row *row);

/* Measures all drivers and prints a line for each. */
int host_bench_links(struct host_error *error);

#endif
