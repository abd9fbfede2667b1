/* The tetrahedra of own bricks from the triangulation of all points: every size
 * of memory, whether it holds all or only what is not final yet, every range of
 * bricks, small rooms outside, sets that span no space, short steps. */
#include <pthread.h>

#include "host/mesh/gen.h"
#include "tests/unit/emulated.h"
#include "tests/unit/incode/solo.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

enum { ROOM_MANY = 4096, WHOLE = 1 << 20, EACH = 23 };

/* An insertion by itself, beside a triangulator whose maker it shares. */
static struct world {
    struct solo solo;
    struct incode_insertion n;
    struct host_digest digest; /* of the whole set */
    struct host_tetrahedra expected;
    uint32_t *brick, *owned; /* of a row, of a brick */
    void *memory;
    size_t room;    /* outside, 0: none now */
    uint64_t *bits; /* the bricks that are committed, as it says */
    uint32_t emitted, committed, calls;
} world;

static size_t emit_room(void *context) {
    (void)context;
    return world.room;
}

static void emit(void *context, uint32_t vertex, const uint32_t (*apexes)[3],
                 size_t count) {
    struct solo *s = context;
    struct incode_tally tally = {0};
    double p[4][3];
    assert_in_range(count, 1, world.room);
    assert_in_range(count, 1, INCODE_INSERTION_EMITTED);
    host_vertex(&s->order, vertex, p[0]);
    for (size_t i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            host_vertex(&s->order, apexes[i][k], p[k + 1]);
            /* The vertex is the one that owns it. */
            assert_true(incode_lexicographic(p[0], p[k + 1]) < 0);
        }
        assert_int_equal(incode_orient3d(&tally, p[0], p[1], p[2], p[3]), 1);
    }
    /* Of an own brick that is not committed, else solo_emit says so. */
    assert_in_range(vertex / INCODE_BRICK_POINTS, world.n.own_first,
                    world.n.own_last - 1);
    world.emitted += (uint32_t)count;
    world.calls++;
    solo_emit(context, vertex, apexes, count);
}

static void commit(void *context, uint32_t brick) {
    assert_in_range(brick, 0, world.n.to - 1);
    assert_true(incode_insertion_has_committed(&world.n, brick));
    world.committed++;
    solo_commit(context, brick);
}

static void open_points(const double *xyz, uint64_t n) {
    memset(&world, 0, sizeof world);
    world.solo.index = INCODE_KD;
    world.solo.build = INCODE_BUILD_FACES;
    world.solo.regions = 1;
    world.solo.wanted = INCODE_NONE;
    world.room = ROOM_MANY;
    solo_open(&world.solo, xyz, n);
    const struct incode_front_outside outside = {
        &world.solo, emit_room, emit, commit, solo_spill, solo_unspill, NULL};
    incode_insertion_init(&world.n, &world.solo.t->maker, &outside);
}

/* What a set comes to by brute force, and how many of the tetrahedra each brick
 * owns. */
static void expect(const double *xyz, uint32_t n) {
    const struct host_order *order = &world.solo.order;
    struct host_tetrahedra *t = &world.expected;
    reference_delaunay(xyz, n, t);
    host_tetrahedra_sort(t);
    host_digest(t, &world.digest);
    world.brick = calloc(n, sizeof *world.brick);
    world.owned = calloc(order->bricks, sizeof *world.owned);
    assert_non_null(world.brick);
    assert_non_null(world.owned);
    for (uint32_t v = 0; v < order->bricks * INCODE_BRICK_POINTS; v++)
        if (order->row[v] != INCODE_NONE)
            world.brick[order->row[v]] = v / INCODE_BRICK_POINTS;
    for (size_t i = 0; i < t->count; i++) {
        uint32_t least = t->v[i][0];
        for (int k = 1; k < 4; k++)
            if (incode_lexicographic(xyz + 3 * (size_t)t->v[i][k],
                                     xyz + 3 * (size_t)least) < 0)
                least = t->v[i][k];
        world.owned[world.brick[least]]++;
    }
}

static void open_made(const char *kind, uint64_t count) {
    struct host_points points = {0};
    struct host_error error = {0};
    if (host_gen(kind, count, 5, &points, &error) != 0)
        fail_msg("%s", error.text);
    open_points(points.xyz, points.count);
    expect(points.xyz, (uint32_t)points.count);
    host_points_free(&points);
}

static void close_world(void) {
    free(world.memory);
    free(world.bits);
    free(world.brick);
    free(world.owned);
    host_tetrahedra_free(&world.expected);
    solo_close(&world.solo);
}

static void start(size_t bytes, uint32_t first, uint32_t last) {
    size_t words = ((size_t)world.n.maker->tree.bricks + 63) / 64;
    free(world.memory);
    free(world.bits);
    world.memory = malloc(bytes); /* no byte more */
    world.bits = malloc(words * sizeof *world.bits);
    assert_non_null(world.memory);
    assert_non_null(world.bits);
    memset(world.bits, 0xff, words * sizeof *world.bits);
    world.solo.job.first = first;
    world.solo.job.last = last;
    world.emitted = world.committed = world.calls = 0;
    incode_insertion_start(&world.n, world.bits, world.memory, bytes, first,
                           last);
}

static enum incode_step one_step(uint32_t units) {
    world.solo.t->maker.walker.left = units;
    return incode_insertion_step(&world.n);
}

/* Of cells that are about to be emitted, none gives way to a point. */
static void check_final(void) {
    const struct incode_complex *x = &world.n.complex;
    const struct host_order *order = &world.solo.order;
    struct incode_tally tally = {0};
    for (uint32_t i = 2 + world.calls % EACH; i < x->cells; i += EACH) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (incode_cell_is_free(c) || incode_cell_proved(c) == 0)
            continue;
        for (uint32_t v = 0; v < order->bricks * INCODE_BRICK_POINTS; v++) {
            double p[3];
            if (order->row[v] == INCODE_NONE)
                continue;
            host_vertex(order, v, p);
            if (incode_complex_gives_way(x, &tally, c, p))
                fail_msg("cell %u is not final: %u", i, v);
        }
    }
}

/* To its end: finished, or full. */
static enum incode_step finish(uint32_t units) {
    enum incode_step r = INCODE_WORKED;
    for (uint32_t i = 0; r <= INCODE_WAITING; i++) {
        assert_in_range(i, 0, 10000000);
        bool settling = world.n.stage < INCODE_INSERTION_LIST;
        r = one_step(units);
        if (settling && world.n.stage == INCODE_INSERTION_LIST)
            check_final();
        if (r == INCODE_WAITING)
            assert_true(solo_deliver(&world.solo));
    }
    return r;
}

static void compare(void) {
    struct solo *s = &world.solo;
    struct host_digest digest;
    host_tetrahedra_map(&s->tets, s->order.row);
    host_tetrahedra_sort(&s->tets);
    host_digest(&s->tets, &digest);
    assert_string_equal(digest.text, world.digest.text);
    host_tetrahedra_cut(&s->tets, 0);
    memset(s->committed, 0, s->order.bricks);
}

/* ---- memory ---- */

/* After it is full: none of what was emitted is wrong or there twice, and what
 * is committed is complete. */
static void compare_part(void) {
    struct solo *s = &world.solo;
    const struct host_tetrahedra *all = &world.expected;
    uint32_t bricks = s->order.bricks, *got = calloc(bricks, sizeof *got);
    assert_non_null(got);
    for (size_t i = 0; i < s->tets.count; i++)
        got[s->tets.v[i][0] / INCODE_BRICK_POINTS]++;
    for (uint32_t b = 0; b < bricks; b++) {
        assert_int_equal(incode_insertion_has_committed(&world.n, b),
                         s->committed[b]);
        if (s->committed[b])
            assert_int_equal(got[b], world.owned[b]);
    }
    free(got);
    host_tetrahedra_map(&s->tets, s->order.row);
    host_tetrahedra_sort(&s->tets);
    size_t k = 0;
    for (size_t i = 0; i < s->tets.count; i++, k++) {
        while (k < all->count &&
               memcmp(all->v[k], s->tets.v[i], sizeof *all->v) != 0)
            k++;
        assert_in_range(k, 0, all->count - 1);
    }
    host_tetrahedra_cut(&s->tets, 0);
    memset(s->committed, 0, bricks);
}

enum outcome { NOTHING, SOME, STREAMED, AT_ONCE, OUTCOMES };

static enum outcome try_memory(size_t bytes) {
    uint32_t bricks = world.solo.order.bricks;
    start(bytes, 0, bricks);
    uint64_t releases = world.n.releases, vertices = world.n.vertices;
    enum incode_step r = finish(1);
    assert_in_range(world.n.used, 0, bytes);
    if (r == INCODE_FINISHED) {
        assert_int_equal(one_step(9), INCODE_FINISHED);
        assert_int_equal(world.committed, bricks);
        assert_int_equal(world.n.vertices - vertices, world.solo.order.points);
        compare();
        return world.n.releases - releases > 1 ? STREAMED : AT_ONCE;
    }
    assert_int_equal(r, INCODE_FULL);
    if (!world.n.emitted)
        assert_int_equal(world.emitted + world.committed, 0);
    else
        assert_in_range(world.committed, 0, bricks - 1);
    compare_part();
    return world.n.emitted ? SOME : NOTHING;
}

/* It is full with nothing emitted, or with something, or it comes to an end;
 * that, once there is as much as stated. */
TEST(each_size_of_memory) {
    static const struct {
        const char *kind;
        uint32_t points, step;
        bool more; /* tetrahedra than is thought */
    } sets[] = {{"uniform", 1000, 4000, false}, {"sphere", 600, 3000, false},
                {"lines", 300, 16000, true},    {"grid", 600, 3000, false},
                {"terrain", 600, 3000, false},  {"shell", 600, 3000, true},
                {"torus", 600, 3000, true},     {"bubbles", 600, 3000, false}};
    unsigned all[OUTCOMES] = {0};
    for (size_t k = 0; k < sizeof sets / sizeof *sets; k++) {
        open_made(sets[k].kind, sets[k].points);
        uint32_t bricks = world.solo.order.bricks;
        unsigned of[OUTCOMES] = {0};
        size_t bits = 2 * ((bricks + 63) / 64) * sizeof(uint64_t);
        size_t least = bits + INCODE_INSERTION_LEAST;
        size_t stated = bits + incode_insertion_bytes((uint64_t)bricks *
                                                      INCODE_BRICK_POINTS);
        size_t step = sets[k].step * (SANITIZED ? 3 : 1);
        enum outcome last = NOTHING;
        for (size_t bytes = least; last < STREAMED || bytes < stated + step;
             bytes += step) {
            last = try_memory(bytes);
            of[last]++;
            assert_true(world.n.whole == (bytes >= stated) ||
                        (sets[k].more && !world.n.whole));
            if (bytes >= stated && !sets[k].more && last != AT_ONCE)
                fail_msg("%s: not in %zu bytes", sets[k].kind, bytes);
        }
        assert_true(of[NOTHING] > 0);
        for (int i = 0; i < OUTCOMES; i++)
            all[i] += of[i];
        close_world();
    }
    assert_true(all[SOME] > 5 && all[STREAMED] > 5 && all[AT_ONCE] > 5);
}

/* ---- jobs ---- */

TEST(each_range_of_bricks) {
    open_made("uniform", 500);
    uint32_t bricks = world.solo.order.bricks;
    uint64_t all = 0;
    assert_in_range(bricks, 4, 16);
    for (uint32_t first = 0; first < bricks; first++) {
        for (uint32_t last = first + 1; last <= bricks; last++) {
            uint64_t kept = world.n.kept, vertices = world.n.vertices;
            start(WHOLE, first, last);
            assert_int_equal(finish(UINT32_MAX), INCODE_FINISHED);
            assert_int_equal(world.committed, last - first);
            assert_int_equal(world.n.kept - kept, world.emitted);
            assert_in_range(world.n.vertices - vertices,
                            (last - first - 1) * INCODE_BRICK_POINTS, 500);
            if (last == first + 1) {
                assert_int_equal(world.emitted, world.owned[first]);
                all += world.emitted;
            }
            host_tetrahedra_cut(&world.solo.tets, 0);
            memset(world.solo.committed, 0, bricks);
        }
    }
    /* Brick after brick, all of it. */
    for (uint32_t first = 0; first < bricks; first++) {
        start(WHOLE, first, first + 1);
        assert_int_equal(finish(UINT32_MAX), INCODE_FINISHED);
    }
    assert_int_equal(world.solo.tets.count, all);
    compare();
    close_world();
}

/* One that is left in the middle, at any step, is forgotten by the next. */
TEST(jobs_that_are_left) {
    open_made("bubbles", 300);
    uint32_t bricks = world.solo.order.bricks;
    for (uint32_t steps = 0; steps < 120; steps++) {
        start(steps % 2 ? WHOLE : 50000, steps % bricks, bricks);
        for (uint32_t i = 0; i < steps; i++)
            if (one_step(5) == INCODE_WAITING)
                (void)solo_deliver(&world.solo);
        host_tetrahedra_cut(&world.solo.tets, 0);
        memset(world.solo.committed, 0, bricks);
        start(WHOLE, 0, bricks);
        assert_int_equal(finish(UINT32_MAX), INCODE_FINISHED);
        compare();
    }
    close_world();
}

/* ---- outside ---- */

TEST(rooms) {
    open_made("hub", 400);
    for (size_t room = 1; room < 300; room += room < 8 ? 1 : 71) {
        enum incode_step r;
        uint32_t waits = 0;
        start(WHOLE, 0, world.solo.order.bricks);
        do {
            uint32_t before = world.emitted;
            /* None at all, each other time. */
            world.room = 0;
            r = one_step(1);
            assert_int_equal(world.emitted, before);
            waits += r == INCODE_WAITING;
            world.room = room;
            r = one_step(1);
            assert_in_range(world.emitted - before, 0, room);
            (void)solo_deliver(&world.solo);
        } while (r != INCODE_FINISHED);
        assert_in_range(waits, 1, UINT32_MAX);
        compare();
    }
    close_world();
}

/* Pages by one credit at a time, and refused by chance: each is asked for, and
 * none in vain. */
TEST(pages) {
    open_made("grid", 27 * 64);
    for (uint64_t chance = 0; chance < 6; chance++) {
        struct incode_pager *pager = &world.solo.t->maker.pager;
        uint64_t before = pager->requests;
        world.solo.chance = chance;
        pager->loading_max = chance < 3 ? 1 : 16;
        world.room = ROOM_MANY;
        start(2 << 20, 0, world.solo.order.bricks);
        enum incode_step r = INCODE_WORKED;
        while (r <= INCODE_WAITING) {
            r = one_step(64);
            if (r == INCODE_WAITING)
                (void)solo_deliver(&world.solo);
        }
        assert_int_equal(r, INCODE_FINISHED);
        assert_in_range(pager->requests - before, 0,
                        world.solo.order.bricks + 4);
        compare();
    }
    close_world();
}

/* With a unit of work, one point, or a few cells, or a few tetrahedra. */
TEST(steps_are_short) {
    open_made("uniform", 700);
    start(WHOLE, 0, world.solo.order.bricks);
    uint32_t steps = 0, cells = 0, most = 0;
    enum incode_step r;
    do {
        const struct incode_complex *x = &world.n.complex;
        uint32_t left = 0, listed = world.n.cell, calls = world.calls;
        bool listing = world.n.stage == INCODE_INSERTION_LIST;
        for (uint32_t v = 1; v < x->points; v++)
            left += !incode_complex_is_vertex(x, v);
        enum incode_insertion_stage stage = world.n.stage;
        r = one_step(1);
        for (uint32_t v = 1; v < x->points; v++)
            left -= !incode_complex_is_vertex(x, v);
        if (stage == INCODE_INSERTION_INSERT && world.n.stage == stage)
            assert_in_range(left, 0, 1);
        if (listing && world.n.stage == stage) {
            cells = world.n.cell - listed;
            most = cells > most ? cells : most;
        }
        assert_in_range(world.calls - calls, 0, 1);
        if (r == INCODE_WAITING)
            (void)solo_deliver(&world.solo);
        steps++;
    } while (r != INCODE_FINISHED);
    assert_in_range(most, 1, 64);
    assert_true(steps > 700);
    compare();
    close_world();
}

/* ---- stack ---- */

static void *insert_all(void *unused) {
    (void)unused;
    while (one_step(UINT32_MAX) == INCODE_WORKED)
        continue;
    return NULL;
}

/* The least stack that a board has is enough for cavities of each size. */
TEST(little_stack) {
    enum { STACK_BYTES = SANITIZED ? 1 << 20 : 48 << 10 };
    static const char *const kinds[] = {"sphere", "hub", "grid", "lines"};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        pthread_attr_t attributes;
        pthread_t thread;
        open_made(kinds[k], 400);
        start(4 << 20, 0, world.solo.order.bricks);
        while (world.n.stage <= INCODE_INSERTION_LOAD)
            if (one_step(UINT32_MAX) == INCODE_WAITING)
                (void)solo_deliver(&world.solo);
        world.room = 0;
        assert_int_equal(pthread_attr_init(&attributes), 0);
        assert_int_equal(pthread_attr_setstacksize(&attributes, STACK_BYTES),
                         0);
        assert_int_equal(pthread_create(&thread, &attributes, insert_all, NULL),
                         0);
        assert_int_equal(pthread_join(thread, NULL), 0);
        (void)pthread_attr_destroy(&attributes);
        assert_int_equal(world.n.stage, INCODE_INSERTION_EMIT);
        world.room = ROOM_MANY;
        assert_int_equal(finish(UINT32_MAX), INCODE_FINISHED);
        compare();
        close_world();
    }
}

/* ---- sets that span no space ---- */

struct bare {
    const double (*p)[3];
    uint32_t n, asked[16], count;
};

static bool bare_request(void *context, uint32_t page) {
    struct bare *b = context;
    b->asked[b->count++] = page;
    return true;
}

/* Points past what the host's order takes, brick after brick. */
static void bare_deliver(struct incode_triangulator *t, struct bare *b) {
    while (b->count > 0) {
        uint32_t brick = b->asked[--b->count], first = brick * 64;
        uint32_t points = b->n - first < 64 ? b->n - first : 64;
        double page[3 * 64];
        for (uint32_t i = 0; i < points; i++)
            for (uint32_t d = 0; d < 3; d++)
                page[d * points + i] = b->p[first + i][d];
        assert_int_equal(incode_triangulator_page(t, brick, page, 24 * points),
                         0);
    }
}

static void expect_no_space(const double (*p)[3], uint32_t n) {
    struct bare bare = {p, n, {0}, 0};
    const struct incode_setup setup = {
        .bricks = (n + 63) / 64, .index = INCODE_KD, .hi = {1000, 1000, 1000}};
    const struct incode_outside outside = {.pages = {&bare, bare_request},
                                           .front = {&world.solo, emit_room,
                                                     emit, commit, solo_spill,
                                                     solo_unspill, NULL}};
    const char *why = "";
    memset(&world, 0, sizeof world);
    world.solo.arena = aligned_alloc(64, 1 << 20);
    world.solo.t = incode_triangulator_init(world.solo.arena, 1 << 20, &setup,
                                            &outside, &why);
    assert_non_null(world.solo.t);
    incode_insertion_init(&world.n, &world.solo.t->maker, &outside.front);
    start(WHOLE, 0, setup.bricks);
    enum incode_step r = INCODE_WAITING;
    while (r <= INCODE_WAITING) {
        r = one_step(UINT32_MAX);
        bare_deliver(world.solo.t, &bare);
    }
    assert_int_equal(r, INCODE_FULL);
    assert_int_equal(world.emitted + world.committed, 0);
    free(world.memory);
    free(world.bits);
    free(world.solo.arena);
}

/* Fewer than four, or a line, or a plane. */
TEST(no_space) {
    enum { MOST = 200 };
    static double p[MOST][3];
    for (unsigned kind = 0; kind < 3; kind++) {
        for (uint32_t i = 0; i < MOST; i++) {
            p[i][0] = i;
            p[i][1] = kind > 0 ? i * i % 17 : i;
            p[i][2] = kind > 1 ? i * i % 19 : i;
        }
        for (uint32_t n = 1; n <= (kind > 1 ? 3 : MOST); n += n < 6 ? 1 : 97)
            expect_no_space((const double(*)[3])p, n);
    }
}

/* All of a plane but the first, the last, or one between. */
TEST(hardly_any_space) {
    enum { SIDE = 12, COUNT = SIDE * SIDE };
    static double p[COUNT][3];
    for (uint32_t off = 0; off < COUNT; off += 13) {
        for (uint32_t i = 0; i < COUNT; i++) {
            p[i][0] = i % SIDE;
            p[i][1] = (i - i % SIDE) * 1.0;
            p[i][2] = i == off ? 0x1p-1074 : 0;
        }
        open_points(p[0], COUNT);
        expect(p[0], COUNT);
        start(WHOLE, 0, world.solo.order.bricks);
        assert_int_equal(finish(UINT32_MAX), INCODE_FINISHED);
        compare();
        close_world();
    }
}
