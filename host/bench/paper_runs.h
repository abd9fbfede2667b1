/* The runs of `incode bench paper` in virtual time: each is made once, however
 * many tables have it, and its sets of points as well.
 *
 * Memory: the sets, and a few numbers a run.  Work: that of the runs.
 *
 *     struct host_paper_case c = {.set = "Uniform", .points = 20000,
 *         .strategy = "spatial", .machine = HOST_PAPER_NCUBE, .nodes = 128};
 *     const struct host_paper_result *r = host_paper_run(&runs, &c, &error);
 *     double speed_up = host_paper_alone_s(&runs, &c, &error) / r->t_max;
 */
#ifndef HOST_BENCH_PAPER_RUNS_H
#define HOST_BENCH_PAPER_RUNS_H

#include <stdbool.h>

#include "host/mesh/points.h"
#include "host/mesh/order.h"
#include "model.h"

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

/* A set by its name; NULL: error tells. */
const struct host_points *host_paper_set(struct host_paper_runs *runs,
                                         const char *set, uint64_t points,
                                         struct host_error *error);

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

#endif
