#include "delaunay.h"

#include <string.h>
#include <time.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "region.h"

/* What is not yet final of a volume of so many points fits a triangulation by
 * points (INCODE_COMPLEX_POINTS_MAX); more would go on by faces, which takes
 * several times as long. */
enum {
    REGION_POINTS = 1 << 20,
    EXPECTED = 7,         /* tetrahedra a point */
    REGION_BYTES = 64,    /* of an arena a point of a region */
    SEAM_LEAST = 1 << 13, /* points of a seam that are worth two threads */
    SEAM_WHOLE = 60000,   /* of which a triangulation has room for all */
    SIFT_LEAST = 1 << 15, /* tetrahedra, likewise */
    POLL_LEFT = 1 << 11,  /* tetrahedra between two trims */
    REGIONS_MAX = 1 << 12,
    KEPT_LEAST = 1 << 18 /* points of a seam's region that is kept: half a
                            second of work */
};

/* The most bytes of an arena that is of use. */
static size_t arena_max(void) {
    const size_t most = (size_t)256 << 20;
    size_t share = host_call_share();
    return share < most / 2 ? 2 * share : most;
}

/* What is not yet final of a region takes room in its thread's arena, which is
 * a part of what the thread may have resident. */
uint32_t host_direct_regions(unsigned threads, uint64_t points) {
    uint64_t most = arena_max() / REGION_BYTES;
    uint32_t regions = 1;
    most = most < REGION_POINTS ? most : REGION_POINTS;
    while (regions < threads ||
           (points / regions > most && regions < REGIONS_MAX))
        regions *= 2;
    return regions;
}

/* --- threads -------------------------------------------------------------- */

static double used_s(clockid_t clock) {
    struct timespec t;
    (void)clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* An arena of as many bytes as there are, down to the least that works: false
 * if there are fewer. */
static bool map_arena(const struct direct *run, unsigned part) {
    struct direct_call *c = run->common;
    size_t least = (incode_arena_min(&run->setup) + 63) / 64 * 64;
    size_t bytes = run->arena > least ? run->arena : least;
    if (c->arena[part] != NULL && c->bytes[part] >= least)
        return true;
    host_unmap(c->arena[part], c->bytes[part]);
    while ((c->arena[part] = host_map_resident(bytes)) == NULL && bytes > least)
        bytes = bytes / 2 > least ? bytes / 2 / 64 * 64 : least;
    c->bytes[part] = bytes;
    return c->arena[part] != NULL;
}

/* Sums, but for the most memory and the longest list; kept is counted in the
 * end. */
static void add_statistics(struct incode_statistics *to,
                           const struct incode_triangulator *t) {
    struct incode_statistics s, before = *to;
    uint64_t word[sizeof s / sizeof(uint64_t)], sum[sizeof s / sizeof *word];
    incode_triangulator_statistics(t, &s);
    memcpy(word, &s, sizeof s);
    memcpy(sum, to, sizeof s);
    for (size_t i = 0; i < sizeof s / sizeof *word; i++)
        sum[i] += word[i];
    memcpy(to, sum, sizeof s);
    to->tetrahedra_kept = 0;
    to->afl_max = s.afl_max > before.afl_max ? s.afl_max : before.afl_max;
    to->memory_high_water = s.memory_high_water > before.memory_high_water
                                ? s.memory_high_water
                                : before.memory_high_water;
}

static bool has_sink(const struct direct *run) {
    return run->level == 0 && run->common->sums != NULL &&
           run->common->sums->sink.put != NULL;
}

/* Gives the rows of a thread's list to the sink, if there is one. */
static void pour(const struct direct *run, struct host_tetrahedra *tets) {
    struct host_direct_sums *sums = run->common->sums;
    if (has_sink(run)) {
        sums->part[tets - run->tets].poured += tets->count;
        host_tetrahedra_pour(tets, sums->by_vertex ? NULL : run->order->row,
                             &sums->sink);
    }
}

static void work(void *context, unsigned part) {
    struct direct *run = context;
    struct direct_worker w = {.run = run,
                              .call = host_call(),
                              .is_caller = part + 1 == run->threads,
                              .tets = &run->tets[part],
                              .left = &run->left[part],
                              .wanted = INCODE_NONE};
    const struct incode_outside outside = direct_outside(&w);
    double cpu = used_s(CLOCK_THREAD_CPUTIME_ID);
    double wall = used_s(CLOCK_MONOTONIC);
    const char *why = NULL;
    /* As many spilled faces as memory has room for, and no file. */
    if (!map_arena(run, part) ||
        host_spill_init(&w.spill, UINT32_MAX, &w.error) != 0) {
        direct_fail(run, HOST_DIRECT_MEMORY, NULL);
    } else {
        w.t = incode_triangulator_init(run->common->arena[part],
                                       run->common->bytes[part], &run->setup,
                                       &outside, &why);
        if (w.t == NULL)
            direct_fail(run, HOST_DIRECT_BROKEN, why);
    }
    /* Room for about as many as there will be: untouched it costs nothing. */
    if (!has_sink(run) && (w.call == NULL || w.call->memory_max == UINT64_MAX))
        (void)host_tetrahedra_room(
            w.tets, (uint64_t)EXPECTED * run->order->points / run->threads,
            &w.error);
    uint32_t region;
    while (run->outcome == HOST_DIRECT_DONE &&
           (region = atomic_fetch_add(&run->regions, 1)) <
               run->order->regions) {
        direct_region(&w, region);
        pour(run, w.tets);
    }
    if (run->common->sums != NULL && w.t != NULL) {
        struct host_direct_part *p = &run->common->sums->part[part];
        add_statistics(&p->statistics, w.t);
        p->faces_spilled += w.spill.faces_total;
        p->cpu_s += used_s(CLOCK_THREAD_CPUTIME_ID) - cpu;
        p->wall_s += used_s(CLOCK_MONOTONIC) - wall;
        p->arena = run->common->bytes[part];
    }
    if (w.spill.table != NULL)
        host_spill_free(&w.spill);
}

/* Memory that is not touched costs nothing.  Where what is not yet final fits,
 * points are inserted; the frames of all pages serve what has to go by faces.
 */
static size_t arena_bytes(const struct host_order *order) {
    enum { LEAST = 16 << 20 };
    size_t bytes = LEAST + (size_t)order->tree.pages * INCODE_PAGE_BYTES;
    return bytes < arena_max() ? bytes : arena_max();
}

/* --- seams ---------------------------------------------------------------- */

/* What is left of regions that were triangulated alone: the tetrahedra that are
 * not final, and those between regions.  All their vertices are the seam's, so
 * they are in the triangulation of its points, whose other tetrahedra lie where
 * a region's final ones are (Funke and Sanders, ALENEX 2017):
 *
 * - Final tetrahedra of two regions have no point in common.  So a tetrahedron
 *   of the seam that has vertices of two regions is not among them.
 * - One with vertices of one region is not if one of these is no final
 *   tetrahedron's; else it is not if the region has it, too. */
struct seam {
    const struct direct *run;
    uint64_t points;
    double (*xyz)[3]; /* [points] */
    uint32_t *id;     /* [points] vertex numbers, ascending, */
    uint16_t *side;   /* twice the region, 1 more: AT_FINAL */
    /* What regions have at such vertices, each ascending, in order; where those
     * stand whose lowest vertex a point is: neighbours in space stand close. */
    struct host_tetrahedra left;
    uint64_t *first;             /* [points + 1] */
    struct host_tetrahedra tets; /* of the seam's points */
    unsigned parts;
    _Atomic bool failed;
};

static uint64_t count_seam(const struct direct *run) {
    uint64_t points = 0, all = (uint64_t)run->order->bricks;
    for (uint64_t i = 0; i < all * INCODE_BRICK_POINTS; i++) {
        if (i % AROUND == 0)
            host_call_trim(AROUND);
        points += (run->mark[i] & AT_SEAM) != 0;
    }
    return points;
}

static void gather_seam(struct seam *s) {
    const struct host_order *order = s->run->order;
    uint64_t n = 0;
    for (uint32_t r = 0; r < order->regions; r++)
        for (uint32_t b = order->region[r].first; b < order->region[r].last;
             b++) {
            host_call_trim(2 * sizeof *order->brick);
            for (uint32_t k = 0; k < order->fill[b]; k++) {
                uint32_t id = b * INCODE_BRICK_POINTS + k;
                unsigned mark = s->run->mark[id];
                if ((mark & AT_SEAM) == 0)
                    continue;
                host_vertex(order, id, s->xyz[n]);
                s->id[n] = id;
                s->side[n++] = (uint16_t)(2 * r + (mark & AT_FINAL));
            }
        }
}

static void sort_four(uint32_t v[4]) {
    for (int i = 1; i < 4; i++)
        for (int k = i; k > 0 && v[k] < v[k - 1]; k--) {
            uint32_t other = v[k];
            v[k] = v[k - 1];
            v[k - 1] = other;
        }
}

/* Those at final tetrahedra's vertices alone. */
static void keep_left(const struct direct *run, struct host_tetrahedra *left) {
    const uint8_t *mark = run->mark;
    uint64_t kept = 0;
    for (uint64_t i = 0; i < left->count; i++) {
        const uint32_t *v = left->v[i];
        if (i % POLL_LEFT == 0)
            host_call_trim(POLL_LEFT * 2 * sizeof left->v[i]);
        if ((mark[v[0]] & mark[v[1]] & mark[v[2]] & mark[v[3]] & AT_FINAL) == 0)
            continue;
        memmove(left->v[kept], v, sizeof left->v[0]);
        sort_four(left->v[kept++]);
    }
    host_tetrahedra_cut(left, kept);
}

static bool sort_left(struct seam *s) {
    const struct direct *run = s->run;
    for (unsigned t = 0; t < run->threads; t++)
        keep_left(run, &run->left[t]);
    if (host_tetrahedra_join(run->left, run->threads, NULL,
                             run->common->error) != 0)
        return false;
    s->left = run->left[0];
    run->left[0] = (struct host_tetrahedra){0};
    host_tetrahedra_sort(&s->left);
    uint64_t at = 0;
    for (uint64_t n = 0; n < s->points && !host_call_cancelled(); n++) {
        uint64_t before = at;
        s->first[n] = at;
        while (at < s->left.count && s->left.v[at][0] == s->id[n])
            at++;
        host_call_trim(sizeof s->id[n] + sizeof s->first[n] +
                       (size_t)(at - before) * sizeof s->left.v[0]);
    }
    s->first[s->points] = at;
    return true;
}

static bool is_before(const uint32_t a[4], const uint32_t b[4]) {
    int k = 1;
    while (k < 3 && a[k] == b[k])
        k++;
    return a[k] < b[k];
}

/* A place where a thread has looked, to within what one fault maps. */
struct place {
    uint64_t block;
};

static bool is_left(const struct seam *s, const uint32_t t[4],
                    struct place *near) {
    uint32_t n[4] = {t[0], t[1], t[2], t[3]};
    sort_four(n);
    const uint32_t v[4] = {s->id[n[0]], s->id[n[1]], s->id[n[2]], s->id[n[3]]};
    uint64_t low = s->first[n[0]], high = s->first[n[0] + 1];
    uint64_t block = low / (AROUND / sizeof s->left.v[0]);
    if (block != near->block)
        host_call_trim(2 * (size_t)AROUND);
    near->block = block;
    while (low < high) {
        uint64_t middle = low + (high - low) / 2;
        if (is_before(s->left.v[middle], v))
            low = middle + 1;
        else
            high = middle;
    }
    return low < s->first[n[0] + 1] && !is_before(v, s->left.v[low]);
}

/* Whether a tetrahedron of the seam's points is one of all points. */
static bool is_right(const struct seam *s, const uint32_t t[4],
                     struct place *near) {
    unsigned a = s->side[t[0]], b = s->side[t[1]], c = s->side[t[2]],
             d = s->side[t[3]];
    return (a | 1U) != (b | 1U) || (a | 1U) != (c | 1U) ||
           (a | 1U) != (d | 1U) || (a & b & c & d & 1) == 0 ||
           is_left(s, t, near);
}

static void sift(void *context, unsigned part) {
    struct seam *s = context;
    enum { POLL = 1 << 12, TOUCHED = 80 /* bytes a row */ };
    struct host_error error;
    struct place near = {UINT64_MAX};
    uint64_t each = s->tets.count / s->parts, i = each * part;
    uint64_t last = part + 1 == s->parts ? s->tets.count : i + each;
    struct host_tetrahedra *to = &s->run->tets[part];
    while (i < last && !host_call_cancelled()) {
        uint64_t end = last - i > POLL ? i + POLL : last;
        uint32_t(*v)[4] = host_tetrahedra_room(to, end - i, &error);
        if (v == NULL) {
            s->failed = true;
            return;
        }
        host_call_trim((size_t)(end - i) * TOUCHED);
        for (; i < end; i++) {
            if (!is_right(s, s->tets.v[i], &near))
                continue;
            for (int k = 0; k < 4; k++)
                v[0][k] = s->id[s->tets.v[i][k]];
            v++;
            host_tetrahedra_keep(to, 1);
        }
        pour(s->run, to);
    }
}

/* A seam is cut in two at most.  Where the final tetrahedra of its regions are,
 * it has tetrahedra that reach from one side to the other: four parts have most
 * of its points at a seam again, two have a fifth (measured on uniform points).
 * Where nearly all points are at a seam, regions close their stars by
 * themselves. */
static uint32_t seam_regions(uint64_t points, uint64_t all) {
    unsigned regions = host_threads();
    bool two = points > SEAM_WHOLE || (regions > 1 && points >= SEAM_LEAST);
    if (points <= all / 8 * 7)
        regions = two && points <= all / 2 ? 2 : 1;
    return host_direct_regions(regions, points);
}

/* Those of an earlier run, if it has kept some. */
static uint32_t seam_regions_kept(const struct direct *run, uint64_t points) {
    const struct host_direct_store *store = run->common->store;
    uint32_t kept =
        store == NULL ? 0 : store->regions(store->context, run->level + 1);
    return kept != 0 ? kept : seam_regions(points, run->order->points);
}

/* key: of the order's points. */
static enum host_direct run_order(struct direct_call *common,
                                  const struct host_order *order,
                                  unsigned level, uint64_t key, bool alone,
                                  struct host_tetrahedra *tets);

static enum host_direct triangulate_seam(struct seam *s) {
    struct direct_call *common = s->run->common;
    struct host_order order;
    enum host_direct outcome = HOST_DIRECT_MEMORY;
    uint64_t all = s->run->order->points;
    if (host_order_make(&order, "points", s->xyz[0], s->points, HOST_ADAPTIVE,
                        seam_regions_kept(s->run, s->points), false,
                        common->error) == 0)
        outcome = run_order(common, &order, s->run->level + 1,
                            host_key(s->id, s->points, s->run->key),
                            s->points <= all / 2, &s->tets);
    else if (host_call_cancelled())
        outcome = HOST_DIRECT_CANCELLED;
    else if (order.fault != HOST_ORDER_SOUND) {
        *common->error = (struct host_error){0}; /* it has no tetrahedron */
        outcome = HOST_DIRECT_DONE;
    }
    host_order_free(&order);
    return outcome;
}

static enum host_direct close_seams(const struct direct *run) {
    struct seam s = {.run = run, .points = count_seam(run)};
    enum host_direct outcome = HOST_DIRECT_MEMORY;
    s.xyz = host_map(s.points * sizeof *s.xyz);
    s.id = host_map(s.points * sizeof *s.id);
    s.side = host_map(s.points * sizeof *s.side);
    s.first = host_map((s.points + 1) * sizeof *s.first);
    if (s.xyz != NULL && s.id != NULL && s.side != NULL && s.first != NULL) {
        gather_seam(&s);
        outcome = sort_left(&s) ? HOST_DIRECT_DONE : HOST_DIRECT_MEMORY;
    }
    if (outcome == HOST_DIRECT_DONE) {
        outcome = triangulate_seam(&s);
        s.parts = s.tets.count < SIFT_LEAST ? 1 : run->threads;
        if (outcome == HOST_DIRECT_DONE)
            host_fork_all(s.parts, sift, &s);
        if (s.failed)
            outcome = HOST_DIRECT_MEMORY;
    }
    host_unmap(s.xyz, s.points * sizeof *s.xyz);
    host_unmap(s.id, s.points * sizeof *s.id);
    host_unmap(s.side, s.points * sizeof *s.side);
    host_unmap(s.first, (s.points + 1) * sizeof *s.first);
    host_tetrahedra_free(&s.left);
    host_tetrahedra_free(&s.tets);
    return outcome;
}

/* --- all together --------------------------------------------------------- */

static enum host_direct tell(const struct direct *run) {
    struct host_error *error = run->common->error;
    enum host_direct outcome = (enum host_direct)run->outcome;
    if (outcome == HOST_DIRECT_BROKEN)
        host_fail(error, HOST_BROKEN, "host: %s; please report this fault",
                  run->why);
    else if (outcome == HOST_DIRECT_MEMORY)
        host_fail_memory(error, "the tetrahedra");
    else if (outcome == HOST_DIRECT_CANCELLED)
        host_fail(error, HOST_BROKEN, "host: cancelled");
    return outcome;
}

static enum host_direct run_order(struct direct_call *common,
                                  const struct host_order *order,
                                  unsigned level, uint64_t key, bool alone,
                                  struct host_tetrahedra *tets) {
    struct host_tetrahedra list[HOST_THREADS_MAX] = {{0}};
    struct host_tetrahedra left[HOST_THREADS_MAX] = {{0}};
    struct host_direct_sums *sums = level == 0 ? common->sums : NULL;
    unsigned threads = host_threads();
    threads = threads < order->regions ? threads : order->regions;
    size_t marks = (size_t)order->bricks * INCODE_BRICK_POINTS;
    struct direct run = {
        .common = common,
        .order = order,
        .tets = list,
        .left = left,
        .level = level,
        .threads = threads,
        .setup = {.bricks = order->bricks,
                  .index = INCODE_KD,
                  .face_rule = INCODE_FACE_OWN,
                  .build = (uint8_t)(order->points > REGION_POINTS
                                         ? INCODE_BUILD_AUTO
                                         : INCODE_BUILD_POINTS),
                  .owner_rule = INCODE_OWNER_SMALLEST},
        .arena = arena_bytes(order)};
    memcpy(run.setup.lo, order->lo, sizeof run.setup.lo);
    memcpy(run.setup.hi, order->hi, sizeof run.setup.hi);
    if (alone && order->regions > 1) {
        run.setup.build = INCODE_BUILD_POINTS;
        run.mark = host_map(marks);
        if (run.mark == NULL)
            direct_fail(&run, HOST_DIRECT_MEMORY, NULL);
    }
    if (level == 0 || order->points / order->regions >= KEPT_LEAST)
        run.store = common->store;
    if (common->store != NULL)
        run.key = host_order_key(order, key);
    if (sums != NULL)
        sums->threads = threads;
    host_fork_all(threads, work, &run);
    enum host_direct outcome = tell(&run);
    if (outcome == HOST_DIRECT_DONE && run.mark != NULL)
        outcome = close_seams(&run);
    for (unsigned i = 0; i < threads && sums != NULL; i++)
        sums->part[i].statistics.tetrahedra_kept =
            list[i].count + sums->part[i].poured;
    if (outcome == HOST_DIRECT_DONE &&
        host_tetrahedra_join(
            list, threads, sums != NULL && sums->by_vertex ? NULL : order->row,
            common->error) != 0)
        outcome = HOST_DIRECT_MEMORY;
    if (outcome == HOST_DIRECT_DONE) {
        *tets = list[0];
        list[0] = (struct host_tetrahedra){0};
    }
    host_unmap(run.mark, marks);
    for (unsigned i = 0; i < threads; i++) {
        host_tetrahedra_free(&list[i]);
        host_tetrahedra_free(&left[i]);
    }
    return outcome;
}

enum host_direct host_direct_run(const struct host_order *order,
                                 struct host_tetrahedra *tets,
                                 struct host_direct_sums *sums,
                                 struct host_error *error) {
    struct direct_call common = {.sums = sums,
                                 .store = sums == NULL ? NULL : sums->store,
                                 .error = error};
    enum host_direct outcome = run_order(&common, order, 0, 0, true, tets);
    for (unsigned i = 0; i < HOST_THREADS_MAX; i++)
        host_unmap(common.arena[i], common.bytes[i]);
    return outcome;
}

int host_delaunay(const double *xyz, uint64_t count,
                  struct host_tetrahedra *tets, struct host_error *error) {
    struct host_order order;
    uint32_t regions = host_direct_regions(host_threads(), count);
    if (host_order_make(&order, "points", xyz, count, HOST_ADAPTIVE, regions,
                        false, error) == 0 &&
        host_direct_run(&order, tets, NULL, error) == HOST_DIRECT_DONE)
        host_tetrahedra_sort(tets);
    host_order_free(&order);
    return error->code;
}
