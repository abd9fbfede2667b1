#include <stdio.h>

#include "arguments_parts.h"

bool host_arguments_given(const struct host_arguments *p, int key) {
    return (p->given >> (key - KEY_STRATEGY) & 1) != 0;
}

/* What a bare board settles: the wires, the memory, the most nodes. */
static int settle_bare(const struct host_arguments *p) {
    struct host_run_options *o = p->options;
    unsigned most = host_bare_nodes_max(o->board->bare);
    if (o->nodes > most) {
        return host_fail(p->error, HOST_USAGE,
                         "--nodes %u: %s has UARTs for a cube of %u; give %u "
                         "or fewer",
                         o->nodes, o->board->name, most, most);
    }
    if (o->memory != HOST_BOARD_MEMORY) {
        return host_fail(p->error, HOST_USAGE,
                         "--memory: %s has 4M, no more and no less; leave it "
                         "out",
                         o->board->name);
    }
    o->link = host_link_named("uart");
    o->wire_bytes_s = HOST_BARE_WIRE_BYTES;
    return 0;
}

int host_arguments_together(const struct host_arguments *p) {
    const struct host_run_options *o = p->options;
    bool cube = o->cube != NULL, bare = !cube && o->board->bare != NULL;
    bool ranks = !cube && !bare && o->link->ranks;
    unsigned heeds = o->strategy == NULL ? 0 : o->strategy->sharing;
    const struct {
        int key;
        bool vain;
        const char *why;
    } options[] = {
        {KEY_MEMORY, cube, "--memory: the cube file of --cube says it"},
        {KEY_LINK, cube, "--link: the cube file of --cube says it"},
        {KEY_BOARD, cube, "--board: the cube file of --cube says it"},
        {KEY_WINDOW, cube, "--window: the cube file of --cube says it"},
        {KEY_LINK, bare, "--link: this board's wires are its UARTs"},
        {KEY_WINDOW, bare, "--window: this board's firmware settles it"},
        {KEY_NODE_PROGRAM, bare, "--node-program: this board has firmware"},
        {KEY_BOARD_RESET, !bare, "--board-reset: goes with emulated boards"},
        {KEY_BOARD_STOP, !bare, "--board-stop: goes with emulated boards"},
        {KEY_BOARD_KILL, !bare, "--board-kill: goes with emulated boards"},
        {KEY_HOST_UNPLUG, cube || !o->link->terminals,
         "--host-unplug: goes with --link serial alone"},
        {KEY_NODE_PROGRAM, ranks, "--node-program: not with --link mpi"},
        {KEY_HOST_RATE_TIME, !host_arguments_given(p, KEY_HOST_RATE),
         "--host-rate-time: goes with --host-rate alone"},
        {KEY_SEED, !host_arguments_given(p, KEY_HOST_STALL),
         "--seed: goes with --host-stall alone"},
        {KEY_PROGRESS, o->quiet, "--progress: -q prints none"},
        {KEY_EXPLAIN, o->quiet, "--explain: -q prints nothing"},
        {KEY_EXPLAIN, o->strategy != NULL,
         "--explain: goes with --strategy auto alone"},
        {KEY_LINDA, o->strategy == NULL || o->strategy->linda == NULL,
         "--linda: goes with --strategy linda alone"},
        {KEY_CLUSTER, (heeds & HOST_SHARING_CLUSTER) == 0,
         "--cluster: goes with a strategy of clusters alone, as hybrid"},
        {KEY_BUILDERS, (heeds & HOST_SHARING_BUILDERS) == 0,
         "--builders: goes with strategies that lend lists of faces"},
        {KEY_FACES_PER_JOB, (heeds & HOST_SHARING_LISTS) == 0,
         "--faces-per-job: goes with strategies that lend lists of faces"},
        {KEY_JOBS_PER_WORKER, (heeds & HOST_SHARING_LISTS) == 0,
         "--jobs-per-worker: goes with strategies that lend lists of faces"}};
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        if (options[i].vain && host_arguments_given(p, options[i].key)) {
            return host_fail(p->error, HOST_USAGE, "%s; leave it out",
                             options[i].why);
        }
    }
    return bare ? settle_bare(p) : 0;
}
