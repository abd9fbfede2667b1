/* A node as a process of Linux.  Its options are arguments, its links are
 * connected sockets or open terminals that it inherits, its arena is one
 * mapping made at start: arena, .data, .bss and stack together are --memory.
 * The one who starts it sets RLIMIT_DATA and RLIMIT_STACK, so that the kernel
 * holds it to that.
 *
 *     incode-node --node 3 --dimension 3 --memory 4194304 --stack 65536 \
 *                 --window 8 --epoch 17 --links 5,6,7
 *
 * A node that a user starts opens its wires itself, draws its epoch, holds
 * itself to its memory, and begins anew when a run is over; see wire.h:
 *
 *     incode-node --node 3 --dimension 2 --key cube.key \
 *                 --wire 0=listen:10.0.0.3:7001 --wire 1=unix-call:/run/cube/13
 *
 * Without --node and --dimension it waits until a neighbour says who it is.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "boards/process.h"
#include "node/identity.h"
#include "node/node.h"
#include "options.h"
#include "boards/processor/processor.h"
#include "transport/drivers/secure_sodium.h"
#include "wire.h"

enum { SANITIZED_STATIC = 8192 };

struct linux_board {
    struct linux_wire wire[CUBE_LINKS_MAX];
    unsigned links_count;
    uint8_t key[SECURE_KEY_BYTES];
    uint64_t awake_us;
    char **again; /* arguments of the next start; NULL: there is none */
};

static uint64_t now_us(void *context) {
    (void)context;
    return process_clock_us(CLOCK_MONOTONIC);
}

static uint64_t busy_us(void *context) {
    (void)context;
    return process_clock_us(CLOCK_PROCESS_CPUTIME_ID);
}

static void idle(void *context, uint64_t wait_us) {
    struct linux_board *board = context;
    linux_wires_idle(board->wire, board->links_count, wait_us, board->awake_us);
}

static uint32_t refused(void *context) {
    const struct linux_board *board = context;
    return linux_wires_refused(board->wire, board->links_count);
}

/* A node that a user started begins anew, with an epoch of its own; there is no
 * loader in which it would stay. */
static void reset(void *context, int status) {
    const struct linux_board *board = context;
    if (board->again != NULL) {
        char *environment[] = {(char[]){LINUX_AGAIN "=1"}, processor_variable(),
                               NULL};
        execve("/proc/self/exe", board->again, environment);
    }
    _exit(status);
}

/* That others can read it, the host says, once. */
static bool read_key(const char *path, uint8_t key[SECURE_KEY_BYTES],
                     struct linux_fault *fault) {
    enum key_file_state state = key_file_read(path, key);
    int reason = state == KEY_FILE_UNREADABLE ? errno : 0;
    struct key_file_text text = key_file_text(state);
    *fault = (struct linux_fault){.where = "--key",
                                  .value = path,
                                  .what = text.what,
                                  .next = text.next,
                                  .reason = reason};
    return state == KEY_FILE_GOOD || state == KEY_FILE_SEEN;
}

static bool open_wires(struct linux_board *linux_board,
                       const struct linux_options *options,
                       struct secure_source *source, struct tcp_wire *net,
                       struct linux_fault *fault) {
    struct linux_guard guard = {.source = source};
    if (options->key != NULL) {
        if (!read_key(options->key, linux_board->key, fault))
            return false;
        guard.key = linux_board->key;
    }
    for (unsigned i = 0; i < options->wires_count; i++) {
        *fault = (struct linux_fault){.where = "--wire",
                                      .value = options->wire[i],
                                      .next = "see incode-node --help"};
        guard.insecure = (options->insecure >> i & 1) != 0;
        if (!linux_wire_open(&linux_board->wire[i],
                             strchr(options->wire[i], '=') + 1, &guard, &net[i],
                             fault))
            return false;
    }
    linux_wires_end_with(linux_board->wire, options->wires_count);
    return true;
}

/* What the one who starts a node does otherwise. */
static void start_alone(struct linux_options *options,
                        struct linux_board *linux_board,
                        struct secure_source *source, char **argv) {
    struct node_identity identity = {.epoch = 0};
    linux_board->again = argv;
    if (options->epoch == 0 && node_identity_epoch(&identity, source))
        options->epoch = identity.epoch;
#ifndef INCODE_SANITIZED
    struct rlimit stack = {options->stack, options->stack};
    struct rlimit data = {options->memory - options->stack,
                          options->memory - options->stack};
    (void)setrlimit(RLIMIT_STACK, &stack);
    (void)setrlimit(RLIMIT_DATA, &data);
#endif
}

/* Once: a greeting may be a stranger's, and the next one right. */
static void tell_of_greeting(const struct learner *learner, bool *told) {
    const char *what = node_identity_doubt(learner);
    if (what != NULL && !*told) {
        fault_print(&(struct linux_fault){
            .where = "--wire",
            .what = what,
            .next = "it waits for another; see incode cube FILE"});
        *told = true;
    }
}

/* A terminal does not break when a node ends: its neighbours may be up, and
 * greet only if they are asked.  A socket does, and is not asked, as a question
 * is no greeting to who decides by the first bytes whether to let one in. */
static void ask_terminals(const struct linux_board *board,
                          struct learner *learner) {
    for (unsigned i = 0; i < board->links_count; i++)
        if (board->wire[i].kind != LINUX_TERMINAL)
            learner->pipes[i].send = NULL;
}

/* Waits until a neighbour has said who this node is. */
static void learn(const struct node_board *board,
                  struct linux_options *options) {
    static struct learner learner;
    struct linux_board *links = board->context;
    struct node_identity identity = {.self = 0};
    bool told = false;
    node_identity_listen(&learner, board, links->links_count);
    ask_terminals(links, &learner);
    while (!node_identity_hear(&learner, &identity)) {
        tell_of_greeting(&learner, &told);
        node_identity_ask(&learner, now_us(links));
        idle(links, 50000);
    }
    options->node = identity.self;
    options->dimension = identity.dimension;
    options->host_port = identity.host_port;
}

/* For those who call from now on: which wires these are. */
static void name_wires(struct linux_board *board,
                       const struct linux_options *options) {
    struct cube_config cube = {.self = (uint16_t)options->node,
                               .dimension = (uint8_t)options->dimension};
    linux_wires_name(board->wire, board->links_count, &cube);
}

static struct node_identity identity_of(const struct linux_options *options) {
    struct node_identity id;
    memset(&id, 0, sizeof id);
    id.self = (uint16_t)options->node;
    id.dimension = (uint8_t)options->dimension;
    id.window = (uint8_t)options->window;
    id.epoch = (uint32_t)options->epoch;
    id.serial_baud = (uint32_t)options->serial_baud;
    id.dead_us = (uint32_t)options->dead;
    id.host_port = options->host_port != 0;
    id.host_ports = (uint8_t)options->host_ports;
    return id;
}

static void fill_in(struct node_board *board, struct linux_board *linux_board) {
    for (unsigned i = 0; i < linux_board->links_count; i++)
        board->pipes[i] = linux_wire_pipe(&linux_board->wire[i]);
    board->context = linux_board;
    board->now_us = now_us;
    board->busy_us = busy_us;
    board->idle = idle;
    board->refused = refused;
    board->reset = reset;
}

/* The arena, and at its end the wires' state; NULL, or what is wrong. */
static const char *take_memory(struct node_board *board,
                               const struct linux_options *options,
                               struct tcp_wire **net) {
    size_t wires = options->wires_count * sizeof **net;
    size_t memory = (size_t)options->memory, stack = (size_t)options->stack;
    size_t fixed = process_static_bytes() + stack;
#ifdef INCODE_SANITIZED
    /* A sanitizer's own data is not a node's, and nothing limits it. */
    fixed = SANITIZED_STATIC + stack;
#endif
    wires = (wires + PROCESS_PAGE - 1) / PROCESS_PAGE * PROCESS_PAGE;
    if (memory < fixed + wires + PROCESS_PAGE)
        return "does not hold the program's own data and the wires";
    size_t bytes = (memory - fixed) / PROCESS_PAGE * PROCESS_PAGE;
    board->arena = process_arena(bytes);
    board->arena_bytes = bytes - wires;
    board->fixed_bytes = fixed + wires;
    if (board->arena == NULL)
        return "the kernel does not grant it";
    *net = (void *)((uint8_t *)board->arena + board->arena_bytes);
    return NULL;
}

static int complain(struct linux_fault fault, int status) {
    fault_print(&fault);
    return status;
}

/* 0, or the status to end with. */
static int prepare(char **argv, struct linux_options *options,
                   struct linux_board *linux_board, struct node_board *board) {
    struct linux_fault fault = {0};
    struct tcp_wire *net = NULL;
    const char *forced = getenv(PROCESSOR_VARIABLE);
    const char *what = processor_force(forced);
    if (what != NULL) {
        return complain((struct linux_fault){.where = PROCESSOR_VARIABLE,
                                             .value = forced,
                                             .what = what,
                                             .next = processor_allowed()},
                        2);
    }
    if (!linux_options_read(argv + 1, options, &fault))
        return complain(fault, 2);
    board->source.random = tcp_random;
    if (options->wires_count > 0 && options->memory > options->stack)
        start_alone(options, linux_board, &board->source, argv);
    const char *why = take_memory(board, options, &net);
    if (why != NULL) {
        return complain((struct linux_fault){.where = "--memory",
                                             .what = why,
                                             .next = "give another"},
                        4);
    }
    linux_board->links_count = options->links_count + options->wires_count;
    linux_board->awake_us = options->awake;
    if (options->wires_count > 0 &&
        !open_wires(linux_board, options, &board->source, net, &fault))
        return complain(fault, 2);
    for (unsigned i = 0; i < options->links_count; i++)
        linux_wire_inherit(&linux_board->wire[i], options->links[i]);
    fill_in(board, linux_board);
    if (options->node == LINUX_UNNAMED)
        learn(board, options);
    name_wires(linux_board, options);
    board->identity = identity_of(options);
    return 0;
}

int main(int argc, char **argv) {
    static struct linux_options options = {
        .node = LINUX_UNNAMED, .stack = 65536, .memory = 4u << 20};
    static struct linux_board linux_board;
    static struct node_board board;
    const char *why = NULL;
    /* Without this a restarted node would be listed by its file's name in
     * /proc. */
    (void)prctl(PR_SET_NAME, "incode-node");
    if (argc == 2 && linux_options_answer(argv[1]))
        return 0;
    int status = prepare(argv, &options, &linux_board, &board);
    if (status != 0)
        return status;
    struct node *node = node_start(&board, &why);
    if (node == NULL) {
        return complain((struct linux_fault){.where = "this node",
                                             .what = why,
                                             .next = "see incode-node --help"},
                        4);
    }
    enum node_reset why_it_ends = node_run(node);
    board.reset(board.context, (int)why_it_ends);
}
