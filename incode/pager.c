#include "pager.h"

#include <string.h>

#include "check.h"

static uint32_t hash_size(uint32_t frames)
{
    uint32_t size = 64;
    while (size < 2 * frames)
        size *= 2;
    return size;
}

size_t incode_pager_bytes(uint32_t frames)
{
    size_t heads = hash_size(frames) * sizeof(uint16_t);
    return frames * sizeof(struct incode_frame) + heads;
}

void incode_pager_init(struct incode_pager *pager, void *memory,
                       uint32_t frames, uint32_t bricks)
{
    INCODE_ASSERT(frames >= 1 && frames < INCODE_NO_FRAME);
    memset(pager, 0, sizeof *pager);
    pager->frames = memory;
    pager->heads = (uint16_t *)(void *)(pager->frames + frames);
    pager->frame_count = frames;
    pager->hash_mask = hash_size(frames) - 1;
    pager->loading_max = frames / 4 < 1 ? 1 : frames / 4;
    pager->bricks = bricks;
    pager->newest = pager->oldest = INCODE_NO_FRAME;
    pager->free = 0;
    for (uint32_t i = 0; i <= pager->hash_mask; i++)
        pager->heads[i] = INCODE_NO_FRAME;
}

static uint16_t *head_of(const struct incode_pager *pager, uint32_t page)
{
    return &pager
                ->heads[(page * UINT32_C(2654435761) >> 12) & pager->hash_mask];
}

static uint16_t find(const struct incode_pager *pager, uint32_t page)
{
    uint16_t i = *head_of(pager, page);
    while (i != INCODE_NO_FRAME && pager->frames[i].number != page)
        i = pager->frames[i].chain;
    return i;
}

static void ring_remove(struct incode_pager *pager, uint16_t i)
{
    const struct incode_frame *f = &pager->frames[i];
    if (f->newer == INCODE_NO_FRAME)
        pager->newest = f->older;
    else
        pager->frames[f->newer].older = f->older;
    if (f->older == INCODE_NO_FRAME)
        pager->oldest = f->newer;
    else
        pager->frames[f->older].newer = f->newer;
}

static void ring_push(struct incode_pager *pager, uint16_t i)
{
    struct incode_frame *f = &pager->frames[i];
    f->newer = INCODE_NO_FRAME;
    f->older = pager->newest;
    if (pager->newest == INCODE_NO_FRAME)
        pager->oldest = i;
    else
        pager->frames[pager->newest].newer = i;
    pager->newest = i;
}

static void unchain(struct incode_pager *pager, uint16_t i)
{
    uint16_t *link = head_of(pager, pager->frames[i].number);
    while (*link != i)
        link = &pager->frames[*link].chain;
    *link = pager->frames[i].chain;
}

/* A frame to load into: never used, or the least recently used that is not
 * waiting for its page. */
static uint16_t take_frame(struct incode_pager *pager)
{
    if (pager->free < pager->frame_count) {
        pager->frames_used++;
        return pager->free++;
    }
    uint16_t i = pager->oldest;
    while (i != INCODE_NO_FRAME && pager->frames[i].state != INCODE_FRAME_READY)
        i = pager->frames[i].newer;
    if (i == INCODE_NO_FRAME)
        return i;
    ring_remove(pager, i);
    unchain(pager, i);
    pager->evictions++;
    return i;
}

static void ask(struct incode_pager *pager, uint32_t page)
{
    if (pager->loading + pager->held >= pager->loading_max ||
        !pager->request(pager->context, page))
        return;
    uint16_t i = take_frame(pager);
    INCODE_ASSERT(i != INCODE_NO_FRAME);
    struct incode_frame *f = &pager->frames[i];
    f->number = page;
    f->state = INCODE_FRAME_LOADING;
    uint16_t *head = head_of(pager, page);
    f->chain = *head;
    *head = i;
    ring_push(pager, i);
    pager->loading++;
    pager->requests++;
}

struct incode_frame *incode_pager_get(struct incode_pager *pager, uint32_t page)
{
    uint16_t i = find(pager, page);
    if (i == INCODE_NO_FRAME) {
        ask(pager, page);
        return NULL;
    }
    struct incode_frame *f = &pager->frames[i];
    if (pager->newest != i) {
        ring_remove(pager, i);
        ring_push(pager, i);
    }
    return f->state == INCODE_FRAME_READY ? f : NULL;
}

bool incode_pager_loading(const struct incode_pager *pager, uint32_t page)
{
    uint16_t i = find(pager, page);
    return i != INCODE_NO_FRAME && pager->frames[i].state != INCODE_FRAME_READY;
}

static void leaf_boxes(struct incode_frame *f)
{
    const double *axis[3] = {f->page.brick.x, f->page.brick.y, f->page.brick.z};
    for (int d = 0; d < 3; d++) {
        for (int leaf = 0; leaf < INCODE_BRICK_LEAVES; leaf++) {
            int first = leaf * INCODE_LEAF_POINTS;
            double lo = __builtin_inf(), hi = -__builtin_inf();
            for (int i = first; i < first + INCODE_LEAF_POINTS; i++) {
                if (i >= f->count)
                    break;
                double a = axis[d][i];
                lo = a < lo ? a : lo;
                hi = a > hi ? a : hi;
            }
            f->leaf_lo[d][leaf] = lo;
            f->leaf_hi[d][leaf] = hi;
        }
    }
}

static void load_brick(struct incode_frame *f, const uint8_t *data,
                       size_t points)
{
    double *axis[3] = {f->page.brick.x, f->page.brick.y, f->page.brick.z};
    for (int d = 0; d < 3; d++) {
        memcpy(axis[d], data + (size_t)d * points * sizeof(double),
               points * sizeof(double));
        for (size_t i = points; i < INCODE_BRICK_POINTS; i++)
            axis[d][i] = axis[d][points - 1];
    }
    f->count = (uint8_t)points;
    leaf_boxes(f);
}

int incode_pager_deliver(struct incode_pager *pager, uint32_t page,
                         const void *data, size_t bytes)
{
    uint16_t i = find(pager, page);
    if (i == INCODE_NO_FRAME || pager->frames[i].state != INCODE_FRAME_LOADING)
        return -1;
    struct incode_frame *f = &pager->frames[i];
    if (page < pager->bricks) {
        size_t points = bytes / (3 * sizeof(double));
        if (points < 1 || points > INCODE_BRICK_POINTS ||
            points * 3 * sizeof(double) != bytes)
            return -1;
        load_brick(f, data, points);
    } else {
        if (bytes != INCODE_PAGE_BYTES)
            return -1;
        memcpy(&f->page, data, bytes);
        f->count = 0;
    }
    pager->loading--;
    f->state = INCODE_FRAME_READY;
    if (pager->shuffle != 0) {
        f->state = INCODE_FRAME_HELD;
        pager->held++;
    }
    return 0;
}

bool incode_pager_release(struct incode_pager *pager, bool now)
{
    if (pager->held == 0)
        return false;
    pager->shuffle ^= pager->shuffle << 13;
    pager->shuffle ^= pager->shuffle >> 7;
    pager->shuffle ^= pager->shuffle << 17;
    if (!now && (pager->shuffle >> 60 & 3) != 0)
        return false;
    uint32_t pick = (uint32_t)(pager->shuffle % pager->held);
    for (uint16_t i = pager->newest; i != INCODE_NO_FRAME;
         i = pager->frames[i].older) {
        if (pager->frames[i].state != INCODE_FRAME_HELD || pick-- > 0)
            continue;
        pager->frames[i].state = INCODE_FRAME_READY;
        pager->held--;
        return true;
    }
    return false;
}
