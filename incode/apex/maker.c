#include "maker.h"

#include <assert.h>
#include <string.h>

#include "incode/pages/pages.h"
#include "incode/predicates/check.h"

enum { LOOKAHEAD_MAX = 48 /* bricks */ };

/* ---- memory ---- */

static size_t horizon_bytes(const struct incode_maker_share *share) {
    return incode_horizon_bytes(share->boxes, share->copies);
}

size_t incode_maker_bytes(const struct incode_maker_share *share) {
    return horizon_bytes(share) + incode_pager_bytes(share->frames);
}

uint32_t incode_maker_frames(const struct incode_maker_share *share,
                             size_t bytes) {
    if (bytes < horizon_bytes(share))
        return 0;
    bytes -= horizon_bytes(share);
    size_t most = bytes / sizeof(struct incode_frame);
    uint32_t frames =
        most > INCODE_FRAMES_MAX ? INCODE_FRAMES_MAX : (uint32_t)most;
    while (frames > 0 && incode_pager_bytes(frames) > bytes)
        frames--;
    return frames;
}

static uint32_t lookahead_of(const struct incode_maker *m) {
    uint32_t bricks = m->pager.frame_count / 24;
    if (m->tree.pages <= m->pager.frame_count)
        return m->tree.bricks; /* none pushes another out */
    return bricks < 1 ? 1 : bricks > LOOKAHEAD_MAX ? LOOKAHEAD_MAX : bricks;
}

/* Takes its share of an arena, with nothing in it. */
static void take(struct incode_maker *m, void *memory,
                 const struct incode_maker_share *share, uint32_t bricks) {
    INCODE_ASSERT(share->frames >= INCODE_FRAMES_MIN);
    incode_maker_yield(m, INCODE_YIELD_UNITS);
    incode_horizon_init(&m->horizon, memory, share->boxes, share->copies,
                        &m->counts.tally.yield);
    incode_maker_yield(m, INCODE_YIELD_UNITS);
    incode_pager_init(&m->pager, (uint8_t *)memory + horizon_bytes(share),
                      share->frames, bricks, &m->counts.tally.yield);
    m->lookahead = lookahead_of(m);
    m->local.pages_max = share->frames / 2;
    incode_local_reset(&m->local);
}

void incode_maker_init(struct incode_maker *m, void *memory,
                       const struct incode_maker_share *share,
                       const struct incode_points *points,
                       const struct incode_page_source *source,
                       const struct incode_yield *yield) {
    INCODE_ASSERT(points->bricks > 0);
    memset(m, 0, sizeof *m);
    m->counts.tally.yield = *yield;
    m->index = points->index;
    memcpy(m->lo, points->lo, sizeof m->lo);
    memcpy(m->hi, points->hi, sizeof m->hi);
    memcpy(m->cells, points->cells, sizeof m->cells);
    incode_tree_init(&m->tree, points->bricks,
                     points->index == INCODE_GRID
                         ? points->cells[0] * points->cells[1] *
                               points->cells[2]
                         : 0);
    take(m, memory, share, points->bricks);
    m->pager.source = *source;
    m->pager.shuffle = points->shuffle_seed;
    m->walker = (struct incode_walker){&m->pager, &m->tree, &m->counts.tally,
                                       &m->counts.candidates, UINT32_MAX};
    m->local.yield = &m->counts.tally.yield;
    m->spread = 1.6;
    m->reach = 2;
}

void incode_maker_move(struct incode_maker *m, void *memory,
                       const struct incode_maker_share *share) {
    struct incode_pager old = m->pager;
    INCODE_ASSERT(old.loading == 0);
    for (unsigned i = 0; i < INCODE_SEARCHES; i++)
        incode_maker_forget(m, i);
    take(m, memory, share, m->tree.bricks);
    m->pager.source = old.source;
    m->pager.shuffle = old.shuffle;
    m->pager.requests = old.requests;
    m->pager.evictions = old.evictions;
    m->ahead = 0;
}

void incode_maker_start(struct incode_maker *m) {
    m->fault = NULL;
    m->ahead = 0;
}

void incode_maker_forget(struct incode_maker *m, unsigned slot) {
    m->search[slot].stage = INCODE_SEARCH_NONE;
    m->search[slot].advanced = false;
}

/* ---- pages ---- */

uint32_t incode_maker_waiting(const struct incode_maker *m, uint32_t slots) {
    uint32_t waiting = 0;
    for (; slots != 0; slots &= slots - 1) {
        unsigned slot = (unsigned)__builtin_ctz(slots);
        if (incode_pager_loading(&m->pager, m->search[slot].page))
            waiting |= UINT32_C(1) << slot;
    }
    return waiting;
}

int incode_maker_page(struct incode_maker *m, uint32_t page, const void *data,
                      size_t bytes) {
    if (!incode_pager_loading(&m->pager, page))
        return INCODE_PAGE_UNASKED;
    if (!incode_page_is_sound(&m->tree, m->lo, m->hi, page, data, bytes))
        return INCODE_PAGE_UNSOUND;
    return incode_pager_deliver(&m->pager, page, data, bytes) == 0
               ? 0
               : INCODE_PAGE_UNASKED;
}

int incode_maker_put(struct incode_maker *m, uint32_t page, const void *data,
                     size_t bytes) {
    bool sound =
        incode_page_is_sound(&m->tree, m->lo, m->hi, page, data, bytes) &&
        incode_pager_put(&m->pager, page, data, bytes) == 0;
    return sound ? 0 : INCODE_PAGE_UNSOUND;
}

bool incode_maker_fetch(struct incode_maker *m, uint32_t page) {
    if (!incode_pager_loading(&m->pager, page) &&
        incode_pager_has_free(&m->pager))
        (void)incode_pager_get(&m->pager, page);
    return incode_pager_loading(&m->pager, page);
}

uint32_t incode_maker_count(struct incode_maker *m, uint32_t brick) {
    const struct incode_frame *f = incode_pager_get(&m->pager, brick);
    return f == NULL ? 0 : f->count;
}

static bool count_brick(struct incode_walker *walker, struct incode_query *q,
                        const struct incode_frame *frame, uint32_t brick,
                        uint32_t leaves, void *context) {
    uint32_t *left = context;
    (void)walker, (void)q, (void)frame, (void)brick, (void)leaves;
    return --*left > 0;
}

/* more: bricks after it or, where `down`, before it. */
static bool prefetch(struct incode_maker *m, uint32_t brick, uint32_t more,
                     bool down) {
    const struct incode_frame *f = incode_pager_get(&m->pager, brick);
    if (f == NULL) {
        for (uint32_t i = 1; i <= more; i++) {
            uint32_t next = down ? brick - i : brick + i;
            if (incode_pager_get(&m->pager, next) == NULL &&
                !incode_pager_loading(&m->pager, next))
                break; /* no more can be asked for at present */
        }
        return false;
    }
    struct incode_query q;
    memset(&q, 0, sizeof q);
    q.question = INCODE_QUERY_BOX;
    q.boxed = q.ahead = true;
    double extent = incode_frame_box(f, q.lo, q.hi);
    for (int d = 0; d < 3; d++) {
        q.lo[d] -= extent * m->spread;
        q.hi[d] += extent * m->spread;
    }
    /* No more than a share of the frames: it would push out what is at work. */
    uint32_t left = m->pager.frame_count / 8;
    return incode_walk(&m->walker, &q, count_brick, &left) != INCODE_WAITING;
}

bool incode_maker_prefetch(struct incode_maker *m, uint32_t brick,
                           uint32_t more) {
    return prefetch(m, brick, more, false);
}

/* Whether there is something to look ahead at, from `first` on before `last`;
 * *more: how many more than the one at m->ahead. */
static bool may_look_ahead(struct incode_maker *m, uint32_t first,
                           uint32_t last, uint32_t *more) {
    if (m->ahead < first)
        m->ahead = first;
    if (m->ahead >= last || m->ahead >= first + m->lookahead)
        return false;
    *more = last - m->ahead - 1;
    if (*more >= m->lookahead)
        *more = m->lookahead - 1;
    return true;
}

void incode_maker_look_ahead(struct incode_maker *m, uint32_t first,
                             uint32_t last) {
    uint32_t more;
    if (may_look_ahead(m, first, last, &more))
        m->ahead += prefetch(m, m->ahead, more, false);
}

void incode_maker_look_down(struct incode_maker *m, uint32_t last,
                            uint32_t passed, uint32_t count) {
    uint32_t more;
    if (may_look_ahead(m, passed, count, &more))
        m->ahead += prefetch(m, last - 1 - m->ahead, more, true);
}
