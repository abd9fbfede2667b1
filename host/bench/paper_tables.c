#include "paper_tables.h"

#include <string.h>

#include "host/mesh/names.h"
#include "host/service/strategies/strategies.h"

/* Rows of one strategy on one set. */
struct series {
    struct host_paper_case c; /* but for its nodes */
    const struct host_paper_series *paper;
    unsigned first, last; /* nodes, doubled from row to row */
};

bool host_paper_has(const struct host_paper_bench *bench,
                    const char *strategy) {
    const char *only = bench->options->strategy;
    if (only != NULL && strcmp(only, strategy) != 0) {
        return false;
    }
    if (host_strategy_named(strategy) == NULL) {
        host_paper_note("%s: not there yet", strategy);
        return false;
    }
    return true;
}

static int row(struct host_paper_bench *bench, const struct series *s,
               const struct host_paper_case *c,
               const struct host_paper_row *paper, struct host_error *error) {
    double alone_s = host_paper_alone_s(&bench->runs, c, error);
    const struct host_paper_result *r =
        alone_s > 0 ? host_paper_run(&bench->runs, c, error) : NULL;
    if (r != NULL) {
        host_paper_line(&bench->print, r, alone_s,
                        &bench->runs.machine[c->machine], s->paper, paper);
    }
    return error->code;
}

static void head(const struct host_paper_bench *bench, const struct series *s,
                 const char *first) {
    const struct host_paper_case *c = &s->c;
    host_paper_head(first, "%s %llu%s, %s, %s partition%s; modelled %s%s",
                    c->set, (unsigned long long)c->points,
                    bench->runs.quick ? " / 10" : "", c->strategy,
                    host_partitions[c->partition],
                    c->paper_rule ? ", the paper's rule" : "",
                    bench->runs.machine[c->machine].name,
                    s->paper != NULL ? " | the paper's figures" : "");
}

static int series(struct host_paper_bench *bench, const struct series *s,
                  struct host_error *error) {
    struct host_paper_case c = s->c;
    unsigned most = bench->options->nodes_max;
    if (!host_paper_has(bench, c.strategy)) {
        return 0;
    }
    head(bench, s, "nodes");
    most = s->last < most ? s->last : most;
    for (c.nodes = s->first; c.nodes <= most && error->code == 0;
         c.nodes *= 2) {
        (void)row(bench, s, &c, host_paper_row_of(s->paper, c.nodes), error);
    }
    return error->code;
}

/* A manager, and so many builders beside it, in the least cube that has them.
 */
static int builders(struct host_paper_bench *bench, const struct series *s,
                    struct host_error *error) {
    struct host_paper_case c = s->c;
    if (!host_paper_has(bench, c.strategy)) {
        return 0;
    }
    head(bench, s, "build");
    for (unsigned i = 0; i < HOST_PAPER_ROWS && error->code == 0; i++) {
        const struct host_paper_row *paper = &s->paper->row[i];
        c.builders = paper->nodes;
        for (c.nodes = 1; c.nodes < c.builders + 1; c.nodes *= 2) {
        }
        if (paper->t_max > 0 && c.nodes <= bench->options->nodes_max) {
            struct host_paper_case alone = s->c;
            alone.strategy = "sequential";
            alone.nodes = 1;
            (void)row(bench, s, c.builders == 0 ? &alone : &c, paper, error);
        }
    }
    return error->code;
}

int host_paper_table_2(struct host_paper_bench *bench,
                       struct host_error *error) {
    host_paper_table(&bench->print, "2",
                     "Table 2: spatial decomposition of uniform sets, and what "
                     "goes beyond it");
    for (uint64_t n = 10000; n <= 20000 && error->code == 0; n += 10000) {
        struct series s = {.c = {.set = "Uniform",
                                 .points = n,
                                 .strategy = "spatial",
                                 .paper_rule = true,
                                 .partition = HOST_UNIFORM},
                           .paper = host_paper_find("2", "Uniform", n, ""),
                           .first = 1,
                           .last = 256};
        (void)series(bench, &s, error);
        s.c.paper_rule = false;
        s.c.partition = HOST_ADAPTIVE;
        (void)(error->code != 0 || series(bench, &s, error));
        s.c.strategy = "exchange";
        (void)(error->code != 0 || series(bench, &s, error));
    }
    return error->code;
}

int host_paper_table_3(struct host_paper_bench *bench,
                       struct host_error *error) {
    host_paper_table(&bench->print, "3",
                     "Table 3: spatial decomposition over Linda, and by "
                     "messages, on workstations");
    for (uint64_t n = 10000; n <= 20000 && error->code == 0; n += 10000) {
        struct series s = {.c = {.set = "Uniform",
                                 .points = n,
                                 .strategy = "linda-spatial",
                                 .partition = HOST_UNIFORM,
                                 .machine = HOST_PAPER_WORKSTATIONS},
                           .paper = host_paper_find("3", "Uniform", n, ""),
                           .first = 1,
                           .last = 8};
        (void)series(bench, &s, error);
        s.c.strategy = "spatial";
        s.c.paper_rule = true;
        (void)(error->code != 0 || series(bench, &s, error));
    }
    return error->code;
}

int host_paper_table_4(struct host_paper_bench *bench,
                       struct host_error *error) {
    static const struct {
        const char *set;
        uint64_t points;
    } sets[] = {{"Uniform", 10000}, {"Bubbles", 20000}, {"Blunt Fin", 10240}};
    host_paper_table(&bench->print, "4",
                     "Table 4: adaptive and uniform partition");
    host_paper_note("Blunt Fin: every second node along the second and third "
                    "index of %s",
                    bench->runs.bluntfin == NULL ? "the program's own grid"
                                                 : bench->runs.bluntfin);
    for (unsigned i = 0; i < 3 && error->code == 0; i++) {
        struct series s = {.c = {.set = sets[i].set,
                                 .points = sets[i].points,
                                 .strategy = "spatial",
                                 .paper_rule = true},
                           .first = 1,
                           .last = 256};
        for (unsigned k = 0; k < 2 && error->code == 0; k++) {
            s.c.partition = k == 0 ? HOST_ADAPTIVE : HOST_UNIFORM;
            s.paper = host_paper_find("4", s.c.set, s.c.points,
                                      k == 0 ? "adaptive" : "uniform");
            (void)series(bench, &s, error);
        }
        s.c.partition = HOST_ADAPTIVE;
        s.c.paper_rule = false;
        s.c.strategy = "exchange";
        s.paper = host_paper_find("4", s.c.set, s.c.points, "adaptive");
        (void)(error->code != 0 || series(bench, &s, error));
    }
    return error->code;
}

int host_paper_table_5(struct host_paper_bench *bench,
                       struct host_error *error) {
    host_paper_table(&bench->print, "5",
                     "Table 5: clusters of four nodes, which the authors "
                     "estimated");
    const struct series s = {
        .c = {.set = "Uniform", .points = 20000, .strategy = "hybrid"},
        .paper = host_paper_find("5", "Uniform", 20000, ""),
        .first = 4,
        .last = 256};
    return series(bench, &s, error);
}

int host_paper_table_6(struct host_paper_bench *bench,
                       struct host_error *error) {
    static const uint64_t points[] = {4000, 6000, 8000, 10000, 20000};
    host_paper_table(&bench->print, "6",
                     "Table 6: a face manager and its tetrahedron builders");
    for (unsigned i = 0; i < 5 && error->code == 0; i++) {
        const struct series s = {
            .c = {.set = "Uniform",
                  .points = points[i],
                  .strategy = "master-slaves"},
            .paper = host_paper_find("6", "Uniform", points[i], "")};
        (void)builders(bench, &s, error);
    }
    return error->code;
}

int host_paper_table_7(struct host_paper_bench *bench,
                       struct host_error *error) {
    host_paper_table(&bench->print, "7",
                     "Table 7: the same over Linda, on workstations");
    for (uint64_t n = 10000; n <= 20000 && error->code == 0; n += 10000) {
        const struct series s = {.c = {.set = "Uniform",
                                       .points = n,
                                       .strategy = "linda",
                                       .machine = HOST_PAPER_WORKSTATIONS},
                                 .paper =
                                     host_paper_find("7", "Uniform", n, "")};
        (void)builders(bench, &s, error);
    }
    return error->code;
}
