#include <errno.h>
#include <stdarg.h>
#include <string.h>

#include "paper.h"
#include "host/base/create.h"
#include "host/base/progress.h"
#include "host/mesh/points.h"
#include "host/service/strategies/strategies.h"

int host_paper_print_begin(struct host_paper_print *print, const char *csv,
                           struct host_error *error) {
    *print = (struct host_paper_print){NULL, ""};
    if (csv == NULL)
        return 0;
    print->csv = host_create_over(csv);
    if (print->csv == NULL) {
        return host_fail(error, HOST_INPUT, "%s: %s; choose another file", csv,
                         strerror(errno));
    }
    fputs("table,set,points,machine,how,strategy,partition,face_rule,index,"
          "nodes,builders,t_min_s,t_max_s,t_io_s,speed_up,efficiency,"
          "tetrahedra,duplication_factor,tetrahedra_per_s,"
          "tetrahedra_per_mflops,paper_t_min_s,paper_t_max_s,paper_t_io_s,"
          "paper_duplication_factor\n",
          print->csv);
    return 0;
}

int host_paper_print_end(struct host_paper_print *print, const char *csv,
                         struct host_error *error) {
    FILE *file = print->csv;
    print->csv = NULL;
    if (file == NULL)
        return 0;
    bool well = ferror(file) == 0;
    well = fclose(file) == 0 && well;
    return well ? 0
                : host_fail(error, HOST_BROKEN, "%s: %s; choose another place",
                            csv, strerror(errno));
}

void host_paper_table(struct host_paper_print *print, const char *table,
                      const char *title) {
    host_progress_erase();
    print->table = table;
    printf("\n%s\n", title);
    (void)fflush(stdout);
}

void host_paper_note(const char *format, ...) {
    va_list arguments;
    host_progress_erase();
    va_start(arguments, format);
    (void)vprintf(format, arguments);
    va_end(arguments);
    printf("\n");
    (void)fflush(stdout);
}

static void host_paper_head(const char *first, const char *format, ...) {
    va_list arguments;
    host_progress_erase();
    printf("\n");
    va_start(arguments, format);
    (void)vprintf(format, arguments);
    va_end(arguments);
    printf("\n%-5s %8s %8s %6s %7s %5s %8s %6s %8s %6s | %8s %8s %6s %7s %5s "
           "%5s %6s\n",
           first, "t_min", "t_max", "t_IO", "speedup", "eff.", "tetra.",
           "dupl.", "tps", "tpMf", "t_min", "t_max", "t_IO", "speedup", "eff.",
           "dupl.", "tps");
    (void)fflush(stdout);
}

static double over(double a, double b) {
    return b > 0 ? a / b : 0;
}

/* "-" for what is not known. */
static void number(int width, int digits, double value) {
    if (value > 0)
        printf(" %*.*f", width, digits, value);
    else
        printf(" %*s", width, "-");
}

/* Nodes that an efficiency is of: a manager, and its builders. */
static unsigned elements_of(unsigned nodes, unsigned builders) {
    return builders > 0 ? builders + 1 : nodes;
}

static void paper_half(const struct host_paper_series *series,
                       const struct host_paper_row *row, unsigned nodes) {
    double speed_up = over(series->alone_s, row->t_max);
    printf(" |");
    number(8, 2, row->t_min);
    number(8, 2, row->t_max);
    number(6, 2, row->t_io);
    number(7, 2, speed_up);
    number(5, 2, speed_up / nodes);
    number(5, 2, row->duplication);
    number(6, 0, over((double)series->tetrahedra, row->t_max));
}

static void csv_text(FILE *file, const char *text) {
    fprintf(file, "%s,", text == NULL ? "" : text);
}

static void csv_number(FILE *file, double value, char end) {
    if (value > 0)
        fprintf(file, "%.9g", value);
    fputc(end, file);
}

void host_paper_csv_row(struct host_paper_print *print,
                        const struct host_paper_csv *r) {
    FILE *f = print->csv;
    if (f == NULL)
        return;
    double per_s = over((double)r->tetrahedra, r->t_max);
    unsigned elements = elements_of(r->nodes, r->builders);
    csv_text(f, print->table);
    csv_text(f, r->set);
    csv_number(f, (double)r->points, ',');
    csv_text(f, r->machine);
    csv_text(f, r->how);
    csv_text(f, r->strategy);
    csv_text(f, r->partition);
    csv_text(f, r->face_rule);
    csv_text(f, r->index);
    csv_number(f, r->nodes, ',');
    csv_number(f, r->builders, ',');
    csv_number(f, r->t_min, ',');
    csv_number(f, r->t_max, ',');
    csv_number(f, r->t_io, ',');
    csv_number(f, r->speed_up, ',');
    csv_number(f, over(r->speed_up, elements), ',');
    csv_number(f, (double)r->tetrahedra, ',');
    csv_number(f, r->duplication, ',');
    csv_number(f, per_s, ',');
    csv_number(f, over(per_s, r->mflops * elements), ',');
    csv_number(f, r->paper_t_min, ',');
    csv_number(f, r->paper_t_max, ',');
    csv_number(f, r->paper_t_io, ',');
    csv_number(f, r->paper_duplication, '\n');
    (void)fflush(f);
}

static void csv_of(struct host_paper_print *print,
                   const struct host_paper_result *r, double speed_up,
                   const struct host_bench_machine *machine,
                   const struct host_paper_row *row) {
    static const struct host_paper_row none;
    const struct host_paper_row *p = row == NULL ? &none : row;
    const struct host_paper_csv line = {
        .set = r->c.set,
        .machine = machine->name,
        .how = "modelled",
        .strategy = r->c.strategy,
        .partition = host_partitions[r->c.partition],
        .face_rule = r->c.paper_rule ? "paper" : "own",
        .index = "kd",
        .points = r->points,
        .tetrahedra = r->tetrahedra,
        .nodes = r->c.nodes,
        .builders = r->c.builders,
        .t_min = r->t_min,
        .t_max = r->t_max,
        .t_io = r->t_io,
        .speed_up = speed_up,
        .duplication = r->duplication,
        .mflops = machine->mflops,
        .paper_t_min = p->t_min,
        .paper_t_max = p->t_max,
        .paper_t_io = p->t_io,
        .paper_duplication = p->duplication};
    host_paper_csv_row(print, &line);
}

/* A row; alone_s: what its speed-up is against; the paper's series and row
 * beside it, or NULL. */
static void host_paper_line(struct host_paper_print *print,
                            const struct host_paper_result *result,
                            double alone_s,
                            const struct host_bench_machine *machine,
                            const struct host_paper_series *series,
                            const struct host_paper_row *row) {
    const struct host_paper_result *r = result;
    unsigned nodes = elements_of(r->c.nodes, r->c.builders);
    double speed_up = over(alone_s, r->t_max);
    double per_s = over((double)r->tetrahedra, r->t_max);
    char first[16] = "seq.";
    if (strcmp(r->c.strategy, "sequential") != 0) {
        (void)snprintf(first, sizeof first, "%u",
                       r->c.builders > 0 ? r->c.builders : r->c.nodes);
    }
    host_progress_erase();
    printf("%-5s %8.2f %8.2f", first, r->t_min, r->t_max);
    number(6, 2, r->t_io);
    number(7, 2, speed_up);
    number(5, 2, speed_up / nodes);
    number(8, 0, (double)r->tetrahedra);
    number(6, 3, r->duplication);
    number(8, 0, per_s);
    number(6, 1, over(per_s, machine->mflops * nodes));
    if (row != NULL)
        paper_half(series, row, nodes);
    printf("\n");
    (void)fflush(stdout);
    csv_of(print, r, speed_up, machine, row);
}

/* --- paper tables --------------------------------------------------------- */

/* Rows of one strategy on one set. */
struct series {
    struct host_paper_case c; /* but for its nodes */
    const struct host_paper_series *paper;
    unsigned first, last; /* nodes, doubled from row to row */
};

bool host_paper_has(const struct host_paper_bench *bench,
                    const char *strategy) {
    const char *only = bench->options->strategy;
    if (only != NULL && strcmp(only, strategy) != 0)
        return false;
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
    if (!host_paper_has(bench, c.strategy))
        return 0;
    head(bench, s, "nodes");
    most = s->last < most ? s->last : most;
    for (c.nodes = s->first; c.nodes <= most && error->code == 0; c.nodes *= 2)
        (void)row(bench, s, &c, host_paper_row_of(s->paper, c.nodes), error);
    return error->code;
}

/* A manager, and so many builders beside it, in the least cube that has them.
 */
static int builders(struct host_paper_bench *bench, const struct series *s,
                    struct host_error *error) {
    struct host_paper_case c = s->c;
    if (!host_paper_has(bench, c.strategy))
        return 0;
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
