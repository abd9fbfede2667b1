#include "paper_plot.h"

#include <errno.h>
#include <string.h>

#include "gnuplot.h"
#include "host/base/progress.h"
#include "host/service/strategies/strategies.h"

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
        if (r != NULL) {
            point(plot, c.nodes, (double)r->tetrahedra / r->t_max, mflops);
        }
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
        if (c->table != NULL) {
            paper_curve(plot, c, mflops);
        } else if (drawn(bench, c)) {
            (void)modelled_curve(bench, plot, c, mflops, error);
        }
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

int host_paper_figure_11(struct host_paper_bench *bench,
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
    if (status == 0) {
        host_paper_note("Drawn in %s.", path);
    }
    return status;
}
