#include "arguments.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/options.h"
#include "host/base/parse.h"
#include "host/base/text.h"
#include "host/formats/formats.h"
#include "host/order/names.h"
#include "host/service/strategies/strategies.h"
#include "incode/builder.h"

enum {
    KEY_STRATEGY = 256,
    KEY_PARTITION,
    KEY_INDEX,
    KEY_NODES,
    KEY_FACE_RULE,
    KEY_BUILD,
    KEY_LINK,
    KEY_BOARD,
    KEY_PATIENCE,
    KEY_CUBE,
    KEY_MEMORY,
    KEY_LINDA,
    KEY_CLUSTER,
    KEY_BUILDERS,
    KEY_FACES_PER_JOB,
    KEY_JOBS_PER_WORKER,
    KEY_STATS,
    KEY_VERIFY,
    KEY_NO_PROGRESS,
    KEY_TABLE,
    KEY_MAP,
    KEY_WINDOW,
    KEY_SHUFFLE_SEED,
    KEY_HOST_STALL,
    KEY_HOST_RATE,
    KEY_HOST_RATE_TIME,
    KEY_HOST_UNPLUG,
    KEY_SEED,
    KEY_NODE_PROGRAM,
    KEY_FORMAT,
    KEY_END
};

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
    {"strategy", KEY_STRATEGY, "NAME", 0, "How the work is shared out:", 1},
    {"partition", KEY_PARTITION, "NAME", 0,
     "Regions of equal counts (adaptive, the default) or equal cells "
     "(uniform)",
     1},
    {"index", KEY_INDEX, "NAME", 0,
     "How a node searches: naive (all points), grid (the paper's uniform "
     "grid) or kd, the default",
     1},
    {"face-rule", KEY_FACE_RULE, "NAME", 0,
     "Faces pursued by a region: those with a vertex of its own (own, the "
     "default) or at least partly inside it (paper)",
     1},
    {"build", KEY_BUILD, "NAME", 0,
     "How a node finds tetrahedra: by faces (InCoDe); by points inserted brick "
     "after brick, as long as what is not final fits in its memory; or auto, "
     "the default: by points where it has some of a surface, or all bricks of "
     "a volume, that fits. Other indexes than kd, the face rule paper, and "
     "other strategies than sequential, spatial and linda-spatial go by faces",
     1},
    {"nodes", KEY_NODES, "N", 0,
     "Nodes of the cube: 1, 2, 4 .. 64. Default: what suits this machine", 1},
    {"linda", KEY_LINDA, "NAME", 0,
     "Of --strategy linda: master-slaves (the default) or spatial", 1},
    {"cluster", KEY_CLUSTER, "N", 0,
     "Nodes of a cluster in hybrid, a power of two. Default: 4", 1},
    {"builders", KEY_BUILDERS, "N", 0,
     "Tetrahedron builders of each face manager. Default: all other nodes, of "
     "hybrid those of its cluster",
     1},
    {"faces-per-job", KEY_FACES_PER_JOB, "M", 0,
     "Faces that a face manager sends a builder at a time, 1 .. 96. Default: "
     "the number of nodes that share its list; of linda 30",
     1},
    {"jobs-per-worker", KEY_JOBS_PER_WORKER, "N", 0,
     "Such lists that a builder may have at a time, 1 .. 16. Default: 2; of "
     "linda 3",
     1},
    {"memory", KEY_MEMORY, "BYTES", 0,
     "Data memory of a node, stack included: 640K .. 1G; a small cube does "
     "with less, and an error says with how much. Default: 4M",
     1},
    {"link", KEY_LINK, "NAME", 0, "Wires between nodes:", 1},
    {"board", KEY_BOARD, "NAME", 0, "What a node runs on:", 1},
    {"patience", KEY_PATIENCE, "SECONDS", 0,
     "Give up a node that shows no progress for so long: start it again, or go "
     "on without it. Default: 60",
     1},
    {"cube", KEY_CUBE, "FILE", 0,
     "Run on the nodes that FILE describes, over the wires that it names; see "
     "README.md",
     1},
    {NULL, 0, NULL, 0, "What to report:", 2},
    {"verify", KEY_VERIFY, NULL, 0,
     "Check the result exactly before reporting success", 2},
    {"stats", KEY_STATS, "FILE", 0, "Write statistics as JSON; - is stdout", 2},
    {"table", KEY_TABLE, NULL, 0,
     "Run on one node too, and print the columns of the paper's Table 2", 2},
    {"map", KEY_MAP, NULL, 0, "Print the memory map of a node", 2},
    {"quiet", 'q', NULL, 0, "Print nothing but errors", 2},
    {"no-progress", KEY_NO_PROGRESS, NULL, 0,
     "No line of progress on a terminal", 2},
    {NULL, 0, NULL, 0, "Testing:", 3},
    {"window", KEY_WINDOW, "FRAMES", 0,
     "Frames a link and direction, 1 .. 64. Default: by memory", 3},
    {"shuffle-seed", KEY_SHUFFLE_SEED, "N", 0,
     "Make arriving pages ready in a random order", 3},
    {"host-stall", KEY_HOST_STALL, "MS", 0,
     "The host sleeps up to MS milliseconds at random", 3},
    {"host-rate", KEY_HOST_RATE, "BYTES", 0, "The host reads BYTES a second ..",
     3},
    {"host-rate-time", KEY_HOST_RATE_TIME, "S", 0,
     ".. for its first S seconds. Default: 30", 3},
    {"host-unplug", KEY_HOST_UNPLUG, "MS", 0,
     "The host closes its serial wire every MS milliseconds, for half a second",
     3},
    {"seed", KEY_SEED, "N", 0, "Seed of --host-stall", 3},
    {"node-program", KEY_NODE_PROGRAM, "FILE", 0,
     "Start FILE for a node instead of incode-node", 3},
    {0}};

struct parse {
    struct host_run_options *options;
    struct host_error *error;
    unsigned linda; /* of the rows of --linda */
    uint64_t given; /* bits of keys from KEY_STRATEGY on */
};

/* names: a list with a comma before and after each, or NULL. */
static bool is_among(const char *names, const char *name)
{
    size_t n = strlen(name);
    const char *at = names == NULL || n == 0 ? NULL : strstr(names, name);
    while (at != NULL && (at == names || at[-1] != ',' || at[n] != ',')) {
        at = strstr(at + 1, name);
    }
    return at != NULL;
}

typedef const char *row_name(unsigned i);

static const char *name_at(const void *context, unsigned i)
{
    return (*(row_name *const *)context)(i);
}

/* Which of the rows that `name` gives, up to NULL, `value` is, or -1 with the
 * error: what is allowed, and what other versions have (later). */
static int choose(struct parse *p, const char *option, const char *value,
                  row_name *name, const char *later)
{
    char allowed[sizeof p->error->text] = "";
    size_t used = 0;
    for (unsigned i = 0; name(i) != NULL; i++) {
        if (strcmp(value, name(i)) == 0) {
            return (int)i;
        }
        if (used < sizeof allowed) { /* what the error has room for */
            used += (size_t)snprintf(allowed + used, sizeof allowed - used,
                                     "%s%s", i == 0 ? "" : ", ", name(i));
        }
    }
    const char *nearest = host_text_nearest(value, name_at, &name);
    bool elsewhere = is_among(later, value);
    host_fail(p->error, HOST_USAGE, "--%s %s: %s; %s%s%sallowed: %s", option,
              value, elsewhere ? "not in this version" : "no such name",
              elsewhere || nearest == NULL ? "" : "did you mean ",
              elsewhere || nearest == NULL ? "" : nearest,
              elsewhere || nearest == NULL ? "" : "? ", allowed);
    return -1;
}

static const char *partition_name(unsigned i)
{
    return host_partitions[i];
}

static const char *index_name(unsigned i)
{
    return host_indexes[i];
}

static const char *build_name(unsigned i)
{
    return host_builds[i];
}

static const char *face_rule_name(unsigned i)
{
    return host_face_rules[i];
}

static int number(struct parse *p, const char *option, const char *value,
                  uint64_t lo, uint64_t hi, uint64_t *result)
{
    if (host_parse_number(value, lo, hi, result) != 0) {
        return host_fail(p->error, HOST_USAGE,
                         "--%s %s: not a number that is allowed; give %llu to "
                         "%llu",
                         option, value, (unsigned long long)lo,
                         (unsigned long long)hi);
    }
    return 0;
}

static void parse_memory(struct parse *p, const char *value)
{
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

static void parse_output(struct parse *p, const char *value)
{
    if (p->options->outputs == HOST_OUTPUTS_MAX) {
        host_fail(p->error, HOST_USAGE,
                  "-o %s: more than %d outputs; use "
                  "incode convert for the others",
                  value, HOST_OUTPUTS_MAX);
        return;
    }
    p->options->output[p->options->outputs++] = value;
}

static bool parse_names(int key, const char *value, struct parse *p)
{
    struct host_run_options *o = p->options;
    switch (key) {
    case KEY_STRATEGY:
        o->strategy = host_strategy_row(
            (unsigned)choose(p, "strategy", value, host_strategy_name, NULL));
        return true;
    case KEY_PARTITION:
        o->partition = (enum host_partition)choose(p, "partition", value,
                                                   partition_name, NULL);
        return true;
    case KEY_INDEX:
        o->index =
            (enum incode_index)choose(p, "index", value, index_name, NULL);
        return true;
    case KEY_FACE_RULE:
        o->face_rule = (enum incode_face_rule)choose(p, "face-rule", value,
                                                     face_rule_name, NULL);
        return true;
    case KEY_BUILD:
        o->build =
            (enum incode_build)choose(p, "build", value, build_name, NULL);
        return true;
    case KEY_LINK:
        o->link = host_link_row(
            (unsigned)choose(p, "link", value, host_link_name, NULL));
        return true;
    case KEY_LINDA:
        p->linda = (unsigned)choose(p, "linda", value, host_linda_name, NULL);
        return true;
    case KEY_BOARD:
        o->board = host_board_row((unsigned)choose(
            p, "board", value, host_board_name, host_boards_elsewhere));
        return true;
    default:
        return false;
    }
}

/* How a strategy shares the work: keys from KEY_CLUSTER on. */
static bool parse_sharing(int key, const char *value, struct parse *p)
{
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
    if (i < 0 || i >= (int)(sizeof row / sizeof row[0])) {
        return false;
    }
    (void)number(p, row[i].name, value, row[i].min, row[i].max, &n);
    *row[i].into = (unsigned)n;
    return true;
}

static bool parse_testing(int key, const char *value, struct parse *p)
{
    struct host_run_options *o = p->options;
    uint64_t n = 0;
    switch (key) {
    case KEY_WINDOW:
        (void)number(p, "window", value, 1, LINK_WINDOW_MAX, &n);
        o->window = (unsigned)n;
        return true;
    case KEY_SHUFFLE_SEED:
        (void)number(p, "shuffle-seed", value, 0, UINT64_MAX, &o->shuffle_seed);
        return true;
    case KEY_HOST_STALL:
        (void)number(p, "host-stall", value, 0, 60000, &n);
        o->throttle.stall_us_max = 1000 * n;
        return true;
    case KEY_HOST_RATE:
        (void)number(p, "host-rate", value, 1, 1000000000,
                     &o->throttle.bytes_a_second);
        return true;
    case KEY_HOST_RATE_TIME:
        (void)number(p, "host-rate-time", value, 0, 86400, &n);
        o->throttle.slow_us = 1000000 * n;
        return true;
    case KEY_HOST_UNPLUG:
        (void)number(p, "host-unplug", value, 50, 86400000, &n);
        o->unplug_us = 1000 * n;
        return true;
    case KEY_SEED:
        (void)number(p, "seed", value, 0, UINT64_MAX, &o->throttle.seed);
        return true;
    case KEY_NODE_PROGRAM:
        o->node_program = value;
        return true;
    default:
        return false;
    }
}

static error_t parse_report(int key, const char *value, struct parse *p)
{
    struct host_run_options *o = p->options;
    switch (key) {
    case KEY_VERIFY:
        o->verify = true;
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
    case KEY_NO_PROGRESS:
        o->progress = false;
        return 0;
    case ARGP_KEY_ARG:
        if (o->input != NULL) {
            host_fail(p->error, HOST_USAGE,
                      "%s: a second file of points after %s; give one", value,
                      o->input);
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

static error_t parse_option(int key, char *value, struct argp_state *state)
{
    struct parse *p = state->input;
    if (key >= KEY_STRATEGY && key < KEY_END) {
        p->given |= UINT64_C(1) << (key - KEY_STRATEGY);
    }
    if (parse_names(key, value, p) || parse_sharing(key, value, p) ||
        parse_testing(key, value, p)) {
        return 0;
    }
    switch (key) {
    case 'o':
        parse_output(p, value);
        return 0;
    case KEY_NODES:
        (void)host_parse_nodes(value, HOST_PROCESSES_MAX,
                               ", or with --cube what its file says",
                               &p->options->nodes, p->error);
        return 0;
    case KEY_MEMORY:
        parse_memory(p, value);
        return 0;
    case KEY_PATIENCE:
        (void)number(p, "patience", value, 1, 86400, &p->options->patience_s);
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

static bool given(const struct parse *p, int key)
{
    return (p->given >> (key - KEY_STRATEGY) & 1) != 0;
}

/* An option that would change nothing is a misunderstanding. */
static int check_together(const struct parse *p)
{
    const struct host_run_options *o = p->options;
    bool cube = o->cube != NULL, ranks = !cube && o->link->ranks;
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
        {KEY_HOST_UNPLUG, cube || !o->link->terminals,
         "--host-unplug: goes with --link serial alone"},
        {KEY_NODE_PROGRAM, ranks, "--node-program: not with --link mpi"},
        {KEY_HOST_RATE_TIME, !given(p, KEY_HOST_RATE),
         "--host-rate-time: goes with --host-rate alone"},
        {KEY_SEED, !given(p, KEY_HOST_STALL),
         "--seed: goes with --host-stall alone"},
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
        if (options[i].vain && given(p, options[i].key)) {
            return host_fail(p->error, HOST_USAGE, "%s; leave it out",
                             options[i].why);
        }
    }
    return 0;
}

static const char *link_help(unsigned i)
{
    return host_link_row(i)->help;
}

static const char *board_help(unsigned i)
{
    return host_board_row(i)->help;
}

/* Option's help with the rows of the table that its values are from; usual: the
 * default's name. */
static char *list_rows(const char *text, const char *(*name)(unsigned i),
                       const char *(*help)(unsigned i), const char *usual)
{
    size_t size = strlen(text) + 1;
    for (unsigned i = 0; name(i) != NULL; i++) {
        size += strlen(name(i)) + strlen(help(i)) + sizeof " (; the default),";
    }
    char *whole = malloc(size);
    size_t used = 0;
    if (whole == NULL) {
        return NULL;
    }
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
                                      size_t size))
{
    char list[HOST_FORMAT_LIST_MAX], *whole = NULL;
    const char *place = strstr(text, "%s");
    put(use, list, sizeof list);
    return asprintf(&whole, "%.*s%s%s", (int)(place - text), text, list,
                    place + strlen("%s")) < 0
               ? NULL
               : whole;
}

/* As argp asks for it: `text` itself, or what is to be freed. */
static char *complete_help(int key, const char *text, void *input)
{
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

/* flags: of argp_parse. */
static int parse_run(int argc, char **argv, unsigned flags,
                     struct host_run_options *options, struct host_error *error)
{
    static const struct argp argp = {
        options_of_run,
        parse_option,
        "POINTS",
        "Triangulates POINTS on a cube of nodes that it starts on this "
        "machine, and writes each output by its extension.\v"
        "POINTS: %s; .gz of any of them; - is .xyz from standard input. Of a "
        ".csv whose first line names columns x, y and z, in any order and "
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
        complete_help,
        NULL};
    struct parse parse = {options, error, 0, 0};
    host_run_defaults(options);
    int status = host_options_parse(&argp, argc, argv, flags, &parse, error);
    if (status != 0) {
        return status;
    }
    if (options->throttle.bytes_a_second != 0 &&
        options->throttle.slow_us == 0) {
        options->throttle.slow_us = 30000000;
    }
    if (options->strategy != NULL && options->strategy->linda != NULL &&
        given(&parse, KEY_LINDA)) {
        options->strategy = host_strategy_linda(parse.linda);
    }
    return check_together(&parse);
}

int host_arguments_run(int argc, char **argv, struct host_run_options *options,
                       struct host_error *error)
{
    return parse_run(argc, argv, 0, options, error);
}

int host_arguments_try(int argc, char **argv, struct host_run_options *options)
{
    struct host_error error = {0};
    return parse_run(argc, argv, ARGP_SILENT, options, &error);
}
