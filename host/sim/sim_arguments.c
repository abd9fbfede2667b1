#include <string.h>

#include "host/base/options.h"
#include "host/base/text.h"
#include "host/service/machine.h"
#include "sim.h"

enum { KEY_SEED = 256, KEY_SEEDS, KEY_NODES, KEY_SECONDS };

struct parse_sim {
    struct host_sim_options *options;
    struct host_error *error;
};

static void add_range(struct parse_sim *p, uint64_t first, uint64_t last) {
    struct host_sim_options *o = p->options;
    if (o->ranges == HOST_SIM_RANGES_MAX) {
        host_fail(p->error, HOST_USAGE,
                  "--seed: more than %d of --seed and --seeds; give a range",
                  HOST_SIM_RANGES_MAX);
        return;
    }
    o->range[o->ranges].first = first;
    o->range[o->ranges++].last = last;
}

/* A..B, both included. */
static void parse_seeds(struct parse_sim *p, const char *value) {
    uint64_t first_seed = 0, last_seed = 0;
    char first[32] = "";
    const char *dots = strstr(value, "..");
    size_t length = dots == NULL ? sizeof first : (size_t)(dots - value);
    if (length < sizeof first) {
        memcpy(first, value, length);
    }
    if (dots == NULL ||
        host_parse_number(first, 0, UINT64_MAX, &first_seed) != 0 ||
        host_parse_number(dots + 2, first_seed, UINT64_MAX, &last_seed) != 0) {
        host_fail(p->error, HOST_USAGE,
                  "--seeds %s: not a range of seeds; give A..B, as in 1..1000",
                  value);
        return;
    }
    add_range(p, first_seed, last_seed);
}

static error_t parse_sim_option(int key, char *value,
                                struct argp_state *state) {
    struct parse_sim *p = state->input;
    uint64_t n = 0;
    switch (key) {
    case ARGP_KEY_ARG:
        host_fail(p->error, HOST_USAGE,
                  "%s: sim takes options alone; see incode sim --help", value);
        return 0;
    case KEY_SEED:
        if (host_option_number("seed", value, 0, UINT64_MAX, &n, p->error) ==
            0) {
            add_range(p, n, n);
        }
        return 0;
    case KEY_SEEDS:
        parse_seeds(p, value);
        return 0;
    case KEY_SECONDS:
        (void)host_option_number("seconds", value, 1, 1000000,
                                 &p->options->seconds_max, p->error);
        return 0;
    case KEY_NODES:
        (void)host_parse_nodes("--nodes", value, HOST_NODES_MAX, "",
                               &p->options->nodes, p->error);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

int host_sim_arguments(int argc, char **argv, struct host_sim_options *options,
                       struct host_error *error) {
    static const struct argp_option options_of_sim[] = {
        {"seed", KEY_SEED, "S", 0,
         "Run seed S, which may be given more than once. Default: 1", 0},
        {"seeds", KEY_SEEDS, "A..B", 0, "Run seeds A to B, and print totals",
         0},
        {"nodes", KEY_NODES, "N", 0,
         "Nodes of the cube: 1, 2, 4 .. 1024. Default: the seed decides", 0},
        {"seconds", KEY_SECONDS, "T", 0,
         "Begin no seed after T seconds of processor time", 0},
        {0}};
    static const struct argp argp = {
        options_of_sim,
        parse_sim_option,
        "",
        "Runs a whole cube - host, nodes and links as they are - in one "
        "process in virtual time.  The seed decides on points, cube, wires and "
        "faults: "
        "lost and damaged frames, stalls, closed wires, partitions, pauses, "
        "crashes, idle nodes, small memories, a slow host, a node that lies.  "
        "Then the faults "
        "stop, and the "
        "result must be the right one; of a node that lies, the run may also "
        "give up if it names it.  Each seed prints what struck while "
        "work was open; a failure prints the command that replays it.\v"
        "Examples:\n"
        "  incode sim --seed 17\n"
        "  incode sim --seed 17 --seed 34\n"
        "  incode sim --seeds 1..1000\n"
        "  incode sim --seeds 1..20 --nodes 64\n\n"
        "Exit status: 0 every result right, 1 something was left behind or the "
        "program failed, 2 wrong usage, 4 a run did not end or a node failed, "
        "5 a wrong result.",
        NULL,
        NULL,
        NULL};
    struct parse_sim parse = {options, error};
    memset(options, 0, sizeof *options);
    int status = host_options_parse(&argp, argc, argv, 0, &parse, error);
    if (status == 0 && options->ranges == 0) {
        add_range(&parse, 1, 1);
    }
    return status;
}
