#include "ranks.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

enum {
    PART_US_MAX = 3000000,
    TAGS = 30000, /* below what MPI grants at least */
    LOOKS_US = 100000,
    LOOK_EVERY_US = 5000
};

static volatile sig_atomic_t terminated;

static void note_end(int signal) {
    (void)signal;
    terminated = 1;
}

static uint64_t clock_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* --- orders --------------------------------------------------------------- */

static void tell_all(struct host_ranks *r, uint32_t word) {
    r->order.word = word;
    for (int i = 1; i < r->place.ranks; i++) {
        /* A few bytes, which MPI takes at once. */
        MPI_Send(&r->order, sizeof r->order, MPI_BYTE, i, MPI_TAG_ORDER,
                 r->place.comm);
        mpi_ring(&r->place, i);
    }
}

int host_ranks_open(struct host_ranks *ranks, struct host_error *error) {
    struct sigaction action = {.sa_handler = note_end};
    unsigned nodes = 0;
    int count = 0;
    memset(ranks, 0, sizeof *ranks);
    MPI_Comm_size(MPI_COMM_WORLD, &count);
    nodes = (unsigned)count - 1;
    bool fits = mpi_place_open(&ranks->place) == 0;
    if (!fits || nodes == 0 || (nodes & (nodes - 1)) != 0) {
        ranks->open = fits;
        return host_fail(error, HOST_USAGE,
                         "mpirun -np %d: one rank is the host, the others are "
                         "nodes of a cube; allowed: 2, 3, 5, 9, 17, 33, 65",
                         count);
    }
    ranks->open = true;
    (void)sigaction(SIGTERM, &action, &ranks->before);
    return 0;
}

int host_ranks_begin(struct host_ranks *ranks, unsigned nodes, uint64_t memory,
                     unsigned window, struct host_error *error) {
    struct mpi_order *order = &ranks->order;
    if (nodes >= (unsigned)ranks->place.ranks) {
        return host_fail(error, HOST_USAGE,
                         "--nodes %u: mpirun has started %d nodes and a host; "
                         "give --nodes %d, or mpirun -np %u",
                         nodes, ranks->place.ranks - 1, ranks->place.ranks - 1,
                         nodes + 1);
    }
    memset(order, 0, sizeof *order);
    order->nodes = nodes;
    while (1u << order->dimension < nodes)
        order->dimension++;
    order->memory = memory;
    order->window = window;
    if (getrandom(&order->epoch, sizeof order->epoch, 0) < 0 ||
        order->epoch < 2)
        order->epoch = 2;
    order->tag = MPI_TAG_PIPES + ranks->cubes++ % TAGS;
    ranks->ended = 0;
    ranks->wires = nodes < CUBE_HOST_PORTS_MAX ? nodes : CUBE_HOST_PORTS_MAX;
    order->host_ports = ranks->wires;
    for (unsigned i = 0; i < ranks->wires; i++) {
        mpi_pipe_open(&ranks->pipe[i], &ranks->place, (int)i + 1,
                      (int)order->tag);
    }
    ranks->running = true;
    tell_all(ranks, MPI_WORD_BEGIN);
    return 0;
}

/* --- losses --------------------------------------------------------------- */

/* Open MPI waits for its processes as soon as they end. */
static int find_lost(const struct host_ranks *r) {
    for (int i = 1; i < r->place.ranks; i++) {
        pid_t process = (pid_t)r->place.process[i];
        if (process != 0 && kill(process, 0) != 0 && errno == ESRCH)
            return i;
    }
    return 0;
}

static int check(void *context, struct host_error *error) {
    struct host_ranks *r = context;
    uint64_t end = clock_us() + LOOKS_US;
    if (!r->running)
        return 0;
    r->lost = find_lost(r);
    while (r->lost == 0 && terminated && clock_us() < end) {
        struct timespec wait = {0, LOOK_EVERY_US * 1000L};
        (void)nanosleep(&wait, NULL);
        r->lost = find_lost(r);
    }
    if (r->lost != 0) {
        return host_fail(error, HOST_CUBE,
                         "node %d (rank %d): its process has ended, and the "
                         "job with it; look for what stopped it, and run again",
                         r->lost - 1, r->lost);
    }
    if (terminated) {
        r->terminated = true;
        return host_fail(error, HOST_CUBE,
                         "mpirun: it ends the job; where it names a rank, that "
                         "is the one lost, else run again");
    }
    return 0;
}

/* --- as a machine --------------------------------------------------------- */

static uint64_t machine_now_us(void *context) {
    (void)context;
    return clock_us();
}

static void machine_idle(void *context, uint64_t wait_us) {
    struct host_ranks *r = context;
    if (!r->running)
        return; /* nothing more will come */
    mpi_sleep(&r->place, r->pipe, r->wires, NULL, wait_us);
}

static bool machine_ended(void *context) {
    struct host_ranks *r = context;
    int there = r->running;
    uint32_t tag = 0;
    while (r->ended < r->order.nodes && there) {
        MPI_Iprobe(MPI_ANY_SOURCE, MPI_TAG_ENDED, r->place.comm, &there,
                   MPI_STATUS_IGNORE);
        if (there) {
            MPI_Recv(&tag, sizeof tag, MPI_BYTE, MPI_ANY_SOURCE, MPI_TAG_ENDED,
                     r->place.comm, MPI_STATUS_IGNORE);
            r->ended += tag == r->order.tag; /* not of an earlier cube */
        }
    }
    return !r->running || r->ended == r->order.nodes;
}

static void leave(struct host_ranks *r) {
    if (r->open) {
        tell_all(r, MPI_WORD_LEAVE);
        mpi_place_close(&r->place);
    }
    r->open = false;
    if (!r->left) {
        MPI_Finalize();
        (void)sigaction(SIGTERM, &r->before, NULL);
    }
    r->left = true;
}

static void machine_stop(void *context) {
    struct host_ranks *r = context;
    if (!r->running)
        return;
    r->running = false;
    if (r->lost != 0 || r->terminated) {
        for (unsigned i = 0; i < r->wires; i++)
            r->pipe[i].closed = true; /* nobody is there to part from */
        return;
    }
    tell_all(r, MPI_WORD_END);
    r->stuck = !mpi_place_part(&r->place, r->pipe, r->wires, PART_US_MAX);
    if (!r->stuck && r->cubes == r->cubes_due)
        leave(r);
}

struct host_machine host_ranks_machine(struct host_ranks *ranks) {
    struct host_machine machine;
    memset(&machine, 0, sizeof machine);
    machine.context = ranks;
    machine.nodes = ranks->order.nodes;
    machine.dimension = ranks->order.dimension;
    machine.epoch = ranks->order.epoch - 1;
    machine.pipe = mpi_link_pipe(&ranks->pipe[0]);
    machine.host_ports = (uint8_t)ranks->wires;
    for (unsigned i = 0; i < ranks->wires; i++)
        machine.wires[i] = mpi_link_pipe(&ranks->pipe[i]);
    machine.now_us = machine_now_us;
    machine.idle = machine_idle;
    machine.check = check;
    machine.ended = machine_ended;
    machine.stop = machine_stop;
    return machine;
}

void host_ranks_close(struct host_ranks *ranks, int status) {
    if (ranks->lost != 0 || ranks->terminated || ranks->stuck) {
        (void)fflush(NULL);
        _exit(status);
    }
    leave(ranks);
}
