#include "state.h"

#include <string.h>

#include "incode/front/exchange.h"

static uint32_t between(size_t least, size_t a, size_t most) {
    return (uint32_t)(a < least ? least : a > most ? most : a);
}

/* The horizon of a maker: a box for 4 KB, a copy for 64 KB. */
static struct incode_maker_share horizon_of(size_t bytes) {
    size_t boxes = bytes >> 12, copies = bytes >> 16;
    return (struct incode_maker_share){
        between(INCODE_HORIZON_MIN, boxes / 64 * 64, INCODE_HORIZON_MAX),
        between(16, copies, INCODE_HORIZON_COPIES), 0};
}

struct incode_maker_share incode_arena_maker(size_t bytes) {
    struct incode_maker_share share = horizon_of(bytes);
    share.frames = incode_maker_frames(&share, bytes);
    return share;
}

size_t incode_arena_bits(const struct incode_setup *setup, size_t bytes) {
    size_t bits = ((size_t)setup->bricks + 63) / 64 * sizeof(uint64_t);
    if (setup->owner_rule == INCODE_OWNER_LOWEST)
        return incode_exchange_bytes(setup->bricks);
    return bits <= bytes / 64 ? bits : 0;
}

/* Divides the memory beside the control block into faces, bricks and frames;
 * false: too little of it is left for frames. */
static bool divide_rest(struct incode_shares *s, struct incode_map *map,
                        size_t bytes, size_t faces, size_t entries) {
    size_t horizon = incode_horizon_bytes(s->maker.boxes, s->maker.copies);
    map->afl_faces = faces;
    map->brick_entries = entries;
    s->front = (struct incode_front_share){(uint32_t)faces, (uint32_t)entries};
    size_t both = incode_front_bytes(&s->front);
    map->bricks = entries * (sizeof(struct incode_touched) + sizeof(uint32_t));
    map->afl = both - map->bricks;
    size_t used = map->control + incode_arena_aligned(both);
    if (bytes < used)
        return false;
    s->maker.frames = incode_maker_frames(&s->maker, bytes - used + horizon);
    map->frame_count = s->maker.frames;
    map->frames = incode_maker_bytes(&s->maker) - horizon;
    map->total = used + map->frames;
    return map->frame_count >= INCODE_FRAMES_MIN;
}

/* The active face list takes three eighths of what the control block leaves
 * (the front of a region of 1,250,000 points, with a tenth to spare), the
 * bricks a sixteenth, page frames the rest.  If not all pages have a frame,
 * a small set gets a shorter list, of at least a third of a face a point, and
 * no more entries than its bricks take with the free part that they need. */
bool incode_arena_divide(struct incode_shares *s, struct incode_map *map,
                         const struct incode_setup *setup, size_t bytes) {
    memset(map, 0, sizeof *map);
    s->maker = horizon_of(bytes);
    map->control = incode_arena_aligned(sizeof(struct incode_triangulator) +
                                        incode_arena_bits(setup, bytes)) +
                   incode_horizon_bytes(s->maker.boxes, s->maker.copies);
    map->local_points = sizeof(struct incode_local_points);
    map->tasks = (sizeof(struct incode_task) + sizeof(struct incode_search)) *
                 INCODE_TASKS;
    if (bytes < map->control)
        return false;
    size_t rest = bytes - map->control, bricks = setup->bricks;
    size_t face = sizeof(struct incode_afl_node) + sizeof(uint32_t);
    size_t brick = sizeof(struct incode_touched) + sizeof(uint32_t);
    size_t faces = between(INCODE_FACES_MIN, rest * 3 / 8 / face, UINT32_MAX);
    size_t entries = between(INCODE_ENTRIES_MIN, rest / 16 / brick, UINT32_MAX);
    bool fits = divide_rest(s, map, bytes, faces, entries);
    if (map->frame_count > bricks + bricks / 16)
        return fits;
    size_t least = bricks * INCODE_BRICK_POINTS / 3;
    size_t all = incode_front_entries(setup->bricks);
    faces = between(INCODE_FACES_MIN, least, faces);
    entries = entries < all ? entries : all;
    return divide_rest(s, map, bytes, faces, entries);
}

size_t incode_arena_min(const struct incode_setup *setup) {
    size_t bytes = sizeof(struct incode_triangulator);
    struct incode_map map;
    struct incode_shares shares;
    while (!incode_arena_divide(&shares, &map, setup, bytes))
        bytes += 1024;
    return bytes;
}

enum { ROOMY = 8 << 20 /* bytes of an arena */ };

/* The maker's share point by point, where few bricks are wanted at a time, but
 * all pages of boxes again and again: as many as go into a part of the arena.
 * A large one has room for bricks around the own ones, too, which are wanted
 * twice at the end. */
static struct incode_maker_share
few_frames(const struct incode_triangulator *t) {
    struct incode_maker_share share = t->shares.maker;
    const struct incode_tree *tree = &t->maker.tree;
    size_t boxes = tree->base[tree->levels] - tree->bricks;
    size_t part = t->bytes / 16 / sizeof(struct incode_frame);
    size_t frames = INCODE_FRAMES_MIN + (boxes < part ? boxes : part);
    if (t->bytes > ROOMY)
        frames += (t->bytes - ROOMY) / 8 / sizeof(struct incode_frame);
    share.frames = between(INCODE_FRAMES_MIN, frames, t->shares.maker.frames);
    return share;
}

size_t incode_arena_room(const struct incode_triangulator *t) {
    struct incode_maker_share few = few_frames(t);
    size_t maker = incode_maker_bytes(&few);
    return t->bytes > maker ? t->bytes - maker : 0;
}

/* Bytes of the arena in use up to now, as it is divided. */
static size_t in_use(const struct incode_triangulator *t) {
    size_t unused = (t->maker.pager.frame_count - t->maker.pager.frames_used) *
                    sizeof(struct incode_frame);
    struct incode_maker_share few = few_frames(t);
    if (!t->by_points)
        return t->map.total - unused;
    return incode_arena_aligned(sizeof *t) + incode_maker_bytes(&few) - unused +
           t->insertion.used;
}

size_t incode_arena_high_water(const struct incode_triangulator *t) {
    size_t now = in_use(t);
    return now > t->high_water ? now : t->high_water;
}

bool incode_arena_turn(struct incode_triangulator *t, bool points) {
    struct incode_maker_share share = points ? few_frames(t) : t->shares.maker;
    size_t maker = incode_maker_bytes(&share);
    if (t->by_points != points && t->maker.pager.loading > 0)
        return false;
    if (t->by_points != points) {
        if (t->has_worked)
            t->high_water = incode_arena_high_water(t);
        incode_maker_move(&t->maker, t->arena, &share);
    }
    t->by_points = points;
    t->has_worked = true;
    if (points)
        incode_insertion_start(&t->insertion, t->committed, t->arena + maker,
                               t->bytes - maker, t->job.first, t->job.last);
    else
        incode_front_move(&t->front, t->arena + maker, &t->shares.front);
    return true;
}
