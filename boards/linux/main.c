/* A node as a process of Linux.  Its straps are arguments, its links are
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
 *                 --wire 0=listen:10.0.0.3:7001 --wire 1=call:10.0.0.1:7001
 *
 * Without --node and --dimension it waits until a neighbour says who it is.
 */
#include <fcntl.h>
#include <link.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "../../node/node.h"
#include "../../transport/learn.h"
#include "wire.h"

#define UNNAMED UINT64_MAX

enum { PAGE = 4096, SANITIZED_STATIC = 8192, KEY_DIGITS = 64 };

struct straps {
    uint64_t node, dimension, memory, stack, window, epoch, lines, host_wire,
        dead;
    int links[CUBE_LINKS_MAX];
    unsigned links_count;
    const char *wire[CUBE_LINKS_MAX]; /* that the node opens itself */
    unsigned wires_count;
    const char *key; /* a file */
};

struct linux_board {
    struct linux_wire wire[CUBE_LINKS_MAX];
    unsigned links_count;
    uint8_t key[SECURE_KEY_BYTES];
    char **again; /* arguments of the next start; NULL: there is none */
};

static void complain(const char *what)
{
    struct {
        const char *text;
    } parts[] = {{"incode-node: "}, {what}, {"\n"}};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        (void)!write(STDERR_FILENO, parts[i].text, strlen(parts[i].text));
    }
}

static bool read_number(const char **text, uint64_t *value)
{
    const char *at = *text;
    *value = 0;
    while (*at >= '0' && *at <= '9' && *value < UINT64_MAX / 100) {
        *value = 10 * *value + (uint64_t)(*at++ - '0');
    }
    bool good = at != *text;
    *text = at;
    return good;
}

static bool read_links(const char *text, struct straps *straps)
{
    uint64_t fd;
    while (*text != '\0') {
        if (straps->links_count == CUBE_LINKS_MAX || !read_number(&text, &fd) ||
            fd > INT16_MAX) {
            return false;
        }
        straps->links[straps->links_count++] = (int)fd;
        if (*text == ',') {
            text++;
        }
    }
    return true;
}

/* "2=call:10.0.0.1:7001" */
static bool read_wire(const char *text, struct straps *straps)
{
    uint64_t link;
    if (!read_number(&text, &link) || *text != '=' || link >= CUBE_LINKS_MAX ||
        straps->wire[link] != NULL) {
        return false;
    }
    straps->wire[link] = text + 1;
    straps->wires_count++;
    return true;
}

/* Every link has a wire, and there are no others. */
static bool wires_fit(const struct straps *straps)
{
    unsigned links = (unsigned)straps->dimension +
                     (straps->node == 0 || straps->host_wire != 0 ? 1 : 0);
    if (straps->node == UNNAMED) {
        links = straps->links_count + straps->wires_count;
        if (links == 0) {
            return false; /* nobody could say who it is */
        }
    }
    if (straps->wires_count == 0) {
        return straps->links_count == links;
    }
    for (unsigned i = 0; i < links; i++) {
        if (straps->wire[i] == NULL) {
            return false;
        }
    }
    return straps->links_count == 0 && straps->wires_count == links;
}

static bool read_straps(char **argv, struct straps *straps)
{
    const struct {
        const char *name;
        uint64_t *value;
    } known[] = {
        {"--node", &straps->node},     {"--dimension", &straps->dimension},
        {"--memory", &straps->memory}, {"--stack", &straps->stack},
        {"--window", &straps->window}, {"--epoch", &straps->epoch},
        {"--lines", &straps->lines},   {"--host-wire", &straps->host_wire},
        {"--dead", &straps->dead}};
    for (; argv[0] != NULL && argv[1] != NULL; argv += 2) {
        const char *text = argv[1];
        bool good = false;
        for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
            if (strcmp(argv[0], known[i].name) == 0) {
                good = read_number(&text, known[i].value) && *text == '\0';
            }
        }
        if (strcmp(argv[0], "--links") == 0) {
            good = read_links(text, straps);
        } else if (strcmp(argv[0], "--wire") == 0) {
            good = read_wire(text, straps);
        } else if (strcmp(argv[0], "--key") == 0) {
            straps->key = text;
            good = true;
        }
        if (!good) {
            return false;
        }
    }
    return argv[0] == NULL && straps->dimension <= CUBE_DIMENSION_MAX &&
           (straps->node == UNNAMED ||
            straps->node < UINT64_C(1) << straps->dimension) &&
           wires_fit(straps);
}

/* Adds the writable segments in whole pages, as the kernel counts them. */
static int add_segments(struct dl_phdr_info *info, size_t size, void *context)
{
    uint64_t *bytes = context;
    (void)size;
    for (unsigned i = 0; i < info->dlpi_phnum; i++) {
        const ElfW(Phdr) *header = &info->dlpi_phdr[i];
        if (header->p_type == PT_LOAD && (header->p_flags & PF_W) != 0) {
            uint64_t from = header->p_vaddr / PAGE * PAGE;
            uint64_t to = header->p_vaddr + header->p_memsz;
            *bytes += (to - from + PAGE - 1) / PAGE * PAGE;
        }
    }
    return 0;
}

/* Bytes of .data and .bss. */
static uint64_t static_bytes(void)
{
    uint64_t bytes = 0;
    (void)dl_iterate_phdr(add_segments, &bytes);
    return bytes;
}

static uint64_t clock_us(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

static uint64_t now_us(void *context)
{
    (void)context;
    return clock_us(CLOCK_MONOTONIC);
}

static uint64_t busy_us(void *context)
{
    (void)context;
    return clock_us(CLOCK_PROCESS_CPUTIME_ID);
}

static void idle(void *context, uint64_t wait_us)
{
    struct linux_board *board = context;
    linux_wires_idle(board->wire, board->links_count, wait_us);
}

/* A node that a user started begins anew, with an epoch of its own. */
static void reset(void *context, int status)
{
    const struct linux_board *board = context;
    if (status == 0 && board->again != NULL) {
        char *no_environment[] = {NULL};
        execve("/proc/self/exe", board->again, no_environment);
    }
    _exit(status);
}

/* 64 hexadecimal digits. */
static bool read_key(const char *path, uint8_t key[SECURE_KEY_BYTES])
{
    char text[KEY_DIGITS];
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    ssize_t got = fd < 0 ? -1 : read(fd, text, sizeof text);
    if (fd >= 0) {
        close(fd);
    }
    for (int i = 0; i < KEY_DIGITS && got == KEY_DIGITS; i++) {
        const char *digits = "0123456789abcdef", *at;
        at = text[i] == '\0' ? NULL : strchr(digits, text[i]);
        if (at == NULL) {
            return false;
        }
        key[i / 2] = (uint8_t)(key[i / 2] << 4 | (at - digits));
    }
    return got == KEY_DIGITS;
}

static const char *open_wires(struct linux_board *linux_board,
                              const struct straps *straps, struct tcp_wire *net)
{
    const uint8_t *key = NULL;
    if (straps->key != NULL) {
        if (!read_key(straps->key, linux_board->key)) {
            return "--key: not a file of 64 hexadecimal digits, as openssl "
                   "rand -hex 32 prints them";
        }
        key = linux_board->key;
    }
    for (unsigned i = 0; i < straps->wires_count; i++) {
        const char *told = NULL;
        const char *why = linux_wire_open(&linux_board->wire[i],
                                          straps->wire[i], key, &net[i], &told);
        if (why != NULL) {
            return why;
        }
        if (told != NULL) {
            complain(told);
        }
    }
    return NULL;
}

/* What the one who starts a node does otherwise. */
static void start_alone(struct straps *straps, struct linux_board *linux_board,
                        char **argv)
{
    uint32_t epoch = 0;
    linux_board->again = argv;
    while (straps->epoch == 0) {
        (void)getrandom(&epoch, sizeof epoch, 0);
        straps->epoch = epoch;
    }
#ifndef INCODE_SANITIZED
    struct rlimit stack = {straps->stack, straps->stack};
    struct rlimit data = {straps->memory - straps->stack,
                          straps->memory - straps->stack};
    (void)setrlimit(RLIMIT_STACK, &stack);
    (void)setrlimit(RLIMIT_DATA, &data);
#endif
}

/* Waits until a neighbour has said who this node is; NULL: as it has wires. */
static const char *learn(const struct node_board *board, struct straps *straps)
{
    static struct learner learner;
    struct linux_board *links = board->context;
    struct learned learned;
    learner_init(&learner, board->pipes, links->links_count);
    while (!learner_poll(&learner, &learned)) {
        idle(links, 50000);
    }
    straps->node = learned.self;
    straps->dimension = learned.dimension;
    straps->host_wire =
        learned.self != 0 && links->links_count > learned.dimension;
    unsigned count = learned.dimension +
                     (straps->node == 0 || straps->host_wire != 0 ? 1u : 0u);
    return count == links->links_count
               ? NULL
               : "its neighbour takes it for a node with another number of "
                 "wires; see incode cube FILE";
}

static struct node_identity identity_of(const struct straps *straps)
{
    struct node_identity id;
    memset(&id, 0, sizeof id);
    id.self = (uint16_t)straps->node;
    id.dimension = (uint8_t)straps->dimension;
    id.window = (uint8_t)straps->window;
    id.epoch = (uint32_t)straps->epoch;
    id.lines = straps->lines != 0;
    id.dead_us = (uint32_t)straps->dead;
    id.host_wire = straps->host_wire != 0;
    return id;
}

static void fill_in(struct node_board *board, struct linux_board *linux_board)
{
    for (unsigned i = 0; i < linux_board->links_count; i++) {
        board->pipes[i] = linux_wire_pipe(&linux_board->wire[i]);
    }
    board->context = linux_board;
    board->now_us = now_us;
    board->busy_us = busy_us;
    board->idle = idle;
    board->reset = reset;
}

int main(int argc, char **argv)
{
    static struct straps straps = {
        .node = UNNAMED, .stack = 65536, .memory = 4u << 20};
    static struct linux_board linux_board;
    static struct node_board board;
    const char *why = NULL;
    (void)argc;
    if (!read_straps(argv + 1, &straps)) {
        complain("wrong straps; incode cube FILE prints those of a cube");
        return 2;
    }
    if (straps.wires_count > 0) {
        start_alone(&straps, &linux_board, argv);
    }
    board.fixed_bytes = static_bytes() + straps.stack;
#ifdef INCODE_SANITIZED
    /* A sanitizer's own data is not a node's, and nothing limits it. */
    board.fixed_bytes = SANITIZED_STATIC + straps.stack;
#endif
    if (straps.memory < board.fixed_bytes + PAGE) {
        complain("--memory does not hold the program's own data");
        return 4;
    }
    board.arena_bytes = (straps.memory - board.fixed_bytes) / PAGE * PAGE;
    /* All of it at once: no page is to be found missing while others wait. */
    board.arena = mmap(NULL, board.arena_bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (board.arena == MAP_FAILED) {
        complain("the kernel does not grant --memory; is it limited?");
        return 4;
    }
    size_t net = straps.wires_count * sizeof(struct tcp_wire);
    net = (net + PAGE - 1) / PAGE * PAGE;
    if (board.arena_bytes <= net) {
        complain("--memory does not hold the wires");
        return 4;
    }
    board.arena_bytes -= net;
    board.fixed_bytes += net;
    linux_board.links_count = straps.links_count + straps.wires_count;
    if (straps.wires_count > 0) {
        why = open_wires(&linux_board, &straps,
                         (void *)((uint8_t *)board.arena + board.arena_bytes));
        if (why != NULL) {
            complain(why);
            return 2;
        }
    }
    for (unsigned i = 0; i < straps.links_count; i++) {
        linux_wire_inherit(&linux_board.wire[i], straps.links[i]);
    }
    fill_in(&board, &linux_board);
    why = straps.node == UNNAMED ? learn(&board, &straps) : NULL;
    if (why != NULL) {
        complain(why);
        return 2;
    }
    board.identity = identity_of(&straps);
    struct node *node = node_start(&board, &why);
    if (node == NULL) {
        complain(why);
        return 4;
    }
    node_run(node);
    board.reset(board.context, 0);
}
