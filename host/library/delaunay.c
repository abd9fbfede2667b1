#include "delaunay.h"

#include <string.h>
#include <time.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/spill.h"

enum {
    PAGES_QUEUE = 1024,
    SPILL_TAKEN = 128,     /* faces given back at a time */
    EMITTED_ROOM = 1 << 12 /* tetrahedra that the triangulator may give at once
                            */
};

/* The threads of one run. */
struct direct {
    const struct host_order *order;
    struct host_direct_sums *sums; /* or NULL */
    struct host_tetrahedra *tets;  /* [threads] */
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
    struct host_tetrahedra *tets;
    struct incode_triangulator *t;
    struct host_spill spill;
    struct host_error error;
    uint32_t pages[PAGES_QUEUE], page_count; /* requested */
    uint32_t wanted; /* brick whose spilled faces are wanted, or INCODE_NONE */
};

/* What is not yet final of a volume of so many points fits a triangulation by
 * points (INCODE_COMPLEX_POINTS_MAX); more would go on by faces, which takes
 * several times as long. */
enum { REGION_POINTS = 1 << 20, REGIONS_MAX = 1 << 12 };

uint32_t host_direct_regions(unsigned threads, uint64_t points) {
    uint32_t regions = 1;
    while (regions < threads ||
           (points / regions > REGION_POINTS && regions < REGIONS_MAX))
        regions *= 2;
    return regions;
}

static void fail(struct direct *run, enum host_direct outcome,
                 const char *why) {
    int before = HOST_DIRECT_DONE;
    if (atomic_compare_exchange_strong(&run->outcome, &before, outcome))
        atomic_store(&run->why, why);
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
    for (size_t i = 0; i < count; i++) {
        v[i][0] = vertex;
        memcpy(v[i] + 1, apexes[i], sizeof apexes[i]);
    }
    host_tetrahedra_keep(w->tets, count);
}

static void commit(void *context, uint32_t brick) {
    struct worker *w = context;
    struct host_direct_sums *sums = w->run->sums;
    (void)brick;
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

static void do_region(struct worker *w, uint32_t number) {
    const struct host_region *r = &w->run->order->region[number];
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

/* An arena of as many bytes as there are, down to the least that works. */
static void *map_arena(const struct direct *run, size_t *bytes) {
    size_t least = (incode_arena_min(&run->setup) + 63) / 64 * 64;
    void *arena = NULL;
    for (*bytes = run->arena > least ? run->arena : least; arena == NULL;
         *bytes = *bytes / 2 > least ? *bytes / 2 / 64 * 64 : least) {
        arena = host_map(*bytes);
        if (arena != NULL || *bytes == least)
            return arena;
    }
    return arena;
}

static void work(void *context, unsigned part) {
    struct direct *run = context;
    struct worker w = {.run = run,
                       .call = host_call(),
                       .is_caller = part + 1 == run->threads,
                       .tets = &run->tets[part],
                       .wanted = INCODE_NONE};
    const struct incode_outside outside = {
        .pages = {&w, request},
        .front = {&w, emit_room, emit, commit, spill, unspill}};
    double cpu = used_s(CLOCK_THREAD_CPUTIME_ID);
    double wall = used_s(CLOCK_MONOTONIC);
    size_t bytes = 0;
    void *arena = map_arena(run, &bytes);
    const char *why = NULL;
    /* As many spilled faces as memory has room for, and no file. */
    if (arena == NULL || host_spill_init(&w.spill, UINT32_MAX, &w.error) != 0) {
        fail(run, HOST_DIRECT_MEMORY, NULL);
    } else {
        w.t =
            incode_triangulator_init(arena, bytes, &run->setup, &outside, &why);
        if (w.t == NULL)
            fail(run, HOST_DIRECT_BROKEN, why);
    }
    uint32_t region;
    while (run->outcome == HOST_DIRECT_DONE &&
           (region = atomic_fetch_add(&run->regions, 1)) < run->order->regions)
        do_region(&w, region);
    if (run->sums != NULL && w.t != NULL) {
        struct host_direct_part *p = &run->sums->part[part];
        incode_triangulator_statistics(w.t, &p->statistics);
        p->faces_spilled = w.spill.faces_total;
        p->cpu_s = used_s(CLOCK_THREAD_CPUTIME_ID) - cpu;
        p->wall_s = used_s(CLOCK_MONOTONIC) - wall;
        p->arena = bytes;
    }
    if (w.spill.table != NULL)
        host_spill_free(&w.spill);
    host_unmap(arena, bytes);
}

/* Memory that is not touched costs nothing.  Where what is not yet final fits,
 * points are inserted; the frames of all pages serve what has to go by faces.
 */
static size_t arena_bytes(const struct host_order *order) {
    enum { LEAST = 16 << 20, MOST = 256 << 20 };
    size_t bytes = LEAST + (size_t)order->tree.pages * INCODE_PAGE_BYTES;
    return bytes < MOST ? bytes : MOST;
}

enum host_direct host_direct_run(const struct host_order *order,
                                 struct host_tetrahedra *tets,
                                 struct host_direct_sums *sums,
                                 struct host_error *error) {
    struct host_tetrahedra list[HOST_THREADS_MAX] = {{0}};
    unsigned threads = host_threads();
    threads = threads < order->regions ? threads : order->regions;
    struct direct run = {
        .order = order,
        .sums = sums,
        .tets = list,
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
    if (sums != NULL)
        sums->threads = threads;
    host_fork_all(threads, work, &run);
    enum host_direct outcome = (enum host_direct)run.outcome;
    if (outcome == HOST_DIRECT_BROKEN)
        host_fail(error, HOST_BROKEN, "host: %s; please report this fault",
                  run.why);
    else if (outcome == HOST_DIRECT_MEMORY)
        host_fail_memory(error, "the tetrahedra");
    else if (outcome == HOST_DIRECT_CANCELLED)
        host_fail(error, HOST_BROKEN, "host: cancelled");
    else if (host_tetrahedra_join(list, threads, order->row, error) != 0)
        outcome = HOST_DIRECT_MEMORY;
    if (outcome == HOST_DIRECT_DONE) {
        *tets = list[0];
        list[0] = (struct host_tetrahedra){0};
    }
    for (unsigned i = 0; i < threads; i++)
        host_tetrahedra_free(&list[i]);
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
