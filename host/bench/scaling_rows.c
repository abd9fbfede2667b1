#include "scaling_rows.h"

#include <errno.h>
#include <stdbool.h>
#include <string.h>

#include "gnuplot.h"
#include "host/base/progress.h"

const char *const host_scaling_strategies[HOST_SCALING_STRATEGIES] = {
    "spatial", "exchange"};

static const double most_of_a_million = 1.15;

/* Nanoseconds for each of so many. */
static double each(double s, uint64_t count) {
    return 1e9 * s / (double)count;
}

static const struct host_scaling_point *
row_of(const struct host_scaling_rows *rows, uint64_t points) {
    for (unsigned i = 0; i < rows->points; i++) {
        if (rows->point[i].points == points) {
            return &rows->point[i];
        }
    }
    return NULL;
}

void host_scaling_points_head(struct host_scaling_rows *rows) {
    host_progress_erase();
    printf("Uniform points, sequential on one node of 4M: ns of processor time "
           "a point, of the\nnode, of the host (files apart) and of both; ns a "
           "tetrahedron of both; ns by the clock\na point; the node's against "
           "the node's of 1,000,000 points.  The least of so many runs.\n\n"
           "%10s %10s %4s %8s %8s %8s %8s %8s %6s\n",
           "points", "tetrahedra", "runs", "node", "host", "both", "a tet.",
           "clock", "/ 1M");
    (void)fflush(stdout);
    if (rows->csv != NULL) {
        fputs("how,strategy,nodes,points,tetrahedra,node_ns,host_ns,clock_ns,"
              "busiest_ns,all_ns,wire_bytes\n",
              rows->csv);
    }
}

void host_scaling_points_row(struct host_scaling_rows *rows,
                             const struct host_scaling_point *point) {
    const struct host_scaling_point *p = &rows->point[rows->points++];
    rows->point[rows->points - 1] = *point;
    const struct host_scaling_point *million = row_of(rows, 1000000);
    double node = each(p->node_s, p->points);
    double host = each(p->host_s, p->points);
    double clock = each(p->wall_s, p->points);
    host_progress_erase();
    printf("%10llu %10llu %4u %8.0f %8.0f %8.0f %8.0f %8.0f",
           (unsigned long long)p->points, (unsigned long long)p->tetrahedra,
           p->runs, node, host, node + host,
           each(p->node_s + p->host_s, p->tetrahedra), clock);
    if (million != NULL) {
        double ratio = node / each(million->node_s, million->points);
        printf(" %6.2f", ratio);
        if (p->points == 10000000) {
            printf(" <=%.2f%s", most_of_a_million,
                   ratio <= most_of_a_million ? "" : "!");
        }
    }
    printf("\n");
    (void)fflush(stdout);
    if (rows->csv != NULL) {
        fprintf(rows->csv,
                "measured,sequential,1,%llu,%llu,%.6g,%.6g,%.6g,,,\n",
                (unsigned long long)p->points,
                (unsigned long long)p->tetrahedra, node, host, clock);
    }
}

void host_scaling_nodes_head(uint64_t points) {
    host_progress_erase();
    printf("\nUniform %llu in virtual time, at the prices of this machine's "
           "model, as processes here\nshare processors: ns of processor time a "
           "point, of the busiest node and of all\ntogether; speed-up and "
           "efficiency by the busiest; bytes on the host's wire a\n"
           "tetrahedron, all that there are.\n\n%5s",
           (unsigned long long)points, "nodes");
    for (int i = 0; i < HOST_SCALING_STRATEGIES; i++) {
        printf(" | %-8s %8s %8s %5s %6s", host_scaling_strategies[i], "all",
               "speed-up", "eff.", "bytes");
    }
    printf("\n");
    (void)fflush(stdout);
}

/* The first of the strategy. */
static double alone(const struct host_scaling_rows *rows,
                    const char *strategy) {
    unsigned i = 0;
    while (strcmp(rows->node[i].strategy, strategy) != 0) {
        i++;
    }
    return rows->node[i].busiest_s;
}

void host_scaling_nodes_row(struct host_scaling_rows *rows,
                            const struct host_scaling_node *node) {
    const struct host_scaling_node *n = &rows->node[rows->nodes++];
    rows->node[rows->nodes - 1] = *node;
    double speed_up = alone(rows, n->strategy) / n->busiest_s;
    double bytes = n->wire_bytes / (double)n->tetrahedra;
    bool first = strcmp(n->strategy, host_scaling_strategies[0]) == 0;
    host_progress_erase();
    if (first) {
        printf("%5u", n->nodes);
    }
    printf(" | %8.1f %8.1f %8.2f %5.2f %6.2f", each(n->busiest_s, n->points),
           each(n->all_s, n->points), speed_up, speed_up / n->nodes, bytes);
    printf("%s",
           strcmp(n->strategy,
                  host_scaling_strategies[HOST_SCALING_STRATEGIES - 1]) == 0
               ? "\n"
               : "");
    (void)fflush(stdout);
    if (rows->csv != NULL) {
        fprintf(rows->csv, "modelled,%s,%u,%llu,%llu,,,,%.6g,%.6g,%.6g\n",
                n->strategy, n->nodes, (unsigned long long)n->points,
                (unsigned long long)n->tetrahedra,
                each(n->busiest_s, n->points), each(n->all_s, n->points),
                bytes);
    }
}

/* --- the figure ----------------------------------------------------------- */

static void put_data(const struct host_scaling_rows *rows, FILE *plot) {
    fprintf(plot, "$p << END\n");
    for (unsigned i = 0; i < rows->points; i++) {
        const struct host_scaling_point *p = &rows->point[i];
        fprintf(plot, "%llu %.6g %.6g %.6g\n", (unsigned long long)p->points,
                each(p->node_s, p->points), each(p->host_s, p->points),
                each(p->node_s + p->host_s, p->points));
    }
    fprintf(plot, "END\n");
    for (int k = 0; k < HOST_SCALING_STRATEGIES; k++) {
        fprintf(plot, "$n%d << END\n", k);
        for (unsigned i = 0; i < rows->nodes; i++) {
            const struct host_scaling_node *n = &rows->node[i];
            if (strcmp(n->strategy, host_scaling_strategies[k]) == 0) {
                fprintf(plot, "%u %.6g %.6g\n", n->nodes,
                        each(n->busiest_s, n->points),
                        each(n->all_s, n->points));
            }
        }
        fprintf(plot, "END\n");
    }
}

static void put_panels(FILE *plot) {
    static const char form[] = "with linespoints pointtype 7 pointsize 0.5";
    fprintf(plot,
            "set terminal svg size 1000,520 dynamic\n"
            "set multiplot layout 1,2\nset logscale x\n"
            "set key below vertical maxrows 4 font ',10'\n"
            "set title \"ns of processor time a point, one node of 4M\"\n"
            "set xlabel \"points\"\nset format x \"10^{%%L}\"\n"
            "set yrange [0:*]\n"
            "plot $p using 1:2 %s title \"node\", $p using 1:3 %s title "
            "\"host\", $p using 1:4 %s title \"both\"\n"
            "set title \"ns a point in virtual time\"\n"
            "set xlabel \"nodes\"\nset format x \"%%g\"\n"
            "set logscale x 2\nset logscale y\nset yrange [*:*]\nplot ",
            form, form, form);
    for (int k = 0; k < HOST_SCALING_STRATEGIES; k++) {
        fprintf(plot,
                "%s$n%d using 1:2 %s title \"%s: the busiest node\", $n%d "
                "using 1:3 %s title \"%s: all nodes\"",
                k == 0 ? "" : ", ", k, form, host_scaling_strategies[k], k,
                form, host_scaling_strategies[k]);
    }
    fprintf(plot, "\nunset multiplot\n");
}

int host_scaling_draw(const struct host_scaling_rows *rows, const char *path,
                      struct host_error *error) {
    FILE *script = tmpfile();
    if (script == NULL) {
        return host_fail(error, HOST_BROKEN, "%s: %s; free memory", path,
                         strerror(errno));
    }
    put_data(rows, script);
    put_panels(script);
    int status = host_gnuplot_draw(script, path, error);
    (void)fclose(script);
    return status;
}
