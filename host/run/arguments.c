#include "arguments.h"

#include <argp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/options.h"
#include "host/base/text.h"
#include "host/formats/formats.h"
#include "host/mesh/points.h"
#include "host/service/strategies/strategies.h"
#include "incode/paper/builder.h"

static const struct argp_option options_of_run[] = {
    {NULL, 0, NULL, 0, "What to compute, and where:", 1},
    {"output", 'o', "FILE", 0,
     "Write the tetrahedra to FILE, by its extension: %s; - is .ele on "
     "standard output. May be given several times; all files get their names "
     "at the end of a run that succeeds, or none does",
     1},
    {"format", KEY_FORMAT, "NAME", 0,
     "What POINTS holds, where no extension tells, as with a pipe: that of %s, "
     "and .gz behind it",
     1},
    {"threads", KEY_THREADS, "N", 0,
     "Threads that triangulate in this process, where no other option speaks "
     "of a cube. Default: one a processor",
     1},
    {NULL, 0, NULL, 0, "A cube of nodes instead of threads:", 2},
    {"strategy", KEY_STRATEGY, "NAME", 0, "How the work is shared out:", 2},
    {"partition", KEY_PARTITION, "NAME", 0,
     "Regions of equal counts (adaptive, the default) or equal cells "
     "(uniform)",
     2},
    {"index", KEY_INDEX, "NAME", 0,
     "How a node searches: naive (all points), grid (the paper's uniform "
     "grid) or kd, the default",
     2},
    {"face-rule", KEY_FACE_RULE, "NAME", 0,
     "Faces pursued by a region: those with a vertex of its own (own, the "
     "default) or at least partly inside it (paper)",
     2},
    {"build", KEY_BUILD, "NAME", 0,
     "How a node finds tetrahedra: by faces (InCoDe); by points inserted brick "
     "after brick, as long as what is not final fits in its memory; or auto, "
     "the default: by points where it has some of a surface, or all bricks of "
     "a volume, that fits. Other indexes than kd, the face rule paper, and "
     "other strategies than sequential, spatial and linda-spatial go by faces",
     2},
    {"nodes", KEY_NODES, "N", 0,
     "Nodes of the cube: 1, 2, 4 .. 64. Default: what suits this machine", 2},
    {"linda", KEY_LINDA, "NAME", 0,
     "Of --strategy linda: master-slaves (the default) or spatial", 2},
    {"cluster", KEY_CLUSTER, "N", 0,
     "Nodes of a cluster in hybrid, a power of two. Default: 4", 2},
    {"builders", KEY_BUILDERS, "N", 0,
     "Tetrahedron builders of each face manager. Default: all other nodes, of "
     "hybrid those of its cluster",
     2},
    {"faces-per-job", KEY_FACES_PER_JOB, "M", 0,
     "Faces that a face manager sends a builder at a time, 1 .. 96. Default: "
     "the number of nodes that share its list; of linda 30",
     2},
    {"jobs-per-worker", KEY_JOBS_PER_WORKER, "N", 0,
     "Such lists that a builder may have at a time, 1 .. 16. Default: 2; of "
     "linda 3",
     2},
    {"memory", KEY_MEMORY, "BYTES", 0,
     "Data memory of a node, stack included: 640K .. 1G; a small cube does "
     "with less, and an error says with how much. Default: 4M",
     2},
    {"link", KEY_LINK, "NAME", 0, "Wires between nodes:", 2},
    {"board", KEY_BOARD, "NAME", 0, "What a node runs on:", 2},
    {"patience", KEY_PATIENCE, "SECONDS", 0,
     "Give up a node that shows no progress for so long: start it again, or go "
     "on without it. Default: 60",
     2},
    {"cube", KEY_CUBE, "FILE", 0,
     "Run on the nodes that FILE describes, over the wires that it names; see "
     "README.md",
     2},
    {NULL, 0, NULL, 0, "What to report:", 3},
    {"verify", KEY_VERIFY, NULL, 0,
     "Check exactly that the result is the Delaunay triangulation; without it "
     "only that it is a triangulation. Default: with --cube, and after a loss",
     3},
    {"no-verify", KEY_NO_VERIFY, NULL, 0, "Leave the exact check out", 3},
    {"stats", KEY_STATS, "FILE", 0, "Write statistics as JSON; - is stdout", 3},
    {"table", KEY_TABLE, NULL, 0,
     "Run on one node too, and print the columns of the paper's Table 2", 3},
    {"map", KEY_MAP, NULL, 0, "Print the memory map of a node", 3},
    {"explain", KEY_EXPLAIN, NULL, 0,
     "Say why --strategy auto took the strategy that it took", 3},
    {"quiet", 'q', NULL, 0, "Print nothing but errors", 3},
    {"progress", KEY_PROGRESS, NULL, 0,
     "Without a terminal, too: a line of progress every three seconds", 3},
    {"no-progress", KEY_NO_PROGRESS, NULL, 0,
     "No line of progress on a terminal", 3},
    {NULL, 0, NULL, 0, "Testing:", 4},
    {"window", KEY_WINDOW, "FRAMES", 0,
     "Frames a link and direction, 1 .. 64. Default: by memory", 4},
    {"shuffle-seed", KEY_SHUFFLE_SEED, "N", 0,
     "Make arriving pages ready in a random order", 4},
    {"host-stall", KEY_HOST_STALL, "MS", 0,
     "The host sleeps up to MS milliseconds at random", 4},
    {"host-rate", KEY_HOST_RATE, "BYTES", 0, "The host reads BYTES a second ..",
     4},
    {"host-rate-time", KEY_HOST_RATE_TIME, "S", 0,
     ".. for its first S seconds. Default: 30", 4},
    {"host-unplug", KEY_HOST_UNPLUG, "MS", 0,
     "The host closes its serial wire every MS milliseconds, for half a second",
     4},
    {"board-reset", KEY_BOARD_RESET, "MS", 0,
     "One emulated board after the other, each once, is reset every MS "
     "milliseconds,",
     4},
    {"board-stop", KEY_BOARD_STOP, "MS", 0, "stopped for half of them,", 4},
    {"board-kill", KEY_BOARD_KILL, "MS", 0, "or killed", 4},
    {"seed", KEY_SEED, "N", 0, "Seed of --host-stall", 4},
    {"node-program", KEY_NODE_PROGRAM, "FILE", 0,
     "Start FILE for a node instead of incode-node", 4},
    {0}};

static bool host_arguments_given(const struct host_arguments *p, int key);

static int of_cube(const struct host_arguments *p) {
    for (int key = KEY_STRATEGY; key < KEY_THREADS; key++)
        if (host_arguments_given(p, key))
            return key;
    return 0;
}

static const char *option_name(int key) {
    const struct argp_option *o = options_of_run;
    while (o->key != key)
        o++;
    return o->name;
}

static int check_threads(const struct host_arguments *p) {
    int key = of_cube(p);
    return key == 0 || !host_arguments_given(p, KEY_THREADS)
               ? 0
               : host_fail(p->error, HOST_USAGE,
                           "--threads: are of this process, and --%s speaks of "
                           "a cube of nodes; leave one of the two out",
                           option_name(key));
}

typedef const char *row_name(unsigned i);

static const char *name_at(const void *context, unsigned i) {
    return (*(row_name *const *)context)(i);
}

/* Which of the rows that `name` gives, up to NULL, `value` is, or -1 with the
 * error: what is allowed. */
static int choose(struct host_arguments *p, const char *option,
                  const char *value, row_name *name) {
    char allowed[sizeof p->error->text] = "";
    size_t used = 0;
    for (unsigned i = 0; name(i) != NULL; i++) {
        if (strcmp(value, name(i)) == 0)
            return (int)i;
        if (used < sizeof allowed) { /* what the error has room for */
            used += (size_t)snprintf(allowed + used, sizeof allowed - used,
                                     "%s%s", i == 0 ? "" : ", ", name(i));
        }
    }
    const char *nearest = host_text_nearest(value, name_at, &name);
    host_fail(p->error, HOST_USAGE, "--%s %s: no such name; %s%s%sallowed: %s",
              option, value, nearest == NULL ? "" : "did you mean ",
              nearest == NULL ? "" : nearest, nearest == NULL ? "" : "? ",
              allowed);
    return -1;
}

static const char *partition_name(unsigned i) {
    return host_partitions[i];
}

static const char *index_name(unsigned i) {
    return host_indexes[i];
}

static const char *build_name(unsigned i) {
    return host_builds[i];
}

static const char *face_rule_name(unsigned i) {
    return host_face_rules[i];
}

static void parse_memory(struct host_arguments *p, const char *value) {
    uint64_t *bytes = &p->options->memory;
    if (host_parse_bytes(value, bytes) != 0 || *bytes < HOST_MEMORY_MIN ||
        *bytes > HOST_MEMORY_MAX) {
        host_fail(p->error, HOST_USAGE,
                  "--memory %s: not a size of memory that is allowed; give "
                  "640K to 1G, as in 4M, or less to a small cube",
                  value);
    }
    *bytes = *bytes / 4096 * 4096;
}

static void parse_output(struct host_arguments *p, const char *value) {
    if (p->options->outputs == HOST_OUTPUTS_MAX) {
        host_fail(p->error, HOST_USAGE,
                  "-o %s: more than %d outputs; use "
                  "incode convert for the others",
                  value, HOST_OUTPUTS_MAX);
        return;
    }
    p->options->output[p->options->outputs++] = value;
}

static bool parse_names(int key, const char *value, struct host_arguments *p) {
    struct host_run_options *o = p->options;
    switch (key) {
    case KEY_STRATEGY:
        o->strategy = host_strategy_row(
            (unsigned)choose(p, "strategy", value, host_strategy_name));
        return true;
    case KEY_PARTITION:
        o->partition =
            (enum host_partition)choose(p, "partition", value, partition_name);
        return true;
    case KEY_INDEX:
        o->index = (enum incode_index)choose(p, "index", value, index_name);
        return true;
    case KEY_FACE_RULE:
        o->face_rule = (enum incode_face_rule)choose(p, "face-rule", value,
                                                     face_rule_name);
        return true;
    case KEY_BUILD:
        o->build = (enum incode_build)choose(p, "build", value, build_name);
        return true;
    case KEY_LINK:
        o->link =
            host_link_row((unsigned)choose(p, "link", value, host_link_name));
        return true;
    case KEY_LINDA:
        p->linda = (unsigned)choose(p, "linda", value, host_linda_name);
        return true;
    case KEY_BOARD:
        o->board = host_board_row(
            (unsigned)choose(p, "board", value, host_board_name));
        return true;
    default:
        return false;
    }
}

/* How a strategy shares the work: keys from KEY_CLUSTER on. */
static bool parse_sharing(int key, const char *value,
                          struct host_arguments *p) {
    struct host_sharing *s = &p->options->sharing;
    const struct {
        const char *name;
        unsigned *into;
        uint64_t min, max;
    } row[] = {{"cluster", &s->cluster, 2, HOST_NODES_MAX},
               {"builders", &s->builders, 1, NODE_BUILDERS_MAX},
               {"faces-per-job", &s->faces_per_job, 1, INCODE_LIST_MAX},
               {"jobs-per-worker", &s->jobs_per_worker, 1, INCODE_LISTS_MAX}};
    int i = key - KEY_CLUSTER;
    uint64_t n = 0;
    if (i < 0 || i >= (int)(sizeof row / sizeof row[0]))
        return false;
    (void)host_option_number(row[i].name, value, row[i].min, row[i].max, &n,
                             p->error);
    *row[i].into = (unsigned)n;
    return true;
}

static bool parse_testing(int key, const char *value,
                          struct host_arguments *p) {
    struct host_run_options *o = p->options;
    uint64_t n = 0;
    switch (key) {
    case KEY_WINDOW:
        (void)host_option_number("window", value, 1, LINK_WINDOW_MAX, &n,
                                 p->error);
        o->window = (unsigned)n;
        return true;
    case KEY_SHUFFLE_SEED:
        (void)host_option_number("shuffle-seed", value, 0, UINT64_MAX,
                                 &o->shuffle_seed, p->error);
        return true;
    case KEY_HOST_STALL:
        (void)host_option_number("host-stall", value, 0, 60000, &n, p->error);
        o->throttle.stall_us_max = 1000 * n;
        return true;
    case KEY_HOST_RATE:
        (void)host_option_number("host-rate", value, 1, 1000000000,
                                 &o->throttle.bytes_a_second, p->error);
        return true;
    case KEY_HOST_RATE_TIME:
        (void)host_option_number("host-rate-time", value, 0, 86400, &n,
                                 p->error);
        o->throttle.slow_us = 1000000 * n;
        return true;
    case KEY_HOST_UNPLUG:
        (void)host_option_number("host-unplug", value, 50, 86400000, &n,
                                 p->error);
        o->unplug_us = 1000 * n;
        return true;
    case KEY_BOARD_RESET:
    case KEY_BOARD_STOP:
    case KEY_BOARD_KILL:
        (void)host_option_number("board-reset, -stop, -kill", value, 10,
                                 86400000, &n, p->error);
        o->trouble.every_us[key - KEY_BOARD_RESET] = 1000 * n;
        return true;
    case KEY_SEED:
        (void)host_option_number("seed", value, 0, UINT64_MAX,
                                 &o->throttle.seed, p->error);
        return true;
    case KEY_NODE_PROGRAM:
        o->node_program = value;
        return true;
    default:
        return false;
    }
}

static error_t parse_report(int key, const char *value,
                            struct host_arguments *p) {
    struct host_run_options *o = p->options;
    switch (key) {
    case KEY_VERIFY:
        o->verifying = HOST_VERIFY_ALWAYS;
        return 0;
    case KEY_NO_VERIFY:
        o->verifying = HOST_VERIFY_NEVER;
        return 0;
    case KEY_STATS:
        o->stats = value;
        return 0;
    case KEY_TABLE:
        o->table = true;
        return 0;
    case KEY_MAP:
        o->map = true;
        return 0;
    case 'q':
        o->quiet = true;
        return 0;
    case KEY_EXPLAIN:
        o->explain = true;
        return 0;
    case KEY_PROGRESS:
    case KEY_NO_PROGRESS:
        o->progress = o->anywhere = key == KEY_PROGRESS;
        return 0;
    case ARGP_KEY_ARG:
        if (o->input != NULL) {
            bool output = host_format_of(value, HOST_WRITE_TETRAHEDRA) != NULL;
            host_fail(p->error, HOST_USAGE,
                      "%s: a second file of points after %s; give one%s%s",
                      value, o->input, output ? ", and an output as -o " : "",
                      output ? value : "");
        }
        o->input = value;
        return 0;
    case ARGP_KEY_END:
        if (o->input == NULL) {
            host_fail(
                p->error, HOST_USAGE,
                "POINTS: not given; name a file, or - for standard input");
        }
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static error_t parse_option(int key, char *value, struct argp_state *state) {
    struct host_arguments *p = state->input;
    uint64_t n = 0;
    if (key >= KEY_STRATEGY && key < KEY_END)
        p->given |= UINT64_C(1) << (key - KEY_STRATEGY);
    if (parse_names(key, value, p) || parse_sharing(key, value, p) ||
        parse_testing(key, value, p))
        return 0;
    switch (key) {
    case 'o':
        parse_output(p, value);
        return 0;
    case KEY_NODES:
        (void)host_parse_nodes("--nodes", value, HOST_PROCESSES_MAX,
                               ", or with --cube what its file says",
                               &p->options->nodes, p->error);
        return 0;
    case KEY_MEMORY:
        parse_memory(p, value);
        return 0;
    case KEY_THREADS:
        (void)host_option_number("threads", value, 1, HOST_THREADS_MAX, &n,
                                 p->error);
        p->options->threads = (unsigned)n;
        return 0;
    case KEY_PATIENCE:
        (void)host_option_number("patience", value, 1, 86400,
                                 &p->options->patience_s, p->error);
        return 0;
    case KEY_FORMAT:
        p->options->format = value;
        (void)host_format_told(value, HOST_READ_POINTS, p->error);
        return 0;
    case KEY_CUBE:
        p->options->cube = value;
        return 0;
    default:
        return parse_report(key, value, p);
    }
}

static int host_arguments_together(const struct host_arguments *p);

static char *host_arguments_help(int key, const char *text, void *input);

/* flags: of argp_parse. */
static int parse_run(int argc, char **argv, unsigned flags,
                     struct host_run_options *options,
                     struct host_error *error) {
    static const struct argp argp = {
        options_of_run,
        parse_option,
        "POINTS",
        "Triangulates POINTS, and writes each output by its extension. The "
        "work is done by threads of this process or, where an option speaks of "
        "a cube, by nodes.\v"
        "POINTS: %s; .gz of any of them; - is .xyz from standard input. Of a "
        ".csv, .xyz or .txt whose first line names columns x, y and z, in any "
        "order and "
        "among others, these are taken; of other text, and of .npy, the first "
        "three columns.\n\n"
        "Examples:\n"
        "  incode run bunny.ply -o bunny.vtu\n"
        "  incode run points.xyz --nodes 8 --verify --stats run.json\n"
        "  incode run - -o - < points.xyz > tetrahedra.ele\n\n"
        "Exit status: 0 done, 1 the program failed, 2 wrong usage, 3 wrong "
        "input or an output that cannot be written, 4 cube, link or node "
        "failure, 5 a verification failed. A signal such as that of Ctrl-C "
        "ends it as a signal does (130 in a shell). Unless it is 0, no output "
        "has its name, and what had it before is as it was.",
        NULL,
        host_arguments_help,
        NULL};
    struct host_arguments parse = {options, error, 0, 0};
    host_run_defaults(options);
    int status = host_options_parse(&argp, argc, argv, flags, &parse, error);
    if (status != 0)
        return status;
    if (options->throttle.bytes_a_second != 0 && options->throttle.slow_us == 0)
        options->throttle.slow_us = 30000000;
    if (options->strategy != NULL && options->strategy->linda != NULL &&
        host_arguments_given(&parse, KEY_LINDA))
        options->strategy = host_strategy_linda(parse.linda);
    options->direct = of_cube(&parse) == 0;
    return check_threads(&parse) != 0 ? error->code
                                      : host_arguments_together(&parse);
}

int host_arguments_run(int argc, char **argv, struct host_run_options *options,
                       struct host_error *error) {
    return parse_run(argc, argv, 0, options, error);
}

int host_arguments_try(int argc, char **argv,
                       struct host_run_options *options) {
    struct host_error error = {0};
    return parse_run(argc, argv, ARGP_SILENT, options, &error);
}

/* --- arguments help ------------------------------------------------------- */

static const char *link_help(unsigned i) {
    return host_link_row(i)->help;
}

static const char *board_help(unsigned i) {
    return host_board_row(i)->help;
}

/* Option's help with the rows of the table that its values are from; usual: the
 * default's name. */
static char *list_rows(const char *text, const char *(*name)(unsigned i),
                       const char *(*help)(unsigned i), const char *usual) {
    size_t size = strlen(text) + 1;
    for (unsigned i = 0; name(i) != NULL; i++)
        size += strlen(name(i)) + strlen(help(i)) + sizeof " (; the default),";
    char *whole = malloc(size);
    size_t used = 0;
    if (whole == NULL)
        return NULL;
    used += (size_t)snprintf(whole, size, "%s", text);
    for (unsigned i = 0; name(i) != NULL; i++) {
        used += (size_t)snprintf(whole + used, size - used, "%s %s (%s%s)",
                                 i == 0 ? "" : ",", name(i), help(i),
                                 strcmp(name(i), usual) == 0 ? "; the default"
                                                             : "");
    }
    return whole;
}

/* `text` with the formats of a use, as `put` has them, in the place of its %s.
 */
static char *list_formats(const char *text, enum host_use use,
                          void (*put)(enum host_use use, char *text,
                                      size_t size)) {
    char list[HOST_FORMAT_LIST_MAX], *whole = NULL;
    const char *place = strstr(text, "%s");
    put(use, list, sizeof list);
    return asprintf(&whole, "%.*s%s%s", (int)(place - text), text, list,
                    place + strlen("%s")) < 0
               ? NULL
               : whole;
}

/* As argp asks for it: `text` itself, or what is to be freed. */
static char *host_arguments_help(int key, const char *text, void *input) {
    (void)input;
    switch (key) {
    case 'o':
        return list_formats(text, HOST_WRITE_TETRAHEDRA, host_format_help);
    case KEY_FORMAT:
        return list_formats(text, HOST_READ_POINTS, host_format_list);
    case ARGP_KEY_HELP_POST_DOC:
        return list_formats(text, HOST_READ_POINTS, host_format_help);
    case KEY_STRATEGY:
        return list_rows(text, host_strategy_name, host_strategy_help, "auto");
    case KEY_LINK:
        return list_rows(text, host_link_name, link_help, host_link_name(0));
    case KEY_BOARD:
        return list_rows(text, host_board_name, board_help, host_board_name(0));
    default:
        return (char *)text;
    }
}

/* --- arguments together --------------------------------------------------- */

/* Whether the option of a key from KEY_STRATEGY on was given. */
static bool host_arguments_given(const struct host_arguments *p, int key) {
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

/* 0, or HOST_USAGE: an option that would change nothing is a misunderstanding.
 * What a board settles is settled then. */
static int host_arguments_together(const struct host_arguments *p) {
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
