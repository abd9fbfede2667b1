/* `incode bench`: its arguments, and the benchmark that they name. */
#ifndef HOST_BENCH_BENCH_H
#define HOST_BENCH_BENCH_H

#include "host/base/error.h"
#include "transport/link.h"
#include "bench_peers.h"

/* The whole command; argv[0] is its name for messages. */
int host_bench(int argc, char **argv, struct host_error *error);

/* What a link does over a wire, measured from one of its ends: `incode bench
 * links` has two processes, each with an end, for each driver. */

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

/* The peers of `incode bench peers`: small programs about other triangulators,
 * of which those are made whose packages are here. */

struct host_bench_builds {
    bool there[HOST_BENCH_PEERS];
    char path[HOST_BENCH_PEERS][4096];
    const char *threads[HOST_BENCH_PEERS]; /* its argument; NULL: has none */
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
