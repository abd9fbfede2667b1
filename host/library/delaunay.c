#include "delaunay.h"

#include <string.h>
#include <time.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/spill.h"

enum {
    PAGES_QUEUE = 1024,
    SPILL_TAKEN = 128,     /* faces given back at a time */
    AROUND = 1 << 16,      /* bytes that one place far from others touches */
    EXPECTED = 7,          /* tetrahedra a point */
    EMITTED_ROOM = 1 << 12 /* tetrahedra that the triangulator may give at once
                            */
};

/* What is known of a vertex of a region that is triangulated alone. */
enum {
    AT_FINAL = 1, /* it is a tetrahedron's that is final */
    AT_SEAM = 2   /* or of one that is not, or of the hull where others' points
                     lie beyond */
};

/* What all runs of a call share. */
struct common {
    struct host_direct_sums *sums; /* or NULL */
    struct host_error *error;
    /* What the triangulators of threads work in; NULL: nothing yet. */
    void *arena[HOST_THREADS_MAX];
    size_t bytes[HOST_THREADS_MAX];
};

/* The threads of one run. */
struct direct {
    struct common *common;
    const struct host_order *order;
    struct host_tetrahedra *tets; /* [threads] */
    struct host_tetrahedra *left; /* [threads] not final: vertex numbers */
    uint8_t *mark;                /* [64 * bricks] or NULL: not alone */
    bool is_first; /* its bricks count, and its rows go to the sink */
    unsigned threads;
    struct incode_setup setup;
    size_t arena;              /* bytes for each thread, if there are so many */
    _Atomic uint32_t regions;  /* that were taken */
    _Atomic int outcome;       /* enum host_direct: the worst so far */
    _Atomic(const char *) why; /* of HOST_DIRECT_BROKEN */
};

struct worker {
    struct direct *run;
    struct host_call *call; /* or NULL */
    bool is_caller;         /* it is the calling thread's */
    struct host_tetrahedra *tets, *left;
    uint64_t tets_before, left_before; /* rows of other regions */
    bool is_hopeless; /* hardly anything of this one is final */
    struct incode_triangulator *t;
    struct host_spill spill;
    struct host_error error;
    uint32_t pages[PAGES_QUEUE], page_count; /* requested */
    uint32_t wanted; /* brick whose spilled faces are wanted, or INCODE_NONE */
};

/* What is not yet final of a volume of so many points fits a triangulation by
 * points (INCODE_COMPLEX_POINTS_MAX); more would go on by faces, which takes
 * several times as long. */
enum {
    REGION_POINTS = 1 << 20,
    REGION_BYTES = 64,        /* of an arena a point of a region */
    SEAM_LEAST = 1 << 13,     /* points of a seam that are worth two threads */
    SEAM_WHOLE = 60000,       /* of which a triangulation has room for all */
    HOPELESS = 2,             /* times as many tetrahedra are not final, */
    HOPELESS_LEAST = 1 << 14, /* and at least so many */
    SIFT_LEAST = 1 << 15,     /* tetrahedra, likewise */
    POLL_LEFT = 1 << 11,      /* tetrahedra between two trims */
    REGIONS_MAX = 1 << 12
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

static void fail(struct direct *run, enum host_direct outcome,
                 const char *why) {
    int before = HOST_DIRECT_DONE;
    if (atomic_compare_exchange_strong(&run->outcome, &before, outcome))
        atomic_store(&run->why, why);
}

static bool has_sink(const struct direct *run) {
    return run->is_first && run->common->sums != NULL &&
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

/* --- what a triangulator asks for ----------------------------------------- */

static bool request(void *context, uint32_t page) {
    struct worker *w = context;
    if (w->page_count == PAGES_QUEUE)
        return false;
    w->pages[w->page_count++] = page;
    return true;
}

static size_t emit_room(void *context) {
    (void)context;
    return EMITTED_ROOM;
}

static void emit(void *context, uint32_t vertex, const uint32_t (*apexes)[3],
                 size_t count) {
    struct worker *w = context;
    uint32_t(*v)[4] = host_tetrahedra_room(w->tets, count, &w->error);
    if (v == NULL) {
        fail(w->run, HOST_DIRECT_MEMORY, NULL);
        return;
    }
    uint8_t *mark = w->run->mark;
    for (size_t i = 0; i < count; i++) {
        v[i][0] = vertex;
        memcpy(v[i] + 1, apexes[i], sizeof apexes[i]);
        for (int k = 0; k < 4 && mark != NULL; k++)
            mark[v[i][k]] |= AT_FINAL;
    }
    host_tetrahedra_keep(w->tets, count);
    host_call_trim(count * sizeof *v);
}

static void leave(void *context, const uint32_t v[4]) {
    struct worker *w = context;
    bool finite = true;
    for (int k = 0; k < 4; k++) {
        finite = finite && v[k] != INCODE_NONE;
        if (v[k] != INCODE_NONE)
            w->run->mark[v[k]] |= AT_SEAM;
    }
    if (!finite)
        return;
    uint32_t(*left)[4] = host_tetrahedra_room(w->left, 1, &w->error);
    if (left == NULL) {
        fail(w->run, HOST_DIRECT_MEMORY, NULL);
        return;
    }
    memcpy(left[0], v, sizeof left[0]);
    host_call_trim(sizeof left[0]);
    host_tetrahedra_keep(w->left, 1);
}

static void commit(void *context, uint32_t brick) {
    struct worker *w = context;
    struct host_direct_sums *sums = w->run->common->sums;
    (void)brick;
    /* As where coordinates are too small for the bounds of spheres. */
    uint64_t final = w->tets->count - w->tets_before;
    uint64_t left = w->left->count - w->left_before;
    w->is_hopeless = left > HOPELESS_LEAST && left / HOPELESS > final;
    if (!w->run->is_first)
        return;
    if (w->call != NULL)
        atomic_fetch_add_explicit(&w->call->bricks, 1, memory_order_relaxed);
    if (sums != NULL) {
        uint32_t done = 1 + atomic_fetch_add_explicit(&sums->bricks, 1,
                                                      memory_order_relaxed);
        if (w->is_caller && sums->committed != NULL)
            sums->committed(done);
    }
}

static bool spill(void *context, const struct incode_face *faces,
                  size_t count) {
    struct worker *w = context;
    if (host_spill_put(&w->spill, 0, faces, (uint32_t)count, &w->error) != 0)
        fail(w->run, HOST_DIRECT_MEMORY, NULL);
    return true;
}

static bool unspill(void *context, uint32_t brick) {
    struct worker *w = context;
    w->wanted = brick;
    return true;
}

/* --- what it gets --------------------------------------------------------- */

static bool deliver_faces(struct worker *w) {
    uint32_t brick = w->wanted, count;
    struct host_spill_list list = host_spill_detach(&w->spill, 0, brick);
    struct incode_face faces[SPILL_TAKEN];
    w->wanted = INCODE_NONE;
    do {
        if (host_spill_take(&w->spill, &list, faces, SPILL_TAKEN, &count,
                            &w->error) != 0 ||
            incode_triangulator_unspill(w->t, brick, faces, count,
                                        list.faces == 0) != 0)
            return false;
    } while (list.faces > 0);
    return true;
}

static bool deliver_pages(struct worker *w) {
    uint8_t page[INCODE_PAGE_BYTES];
    for (uint32_t i = 0; i < w->page_count; i++) {
        size_t bytes = host_page(w->run->order, w->pages[i], page);
        host_call_trim(AROUND);
        if (incode_triangulator_page(w->t, w->pages[i], page, bytes) != 0)
            return false;
    }
    w->page_count = 0;
    return true;
}

static bool deliver(struct worker *w) {
    if (w->page_count == 0 && w->wanted == INCODE_NONE)
        return false;
    return (w->wanted == INCODE_NONE || deliver_faces(w)) && deliver_pages(w);
}

/* A region that cannot be triangulated alone: all of it is seam. */
static void give_up_region(struct worker *w, const struct host_region *r) {
    const struct host_order *order = w->run->order;
    host_tetrahedra_cut(w->tets, w->tets_before);
    host_tetrahedra_cut(w->left, w->left_before);
    (void)deliver(w); /* what the triangulator will not ask for again */
    for (uint32_t brick = r->first; brick < r->last; brick++)
        memset(w->run->mark + (size_t)brick * INCODE_BRICK_POINTS, AT_SEAM,
               order->fill[brick]);
}

static void do_region(struct worker *w, uint32_t number) {
    const struct host_region *r = &w->run->order->region[number];
    w->tets_before = w->tets->count;
    w->left_before = w->left->count;
    w->is_hopeless = false;
    struct incode_job job = {.first = r->first, .last = r->last};
    memcpy(job.lo, r->lo, sizeof job.lo);
    memcpy(job.hi, r->hi, sizeof job.hi);
    if (r->first == r->last)
        return;
    incode_triangulator_start(w->t, &job);
    while (atomic_load_explicit(&w->run->outcome, memory_order_relaxed) ==
           HOST_DIRECT_DONE) {
        enum incode_step step = incode_triangulator_step(w->t);
        if (step == INCODE_FINISHED)
            return;
        if (step == INCODE_FULL || w->is_hopeless) {
            give_up_region(w, r);
            return;
        }
        if (step == INCODE_BROKEN)
            fail(w->run, HOST_DIRECT_BROKEN, incode_triangulator_fault(w->t));
        else if (step == INCODE_WAITING && !deliver(w))
            fail(w->run, HOST_DIRECT_BROKEN, "it waits for nothing");
        if (host_call_cancelled())
            fail(w->run, HOST_DIRECT_CANCELLED, NULL);
    }
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
    struct common *c = run->common;
    size_t least = (incode_arena_min(&run->setup) + 63) / 64 * 64;
    size_t bytes = run->arena > least ? run->arena : least;
    if (c->arena[part] != NULL && c->bytes[part] >= least)
        return true;
    host_unmap(c->arena[part], c->bytes[part]);
    while ((c->arena[part] = host_map(bytes)) == NULL && bytes > least)
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

static void work(void *context, unsigned part) {
    struct direct *run = context;
    struct worker w = {.run = run,
                       .call = host_call(),
                       .is_caller = part + 1 == run->threads,
                       .tets = &run->tets[part],
                       .left = &run->left[part],
                       .wanted = INCODE_NONE};
    const struct incode_outside outside = {
        .pages = {&w, request},
        .front = {.context = &w,
                  .emit_room = emit_room,
                  .emit = emit,
                  .left = run->mark != NULL ? leave : NULL,
                  .commit = commit,
                  .spill = spill,
                  .unspill = unspill}};
    double cpu = used_s(CLOCK_THREAD_CPUTIME_ID);
    double wall = used_s(CLOCK_MONOTONIC);
    const char *why = NULL;
    /* As many spilled faces as memory has room for, and no file. */
    if (!map_arena(run, part) ||
        host_spill_init(&w.spill, UINT32_MAX, &w.error) != 0) {
        fail(run, HOST_DIRECT_MEMORY, NULL);
    } else {
        w.t = incode_triangulator_init(run->common->arena[part],
                                       run->common->bytes[part], &run->setup,
                                       &outside, &why);
        if (w.t == NULL)
            fail(run, HOST_DIRECT_BROKEN, why);
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
        do_region(&w, region);
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
    double (*xyz)[3];     /* [points] */
    uint32_t *id;         /* [points] vertex numbers, */
    uint16_t *side;       /* twice the region, 1 more: AT_FINAL */
    uint32_t (*table)[4]; /* [slots] what regions have at such vertices */
    uint64_t slots;       /* a power of two */
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

static uint64_t slot_of(const struct seam *s, const uint32_t v[4]) {
    uint64_t h = (uint64_t)v[0] << 32 | v[1], g = (uint64_t)v[2] << 32 | v[3];
    h = (h ^ g * UINT64_C(0x9e3779b97f4a7c15)) * UINT64_C(0xff51afd7ed558ccd);
    h = (h ^ h >> 32) * UINT64_C(0xc4ceb9fe1a85ec53);
    return (h ^ h >> 29) & (s->slots - 1);
}

static void sort_four(uint32_t v[4]) {
    for (int i = 1; i < 4; i++)
        for (int k = i; k > 0 && v[k] < v[k - 1]; k--) {
            uint32_t other = v[k];
            v[k] = v[k - 1];
            v[k - 1] = other;
        }
}

/* Where the tetrahedron is, or would be: v[3] = INCODE_NONE. */
static uint32_t *find_left(const struct seam *s, uint32_t v[4]) {
    sort_four(v);
    uint64_t i = slot_of(s, v);
    host_call_trim(AROUND);
    while (s->table[i][3] != INCODE_NONE &&
           memcmp(s->table[i], v, sizeof s->table[i]) != 0)
        i = (i + 1) & (s->slots - 1);
    return s->table[i];
}

/* Those at final tetrahedra's vertices alone. */
static bool keep_left(struct seam *s) {
    const uint8_t *mark = s->run->mark;
    uint64_t count = 0;
    for (unsigned t = 0; t < s->run->threads; t++) {
        struct host_tetrahedra *left = &s->run->left[t];
        uint64_t kept = 0;
        for (uint64_t i = 0; i < left->count; i++) {
            const uint32_t *v = left->v[i];
            if (i % POLL_LEFT == 0)
                host_call_trim(POLL_LEFT * 2 * sizeof left->v[i]);
            if ((mark[v[0]] & mark[v[1]] & mark[v[2]] & mark[v[3]] &
                 AT_FINAL) != 0)
                memmove(left->v[kept++], v, sizeof left->v[0]);
        }
        host_tetrahedra_cut(left, kept);
        count += kept;
    }
    for (s->slots = 1; s->slots < 2 * count + 2;)
        s->slots *= 2;
    s->table = host_map(s->slots * sizeof *s->table);
    if (s->table == NULL)
        return false;
    for (uint64_t i = 0; i < s->slots; i += POLL_LEFT) {
        uint64_t n = s->slots - i < POLL_LEFT ? s->slots - i : POLL_LEFT;
        memset(s->table + i, 0xff, n * sizeof *s->table);
        host_call_trim(n * sizeof *s->table);
    }
    for (unsigned t = 0; t < s->run->threads; t++)
        for (uint64_t i = 0; i < s->run->left[t].count; i++) {
            uint32_t v[4];
            memcpy(v, s->run->left[t].v[i], sizeof v);
            uint32_t *slot = find_left(s, v);
            memcpy(slot, v, sizeof v);
        }
    return true;
}

/* Whether a tetrahedron of the seam's points is one of all points. */
static bool is_right(const struct seam *s, const uint32_t t[4]) {
    unsigned a = s->side[t[0]], b = s->side[t[1]], c = s->side[t[2]],
             d = s->side[t[3]];
    if ((a | 1U) != (b | 1U) || (a | 1U) != (c | 1U) || (a | 1U) != (d | 1U) ||
        (a & b & c & d & 1) == 0)
        return true;
    uint32_t v[4] = {s->id[t[0]], s->id[t[1]], s->id[t[2]], s->id[t[3]]};
    return find_left(s, v)[3] != INCODE_NONE;
}

static void sift(void *context, unsigned part) {
    struct seam *s = context;
    enum { POLL = 1 << 12, TOUCHED = 80 /* bytes a row */ };
    struct host_error error;
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
            if (!is_right(s, s->tets.v[i]))
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

static enum host_direct run_order(struct common *common,
                                  const struct host_order *order, bool is_first,
                                  bool alone, struct host_tetrahedra *tets);

static enum host_direct triangulate_seam(struct seam *s) {
    struct common *common = s->run->common;
    struct host_order order;
    enum host_direct outcome = HOST_DIRECT_MEMORY;
    uint64_t all = s->run->order->points;
    if (host_order_make(&order, "points", s->xyz[0], s->points, HOST_ADAPTIVE,
                        seam_regions(s->points, all), false,
                        common->error) == 0)
        outcome =
            run_order(common, &order, false, s->points <= all / 2, &s->tets);
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
    if (s.xyz != NULL && s.id != NULL && s.side != NULL && keep_left(&s)) {
        gather_seam(&s);
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
    host_unmap(s.table, s.slots * sizeof *s.table);
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

static enum host_direct run_order(struct common *common,
                                  const struct host_order *order, bool is_first,
                                  bool alone, struct host_tetrahedra *tets) {
    struct host_tetrahedra list[HOST_THREADS_MAX] = {{0}};
    struct host_tetrahedra left[HOST_THREADS_MAX] = {{0}};
    struct host_direct_sums *sums = is_first ? common->sums : NULL;
    unsigned threads = host_threads();
    threads = threads < order->regions ? threads : order->regions;
    size_t marks = (size_t)order->bricks * INCODE_BRICK_POINTS;
    struct direct run = {
        .common = common,
        .order = order,
        .tets = list,
        .left = left,
        .is_first = is_first,
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
            fail(&run, HOST_DIRECT_MEMORY, NULL);
    }
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
    struct common common = {.sums = sums, .error = error};
    enum host_direct outcome = run_order(&common, order, true, true, tets);
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
