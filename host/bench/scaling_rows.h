/* The rows of `incode bench scaling`: printed, as CSV, and drawn.
 *
 * Memory: struct host_scaling_rows.  Work: a line a row.
 *
 *     struct host_scaling_rows rows = {.csv = NULL};
 *     host_scaling_points_row(&rows, &point);
 *     if (rows.points > 0)
 *         host_scaling_draw(&rows, "scaling.svg", &error);
 */
#ifndef HOST_BENCH_SCALING_ROWS_H
#define HOST_BENCH_SCALING_ROWS_H

#include <stdint.h>
#include <stdio.h>

#include "host/base/error.h"

enum { HOST_SCALING_ROWS = 24, HOST_SCALING_STRATEGIES = 2 };

/* Seconds of one run; the clock's from the points in memory to the last
 * tetrahedron. */
struct host_scaling_point {
    uint64_t points, tetrahedra;
    unsigned runs;
    double node_s, host_s, wall_s;
};

/* Of a strategy in virtual time: the busiest node, and all. */
struct host_scaling_node {
    const char *strategy;
    unsigned nodes;
    uint64_t points, tetrahedra;
    double busiest_s, all_s, wire_bytes;
};

struct host_scaling_rows {
    FILE *csv; /* NULL: none */
    struct host_scaling_point point[HOST_SCALING_ROWS];
    unsigned points;
    struct host_scaling_node node[HOST_SCALING_STRATEGIES * HOST_SCALING_ROWS];
    unsigned nodes;
};

extern const char *const host_scaling_strategies[HOST_SCALING_STRATEGIES];

/* The heads of both tables. */
void host_scaling_points_head(struct host_scaling_rows *rows);
void host_scaling_nodes_head(uint64_t points);

/* Takes a row and prints it.  One of 10,000,000 points is held to 1.15 times
 * what a point costs of 1,000,000. */
void host_scaling_points_row(struct host_scaling_rows *rows,
                             const struct host_scaling_point *point);
void host_scaling_nodes_row(struct host_scaling_rows *rows,
                            const struct host_scaling_node *node);

/* 0, or as host_gnuplot_draw. */
int host_scaling_draw(const struct host_scaling_rows *rows, const char *path,
                      struct host_error *error);

#endif
