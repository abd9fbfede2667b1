/* The active face list against a plain array of faces. */

#include "incode/front/afl.h"
#include "incode/pages/bricks.h"
#include "tests/unit/test.h"

enum { FACES = 300, BRICKS = 40, GUARD = 64 };

static uint64_t state;

static uint32_t draw(uint32_t below) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (uint32_t)((state >> 33) % below);
}

struct plain {
    uint32_t face[FACES][4]; /* and whether it is held */
    uint32_t count, most;
};

static uint32_t find(const struct plain *p, uint32_t key, uint32_t b,
                     uint32_t c) {
    uint32_t i = 0;
    while (i < p->count &&
           (p->face[i][0] != key || p->face[i][1] != b || p->face[i][2] != c))
        i++;
    return i;
}

static bool take_out(struct plain *p, uint32_t key, uint32_t b, uint32_t c) {
    uint32_t i = find(p, key, b, c);
    if (i == p->count)
        return false;
    memcpy(p->face[i], p->face[--p->count], sizeof p->face[i]);
    return true;
}

static uint32_t faces_at(const struct plain *p, uint32_t first, uint32_t end) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < p->count; i++)
        n += p->face[i][0] >= first && p->face[i][0] < end;
    return n;
}

/* Whether a face that is held shares an edge at the key. */
static bool meets_held(const struct plain *p, uint32_t i) {
    const uint32_t *f = p->face[i];
    for (uint32_t k = 0; k < p->count; k++) {
        const uint32_t *g = p->face[k];
        if (k != i && g[0] == f[0] && g[3] != 0 &&
            (g[1] == f[1] || g[1] == f[2] || g[2] == f[1] || g[2] == f[2]))
            return true;
    }
    return false;
}

/* Faces at a vertex that can be taken, or that can be held as well. */
static uint32_t free_at(const struct plain *p, uint32_t v, bool apart) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < p->count; i++)
        n += p->face[i][0] == v && p->face[i][3] == 0 &&
             !(apart && meets_held(p, i));
    return n;
}

static uint32_t held_of(const struct plain *p) {
    uint32_t n = 0;
    for (uint32_t i = 0; i < p->count; i++)
        n += p->face[i][3] != 0;
    return n;
}

static uint8_t *open_list(struct incode_afl *afl, uint32_t faces,
                          uint32_t bricks) {
    size_t bytes = incode_afl_bytes(faces, bricks);
    uint8_t *memory = aligned_alloc(64, (bytes + GUARD + 63) / 64 * 64);
    assert_non_null(memory);
    memset(memory, 0xa5, bytes + GUARD);
    incode_afl_init(afl, memory, faces, bricks, NULL);
    return memory;
}

static void close_list(uint8_t *memory, uint32_t faces, uint32_t bricks) {
    size_t bytes = incode_afl_bytes(faces, bricks);
    for (size_t i = bytes; i < bytes + GUARD; i++)
        assert_int_equal(memory[i], 0xa5);
    free(memory);
}

/* What is known of every brick agrees with the faces. */
static void compare(const struct incode_afl *afl, const struct plain *p) {
    assert_int_equal(afl->count, p->count);
    assert_int_equal(afl->count_max, p->most);
    assert_int_equal(afl->held_count, held_of(p));
    for (uint32_t brick = 0; brick < BRICKS; brick++) {
        const struct incode_touched *entry = incode_afl_find(afl, brick);
        uint32_t first = brick * INCODE_BRICK_POINTS;
        uint32_t n = faces_at(p, first, first + INCODE_BRICK_POINTS);
        assert_int_equal(entry == NULL ? 0 : entry->faces, n);
        for (uint32_t v = 0; v < INCODE_BRICK_POINTS && entry != NULL; v++) {
            bool pending = (entry->pending >> v & 1) != 0;
            /* The mark may outlast the faces, but never fails them. */
            if (free_at(p, first + v, true) > 0)
                assert_true(pending);
        }
    }
}

/* A vertex of few bricks, so that faces meet their twins. */
static uint32_t draw_vertex(void) {
    return draw(BRICKS) * INCODE_BRICK_POINTS + draw(2);
}

static void toggle_one(struct incode_afl *afl, struct plain *p) {
    uint32_t f[3];
    if (p->count > 0 && draw(8) < 3) { /* the twin of an open one */
        uint32_t i = draw(p->count);
        f[0] = p->face[i][0];
        f[1] = p->face[i][2];
        f[2] = p->face[i][1];
    } else {
        if (p->count == FACES)
            return;
        f[0] = draw_vertex();
        f[1] = draw(4) + 100000;
        f[2] = draw(4) + 200000;
        if (find(p, f[0], f[1], f[2]) < p->count)
            return; /* opening a face twice is not allowed */
    }
    bool closes = take_out(p, f[0], f[2], f[1]);
    if (draw(4) == 0) {
        assert_int_equal(incode_afl_close_twin(afl, f[0], f[1], f[2]), closes);
        return;
    }
    incode_afl_toggle(afl, f[0], f[1], f[2]);
    if (closes)
        return;
    memcpy(p->face[p->count], f, sizeof f);
    p->face[p->count++][3] = 0;
    p->most = p->count > p->most ? p->count : p->most;
}

static void take_some(struct incode_afl *afl, struct plain *p) {
    uint32_t v = draw_vertex(), pairs[8][2], limit = draw(8) + 1;
    uint32_t n = free_at(p, v, false);
    bool more = true;
    uint32_t taken = incode_afl_take(afl, v, pairs, limit, &more);
    assert_int_equal(taken, n < limit ? n : limit);
    assert_int_equal(more, faces_at(p, v, v + 1) > taken);
    for (uint32_t i = 0; i < taken; i++)
        assert_true(take_out(p, v, pairs[i][0], pairs[i][1]));
    const struct incode_touched *entry =
        incode_afl_find(afl, v / INCODE_BRICK_POINTS);
    if (entry != NULL && !more)
        assert_int_equal(entry->pending >> (v % INCODE_BRICK_POINTS) & 1, 0);
}

static void hold_some(struct incode_afl *afl, struct plain *p) {
    uint32_t v = draw_vertex(), pairs[8][2], limit = draw(8) + 1;
    uint32_t n = incode_afl_hold(afl, v, pairs, limit);
    for (uint32_t i = 0; i < n; i++) {
        uint32_t k = find(p, v, pairs[i][0], pairs[i][1]);
        assert_in_range(k, 0, p->count - 1);
        assert_int_equal(p->face[k][3], 0);
        assert_false(meets_held(p, k)); /* nor one of those before it */
        p->face[k][3] = 1;
    }
    if (n < limit)
        assert_int_equal(free_at(p, v, true), 0);
}

static void hold_one(struct incode_afl *afl, struct plain *p) {
    uint32_t none[3] = {draw_vertex(), 9, 9};
    assert_false(incode_afl_hold_face(afl, none[0], none[1], none[2]));
    if (p->count == 0)
        return;
    uint32_t *f = p->face[draw(p->count)];
    assert_true(incode_afl_hold_face(afl, f[0], f[1], f[2]));
    f[3] = 1;
}

static void let_go(struct incode_afl *afl, struct plain *p) {
    uint32_t v = draw_vertex(), held = 0;
    for (uint32_t i = 0; i < p->count; i++) {
        held += p->face[i][0] == v && p->face[i][3] != 0;
        if (p->face[i][0] == v)
            p->face[i][3] = 0;
    }
    assert_int_equal(incode_afl_let_go(afl, v), held);
}

static void drop_one(struct incode_afl *afl, const struct plain *p) {
    uint32_t brick = draw(BRICKS), first = brick * INCODE_BRICK_POINTS;
    if (faces_at(p, first, first + INCODE_BRICK_POINTS) > 0)
        return;
    incode_afl_drop(afl, brick);
    assert_null(incode_afl_find(afl, brick));
}

TEST(against_plain) {
    for (uint32_t round = 0; round < 4; round++) {
        struct incode_afl afl;
        uint8_t *memory = open_list(&afl, FACES, BRICKS);
        struct plain p = {.count = 0};
        state = round;
        for (int step = 0; step < 20000; step++) {
            uint32_t what = draw(20);
            if (what == 0)
                take_some(&afl, &p);
            else if (what == 1)
                drop_one(&afl, &p);
            else if (what == 2)
                hold_some(&afl, &p);
            else if (what == 3)
                hold_one(&afl, &p);
            else if (what == 4)
                let_go(&afl, &p);
            else
                toggle_one(&afl, &p);
            if (step % 256 == 0)
                compare(&afl, &p);
        }
        compare(&afl, &p);
        assert_true(afl.count_max > FACES / 4);
        incode_afl_clear(&afl);
        p.count = 0;
        compare(&afl, &p);
        assert_int_equal(afl.touched_count, 0);
        close_list(memory, FACES, BRICKS);
    }
}

/* To the last face and the last brick, and back. */
TEST(full) {
    static const uint32_t sizes[][2] = {
        {1, 1}, {2, 1}, {3, 5}, {64, 32}, {100, 100}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        uint32_t faces = sizes[k][0], bricks = sizes[k][1];
        struct incode_afl afl;
        uint8_t *memory = open_list(&afl, faces, bricks);
        for (int round = 0; round < 3; round++) {
            for (uint32_t i = 0; i < faces; i++)
                incode_afl_toggle(&afl, i % bricks * INCODE_BRICK_POINTS,
                                  1000 + i, 5000 + i);
            for (uint32_t i = 0; i < bricks; i++)
                (void)incode_afl_touch(&afl, i);
            assert_int_equal(afl.count, faces);
            assert_int_equal(afl.touched_count, bricks);
            for (uint32_t i = 0; i < faces; i++)
                incode_afl_toggle(&afl, i % bricks * INCODE_BRICK_POINTS,
                                  5000 + i, 1000 + i);
            assert_int_equal(afl.count, 0);
            for (uint32_t i = 0; i < bricks; i++)
                incode_afl_drop(&afl, i);
            assert_int_equal(afl.touched_count, 0);
        }
        close_list(memory, faces, bricks);
    }
}

/* A long list is noticed, once, and not before it is long. */
TEST(crowded) {
    enum { MANY = 1024 };
    struct incode_afl afl;
    uint8_t *memory = open_list(&afl, MANY, BRICKS);
    for (uint32_t i = 0; i <= INCODE_AFL_CROWD; i++) {
        assert_int_equal(afl.crowded, INCODE_NONE);
        incode_afl_toggle(&afl, 77, 1000 + i, 5000 + i);
        incode_afl_toggle(&afl, 200 + i, 1000 + i, 5000 + i);
    }
    assert_int_equal(afl.crowded, 77);
    uint32_t pairs[MANY][2];
    bool more;
    assert_int_equal(incode_afl_take(&afl, 77, pairs, MANY, &more),
                     INCODE_AFL_CROWD + 1);
    assert_false(more);
    incode_afl_clear(&afl);
    assert_int_equal(afl.crowded, INCODE_NONE);
    close_list(memory, MANY, BRICKS);
}

/* Where a vertex has thousands of faces, as it does when all hubs are in use,
 * lending some of them takes a look or two at each; and all are lent in the
 * end. */
TEST(held_of_a_long_list) {
    enum { MANY = 6000, LIMIT = 96 };
    struct incode_afl afl;
    uint32_t pairs[LIMIT][2], left = MANY;
    void *memory = malloc(incode_afl_bytes(MANY, BRICKS));
    assert_non_null(memory);
    incode_afl_init(&afl, memory, MANY, BRICKS, NULL);
    for (uint32_t i = 0; i < MANY; i++)
        incode_afl_toggle(&afl, 1, 2 + i, 3 + i);
    while (left > 0) {
        uint64_t looks = afl.looks;
        uint32_t n = incode_afl_hold(&afl, 1, pairs, LIMIT);
        assert_true(n > 0);
        if (left > INCODE_AFL_CROWD)
            assert_in_range(afl.looks - looks, 0, 2 * left);
        for (uint32_t i = 0; i < n; i++, left--)
            assert_true(
                incode_afl_close_twin(&afl, 1, pairs[i][1], pairs[i][0]));
    }
    assert_int_equal(afl.count, 0);
    assert_null(afl.fault);
    free(memory);
}

/* Where hubs do not help, one vertex after another gets thousands of faces: a
 * search looks at few of them, as do all that close them; and take, tell and
 * let go miss none. */
TEST(searches_of_long_lists) {
    enum { MANY = 6000, VERTICES = 3 * INCODE_AFL_WIDE, LIMIT = 96 };
    struct incode_afl afl;
    static uint32_t pairs[MANY][2];
    void *memory = malloc(incode_afl_bytes(2 * MANY, BRICKS));
    assert_non_null(memory);
    incode_afl_init(&afl, memory, 2 * MANY, BRICKS, NULL);
    for (uint32_t v = 0; v < VERTICES; v++) {
        uint64_t looks = afl.looks;
        for (uint32_t i = 0; i < MANY; i++)
            incode_afl_toggle(&afl, v, 100 + i, 101 + i);
        assert_int_equal(incode_afl_tell(&afl, v, pairs, MANY), MANY);
        for (uint32_t i = 0; i < MANY; i += 2)
            assert_true(incode_afl_hold_face(&afl, v, 100 + i, 101 + i));
        assert_int_equal(incode_afl_tell(&afl, v, pairs, MANY), MANY / 2);
        assert_int_equal(incode_afl_let_go(&afl, v), MANY / 2);
        for (uint32_t i = LIMIT; i < MANY; i++)
            incode_afl_toggle(&afl, v, 101 + i, 100 + i);
        assert_in_range(afl.looks - looks, 0, 150 * MANY);
        bool more;
        /* Some stay a while. */
        assert_int_equal(incode_afl_take(&afl, v, pairs, LIMIT - 40, &more),
                         LIMIT - 40);
        assert_true(more);
    }
    for (uint32_t v = 0; v < VERTICES; v++) {
        bool more;
        assert_int_equal(incode_afl_take(&afl, v, pairs, MANY, &more), 40);
        assert_false(more);
    }
    assert_int_equal(afl.count, 0);
    assert_null(afl.fault);
    free(memory);
}

/* Ways through lists of 0, 1 and 3 faces end in that order, and change nothing;
 * one of them leads past every face of its list. */
TEST_WITH(fetched_lists, NULL, NULL) {
    enum { LISTS = 3 };
    static const uint32_t faces[LISTS] = {0, 3, 1}, left[] = {2, 1, 1, 0, 0};
    struct incode_afl afl;
    void *memory = malloc(incode_afl_bytes(FACES, BRICKS));
    const uint32_t *link[LISTS];
    assert_non_null(memory);
    incode_afl_init(&afl, memory, FACES, BRICKS, NULL);
    for (uint32_t v = 0; v < LISTS; v++) {
        for (uint32_t i = 0; i < faces[v]; i++)
            incode_afl_toggle(&afl, v, 100 + i, 200 + i);
        link[v] = incode_afl_list(&afl, v, 100, 200);
        assert_ptr_equal(link[v], incode_afl_list(&afl, v, 200, 100));
    }
    uint32_t count = LISTS;
    for (uint32_t i = 0; i < sizeof left / sizeof *left; i++) {
        count = incode_afl_fetch(&afl, link, count);
        assert_int_equal(count, left[i]);
        if (count > 0)
            assert_ptr_equal(link[0], &afl.nodes[2 - i].next);
    }
    assert_int_equal(afl.count, 4);
    assert_null(afl.fault);
    free(memory);
}
