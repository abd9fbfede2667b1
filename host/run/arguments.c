#include "arguments.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/options.h"
#include "host/base/text.h"
#include "host/formats/formats.h"
#include "host/mesh/points.h"
#include "host/service/strategies/strategies.h"
#include "incode/paper/builder.h"

/* --- help ----------------------------------------------------------------- */

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

static char *list_written(const char *text) {
    return list_formats(text, HOST_WRITE_TETRAHEDRA, host_format_help);
}

static char *list_read(const char *text) {
    return list_formats(text, HOST_READ_POINTS, host_format_list);
}

static char *list_points(const char *text) {
    return list_formats(text, HOST_READ_POINTS, host_format_help);
}

static char *list_strategies(const char *text) {
    return list_rows(text, host_strategy_name, host_strategy_help, "auto");
}

static char *list_links(const char *text) {
    return list_rows(text, host_link_name, link_help, host_link_name(0));
}

static char *list_boards(const char *text) {
    return list_rows(text, host_board_name, board_help, host_board_name(0));
}

/* --- values --------------------------------------------------------------- */

static const char *partition_name(unsigned i) {
    return host_partitions[i];
}

static const char *order_name(unsigned i) {
    static const char *const names[] = {
        [HOST_CANONICAL] = "canonical", [HOST_AS_MADE] = "as-made", NULL};
    return names[i];
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

static void take_strategy(void *into, const char *value,
                          struct host_error *error) {
    struct host_run_options *o = into;
    o->strategy = host_strategy_row((unsigned)host_option_choose(
        "strategy", value, host_strategy_name, error));
}

static void take_link(void *into, const char *value, struct host_error *error) {
    struct host_run_options *o = into;
    o->link = host_link_row(
        (unsigned)host_option_choose("link", value, host_link_name, error));
}

static void take_board(void *into, const char *value,
                       struct host_error *error) {
    struct host_run_options *o = into;
    o->board = host_board_row(
        (unsigned)host_option_choose("board", value, host_board_name, error));
}

static void take_memory(void *into, const char *value,
                        struct host_error *error) {
    uint64_t *bytes = &((struct host_run_options *)into)->memory;
    if (host_parse_bytes(value, bytes) != 0 || *bytes < HOST_MEMORY_MIN ||
        *bytes > HOST_MEMORY_MAX) {
        host_fail(error, HOST_USAGE,
                  "--memory %s: not a size of memory that is allowed; give "
                  "640K to 1G, as in 4M, or less to a small cube",
                  value);
    }
    *bytes = *bytes / 4096 * 4096;
}

static void take_output(void *into, const char *value,
                        struct host_error *error) {
    struct host_run_options *o = into;
    if (o->outputs == HOST_OUTPUTS_MAX) {
        host_fail(error, HOST_USAGE,
                  "-o %s: more than %d outputs; use "
                  "incode convert for the others",
                  value, HOST_OUTPUTS_MAX);
        return;
    }
    o->output[o->outputs++] = value;
}

static void take_format(void *into, const char *value,
                        struct host_error *error) {
    ((struct host_run_options *)into)->format = value;
    (void)host_format_told(value, HOST_READ_POINTS, error);
}

static void take_verify(void *into, const char *value,
                        struct host_error *error) {
    (void)value;
    (void)error;
    ((struct host_run_options *)into)->verifying = HOST_VERIFY_ALWAYS;
}

static void take_no_verify(void *into, const char *value,
                           struct host_error *error) {
    (void)value;
    (void)error;
    ((struct host_run_options *)into)->verifying = HOST_VERIFY_NEVER;
}

static void take_progress(void *into, const char *value,
                          struct host_error *error) {
    struct host_run_options *o = into;
    (void)value;
    (void)error;
    o->progress = o->anywhere = true;
}

static void take_no_progress(void *into, const char *value,
                             struct host_error *error) {
    struct host_run_options *o = into;
    (void)value;
    (void)error;
    o->progress = o->anywhere = false;
}

static void take_points(void *into, const char *value,
                        struct host_error *error) {
    struct host_run_options *o = into;
    if (o->input != NULL) {
        bool output = host_format_of(value, HOST_WRITE_TETRAHEDRA) != NULL;
        host_fail(error, HOST_USAGE,
                  "%s: a second file of points after %s; give one%s%s", value,
                  o->input, output ? ", and an output as -o " : "",
                  output ? value : "");
    }
    o->input = value;
}

#define CUBE_HEADING "A cube of nodes instead of threads:"

static const struct host_option rows[] = {
    {.help = "What to compute, and where:"},
    {"output", 'o', "FILE",
     "Write the tetrahedra to FILE, by its extension: %s; - is .ele on "
     "standard output. May be given several times; all files get their names "
     "at the end of a run that succeeds, or none does",
     .take = take_output, .fill = list_written},
    {"format", 0, "NAME",
     "What POINTS holds, where no extension tells, as with a pipe: that of %s, "
     "and .gz behind it",
     .take = take_format, .fill = list_read},
    {"threads", 0, "N",
     "Threads that triangulate in this process, where no other option speaks "
     "of a cube. Default: one a processor",
     HOST_AT(struct host_run_options, threads), .least = 1,
     .most = HOST_THREADS_MAX},
    {"order", 0, "NAME",
     "Tetrahedra in ascending order (canonical, the default), the same bytes "
     "whatever made them, or as they were made (as-made), which saves the "
     "sort. As made they have no digest; incode digest FILE makes it. .npy, "
     ".msh and .mesh are written while threads triangulate, without --verify "
     "and --stats; other outputs, and those of a cube, whose bricks a lost "
     "node may change, at the end",
     HOST_AT(struct host_run_options, row_order), .names = order_name},
    HOST_LIMITS_ROWS(struct host_run_options, limits.memory, limits.folder),
    {"resume", 0, "DIR",
     "Keep the run's state in DIR, which is made if it is not there. After a "
     "crash, kill -9 or loss of power the same command goes on from there and "
     "writes the same bytes. A run that succeeds removes its state",
     HOST_AT(struct host_run_options, resume)},
    {.help = CUBE_HEADING},
    {"strategy", 0, "NAME", "How the work is shared out:",
     .take = take_strategy, .fill = list_strategies},
    {"partition", 0, "NAME",
     "Regions of equal counts (adaptive, the default) or equal cells "
     "(uniform)",
     HOST_AT(struct host_run_options, partition), .names = partition_name},
    {"index", 0, "NAME",
     "How a node searches: naive (all points), grid (the paper's uniform "
     "grid) or kd, the default",
     HOST_AT(struct host_run_options, index), .names = index_name},
    {"face-rule", 0, "NAME",
     "Faces pursued by a region: those with a vertex of its own (own, the "
     "default) or at least partly inside it (paper)",
     HOST_AT(struct host_run_options, face_rule), .names = face_rule_name},
    {"build", 0, "NAME",
     "How a node finds tetrahedra: by faces (InCoDe); by points inserted brick "
     "after brick, as long as what is not final fits in its memory; or auto, "
     "the default: by points where it has some of a surface, or all bricks of "
     "a volume, that fits. Other indexes than kd, the face rule paper, and "
     "other strategies than sequential, spatial and linda-spatial go by faces",
     HOST_AT(struct host_run_options, build), .names = build_name},
    {"nodes", 0, "N",
     "Nodes of the cube: 1, 2, 4 .. 64. Default: what suits this machine",
     HOST_AT(struct host_run_options, nodes), .most = HOST_PROCESSES_MAX,
     .powers = ", or with --cube what its file says"},
    {"linda", 0, "NAME",
     "Of --strategy linda: master-slaves (the default) or spatial",
     HOST_AT(struct host_run_options, linda), .names = host_linda_name},
    {"cluster", 0, "N",
     "Nodes of a cluster in hybrid, a power of two. Default: 4",
     HOST_AT(struct host_run_options, sharing.cluster), .least = 2,
     .most = HOST_NODES_MAX},
    {"builders", 0, "N",
     "Tetrahedron builders of each face manager. Default: all other nodes, of "
     "hybrid those of its cluster",
     HOST_AT(struct host_run_options, sharing.builders), .least = 1,
     .most = NODE_BUILDERS_MAX},
    {"faces-per-job", 0, "M",
     "Faces that a face manager sends a builder at a time, 1 .. 96. Default: "
     "the number of nodes that share its list; of linda 30",
     HOST_AT(struct host_run_options, sharing.faces_per_job), .least = 1,
     .most = INCODE_LIST_MAX},
    {"jobs-per-worker", 0, "N",
     "Such lists that a builder may have at a time, 1 .. 16. Default: 2; of "
     "linda 3",
     HOST_AT(struct host_run_options, sharing.jobs_per_worker), .least = 1,
     .most = INCODE_LISTS_MAX},
    {"memory", 0, "BYTES",
     "Data memory of a node, stack included: 640K .. 1G; a small cube does "
     "with less, and an error says with how much. Default: 4M",
     .take = take_memory},
    {"link", 0, "NAME", "Wires between nodes:", .take = take_link,
     .fill = list_links},
    {"board", 0, "NAME", "What a node runs on:", .take = take_board,
     .fill = list_boards},
    {"patience", 0, "SECONDS",
     "Give up a node that shows no progress for so long: start it again, or go "
     "on without it. Default: 60",
     HOST_AT(struct host_run_options, patience_s), .least = 1, .most = 86400},
    {"cube", 0, "FILE",
     "Run on the nodes that FILE describes, over the wires that it names; see "
     "README.md",
     HOST_AT(struct host_run_options, cube)},
    {"table", 0, NULL,
     "Run on one node too, and print the columns of the paper's Table 2",
     HOST_AT(struct host_run_options, table)},
    {"map", 0, NULL, "Print the memory map of a node",
     HOST_AT(struct host_run_options, map)},
    {"explain", 0, NULL,
     "Say why --strategy auto took the strategy that it took",
     HOST_AT(struct host_run_options, explain)},
    {"window", 0, "FRAMES",
     "Frames a link and direction, 1 .. 64. Default: by memory",
     HOST_AT(struct host_run_options, window), .least = 1,
     .most = LINK_WINDOW_MAX},
    {"node-program", 0, "FILE", "Start FILE for a node instead of incode-node",
     HOST_AT(struct host_run_options, node_program)},
    {.help = "What to report:"},
    {"verify", 0, NULL,
     "Check exactly that the result is the Delaunay triangulation; without it "
     "only that it is a triangulation. Default: with --cube, and after a loss",
     .take = take_verify},
    {"no-verify", 0, NULL, "Leave the exact check out", .take = take_no_verify},
    {"stats", 0, "FILE", "Write statistics as JSON; - is stdout",
     HOST_AT(struct host_run_options, stats)},
    {"quiet", 'q', NULL, "Print nothing but errors",
     HOST_AT(struct host_run_options, quiet)},
    {"progress", 0, NULL,
     "Without a terminal, too: a line of progress every three seconds",
     .take = take_progress},
    {"no-progress", 0, NULL, "No line of progress on a terminal",
     .take = take_no_progress},
    {0}};

/* --- what goes together --------------------------------------------------- */

/* The first option given that speaks of a cube, or NULL. */
static const char *option_of_cube(uint64_t given) {
    bool of_cube = false;
    for (unsigned i = 0; rows[i].help != NULL; i++) {
        if (rows[i].name == NULL)
            of_cube = strcmp(rows[i].help, CUBE_HEADING) == 0;
        if (of_cube && (given >> i & 1) != 0)
            return rows[i].name;
    }
    return NULL;
}

/* What a bare board settles: the wires, the memory, the most nodes. */
static int settle_bare(struct host_run_options *o, struct host_error *error) {
    unsigned most = host_bare_nodes_max(o->board->bare);
    if (o->nodes > most) {
        return host_fail(error, HOST_USAGE,
                         "--nodes %u: %s has UARTs for a cube of %u; give %u "
                         "or fewer",
                         o->nodes, o->board->name, most, most);
    }
    if (o->memory != HOST_BOARD_MEMORY) {
        return host_fail(error, HOST_USAGE,
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
static int check_together(struct host_run_options *o, uint64_t given,
                          struct host_error *error) {
    bool cube = o->cube != NULL, bare = !cube && o->board->bare != NULL;
    bool ranks = !cube && !bare && o->link->ranks;
    unsigned heeds = o->strategy == NULL ? 0 : o->strategy->sharing;
    const struct {
        const char *name;
        bool vain;
        const char *why;
    } options[] = {
        {"memory", cube, "the cube file of --cube says it"},
        {"link", cube, "the cube file of --cube says it"},
        {"board", cube, "the cube file of --cube says it"},
        {"window", cube, "the cube file of --cube says it"},
        {"link", bare, "this board's wires are its UARTs"},
        {"window", bare, "this board's firmware settles it"},
        {"node-program", bare, "this board has firmware"},
        {"node-program", ranks, "not with --link mpi"},
        {"table", o->resume != NULL, "--resume is of one run"},
        {"progress", o->quiet, "-q prints none"},
        {"explain", o->quiet, "-q prints nothing"},
        {"explain", o->strategy != NULL, "goes with --strategy auto alone"},
        {"linda", o->strategy == NULL || o->strategy->linda == NULL,
         "goes with --strategy linda alone"},
        {"cluster", (heeds & HOST_SHARING_CLUSTER) == 0,
         "goes with a strategy of clusters alone, as hybrid"},
        {"builders", (heeds & HOST_SHARING_BUILDERS) == 0,
         "goes with strategies that lend lists of faces"},
        {"faces-per-job", (heeds & HOST_SHARING_LISTS) == 0,
         "goes with strategies that lend lists of faces"},
        {"jobs-per-worker", (heeds & HOST_SHARING_LISTS) == 0,
         "goes with strategies that lend lists of faces"}};
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        if (options[i].vain &&
            host_option_given(rows, given, options[i].name)) {
            return host_fail(error, HOST_USAGE, "--%s: %s; leave it out",
                             options[i].name, options[i].why);
        }
    }
    return bare ? settle_bare(o, error) : 0;
}

/* --- the whole ------------------------------------------------------------ */

static const struct host_option *added;

void host_arguments_add(const struct host_option *more) {
    added = more;
}

/* Faults of nodes and wires, which threads do not have. */
static bool has_faults(const struct host_run_options *o) {
    const struct host_throttle *t = &o->throttle;
    uint64_t any =
        t->stall_us_max | t->bytes_a_second | o->unplug_us | o->shuffle_seed;
    for (unsigned i = 0; i < HOST_TROUBLES; i++)
        any |= o->trouble.every_us[i];
    return any != 0;
}

/* silent: see host_options_parse. */
static int parse_run(int argc, char **argv, bool silent,
                     struct host_run_options *options,
                     struct host_error *error) {
    const struct host_options mine = {
        .rows = rows,
        .more = added,
        .argument = take_points,
        .arguments = "POINTS",
        .fill = list_points,
        .about =
            "Triangulates POINTS, and writes each output by its extension. The "
            "work is done by threads of this process or, where an option "
            "speaks of a cube, by nodes.\v"
            "POINTS: %s; .gz of any of them; - is .xyz from standard input. Of "
            "a .csv, .xyz or .txt whose first line names columns x, y and z, "
            "in any order and among others, these are taken; of other text, "
            "and of .npy, the first three columns.\n\n"
            "Examples:\n"
            "  incode run bunny.ply -o bunny.vtu\n"
            "  incode run points.xyz --nodes 8 --verify --stats run.json\n"
            "  incode run - -o - < points.xyz > tetrahedra.ele\n\n"
            "Exit status: 0 done, 1 the program failed, 2 wrong usage, 3 wrong "
            "input or an output that cannot be written, 4 cube, link or node "
            "failure, 5 a verification failed. A signal such as that of Ctrl-C "
            "ends it as a signal does (130 in a shell). Unless it is 0, no "
            "output has its name, and what had it before is as it was."};
    uint64_t given = 0;
    host_run_defaults(options);
    int status =
        host_options_parse(&mine, argc, argv, silent, options, &given, error);
    if (status != 0)
        return status;
    if (options->input == NULL) {
        return host_fail(
            error, HOST_USAGE,
            "POINTS: not given; name a file, or - for standard input");
    }
    if (options->throttle.bytes_a_second != 0 && options->throttle.slow_us == 0)
        options->throttle.slow_us = 30000000;
    if (options->strategy != NULL && options->strategy->linda != NULL &&
        host_option_given(rows, given, "linda"))
        options->strategy = host_strategy_linda(options->linda);
    const char *of_cube = option_of_cube(given);
    options->direct = of_cube == NULL && !has_faults(options);
    if (of_cube != NULL && host_option_given(rows, given, "threads")) {
        return host_fail(error, HOST_USAGE,
                         "--threads: are of this process, and --%s speaks of "
                         "a cube of nodes; leave one of the two out",
                         of_cube);
    }
    return check_together(options, given, error);
}

int host_arguments_run(int argc, char **argv, struct host_run_options *options,
                       struct host_error *error) {
    return parse_run(argc, argv, false, options, error);
}

int host_arguments_try(int argc, char **argv,
                       struct host_run_options *options) {
    struct host_error error = {0};
    return parse_run(argc, argv, true, options, &error);
}
