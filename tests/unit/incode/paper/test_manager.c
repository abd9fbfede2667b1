/* A face manager and tetrahedron builders together, without a node: whatever
 * is late, and in whatever order, the result is that of the triangulator. */
#include "host/mesh/gen.h"
#include "tests/unit/emulated.h"
#include "tests/unit/incode/lend_scene.h"
#include "tests/unit/incode/solo.h"
#include "tests/unit/reference.h"

static void expect(const double *xyz, uint64_t n, struct host_digest *digest) {
    struct solo solo = {
        .index = INCODE_KD, .regions = 1, .build = INCODE_BUILD_FACES};
    solo_run(&solo, xyz, n);
    *digest = solo.digest;
    solo_close(&solo);
}

static void run(struct lend *lend, const struct host_points *set,
                const struct host_digest *digest) {
    lend_run(lend, set->xyz, set->count);
    assert_string_equal(lend->world.digest.text, digest->text);
}

static void make(const char *kind, uint64_t n, struct host_points *set) {
    struct host_error error = {0};
    if (host_gen(kind, n, 5, set, &error) != 0)
        fail_msg("%s", error.text);
}

/* Every kind of points, every index, one builder and several, at once and by
 * chance. */
TEST(kinds) {
    static const char *const names[] = {"uniform", "bluntfin", "rotated",
                                        "sphere",  "grid",     "hub"};
    static const uint32_t shapes[][3] = {
        {1, 96, 2}, {1, 1, 1}, {3, 8, 2}, {7, 5, 3}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        struct host_points set = {0};
        struct host_digest digest;
        make(names[i], SANITIZED ? 200 : 500, &set);
        expect(set.xyz, set.count, &digest);
        for (unsigned k = 0; k < 4; k++) {
            for (uint64_t chance = 0; chance < 3; chance++) {
                struct lend lend = {.builders = shapes[k][0],
                                    .faces = shapes[k][1],
                                    .jobs = shapes[k][2],
                                    .world.chance = chance * (i + k + 1),
                                    .world.shuffle = chance,
                                    .world.units = chance == 2 ? 3 : 0};
                run(&lend, &set, &digest);
                lend_close(&lend);
            }
        }
        host_points_free(&set);
    }
}

TEST(indexes) {
    struct host_points set = {0};
    struct host_digest digest;
    make("uniform", 400, &set);
    expect(set.xyz, set.count, &digest);
    static const uint8_t indexes_in_turn[] = {INCODE_NAIVE, INCODE_GRID};
    for (unsigned i = 0; i < 2; i++) {
        struct lend lend = {.builders = 3,
                            .faces = 4,
                            .jobs = 2,
                            .world.index = indexes_in_turn[i],
                            .world.chance = 5};
        run(&lend, &set, &digest);
        lend_close(&lend);
    }
    host_points_free(&set);
}

/* Faces are lent, then spilled, then lent again: what comes late of them does
 * not count. */
TEST(spilled) {
    struct host_points set = {0};
    struct host_digest digest;
    make("uniform", 2500, &set); /* fewer would not spill */
    expect(set.xyz, set.count, &digest);
    for (uint32_t k = 0; k < 4; k++) {
        struct lend lend = {.builders = 1 + 2 * k,
                            .faces = 1 + 30 * k,
                            .jobs = 2,
                            .world.chance = k + 1,
                            .world.pressure = 500};
        run(&lend, &set, &digest);
        assert_true(lend.all.afl_spilled > 0);
        lend_close(&lend);
    }
    host_points_free(&set);
}

/* A list that asks for more faces than there are open ever. */
TEST(job_larger_than_the_list) {
    struct host_points set = {0};
    struct host_digest digest;
    make("uniform", 12, &set);
    expect(set.xyz, set.count, &digest);
    for (uint32_t builders = 1; builders <= LEND_BUILDERS; builders *= 2) {
        struct lend lend = {.builders = builders,
                            .faces = INCODE_LIST_MAX,
                            .jobs = INCODE_LISTS_MAX};
        run(&lend, &set, &digest);
        assert_true(lend.all.afl_max < INCODE_LIST_MAX);
        lend_close(&lend);
    }
    host_points_free(&set);
}

/* A single tetrahedron: all its faces are of the hull, and the list is empty
 * when they are answered. */
TEST(all_faces_on_the_hull) {
    double xyz[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const struct host_points set = {.xyz = xyz, .count = 4};
    for (uint32_t builders = 1; builders <= 3; builders++) {
        struct lend lend = {.builders = builders, .faces = 4, .jobs = 2};
        lend_run(&lend, set.xyz, set.count);
        assert_int_equal(lend.world.tets.count, 1);
        assert_int_equal(lend.all.hull_facets, 4);
        assert_int_equal(lend.empty_faces, 4);
        assert_int_equal(lend.all.seeds, 1);
        lend_close(&lend);
    }
}

/* A job without bricks: nothing is lent, and it is done. */
TEST(empty_list) {
    double xyz[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    struct lend lend = {.builders = 1, .faces = 4, .jobs = 1};
    struct incode_list list;
    lend_open(&lend, xyz, 4);
    incode_manager_start(&lend.manager, &(struct incode_job){0});
    assert_int_equal(incode_manager_lend(&lend.manager, 4, &list), 0);
    for (int i = 0; incode_manager_step(&lend.manager, 1) != INCODE_FINISHED;
         i++)
        assert_in_range(i, 0, 10);
    assert_int_equal(incode_manager_lend(&lend.manager, 4, &list), 0);
    lend_close(&lend);
}

/* What no builder says, and what no manager asks. */
TEST(unsound) {
    double xyz[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const struct incode_answers wrong[] = {
        {0, 0, 1, {{0, 1, 2, 3}}},
        {4, 0, 1, {{0, 1, 2, 3}}},
        {INCODE_LIST_FACES, 0, INCODE_LIST_MAX + 1, {{0, 1, 2, 3}}},
        {INCODE_LIST_FACES, 0, 1, {{0, 1, 1, 3}}},
        {INCODE_LIST_FACES, 0, 1, {{0, 1, 2, 2}}},
        {INCODE_LIST_FACES, 0, 1, {{0, 1, 64, 3}}},
        {INCODE_LIST_FACES, 0, 1, {{0, 1, 2, 64}}},
        {INCODE_LIST_FIRST, 0, 1, {{0, 1, 2, INCODE_NONE}}},
        {INCODE_LIST_COUNT, 0, 1, {{0, 0, 0, 0}}},
        {INCODE_LIST_COUNT, 0, 1, {{0, 65, 0, 0}}}};
    static const struct incode_list lists[] = {
        {0, 1, {{0, 1, 2}}},
        {INCODE_LIST_FACES, 0, {{0, 1, 2}}},
        {INCODE_LIST_FACES, 97, {{0, 1, 2}}},
        {INCODE_LIST_FACES, 1, {{0, 1, 64}}},
        {INCODE_LIST_FACES, 1, {{0, 1, 1}}},
        {INCODE_LIST_FIRST, 1, {{64, 0, 0}}},
        {INCODE_LIST_FIRST, 2, {{0, 0, 0}, {1, 0, 0}}},
        {INCODE_LIST_COUNT, 1, {{1, 0, 0}}}};
    struct lend lend = {.builders = 1, .faces = 4, .jobs = 1};
    struct incode_list list;
    lend_open(&lend, xyz, 4);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        lend.manager.lists = 0;
        incode_manager_start(&lend.manager, &(struct incode_job){.last = 1});
        assert_true(incode_manager_lend(&lend.manager, 4, &list) > 0);
        memset(lend.manager.due, 0, sizeof lend.manager.due);
        if (wrong[i].kind <= INCODE_LIST_COUNT) /* as if it had been asked */
            lend.manager.due[wrong[i].kind] = wrong[i].count;
        incode_manager_take(&lend.manager, &wrong[i]);
        assert_int_equal(incode_manager_step(&lend.manager, 1), INCODE_BROKEN);
    }
    lend.manager.lists = 0;
    incode_manager_start(&lend.manager, &(struct incode_job){.last = 1});
    incode_manager_take(
        &lend.manager, /* nobody has asked */
        &(struct incode_answers){INCODE_LIST_COUNT, 0, 1, {{0, 4, 0, 0}}});
    assert_non_null(incode_manager_fault(&lend.manager));
    struct incode_builder *b = &lend.builder[0].builder;
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        b->fault = NULL;
        assert_true(incode_builder_take(b, &lists[i]));
        assert_int_equal(incode_builder_step(b, 1), INCODE_BROKEN);
    }
    lend_close(&lend);
}

enum cheat { MISSING, EMPTY, OTHER_KIND, TWICE, OTHER_VERTEX };

static void cheat_with(struct incode_answers *answers, enum cheat how) {
    answers->count -= how == MISSING;
    answers->count = how == EMPTY ? 0 : answers->count;
    if (how == OTHER_KIND)
        answers->kind = answers->kind == INCODE_LIST_FACES ? INCODE_LIST_COUNT
                                                           : INCODE_LIST_FACES;
    if (how == OTHER_KIND && answers->kind == INCODE_LIST_COUNT)
        answers->v[0][1] = 1;
    if (how == TWICE)
        memcpy(answers->v[0], answers->v[1], sizeof answers->v[0]);
    answers->v[0][0] ^= how == OTHER_VERTEX;
}

/* What the manager says of a builder who has a list of some kind wrong, or all
 * of them where another face may close the one that is left out. */
static const char *fault_of(enum incode_list_kind kind, uint32_t least,
                            enum cheat how) {
    struct host_points set = {0};
    struct lend lend = {.builders = 1, .faces = 8, .jobs = 1};
    struct incode_builder *b;
    bool cheated = false;
    const char *fault;
    make("uniform", 300, &set);
    lend_open(&lend, set.xyz, set.count);
    lend.world.job = (struct incode_job){.last = lend.world.order.bricks};
    incode_manager_start(&lend.manager, &lend.world.job);
    b = &lend.builder[0].builder;
    for (uint32_t i = 0;; i++) {
        assert_in_range(i, 0, 100000); /* or it waits for ever */
        if (incode_manager_step(&lend.manager, 100) == INCODE_BROKEN)
            break;
        const struct incode_answers *answers = incode_builder_answers(b);
        if (answers != NULL && incode_manager_is_free(&lend.manager)) {
            struct incode_answers changed = *answers;
            if ((!cheated || how == TWICE) && changed.kind == kind &&
                changed.count >= least) {
                cheat_with(&changed, how);
                cheated = true;
            }
            incode_manager_take(&lend.manager, &changed);
            incode_builder_drop(b);
        }
        (void)lend_list(&lend);
        (void)lend_build(&lend);
    }
    assert_true(cheated);
    fault = incode_manager_fault(&lend.manager);
    lend_close(&lend);
    host_points_free(&set);
    return fault;
}

/* A builder that leaves something out, or answers what it was not asked, is
 * found, and not waited for. */
TEST(wrong_answers) {
    static const char unsound_text[] =
        "answers that are none to what was asked";
    static const char short_text[] =
        "all lists are back, and not all that they asked has an answer";
    static const struct {
        enum incode_list_kind kind;
        uint32_t least;
        enum cheat how;
        const char *said;
    } cases[] = {{INCODE_LIST_FACES, 2, MISSING, unsound_text},
                 {INCODE_LIST_FACES, 1, EMPTY, unsound_text},
                 {INCODE_LIST_FACES, 1, OTHER_KIND, unsound_text},
                 {INCODE_LIST_FACES, 4, TWICE, short_text},
                 {INCODE_LIST_FIRST, 1, EMPTY, unsound_text},
                 {INCODE_LIST_FIRST, 1, OTHER_KIND, unsound_text},
                 {INCODE_LIST_FIRST, 1, OTHER_VERTEX, unsound_text},
                 {INCODE_LIST_COUNT, 2, MISSING, unsound_text},
                 {INCODE_LIST_COUNT, 2, TWICE, short_text}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_string_equal(
            fault_of(cases[i].kind, cases[i].least, cases[i].how),
            cases[i].said);
}
