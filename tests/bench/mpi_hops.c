/* Measures what a hop costs between ranks of MPI, and what it would save to go
 * straight to the destination: links of the protocol over mpi_pipe, in a chain
 * of 1, 2 .. all ranks, each of which passes messages on as a node of the cube
 * does, and a chain of one hop between first and last.
 *
 *     mpirun -np 5 --oversubscribe build/tests/mpi_hops
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "transport/drivers/mpi.h"

enum { WINDOW = 8, MESSAGE = 1608, ROUNDS = 2000, BULK = 20000 };

static struct mpi_place place;
static struct mpi_pipe pipes[2];
static struct link *links[2];

static uint64_t now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* A link to `peer`, as port `own` of this rank. */
static void open_link(unsigned i, int peer, int tag) {
    struct link_config config = {.epoch = (uint32_t)(place.rank + 1),
                                 .node = (uint16_t)place.rank,
                                 .peer_node = (uint16_t)peer,
                                 .window = WINDOW};
    mpi_pipe_open(&pipes[i], &place, peer, tag);
    config.pipe = mpi_link_pipe(&pipes[i]);
    size_t bytes = link_bytes(&config);
    links[i] =
        link_init(aligned_alloc(64, (bytes + 63) / 64 * 64), bytes, &config);
}

static int poll_links(unsigned count) {
    int moved = 0;
    for (unsigned i = 0; i < count; i++)
        moved += link_poll(links[i], now_us());
    return moved;
}

static void rest(unsigned count) {
    uint64_t wait = 1000000;
    for (unsigned i = 0; i < count; i++) {
        uint64_t due = link_next_due_us(links[i], now_us());
        wait = due < wait ? due : wait;
    }
    mpi_sleep(&place, pipes, count, NULL, wait);
}

static void put(unsigned i, unsigned count, const void *data, size_t size) {
    while (link_write(links[i], data, size, NULL, 0) != 0)
        if (poll_links(count) == 0)
            rest(count);
}

/* The next message of link i, copied. */
static size_t get(unsigned i, unsigned count, uint8_t *data) {
    struct link_message message;
    while (!link_read(links[i], &message))
        if (poll_links(count) == 0)
            rest(count);
    size_t size = message.size;
    memcpy(data, message.data, size);
    link_release(links[i]);
    return size;
}

/* Passes on what comes, both ways, until an empty message has passed. */
static void pass_on(void) {
    static uint8_t data[2][LINK_MESSAGE_MAX];
    struct link_message message;
    bool ending = false;
    while (!ending || !link_idle(links[0]) || !link_idle(links[1])) {
        int moved = poll_links(2);
        for (unsigned i = 0; i < 2; i++) {
            while (link_room(links[1 - i], MESSAGE) > 0 &&
                   link_read(links[i], &message)) {
                memcpy(data[i], message.data, message.size);
                ending = ending || (i == 0 && message.size == 0);
                (void)link_write(links[1 - i], data[i], message.size, NULL, 0);
                link_release(links[i]);
                moved++;
            }
        }
        if (moved == 0)
            rest(2);
    }
}

static void first(const char *name, unsigned hops) {
    static uint8_t data[LINK_MESSAGE_MAX];
    put(0, 1, data, 8); /* all links are up once it is back */
    (void)get(0, 1, data);
    uint64_t start = now_us();
    for (unsigned i = 0; i < ROUNDS; i++) {
        put(0, 1, data, 8);
        (void)get(0, 1, data);
    }
    double round = (double)(now_us() - start) / ROUNDS;
    start = now_us();
    for (unsigned i = 0; i < BULK; i++)
        put(0, 1, data, MESSAGE);
    put(0, 1, data, 8);
    while (get(0, 1, data) != 8) {
    }
    double seconds = 1e-6 * (double)(now_us() - start);
    printf("%-10s %2u hops: round trip %7.1f us, %7.1f MB/s\n", name, hops,
           round, 1e-6 * BULK * MESSAGE / seconds);
    fflush(stdout);
    put(0, 1, data, 0);
    while (!link_idle(links[0]))
        if (poll_links(1) == 0)
            rest(1);
}

/* Answers short messages, takes long ones. */
static void last(void) {
    static uint8_t data[LINK_MESSAGE_MAX];
    size_t size;
    while ((size = get(0, 1, data)) != 0)
        if (size == 8)
            put(0, 1, data, 8);
    uint64_t end = now_us() + 20000;
    while (now_us() < end)
        (void)poll_links(1);
}

/* The chain of these ranks, of which this rank is number `at`. */
static void chain(const char *name, const int *ranks, int count, int tag) {
    int at = -1;
    for (int i = 0; i < count; i++)
        at = ranks[i] == place.rank ? i : at;
    unsigned ends = 0;
    if (at > 0)
        open_link(ends++, ranks[at - 1], tag);
    if (at >= 0 && at < count - 1)
        open_link(ends++, ranks[at + 1], tag);
    if (at == 0)
        first(name, (unsigned)count - 1);
    else if (at == count - 1)
        last();
    else if (at > 0)
        pass_on();
    (void)mpi_place_part(&place, pipes, ends, UINT64_MAX);
    for (unsigned i = 0; i < ends; i++)
        free(links[i]);
}

int main(int argc, char **argv) {
    int ranks[MPI_RANKS_MAX] = {0};
    MPI_Init(&argc, &argv);
    if (mpi_place_open(&place) != 0)
        MPI_Abort(MPI_COMM_WORLD, 2);
    for (int i = 0; i < place.ranks; i++)
        ranks[i] = i;
    for (int count = 2; count <= place.ranks; count++)
        chain("chain", ranks, count, count);
    ranks[1] = place.ranks - 1;
    chain("straight", ranks, 2, 100);
    mpi_place_close(&place);
    MPI_Finalize();
    return 0;
}
