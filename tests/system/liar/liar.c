/* A node program of Linux, one of whose nodes lies (host/sim/liar.h): which,
 * and how, stands in the file that is named as the program and `.lie`, as a
 * node that a host starts has no environment:
 *
 *     NODE WAY ONE-IN SEED
 *
 * Each message with lies adds a line to `.told`: how many they were.  Linked
 * with --wrap=node_start. */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "host/sim/liar.h"
#include "node/node.h"
#include "transport/drivers/sim.h"

static struct host_liar liar;
static int told = -1;

static int lie(void *context, struct node_counted *counted, uint16_t dest,
               uint8_t type, const void *data, size_t size) {
    uint64_t before = liar.told;
    int status = host_liar_write(&liar, counted, dest, type, data, size);
    (void)context;
    if (liar.told > before) {
        dprintf(told, "%s %llu %u\n", host_lies[liar.way],
                (unsigned long long)(liar.told - before), type);
    }
    return status;
}

static _Noreturn void give_up(const char *what) {
    (void)!write(STDERR_FILENO, what, strlen(what));
    _exit(2);
}

/* The file that stands beside the program. */
static int open_beside(const char *extension, int flags) {
    char path[4096];
    ssize_t size =
        readlink("/proc/self/exe", path, sizeof path - strlen(extension) - 1);
    if (size <= 0)
        give_up("incode-node-liar: no /proc/self/exe\n");
    strcpy(path + size, extension);
    return open(path, flags | O_CLOEXEC, 0600);
}

/* The liar as the file has it; its node. */
static unsigned long read_orders(void) {
    char text[256], *at = text, *way;
    int file = open_beside(".lie", O_RDONLY);
    ssize_t size = file < 0 ? -1 : read(file, text, sizeof text - 1);
    if (size <= 0)
        give_up("incode-node-liar: no orders beside it\n");
    close(file);
    text[size > 0 ? size : 0] = '\0';
    unsigned long node = strtoul(at, &at, 10);
    way = strtok_r(at, " \n", &at);
    while (liar.way < HOST_LIES &&
           (way == NULL || strcmp(way, host_lies[liar.way]) != 0))
        liar.way++;
    liar.one_in = (uint32_t)strtoul(at, &at, 10);
    liar.random = sim_seed(strtoul(at, &at, 10), node);
    if (liar.way == HOST_LIES || liar.one_in == 0)
        give_up("incode-node-liar: orders are NODE WAY ONE-IN SEED\n");
    return node;
}

struct node *__real_node_start(const struct node_board *board,
                               const char **why);
struct node *__wrap_node_start(const struct node_board *board,
                               const char **why);

struct node *__wrap_node_start(const struct node_board *board,
                               const char **why) {
    static struct node_board lying;
    lying = *board;
    if (read_orders() == board->identity.self) {
        told = open_beside(".told", O_WRONLY | O_CREAT | O_APPEND);
        lying.write = lie;
    }
    return __real_node_start(&lying, why);
}
