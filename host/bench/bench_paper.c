#include "bench_paper.h"

#include <stdio.h>
#include <string.h>

#include "host/mesh/gen.h"
#include "host/order/names.h"
#include "host/run/report.h"
#include "host/service/strategies/strategies.h"

/* One row of a table: `points` on so many nodes. */
static int bench_row(const struct host_run_options *options,
                     const struct host_points *points, unsigned nodes,
                     struct host_run_result *result, struct host_error *error)
{
    struct host_run_options row = *options;
    struct host_tetrahedra tets = {0};
    row.nodes = nodes;
    row.strategy = host_strategy_named("spatial");
    row.quiet = true;
    memset(result, 0, sizeof *result);
    int status = host_triangulate(&row, points, &tets, result, error);
    host_tetrahedra_free(&tets);
    return status;
}

static int bench_table(const struct host_run_options *options, const char *kind,
                       const char *name, uint64_t n, unsigned nodes_max,
                       struct host_error *error)
{
    static struct host_run_result alone, result;
    struct host_points points = {0};
    char title[128];
    int status = host_gen(kind, n, 1, &points, error);
    snprintf(title, sizeof title, "%s, %llu points, %s partition", name,
             (unsigned long long)n, host_partitions[options->partition]);
    host_report_head(stdout, title);
    for (unsigned nodes = 1; status == 0 && nodes <= nodes_max; nodes *= 2) {
        status = bench_row(options, &points, nodes, &result, error);
        if (nodes == 1) {
            alone = result;
        }
        if (status == 0) {
            host_report_row(stdout, &result, &alone);
            fflush(stdout);
        }
    }
    host_points_free(&points);
    return status;
}

int host_bench_paper(const struct host_run_options *options, unsigned nodes_max,
                     struct host_error *error)
{
    static const struct {
        const char *kind, *name;
        uint64_t n;
    } sets[] = {{"uniform", "Uniform", 10000},
                {"bubbles", "Bubbles", 20000},
                {"bluntfin", "Bluntfin", 10000}};
    struct host_run_options row = *options;
    int status = 0;
    printf("Table 2: spatial decomposition of uniform sets\n");
    row.partition = HOST_UNIFORM;
    for (uint64_t n = 10000; status == 0 && n <= 20000; n += 10000) {
        status = bench_table(&row, "uniform", "Uniform", n, nodes_max, error);
    }
    printf("\nTable 4: adaptive and uniform partition\n");
    for (unsigned i = 0; status == 0 && i < 3; i++) {
        for (unsigned k = 0; status == 0 && k < 2; k++) {
            row.partition = k == 0 ? HOST_ADAPTIVE : HOST_UNIFORM;
            status = bench_table(&row, sets[i].kind, sets[i].name, sets[i].n,
                                 nodes_max, error);
        }
    }
    host_report_notes(stdout);
    return status;
}
