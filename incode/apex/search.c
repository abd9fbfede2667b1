#include "search.h"

#include <float.h>
#include <stdalign.h>
#include <string.h>

#include "query.h"
#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

bool incode_fetch_point(struct incode_maker *m, uint32_t v, double p[3],
                        uint32_t *page) {
    uint32_t brick = v / INCODE_BRICK_POINTS, slot = v % INCODE_BRICK_POINTS;
    const struct incode_frame *f = incode_pager_get(&m->pager, brick);
    *page = brick;
    if (f == NULL)
        return false;
    if (slot >= f->count) {
        m->fault = INCODE_NO_VERTEX;
        return false;
    }
    p[0] = f->page.brick.x[slot];
    p[1] = f->page.brick.y[slot];
    p[2] = f->page.brick.z[slot];
    return true;
}

/* ---- hull planes ---- */

bool incode_hull_known(struct incode_maker *m, const double pv[3],
                       const double pb[3], const double pc[3]) {
    struct incode_tally *tally = &m->counts.tally;
    for (uint32_t i = 0; i < m->plane_count; i++) {
        const struct incode_hull_plane *h = &m->planes[i];
        const double *a = h->p[0], *b = h->p[1], *c = h->p[2];
        incode_yield_after(&tally->yield, 2);
        if (incode_orient3d(tally, a, b, c, pv) == 0 &&
            incode_orient3d(tally, a, b, c, pb) == 0 &&
            incode_orient3d(tally, a, b, c, pc) == 0)
            return incode_orient3d(tally, pv, pb, pc, h->below) < 0;
    }
    return false;
}

void incode_hull_remember(struct incode_maker *m, const struct incode_query *q,
                          const double below[3]) {
    struct incode_hull_plane *h = &m->planes[m->plane_next];
    memcpy(h->p[0], q->pv, sizeof q->pv);
    memcpy(h->p[1], q->pb, sizeof q->pb);
    memcpy(h->p[2], q->pc, sizeof q->pc);
    memcpy(h->below, below, sizeof h->below);
    m->plane_next = (m->plane_next + 1) % INCODE_HULL_PLANES;
    if (m->plane_count < INCODE_HULL_PLANES)
        m->plane_count++;
}

/* The length of an edge off its first vertex, against the normal's largest
 * component; where the normal is not known, along any axis. */
void incode_hull_learn(struct incode_maker *m, const struct incode_query *q) {
    const double *n = q->sphere.n;
    double side = 1 / q->scale;
    unsigned largest = 0;
    for (unsigned d = 1; d < 3; d++)
        if (__builtin_fabs(n[d]) > __builtin_fabs(n[largest]))
            largest = d;
    for (unsigned i = 0; i < 6; i++) {
        unsigned d = (largest + i / 2) % 3;
        double below[3] = {q->pv[0], q->pv[1], q->pv[2]};
        below[d] += (n[d] > 0) == (i % 2 == 0) ? -side : side;
        incode_maker_yield(m, 1);
        if (__builtin_fabs(below[d]) <= DBL_MAX &&
            incode_orient3d(&m->counts.tally, q->pv, q->pb, q->pc, below) < 0) {
            incode_hull_remember(m, q, below);
            return;
        }
    }
}

/* ---- the search of the whole set ---- */

/* Begins a walk.  Where pages are replaced, one walk goes up and the next down:
 * it begins with the pages that the last walk used last.  Walks in one
 * direction would find each page evicted just before they come to it. */
static void begin_walk(struct incode_maker *m, struct incode_query *q) {
    m->walks_down = !m->walks_down && !incode_pager_has_free(&m->pager);
    q->down = m->walks_down;
    q->cursor = 0;
}

/* The box of the next look: only points that are clearly beyond the face count
 * there, so that those in its plane need not be told apart in vain. */
void incode_search_box(struct incode_maker *m, struct incode_search *s) {
    struct incode_query *q = &s->query;
    bool all = true;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = q->pv[d] - s->radius;
        q->hi[d] = q->pv[d] + s->radius;
        all = all && q->lo[d] <= m->lo[d] && q->hi[d] >= m->hi[d];
    }
    q->boxed = !all;
    q->strictly_beyond = !s->degenerate;
    begin_walk(m, q);
}

void incode_search_last(struct incode_maker *m, struct incode_search *s) {
    struct incode_query *q = &s->query;
    s->final = true;
    q->done = q->strictly_beyond = false;
    begin_walk(m, q);
    incode_query_shrink(q);
}

void incode_search_begin(struct incode_maker *m, struct incode_search *s,
                         const uint32_t f[3], const double pv[3],
                         const double pb[3], const double pc[3],
                         double radius) {
    struct incode_query *q = &s->query;
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_APEX;
    q->v = f[0];
    q->b = f[1];
    q->c = f[2];
    memcpy(q->pv, pv, sizeof q->pv);
    memcpy(q->pb, pb, sizeof q->pb);
    memcpy(q->pc, pc, sizeof q->pc);
    q->best = INCODE_NONE;
    incode_query_face(q);
    /* A radius that vanished among denormals could not grow again. */
    s->radius = radius > DBL_MIN ? radius : DBL_MIN;
    s->final = s->degenerate = false;
    s->looked = 0;
    incode_search_box(m, s);
}

void incode_count_candidates(struct incode_maker *m, uint64_t looked) {
    uint64_t n = looked < 2 ? 2 : looked;
    uint32_t octave = 63 - (uint32_t)__builtin_clzll(n);
    uint32_t half = 2 * octave + (uint32_t)(n >> (octave - 1) & 1);
    uint32_t last =
        sizeof m->counts.histogram / sizeof m->counts.histogram[0] - 1;
    m->counts.histogram[half < last ? half : last]++;
}

enum { MANY = 1024 /* points */ };

void incode_search_learn(struct incode_maker *m, const struct incode_query *q,
                         uint64_t looked) {
    const double *const p[4] = {q->pv, q->pb, q->pc, q->best_p};
    if (q->best != INCODE_NONE && looked >= MANY)
        incode_empty_spheres_add(&m->empty, p, q->scale);
}

enum incode_step incode_search_suspend(struct incode_search *s) {
    s->page = s->query.missing;
    s->advanced = s->page == INCODE_NONE;
    return s->advanced ? INCODE_WORKED : INCODE_WAITING;
}

enum incode_step incode_search_run(struct incode_maker *m,
                                   struct incode_search *s) {
    struct incode_query *q = &s->query;
    for (;;) {
        uint64_t before = m->counts.candidates;
        q->yields = true;
        enum incode_step r =
            incode_walk(&m->walker, q, incode_visit_points, NULL);
        s->looked += m->counts.candidates - before;
        if (r == INCODE_WAITING)
            return incode_search_suspend(s);
        if (q->question == INCODE_QUERY_HALF_SPACE) {
            m->half_spaces[m->half_space_next] = q->half_space;
            m->half_space_next = (m->half_space_next + 1) % INCODE_HALF_SPACES;
            if (m->half_space_count < INCODE_HALF_SPACES)
                m->half_space_count++;
            return INCODE_FINISHED;
        }
        if (s->final) {
            incode_count_candidates(m, s->looked);
            if (q->best == INCODE_NONE)
                incode_hull_learn(m, q);
            return INCODE_FINISHED;
        }
        if (q->best != INCODE_NONE || !q->boxed) {
            incode_maker_yield(m, INCODE_LESSEN_UNITS);
            incode_search_last(m, s);
            continue;
        }
        q->done = true;
        memcpy(q->done_lo, q->lo, sizeof q->lo);
        memcpy(q->done_hi, q->hi, sizeof q->hi);
        s->radius *= s->degenerate ? 2 : 4;
        incode_search_box(m, s);
    }
}

/* --- cell search ---------------------------------------------------------- */

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
    BATCH_UNITS = 8 /* of incode/predicates/yield.h */
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
static enum incode_step finish_piece(struct incode_cell_search *c,
                                     const struct incode_grid *g,
                                     struct incode_walker *walker,
                                     struct incode_query *q, uint32_t *work) {
    while (c->list < c->end) {
        struct batch batch;
        incode_walker_yield(walker, BATCH_UNITS);
        bool all = fill_batch(c, g, &batch, &q->missing);
        if (batch.count > 0)
            look_at(c, walker, q, &batch);
        c->list += batch.count;
        if (!all) {
            ask_ahead(c, g);
            return INCODE_WAITING;
        }
        *work += batch.count;
        if (*work >= work_of(walker))
            return INCODE_WORKED;
    }
    return INCODE_FINISHED;
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
 * concerns it; INCODE_WORKED: none is left. */
static enum incode_step next_piece(struct incode_cell_search *c,
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
            incode_walker_yield(walker, BATCH_UNITS);
            if (!whole && passing(q, &s->box, 1) == 0)
                break;
            uint32_t from, to;
            if (!incode_cells_word(g, base, row + c->x, &from, &q->missing) ||
                !incode_cells_word(g, base, row + last + 1, &to, &q->missing))
                return INCODE_WAITING;
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
            return INCODE_FINISHED;
    }
    return INCODE_WORKED;
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
    incode_walker_yield(walker, BATCH_UNITS);
    tested->mask = passing(q, &boxes, count);
    s->work++;
    return (tested->mask & 1) != 0;
}

static enum incode_step run_row(struct incode_cell_search *c,
                                const struct incode_grid *g,
                                struct incode_walker *walker,
                                struct incode_query *q, struct shell *s) {
    if (c->x == s->outer[0].first &&
        !passes(g, walker, q, s, &s->rows, 1, c->y))
        return INCODE_FINISHED;
    set_range(&s->box, g, 1, (struct range){c->y, c->y});
    for (;;) {
        enum incode_step r = next_piece(c, g, walker, q, s);
        if (r == INCODE_WORKED)
            return INCODE_FINISHED;
        if (r == INCODE_FINISHED)
            r = finish_piece(c, g, walker, q, &s->work);
        if (r != INCODE_FINISHED)
            return r;
    }
}

/* One layer of cells from row c->y on. */
static enum incode_step run_layer(struct incode_cell_search *c,
                                  const struct incode_grid *g,
                                  struct incode_walker *walker,
                                  struct incode_query *q, struct shell *s) {
    if (c->y == s->outer[1].first && c->x == s->outer[0].first &&
        !passes(g, walker, q, s, &s->layers, 2, c->z))
        return INCODE_FINISHED;
    set_range(&s->box, g, 2, (struct range){c->z, c->z});
    s->rows.end = 0;
    for (; c->y <= s->outer[1].last; c->y++) {
        incode_walker_yield(walker, 1);
        enum incode_step r = run_row(c, g, walker, q, s);
        if (r == INCODE_FINISHED && s->work >= work_of(walker))
            r = INCODE_WORKED;
        if (r != INCODE_FINISHED)
            return r;
        c->x = s->outer[0].first;
    }
    return INCODE_FINISHED;
}

static enum incode_step run_shell(struct incode_cell_search *c,
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
    enum incode_step r = finish_piece(c, g, walker, q, &s.work);
    for (; r == INCODE_FINISHED && c->z <= s.outer[2].last; c->z++) {
        incode_walker_yield(walker, 1);
        r = run_layer(c, g, walker, q, &s);
        if (r != INCODE_FINISHED)
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

enum incode_step incode_cell_search_run(struct incode_cell_search *c,
                                        const struct incode_grid *grid,
                                        struct incode_walker *walker,
                                        struct incode_query *q) {
    enum incode_step r = run_shell(c, grid, walker, q);
    if (r != INCODE_FINISHED || !more_beyond(c, grid, q))
        return r;
    INCODE_ASSERT(c->reach < UINT32_C(1) << 30);
    c->any_done = true;
    c->done = c->reach;
    c->reach *= 2;
    start_shell(c, grid);
    return INCODE_WORKED;
}

/* --- cap ------------------------------------------------------------------ */

/* Whether the cap of a sphere beyond a face lies in a box. */

/* Three numbers along the axes' two directions, in the order of a box's walls;
 * the lanes from `first` on. */
INCODE_INLINE incode_vd both_ways(const double a[3], int first) {
#if INCODE_VECTOR == 64
    (void)first;
    return (incode_vd){a[0], a[1], a[2], 0, -a[0], -a[1], -a[2], 0};
#elif INCODE_VECTOR == 32
    incode_vd up = {a[0], a[1], a[2], 0};
    return first == 0 ? up : -up;
#elif INCODE_VECTOR == 16
    incode_vd up = {a[first % 4], first % 4 == 0 ? a[1] : 0};
    return first < 4 ? up : -up;
#else
    incode_vd up = {first % 4 == 3 ? 0 : a[first % 4]};
    return first < 4 ? up : -up;
#endif
}

bool incode_cap_fits(const double walls[8], const struct incode_pencil *pencil,
                     double t) {
    double circle = incode_dot(pencil->c0, pencil->c0);
    double square = circle + 0.25 * t * t, radius = __builtin_sqrt(square);
    incode_vd zero = incode_vd_all(0);
    incode_vl all = incode_vl_ones();
    for (int first = 0; first < 8; first += INCODE_VD_LANES) {
        incode_vd n = both_ways(pencil->n, first);
        incode_vd c0 = both_ways(pencil->c0, first);
        incode_vd wall = incode_vd_load(walls + first);
        incode_vd gap = wall - (c0 + incode_vd_all(0.5 * t) * n);
        incode_vl in =
            (gap > zero) & (gap * gap > incode_vd_all(square * (1 + 4e-6)));
        incode_vl known =
            n * incode_vd_all(radius) < incode_vd_all(-0.5 * t - 2e-6 * radius);
        incode_vd rim = incode_vd_all(circle + 4e-6 * square) -
                        incode_vd_all(circle) * n * n;
        incode_vd short_gap = wall - c0;
        in |= known & (short_gap > zero) & (short_gap * short_gap > rim);
        all &= in;
    }
    return incode_vd_mask(all) == INCODE_VD_ALL;
}

/* The centre is m / (2 det), the radius its length. */
bool incode_sphere_fits(const double wall[8], const struct incode_sphere *s) {
    if (!(s->det > 1e9 * INCODE_SPHERE_EPS * s->pdet) ||
        !(s->det > INCODE_SPHERE_LEAST)) /* squares below would underflow */
        return false;
    double nn = incode_dot(s->n, s->n), half = 0.5 / s->det;
    double centre[3], t = 2 * incode_dot(s->n, s->m) * half;
    struct incode_pencil pencil;
    double unit = 1 / __builtin_sqrt(nn);
    double length = __builtin_sqrt(incode_dot(s->m, s->m)) * half;
    double error = 12 * INCODE_SPHERE_EPS * incode_max_norm(s->pm) * half;
    if (!(error < 1e-7 * length))
        return false;
    /* Without a good normal, the whole sphere. */
    if (!(nn > 1e-60) || !(INCODE_SPHERE_EPS * incode_max_norm(s->pn) <
                           1e-8 * incode_max_norm(s->n)))
        t = unit = 0;
    for (int d = 0; d < 3; d++) {
        centre[d] = s->m[d] * half;
        pencil.n[d] = s->n[d] * unit;
        pencil.c0[d] = centre[d] - 0.5 * t * unit * pencil.n[d];
    }
    return incode_cap_fits(wall, &pencil, t * unit);
}
