#include "regions.h"

#include <math.h>
#include <string.h>

bool host_regions_first(struct host_work *work, unsigned node,
                        struct incode_job *job)
{
    if (work->ledger->committed > 0 || work->living < work->nodes ||
        node >= work->order->regions) {
        return false;
    }
    const struct host_region *region = &work->order->region[node];
    *job = (struct incode_job){.first = region->first, .last = region->last};
    memcpy(job->lo, region->lo, sizeof region->lo);
    memcpy(job->hi, region->hi, sizeof region->hi);
    work->ledger->cursor = region->last;
    return true;
}

/* Bricks [first, last), and the box of their points. */
static struct incode_job job_of(const struct host_order *order, uint32_t first,
                                uint32_t last)
{
    struct incode_job job = {.first = first, .last = last};
    for (int k = 0; k < 3; k++) {
        job.lo[k] = INFINITY;
        job.hi[k] = -INFINITY;
    }
    for (uint32_t v = first * INCODE_BRICK_POINTS;
         v < last * INCODE_BRICK_POINTS; v++) {
        double p[3];
        host_vertex(order, v, p);
        for (int k = 0; k < 3; k++) {
            job.lo[k] = p[k] < job.lo[k] ? p[k] : job.lo[k];
            job.hi[k] = p[k] > job.hi[k] ? p[k] : job.hi[k];
        }
    }
    return job;
}

bool host_regions_next(struct host_work *work, unsigned node,
                       struct incode_job *job)
{
    uint32_t first, last;
    (void)node;
    if (!host_ledger_next(work->ledger, work->order, &first, &last)) {
        return false;
    }
    *job = job_of(work->order, first, last);
    return true;
}

int host_regions_commit(struct host_work *work, unsigned node, uint32_t brick)
{
    return host_ledger_commit(work->ledger, node, brick);
}
