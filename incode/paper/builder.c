#include "builder.h"

#include <assert.h>
#include <string.h>

#include "incode/state.h"
#include "incode/predicates/check.h"

static_assert((int)INCODE_LISTS_MAX <= INCODE_SEARCHES, "a search for each");

static const char *const UNSOUND = "a list of no faces";

/* ---- memory ---- */

static size_t lent_bytes(uint32_t lists) {
    return incode_arena_aligned(lists * sizeof(struct incode_lent));
}

size_t incode_builder_min(uint32_t lists) {
    size_t bytes = incode_maker_bytes(&(struct incode_maker_share){
        INCODE_HORIZON_MIN, 16, INCODE_FRAMES_MIN});
    while (incode_arena_maker(bytes).frames < INCODE_FRAMES_MIN)
        bytes += 1024;
    return lent_bytes(lists) + incode_arena_aligned(bytes);
}

void incode_builder_init(struct incode_builder *b, void *memory, size_t bytes,
                         const struct incode_setup *setup, uint32_t lists,
                         const struct incode_page_source *source,
                         const struct incode_yield *yield) {
    INCODE_ASSERT(lists >= 1 && lists <= INCODE_LISTS_MAX);
    INCODE_ASSERT(bytes >= incode_builder_min(lists));
    size_t places = lent_bytes(lists);
    struct incode_maker_share share = incode_arena_maker(bytes - places);
    struct incode_points points = {.bricks = setup->bricks,
                                   .index = (enum incode_index)setup->index,
                                   .shuffle_seed = setup->shuffle_seed};
    memcpy(points.lo, setup->lo, sizeof points.lo);
    memcpy(points.hi, setup->hi, sizeof points.hi);
    memcpy(points.cells, setup->cells, sizeof points.cells);
    struct incode_yield began = *yield;
    memset(b, 0, sizeof *b);
    incode_yield_after(&began, INCODE_YIELD_UNITS);
    b->lent = memory;
    b->lists = lists;
    b->bytes = places + incode_maker_bytes(&share);
    for (uint32_t i = 0; i < lists; i++)
        b->lent[i].born = 0;
    incode_maker_init(&b->maker, (uint8_t *)memory + places, &share, &points,
                      source, &began);
}

/* ---- lists ---- */

static bool is_sound(const struct incode_builder *b,
                     const struct incode_list *list) {
    uint32_t bricks = b->maker.tree.bricks;
    bool sound = list->count >= 1 && list->count <= INCODE_LIST_MAX &&
                 list->kind >= INCODE_LIST_FACES &&
                 list->kind <= INCODE_LIST_COUNT;
    for (uint32_t i = 0; sound && i < list->count; i++) {
        const uint32_t *v = list->v[i];
        if (list->kind == INCODE_LIST_FACES)
            sound = v[0] / INCODE_BRICK_POINTS < bricks &&
                    v[1] / INCODE_BRICK_POINTS < bricks &&
                    v[2] / INCODE_BRICK_POINTS < bricks && v[0] != v[1] &&
                    v[0] != v[2] && v[1] != v[2];
        else if (list->kind == INCODE_LIST_FIRST)
            sound = v[0] / INCODE_BRICK_POINTS < bricks && list->count == 1;
        else
            sound = v[0] < bricks;
    }
    return sound;
}

bool incode_builder_take(struct incode_builder *b,
                         const struct incode_list *list) {
    struct incode_lent *lent = NULL;
    for (uint32_t i = 0; i < b->lists && lent == NULL; i++)
        lent = b->lent[i].born == 0 ? &b->lent[i] : NULL;
    if (lent == NULL)
        return false;
    if (!is_sound(b, list)) {
        b->fault = UNSOUND;
        return true;
    }
    memcpy(&lent->list, list, incode_list_bytes(list->count));
    lent->answers.kind = (uint16_t)list->kind;
    lent->answers.builder = b->number;
    lent->answers.count = list->count;
    for (uint32_t i = 0; i < list->count; i++) {
        memcpy(lent->answers.v[i], list->v[i], sizeof list->v[i]);
        lent->answers.v[i][3] = INCODE_NONE;
    }
    lent->born = ++b->clock;
    lent->done = lent->retries = 0;
    memset(lent->known, 0, sizeof lent->known);
    incode_maker_forget(&b->maker, (unsigned)(lent - b->lent));
    return true;
}

static bool is_complete(const struct incode_lent *lent) {
    return lent->born != 0 && lent->done == lent->list.count;
}

static struct incode_lent *oldest_complete(const struct incode_builder *b) {
    struct incode_lent *oldest = NULL;
    for (uint32_t i = 0; i < b->lists; i++)
        if (is_complete(&b->lent[i]) &&
            (oldest == NULL || b->lent[i].born < oldest->born))
            oldest = &b->lent[i];
    return oldest;
}

const struct incode_answers *
incode_builder_answers(const struct incode_builder *b) {
    const struct incode_lent *lent = oldest_complete(b);
    return lent == NULL ? NULL : &lent->answers;
}

void incode_builder_drop(struct incode_builder *b) {
    struct incode_lent *lent = oldest_complete(b);
    INCODE_ASSERT(lent != NULL);
    lent->born = 0;
}

uint32_t incode_builder_held(const struct incode_builder *b) {
    uint32_t held = 0;
    for (uint32_t i = 0; i < b->lists; i++)
        held += b->lent[i].born != 0;
    return held;
}

/* ---- faces ---- */

static bool has_vertex(const uint32_t t[4], uint32_t v) {
    return t[0] == v || t[1] == v || t[2] == v || t[3] == v;
}

/* All faces of a list were open at a time, so that those which have their
 * vertices of one tetrahedron have it on the same side: it is found once. */
static void share_apex(struct incode_lent *lent, const uint32_t t[4]) {
    for (uint32_t i = lent->done + 1; i < lent->list.count; i++) {
        const uint32_t *f = lent->list.v[i];
        if (has_vertex(t, f[0]) && has_vertex(t, f[1]) && has_vertex(t, f[2])) {
            for (int k = 0; k < 4; k++)
                if (t[k] != f[0] && t[k] != f[1] && t[k] != f[2])
                    lent->answers.v[i][3] = t[k];
            lent->known[i / 64] |= UINT64_C(1) << i % 64;
        }
    }
}

static enum incode_step answer_face(struct incode_builder *b,
                                    struct incode_lent *lent) {
    struct incode_answer a;
    uint32_t i = lent->done, done = 0;
    uint64_t before = b->maker.counts.candidates;
    if ((lent->known[i / 64] >> i % 64 & 1) != 0)
        return INCODE_FINISHED;
    enum incode_step r = incode_maker_apexes(
        &b->maker, (unsigned)(lent - b->lent),
        (const uint32_t(*)[3])lent->list.v + i, 1, &a, &done);
    uint64_t looked = b->maker.counts.candidates - before;
    incode_walker_spend(&b->maker.walker,
                        1 + (uint32_t)(looked / INCODE_BRICK_POINTS));
    if (r == INCODE_FINISHED) {
        memcpy(lent->answers.v[i], a.f, sizeof a.f);
        b->built += a.f[3] != INCODE_NONE;
        if (a.f[3] != INCODE_NONE)
            share_apex(lent, a.f);
    }
    return r;
}

static enum incode_step answer_first(struct incode_builder *b,
                                     struct incode_lent *lent) {
    struct incode_answer a;
    enum incode_step r = incode_maker_first(
        &b->maker, (unsigned)(lent - b->lent), lent->list.v[0][0], &a);
    incode_walker_spend(&b->maker.walker, 1);
    if (r == INCODE_FINISHED && b->maker.fault == NULL) {
        memcpy(lent->answers.v[0], a.f, sizeof a.f);
        b->built++;
    }
    return r;
}

static enum incode_step answer_count(struct incode_builder *b,
                                     struct incode_lent *lent) {
    uint32_t i = lent->done, brick = lent->list.v[i][0];
    uint32_t count = incode_maker_count(&b->maker, brick);
    const uint32_t answer[4] = {brick, count, 0, 0};
    incode_walker_spend(&b->maker.walker, 1);
    b->maker.search[lent - b->lent].page = brick;
    if (count == 0)
        return INCODE_WAITING;
    memcpy(lent->answers.v[i], answer, sizeof answer);
    return INCODE_FINISHED;
}

/* ---- steps ---- */

/* The list that goes on, the oldest first; NULL: none may. */
static struct incode_lent *choose(const struct incode_builder *b) {
    struct incode_lent *oldest = NULL, *ready = NULL;
    for (uint32_t i = 0; i < b->lists; i++) {
        struct incode_lent *lent = &b->lent[i];
        if (lent->born == 0 || is_complete(lent))
            continue;
        bool waits = lent->retries > 0 &&
                     incode_maker_waiting(&b->maker, UINT32_C(1) << i) != 0;
        if (oldest == NULL || lent->born < oldest->born)
            oldest = lent;
        if (!waits && (ready == NULL || lent->born < ready->born))
            ready = lent;
    }
    bool alone = oldest != NULL && oldest->retries > INCODE_LIST_PATIENCE;
    return alone && ready != oldest ? NULL : ready;
}

static enum incode_step go_on(struct incode_builder *b,
                              struct incode_lent *lent) {
    enum incode_step r = INCODE_FINISHED;
    while (r == INCODE_FINISHED && lent->done < lent->list.count &&
           b->maker.walker.left > 0 && b->maker.fault == NULL) {
        r = lent->list.kind == INCODE_LIST_FACES   ? answer_face(b, lent)
            : lent->list.kind == INCODE_LIST_FIRST ? answer_first(b, lent)
                                                   : answer_count(b, lent);
        lent->done += r == INCODE_FINISHED;
        lent->retries = r == INCODE_FINISHED ? 0 : lent->retries;
    }
    if (r != INCODE_WAITING)
        return INCODE_WORKED;
    unsigned slot = (unsigned)(lent - b->lent);
    b->faults += lent->retries == 0;
    lent->retries++;
    /* Without credit for its page it can only be tried again. */
    return incode_maker_waiting(&b->maker, UINT32_C(1) << slot) != 0
               ? INCODE_WORKED
               : INCODE_WAITING;
}

enum incode_step incode_builder_step(struct incode_builder *b, uint32_t units) {
    if (incode_builder_fault(b) != NULL)
        return INCODE_BROKEN;
    bool released = incode_pager_release(&b->maker.pager, false);
    struct incode_lent *lent = choose(b);
    units = units > 0 ? units : 1;
    b->maker.walker.left = units;
    enum incode_step r = lent == NULL ? INCODE_WAITING : go_on(b, lent);
    b->spent += 1 + (units - b->maker.walker.left);
    if (incode_builder_fault(b) != NULL)
        return INCODE_BROKEN;
    if (r == INCODE_WAITING &&
        (released || incode_pager_release(&b->maker.pager, true)))
        return INCODE_WORKED;
    return r;
}

/* ---- reports ---- */

const char *incode_builder_fault(const struct incode_builder *b) {
    return b->fault != NULL ? b->fault : b->maker.fault;
}

void incode_builder_statistics(const struct incode_builder *b,
                               struct incode_statistics *s) {
    const struct incode_maker *maker = &b->maker;
    const struct incode_pager *pager = &maker->pager;
    size_t unused =
        (pager->frame_count - pager->frames_used) * sizeof(struct incode_frame);
    *s = (struct incode_statistics){
        .tetrahedra_built = b->built,
        .make_tetra_calls = maker->counts.calls,
        .candidates = maker->counts.candidates,
        .tree_searches = maker->counts.tree_searches,
        .page_requests = pager->requests,
        .page_faults = b->faults,
        .page_evictions = pager->evictions,
        .memory_high_water = b->bytes - unused,
        .tally = {maker->counts.tally.exact_orient3d,
                  maker->counts.tally.exact_in_sphere}};
    memcpy(s->candidates_histogram, maker->counts.histogram,
           sizeof s->candidates_histogram);
}
