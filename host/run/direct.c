/* The library's way: threads of this process instead of nodes. */
#include <stdio.h>
#include <string.h>

#include "host/base/clock.h"
#include "host/base/progress.h"
#include "host/library/delaunay.h"
#include "host/verify/verify.h"
#include "run.h"

static const struct host_strategy strategy_direct = {
    .name = "direct",
    .title = "Direct",
    .help = "one triangulator a thread, over points that they share"};

static const struct host_link link_memory = {
    .name = "memory", .help = "the memory of one process"};

static uint32_t bricks;

static void show_progress(uint32_t committed) {
    host_progress_show(committed, bricks, committed);
}

/* The threads take the place of nodes. */
static void take_sums(const struct host_direct_sums *sums,
                      struct host_run_result *r) {
    r->nodes = sums->threads;
    for (unsigned i = 0; i < sums->threads; i++) {
        const struct host_direct_part *part = &sums->part[i];
        struct node_finished_message *f = &r->node[i].statistics;
        f->statistics = part->statistics;
        f->busy_us = (uint64_t)(1e6 * part->cpu_s);
        f->wall_us = (uint64_t)(1e6 * part->wall_s);
        f->memory_high_water = part->arena;
        r->faces_spilled += part->faces_spilled;
        r->memory = part->arena > r->memory ? part->arena : r->memory;
    }
    host_run_sum_nodes(r);
}

static int triangulate(const struct host_run_options *options,
                       const struct host_points *points,
                       struct host_tetrahedra *tets, struct host_order *order,
                       struct host_run_result *r, struct host_error *error) {
    static struct host_direct_sums sums;
    uint64_t start = host_now_us();
    host_progress_phase("ordering", NULL);
    int status = host_order_make(
        order, options->input, points->xyz, points->count, HOST_ADAPTIVE,
        host_direct_regions(host_threads(), points->count), false, error);
    r->time_order_s = 1e-6 * (double)(host_now_us() - start);
    if (status != 0) {
        return status;
    }
    r->rows = order->rows;
    r->points = order->points;
    r->duplicates = order->duplicates;
    r->negative_zeros = order->negative_zeros;
    r->pages = order->tree.pages;
    bricks = order->bricks;
    host_progress_phase("triangulating", NULL);
    memset(&sums, 0, sizeof sums);
    sums.committed = show_progress;
    if (host_direct_run(order, tets, &sums, error) != HOST_DIRECT_DONE) {
        return error->code;
    }
    take_sums(&sums, r);
    return 0;
}

/* The exact check where it is asked for.  The count of the hull's facets, which
 * only statistics need, comes from the check that the tetrahedra tile. */
static int check(const struct host_run_options *options,
                 const struct host_points *points,
                 const struct host_tetrahedra *tets, struct host_run_result *r,
                 struct host_error *error) {
    bool exact = options->verifying == HOST_VERIFY_ALWAYS;
    if (!exact && options->stats == NULL) {
        return 0;
    }
    uint64_t start = host_now_us();
    host_progress_phase("checking", NULL);
    int status = host_verify(points, tets,
                             exact ? HOST_CHECK_DELAUNAY : HOST_CHECK_TILING,
                             &r->check, error);
    r->hull_facets = r->check.hull_facets;
    r->verified = status == 0 && exact;
    r->checks_failed = status == HOST_UNVERIFIED;
    r->time_verify_s = 1e-6 * (double)(host_now_us() - start);
    if (status == HOST_UNVERIFIED) {
        host_progress_erase();
        fputs(r->check.text, stderr);
    }
    return status;
}

int host_triangulate_direct(const struct host_run_options *options,
                            const struct host_points *points,
                            struct host_tetrahedra *tets,
                            struct host_run_result *result,
                            struct host_error *error) {
    struct host_order order = {0};
    struct timespec used;
    result->strategy = &strategy_direct;
    result->partition = HOST_ADAPTIVE;
    result->index = INCODE_KD;
    result->link = &link_memory;
    result->board = host_board_row(0);
    uint64_t start = host_now_us();
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    double before_s = (double)used.tv_sec + 1e-9 * (double)used.tv_nsec;
    int status = triangulate(options, points, tets, &order, result, error);
    host_order_free(&order);
    result->time_triangulation_s = 1e-6 * (double)(host_now_us() - start);
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    result->host_triangulation_cpu_s =
        (double)used.tv_sec + 1e-9 * (double)used.tv_nsec - before_s;
    result->tetrahedra = tets->count;
    return status == 0 ? check(options, points, tets, result, error) : status;
}
