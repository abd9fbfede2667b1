/* A class of `incode bench peers` as a table: a row a set, goals beside what
 * is held to them, and the ratios of all rows. */
#ifndef HOST_BENCH_TABLE_H
#define HOST_BENCH_TABLE_H

#include <stdio.h>

#include "bench_peers.h"
#include "host/base/error.h"

enum { HOST_BENCH_ROWS_MAX = 4096 };

/* Medians, in seconds; 0: not measured, or not brought to its end. */
struct host_bench_result {
    const char *name;
    uint64_t points, tetrahedra, pages, pages_asked;
    double node, other;    /* of nodes, and of nodes the other way */
    double host, host_all; /* to the last tetrahedron; files apart */
    double peer[HOST_BENCH_PEERS];
    bool late, other_late, peer_late[HOST_BENCH_PEERS];
    double ratio, seconds, step; /* goals; 0: none */
};

struct host_bench_table {
    const struct host_bench_class *class;
    bool peer[HOST_BENCH_PEERS]; /* those that have a column */
    double limit_s;
    unsigned rows, goals, reached;
    double ratio[HOST_BENCH_PEERS][HOST_BENCH_ROWS_MAX];
    unsigned ratios[HOST_BENCH_PEERS];
    struct host_bench_result first, before; /* rows; for steps */
    char before_name[64];
};

extern const char *const host_bench_peer_titles[HOST_BENCH_PEERS];

/* Its column in a class. */
const char *host_bench_peer_title(const struct host_bench_class *c,
                                  unsigned peer);

void host_bench_table_begin(struct host_bench_table *table,
                            const struct host_bench_class *c,
                            const bool peer[HOST_BENCH_PEERS], double limit_s);
void host_bench_table_row(struct host_bench_table *table,
                          const struct host_bench_result *result);

/* How many goals of the class are not reached. */
unsigned host_bench_table_end(struct host_bench_table *table);

/* Figures through gnuplot (Debian's gnuplot-nox): a script in, an SVG out. */

/* 0; HOST_INPUT where there is no gnuplot, which the file needs. */
int host_gnuplot_there(const char *path, struct host_error *error);

/* What the script, from its beginning, writes to standard output becomes the
 * file.  0, HOST_INPUT where it cannot be made, or HOST_BROKEN where gnuplot
 * does not draw. */
int host_gnuplot_draw(FILE *script, const char *path, struct host_error *error);

#endif
