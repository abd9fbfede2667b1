#include "pager.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

enum { GROUP = 32 }; /* frames of which a least time of use is noted */

static uint32_t hash_size(uint32_t frames) {
    uint32_t size = 64;
    while (size < 2 * frames)
        size *= 2;
    return size;
}

size_t incode_pager_bytes(uint32_t frames) {
    size_t heads = hash_size(frames) * sizeof(uint16_t);
    size_t groups = (frames + GROUP - 1) / GROUP * sizeof(uint64_t);
    return frames * (sizeof(struct incode_frame) + sizeof(uint64_t) +
                     sizeof(struct incode_slot)) +
           groups + heads;
}

void incode_pager_init(struct incode_pager *pager, void *memory,
                       uint32_t frames, uint32_t bricks,
                       struct incode_yield *yield) {
    INCODE_ASSERT(frames >= 1 && frames < INCODE_NO_FRAME &&
                  (uintptr_t)memory % alignof(struct incode_frame) == 0);
    memset(pager, 0, sizeof *pager);
    pager->frames = memory;
    pager->used = (uint64_t *)(void *)(pager->frames + frames);
    pager->oldest = pager->used + frames;
    pager->group_count = (frames + GROUP - 1) / GROUP;
    pager->slots =
        (struct incode_slot *)(void *)(pager->oldest + pager->group_count);
    pager->heads = (uint16_t *)(void *)(pager->slots + frames);
    pager->frame_count = frames;
    pager->hash_mask = hash_size(frames) - 1;
    pager->loading_max = frames / 4 < 1 ? 1 : frames / 4;
    pager->bricks = bricks;
    memset(pager->oldest, 0, pager->group_count * sizeof pager->oldest[0]);
    incode_yield_fill(yield, pager->heads, 0xff, /* INCODE_NO_FRAME each */
                      (pager->hash_mask + 1) * sizeof pager->heads[0]);
}

static uint16_t *head_of(const struct incode_pager *pager, uint32_t page) {
    return &pager
                ->heads[(page * UINT32_C(2654435761) >> 12) & pager->hash_mask];
}

static uint16_t find(const struct incode_pager *pager, uint32_t page) {
    uint16_t i = *head_of(pager, page);
    while (i != INCODE_NO_FRAME && pager->slots[i].number != page)
        i = pager->slots[i].chain;
    return i;
}

static void set_state(struct incode_pager *pager, uint16_t i,
                      enum incode_frame_state state) {
    uint64_t *oldest = &pager->oldest[i / GROUP];
    pager->slots[i].state = (uint8_t)state;
    pager->used[i] &= ~INCODE_FRAME_WAITING;
    if (state != INCODE_FRAME_READY)
        pager->used[i] |= INCODE_FRAME_WAITING;
    *oldest = pager->used[i] < *oldest ? pager->used[i] : *oldest;
}

/* Where the least of some times is. */
static uint32_t least_of(const uint64_t *time, uint32_t count) {
    uint32_t at = 0;
    for (uint32_t i = 1; i < count; i++)
        at = time[i] < time[at] ? i : at;
    return at;
}

/* The frame that is ready and was not used for longest.  Times only grow, so
 * that what a group's least was is a lower bound: the group with the least of
 * these has it if its bound still holds, else the bound is raised. */
static uint16_t find_oldest(struct incode_pager *pager) {
    for (;;) {
        uint32_t group = least_of(pager->oldest, pager->group_count);
        uint32_t first = group * GROUP, left = pager->frame_count - first;
        uint32_t i =
            first + least_of(pager->used + first, left < GROUP ? left : GROUP);
        if (pager->used[i] >= INCODE_FRAME_WAITING &&
            pager->oldest[group] >= INCODE_FRAME_WAITING)
            return INCODE_NO_FRAME;
        if (pager->used[i] == pager->oldest[group])
            return (uint16_t)i;
        pager->oldest[group] = pager->used[i];
    }
}

static void unchain(struct incode_pager *pager, uint16_t i) {
    uint16_t *link = head_of(pager, pager->slots[i].number);
    while (*link != i)
        link = &pager->slots[*link].chain;
    *link = pager->slots[i].chain;
}

/* A frame to load into: never used, or the least recently used that is not
 * waiting for its page. */
static uint16_t take_frame(struct incode_pager *pager) {
    if (pager->free < pager->frame_count) {
        pager->frames_used++;
        return pager->free++;
    }
    uint16_t i = find_oldest(pager);
    if (i == INCODE_NO_FRAME)
        return i;
    unchain(pager, i);
    pager->evictions++;
    return i;
}

/* A frame for a page that is on its way. */
static void reserve(struct incode_pager *pager, uint32_t page) {
    uint16_t i = take_frame(pager);
    INCODE_ASSERT(i != INCODE_NO_FRAME);
    struct incode_slot *slot = &pager->slots[i];
    slot->number = pager->frames[i].number = page;
    pager->frames[i].label = 0;
    pager->used[i] = ++pager->time;
    set_state(pager, i, INCODE_FRAME_LOADING);
    uint16_t *head = head_of(pager, page);
    slot->chain = *head;
    *head = i;
    pager->loading++;
}

static void ask(struct incode_pager *pager, uint32_t page) {
    if (pager->loading + pager->held >= pager->loading_max ||
        !pager->source.request(pager->source.context, page))
        return;
    reserve(pager, page);
    pager->requests++;
}

struct incode_frame *incode_pager_get(struct incode_pager *pager,
                                      uint32_t page) {
    uint16_t i = find(pager, page);
    if (i == INCODE_NO_FRAME) {
        ask(pager, page);
        return NULL;
    }
    pager->used[i] = ++pager->time;
    if (pager->slots[i].state == INCODE_FRAME_READY)
        return &pager->frames[i];
    pager->used[i] |= INCODE_FRAME_WAITING;
    return NULL;
}

bool incode_pager_loading(const struct incode_pager *pager, uint32_t page) {
    uint16_t i = find(pager, page);
    return i != INCODE_NO_FRAME && pager->slots[i].state != INCODE_FRAME_READY;
}

uint32_t incode_pager_awaited(const struct incode_pager *pager) {
    for (uint16_t i = 0; pager->loading > 0 && i < pager->free; i++)
        if (pager->slots[i].state == INCODE_FRAME_LOADING)
            return pager->slots[i].number;
    return INCODE_NONE;
}

static void load_brick(struct incode_frame *f, const uint8_t *data,
                       size_t points) {
    double *axis[3] = {f->page.brick.x, f->page.brick.y, f->page.brick.z};
    for (int d = 0; d < 3; d++) {
        memcpy(axis[d], data + (size_t)d * points * sizeof(double),
               points * sizeof(double));
        for (size_t i = points; i < INCODE_BRICK_POINTS; i++)
            axis[d][i] = axis[d][points - 1];
    }
    f->count = (uint8_t)points;
}

int incode_pager_deliver(struct incode_pager *pager, uint32_t page,
                         const void *data, size_t bytes) {
    uint16_t i = find(pager, page);
    if (i == INCODE_NO_FRAME || pager->slots[i].state != INCODE_FRAME_LOADING)
        return -1;
    struct incode_frame *f = &pager->frames[i];
    if (page < pager->bricks) {
        size_t points = bytes / (3 * sizeof(double));
        if (points < 1 || points > INCODE_BRICK_POINTS ||
            points * 3 * sizeof(double) != bytes)
            return -1;
        load_brick(f, data, points);
    } else {
        if (bytes != sizeof f->page.boxes && bytes != sizeof f->page.words)
            return -1;
        memcpy(&f->page, data, bytes);
        f->count = 0;
    }
    pager->loading--;
    set_state(pager, i,
              pager->shuffle != 0 ? INCODE_FRAME_HELD : INCODE_FRAME_READY);
    pager->held += pager->shuffle != 0;
    return 0;
}

int incode_pager_put(struct incode_pager *pager, uint32_t page,
                     const void *data, size_t bytes) {
    uint16_t i = find(pager, page);
    if (i == INCODE_NO_FRAME && incode_pager_has_free(pager)) {
        reserve(pager, page);
        i = find(pager, page);
    }
    return i != INCODE_NO_FRAME && pager->slots[i].state == INCODE_FRAME_LOADING
               ? incode_pager_deliver(pager, page, data, bytes)
               : 0;
}

bool incode_pager_has(const struct incode_pager *pager, uint32_t page) {
    uint16_t i = find(pager, page);
    return i != INCODE_NO_FRAME && pager->slots[i].state == INCODE_FRAME_READY;
}

size_t incode_pager_copy(const struct incode_pager *pager, uint32_t page,
                         void *data) {
    if (!incode_pager_has(pager, page))
        return 0;
    const struct incode_frame *f = &pager->frames[find(pager, page)];
    if (page >= pager->bricks) {
        memcpy(data, &f->page, sizeof f->page);
        return sizeof f->page;
    }
    size_t axis = f->count * sizeof f->page.brick.x[0];
    memcpy(data, f->page.brick.x, axis);
    memcpy((uint8_t *)data + axis, f->page.brick.y, axis);
    memcpy((uint8_t *)data + 2 * axis, f->page.brick.z, axis);
    return 3 * axis;
}

uint64_t *incode_pager_label(const struct incode_pager *pager, uint32_t page) {
    uint16_t i = find(pager, page);
    return i == INCODE_NO_FRAME ? NULL : &pager->frames[i].label;
}

bool incode_pager_release(struct incode_pager *pager, bool now) {
    if (pager->held == 0)
        return false;
    pager->shuffle ^= pager->shuffle << 13;
    pager->shuffle ^= pager->shuffle >> 7;
    pager->shuffle ^= pager->shuffle << 17;
    if (!now && (pager->shuffle >> 60 & 3) != 0)
        return false;
    uint32_t pick = (uint32_t)(pager->shuffle % pager->held);
    for (uint16_t i = 0; i < pager->free; i++) {
        if (pager->slots[i].state != INCODE_FRAME_HELD || pick-- > 0)
            continue;
        set_state(pager, i, INCODE_FRAME_READY);
        pager->held--;
        return true;
    }
    return false;
}

/* What is past the last point repeats it, so that no leaf is empty. */
void incode_frame_leaf_boxes(const struct incode_frame *f,
                             double lo[3][INCODE_BRICK_LEAVES],
                             double hi[3][INCODE_BRICK_LEAVES]) {
    const struct incode_brick *b = &f->page.brick;
    const double *const axis[3] = {b->x, b->y, b->z};
    for (int d = 0; d < 3; d++) {
        const double *p = axis[d];
        for (int leaf = 0; leaf < INCODE_BRICK_LEAVES;
             leaf += INCODE_VD_LANES) {
            incode_vd least[INCODE_VD_LANES], most[INCODE_VD_LANES];
            for (int k = 0; k < INCODE_VD_LANES; k++) {
                least[k] = incode_vd_load(p);
                most[k] = -least[k];
                p += INCODE_VD_LANES;
                for (int i = INCODE_VD_LANES; i < INCODE_LEAF_POINTS;
                     i += INCODE_VD_LANES) {
                    least[k] = incode_vd_min(least[k], incode_vd_load(p));
                    most[k] = incode_vd_min(most[k], -incode_vd_load(p));
                    p += INCODE_VD_LANES;
                }
            }
            *(incode_vd *)(lo[d] + leaf) = incode_vd_least_of_each(least);
            *(incode_vd *)(hi[d] + leaf) = -incode_vd_least_of_each(most);
        }
    }
}

double incode_frame_box(const struct incode_frame *f, double lo[3],
                        double hi[3]) {
    alignas(64) double leaf_lo[3][INCODE_BRICK_LEAVES],
        leaf_hi[3][INCODE_BRICK_LEAVES];
    double extent = 0;
    incode_frame_leaf_boxes(f, leaf_lo, leaf_hi);
    for (int d = 0; d < 3; d++) {
        lo[d] = leaf_lo[d][0];
        hi[d] = leaf_hi[d][0];
        for (int i = 0; i < INCODE_BRICK_LEAVES; i++) {
            double side = leaf_hi[d][i] - leaf_lo[d][i];
            extent = side > extent ? side : extent;
            lo[d] = leaf_lo[d][i] < lo[d] ? leaf_lo[d][i] : lo[d];
            hi[d] = leaf_hi[d][i] > hi[d] ? leaf_hi[d][i] : hi[d];
        }
    }
    return extent;
}

/* --- cells ---------------------------------------------------------------- */

uint32_t incode_cell_along(double lo, double hi, uint32_t cells, double p) {
    /* Halves first: hi - lo of two finite numbers may overflow. */
    double side = 0.5 * hi - 0.5 * lo;
    double t = (0.5 * p - 0.5 * lo) / side * (double)cells;
    if (!(t > 0)) /* below the box, or a side of no length: NaN */
        return 0;
    return t < (double)cells ? (uint32_t)t : cells - 1;
}

uint32_t incode_cell_of(const double lo[3], const double hi[3],
                        const uint32_t cells[3], const double p[3]) {
    uint32_t ix = incode_cell_along(lo[0], hi[0], cells[0], p[0]);
    uint32_t iy = incode_cell_along(lo[1], hi[1], cells[1], p[1]);
    uint32_t iz = incode_cell_along(lo[2], hi[2], cells[2], p[2]);
    return (iz * cells[1] + iy) * cells[0] + ix;
}

/* The cell function itself is asked, and it never falls as the
 * coordinate grows, so rounding cannot make the bound wrong, only wide. */
double incode_cells_lowest(const struct incode_grid *g, int d, uint32_t cell) {
    double lo = g->lo[d], hi = g->hi[d];
    if (cell == 0)
        return lo;
    double side = 0.5 * hi - 0.5 * lo;
    double wall = 2 * (0.5 * lo + side * ((double)cell / g->cells[d]));
    double slack =
        0x1p-50 * (__builtin_fabs(lo) + __builtin_fabs(hi)) + 0x1p-1070;
    for (int i = 0; i < 4; i++, slack *= 64) {
        double bound = wall - slack;
        if (!(bound > lo))
            return lo;
        if (incode_cell_along(lo, hi, g->cells[d], bound) < cell)
            return bound;
    }
    return lo;
}

double incode_cells_highest(const struct incode_grid *g, int d, uint32_t cell) {
    double lo = g->lo[d], hi = g->hi[d];
    if (cell + 1 >= g->cells[d])
        return hi;
    double side = 0.5 * hi - 0.5 * lo;
    double wall = 2 * (0.5 * lo + side * ((double)(cell + 1) / g->cells[d]));
    double slack =
        0x1p-50 * (__builtin_fabs(lo) + __builtin_fabs(hi)) + 0x1p-1070;
    for (int i = 0; i < 4; i++, slack *= 64) {
        double bound = wall + slack;
        if (!(bound < hi))
            return hi;
        if (incode_cell_along(lo, hi, g->cells[d], bound) > cell)
            return bound;
    }
    return hi;
}

bool incode_cells_word(const struct incode_grid *g, uint32_t base, uint32_t i,
                       uint32_t *word, uint32_t *missing) {
    uint32_t page = base + i / INCODE_PAGE_WORDS;
    const struct incode_frame *f = incode_pager_get(g->pager, page);
    *missing = page;
    if (f == NULL)
        return false;
    *word = f->page.words.word[i % INCODE_PAGE_WORDS];
    *word = *word == INCODE_NONE ? 0 : *word;
    return true;
}
