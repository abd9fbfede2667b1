#include "bench_paper.h"

#include <stdlib.h>
#include <string.h>

#include "gnuplot.h"
#include "host/base/progress.h"
#include "host/service/strategies/strategies.h"
#include "paper_goals.h"
#include "paper_plot.h"
#include "paper_sequential.h"

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
            (at[length] == ',' || at[length] == '\0')) {
            return true;
        }
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
    if (host_paper_runs_begin(&bench->runs, error) != 0) {
        return error->code;
    }
    host_progress_erase();
    print_model(bench);
    for (int i = 0; i < TABLES && error->code == 0; i++) {
        if (o->tables == NULL || among(o->tables, tables[i].name)) {
            (void)tables[i].print(bench, error);
        }
    }
    return error->code;
}

int host_bench_paper(const struct host_paper_options *options,
                     struct host_error *error) {
    if (check_tables(options->tables, error) != 0) {
        return error->code;
    }
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
            0) {
        return error->code;
    }
    struct host_paper_bench *bench = calloc(1, sizeof *bench);
    if (bench == NULL) {
        return host_fail_memory(error, "the tables");
    }
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
