#include "region.h"

#include <string.h>

enum {
    SPILL_TAKEN = 128,       /* faces given back at a time */
    EMITTED_ROOM = 1 << 12,  /* tetrahedra that the triangulator may give at
                                once */
    HOPELESS = 2,            /* times as many tetrahedra are not final, */
    HOPELESS_LEAST = 1 << 14 /* and at least so many */
};

bool direct_fail(struct direct *run, enum host_direct outcome,
                 const char *why) {
    int before = HOST_DIRECT_DONE;
    if (!atomic_compare_exchange_strong(&run->outcome, &before, outcome))
        return false;
    atomic_store(&run->why, why);
    return true;
}

/* --- what a triangulator asks for ----------------------------------------- */

static bool request(void *context, uint32_t page) {
    struct direct_worker *w = context;
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
    struct direct_worker *w = context;
    uint32_t(*v)[4] = host_tetrahedra_room(w->tets, count, &w->error);
    if (v == NULL) {
        direct_fail(w->run, HOST_DIRECT_MEMORY, NULL);
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
    struct direct_worker *w = context;
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
        direct_fail(w->run, HOST_DIRECT_MEMORY, NULL);
        return;
    }
    memcpy(left[0], v, sizeof left[0]);
    host_call_trim(sizeof left[0]);
    host_tetrahedra_keep(w->left, 1);
}

static void count_bricks(struct direct_worker *w, uint32_t count) {
    struct host_direct_sums *sums = w->run->common->sums;
    if (w->run->level > 0)
        return;
    if (w->call != NULL)
        atomic_fetch_add_explicit(&w->call->bricks, count,
                                  memory_order_relaxed);
    if (sums != NULL) {
        uint32_t done = count + atomic_fetch_add_explicit(&sums->bricks, count,
                                                          memory_order_relaxed);
        if (w->is_caller && sums->committed != NULL)
            sums->committed(done);
    }
}

static void commit(void *context, uint32_t brick) {
    struct direct_worker *w = context;
    (void)brick;
    /* As where coordinates are too small for the bounds of spheres. */
    uint64_t final = w->tets->count - w->tets_before;
    uint64_t left = w->left->count - w->left_before;
    w->is_hopeless = left > HOPELESS_LEAST && left / HOPELESS > final;
    count_bricks(w, 1);
}

static bool spill(void *context, const struct incode_face *faces,
                  size_t count) {
    struct direct_worker *w = context;
    if (host_spill_put(&w->spill, 0, faces, (uint32_t)count, &w->error) != 0)
        direct_fail(w->run, HOST_DIRECT_MEMORY, NULL);
    return true;
}

static bool unspill(void *context, uint32_t brick) {
    struct direct_worker *w = context;
    w->wanted = brick;
    return true;
}

struct incode_outside direct_outside(struct direct_worker *w) {
    return (struct incode_outside){
        .pages = {w, request},
        .front = {.context = w,
                  .emit_room = emit_room,
                  .emit = emit,
                  .left = w->run->mark != NULL ? leave : NULL,
                  .commit = commit,
                  .spill = spill,
                  .unspill = unspill}};
}

/* --- what it gets --------------------------------------------------------- */

static bool deliver_faces(struct direct_worker *w) {
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

static bool deliver_pages(struct direct_worker *w) {
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

static bool deliver(struct direct_worker *w) {
    if (w->page_count == 0 && w->wanted == INCODE_NONE)
        return false;
    return (w->wanted == INCODE_NONE || deliver_faces(w)) && deliver_pages(w);
}

/* A region that cannot be triangulated alone: all of it is seam. */
static void give_up_region(struct direct_worker *w,
                           const struct host_region *r) {
    const struct host_order *order = w->run->order;
    host_tetrahedra_cut(w->tets, w->tets_before);
    host_tetrahedra_cut(w->left, w->left_before);
    (void)deliver(w); /* what the triangulator will not ask for again */
    for (uint32_t brick = r->first; brick < r->last; brick++)
        memset(w->run->mark + (size_t)brick * INCODE_BRICK_POINTS, AT_SEAM,
               order->fill[brick]);
}

static void do_region(struct direct_worker *w, uint32_t number) {
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
            direct_fail(w->run, HOST_DIRECT_BROKEN,
                        incode_triangulator_fault(w->t));
        else if (step == INCODE_WAITING && !deliver(w))
            direct_fail(w->run, HOST_DIRECT_BROKEN, "it waits for nothing");
        if (host_call_cancelled())
            direct_fail(w->run, HOST_DIRECT_CANCELLED, NULL);
    }
}

void direct_region(struct direct_worker *w, uint32_t number) {
    struct direct *run = w->run;
    const struct host_direct_store *store = run->store;
    const struct host_region *r = &run->order->region[number];
    size_t first = (size_t)r->first * INCODE_BRICK_POINTS;
    struct host_direct_region region = {.key = run->key,
                                        .level = run->level,
                                        .number = number,
                                        .regions = run->order->regions,
                                        .tets = w->tets,
                                        .left = w->left,
                                        .tets_before = w->tets->count,
                                        .left_before = w->left->count};
    if (run->mark != NULL) {
        region.mark = run->mark + first;
        region.marks = (size_t)r->last * INCODE_BRICK_POINTS - first;
    }
    if (store != NULL && store->load(store->context, &region)) {
        count_bricks(w, r->last - r->first);
        return;
    }
    do_region(w, number);
    if (store != NULL && run->outcome == HOST_DIRECT_DONE &&
        store->keep(store->context, &region, &w->error) != 0 &&
        direct_fail(run, HOST_DIRECT_UNKEPT, NULL))
        *run->common->error = w->error;
}
