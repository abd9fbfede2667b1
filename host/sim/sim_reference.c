#include "sim_reference.h"

#include <stdlib.h>
#include <string.h>

#include "incode/triangulator.h"
#include "host/mesh/order.h"

enum { PAGES_MAX = 4096, SPARE_BYTES = 8 << 20, EMIT_ROOM = 4096 };

struct reference {
    struct host_order order;
    struct host_tetrahedra *tets;
    struct host_error *error;
    struct incode_triangulator *t;
    uint32_t pages[PAGES_MAX], count; /* asked for */
    uint32_t committed;
};

static bool request(void *context, uint32_t page) {
    struct reference *r = context;
    if (r->count == PAGES_MAX) {
        return false;
    }
    r->pages[r->count++] = page;
    return true;
}

static size_t emit_room(void *context) {
    (void)context;
    return EMIT_ROOM;
}

static void emit(void *context, uint32_t vertex, const uint32_t (*apexes)[3],
                 size_t count) {
    struct reference *r = context;
    uint32_t(*v)[4] = host_tetrahedra_room(r->tets, count, r->error);
    for (size_t i = 0; v != NULL && i < count; i++) {
        v[i][0] = vertex;
        memcpy(v[i] + 1, apexes[i], sizeof apexes[i]);
    }
    host_tetrahedra_keep(r->tets, v == NULL ? 0 : count);
}

static void commit(void *context, uint32_t brick) {
    struct reference *r = context;
    (void)brick;
    r->committed++;
}

/* There is memory enough: nothing is spilled. */
static bool spill(void *context, const struct incode_face *faces,
                  size_t count) {
    (void)context, (void)faces, (void)count;
    return false;
}

static bool unspill(void *context, uint32_t brick) {
    (void)context, (void)brick;
    return false;
}

static void deliver(struct reference *r) {
    uint8_t page[INCODE_PAGE_BYTES];
    while (r->count > 0) {
        uint32_t number = r->pages[--r->count];
        size_t bytes = host_page(&r->order, number, page);
        (void)incode_triangulator_page(r->t, number, page, bytes);
    }
}

static int work(struct reference *r) {
    enum incode_step step = INCODE_WORKED;
    while (step != INCODE_FINISHED && r->error->code == 0) {
        step = incode_triangulator_step(r->t);
        if (step == INCODE_BROKEN ||
            (step == INCODE_WAITING && r->count == 0)) {
            const char *why = incode_triangulator_fault(r->t);
            return host_fail(r->error, HOST_BROKEN,
                             "the triangulator alone: %s; please report this",
                             why == NULL ? "waits for nothing" : why);
        }
        deliver(r);
    }
    if (r->committed != r->order.bricks) {
        return host_fail(r->error, HOST_BROKEN,
                         "the triangulator alone: %u bricks of %u committed; "
                         "please report this",
                         r->committed, r->order.bricks);
    }
    return r->error->code;
}

static int triangulate(struct reference *r, void *arena, size_t bytes,
                       const struct incode_setup *setup) {
    const struct incode_outside outside = {
        .pages = {r, request},
        .front = {r, emit_room, emit, commit, spill, unspill}};
    const char *why = NULL;
    r->t = incode_triangulator_init(arena, bytes, setup, &outside, &why);
    if (r->t == NULL) {
        return host_fail(r->error, HOST_BROKEN,
                         "the triangulator alone: %s; please report this", why);
    }
    struct incode_job job = {.first = 0, .last = r->order.bricks};
    memcpy(job.lo, r->order.region[0].lo, sizeof job.lo);
    memcpy(job.hi, r->order.region[0].hi, sizeof job.hi);
    incode_triangulator_start(r->t, &job);
    return work(r);
}

int host_reference(const struct host_points *points,
                   struct host_tetrahedra *tets, struct host_error *error) {
    struct reference r = {.tets = tets, .error = error};
    if (host_order_make(&r.order, "points", points->xyz, points->count,
                        HOST_ADAPTIVE, 1, false, error) != 0) {
        return error->code;
    }
    struct incode_setup setup = {.bricks = r.order.bricks,
                                 .index = INCODE_KD,
                                 .build = INCODE_BUILD_FACES};
    memcpy(setup.lo, r.order.lo, sizeof setup.lo);
    memcpy(setup.hi, r.order.hi, sizeof setup.hi);
    size_t bytes = incode_arena_min(&setup) +
                   (size_t)r.order.bricks * INCODE_PAGE_BYTES + SPARE_BYTES;
    bytes = (bytes + 63) / 64 * 64;
    void *arena = aligned_alloc(64, bytes);
    int status = arena == NULL
                     ? host_fail_memory(error, "the triangulator alone")
                     : triangulate(&r, arena, bytes, &setup);
    if (status == 0) {
        host_tetrahedra_map(tets, r.order.row);
        host_tetrahedra_sort(tets);
    }
    free(arena);
    host_order_free(&r.order);
    return status;
}
