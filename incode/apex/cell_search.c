#include "cell_search.h"

#include <stdalign.h>
#include <string.h>

#include "incode/predicates/check.h"

/* ---- where cells lie ---- */

struct range {
    uint32_t first, last;
};

/* The cells of dimension d within `reach` of the centre. */
static struct range range_of(const struct incode_cell_search *c,
                             const struct incode_grid *g, int d,
                             uint32_t reach) {
    uint32_t at = c->centre[d], last = g->cells[d] - 1;
    return (struct range){at > reach ? at - reach : 0,
                          last - at > reach ? at + reach : last};
}

/* Boxes as the query wants them: eight at once. */
struct lane_boxes {
    alignas(64) double lo[3][8];
    alignas(64) double hi[3][8];
};

static uint32_t passing(const struct incode_query *q,
                        const struct lane_boxes *boxes, unsigned count) {
    const double *const lo[3] = {boxes->lo[0], boxes->lo[1], boxes->lo[2]};
    const double *const hi[3] = {boxes->hi[0], boxes->hi[1], boxes->hi[2]};
    return incode_query_boxes(q, lo, hi, count);
}

static void set_range(struct lane_boxes *boxes, const struct incode_grid *g,
                      int d, struct range range) {
    boxes->lo[d][0] = incode_cells_lowest(g, d, range.first);
    boxes->hi[d][0] = incode_cells_highest(g, d, range.last);
}

/* Whether the question still concerns what lies beyond `reach`: six slabs of
 * the whole box, one beyond each side. */
static bool more_beyond(const struct incode_cell_search *c,
                        const struct incode_grid *g,
                        const struct incode_query *q) {
    struct lane_boxes boxes;
    unsigned count = 0;
    memset(&boxes, 0, sizeof boxes);
    for (int d = 0; d < 3; d++) {
        struct range range = range_of(c, g, d, c->reach);
        for (int side = 0; side < 2; side++) {
            if (side == 0 ? range.first == 0 : range.last + 1 == g->cells[d])
                continue;
            for (int e = 0; e < 3; e++) {
                boxes.lo[e][count] = g->lo[e];
                boxes.hi[e][count] = g->hi[e];
            }
            if (side == 0)
                boxes.hi[d][count] =
                    incode_cells_highest(g, d, range.first - 1);
            else
                boxes.lo[d][count] = incode_cells_lowest(g, d, range.last + 1);
            count++;
        }
    }
    return count > 0 && passing(q, &boxes, count) != 0;
}

/* ---- points ---- */

enum {
    LANES = 8,
    ASK_AHEAD = 16,
    BATCH_UNITS = 8 /* of incode/predicates/pause.h */
};

struct batch {
    alignas(64) double p[3][LANES];
    uint32_t id[LANES];
    unsigned count;
};

/* Vertex i of the list; false: page *missing is. */
static bool listed(const struct incode_grid *g, uint32_t i, uint32_t *id,
                   uint32_t *missing) {
    if (!incode_cells_word(g, g->tree->list_base, i, id, missing))
        return false;
    /* What a page may hold at most is one too many for a vertex. */
    *id = *id / INCODE_BRICK_POINTS < g->tree->bricks ? *id : 0;
    return true;
}

/* Up to 8 points of the list from c->list on; false: a page is missing after
 * those. */
static bool fill_batch(const struct incode_cell_search *c,
                       const struct incode_grid *g, struct batch *batch,
                       uint32_t *missing) {
    const struct incode_frame *f = NULL;
    uint32_t brick = INCODE_NONE;
    memset(batch->p, 0, sizeof batch->p);
    batch->count = 0;
    while (batch->count < LANES && c->list + batch->count < c->end) {
        uint32_t id;
        if (!listed(g, c->list + batch->count, &id, missing))
            return false;
        if (f == NULL || id / INCODE_BRICK_POINTS != brick) {
            brick = id / INCODE_BRICK_POINTS;
            f = incode_pager_get(g->pager, brick);
            *missing = brick;
            if (f == NULL)
                return false;
        }
        uint32_t slot = id % INCODE_BRICK_POINTS;
        batch->p[0][batch->count] = f->page.brick.x[slot];
        batch->p[1][batch->count] = f->page.brick.y[slot];
        batch->p[2][batch->count] = f->page.brick.z[slot];
        batch->id[batch->count++] = id;
    }
    return true;
}

static void look_at(struct incode_cell_search *c, struct incode_walker *walker,
                    struct incode_query *q, const struct batch *batch) {
    struct incode_tally *tally = walker->tally;
    const double *const axis[3] = {batch->p[0], batch->p[1], batch->p[2]};
    uint32_t lanes = incode_query_lanes(q, axis);
    *walker->candidates += batch->count;
    for (unsigned i = 0; i < batch->count; i++) {
        uint32_t id = batch->id[i];
        bool maybe = (lanes >> i & 1) != 0;
        if ((!maybe && c->has_below) || id == q->v || id == q->b ||
            id == q->c || id == q->best)
            continue;
        const double p[3] = {axis[0][i], axis[1][i], axis[2][i]};
        if (maybe) {
            incode_query_consider(q, tally, id, p);
        } else if (incode_orient3d(tally, q->pv, q->pb, q->pc, p) < 0) {
            c->has_below = true;
            memcpy(c->below, p, sizeof p);
        }
    }
}

/* Asks for the bricks of the next points, which will be missing, too. */
static void ask_ahead(const struct incode_cell_search *c,
                      const struct incode_grid *g) {
    uint32_t id, page;
    for (uint32_t i = c->list; i < c->end && i < c->list + ASK_AHEAD; i++) {
        if (!listed(g, i, &id, &page))
            return;
        (void)incode_pager_get(g->pager, id / INCODE_BRICK_POINTS);
    }
}

/* Rows and points that a call may look at. */
static uint32_t work_of(const struct incode_walker *walker) {
    const uint32_t most = INCODE_CELL_SEARCH_WORK / INCODE_CELL_SEARCH_UNIT;
    uint32_t units = walker->left < most ? walker->left : most;
    return units == 0 ? 1 : units * INCODE_CELL_SEARCH_UNIT;
}

/* The rest of the piece at work. */
static enum incode_walk finish_piece(struct incode_cell_search *c,
                                     const struct incode_grid *g,
                                     struct incode_walker *walker,
                                     struct incode_query *q, uint32_t *work) {
    while (c->list < c->end) {
        struct batch batch;
        incode_walker_breathe(walker, BATCH_UNITS);
        bool all = fill_batch(c, g, &batch, &q->missing);
        if (batch.count > 0)
            look_at(c, walker, q, &batch);
        c->list += batch.count;
        if (!all) {
            ask_ahead(c, g);
            return INCODE_WALK_WAIT;
        }
        *work += batch.count;
        if (*work >= work_of(walker))
            return INCODE_WALK_STOP;
    }
    return INCODE_WALK_DONE;
}

/* ---- shells ---- */

/* Layers or rows from first to end that have been tested, one bit each. */
struct tested {
    uint32_t first, end, mask;
};

struct shell {
    struct range outer[3], inner[3];
    double lo[3], hi[3];        /* of outer, in coordinates */
    struct lane_boxes box;      /* the first lane: of a piece */
    struct tested rows, layers; /* rows: of this layer */
    uint32_t work;
};

static bool is_within(struct range range, uint32_t i) {
    return i >= range.first && i <= range.last;
}

/* Takes the next piece of the row, from c->x on, as far as the question
 * concerns it; INCODE_WALK_STOP: none is left. */
static enum incode_walk next_piece(struct incode_cell_search *c,
                                   const struct incode_grid *g,
                                   const struct incode_walker *walker,
                                   struct incode_query *q, struct shell *s) {
    bool crosses = c->any_done && is_within(s->inner[1], c->y) &&
                   is_within(s->inner[2], c->z);
    uint32_t row = (c->z * g->cells[1] + c->y) * g->cells[0];
    uint32_t base = g->tree->cells_base;
    while (c->x <= s->outer[0].last) {
        uint32_t last = s->outer[0].last;
        if (crosses && is_within(s->inner[0], c->x)) {
            c->x = s->inner[0].last + 1;
            continue;
        }
        if (crosses && c->x < s->inner[0].first)
            last = s->inner[0].first - 1;
        bool whole = c->x == s->outer[0].first && last == s->outer[0].last;
        for (;; whole = false) {
            set_range(&s->box, g, 0, (struct range){c->x, last});
            s->work++;
            incode_walker_breathe(walker, BATCH_UNITS);
            if (!whole && passing(q, &s->box, 1) == 0)
                break;
            uint32_t from, to;
            if (!incode_cells_word(g, base, row + c->x, &from, &q->missing) ||
                !incode_cells_word(g, base, row + last + 1, &to, &q->missing))
                return INCODE_WALK_WAIT;
            if (to - from > INCODE_CELL_SEARCH_PIECE && last > c->x) {
                last = c->x + (last - c->x) / 2;
                continue;
            }
            c->list = from;
            c->end = to;
            break;
        }
        c->x = last + 1;
        if (c->list < c->end)
            return INCODE_WALK_DONE;
    }
    return INCODE_WALK_STOP;
}

/* Whether the question concerns layer or row i (d: 2 or 1) of the shell; eight
 * are tested at once, and what is found later can only leave fewer. */
static bool passes(const struct incode_grid *g,
                   const struct incode_walker *walker,
                   const struct incode_query *q, struct shell *s,
                   struct tested *tested, int d, uint32_t i) {
    if (i >= tested->first && i < tested->end)
        return (tested->mask >> (i - tested->first) & 1) != 0;
    struct lane_boxes boxes;
    uint32_t left = s->outer[d].last - i + 1;
    uint32_t count = left < LANES ? left : LANES;
    for (uint32_t k = 0; k < LANES; k++) {
        for (int e = 0; e < 3; e++) {
            boxes.lo[e][k] = e > d ? s->box.lo[e][0] : s->lo[e];
            boxes.hi[e][k] = e > d ? s->box.hi[e][0] : s->hi[e];
        }
        uint32_t at = i + (k < count ? k : 0);
        boxes.lo[d][k] = incode_cells_lowest(g, d, at);
        boxes.hi[d][k] = incode_cells_highest(g, d, at);
    }
    tested->first = i;
    tested->end = i + count;
    incode_walker_breathe(walker, BATCH_UNITS);
    tested->mask = passing(q, &boxes, count);
    s->work++;
    return (tested->mask & 1) != 0;
}

static enum incode_walk run_row(struct incode_cell_search *c,
                                const struct incode_grid *g,
                                struct incode_walker *walker,
                                struct incode_query *q, struct shell *s) {
    if (c->x == s->outer[0].first &&
        !passes(g, walker, q, s, &s->rows, 1, c->y))
        return INCODE_WALK_DONE;
    set_range(&s->box, g, 1, (struct range){c->y, c->y});
    for (;;) {
        enum incode_walk r = next_piece(c, g, walker, q, s);
        if (r == INCODE_WALK_STOP)
            return INCODE_WALK_DONE;
        if (r == INCODE_WALK_DONE)
            r = finish_piece(c, g, walker, q, &s->work);
        if (r != INCODE_WALK_DONE)
            return r;
    }
}

/* One layer of cells from row c->y on. */
static enum incode_walk run_layer(struct incode_cell_search *c,
                                  const struct incode_grid *g,
                                  struct incode_walker *walker,
                                  struct incode_query *q, struct shell *s) {
    if (c->y == s->outer[1].first && c->x == s->outer[0].first &&
        !passes(g, walker, q, s, &s->layers, 2, c->z))
        return INCODE_WALK_DONE;
    set_range(&s->box, g, 2, (struct range){c->z, c->z});
    s->rows.end = 0;
    for (; c->y <= s->outer[1].last; c->y++) {
        incode_walker_breathe(walker, 1);
        enum incode_walk r = run_row(c, g, walker, q, s);
        if (r == INCODE_WALK_DONE && s->work >= work_of(walker))
            r = INCODE_WALK_STOP;
        if (r != INCODE_WALK_DONE)
            return r;
        c->x = s->outer[0].first;
    }
    return INCODE_WALK_DONE;
}

static enum incode_walk run_shell(struct incode_cell_search *c,
                                  const struct incode_grid *g,
                                  struct incode_walker *walker,
                                  struct incode_query *q) {
    struct shell s;
    memset(&s, 0, sizeof s);
    for (int d = 0; d < 3; d++) {
        s.outer[d] = range_of(c, g, d, c->reach);
        s.inner[d] = range_of(c, g, d, c->done);
        s.lo[d] = incode_cells_lowest(g, d, s.outer[d].first);
        s.hi[d] = incode_cells_highest(g, d, s.outer[d].last);
    }
    enum incode_walk r = finish_piece(c, g, walker, q, &s.work);
    for (; r == INCODE_WALK_DONE && c->z <= s.outer[2].last; c->z++) {
        incode_walker_breathe(walker, 1);
        r = run_layer(c, g, walker, q, &s);
        if (r != INCODE_WALK_DONE)
            break;
        c->y = s.outer[1].first;
        c->x = s.outer[0].first;
    }
    incode_walker_spend(walker, 1 + s.work / INCODE_CELL_SEARCH_UNIT);
    return r;
}

static void start_shell(struct incode_cell_search *c,
                        const struct incode_grid *g) {
    c->x = range_of(c, g, 0, c->reach).first;
    c->y = range_of(c, g, 1, c->reach).first;
    c->z = range_of(c, g, 2, c->reach).first;
    c->list = c->end = 0;
}

void incode_cell_search_begin(struct incode_cell_search *c,
                              const struct incode_grid *grid,
                              const struct incode_query *q) {
    memset(c, 0, sizeof *c);
    for (int d = 0; d < 3; d++) {
        double middle = q->pv[d] / 3 + q->pb[d] / 3 + q->pc[d] / 3;
        c->centre[d] =
            incode_cell_along(grid->lo[d], grid->hi[d], grid->cells[d], middle);
    }
    c->reach = 1;
    start_shell(c, grid);
}

enum incode_walk incode_cell_search_run(struct incode_cell_search *c,
                                        const struct incode_grid *grid,
                                        struct incode_walker *walker,
                                        struct incode_query *q) {
    enum incode_walk r = run_shell(c, grid, walker, q);
    if (r != INCODE_WALK_DONE || !more_beyond(c, grid, q))
        return r;
    INCODE_ASSERT(c->reach < UINT32_C(1) << 30);
    c->any_done = true;
    c->done = c->reach;
    c->reach *= 2;
    start_shell(c, grid);
    return INCODE_WALK_STOP;
}
