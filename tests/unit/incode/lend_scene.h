/* A face manager and its tetrahedron builders in one process: lists and answers
 * are handed over by chance, late and in any order, pages come straight from
 * the host's order, spilled faces wait in an array, tetrahedra gather in a
 * list. */
#ifndef TESTS_UNIT_LEND_SCENE_H
#define TESTS_UNIT_LEND_SCENE_H

#include "incode/paper/builder.h"
#include "incode/paper/manager.h"
#include "tests/unit/incode/solo.h"

enum {
    LEND_BUILDERS = 8,
    LEND_PAGES = 65536,
    LEND_STEPS = 20000000, /* or it goes in circles */
    LEND_IDLE = 100000
};

struct lend {
    struct solo world; /* what to do, and what came of it, but for these */
    uint32_t builders, faces, jobs; /* of a list; lists a builder */
    struct incode_statistics all;   /* of the manager */
    uint64_t built, calls, lists, empty_faces;

    /* At work. */
    struct incode_manager manager;
    void *memory_of_manager;
    struct lend_builder {
        struct lend *lend;
        struct incode_builder builder;
        void *memory;
        uint32_t pages[LEND_PAGES], page_count;
    } * builder;
};

static inline bool lend_request(void *context, uint32_t page) {
    struct lend_builder *b = context;
    if (b->page_count == LEND_PAGES || solo_refuses(&b->lend->world))
        return false;
    b->pages[b->page_count++] = page;
    return true;
}

/* `world` is the first member. */
static inline int lend_unspilled(struct solo *world,
                                 const struct incode_face *faces,
                                 uint32_t count, bool last) {
    struct lend *s = (struct lend *)(void *)world;
    return incode_manager_unspill(&s->manager, world->wanted, faces, count,
                                  last);
}

static inline void lend_deliver_page(struct lend_builder *b) {
    uint8_t page[INCODE_PAGE_BYTES];
    struct solo *world = &b->lend->world;
    if (b->page_count == 0)
        return;
    uint32_t i = world->chance == 0 ? 0 : solo_draw(world, b->page_count);
    uint32_t number = b->pages[i];
    b->pages[i] = b->pages[--b->page_count];
    size_t bytes = host_page(&world->order, number, page);
    assert_int_equal(incode_maker_page(&b->builder.maker, number, page, bytes),
                     0);
}

/* The answers of some builder, if the manager takes any. */
static inline bool lend_answer(struct lend *s) {
    uint32_t from =
        s->world.chance == 0 ? 0 : solo_draw(&s->world, s->builders);
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
    uint32_t from =
        s->world.chance == 0 ? 0 : solo_draw(&s->world, s->builders);
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
        if (solo_refuses(&s->world))
            continue;
        enum incode_step r = incode_builder_step(
            &b->builder, s->world.units == 0 ? UINT32_MAX : s->world.units);
        if (r == INCODE_BROKEN)
            fail_msg("%s", incode_builder_fault(&b->builder));
        worked = worked || r == INCODE_WORKED || b->page_count > 0;
        if (r == INCODE_WAITING || s->world.chance == 0 ||
            solo_draw(&s->world, 4) == 0)
            lend_deliver_page(b);
    }
    return worked;
}

static inline void lend_job(struct lend *s, uint32_t region) {
    const struct host_region *r = &s->world.order.region[region];
    s->world.job = (struct incode_job){.first = r->first, .last = r->last};
    incode_manager_start(&s->manager, &s->world.job);
    s->world.face_count = 0;
    s->world.wanted = INCODE_NONE;
    if (s->world.pressure != 0)
        s->manager.front.room_faces =
            s->manager.front.afl.capacity - s->world.pressure;
    enum incode_step step = INCODE_WORKED;
    uint32_t idle = 0;
    for (uint32_t i = 0; step != INCODE_FINISHED; i++) {
        assert_in_range(i, 0, LEND_STEPS);
        step = incode_manager_step(
            &s->manager, s->world.units == 0 ? UINT32_MAX : s->world.units);
        if (step == INCODE_BROKEN)
            fail_msg("%s", incode_manager_fault(&s->manager));
        bool moved = step == INCODE_WORKED;
        moved = (!solo_refuses(&s->world) && lend_answer(s)) || moved;
        moved = (!solo_refuses(&s->world) && lend_list(s)) || moved;
        moved = lend_build(s) || moved;
        if (s->world.wanted != INCODE_NONE && !solo_refuses(&s->world))
            solo_deliver_faces(&s->world, lend_unspilled);
        idle = moved ? 0 : idle + 1;
        assert_in_range(idle, 0, LEND_IDLE); /* or it waits for nothing */
    }
    assert_int_equal(s->manager.front.afl.count, 0);
    assert_int_equal(s->manager.front.afl.held_count, 0);
    solo_check_commits(&s->world);
}

static inline void lend_open(struct lend *s, const double *xyz, uint64_t n) {
    struct solo *world = &s->world;
    world->regions = world->regions == 0 ? 1 : world->regions;
    world->owner_rule = INCODE_OWNER_LOWEST;
    solo_order(world, xyz, n);
    solo_set_up(world);
    const struct incode_front_outside outside = {
        world,      solo_emit_room, solo_emit, solo_commit,
        solo_spill, solo_unspill,   NULL};
    const struct incode_yield yield = {0};
    size_t bytes =
        s->world.memory == 0 ? incode_manager_min() : s->world.memory;
    s->memory_of_manager = aligned_alloc(64, (bytes + 63) / 64 * 64);
    s->builder = calloc(s->builders, sizeof *s->builder);
    assert_non_null(s->memory_of_manager);
    assert_non_null(s->builder);
    incode_manager_init(&s->manager, s->memory_of_manager, bytes,
                        &s->world.setup, &outside, &yield);
    for (uint32_t i = 0; i < s->builders; i++) {
        struct lend_builder *b = &s->builder[i];
        size_t least = incode_builder_min(s->jobs);
        b->lend = s;
        b->memory = aligned_alloc(64, (least + 63) / 64 * 64);
        assert_non_null(b->memory);
        memset(b->memory, 0xa5, least);
        const struct incode_page_source source = {b, lend_request};
        incode_builder_init(&b->builder, b->memory, least, &s->world.setup,
                            s->jobs, &source, &yield);
    }
}

static inline void lend_run(struct lend *s, const double *xyz, uint64_t n) {
    lend_open(s, xyz, n);
    for (uint32_t r = 0; r < s->world.regions; r++)
        lend_job(s, r);
    incode_manager_statistics(&s->manager, &s->all);
    for (uint32_t i = 0; i < s->builders; i++) {
        struct incode_statistics one;
        incode_builder_statistics(&s->builder[i].builder, &one);
        s->built += one.tetrahedra_built;
        s->calls += one.make_tetra_calls;
        assert_int_equal(incode_builder_held(&s->builder[i].builder), 0);
    }
    assert_int_equal(s->all.tetrahedra_kept, s->world.tets.count);
    assert_true(s->built >= s->world.tets.count);
    host_tetrahedra_map(&s->world.tets, s->world.order.row);
    host_tetrahedra_sort(&s->world.tets);
    host_digest(&s->world.tets, &s->world.digest);
}

static inline void lend_close(struct lend *s) {
    for (uint32_t i = 0; i < s->builders; i++)
        free(s->builder[i].memory);
    free(s->builder);
    free(s->memory_of_manager);
    solo_close(&s->world);
}

#endif
