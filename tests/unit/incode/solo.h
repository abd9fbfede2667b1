/* A triangulator alone, on no cube: pages come straight from the host's order,
 * spilled faces wait in an array, tetrahedra gather in a list.  By chance its
 * outside refuses, pages come late and in any order, and what the interface
 * promises is checked on the way. */
#ifndef TESTS_UNIT_SOLO_H
#define TESTS_UNIT_SOLO_H

#include <stdlib.h>
#include <string.h>

#include "host/mesh/order.h"
#include "host/mesh/tetrahedra.h"
#include "incode/state.h"
#include "tests/unit/test.h"

enum {
    SOLO_QUEUE = 65536,
    SOLO_GUARD = 256,
    SOLO_STEPS = 20000000 /* a region, or it goes in circles */
};

struct solo {
    /* What to do. */
    uint8_t index, face_rule, build;
    enum incode_owner_rule owner_rule;
    enum host_partition partition;
    uint32_t regions;
    size_t memory;    /* 0: the least that works */
    uint64_t shuffle; /* the pager's own */
    uint64_t chance;  /* 0: everything is ready at once */
    /* What the list may hold before it spills; 0: what fits. */
    uint32_t pressure, brick_pressure;
    bool false_start; /* each job is begun twice, the first one abandoned */
    uint32_t units;   /* that a step may work; 0: as many as it likes */
    struct incode_yield yield;

    /* What became of it. */
    struct host_digest digest;
    struct host_tetrahedra tets; /* input rows, sorted */
    uint64_t built, by_points, spilled, hulls, seeds, evictions;
    uint64_t far_calls; /* that looked at more than 2,048 points */
    uint32_t hubs;

    /* At work. */
    struct host_order order;
    struct incode_setup setup;
    struct incode_triangulator *t;
    struct incode_job job;
    uint8_t *arena;
    uint32_t pages[SOLO_QUEUE], page_count;
    struct incode_face *face;
    size_t face_count, face_room;
    uint32_t wanted; /* a spilled brick, or INCODE_NONE */
    uint8_t *committed;
};

static inline uint32_t solo_draw(struct solo *s, uint32_t below) {
    s->chance ^= s->chance << 13;
    s->chance ^= s->chance >> 7;
    s->chance ^= s->chance << 17;
    return (uint32_t)((s->chance >> 32) % below);
}

/* One time in four, if anything is left to chance. */
static inline bool solo_refuses(struct solo *s) {
    return s->chance != 0 && solo_draw(s, 4) == 0;
}

/* ---- outside ---- */

static inline bool solo_request(void *context, uint32_t page) {
    struct solo *s = context;
    if (s->page_count == SOLO_QUEUE || solo_refuses(s))
        return false;
    for (uint32_t i = 0; i < s->page_count; i++)
        assert_int_not_equal(s->pages[i], page); /* asked for once */
    s->pages[s->page_count++] = page;
    return true;
}

static inline size_t solo_emit_room(void *context) {
    struct solo *s = context;
    if (s->chance == 0)
        return 4096;
    return solo_refuses(s) ? solo_draw(s, 8) : solo_draw(s, 300);
}

static inline void solo_emit(void *context, uint32_t vertex,
                             const uint32_t (*apexes)[3], size_t count) {
    struct solo *s = context;
    struct host_error error = {0};
    uint32_t(*v)[4] = host_tetrahedra_room(&s->tets, count, &error);
    assert_non_null(v);
    for (size_t i = 0; i < count; i++) {
        v[i][0] = vertex;
        memcpy(v[i] + 1, apexes[i], sizeof apexes[i]);
        double p[4][3];
        for (int k = 0; k < 4; k++)
            host_vertex(&s->order, v[i][k], p[k]);
        const double *const at[4] = {p[0], p[1], p[2], p[3]};
        unsigned owner = incode_owner(s->owner_rule, v[i], at);
        uint32_t brick = v[i][owner] / INCODE_BRICK_POINTS;
        assert_in_range(brick, s->job.first, s->job.last - 1);
        assert_int_equal(s->committed[brick], 0);
    }
    host_tetrahedra_keep(&s->tets, count);
}

static inline void solo_commit(void *context, uint32_t brick) {
    struct solo *s = context;
    assert_in_range(brick, s->job.first, s->job.last - 1);
    assert_int_equal(s->committed[brick], 0);
    s->committed[brick] = 1;
}

static inline bool solo_spill(void *context, const struct incode_face *faces,
                              size_t count) {
    struct solo *s = context;
    if (solo_refuses(s))
        return false;
    if (s->face_count + count > s->face_room) {
        s->face_room = 2 * (s->face_count + count);
        s->face = realloc(s->face, s->face_room * sizeof *s->face);
        assert_non_null(s->face);
    }
    memcpy(s->face + s->face_count, faces, count * sizeof *faces);
    s->face_count += count;
    return true;
}

static inline bool solo_unspill(void *context, uint32_t brick) {
    struct solo *s = context;
    if (solo_refuses(s))
        return false;
    assert_int_equal(s->wanted, INCODE_NONE);
    s->wanted = brick;
    return true;
}

/* ---- the world's side ---- */

static inline void solo_deliver_page(struct solo *s, uint32_t i) {
    uint8_t page[INCODE_PAGE_BYTES];
    uint32_t number = s->pages[i];
    s->pages[i] = s->pages[--s->page_count];
    size_t bytes = host_page(&s->order, number, page);
    assert_true(bytes > 0);
    assert_int_equal(incode_triangulator_page(s->t, number, page, bytes), 0);
}

typedef int solo_take_faces(struct solo *s, const struct incode_face *faces,
                            uint32_t count, bool last);

static inline int solo_unspilled(struct solo *s,
                                 const struct incode_face *faces,
                                 uint32_t count, bool last) {
    return incode_triangulator_unspill(s->t, s->wanted, faces, count, last);
}

/* Gives the faces of the wanted brick back, in portions and in their order. */
static inline void solo_deliver_faces(struct solo *s, solo_take_faces *take) {
    uint32_t brick = s->wanted;
    size_t kept = 0, portion = s->chance == 0 ? SIZE_MAX : solo_draw(s, 64), i;
    for (i = 0; i < s->face_count && portion > 0; i++) {
        if (s->face[i].v[0] / INCODE_BRICK_POINTS != brick) {
            s->face[kept++] = s->face[i];
            continue;
        }
        portion--;
        assert_int_equal(take(s, s->face + i, 1, false), 0);
    }
    bool all = i == s->face_count;
    if (s->face_count > i)
        memmove(s->face + kept, s->face + i,
                (s->face_count - i) * sizeof *s->face);
    s->face_count -= i - kept;
    if (!all)
        return;
    assert_int_equal(take(s, NULL, 0, true), 0);
    s->wanted = INCODE_NONE;
}

/* Something of what is under way arrives; false: nothing is. */
static inline bool solo_deliver(struct solo *s) {
    if (s->wanted != INCODE_NONE && !solo_refuses(s)) {
        solo_deliver_faces(s, solo_unspilled);
        return true;
    }
    if (s->page_count == 0)
        return s->wanted != INCODE_NONE;
    if (s->chance != 0) {
        solo_deliver_page(s, solo_draw(s, s->page_count));
        return true;
    }
    while (s->page_count > 0) {
        solo_deliver_page(s, 0);
        if (s->yield.poll != NULL) /* as a node does between two messages */
            (void)s->yield.poll(s->yield.context);
    }
    return true;
}

static inline void solo_start(struct solo *s, uint32_t region) {
    const struct host_region *r = &s->order.region[region];
    s->job = (struct incode_job){.first = r->first, .last = r->last};
    memcpy(s->job.lo, r->lo, sizeof r->lo);
    memcpy(s->job.hi, r->hi, sizeof r->hi);
    incode_triangulator_start(s->t, &s->job);
    s->face_count = 0;
    s->wanted = INCODE_NONE;
    if (s->pressure != 0)
        s->t->front.room_faces = s->t->front.afl.capacity - s->pressure;
    if (s->brick_pressure != 0)
        s->t->front.room_entries =
            s->t->front.afl.touched_capacity - s->brick_pressure;
}

/* Steps until the job is done, or `steps` times. */
static inline bool solo_step(struct solo *s, uint64_t steps) {
    uint32_t idle = 0;
    while (steps-- > 0) {
        enum incode_step r = incode_triangulator_step(s->t);
        if (r == INCODE_BROKEN)
            fail_msg("%s", incode_triangulator_fault(s->t));
        s->hubs =
            s->t->front.hub_count > s->hubs ? s->t->front.hub_count : s->hubs;
        if (r == INCODE_FINISHED)
            return true;
        bool came = false;
        if (r == INCODE_WAITING || (s->chance != 0 && solo_draw(s, 8) == 0))
            came = solo_deliver(s);
        idle = r == INCODE_WAITING && !came ? idle + 1 : 0;
        assert_in_range(idle, 0, 1000); /* or it waits for nothing */
    }
    return false;
}

/* All bricks of the job, and no others, are. */
static inline void solo_check_commits(struct solo *s) {
    for (uint32_t b = 0; b < s->order.bricks; b++) {
        bool own = b >= s->job.first && b < s->job.last;
        assert_int_equal(s->committed[b], own);
        s->committed[b] = 0;
    }
    assert_int_equal(s->face_count, 0);
}

static inline void solo_region(struct solo *s, uint32_t region) {
    solo_start(s, region);
    if (s->false_start) {
        uint64_t count = s->tets.count;
        (void)solo_step(s, 50);
        host_tetrahedra_cut(&s->tets, count);
        memset(s->committed, 0, s->order.bricks);
        solo_start(s, region);
    }
    assert_true(solo_step(s, SOLO_STEPS));
    solo_check_commits(s);
    assert_int_equal(s->t->front.afl.count, 0);
}
static inline void solo_order(struct solo *s, const double *xyz, uint64_t n) {
    struct host_error error = {0};
    if (host_order_make(&s->order, "set", xyz, n, s->partition, s->regions,
                        s->index == INCODE_GRID, &error) != 0)
        fail_msg("%s", error.text);
}

static inline void solo_set_up(struct solo *s) {
    s->setup = (struct incode_setup){.bricks = s->order.bricks,
                                     .index = s->index,
                                     .face_rule = s->face_rule,
                                     .build = s->build,
                                     .owner_rule = (uint8_t)s->owner_rule,
                                     .shuffle_seed = s->shuffle};
    memcpy(s->setup.lo, s->order.lo, sizeof s->setup.lo);
    memcpy(s->setup.hi, s->order.hi, sizeof s->setup.hi);
    memcpy(s->setup.cells, s->order.cells, sizeof s->setup.cells);
    s->committed = calloc(s->order.bricks, 1);
    assert_non_null(s->committed);
}

/* Makes the triangulator; s->order has been made. */
static inline void solo_make(struct solo *s,
                             const struct incode_front_peers *peers) {
    solo_set_up(s);
    if (s->memory == 0)
        s->memory = incode_arena_min(&s->setup);
    s->memory = (s->memory + 63) / 64 * 64;
    s->arena = aligned_alloc(64, s->memory + SOLO_GUARD);
    assert_non_null(s->arena);
    memset(s->arena, 0xa5, s->memory + SOLO_GUARD);
    const struct incode_outside outside = {
        .pages = {s, solo_request},
        .front = {s, solo_emit_room, solo_emit, solo_commit, solo_spill,
                  solo_unspill, NULL},
        .peers = *peers,
        .yield = s->yield};
    const char *why = "";
    s->t = incode_triangulator_init(s->arena, s->memory, &s->setup, &outside,
                                    &why);
    if (s->t == NULL)
        fail_msg("%s", why);
    if (s->units != 0)
        incode_triangulator_allow(s->t, s->units);
}

static inline void solo_open(struct solo *s, const double *xyz, uint64_t n) {
    const struct incode_front_peers none = {0};
    solo_order(s, xyz, n);
    solo_make(s, &none);
}

/* The whole set, region after region, in one arena. */
static inline void solo_run(struct solo *s, const double *xyz, uint64_t n) {
    solo_open(s, xyz, n);
    for (uint32_t r = 0; r < s->regions; r++)
        solo_region(s, r);
    struct incode_statistics stats;
    incode_triangulator_statistics(s->t, &stats);
    assert_int_equal(stats.tetrahedra_kept >= s->tets.count, 1);
    assert_in_range(stats.memory_high_water, 1, s->memory);
    assert_true(stats.tetrahedra_by_points <= stats.tetrahedra_kept);
    s->by_points = stats.tetrahedra_by_points;
    s->built = stats.tetrahedra_built;
    s->spilled = stats.afl_spilled;
    s->hulls = stats.hull_facets;
    s->seeds = stats.seeds;
    s->evictions = stats.page_evictions;
    s->far_calls =
        stats.candidates_histogram[22] + stats.candidates_histogram[23];
    for (size_t i = 0; i < SOLO_GUARD; i++)
        assert_int_equal(s->arena[s->memory + i], 0xa5);
    host_tetrahedra_map(&s->tets, s->order.row);
    host_tetrahedra_sort(&s->tets);
    host_digest(&s->tets, &s->digest);
}

static inline void solo_close(struct solo *s) {
    host_order_free(&s->order);
    host_tetrahedra_free(&s->tets);
    free(s->arena);
    free(s->committed);
    free(s->face);
}

#endif
