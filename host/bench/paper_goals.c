#include "paper_goals.h"

#include <math.h>
#include <string.h>

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

int host_paper_relation(struct host_paper_bench *bench,
                        struct host_error *error) {
    double slaves = 0;
    host_paper_table(&bench->print, "relation",
                     "Relation (1): S_spatial(4N) / S_spatial(N) < "
                     "S_master-slaves(4), Uniform 20,000");
    for (unsigned n = 16; n <= 32; n *= 2) {
        paper_relation(n);
    }
    if (!host_paper_has(bench, "master-slaves")) {
        return 0;
    }
    slaves = speed_up(bench, "master-slaves", 4, error);
    for (unsigned n = 16;
         n <= 64 && error->code == 0 && 4 * n <= bench->options->nodes_max;
         n *= 2) {
        (void)model_relation(bench, n, slaves, error);
    }
    for (unsigned n = 64;
         n <= 128 && error->code == 0 && n <= bench->options->nodes_max;
         n *= 2) {
        (void)estimate(bench, n, slaves, error);
    }
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
    if (g->paper > 0) {
        (void)snprintf(paper, sizeof paper, "; the paper's %.4g", g->paper);
    }
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

int host_paper_goals(struct host_paper_bench *bench, struct host_error *error) {
    const char *missing = "";
    host_paper_table(&bench->print, "goals", "Goals, modelled nCUBE 2");
    for (size_t i = 0; i < sizeof goals / sizeof goals[0]; i++) {
        const struct goal *g = &goals[i];
        bool wanted = g->nodes <= bench->options->nodes_max || g->large;
        if (!wanted || (g->large && !bench->options->large) ||
            strcmp(missing, g->strategy) == 0) {
            continue;
        }
        if (!host_paper_has(bench, g->strategy)) {
            missing = g->strategy;
        } else if (hold(bench, g, error) != 0) {
            return error->code;
        }
    }
    return 0;
}
