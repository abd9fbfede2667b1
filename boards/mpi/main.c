/* A node as a rank of MPI.  It has no options of its own: rank 0, the host,
 * says how large the cube is and how much memory a node has, and rank i + 1 is
 * node i.  Its links are pipes to the ranks of its neighbours. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#include "boards/process.h"
#include "node/node.h"
#include "boards/processor/processor.h"
#include "transport/drivers/mpi.h"
#include "transport/drivers/mpi_environment.h"

enum {
    STACK_BYTES = 65536, /* of a node's memory */
    STEPS_A_LOOK = 16,   /* between looks for orders */
    PART_US_MAX = 60000000,
    STAY_US = 300000 /* after SIGTERM: rank 0 sees then who went first */
};

struct mpi_board {
    struct mpi_place place;
    struct mpi_pipe *pipes;
    unsigned links;
    uint32_t tag;          /* of the present cube */
    struct mpi_order next; /* what rank 0 says next, once `heard` is */
    MPI_Request heard;
    uint64_t busy_us; /* before this cube */
};

static _Noreturn void give_up(unsigned node, const char *why) {
    (void)fprintf(stderr, "incode-node-mpi: node %u: %s\n", node, why);
    _exit(4);
}

/* what: in the host's order, a number that breaks its bound ("at most"). */
static _Noreturn void refuse_order(unsigned node, const char *what,
                                   unsigned long long is, const char *bound,
                                   unsigned long long limit) {
    char why[160];
    (void)snprintf(why, sizeof why,
                   "the host's order: %s %llu, expected %s %llu; are all "
                   "machines of one version?",
                   what, is, bound, limit);
    give_up(node, why);
}

/* Open MPI ends all ranks when it has lost one. */
static void stay_a_moment(int signal) {
    struct timespec wait = {0, STAY_US * 1000L};
    (void)signal;
    (void)nanosleep(&wait, NULL);
    _exit(143);
}

static uint64_t now_us(void *context) {
    (void)context;
    return process_clock_us(CLOCK_MONOTONIC);
}

static uint64_t busy_us(void *context) {
    const struct mpi_board *b = context;
    return process_clock_us(CLOCK_PROCESS_CPUTIME_ID) - b->busy_us;
}

static void idle(void *context, uint64_t wait_us) {
    struct mpi_board *b = context;
    mpi_sleep(&b->place, b->pipes, b->links, &b->heard, wait_us);
}

static void reset(void *context, int status) {
    (void)context;
    _exit(status);
}

static void listen_for_order(struct mpi_board *b) {
    MPI_Irecv(&b->next, sizeof b->next, MPI_BYTE, 0, MPI_TAG_ORDER,
              b->place.comm, &b->heard);
}

static bool heard(struct mpi_board *b) {
    int flag = 0;
    MPI_Request_get_status(b->heard, &flag, MPI_STATUS_IGNORE);
    return flag != 0;
}

static struct mpi_order take_order(struct mpi_board *b) {
    while (!heard(b))
        mpi_sleep(&b->place, NULL, 0, &b->heard, 1000000);
    MPI_Wait(&b->heard, MPI_STATUS_IGNORE);
    struct mpi_order order = b->next;
    listen_for_order(b);
    return order;
}

/* The board's struct for this cube, with arena and pipes. */
static void equip(struct mpi_board *b, const struct mpi_order *order,
                  struct node_board *board) {
    unsigned self = (unsigned)b->place.rank - 1;
    size_t fixed = process_static_bytes() + STACK_BYTES;
    memset(board, 0, sizeof *board);
    if (order->dimension > CUBE_DIMENSION_MAX) {
        refuse_order(self, "dimension", order->dimension, "at most",
                     CUBE_DIMENSION_MAX);
    }
    if (order->memory < fixed + PROCESS_PAGE) {
        refuse_order(self, "bytes of memory", order->memory, "at least",
                     fixed + PROCESS_PAGE);
    }
    board->fixed_bytes = fixed;
    board->arena_bytes =
        (size_t)(order->memory - fixed) / PROCESS_PAGE * PROCESS_PAGE;
    board->arena = process_arena(board->arena_bytes);
    b->tag = order->tag;
    b->links =
        order->dimension + (self < order->host_ports || self == 0 ? 1u : 0u);
    b->pipes = calloc(CUBE_LINKS_MAX, sizeof *b->pipes);
    if (board->arena == NULL || b->pipes == NULL)
        give_up(self, "this machine does not grant a node's memory");
    for (unsigned d = 0; d < b->links; d++) {
        int peer = d < order->dimension ? (int)(self ^ 1u << d) + 1 : 0;
        mpi_pipe_open(&b->pipes[d], &b->place, peer, (int)order->tag);
        board->pipes[d] = mpi_link_pipe(&b->pipes[d]);
    }
    b->busy_us = process_clock_us(CLOCK_PROCESS_CPUTIME_ID);
    board->context = b;
    board->identity.self = (uint16_t)self;
    board->identity.dimension = (uint8_t)order->dimension;
    board->identity.window = (uint8_t)order->window;
    board->identity.host_ports = (uint8_t)order->host_ports;
    board->identity.epoch = order->epoch + self;
    board->now_us = now_us;
    board->busy_us = busy_us;
    board->idle = idle;
    board->reset = reset;
}

/* The node, until the host ends it, or drops the whole cube. */
static void run(struct mpi_board *b, const struct node_board *board) {
    const char *why = NULL;
    struct node *node = node_start(board, &why);
    enum node_event event = NODE_BUSY;
    if (node == NULL)
        give_up(board->identity.self, why);
    for (unsigned step = 1; event != NODE_STOPPED; step++) {
        event = node_step(node);
        if (event == NODE_IDLE)
            idle(b, node_wait_us(node));
        if ((event == NODE_IDLE || step % STEPS_A_LOOK == 0) && heard(b))
            return;
    }
    MPI_Request told;
    for (unsigned d = 0; d < b->links; d++)
        mpi_pipe_end(&b->pipes[d]);
    MPI_Isend(&b->tag, sizeof b->tag, MPI_BYTE, 0, MPI_TAG_ENDED, b->place.comm,
              &told);
    MPI_Request_free(&told);
    mpi_ring(&b->place, 0);
}

/* One cube, from its beginning to its end. */
static void take_part(struct mpi_board *b, const struct mpi_order *order) {
    static struct node_board board;
    bool mine = (unsigned)b->place.rank <= order->nodes;
    b->links = 0;
    if (mine) {
        equip(b, order, &board);
        run(b, &board);
    }
    if (take_order(b).word != MPI_WORD_END) {
        give_up((unsigned)b->place.rank - 1,
                "the host begins before it has ended; please report this");
    }
    if (!mpi_place_part(&b->place, b->pipes, b->links, PART_US_MAX))
        give_up((unsigned)b->place.rank - 1, "other ranks do not end");
    if (mine) {
        (void)munmap(board.arena, board.arena_bytes);
        free(b->pipes);
        b->pipes = NULL;
    }
}

int main(int argc, char **argv) {
    static struct mpi_board board;
    struct sigaction action = {.sa_handler = stay_a_moment};
    const char *forced = getenv(PROCESSOR_VARIABLE);
    const char *what = processor_force(forced);
    if (what != NULL) {
        (void)fprintf(stderr,
                      "incode-node-mpi: " PROCESSOR_VARIABLE "=%s: %s; %s\n",
                      forced, what, processor_allowed());
        return 2;
    }
    prctl(PR_SET_PDEATHSIG, SIGKILL); /* gone with the launcher's daemon */
    (void)sigaction(SIGTERM, &action, NULL);
    mpi_environment();
    MPI_Init(&argc, &argv);
    if (mpi_place_open(&board.place) == 0) {
        listen_for_order(&board);
        for (;;) {
            struct mpi_order order = take_order(&board);
            if (order.word != MPI_WORD_BEGIN)
                break;
            take_part(&board, &order);
        }
        MPI_Cancel(&board.heard);
        MPI_Wait(&board.heard, MPI_STATUS_IGNORE);
        mpi_place_close(&board.place);
    }
    MPI_Finalize();
    return 0;
}
