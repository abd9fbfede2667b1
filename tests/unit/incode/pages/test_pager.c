/* The pager against a plain model: a list of pages, the most recently used
 * first, and a set of those that are on their way. */
#include <math.h>

#include "incode/pages/pager.h"
#include "tests/unit/test.h"

enum { FRAMES_MAX = 64, PAGES_MAX = 400, BRICKS = 300 };

static uint64_t state;

static uint32_t draw(uint32_t below) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (uint32_t)((state >> 33) % below);
}

/* ---- the model ---- */

enum place { ABSENT, LOADING, HELD, READY };

struct model {
    uint32_t frames, loading_max, loading, held;
    uint32_t page[FRAMES_MAX]; /* most recently used first */
    uint32_t count;
    enum place place[PAGES_MAX];
    uint64_t requests, evictions;
    bool shuffled, credit;
    uint32_t asked; /* the last page asked for, or INCODE_NONE */
};

static void take_out(struct model *m, uint32_t i) {
    memmove(m->page + i, m->page + i + 1,
            (m->count - i - 1) * sizeof m->page[0]);
    m->count--;
}

static void put_first(struct model *m, uint32_t page) {
    memmove(m->page + 1, m->page, m->count * sizeof m->page[0]);
    m->page[0] = page;
    m->count++;
}

static void model_ask(struct model *m, uint32_t page) {
    if (m->loading + m->held >= m->loading_max || !m->credit)
        return;
    if (m->count == m->frames) {
        uint32_t i = m->count;
        do {
            assert_int_not_equal(i, 0);
            i--;
        } while (m->place[m->page[i]] != READY);
        m->place[m->page[i]] = ABSENT;
        take_out(m, i);
        m->evictions++;
    }
    put_first(m, page);
    m->place[page] = LOADING;
    m->loading++;
    m->requests++;
}

static bool model_get(struct model *m, uint32_t page) {
    if (m->place[page] == ABSENT) {
        model_ask(m, page);
        return false;
    }
    for (uint32_t i = 0; i < m->count; i++) {
        if (m->page[i] == page) {
            take_out(m, i);
            put_first(m, page);
            break;
        }
    }
    return m->place[page] == READY;
}

/* ---- pages ---- */

/* In no order within a leaf. */
static double coordinate(uint32_t page, uint32_t slot, int d) {
    uint32_t mixed = (page * 64 + slot) * UINT32_C(2654435761);
    return (double)(mixed * (uint32_t)(2 * d + 1) >> 8) * 0.37 - 2000000;
}

static uint32_t points_of(uint32_t page) {
    return page % 5 == 0 ? page % 64 + 1 : 64;
}

static size_t fill(uint32_t page, uint8_t *data) {
    if (page >= BRICKS) {
        memset(data, (int)(page & 0xff), INCODE_PAGE_BYTES);
        return INCODE_PAGE_BYTES;
    }
    uint32_t n = points_of(page);
    for (int d = 0; d < 3; d++) {
        for (uint32_t i = 0; i < n; i++) {
            double a = coordinate(page, i, d);
            memcpy(data + ((uint32_t)d * n + i) * sizeof a, &a, sizeof a);
        }
    }
    return 24 * (size_t)n;
}

/* Boxes made of the frame's points against those of the points sent. */
static void check_boxes(const struct incode_frame *f, uint32_t page) {
    _Alignas(64) double leaf_lo[3][INCODE_BRICK_LEAVES],
        leaf_hi[3][INCODE_BRICK_LEAVES];
    double lo[3], hi[3], extent = 0;
    uint32_t n = points_of(page);
    incode_frame_leaf_boxes(f, leaf_lo, leaf_hi);
    double longest = incode_frame_box(f, lo, hi);
    for (int d = 0; d < 3; d++) {
        double least = INFINITY, most = -INFINITY;
        for (uint32_t leaf = 0; leaf < incode_frame_leaves(f); leaf++) {
            double from = INFINITY, to = -INFINITY;
            for (uint32_t i = 8 * leaf; i < 8 * leaf + 8 && i < n; i++) {
                from = fmin(from, coordinate(page, i, d));
                to = fmax(to, coordinate(page, i, d));
            }
            assert_true(leaf_lo[d][leaf] == from);
            assert_true(leaf_hi[d][leaf] == to);
            least = fmin(least, from);
            most = fmax(most, to);
            extent = fmax(extent, to - from);
        }
        assert_true(lo[d] == least);
        assert_true(hi[d] == most);
    }
    assert_true(longest == extent);
}

static void check_frame(const struct incode_frame *f, uint32_t page) {
    assert_int_equal(f->number, page);
    if (page >= BRICKS) {
        uint8_t data[INCODE_PAGE_BYTES];
        (void)fill(page, data);
        assert_memory_equal(&f->page, data, sizeof data);
        return;
    }
    uint32_t n = points_of(page);
    assert_int_equal(f->count, n);
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i++) {
        uint32_t slot = i < n ? i : n - 1; /* the last point repeats */
        assert_true(f->page.brick.x[i] == coordinate(page, slot, 0));
        assert_true(f->page.brick.y[i] == coordinate(page, slot, 1));
        assert_true(f->page.brick.z[i] == coordinate(page, slot, 2));
    }
    check_boxes(f, page);
}

/* ---- traces ---- */

static bool request(void *context, uint32_t page) {
    struct model *m = context;
    m->asked = page;
    return m->credit;
}

static void get_one(struct incode_pager *pager, struct model *m,
                    uint32_t pages) {
    uint32_t page = draw(4) == 0 ? draw(pages) : draw(pages / 8 + 1);
    m->credit = draw(8) != 0;
    m->asked = INCODE_NONE;
    bool absent = m->place[page] == ABSENT;
    const struct incode_frame *f = incode_pager_get(pager, page);
    bool ready = model_get(m, page);
    assert_int_equal(f != NULL, ready);
    assert_true(m->asked == INCODE_NONE || (absent && m->asked == page));
    if (f != NULL)
        check_frame(f, page);
}

static void deliver_one(struct incode_pager *pager, struct model *m,
                        uint32_t pages) {
    uint8_t data[INCODE_PAGE_BYTES + 64];
    uint32_t page = draw(pages);
    for (uint32_t i = 0; i < pages && m->place[page] != LOADING; i++)
        page = (page + 1) % pages;
    size_t bytes = fill(page, data);
    if (m->place[page] != LOADING) {
        assert_int_equal(incode_pager_deliver(pager, page, data, bytes), -1);
        return;
    }
    /* A wrong size is refused and the page still waited for. */
    if (draw(4) == 0) {
        size_t wrong = draw(2) == 0 ? bytes + 8 : bytes - 1;
        assert_int_equal(incode_pager_deliver(pager, page, data, wrong), -1);
    }
    assert_int_equal(incode_pager_deliver(pager, page, data, bytes), 0);
    m->loading--;
    m->place[page] = m->shuffled ? HELD : READY;
    m->held += m->shuffled;
}

/* One that comes unasked is taken where it is on its way, or where nothing has
 * to make room for it. */
static void put_one(struct incode_pager *pager, struct model *m,
                    uint32_t pages) {
    uint8_t data[INCODE_PAGE_BYTES + 64];
    uint32_t page = draw(pages);
    size_t bytes = fill(page, data);
    m->asked = INCODE_NONE;
    assert_int_equal(incode_pager_has_free(pager), m->count < m->frames);
    assert_int_equal(incode_pager_put(pager, page, data, bytes), 0);
    assert_int_equal(m->asked, INCODE_NONE);
    bool comes = m->place[page] == LOADING;
    if (m->place[page] == ABSENT && m->count < m->frames) {
        put_first(m, page);
        comes = true;
    } else if (comes) {
        m->loading--;
    }
    if (comes) {
        m->place[page] = m->shuffled ? HELD : READY;
        m->held += m->shuffled;
    }
}

/* A page that is there goes out as it came, and that is no use of it. */
static void copy_one(const struct incode_pager *pager, const struct model *m,
                     uint32_t pages) {
    uint8_t data[INCODE_PAGE_BYTES + 64], copy[INCODE_PAGE_BYTES];
    uint32_t page = draw(pages);
    size_t bytes = fill(page, data), had = incode_pager_copy(pager, page, copy);
    bool ready = m->place[page] == READY;
    assert_int_equal(incode_pager_has(pager, page), ready);
    assert_int_equal(had, ready ? bytes : 0);
    assert_memory_equal(copy, data, had);
    uint64_t *label = incode_pager_label(pager, page);
    assert_int_equal(label != NULL, m->place[page] != ABSENT);
    if (label != NULL) { /* the one that was set, or none yet */
        assert_true(*label == 0 || *label == page + 1);
        *label = page + 1;
    }
}

/* Which page comes out is the pager's choice; one does at once if told so. */
static void release(struct incode_pager *pager, struct model *m) {
    bool now = draw(2) == 0;
    bool released = incode_pager_release(pager, now);
    if (m->held == 0)
        assert_false(released);
    else if (now)
        assert_true(released);
    if (!released)
        return;
    uint32_t found = 0;
    for (uint32_t i = 0; i < pager->frame_count; i++) {
        const struct incode_frame *f = &pager->frames[i];
        if (pager->slots[i].state == INCODE_FRAME_READY &&
            m->place[f->number] == HELD) {
            m->place[f->number] = READY;
            found++;
        }
    }
    assert_int_equal(found, 1);
    m->held--;
}

static void compare(const struct incode_pager *pager, const struct model *m,
                    uint32_t pages) {
    assert_int_equal(pager->requests, m->requests);
    assert_int_equal(pager->evictions, m->evictions);
    assert_int_equal(pager->loading, m->loading);
    assert_int_equal(pager->held, m->held);
    assert_in_range(pager->frames_used, m->count, m->frames);
    for (uint32_t page = 0; page < pages; page++) {
        bool waits = m->place[page] == LOADING || m->place[page] == HELD;
        assert_int_equal(incode_pager_loading(pager, page), waits);
    }
    /* Times of use fall along the model's list, and nothing else is used. */
    uint64_t before = UINT64_MAX;
    for (uint32_t k = 0; k < m->count; k++) {
        uint32_t i = 0;
        while (i < pager->frames_used && pager->frames[i].number != m->page[k])
            i++;
        assert_int_not_equal(i, pager->frames_used);
        uint64_t used = pager->used[i] & ~INCODE_FRAME_WAITING;
        assert_true(used < before);
        before = used;
    }
    assert_int_equal(pager->frames_used, m->count);
}

static void trace(uint32_t frames, uint32_t pages, bool shuffled) {
    size_t bytes = (incode_pager_bytes(frames) + 63) / 64 * 64;
    uint8_t *memory = aligned_alloc(64, bytes + 64);
    assert_non_null(memory);
    memset(memory, 0xa5, bytes + 64);
    struct incode_pager pager;
    struct incode_yield none = {0};
    incode_pager_init(&pager, memory, frames, BRICKS, &none);
    struct model m = {.frames = frames,
                      .loading_max = pager.loading_max,
                      .shuffled = shuffled};
    pager.source.request = request;
    pager.source.context = &m;
    pager.shuffle = shuffled ? 99 : 0;
    assert_in_range(pager.loading_max, 1, frames);
    for (int step = 0; step < 20000; step++) {
        uint32_t what = draw(9);
        if (what < 5)
            get_one(&pager, &m, pages);
        else if (what < 7)
            deliver_one(&pager, &m, pages);
        else if (what == 7 && draw(8) == 0)
            put_one(&pager, &m, pages);
        else if (what == 7)
            copy_one(&pager, &m, pages);
        else
            release(&pager, &m);
        if (step % 64 == 0)
            compare(&pager, &m, pages);
    }
    compare(&pager, &m, pages);
    assert_true(m.requests > 0);
    for (size_t i = incode_pager_bytes(frames); i < bytes + 64; i++)
        assert_int_equal(memory[i], 0xa5);
    free(memory);
}

TEST(least_recently_used) {
    static const uint32_t frames[] = {1, 2, 3, 4, 7, 16, 48, 64};
    for (size_t i = 0; i < sizeof frames / sizeof *frames; i++) {
        state = i;
        trace(frames[i], PAGES_MAX, false);
        trace(frames[i], frames[i] + 3, false);
    }
}

TEST(shuffled) {
    static const uint32_t frames[] = {4, 16, 48};
    for (size_t i = 0; i < sizeof frames / sizeof *frames; i++) {
        state = i;
        trace(frames[i], PAGES_MAX, true);
        trace(frames[i], 2 * frames[i], true);
    }
}

/* Page numbers up to the end of their range, which share hash chains. */
TEST(large_numbers) {
    enum { FRAMES = 8 };
    uint8_t data[INCODE_PAGE_BYTES] = {7};
    void *memory =
        aligned_alloc(64, (incode_pager_bytes(FRAMES) + 63) / 64 * 64);
    assert_non_null(memory);
    struct incode_pager pager;
    struct model m = {.credit = true};
    struct incode_yield none = {0};
    incode_pager_init(&pager, memory, FRAMES, 0, &none);
    pager.source.request = request;
    pager.source.context = &m;
    for (uint32_t k = 0; k < 1000; k++) {
        uint32_t page = UINT32_MAX - 1 - k * UINT32_C(4096);
        assert_int_equal(incode_pager_awaited(&pager), INCODE_NONE);
        assert_null(incode_pager_get(&pager, page));
        assert_true(incode_pager_loading(&pager, page));
        assert_int_equal(incode_pager_awaited(&pager), page);
        assert_int_equal(incode_pager_deliver(&pager, page, data, sizeof data),
                         0);
        assert_int_equal(incode_pager_deliver(&pager, page, data, sizeof data),
                         -1);
        assert_non_null(incode_pager_get(&pager, page));
        if (k >= FRAMES)
            assert_false(incode_pager_loading(
                &pager, UINT32_MAX - 1 - (k - FRAMES) * UINT32_C(4096)));
    }
    assert_int_equal(pager.evictions, 1000 - FRAMES);
    free(memory);
}
