/* A front alone: an oracle that knows the triangulation answers what it asks,
 * at once, late or much later, and there is no page anywhere.  The tetrahedra
 * come out whole, each once, every brick is committed, and nothing is left. */

#include "host/mesh/gen.h"
#include "incode/front/front.h"
#include "incode/front/job.h"
#include "tests/unit/incode/oracle.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

enum { GUARD = 256, SPILLED = 1 << 20, STEPS = 2000000 };

struct world {
    /* What to do. */
    uint32_t regions;
    bool faces;                        /* one at a time, else stars */
    uint64_t chance;                   /* 0: every answer is there at once */
    uint32_t pressure, entry_pressure; /* what may be open before it spills */
    enum incode_face_rule rule;

    struct host_points points;
    struct host_tetrahedra known, got;
    struct oracle oracle;
    struct incode_front front;
    uint32_t bricks;
    uint8_t *memory;
    size_t bytes;
    bool *committed;
    struct incode_face *spilled;
    size_t spilled_count, spilled_most;
    uint32_t wanted;                 /* a spilled brick, or INCODE_NONE */
    uint32_t asked[INCODE_TASKS][3]; /* faces: what each task waits for */
    bool asks[INCODE_TASKS];
    uint32_t hubs;
    uint64_t kept;
};

static bool by_chance(struct world *w, uint32_t one_in) {
    if (w->chance == 0)
        return false;
    w->chance ^= w->chance << 13;
    w->chance ^= w->chance >> 7;
    w->chance ^= w->chance << 17;
    return (w->chance >> 32) % one_in == 0;
}

static const double *at(const struct world *w, uint32_t v) {
    return w->points.xyz + 3 * (size_t)v;
}

/* ---- outside ---- */

static size_t emit_room(void *context) {
    return by_chance(context, 8) ? 3 : by_chance(context, 2) ? 20 : 4096;
}

static void emit(void *context, uint32_t vertex, const uint32_t (*apexes)[3],
                 size_t count) {
    struct world *w = context;
    struct host_error error = {0};
    uint32_t(*v)[4] = host_tetrahedra_room(&w->got, count, &error);
    assert_non_null(v);
    for (size_t i = 0; i < count; i++) {
        v[i][0] = vertex;
        memcpy(v[i] + 1, apexes[i], sizeof apexes[i]);
        const double *const p[4] = {at(w, v[i][0]), at(w, v[i][1]),
                                    at(w, v[i][2]), at(w, v[i][3])};
        uint32_t brick = v[i][incode_owner(INCODE_OWNER_SMALLEST, v[i], p)] /
                         INCODE_BRICK_POINTS;
        assert_in_range(brick, w->front.job.first, w->front.job.last - 1);
        assert_false(w->committed[brick]);
    }
    host_tetrahedra_keep(&w->got, count);
}

static void commit(void *context, uint32_t brick) {
    struct world *w = context;
    assert_in_range(brick, w->front.job.first, w->front.job.last - 1);
    assert_false(w->committed[brick]);
    w->committed[brick] = true;
}

static bool spill(void *context, const struct incode_face *faces,
                  size_t count) {
    struct world *w = context;
    if (by_chance(w, 4))
        return false;
    assert_true(w->spilled_count + count <= SPILLED);
    memcpy(w->spilled + w->spilled_count, faces, count * sizeof *faces);
    w->spilled_count += count;
    if (w->spilled_count > w->spilled_most)
        w->spilled_most = w->spilled_count;
    return true;
}

static bool unspill(void *context, uint32_t brick) {
    struct world *w = context;
    if (by_chance(w, 4))
        return false;
    assert_int_equal(w->wanted, INCODE_NONE);
    w->wanted = brick;
    return true;
}

/* Gives the brick that is wanted back. */
static bool return_spilled(struct world *w) {
    uint32_t brick = w->wanted;
    size_t left = 0;
    if (brick == INCODE_NONE)
        return false;
    w->wanted = INCODE_NONE;
    for (size_t i = 0; i < w->spilled_count; i++) {
        if (w->spilled[i].v[0] / INCODE_BRICK_POINTS != brick)
            w->spilled[left++] = w->spilled[i];
        else
            assert_int_equal(incode_front_unspill(&w->front, brick,
                                                  &w->spilled[i], 1, false),
                             0);
    }
    w->spilled_count = left;
    assert_int_equal(incode_front_unspill(&w->front, brick, NULL, 0, true), 0);
    return true;
}

/* ---- answers ---- */

struct answer {
    uint32_t v[4];
    const double *p[4];
};

static struct answer answer_of(const struct world *w, uint32_t a, uint32_t b,
                               uint32_t c) {
    const uint32_t f[3] = {a, b, c};
    uint32_t apex = oracle_apex(&w->oracle, f);
    return (struct answer){{a, b, c, apex},
                           {at(w, a), at(w, b), at(w, c),
                            apex == INCODE_NONE ? NULL : at(w, apex)}};
}

/* Any tetrahedron at a vertex, turned so that it comes first. */
static bool run_seed(struct world *w, uint32_t v) {
    if (incode_front_is_reached(&w->front, v))
        return true;
    if (by_chance(w, 4))
        return false;
    const uint32_t *t = w->known.v[w->oracle.at[v]];
    for (int k = 0; k < 4; k++) {
        const uint8_t *j = oracle_faces[k];
        for (int i = 0; i < 3; i++) {
            if (t[j[i]] != v)
                continue;
            struct answer a =
                answer_of(w, v, t[j[(i + 1) % 3]], t[j[(i + 2) % 3]]);
            incode_front_seed(&w->front, a.v, a.p);
            return true;
        }
    }
    fail();
    return true;
}

/* False: an answer is not there. */
static bool run_star(struct world *w, uint32_t v) {
    /* Whatever a hint says, it comes back with its vertex. */
    struct incode_star_face face;
    bool all = true;
    if (!incode_star_open(&w->front, v))
        return true;
    while (all && !incode_star_is_enough(&w->front) &&
           !incode_star_is_full(&w->front) &&
           incode_star_take(&w->front, &face)) {
        const uint32_t end[2] = {face.b, face.c};
        for (int i = 0; i < 2; i++)
            assert_true(face.hint[i] == INCODE_HINT_NONE ||
                        face.hint[i] == end[i] % 1000);
        if (by_chance(w, 20)) {
            incode_star_put(&w->front, &face);
            assert_true(incode_star_find(&w->front, face.b, face.c));
            assert_false(incode_star_find(&w->front, face.b, face.c));
            incode_star_put(&w->front, &face);
            all = false;
            continue;
        }
        struct answer a = answer_of(w, v, face.b, face.c);
        const uint16_t hint[4] = {INCODE_HINT_NONE, (uint16_t)(a.v[1] % 1000),
                                  (uint16_t)(a.v[2] % 1000),
                                  (uint16_t)(a.v[3] % 1000)};
        incode_star_build(&w->front, a.v, a.p, hint);
    }
    incode_star_shut(&w->front);
    return all;
}

static bool run_face(struct world *w, unsigned task, uint32_t v) {
    uint32_t *f = w->asked[task];
    if (!w->asks[task] && !incode_front_face(&w->front, v, f))
        return true;
    w->asks[task] = true;
    assert_int_equal(f[0], v);
    if (by_chance(w, 2))
        return false;
    struct answer a = answer_of(w, f[0], f[1], f[2]);
    incode_front_use(&w->front, a.v, a.p);
    return true;
}

static void run(struct world *w, unsigned task) {
    uint32_t v = w->front.task[task].v;
    bool done;
    incode_front_run(&w->front, UINT32_MAX);
    if (w->front.task[task].seed)
        done = run_seed(w, v);
    else
        done = w->faces ? run_face(w, task, v) : run_star(w, v);
    if (done)
        incode_front_done(&w->front, task);
    else
        incode_front_suspend(&w->front, task, by_chance(w, 2), false);
}

/* ---- jobs ---- */

static uint32_t count_of(const struct world *w, uint32_t brick) {
    uint64_t left = w->points.count - (uint64_t)brick * INCODE_BRICK_POINTS;
    return left < INCODE_BRICK_POINTS ? (uint32_t)left : INCODE_BRICK_POINTS;
}

static enum incode_turn step(struct world *w) {
    uint32_t task = 0;
    uint32_t waiting = by_chance(w, 2) ? (uint32_t)w->chance : 0;
    enum incode_turn turn = incode_front_turn(&w->front, waiting, &task);
    if (turn == INCODE_TURN_NEXT) {
        turn = incode_front_next(&w->front, &task);
        if (turn == INCODE_TURN_COUNT)
            turn =
                by_chance(w, 4)
                    ? INCODE_TURN_WAIT
                    : incode_front_count(&w->front, count_of(w, task), &task);
        if (turn == INCODE_TURN_TASK)
            w->asks[task] = false;
    }
    if (turn == INCODE_TURN_TASK || turn == INCODE_TURN_RESUME)
        run(w, task);
    return turn;
}

static void do_job(struct world *w, const struct incode_job *job) {
    uint32_t idle = 0, steps = 0;
    memset(w->committed, 0, w->bricks * sizeof *w->committed);
    incode_front_start(&w->front, job);
    if (w->pressure != 0)
        w->front.room_faces = w->front.afl.capacity - w->pressure;
    if (w->entry_pressure != 0)
        w->front.room_entries =
            w->front.afl.touched_capacity - w->entry_pressure;
    for (;;) {
        enum incode_turn turn = step(w);
        if (w->front.fault != NULL)
            fail_msg("%s", w->front.fault);
        if (turn == INCODE_TURN_END)
            break;
        if (w->front.hub_count > w->hubs) {
            w->hubs = w->front.hub_count;
            assert_int_equal(w->front.hubs[w->hubs - 1], w->points.count / 3);
        }
        bool came =
            (turn == INCODE_TURN_WAIT || by_chance(w, 8)) && return_spilled(w);
        idle = turn == INCODE_TURN_WAIT && !came ? idle + 1 : 0;
        assert_in_range(idle, 0, 1000); /* or it waits for nothing */
        assert_in_range(++steps, 0, STEPS);
    }
    for (uint32_t b = 0; b < w->bricks; b++)
        assert_int_equal(w->committed[b], b >= job->first && b < job->last);
    const struct incode_front *f = &w->front;
    assert_int_equal(f->afl.count, 0);
    assert_int_equal(f->afl.touched_count, 0);
    assert_int_equal(f->busy, 0);
    assert_int_equal(f->star.faces, 0);
    assert_int_equal(f->star.kept, 0);
    assert_int_equal(f->hub_count, 0);
    assert_int_equal(f->spill_count, 0);
    assert_int_equal(w->spilled_count, 0);
    assert_int_equal(w->wanted, INCODE_NONE);
}

static int by_x(const void *a, const void *b) {
    return incode_lexicographic(a, b);
}

/* A vertex's number is its row: along x, or, for a hub, at random, with the hub
 * after a third of the others. */
static void number(struct host_points *points, bool hub) {
    double first[3], *third = points->xyz + points->count / 3 * 3;
    if (!hub) {
        qsort(points->xyz, points->count, sizeof first, by_x);
        return;
    }
    memcpy(first, points->xyz, sizeof first);
    memcpy(points->xyz, third, sizeof first);
    memcpy(third, first, sizeof first);
}

static void open_world(struct world *w, const char *kind, uint64_t n) {
    const struct incode_front_share share = {INCODE_FACES_MIN,
                                             INCODE_ENTRIES_MIN};
    const struct incode_front_outside outside = {w,     emit_room, emit, commit,
                                                 spill, unspill,   NULL};
    struct host_error error = {0};
    if (host_gen(kind, n, 3, &w->points, &error) != 0)
        fail_msg("%s", error.text);
    n = w->points.count;
    number(&w->points, strcmp(kind, "hub") == 0);
    reference_delaunay(w->points.xyz, (uint32_t)n, &w->known);
    host_tetrahedra_sort(&w->known);
    oracle_open(&w->oracle, &w->known, (uint32_t)n);
    w->bricks = (uint32_t)((n + INCODE_BRICK_POINTS - 1) / INCODE_BRICK_POINTS);
    w->bytes = incode_front_bytes(&share);
    w->memory = aligned_alloc(64, (w->bytes + GUARD + 63) / 64 * 64);
    w->committed = calloc(w->bricks, sizeof *w->committed);
    w->spilled = malloc(SPILLED * sizeof *w->spilled);
    w->wanted = INCODE_NONE;
    assert_non_null(w->memory);
    assert_non_null(w->committed);
    assert_non_null(w->spilled);
    memset(w->memory, 0xa5, w->bytes + GUARD);
    incode_front_init(&w->front, w->memory, &share, w->bricks, w->rule,
                      &outside, NULL);
}

static void close_world(struct world *w) {
    for (size_t i = 0; i < GUARD; i++)
        assert_int_equal(w->memory[w->bytes + i], 0xa5);
    host_tetrahedra_free(&w->known);
    host_tetrahedra_free(&w->got);
    host_points_free(&w->points);
    oracle_close(&w->oracle);
    free(w->memory);
    free(w->committed);
    free(w->spilled);
}

/* Region after region of the set, by one front; the whole must come of it. */
static void triangulate(struct world *w) {
    struct host_digest known, got;
    for (uint32_t r = 0; r < w->regions; r++) {
        struct incode_job job = {.first = w->bricks * r / w->regions,
                                 .last = w->bricks * (r + 1) / w->regions};
        for (int d = 0; d < 3; d++) {
            job.lo[d] = -0.25 + r * 0.1;
            job.hi[d] = job.lo[d] + 0.5;
        }
        do_job(w, &job);
    }
    assert_int_equal(w->front.counts.kept, w->got.count);
    assert_int_equal(w->got.count, w->known.count);
    if (w->regions == 1)
        assert_int_equal(w->front.counts.hull_facets, w->oracle.hull);
    host_tetrahedra_sort(&w->got);
    host_digest(&w->known, &known);
    host_digest(&w->got, &got);
    assert_string_equal(got.text, known.text);
}

/* ---- tests ---- */

TEST(sets) {
    static const char *const kinds[] = {"uniform", "bubbles", "grid", "sphere",
                                        "hub"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        for (uint32_t k = 0; k < 16; k++) {
            struct world w = {.regions = k & 1 ? 3 : 1,
                              .faces = (k & 2) != 0,
                              .chance = k & 4 ? k : 0,
                              .rule =
                                  k & 8 ? INCODE_FACE_PAPER : INCODE_FACE_OWN};
            open_world(&w, kinds[i], 400 + 10 * i);
            triangulate(&w);
            close_world(&w);
        }
    }
}

/* Little may be open at a time: the rest goes out and comes back in order. */
TEST(spilling) {
    for (uint32_t k = 0; k < 16; k++) {
        struct world w = {.regions = k & 1 ? 2 : 1,
                          .faces = (k & 2) != 0,
                          .chance = k & 4 ? k : 0,
                          .pressure = k & 8 ? 0 : 400,
                          .entry_pressure = k & 8 ? 6 : 0};
        open_world(&w, "uniform", 1500);
        triangulate(&w);
        assert_true(w.front.counts.spilled > 0);
        assert_true(w.spilled_most > 0);
        close_world(&w);
    }
}

/* A vertex with a list far longer than a star holds at hand. */
TEST(hub) {
    for (uint32_t k = 0; k < 4; k++) {
        struct world w = {.regions = k & 1 ? 2 : 1, .chance = k & 2 ? 5 : 0};
        open_world(&w, "hub", 900);
        triangulate(&w);
        assert_in_range(w.hubs, 1, INCODE_HUBS);
        close_world(&w);
    }
}

/* A job that is abandoned midway leaves nothing behind. */
TEST(abandoned) {
    struct world w = {.regions = 1, .chance = 9};
    open_world(&w, "uniform", 300);
    const struct incode_job job = {.first = 0, .last = w.bricks};
    for (int tries = 0; tries < 4; tries++) {
        memset(w.committed, 0, w.bricks * sizeof *w.committed);
        incode_front_start(&w.front, &job);
        for (int i = 0; i < 20 << tries; i++)
            (void)step(&w);
        assert_true(w.front.afl.count > 0);
    }
    host_tetrahedra_cut(&w.got, 0);
    w.front.counts = (struct incode_front_counts){0};
    w.spilled_count = 0;
    w.wanted = INCODE_NONE;
    triangulate(&w);
    close_world(&w);
}

/* Nothing was asked for that it does not ask for. */
TEST(refusals) {
    struct world w = {.regions = 1};
    uint32_t task;
    open_world(&w, "uniform", 100);
    assert_int_equal(incode_front_turn(&w.front, 0, &task), INCODE_TURN_END);
    const struct incode_face face = {{0, 1, 2}};
    assert_int_equal(incode_front_unspill(&w.front, 0, &face, 1, true), -1);
    triangulate(&w);
    assert_int_equal(incode_front_unspill(&w.front, 0, &face, 1, true), -1);
    close_world(&w);
}

/* Of four corners, however they are turned, one is the owner. */
TEST(one_owner) {
    static const double corner[4][3] = {
        {1, -2, 7}, {1, -2, 6}, {1, 3, -9}, {2, -9, -9}};
    static const unsigned turns[4][4] = {
        {0, 1, 2, 3}, {1, 0, 3, 2}, {3, 2, 1, 0}, {2, 3, 0, 1}};
    for (int k = 0; k < 4; k++) {
        const double *const p[4] = {corner[turns[k][0]], corner[turns[k][1]],
                                    corner[turns[k][2]], corner[turns[k][3]]};
        uint32_t v[4];
        for (int i = 0; i < 4; i++)
            v[i] = turns[k][i] ^ 2; /* the lowest of them is corner 2 */
        unsigned i = incode_owner(INCODE_OWNER_SMALLEST, v, p);
        assert_int_equal(turns[k][i], 1);
        i = incode_owner(INCODE_OWNER_LOWEST, v, p);
        assert_int_equal(turns[k][i], 2);
    }
}
