#include "regions.h"

#include <math.h>
#include <string.h>

#include "host/base/parallel.h"

/* Ranges a node after a loss: they differ in work, and whoever is free takes
 * the next; but each has a border, which is worked on from both sides. */
enum { PIECES = 2 };

/* Measured in runs of two nodes.  One node alone inserts points faster than
 * faces are found as long as what is not final takes little memory: about
 * 8 n^(2/3) tetrahedra of a volume, of 38 bytes, up to a fifth of it; what of a
 * surface is open is known to fit.  Beside that, surfaces, stretched grids and
 * lattices take three times as long and more face by face.  Where one alone
 * goes face by face, too, several hold each other up for pages, if a node
 * cannot hold the points of all. */
static double regions_total(const struct host_task *task) {
    enum { POINT_BYTES = 32 };
    double open = 8 * 38 * pow((double)task->points, 2.0 / 3);
    bool holds_all = task->points <= task->memory / POINT_BYTES;
    if (!task->by_points)
        return !task->uneven ? 1.05 : holds_all ? 1.2 : 1.7;
    if (task->uneven)
        return 3.0;
    return open <= (double)task->memory / 5 ? 1.5 : 1.05;
}

/* A surface has more of its tetrahedra at borders than a volume. */
struct host_cost host_regions_cost(const struct host_task *task, double again) {
    double regions = (double)task->nodes / (double)(task->points + 1);
    double border = (task->uneven ? 2 : 1) * again * cbrt(regions);
    double total = regions_total(task) * (1 + border);
    return task->nodes == 1 ? (struct host_cost){1.01, 1.01}
                            : (struct host_cost){total / task->nodes, total};
}

struct host_cost host_regions_lists_cost(unsigned groups, unsigned faces) {
    double group = 3 + 30.0 / faces;
    return (struct host_cost){group / groups, 2 * group};
}

unsigned host_regions_each(unsigned nodes) {
    return nodes;
}

unsigned host_regions_one(unsigned nodes) {
    (void)nodes;
    return 1;
}

bool host_regions_first(struct host_work *work, unsigned node,
                        struct incode_job *job) {
    if (work->ledger->committed > 0 || work->living < work->nodes ||
        node >= work->order->regions)
        return false;
    const struct host_region *region = &work->order->region[node];
    *job = (struct incode_job){.first = region->first, .last = region->last};
    memcpy(job->lo, region->lo, sizeof region->lo);
    memcpy(job->hi, region->hi, sizeof region->hi);
    work->ledger->cursor = region->last;
    return true;
}

struct incode_job host_regions_job(const struct host_order *order,
                                   uint32_t first, uint32_t last) {
    struct incode_job job = {.first = first, .last = last};
    for (int k = 0; k < 3; k++) {
        job.lo[k] = INFINITY;
        job.hi[k] = -INFINITY;
    }
    for (uint32_t v = first * INCODE_BRICK_POINTS;
         v < last * INCODE_BRICK_POINTS; v++) {
        double p[3];
        host_call_trim(sizeof p);
        host_vertex(order, v, p);
        for (int k = 0; k < 3; k++) {
            job.lo[k] = p[k] < job.lo[k] ? p[k] : job.lo[k];
            job.hi[k] = p[k] > job.hi[k] ? p[k] : job.hi[k];
        }
    }
    return job;
}

bool host_regions_next(struct host_work *work, unsigned node,
                       struct incode_job *job) {
    uint32_t first, last;
    (void)node;
    if (!host_ledger_next(work->ledger, work->order, &first, &last))
        return false;
    *job = host_regions_job(work->order, first, last);
    return true;
}

int host_regions_commit(struct host_work *work, unsigned node, uint32_t brick) {
    return host_ledger_commit(work->ledger, node, brick);
}

bool host_regions_next_alone(struct host_work *work, unsigned node,
                             struct incode_job *job) {
    return node == host_first_left(work, 0) &&
           host_regions_next(work, node, job);
}

/* One node has no use for more ranges than are left. */
void host_regions_lose_among(struct host_work *work, unsigned takers) {
    uint32_t pieces = takers > 1 ? PIECES * takers : 1;
    (void)host_ledger_abandon(work->ledger, pieces, work->order, work->tets);
}

void host_regions_lose(struct host_work *work) {
    host_regions_lose_among(work, work->living);
}

void host_regions_lose_alone(struct host_work *work) {
    host_regions_lose_among(work, 1);
}
