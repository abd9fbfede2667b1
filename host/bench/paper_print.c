#include "paper_print.h"

#include <errno.h>
#include <stdarg.h>
#include <string.h>

#include "host/base/create.h"
#include "host/base/progress.h"
#include "host/mesh/names.h"

int host_paper_print_begin(struct host_paper_print *print, const char *csv,
                           struct host_error *error) {
    *print = (struct host_paper_print){NULL, ""};
    if (csv == NULL) {
        return 0;
    }
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
    if (file == NULL) {
        return 0;
    }
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

void host_paper_head(const char *first, const char *format, ...) {
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
    if (value > 0) {
        printf(" %*.*f", width, digits, value);
    } else {
        printf(" %*s", width, "-");
    }
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
    if (value > 0) {
        fprintf(file, "%.9g", value);
    }
    fputc(end, file);
}

void host_paper_csv_row(struct host_paper_print *print,
                        const struct host_paper_csv *r) {
    FILE *f = print->csv;
    if (f == NULL) {
        return;
    }
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

void host_paper_line(struct host_paper_print *print,
                     const struct host_paper_result *result, double alone_s,
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
    if (row != NULL) {
        paper_half(series, row, nodes);
    }
    printf("\n");
    (void)fflush(stdout);
    csv_of(print, r, speed_up, machine, row);
}
