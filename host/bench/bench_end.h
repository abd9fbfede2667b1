/* What a link does over a wire, measured from one of its ends: `incode bench
 * links` has two processes, each with an end, for each driver.
 *
 * Memory: a link.  Work: some seconds.
 *
 *     struct host_bench_end end = {.pipe = pipe, .idle = idle};
 *     struct host_bench_row row;
 *     if (host_bench_end(&end, role, &row) == 0)
 *         printf("%.3f MB/s\n", 1e-6 * row.bytes_per_s);
 */
#ifndef HOST_BENCH_END_H
#define HOST_BENCH_END_H

#include "transport/link.h"

enum {
    HOST_BENCH_MESSAGE = 1600, /* bytes: a page and its head */
    HOST_BENCH_SMALL = 16
};

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

/* Settings of a serial line's link; 0 baud: a pseudo-terminal's. */
struct link_config host_bench_serial(uint32_t baud);

/* Processor time of this process, in microseconds. */
uint64_t host_bench_used_us(void);

#endif
