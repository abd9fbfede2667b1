#include "bench_arguments.h"

#include <stdlib.h>
#include <string.h>

#include "bench_boards.h"
#include "bench_class.h"
#include "bench_links.h"
#include "bench_paper.h"
#include "bench_peers.h"
#include "bench_scaling.h"
#include "host/base/options.h"
#include "host/base/parse.h"
#include "host/service/machine.h"

enum {
    KEY_ROUNDS = 256,
    KEY_CLASS,
    KEY_PEERS,
    KEY_LARGE,
    KEY_LIMIT,
    KEY_QUICK,
    KEY_CSV,
    KEY_SVG,
    KEY_TABLE,
    KEY_STRATEGY,
    KEY_BLUNTFIN,
    KEY_MILLION,
    NODES = 256,
    NODES_QUICK = 64,
    SCALING_NODES = 64,
    SCALING_NODES_QUICK = 8
};

struct arguments {
    const char *what; /* the benchmark */
    struct host_paper_options paper;
    /* Options given that they alone have: of_runs paper and scaling, of_rows
     * these and boards. */
    const char *of_paper, *of_peers, *of_runs, *of_rows;
    struct host_bench_peers_options peers;
    struct host_error *error;
};

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "Of paper:", 1},
    {"table", KEY_TABLE, "LIST", 0,
     "Some tables alone, with commas between: 1 to 7, 11 (the figure), "
     "relation, goals, check (of the model)",
     1},
    {"strategy", KEY_STRATEGY, "NAME", 0, "One strategy alone", 1},
    {"bluntfin", KEY_BLUNTFIN, "FILE", 0,
     "The grid of NASA's Blunt Fin. Default: one like it", 1},
    {"million", KEY_MILLION, NULL, 0,
     "The goal for 1,000,000 points on 1,024 nodes, too", 1},
    {NULL, 0, NULL, 0, "Of paper and scaling:", 3},
    {"quick", KEY_QUICK, NULL, 0,
     "A tenth of the points, up to 64 nodes; or 30,000 points, up to 8", 3},
    {"nodes", 'n', "N", 0, "Up to N nodes. Default: 256; or 64", 3},
    {NULL, 0, NULL, 0, "Of paper, scaling and boards:", 4},
    {"csv", KEY_CSV, "FILE", 0, "All rows, as CSV", 4},
    {"svg", KEY_SVG, "FILE", 0,
     "Figure 11 or both curves, by gnuplot; or each board's instructions as a "
     "bar",
     4},
    {NULL, 0, NULL, 0, "Of peers:", 2},
    {"rounds", KEY_ROUNDS, "N", 0, "Medians of N rounds. Default: 3", 2},
    {"class", KEY_CLASS, "NAME", 0,
     "One class alone: uniform, files, volumes, real, small, thin, growth, "
     "extremes "
     "or cube; real, small and cube are of the files given",
     2},
    {"peers", KEY_PEERS, "LIST", 0,
     "Some peers alone, with commas between: cgal, tetgen, qhull", 2},
    {"large", KEY_LARGE, NULL, 0, "Sets of a million points too", 2},
    {"limit", KEY_LIMIT, "S", 0,
     "End a run after S seconds, and go on without. Default: 60", 2},
    {0}};

static void parse_whole(struct arguments *a, const char *name,
                        const char *value, unsigned most, unsigned *number) {
    uint64_t n = 0;
    (void)host_option_number(name, value, 1, most, &n, a->error);
    *number = (unsigned)n;
}

static void parse_argument(struct arguments *a, const char *value) {
    if (a->what == NULL) {
        a->what = value;
    } else if (a->peers.names == HOST_BENCH_NAMES_MAX) {
        host_fail(a->error, HOST_USAGE,
                  "%s: more than %d names; give directories", value,
                  HOST_BENCH_NAMES_MAX);
    } else {
        a->peers.name[a->peers.names++] = value;
    }
}

/* False: it is not one of its options. */
static bool parse_paper(int key, const char *value, struct arguments *a) {
    struct host_paper_options *paper = &a->paper;
    switch (key) {
    case 'n':
        a->of_runs = "--nodes";
        (void)host_parse_nodes("--nodes", value, HOST_NODES_MAX, "",
                               &paper->nodes_max, a->error);
        return true;
    case KEY_QUICK:
        a->of_runs = "--quick";
        paper->quick = true;
        return true;
    case KEY_TABLE:
        a->of_paper = "--table";
        paper->tables = value;
        return true;
    case KEY_STRATEGY:
        a->of_paper = "--strategy";
        paper->strategy = value;
        return true;
    case KEY_BLUNTFIN:
        a->of_paper = "--bluntfin";
        paper->bluntfin = value;
        return true;
    case KEY_MILLION:
        a->of_paper = "--million";
        paper->large = true;
        return true;
    case KEY_CSV:
        a->of_rows = "--csv";
        paper->csv = value;
        return true;
    case KEY_SVG:
        a->of_rows = "--svg";
        paper->svg = value;
        return true;
    default:
        return false;
    }
}

static error_t parse_bench(int key, char *value, struct argp_state *state) {
    struct arguments *a = state->input;
    if (parse_paper(key, value, a)) {
        return 0;
    }
    switch (key) {
    case KEY_ROUNDS:
        a->of_peers = "--rounds";
        parse_whole(a, "rounds", value, HOST_BENCH_ROUNDS_MAX,
                    &a->peers.rounds);
        return 0;
    case KEY_LIMIT:
        a->of_peers = "--limit";
        parse_whole(a, "limit", value, 1000000, &a->peers.limit_s);
        return 0;
    case KEY_CLASS:
        a->of_peers = "--class";
        a->peers.class = value;
        if (host_bench_class_named(value) == NULL) {
            host_fail(a->error, HOST_USAGE,
                      "--class %s: not in this version; allowed: %s", value,
                      host_bench_class_names());
        }
        return 0;
    case KEY_PEERS:
        a->of_peers = "--peers";
        a->peers.peers = value;
        return 0;
    case KEY_LARGE:
        a->of_peers = "--large";
        a->peers.large = true;
        return 0;
    case ARGP_KEY_ARG:
        parse_argument(a, value);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static const struct argp bench = {
    options,
    parse_bench,
    "paper\nlinks\nboards\nscaling\npeers [DIRECTORY|FILE]...",
    "Measures this machine: paper prints Tables 1 to 7 and figure 11 of "
    "Cignoni, Laforenza, Perego, Scopigno and Montani (1995) beside the "
    "paper's figures, for up to 256 nodes in virtual time; links prints what a "
    "link does over each driver; boards, in the source tree, what a "
    "tetrahedron costs each bare board, emulated, in instructions and bytes, "
    "and where they go; scaling, what a point costs from 1,000 to 10,000,000 "
    "points, measured, and from 1 to 64 nodes, in virtual time; peers, in the "
    "source tree, runs CGAL, TetGen and "
    "Qhull in turn with this program on points that it makes and on those "
    "given, and prints times, ratios and the goals of each class.",
    NULL,
    NULL,
    NULL};

/* An option that the benchmark has not, or NULL. */
static const char *other_option(const struct arguments *a) {
    bool paper = strcmp(a->what, "paper") == 0;
    bool runs = paper || strcmp(a->what, "scaling") == 0;
    bool rows = runs || strcmp(a->what, "boards") == 0;
    bool peers = strcmp(a->what, "peers") == 0;
    return a->of_paper != NULL && !paper   ? a->of_paper
           : a->of_runs != NULL && !runs   ? a->of_runs
           : a->of_rows != NULL && !rows   ? a->of_rows
           : a->of_peers != NULL && !peers ? a->of_peers
                                           : NULL;
}

/* Options and arguments that the benchmark has not. */
static int check(const struct arguments *a, struct host_error *error) {
    static const char *const all[] = {"paper", "links", "boards", "scaling",
                                      "peers"};
    bool known = false, peers = strcmp(a->what, "peers") == 0;
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        known = known || strcmp(a->what, all[i]) == 0;
    }
    if (!known) {
        return host_fail(error, HOST_USAGE,
                         "bench %s: not in this version; allowed: paper, "
                         "links, boards, scaling, peers",
                         a->what);
    }
    const char *other = other_option(a);
    if (other != NULL) {
        return host_fail(error, HOST_USAGE,
                         "%s: no option of bench %s; see incode bench --help",
                         other, a->what);
    }
    return peers || a->peers.names == 0
               ? 0
               : host_fail(error, HOST_USAGE,
                           "%s: one argument too many; bench %s takes none",
                           a->peers.name[0], a->what);
}

int host_bench(int argc, char **argv, struct host_error *error) {
    struct arguments a = {.peers = {.rounds = 3, .limit_s = 60},
                          .error = error};
    if (host_options_parse(&bench, argc, argv, 0, &a, error) != 0) {
        return error->code;
    }
    if (a.what == NULL) {
        return host_fail(error, HOST_USAGE,
                         "%s: too few arguments; give paper, links, boards, "
                         "scaling or peers, see --help",
                         argv[0]);
    }
    if (check(&a, error) != 0) {
        return error->code;
    }
    if (strcmp(a.what, "links") == 0) {
        return host_bench_links(error);
    }
    if (strcmp(a.what, "boards") == 0) {
        struct host_bench_boards_options boards = {a.paper.csv, a.paper.svg};
        return host_bench_boards(&boards, error);
    }
    if (strcmp(a.what, "peers") == 0) {
        return host_bench_peers(&a.peers, error);
    }
    if (strcmp(a.what, "scaling") == 0) {
        struct host_scaling_options scaling = {a.paper.quick, a.paper.nodes_max,
                                               a.paper.csv, a.paper.svg};
        if (scaling.nodes_max == 0) {
            scaling.nodes_max =
                scaling.quick ? SCALING_NODES_QUICK : SCALING_NODES;
        }
        return host_bench_scaling(&scaling, error);
    }
    if (a.paper.nodes_max == 0) {
        a.paper.nodes_max = a.paper.quick ? NODES_QUICK : NODES;
    }
    return host_bench_paper(&a.paper, error);
}
