/* A face manager and its tetrahedron builders in one process: lists and answers
 * are handed over by chance, late and in any order, pages come straight from
 * the host's order, spilled faces wait in an array, tetrahedra gather in a
 * list. */
#ifndef TESTS_UNIT_LEND_SCENE_H
#define TESTS_UNIT_LEND_SCENE_H

#include <stdlib.h>
#include <string.h>

#include "host/mesh/tetrahedra.h"
#include "host/mesh/order.h"
#include "incode/paper/builder.h"
#include "incode/paper/manager.h"
#include "tests/unit/test.h"

enum {
    LEND_BUILDERS = 8,
    LEND_PAGES = 65536,
    LEND_STEPS = 20000000, /* or it goes in circles */
    LEND_IDLE = 100000
};

struct lend {
    /* What to do. */
    uint8_t index;
    uint32_t builders, faces, jobs; /* of a list; lists a builder */
    uint32_t regions;               /* 0: one */
    size_t memory;                  /* of the list; 0: the least */
    uint64_t chance;                /* 0: everything is ready at once */
    uint64_t shuffle;               /* the pagers' own */
    uint32_t pressure, units;       /* faces before it spills; units a step */

    /* What became of it. */
    struct host_digest digest;
    struct host_tetrahedra tets;  /* input rows, sorted */
    struct incode_statistics all; /* of the manager */
    uint64_t built, calls, lists, empty_faces;

    /* At work. */
    struct host_order order;
    struct incode_setup setup;
    struct incode_job job;
    struct incode_manager manager;
    void *memory_of_manager;
    struct lend_builder {
        struct lend *lend;
        struct incode_builder builder;
        void *memory;
        uint32_t pages[LEND_PAGES], page_count;
    } * builder;
    struct incode_face *face;
    size_t face_count, face_room;
    uint32_t wanted; /* a spilled brick, or INCODE_NONE */
    uint8_t *committed;
};

static inline uint32_t lend_draw(struct lend *s, uint32_t below) {
    s->chance ^= s->chance << 13;
    s->chance ^= s->chance >> 7;
    s->chance ^= s->chance << 17;
    return (uint32_t)((s->chance >> 32) % below);
}

/* One time in four, if anything is left to chance. */
static inline bool lend_refuses(struct lend *s) {
    return s->chance != 0 && lend_draw(s, 4) == 0;
}

/* ---- outside ---- */

static inline bool lend_request(void *context, uint32_t page) {
    struct lend_builder *b = context;
    if (b->page_count == LEND_PAGES || lend_refuses(b->lend))
        return false;
    b->pages[b->page_count++] = page;
    return true;
}

static inline size_t lend_emit_room(void *context) {
    struct lend *s = context;
    if (s->chance == 0)
        return 4096;
    return lend_refuses(s) ? lend_draw(s, 8) : lend_draw(s, 300);
}

static inline void lend_emit(void *context, uint32_t vertex,
                             const uint32_t (*apexes)[3], size_t count) {
    struct lend *s = context;
    struct host_error error = {0};
    uint32_t(*v)[4] = host_tetrahedra_room(&s->tets, count, &error);
    assert_non_null(v);
    for (size_t i = 0; i < count; i++) {
        v[i][0] = vertex;
        memcpy(v[i] + 1, apexes[i], sizeof apexes[i]);
    }
    host_tetrahedra_keep(&s->tets, count);
}

static inline void lend_commit(void *context, uint32_t brick) {
    struct lend *s = context;
    assert_in_range(brick, s->job.first, s->job.last - 1);
    assert_int_equal(s->committed[brick], 0);
    s->committed[brick] = 1;
}

static inline bool lend_spill(void *context, const struct incode_face *faces,
                              size_t count) {
    struct lend *s = context;
    if (lend_refuses(s))
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

static inline bool lend_unspill(void *context, uint32_t brick) {
    struct lend *s = context;
    if (lend_refuses(s))
        return false;
    assert_int_equal(s->wanted, INCODE_NONE);
    s->wanted = brick;
    return true;
}

/* ---- the world's side ---- */

/* Gives the faces of the wanted brick back, in portions and in their order. */
static inline void lend_deliver_faces(struct lend *s) {
    uint32_t brick = s->wanted;
    size_t kept = 0, portion = s->chance == 0 ? SIZE_MAX : lend_draw(s, 64), i;
    for (i = 0; i < s->face_count && portion > 0; i++) {
        if (s->face[i].v[0] / INCODE_BRICK_POINTS != brick) {
            s->face[kept++] = s->face[i];
            continue;
        }
        portion--;
        assert_int_equal(
            incode_manager_unspill(&s->manager, brick, s->face + i, 1, false),
            0);
    }
    bool all = i == s->face_count;
    if (s->face_count > i)
        memmove(s->face + kept, s->face + i,
                (s->face_count - i) * sizeof *s->face);
    s->face_count -= i - kept;
    if (!all)
        return;
    s->wanted = INCODE_NONE;
    assert_int_equal(incode_manager_unspill(&s->manager, brick, NULL, 0, true),
                     0);
}

static inline void lend_deliver_page(struct lend_builder *b) {
    uint8_t page[INCODE_PAGE_BYTES];
    struct lend *s = b->lend;
    if (b->page_count == 0)
        return;
    uint32_t i = s->chance == 0 ? 0 : lend_draw(s, b->page_count);
    uint32_t number = b->pages[i];
    b->pages[i] = b->pages[--b->page_count];
    size_t bytes = host_page(&s->order, number, page);
    assert_int_equal(incode_maker_page(&b->builder.maker, number, page, bytes),
                     0);
}

/* The answers of some builder, if the manager takes any. */
static inline bool lend_answer(struct lend *s) {
    uint32_t from = s->chance == 0 ? 0 : lend_draw(s, s->builders);
    for (uint32_t i = 0; i < s->builders && incode_manager_is_free(&s->manager);
         i++) {
        struct incode_builder *b =
            &s->builder[(from + i) % s->builders].builder;
        const struct incode_answers *answers = incode_builder_answers(b);
        if (answers == NULL)
            continue;
        for (uint32_t k = 0; k < answers->count; k++)
            s->empty_faces += answers->kind == INCODE_LIST_FACES &&
                              answers->v[k][3] == INCODE_NONE;
        incode_manager_take(&s->manager, answers);
        incode_builder_drop(b);
        return true;
    }
    return false;
}

/* A list to a builder that has room. */
static inline bool lend_list(struct lend *s) {
    struct incode_list list;
    uint32_t from = s->chance == 0 ? 0 : lend_draw(s, s->builders);
    for (uint32_t i = 0; i < s->builders; i++) {
        struct incode_builder *b =
            &s->builder[(from + i) % s->builders].builder;
        if (incode_builder_held(b) == s->jobs)
            continue;
        if (incode_manager_lend(&s->manager, s->faces, &list) == 0)
            return false;
        assert_in_range(list.count, 1, INCODE_LIST_MAX);
        assert_true(list.kind != INCODE_LIST_FACES || list.count <= s->faces);
        assert_true(incode_builder_take(b, &list));
        s->lists++;
        return true;
    }
    return false;
}

static inline bool lend_build(struct lend *s) {
    bool worked = false;
    for (uint32_t i = 0; i < s->builders; i++) {
        struct lend_builder *b = &s->builder[i];
        if (lend_refuses(s))
            continue;
        enum incode_step r = incode_builder_step(
            &b->builder, s->units == 0 ? UINT32_MAX : s->units);
        if (r == INCODE_BROKEN)
            fail_msg("%s", incode_builder_fault(&b->builder));
        worked = worked || r == INCODE_WORKED || b->page_count > 0;
        if (r == INCODE_WAITING || s->chance == 0 || lend_draw(s, 4) == 0)
            lend_deliver_page(b);
    }
    return worked;
}

static inline void lend_job(struct lend *s, uint32_t region) {
    const struct host_region *r = &s->order.region[region];
    s->job = (struct incode_job){.first = r->first, .last = r->last};
    incode_manager_start(&s->manager, &s->job);
    s->face_count = 0;
    s->wanted = INCODE_NONE;
    if (s->pressure != 0)
        s->manager.front.room_faces =
            s->manager.front.afl.capacity - s->pressure;
    enum incode_step step = INCODE_WORKED;
    uint32_t idle = 0;
    for (uint32_t i = 0; step != INCODE_FINISHED; i++) {
        assert_in_range(i, 0, LEND_STEPS);
        step = incode_manager_step(&s->manager,
                                   s->units == 0 ? UINT32_MAX : s->units);
        if (step == INCODE_BROKEN)
            fail_msg("%s", incode_manager_fault(&s->manager));
        bool moved = step == INCODE_WORKED;
        moved = (!lend_refuses(s) && lend_answer(s)) || moved;
        moved = (!lend_refuses(s) && lend_list(s)) || moved;
        moved = lend_build(s) || moved;
        if (s->wanted != INCODE_NONE && !lend_refuses(s))
            lend_deliver_faces(s);
        idle = moved ? 0 : idle + 1;
        assert_in_range(idle, 0, LEND_IDLE); /* or it waits for nothing */
    }
    assert_int_equal(s->manager.front.afl.count, 0);
    assert_int_equal(s->manager.front.afl.held_count, 0);
    assert_int_equal(s->face_count, 0);
    for (uint32_t b = 0; b < s->order.bricks; b++) {
        assert_int_equal(s->committed[b], b >= s->job.first && b < s->job.last);
        s->committed[b] = 0;
    }
}

static inline void lend_open(struct lend *s, const double *xyz, uint64_t n) {
    struct host_error error = {0};
    s->regions = s->regions == 0 ? 1 : s->regions;
    if (host_order_make(&s->order, "set", xyz, n, HOST_ADAPTIVE, s->regions,
                        s->index == INCODE_GRID, &error) != 0)
        fail_msg("%s", error.text);
    s->setup = (struct incode_setup){.bricks = s->order.bricks,
                                     .index = s->index,
                                     .shuffle_seed = s->shuffle};
    memcpy(s->setup.lo, s->order.lo, sizeof s->setup.lo);
    memcpy(s->setup.hi, s->order.hi, sizeof s->setup.hi);
    memcpy(s->setup.cells, s->order.cells, sizeof s->setup.cells);
    const struct incode_front_outside outside = {
        s, lend_emit_room, lend_emit, lend_commit, lend_spill, lend_unspill};
    const struct incode_yield yield = {0};
    size_t bytes = s->memory == 0 ? incode_manager_min() : s->memory;
    s->memory_of_manager = aligned_alloc(64, (bytes + 63) / 64 * 64);
    s->builder = calloc(s->builders, sizeof *s->builder);
    s->committed = calloc(s->order.bricks, 1);
    assert_non_null(s->memory_of_manager);
    assert_non_null(s->builder);
    assert_non_null(s->committed);
    incode_manager_init(&s->manager, s->memory_of_manager, bytes, &s->setup,
                        &outside, &yield);
    for (uint32_t i = 0; i < s->builders; i++) {
        struct lend_builder *b = &s->builder[i];
        size_t least = incode_builder_min(s->jobs);
        b->lend = s;
        b->memory = aligned_alloc(64, (least + 63) / 64 * 64);
        assert_non_null(b->memory);
        memset(b->memory, 0xa5, least);
        const struct incode_page_source source = {b, lend_request};
        incode_builder_init(&b->builder, b->memory, least, &s->setup, s->jobs,
                            &source, &yield);
    }
}

static inline void lend_run(struct lend *s, const double *xyz, uint64_t n) {
    lend_open(s, xyz, n);
    for (uint32_t r = 0; r < s->regions; r++)
        lend_job(s, r);
    incode_manager_statistics(&s->manager, &s->all);
    for (uint32_t i = 0; i < s->builders; i++) {
        struct incode_statistics one;
        incode_builder_statistics(&s->builder[i].builder, &one);
        s->built += one.tetrahedra_built;
        s->calls += one.make_tetra_calls;
        assert_int_equal(incode_builder_held(&s->builder[i].builder), 0);
    }
    assert_int_equal(s->all.tetrahedra_kept, s->tets.count);
    assert_true(s->built >= s->tets.count);
    host_tetrahedra_map(&s->tets, s->order.row);
    host_tetrahedra_sort(&s->tets);
    host_digest(&s->tets, &s->digest);
}

static inline void lend_close(struct lend *s) {
    for (uint32_t i = 0; i < s->builders; i++)
        free(s->builder[i].memory);
    host_order_free(&s->order);
    host_tetrahedra_free(&s->tets);
    free(s->builder);
    free(s->memory_of_manager);
    free(s->committed);
    free(s->face);
}

#endif
