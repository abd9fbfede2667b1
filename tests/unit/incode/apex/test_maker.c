/* A maker alone: asked for the apexes of the faces of a known triangulation, in
 * no order that a front would have, by searches that are suspended for pages
 * which come late, at random, or have been replaced meanwhile. */

#include "host/mesh/gen.h"
#include "incode/apex/maker.h"
#include "tests/unit/emulated.h"
#include "tests/unit/incode/oracle.h"
#include "tests/unit/incode/solo.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

enum { GUARD = 256, QUEUE = 4096, SLOTS = 5, BATCH = 24, IDLE_MAX = 10000 };

/* A set, what the triangulator makes of it, and a maker over its pages. */
struct bench {
    uint64_t chance; /* 0: pages come at once */
    struct solo solo;
    struct oracle oracle;
    struct incode_maker maker;
    uint8_t *memory;
    size_t bytes;
    uint32_t page[QUEUE], pages;
    uint32_t (*face)[3];
    uint32_t faces;
    uint64_t waits;
};

static uint32_t draw(struct bench *b, uint32_t below) {
    b->chance ^= b->chance << 13;
    b->chance ^= b->chance >> 7;
    b->chance ^= b->chance << 17;
    return (uint32_t)((b->chance >> 32) % below);
}

/* ---- pages ---- */

static bool request(void *context, uint32_t page) {
    struct bench *b = context;
    if (b->pages == QUEUE || (b->chance != 0 && draw(b, 4) == 0))
        return false;
    for (uint32_t i = 0; i < b->pages; i++)
        assert_int_not_equal(b->page[i], page);
    b->page[b->pages++] = page;
    return true;
}

/* One of the pages under way comes. */
static void deliver(struct bench *b) {
    uint8_t page[INCODE_PAGE_BYTES];
    if (b->pages == 0)
        return;
    uint32_t i = b->chance != 0 ? draw(b, b->pages) : 0, number = b->page[i];
    b->page[i] = b->page[--b->pages];
    size_t bytes = host_page(&b->solo.order, number, page);
    assert_int_equal(incode_pager_deliver(&b->maker.pager, number, page, bytes),
                     0);
}

/* ---- the bench ---- */

static int by_first(const void *a, const void *b) {
    const uint32_t *f = a, *g = b;
    return f[0] != g[0] ? (f[0] > g[0]) - (f[0] < g[0])
                        : memcmp(f, g, 3 * sizeof *f);
}

/* The faces of one tetrahedron in `every`, and all of the hull from within and
 * from without. */
static void list_faces(struct bench *b, uint32_t every) {
    const struct host_tetrahedra *tets = &b->solo.tets;
    b->face = malloc(8 * tets->count * sizeof *b->face);
    assert_non_null(b->face);
    for (uint32_t i = 0; i < tets->count; i++) {
        for (int k = 0; k < 4; k++) {
            const uint32_t *t = tets->v[i];
            const uint8_t *j = oracle_faces[k];
            const uint32_t f[3] = {t[j[0]], t[j[1]], t[j[2]]};
            const uint32_t back[3] = {f[1], f[0], f[2]};
            bool hull = oracle_apex(&b->oracle, back) == INCODE_NONE;
            if (hull || i % every == 0)
                memcpy(b->face[b->faces++], f, sizeof f);
            if (hull)
                memcpy(b->face[b->faces++], back, sizeof back);
        }
    }
    qsort(b->face, b->faces, sizeof *b->face, by_first);
}

/* Tetrahedra of rows become such of vertices. */
static void number_by_vertices(struct solo *s) {
    uint32_t *vertex = malloc(s->order.rows * sizeof *vertex);
    assert_non_null(vertex);
    for (uint32_t v = 0; v < s->order.bricks * INCODE_BRICK_POINTS; v++)
        if (s->order.row[v] != INCODE_NONE)
            vertex[s->order.row[v]] = v;
    host_tetrahedra_map(&s->tets, vertex);
    free(vertex);
}

static void open_bench(struct bench *b, const struct host_points *set,
                       enum incode_index index, uint32_t frames) {
    b->solo = (struct solo){.index = (uint8_t)index, .regions = 1};
    solo_run(&b->solo, set->xyz, set->count);
    number_by_vertices(&b->solo);
    const struct host_order *order = &b->solo.order;
    oracle_open(&b->oracle, &b->solo.tets, order->bricks * INCODE_BRICK_POINTS);
    struct incode_points points = {.bricks = order->bricks, .index = index};
    memcpy(points.lo, order->lo, sizeof points.lo);
    memcpy(points.hi, order->hi, sizeof points.hi);
    memcpy(points.cells, order->cells, sizeof points.cells);
    const struct incode_maker_share share = {INCODE_HORIZON_MIN, 16, frames};
    const struct incode_page_source source = {b, request};
    b->bytes = incode_maker_bytes(&share);
    b->memory = aligned_alloc(64, (b->bytes + GUARD + 63) / 64 * 64);
    assert_non_null(b->memory);
    memset(b->memory, 0xa5, b->bytes + GUARD);
    const struct incode_yield nobody = {NULL, NULL, 0};
    incode_maker_init(&b->maker, b->memory, &share, &points, &source, &nobody);
}

static void close_bench(struct bench *b) {
    assert_null(b->maker.fault);
    for (size_t i = 0; i < GUARD; i++)
        assert_int_equal(b->memory[b->bytes + i], 0xa5);
    oracle_close(&b->oracle);
    solo_close(&b->solo);
    free(b->memory);
    free(b->face);
}

static void check_answer(const struct bench *b, const uint32_t f[3],
                         const struct incode_answer *a) {
    uint32_t apex = oracle_apex(&b->oracle, f);
    if (a->f[3] != apex)
        fail_msg("(%u, %u, %u): %u, expected %u", f[0], f[1], f[2], a->f[3],
                 apex);
    for (int i = 0; i < 3; i++)
        assert_int_equal(a->f[i], f[i]);
    for (int i = 0; i < 4 && apex != INCODE_NONE; i++) {
        double p[3];
        host_vertex(&b->solo.order, a->f[i], p);
        assert_memory_equal(a->p[i], p, sizeof p);
    }
}

/* ---- faces ---- */

struct batch {
    uint32_t first, count, done;
    struct incode_answer answer[BATCH];
};

/* Lets several searches answer some faces each, in turn. */
static void answer_all(struct bench *b) {
    static struct batch batch[SLOTS];
    uint32_t next = 0, open = 0, idle = 0;
    memset(batch, 0, sizeof batch);
    for (unsigned slot = 0; next < b->faces || open > 0;
         slot = (slot + 1) % SLOTS) {
        struct batch *s = &batch[slot];
        if (s->count == 0) {
            uint32_t left = b->faces - next;
            s->first = next;
            s->count = left < BATCH ? left : BATCH;
            s->done = 0;
            next += s->count;
            open += s->count > 0;
            if (s->count == 0)
                continue;
        }
        uint32_t before = s->done;
        enum incode_step r = incode_maker_apexes(
            &b->maker, slot, (const uint32_t(*)[3])b->face + s->first, s->count,
            s->answer, &s->done);
        assert_null(b->maker.fault);
        idle = s->done > before || r == INCODE_WORKED ? 0 : idle + 1;
        assert_in_range(idle, 0, IDLE_MAX); /* or it goes in circles */
        if (r == INCODE_WAITING) {
            assert_true(s->done < s->count);
            b->waits++;
            deliver(b);
        }
        if (r != INCODE_FINISHED)
            continue;
        assert_int_equal(s->done, s->count);
        for (uint32_t i = 0; i < s->count; i++)
            check_answer(b, b->face[s->first + i], &s->answer[i]);
        s->count = 0;
        open--;
    }
}

static void answer_set(const struct host_points *set, enum incode_index index,
                       uint64_t chance, uint32_t frames, uint32_t every) {
    struct bench b = {.chance = chance};
    open_bench(&b, set, index, frames);
    list_faces(&b, every);
    answer_all(&b);
    assert_true(b.waits > 0);
    assert_true(b.maker.counts.calls >= b.faces);
    if (b.maker.tree.pages > frames)
        assert_true(b.maker.pager.evictions > 0);
    close_bench(&b);
}

TEST(real_sets) {
    static const struct {
        const char *name;
        enum incode_index index;
        uint32_t every;
    } cases[] = {{"cactus", INCODE_KD, 1},    {"mug_fem", INCODE_KD, 3},
                 {"can_fem", INCODE_KD, 5},   {"cactus", INCODE_GRID, 2},
                 {"can_fem", INCODE_GRID, 9}, {"cactus", INCODE_NAIVE, 9}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct host_points points = {0};
        char file[64];
        (void)snprintf(file, sizeof file, "%s.xyz.gz", cases[i].name);
        if (!reference_data(file, &points)) {
            print_message("%s: not there\n", file);
            skip();
        }
        for (uint64_t k = 0; k < 2; k++)
            answer_set(&points, cases[i].index, k * (i + 1),
                       k == 0 ? 1000 : INCODE_FRAMES_MIN,
                       (SANITIZED ? 5 : 1) * cases[i].every);
        host_points_free(&points);
    }
}

TEST(made_sets) {
    static const char *const kinds[] = {"uniform", "bluntfin", "rotated",
                                        "sphere", "hub"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct host_points points = {0};
        struct host_error error = {0};
        if (host_gen(kinds[i], 1000, 5, &points, &error) != 0)
            fail_msg("%s", error.text);
        for (unsigned index = 0; index < 3; index++)
            answer_set(&points, (enum incode_index)index, index + i,
                       INCODE_FRAMES_MIN, index == INCODE_NAIVE ? 9 : 1);
        host_points_free(&points);
    }
}

/* ---- a first tetrahedron, and what else is asked ---- */

static void made(struct host_points *points, uint64_t n) {
    struct host_error error = {0};
    if (host_gen("uniform", n, 2, points, &error) != 0)
        fail_msg("%s", error.text);
}

TEST(first_tetrahedra) {
    struct host_points points = {0};
    struct bench b = {.chance = 77};
    made(&points, 3000);
    open_bench(&b, &points, INCODE_KD, INCODE_FRAMES_MIN);
    for (uint32_t k = 0; k < 300; k++) {
        uint32_t v = draw(&b, b.solo.order.bricks * INCODE_BRICK_POINTS);
        struct incode_answer a;
        enum incode_step r;
        if (b.solo.order.row[v] == INCODE_NONE)
            continue;
        while ((r = incode_maker_first(&b.maker, 3, v, &a)) == INCODE_WAITING)
            deliver(&b);
        assert_int_equal(r, INCODE_FINISHED);
        assert_null(b.maker.fault);
        assert_int_equal(a.f[0], v);
        assert_int_not_equal(a.f[3], INCODE_NONE);
        check_answer(&b, a.f, &a);
    }
    host_points_free(&points);
    close_bench(&b);
}

/* A search that is abandoned anywhere leaves nothing to the next one. */
TEST(abandoned) {
    struct host_points points = {0};
    struct bench b = {.chance = 5};
    made(&points, 3000);
    open_bench(&b, &points, INCODE_KD, INCODE_FRAMES_MIN);
    list_faces(&b, 1);
    for (uint32_t k = 0; k < 2000; k++) {
        const uint32_t(*f)[3] =
            (const uint32_t(*)[3])b.face + draw(&b, b.faces);
        struct incode_answer a;
        uint32_t done = 0, left = draw(&b, 10);
        while (incode_maker_apexes(&b.maker, 0, f, 1, &a, &done) !=
                   INCODE_FINISHED &&
               left-- > 0)
            deliver(&b);
        if (done == 1)
            check_answer(&b, *f, &a);
        incode_maker_forget(&b.maker, 0);
        deliver(&b);
    }
    host_points_free(&points);
    close_bench(&b);
}

/* Which searches wait is known, and a page that is fetched ahead is there. */
TEST(waiting_and_ahead) {
    struct host_points points = {0};
    struct bench b = {.chance = 0};
    made(&points, 3000);
    open_bench(&b, &points, INCODE_KD, 200);
    list_faces(&b, 1);
    struct incode_answer a;
    uint32_t done = 0;
    assert_int_equal(incode_maker_apexes(&b.maker, 4,
                                         (const uint32_t(*)[3])b.face, 1, &a,
                                         &done),
                     INCODE_WAITING);
    assert_int_equal(incode_maker_waiting(&b.maker, 1 << 4), 1 << 4);
    assert_int_equal(incode_maker_waiting(&b.maker, 0), 0);
    while (b.pages > 0)
        deliver(&b);
    assert_int_equal(incode_maker_waiting(&b.maker, 1 << 4), 0);
    incode_maker_forget(&b.maker, 4);
    assert_int_equal(incode_maker_count(&b.maker, 20), 0);
    for (int i = 0; i < 100 && !incode_maker_prefetch(&b.maker, 20, 5); i++)
        while (b.pages > 0)
            deliver(&b);
    while (b.pages > 0)
        deliver(&b);
    assert_true(incode_maker_prefetch(&b.maker, 20, 5));
    assert_int_equal(incode_maker_count(&b.maker, 20), b.solo.order.fill[20]);
    assert_int_equal(incode_maker_count(&b.maker, 22), b.solo.order.fill[22]);
    /* Each brick of a range is looked ahead at once, and none past it. */
    incode_maker_start(&b.maker);
    for (int i = 0; i < 100 && b.maker.ahead < 33; i++) {
        incode_maker_look_ahead(&b.maker, 30, 33);
        while (b.pages > 0)
            deliver(&b);
    }
    assert_int_equal(b.maker.ahead, 33);
    for (uint32_t brick = 30; brick < 33; brick++)
        assert_int_equal(incode_maker_count(&b.maker, brick),
                         b.solo.order.fill[brick]);
    incode_maker_look_ahead(&b.maker, 30, 33);
    assert_int_equal(b.pages, 0);
    incode_maker_look_ahead(&b.maker, 34, 33);
    assert_int_equal(b.pages, 0);
    host_points_free(&points);
    close_bench(&b);
}

/* What fits is what the bytes say. */
TEST(memory) {
    for (size_t bytes = 0; bytes < 3 << 20; bytes += 12345) {
        for (uint32_t copies = 16; copies <= INCODE_HORIZON_COPIES;
             copies += 8) {
            struct incode_maker_share share = {128 + 64 * (copies / 8 % 4),
                                               copies, 0};
            share.frames = incode_maker_frames(&share, bytes);
            if (share.frames > 0)
                assert_true(incode_maker_bytes(&share) <= bytes);
            share.frames++;
            assert_true(incode_maker_bytes(&share) > bytes);
        }
    }
}
