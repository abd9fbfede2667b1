#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "paper.h"
#include "bench_table.h"
#include "host/base/progress.h"
#include "host/service/strategies/strategies.h"

/* Speed-up of a run on Uniform 20,000 by the model of the nCUBE 2; 0: error. */
static double speed_up(struct host_paper_bench *bench, const char *strategy,
                       unsigned nodes, struct host_error *error) {
    const struct host_paper_case c = {
        .set = "Uniform",
        .points = 20000,
        .strategy = strategy,
        .paper_rule = strcmp(strategy, "spatial") == 0,
        .partition =
            strcmp(strategy, "spatial") == 0 ? HOST_UNIFORM : HOST_ADAPTIVE,
        .nodes = nodes,
        .builders = strcmp(strategy, "master-slaves") == 0 ? nodes - 1 : 0};
    double alone_s = host_paper_alone_s(&bench->runs, &c, error);
    const struct host_paper_result *r =
        alone_s > 0 ? host_paper_run(&bench->runs, &c, error) : NULL;
    return r == NULL ? 0 : alone_s / r->t_max;
}

static double paper_speed_up(const char *table, unsigned nodes) {
    const struct host_paper_series *s =
        host_paper_find(table, "Uniform", 20000, "");
    return s->alone_s / host_paper_row_of(s, nodes)->t_max;
}

/* The paper's, in its own figures. */
static void paper_relation(unsigned n) {
    double gain = paper_speed_up("2", 4 * n) / paper_speed_up("2", n);
    double slaves = paper_speed_up("6", 3);
    host_paper_note("N = %2u, the paper's figures: %.2f %s %.2f", n, gain,
                    gain < slaves ? "<" : ">=", slaves);
}

static int model_relation(struct host_paper_bench *bench, unsigned n,
                          double slaves, struct host_error *error) {
    double few = speed_up(bench, "spatial", n, error);
    double many = few > 0 ? speed_up(bench, "spatial", 4 * n, error) : 0;
    if (error->code == 0) {
        host_paper_note(
            "N = %2u, modelled nCUBE 2%s: %.2f %s %.2f: a hybrid %s", n,
            bench->runs.quick ? ", a tenth of the points" : "", many / few,
            many / few < slaves ? "<" : ">=", slaves,
            many / few < slaves ? "pays" : "does not pay");
    }
    return error->code;
}

/* Formula (2): S_hybrid(4N) = S_spatial(N) * S_master-slaves(4), with initial
 * work counted once, which here is next to nothing. */
static int estimate(struct host_paper_bench *bench, unsigned nodes,
                    double slaves, struct host_error *error) {
    double paper = paper_speed_up("5", nodes);
    double regions = speed_up(bench, "spatial", nodes / 4, error);
    double hybrid = regions > 0 && host_paper_has(bench, "hybrid")
                        ? speed_up(bench, "hybrid", nodes, error)
                        : 0;
    if (hybrid > 0) {
        host_paper_note(
            "hybrid, %3u nodes: the authors' estimate %.1f, %s: %.1f; their "
            "formula of the modelled parts, %.2f * %.2f = %.1f, %s by %.0f %%",
            nodes, paper,
            bench->runs.quick
                ? "for ten times the points and not held to a tenth"
            : hybrid >= paper ? "comes true"
                              : "does not come true",
            hybrid, regions, slaves, regions * slaves,
            regions * slaves > hybrid ? "promises too much"
                                      : "promises too little",
            100 * fabs(regions * slaves / hybrid - 1));
    }
    return error->code;
}

/* A hybrid of clusters of four pays where S_spatial(4N) / S_spatial(N) <
 * S_master-slaves(4), for N of 16 and more; and whether the estimate of Table 5
 * comes true.  0, or what a run ends with. */
static int host_paper_relation(struct host_paper_bench *bench,
                               struct host_error *error) {
    double slaves = 0;
    host_paper_table(&bench->print, "relation",
                     "Relation (1): S_spatial(4N) / S_spatial(N) < "
                     "S_master-slaves(4), Uniform 20,000");
    for (unsigned n = 16; n <= 32; n *= 2)
        paper_relation(n);
    if (!host_paper_has(bench, "master-slaves"))
        return 0;
    slaves = speed_up(bench, "master-slaves", 4, error);
    for (unsigned n = 16;
         n <= 64 && error->code == 0 && 4 * n <= bench->options->nodes_max;
         n *= 2)
        (void)model_relation(bench, n, slaves, error);
    for (unsigned n = 64;
         n <= 128 && error->code == 0 && n <= bench->options->nodes_max; n *= 2)
        (void)estimate(bench, n, slaves, error);
    return error->code;
}

/* --- goals ---------------------------------------------------------------- */

enum figure { DUPLICATION, EFFICIENCY, SPEED_UP };

struct goal {
    const char *set, *strategy;
    uint64_t points;
    unsigned nodes;
    enum figure figure;
    double goal, wanted, paper; /* 0: none */
    bool large;
};

static const struct goal goals[] = {
    {"Uniform", "exchange", 20000, 128, DUPLICATION, 1.10, 0, 1.66, false},
    {"Uniform", "exchange", 20000, 128, EFFICIENCY, 0.50, 0.60, 0.16, false},
    {"Uniform", "exchange", 20000, 16, EFFICIENCY, 0.85, 0, 0.56, false},
    {"Blunt Fin", "exchange", 10240, 128, SPEED_UP, 40, 0, 11, false},
    {"Uniform", "hybrid", 20000, 64, SPEED_UP, 25.0, 0, 0, false},
    {"Uniform", "hybrid", 20000, 128, SPEED_UP, 38.6, 0, 0, false},
    {"Uniform", "exchange", 1000000, 1024, EFFICIENCY, 0.60, 0.70, 0, true},
};

static bool meets(const struct goal *g, double value, double goal) {
    return g->figure == DUPLICATION ? value <= goal : value >= goal;
}

static void say(const struct host_paper_bench *bench, const struct goal *g,
                double value) {
    static const char *const figures[] = {"duplication factor", "efficiency",
                                          "speed-up"};
    char wanted[48] = "", paper[32] = "";
    if (g->wanted > 0) {
        (void)snprintf(wanted, sizeof wanted, ", wanted %.2f%s", g->wanted,
                       meets(g, value, g->wanted) ? " too" : "");
    }
    if (g->paper > 0)
        (void)snprintf(paper, sizeof paper, "; the paper's %.4g", g->paper);
    host_paper_note("%s on %s %llu, %u nodes: %s %.3f, goal %s %.4g%s: %s%s",
                    g->strategy, g->set, (unsigned long long)g->points,
                    g->nodes, figures[g->figure], value,
                    g->figure == DUPLICATION ? "<=" : ">=", g->goal, wanted,
                    bench->runs.quick          ? "not held to a tenth"
                    : meets(g, value, g->goal) ? "reached"
                                               : "missed",
                    paper);
}

static int hold(struct host_paper_bench *bench, const struct goal *g,
                struct host_error *error) {
    const struct host_paper_case c = {.set = g->set,
                                      .points = g->points,
                                      .strategy = g->strategy,
                                      .nodes = g->nodes};
    double alone_s = host_paper_alone_s(&bench->runs, &c, error);
    const struct host_paper_result *r =
        alone_s > 0 ? host_paper_run(&bench->runs, &c, error) : NULL;
    if (r != NULL) {
        double gain = alone_s / r->t_max;
        say(bench, g,
            g->figure == DUPLICATION  ? r->duplication
            : g->figure == EFFICIENCY ? gain / g->nodes
                                      : gain);
    }
    return error->code;
}

/* 0, or what a run ends with, be the goals reached or not. */
static int host_paper_goals(struct host_paper_bench *bench,
                            struct host_error *error) {
    const char *missing = "";
    host_paper_table(&bench->print, "goals", "Goals, modelled nCUBE 2");
    for (size_t i = 0; i < sizeof goals / sizeof goals[0]; i++) {
        const struct goal *g = &goals[i];
        bool wanted = g->nodes <= bench->options->nodes_max || g->large;
        if (!wanted || (g->large && !bench->options->large) ||
            strcmp(missing, g->strategy) == 0)
            continue;
        if (!host_paper_has(bench, g->strategy))
            missing = g->strategy;
        else if (hold(bench, g, error) != 0)
            return error->code;
    }
    return 0;
}

/* --- paper plot ----------------------------------------------------------- */

/* A curve: the paper's table, or what is run. */
struct curve {
    const char *title, *table; /* table: the paper's; NULL: modelled, */
    const char *strategy;      /* with this one */
    bool paper_rule;
    enum host_paper_machine machine;
    unsigned first, last;
};

static const struct curve curves[] = {
    {.title = "nCUBE 2, spatial decomposition, the paper", .table = "2"},
    {.title = "nCUBE 2, hybrid, the paper's estimate", .table = "5"},
    {.title = "Linda on IBM ws, spatial decomposition, the paper",
     .table = "3",
     .machine = HOST_PAPER_WORKSTATIONS},
    {.title = "modelled: spatial, the paper's rule",
     .strategy = "spatial",
     .paper_rule = true,
     .first = 1,
     .last = 256},
    {.title = "modelled: spatial",
     .strategy = "spatial",
     .first = 1,
     .last = 256},
    {.title = "modelled: exchange",
     .strategy = "exchange",
     .first = 1,
     .last = 256},
    {.title = "modelled: hybrid",
     .strategy = "hybrid",
     .first = 4,
     .last = 256},
    {.title = "modelled: workstations, spatial",
     .strategy = "spatial",
     .paper_rule = true,
     .machine = HOST_PAPER_WORKSTATIONS,
     .first = 1,
     .last = 8},
};

enum { CURVES = sizeof curves / sizeof curves[0] };

static void point(FILE *plot, unsigned nodes, double per_s, double mflops) {
    fprintf(plot, "%u %.6g %.6g\n", nodes, per_s, per_s / (nodes * mflops));
}

static void paper_curve(FILE *plot, const struct curve *curve, double mflops) {
    const struct host_paper_series *s =
        host_paper_find(curve->table, "Uniform", 20000, "");
    for (int i = 0; i < HOST_PAPER_ROWS && s->row[i].t_max > 0; i++) {
        point(plot, s->row[i].nodes, (double)s->tetrahedra / s->row[i].t_max,
              mflops);
    }
}

static int modelled_curve(struct host_paper_bench *bench, FILE *plot,
                          const struct curve *curve, double mflops,
                          struct host_error *error) {
    struct host_paper_case c = {.set = "Uniform",
                                .points = 20000,
                                .strategy = curve->strategy,
                                .paper_rule = curve->paper_rule,
                                .partition = curve->paper_rule ? HOST_UNIFORM
                                                               : HOST_ADAPTIVE,
                                .machine = curve->machine};
    unsigned most = bench->options->nodes_max;
    most = curve->last < most ? curve->last : most;
    for (c.nodes = curve->first; c.nodes <= most && error->code == 0;
         c.nodes *= 2) {
        const struct host_paper_result *r =
            host_paper_run(&bench->runs, &c, error);
        if (r != NULL)
            point(plot, c.nodes, (double)r->tetrahedra / r->t_max, mflops);
    }
    return error->code;
}

static bool drawn(const struct host_paper_bench *bench, const struct curve *c) {
    const char *only = bench->options->strategy;
    return c->table != NULL ||
           (host_strategy_named(c->strategy) != NULL &&
            (only == NULL || strcmp(only, c->strategy) == 0));
}

/* One panel; column: of the curves' data. */
static void panel(const struct host_paper_bench *bench, FILE *plot,
                  const char *title, int column) {
    fprintf(plot, "set title \"%s\"\nplot ", title);
    for (int i = 0; i < CURVES; i++) {
        const char *form = curves[i].table != NULL
                               ? "linespoints dashtype 2 pointtype 4"
                               : "linespoints pointtype 7 pointsize 0.5";
        if (drawn(bench, &curves[i])) {
            fprintf(plot, "%s$c%d using 1:%d with %s title \"%s\"",
                    i == 0 ? "" : ", ", i, column, form, curves[i].title);
        }
    }
    fprintf(plot, "\n");
}

static int draw(struct host_paper_bench *bench, FILE *plot,
                struct host_error *error) {
    for (int i = 0; i < CURVES && error->code == 0; i++) {
        const struct curve *c = &curves[i];
        double mflops = bench->runs.machine[c->machine].mflops;
        fprintf(plot, "$c%d << END\n", i);
        if (c->table != NULL)
            paper_curve(plot, c, mflops);
        else if (drawn(bench, c))
            (void)modelled_curve(bench, plot, c, mflops, error);
        fprintf(plot, "END\n");
    }
    fprintf(plot, "set terminal svg size 1000,520 dynamic\n"
                  "set multiplot layout 1,2\n"
                  "set logscale x\nset xrange [1:256]\n"
                  "set xlabel \"No. of pe's\"\nset yrange [0:*]\n"
                  "set key below vertical maxrows 8 font ',10'\n");
    panel(bench, plot, "tetrahedra a second (tps)", 2);
    panel(bench, plot, "tps / Mflop/s (tpMflops)", 3);
    fprintf(plot, "unset multiplot\n");
    return error->code;
}

/* Draws it where options->svg says, and prints what it shows.  0, what a run
 * ends with, or HOST_BROKEN where gnuplot does not draw. */
static int host_paper_figure_11(struct host_paper_bench *bench,
                                struct host_error *error) {
    const char *path = bench->options->svg;
    host_paper_table(
        &bench->print, "11",
        "Figure 11: tetrahedra a second, and a second and Mflop/s");
    if (path == NULL) {
        host_paper_note("The columns tps and tpMf of Tables 2, 3 and 5; --svg "
                        "FILE draws them.");
        return 0;
    }
    FILE *script = tmpfile();
    if (script == NULL) {
        return host_fail(error, HOST_BROKEN, "%s: %s; free memory", path,
                         strerror(errno));
    }
    int status = draw(bench, script, error);
    status = status != 0 ? status : host_gnuplot_draw(script, path, error);
    (void)fclose(script);
    if (status == 0)
        host_paper_note("Drawn in %s.", path);
    return status;
}

/* --- bench paper ---------------------------------------------------------- */

static const struct {
    const char *name;
    int (*print)(struct host_paper_bench *bench, struct host_error *error);
} tables[] = {
    {"1", host_paper_table_1},         {"2", host_paper_table_2},
    {"3", host_paper_table_3},         {"4", host_paper_table_4},
    {"5", host_paper_table_5},         {"6", host_paper_table_6},
    {"7", host_paper_table_7},         {"11", host_paper_figure_11},
    {"relation", host_paper_relation}, {"goals", host_paper_goals},
    {"check", host_paper_check},
};

enum { TABLES = sizeof tables / sizeof tables[0] };

const char host_paper_tables[] =
    "1, 2, 3, 4, 5, 6, 7, 11, relation, goals, check";

/* Whether `name` is among `list`, names with commas between. */
static bool among(const char *list, const char *name) {
    size_t length = strlen(name);
    for (const char *at = list; at != NULL; at = strchr(at, ',')) {
        at += *at == ',' ? 1 : 0;
        if (strncmp(at, name, length) == 0 &&
            (at[length] == ',' || at[length] == '\0'))
            return true;
    }
    return false;
}

static int check_tables(const char *list, struct host_error *error) {
    for (const char *at = list; at != NULL && *at != '\0';) {
        size_t length = strcspn(at, ",");
        bool known = false;
        for (int i = 0; i < TABLES; i++) {
            known = known || (strlen(tables[i].name) == length &&
                              strncmp(tables[i].name, at, length) == 0);
        }
        if (!known) {
            return host_fail(error, HOST_USAGE,
                             "--table %.*s: not in this version; allowed: %s",
                             (int)length, at, host_paper_tables);
        }
        at += length + (at[length] == ',' ? 1 : 0);
    }
    return 0;
}

static void print_model(const struct host_paper_bench *bench) {
    const struct host_bench_machine *n = &bench->runs.machine[HOST_PAPER_NCUBE];
    const struct host_bench_machine *w =
        &bench->runs.machine[HOST_PAPER_WORKSTATIONS];
    printf("Modelled, where it is said: host and nodes as they are, in virtual "
           "time. A node's\nprocessor takes scale * (");
    for (int k = 0; k < HOST_BENCH_COUNTS; k++) {
        printf("%s%.3g ns * %s", k == 0 ? "" : " + ", host_bench_prices[k],
               host_bench_count_names[k]);
    }
    printf(
        ")\nand so many us a message at each end; a message takes on each "
        "wire of its way its bytes\nover the rate and the latency.\n"
        "%s: scale %.0f, which makes the work of sequential on Uniform "
        "20,000 %.2f s as in\nthe paper; %.2f MB/s and %.1f Mflop/s a node "
        "(the paper's); %u us a hop, %.0f us a message,\nlinks beside the "
        "processor (assumed).\n"
        "%s: scale %.0f, to %.2f s; one shared Ethernet of 10 Mbit/s and "
        "%.0f Mflop/s (the\npaper's); %u us of latency, %.0f us a message "
        "(assumed).\n"
        "t_IO: the pages that the host has sent, over its wire, and the last "
        "down the tree; the\npaper's was a disk's. Speed-ups are against "
        "sequential on one node. tps: tetrahedra a\nsecond; tpMf: these a "
        "Mflop/s.%s\n",
        n->name, n->scale, n->work_s, 1e-6 * n->wire.bytes_per_s, n->mflops,
        n->wire.latency_us, n->message_us, w->name, w->scale, w->work_s,
        w->mflops, w->wire.latency_us, w->message_us,
        bench->runs.quick ? " Quick: a tenth of the points, beside the "
                            "paper's figures for all."
                          : "");
    (void)fflush(stdout);
}

static int print_tables(struct host_paper_bench *bench,
                        struct host_error *error) {
    const struct host_paper_options *o = bench->options;
    host_progress_phase("calibrating", NULL);
    if (host_paper_runs_begin(&bench->runs, error) != 0)
        return error->code;
    host_progress_erase();
    print_model(bench);
    for (int i = 0; i < TABLES && error->code == 0; i++)
        if (o->tables == NULL || among(o->tables, tables[i].name))
            (void)tables[i].print(bench, error);
    return error->code;
}

int host_bench_paper(const struct host_paper_options *options,
                     struct host_error *error) {
    if (check_tables(options->tables, error) != 0)
        return error->code;
    if (options->strategy != NULL &&
        host_strategy_named(options->strategy) == NULL) {
        return host_fail(error, HOST_USAGE,
                         "--strategy %s: not in this version; see incode run "
                         "--help",
                         options->strategy);
    }
    if (options->svg != NULL &&
        (options->tables == NULL || among(options->tables, "11")
             ? host_gnuplot_there(options->svg, error)
             : host_fail(
                   error, HOST_USAGE,
                   "--svg: goes with table 11; name it, or leave --svg out")) !=
            0)
        return error->code;
    struct host_paper_bench *bench = calloc(1, sizeof *bench);
    if (bench == NULL)
        return host_fail_memory(error, "the tables");
    bench->options = options;
    bench->runs.quick = options->quick;
    bench->runs.bluntfin = options->bluntfin;
    host_progress_begin(true);
    int status = host_paper_print_begin(&bench->print, options->csv, error);
    if (status == 0) {
        status = print_tables(bench, error);
        struct host_error later = {0};
        int closed = host_paper_print_end(&bench->print, options->csv,
                                          status == 0 ? error : &later);
        status = status != 0 ? status : closed;
    }
    host_progress_end();
    host_paper_runs_end(&bench->runs);
    free(bench);
    return status;
}
