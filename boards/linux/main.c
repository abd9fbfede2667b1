/* A node as a process of Linux.  Its straps are arguments, its links are
 * connected sockets or open terminals that it inherits, its arena is one
 * mapping made at start: arena, .data, .bss and stack together are --memory.
 * The one who starts it sets RLIMIT_DATA and RLIMIT_STACK, so that the kernel
 * holds it to that.
 *
 *     incode-node --node 3 --dimension 3 --memory 4194304 --stack 65536 \
 *                 --window 8 --epoch 17 --links 5,6,7
 */
#include <link.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "../../node/node.h"
#include "wire.h"

enum { PAGE = 4096, SANITIZED_STATIC = 8192 };

struct straps {
    uint64_t node, dimension, memory, stack, window, epoch;
    int links[CUBE_LINKS_MAX];
    unsigned links_count;
};

struct linux_board {
    struct linux_wire wire[CUBE_LINKS_MAX];
    unsigned links_count;
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

static bool read_straps(char **argv, struct straps *straps)
{
    const struct {
        const char *name;
        uint64_t *value;
    } known[] = {
        {"--node", &straps->node},     {"--dimension", &straps->dimension},
        {"--memory", &straps->memory}, {"--stack", &straps->stack},
        {"--window", &straps->window}, {"--epoch", &straps->epoch}};
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
        }
        if (!good) {
            return false;
        }
    }
    return argv[0] == NULL && straps->dimension <= CUBE_DIMENSION_MAX &&
           straps->node < UINT64_C(1) << straps->dimension &&
           straps->links_count ==
               straps->dimension + (straps->node == 0 ? 1 : 0);
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

static void reset(void *context, int status)
{
    (void)context;
    _exit(status);
}

int main(int argc, char **argv)
{
    static struct straps straps = {.stack = 65536};
    static struct linux_board linux_board;
    static struct node_board board;
    const char *why = NULL;
    (void)argc;
    if (!read_straps(argv + 1, &straps)) {
        complain("wrong straps; it is incode that starts its nodes");
        return 2;
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
    board.arena = mmap(NULL, board.arena_bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (board.arena == MAP_FAILED) {
        complain("the kernel does not grant --memory; is it limited?");
        return 4;
    }
    linux_board.links_count = straps.links_count;
    for (unsigned i = 0; i < straps.links_count; i++) {
        linux_wire_inherit(&linux_board.wire[i], straps.links[i]);
        board.pipes[i] = linux_wire_pipe(&linux_board.wire[i]);
    }
    board.context = &linux_board;
    board.identity.self = (uint16_t)straps.node;
    board.identity.dimension = (uint8_t)straps.dimension;
    board.identity.window = (uint8_t)straps.window;
    board.identity.epoch = (uint32_t)straps.epoch;
    board.now_us = now_us;
    board.busy_us = busy_us;
    board.idle = idle;
    board.reset = reset;
    struct node *node = node_start(&board, &why);
    if (node == NULL) {
        complain(why);
        return 4;
    }
    node_run(node);
    board.reset(board.context, 0);
}
