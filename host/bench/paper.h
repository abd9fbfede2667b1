/* The runs of `incode bench paper` in virtual time: each is made once, however
 * many tables have it, and its sets of points as well. */
#ifndef HOST_BENCH_PAPER_H
#define HOST_BENCH_PAPER_H

#include <stdbool.h>
#include <stdio.h>

#include "host/mesh/points.h"
#include "host/mesh/order.h"
#include "model.h"
#include "host/base/error.h"
#include "host/mesh/tetrahedra.h"
#include "host/run/run.h"

enum { HOST_PAPER_SETS = 16, HOST_PAPER_RUNS_MAX = 512, HOST_PAPER_QUICK = 10 };

enum host_paper_machine {
    HOST_PAPER_NCUBE,
    HOST_PAPER_WORKSTATIONS,
    HOST_PAPER_HERE,
    HOST_PAPER_MACHINES
};

/* What is run. */
struct host_paper_case {
    const char *set; /* Uniform, Bubbles, Blunt Fin */
    uint64_t points; /* of the paper; a tenth of them are run if it is quick */
    const char *strategy; /* a row of strategies.h */
    bool paper_rule;      /* --face-rule paper */
    enum host_partition partition;
    enum host_paper_machine machine;
    unsigned nodes;
    unsigned builders; /* --builders; 0: the strategy's default */
};

/* And what came of it, in virtual seconds. */
struct host_paper_result {
    struct host_paper_case c;
    uint64_t points, tetrahedra;
    double t_min, t_max, t_io, duplication;
    double busy; /* processor time of the busiest node */
    double work_ns;
};

struct host_paper_runs {
    /* Given by the caller, who clears the rest. */
    const char *bluntfin; /* a file of the grid, or NULL */
    bool quick;
    /* Private. */
    struct {
        const char *set;
        uint64_t points;
        struct host_points xyz;
    } set[HOST_PAPER_SETS];
    unsigned sets;
    struct host_paper_result result[HOST_PAPER_RUNS_MAX];
    unsigned results;
    struct host_bench_machine machine[HOST_PAPER_MACHINES];
};

/* The machines as model.h has them, with their scales. */
int host_paper_runs_begin(struct host_paper_runs *runs,
                          struct host_error *error);
void host_paper_runs_end(struct host_paper_runs *runs);

/* The result of a run, made where it has not been; NULL: error tells.  It stays
 * until the end. */
const struct host_paper_result *host_paper_run(struct host_paper_runs *runs,
                                               const struct host_paper_case *c,
                                               struct host_error *error);

/* What speed-ups are against: t_max of `sequential` on one node of that machine
 * and set, as every strategy's tetrahedra are its; 0: error tells. */
double host_paper_alone_s(struct host_paper_runs *runs,
                          const struct host_paper_case *c,
                          struct host_error *error);

/* `incode bench paper`: Tables 1 to 7 and figure 11 of Cignoni, Laforenza,
 * Perego, Scopigno and Montani (1995), each beside the paper's own figures
 * (paper_figures.h), relation (1) of section 4.3, and the project's goals.
 * Table 1 is measured; all others are run in virtual time (virtual_run.h) on
 * the machines of model.h, and the model is held against real runs on this
 * machine. */

struct host_paper_options {
    /* Of host_paper_tables, separated by commas; NULL: all. */
    const char *tables;
    const char *strategy; /* this one alone; NULL: all that there are */
    const char *csv, *svg, *bluntfin; /* files, or NULL */
    unsigned nodes_max;
    bool quick;
    bool large; /* Uniform 1,000,000 on 1,024 nodes, too */
};

/* What can be asked for, separated by commas: the numbers of tables, 11 for the
 * figure, `relation`, `check` for the model's, and `goals`. */
extern const char host_paper_tables[];

/* 0, or what a run ends with. */
int host_bench_paper(const struct host_paper_options *options,
                     struct host_error *error);

/* What `incode bench paper` prints: the rows of its tables beside the paper's,
 * on standard output and as CSV. */

struct host_paper_print {
    FILE *csv; /* NULL: none */
    const char *table;
};

/* One row of the CSV, and of a table: measured or modelled, and the paper's
 * beside it.  0 or NULL: not known. */
struct host_paper_csv {
    const char *set, *machine, *how, *strategy, *partition, *face_rule, *index;
    uint64_t points, tetrahedra;
    unsigned nodes, builders;
    double t_min, t_max, t_io, speed_up, duplication, mflops;
    double paper_t_min, paper_t_max, paper_t_io, paper_duplication;
};

int host_paper_print_begin(struct host_paper_print *print, const char *csv,
                           struct host_error *error);
int host_paper_print_end(struct host_paper_print *print, const char *csv,
                         struct host_error *error);

/* A table, "2", and a part of it, with the head of its columns. */
void host_paper_table(struct host_paper_print *print, const char *table,
                      const char *title);
void host_paper_note(const char *format, ...)
    __attribute__((format(printf, 1, 2)));

void host_paper_csv_row(struct host_paper_print *print,
                        const struct host_paper_csv *row);

/* The tables of `incode bench paper` that are run in virtual time. */

struct host_paper_bench {
    const struct host_paper_options *options;
    struct host_paper_runs runs;
    struct host_paper_print print;
};

/* Whether there is that strategy, and it is asked for; says where it is not
 * there yet. */
bool host_paper_has(const struct host_paper_bench *bench, const char *strategy);

/* 0, or what a run ends with. */
int host_paper_table_2(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_3(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_4(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_5(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_6(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_table_7(struct host_paper_bench *bench,
                       struct host_error *error);

/* What follows from the tables: relation (1) of the paper's section 4.3, its
 * estimate of the hybrid, and the project's goals, each said to be reached or
 * missed with its figure. */

/* The paper's figure 11 as an SVG through gnuplot: tetrahedra a second, and a
 * second and Mflop/s, against the number of processing elements. */

/* What `incode bench paper` measures on this machine: Table 1, the sequential
 * program naive and optimised; and the model's prices, held against real runs
 * on one node and two.
 *
 * Memory: a run of 20,000 points. */

/* 0, or what a run ends with. */
int host_paper_table_1(struct host_paper_bench *bench,
                       struct host_error *error);
int host_paper_check(struct host_paper_bench *bench, struct host_error *error);

/* The active face list alone, for Table 1: the searches of a triangulation made
 * once more, without the search for apexes.
 *
 * Memory: 16 bytes a face, of twice as many faces as there are tetrahedra at
 * most. */

struct host_paper_list {
    uint64_t searches;
    double accesses;  /* faces looked at, a search */
    double seconds;   /* of all searches */
    uint64_t longest; /* faces open at a time */
};

/* tets: of positive orientation, in the order in which they were built; their
 * vertices below `vertices`.  0, or HOST_BROKEN without memory. */
int host_paper_list(const struct host_tetrahedra *tets, uint64_t vertices,
                    struct host_paper_list *list, struct host_error *error);

/* The model's prices on this machine: real runs of `sequential` on one node,
 * and the prices of model.h, none of them negative, that make the sum of
 * squares of the relative errors of the node's processor time least.
 *
 * Memory: a run of 20,000 points. */

enum {
    HOST_CALIBRATE_RUNS = 8,
    /* After the counts: messages, and the start of a node's program. */
    HOST_CALIBRATE_MESSAGE = HOST_BENCH_COUNTS,
    HOST_CALIBRATE_START,
    HOST_CALIBRATE_TERMS
};

struct host_calibration {
    double price[HOST_BENCH_COUNTS]; /* nanoseconds */
    double message_us, start_us;
    double error; /* root of the mean square of the relative errors */
    unsigned runs;
};

/* The x >= 0 for which the sum over rows of (sum of a[row][k] x[k] - 1)^2 is
 * least. */
void host_calibrate_fit(const double (*a)[HOST_CALIBRATE_TERMS], unsigned rows,
                        double x[HOST_CALIBRATE_TERMS]);

#endif
