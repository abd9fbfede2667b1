/* Which cells are final: no point to come lies in their spheres.
 *
 * The highest boxes to come tell of most cells of a volume; all boxes, with the
 * lifted ones, of most cells of a surface.  Of the rest only the points can
 * tell: the bricks that these cells may reach are visited, and each of their
 * points looks up the cells that it would make give way.  First one brick for
 * each cell, as that often settles it, then all that are still reached.
 *
 * A region alone goes no further.  Of what is final among its own points, the
 * boxes and points of other regions tell what is final among all; the rest is
 * left to who knows those points.
 *
 * Else, when all own bricks have been taken in, a point of another's brick that
 * lies in the sphere of a cell at an own point is inserted, and that closes the
 * stars of all own points in one visit: a new cell at such a point p is on a
 * facet at p between a cell that gives way and one that stays, and its sphere
 * is within the two's (Edelsbrunner, Combinatorica 10, 1990), both at p, too.
 * So a point that was in no sphere at an own point never will be.  Points near
 * the own bricks go first, as the cells at their sides are large.  Before that,
 * and where these points do not fit, they are only shown to the cells, and
 * those that hold none are final. */
#include <assert.h>
#include <stdalign.h>
#include <string.h>

#include "insertion.h"
#include "incode/predicates/check.h"

enum {
    JUDGED = 1024,        /* cells a step */
    AT_ONCE = 16,         /* cells between two yields */
    SHOWN = 256,          /* cells looked at as a unit of work */
    LARGE = 32,           /* a cavity of more than such a part of the cells */
    SOUGHT_FRAMES = 1024, /* bricks around some own ones have room */
    NEWTON = 40,          /* from above: a third less at each step */
    FEW = 128,            /* cells: looking at all is better than a search */
    LEAST_SHARE = 8       /* of the cells must be final */
};

#define AROUND 1.5 /* times the distance of points in a volume */

/* Marks of cells: INCODE_CELL_PROVED. */
enum {
    UNKNOWN = 0, /* or not final, as is known */
    FINAL = INCODE_CELL_FINAL,
    REACHED = 3 /* by a box, and by no point yet */
};

/* ---- boxes ---- */

static uint32_t cells_left(const struct incode_insertion *n) {
    return incode_complex_cells_used(&n->complex) - INCODE_COMPLEX_CELLS_FIRST;
}

static void go_on(struct incode_insertion *n,
                  enum incode_insertion_stage stage) {
    n->cell = INCODE_COMPLEX_CELLS_FIRST;
    n->brick = n->next = 0;
    n->listed = INCODE_NONE;
    n->large = false;
    n->stage = stage;
}

/* About the edge of a cube that is one part of a box, by Newton's method. */
static double edge_of_part(const double lo[3], const double hi[3],
                           double parts) {
    double volume = 1 / parts, edge = 0;
    for (int d = 0; d < 3; d++) {
        volume *= hi[d] - lo[d];
        edge = hi[d] - lo[d] > edge ? hi[d] - lo[d] : edge;
    }
    for (unsigned i = 0; i < NEWTON; i++)
        edge = (2 * edge + volume / edge / edge) / 3;
    return edge;
}

/* Of others' points those go first that are near the own bricks' box, by as
 * much as neighbours in a volume are apart.  Without them the cells at its
 * sides are so large that three times as many points would be inserted. */
static void bound(struct incode_insertion *n) {
    const struct incode_rest *rest = &n->work->rest;
    struct incode_look *look = &n->work->look;
    double points = (double)(n->own_last - n->own_first) * INCODE_BRICK_POINTS;
    double around = AROUND * edge_of_part(rest->own_lo, rest->own_hi, points);
    look->bounded = around > 0 && around < __builtin_inf();
    for (int d = 0; d < 3; d++) {
        look->lo[d] = rest->own_lo[d] - around;
        look->hi[d] = rest->own_hi[d] + around;
    }
}

enum incode_step incode_insertion_rest(struct incode_insertion *n) {
    struct incode_insertion_work *work = n->work;
    size_t bits = (n->maker->tree.bricks + 63) / 64 * sizeof(uint64_t);
    bool alone = incode_insertion_is_alone(n);
    if (!(alone
              ? incode_rest_set_own(&work->rest, n->maker, n->from, n->own_last)
              : incode_rest_set(&work->rest, n->maker, n->own_first, n->from,
                                n->own_last)))
        return INCODE_WAITING;
    n->closing = n->from == n->own_last && !n->squeezed;
    n->shown = false;
    memset(n->touched, 0, bits);
    memset(n->passed, 0, bits);
    n->apart = false;
    incode_look_init(&work->look, n->maker, n->passed, n->touched);
    work->look.first = incode_insertion_base(n);
    work->look.end = incode_insertion_end(n);
    bool near = n->closing && n->thorough;
    uint32_t frames = n->maker->pager.frame_count;
    bool roomy = frames >= SOUGHT_FRAMES || frames >= n->maker->tree.bricks / 2;
    work->look.sought = near && roomy ? n->sought : NULL;
    if (work->look.sought != NULL)
        incode_yield_fill(&n->maker->counts.tally.yield, n->sought, 0,
                          n->maker->tree.bricks * sizeof *n->sought);
    incode_look_begin(&work->look, near, n->own_first, n->from);
    if (near)
        bound(n);
    n->releases++;
    n->final = n->reached = 0;
    n->round = 0;
    /* What the highest boxes tell has been released, unless insertions have
     * come in between. */
    go_on(n, n->thorough && !n->squeezed ? INCODE_INSERTION_LOOK
                                         : INCODE_INSERTION_JUDGE);
    return INCODE_WORKED;
}

/* Now and then in a loop over cells. */
static inline void yield_at(const struct incode_insertion *n, uint32_t cell) {
    if (cell % AT_ONCE == 0)
        incode_maker_yield(n->maker, AT_ONCE / 4);
}

/* Where to stop after some cells. */
static uint32_t some_cells(const struct incode_insertion *n) {
    uint32_t cells = n->complex.cells;
    incode_walker_spend(&n->maker->walker, JUDGED / INCODE_INSERTION_CELLS);
    incode_maker_yield(n->maker, JUDGED / AT_ONCE);
    return cells - n->cell < JUDGED ? cells : n->cell + JUDGED;
}

/* Of work, to test a cell against the rest, at most INCODE_YIELD_OVER. */
static uint32_t units_of(const struct incode_insertion *n) {
    enum { BOXES = 8 };
    static_assert(1 + INCODE_REST_MAX / BOXES <= INCODE_YIELD_OVER,
                  "one test is not too much at a time");
    return 1 + n->work->rest.count / BOXES;
}

enum incode_step incode_insertion_judge(struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    uint32_t units = units_of(n);
    for (uint32_t end = some_cells(n); n->cell < end; n->cell++) {
        struct incode_cell *c = incode_complex_cell(x, n->cell);
        incode_maker_yield(n->maker, units);
        if (incode_cell_is_free(c))
            continue;
        bool final = !incode_rest_reaches(&n->work->rest, x, c);
        incode_cell_set_proved(c, final ? FINAL : UNKNOWN);
        n->final += final;
    }
    if (n->cell < x->cells)
        return INCODE_WORKED;
    bool enough = n->final == cells_left(n) ||
                  (!n->thorough && n->final >= cells_left(n) / 2);
    go_on(n, enough ? INCODE_INSERTION_SETTLE : INCODE_INSERTION_LOOK);
    return INCODE_WORKED;
}

/* Whether it is at an own point that has been taken in. */
static bool is_at_own(const struct incode_insertion *n,
                      const struct incode_cell *c) {
    const struct incode_complex_point *point = n->complex.point;
    uint32_t first = n->own_first * INCODE_BRICK_POINTS;
    uint32_t count = n->from * INCODE_BRICK_POINTS - first;
    bool own = false;
    for (unsigned i = 0; i < 4; i++)
        own = own || point[c->v[i]].id - first < count;
    return own;
}

/* Whether a cell is to be looked at in this round. */
static bool is_wanted(const struct incode_insertion *n,
                      const struct incode_cell *c) {
    unsigned proved = incode_cell_proved(c);
    if (incode_cell_is_free(c) || proved == FINAL)
        return false;
    if (n->apart)
        return proved == REACHED;
    if (n->round == 1 && !n->closing)
        return proved == REACHED;
    return n->squeezed || is_at_own(n, c);
}

/* What the look has told of its cells. */
static void note(struct incode_insertion *n) {
    const struct incode_look *look = &n->work->look;
    for (uint32_t i = 0; i < look->count && !look->every; i++) {
        bool reached = incode_look_has_reached(look, i);
        incode_cell_set_proved(incode_complex_cell(&n->complex, look->cell[i]),
                               reached ? REACHED : FINAL);
        n->final += !reached;
        n->reached += reached;
    }
}

enum incode_step incode_insertion_look(struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    struct incode_look *look = &n->work->look;
    uint32_t end = look->at == look->first ? some_cells(n) : n->cell;
    for (; n->cell < end && !incode_look_is_full(look); n->cell++) {
        yield_at(n, n->cell);
        if (is_wanted(n, incode_complex_cell(x, n->cell)))
            incode_look_add(look, x, n->cell);
    }
    if (n->cell < x->cells && !incode_look_is_full(look))
        return INCODE_WORKED;
    incode_walker_spend(&n->maker->walker, look->count);
    enum incode_step r = incode_look_go(look);
    if (r != INCODE_FINISHED)
        return r == INCODE_WORKED ? INCODE_WORKED : INCODE_WAITING;
    note(n);
    bool bounded = look->bounded;
    incode_look_begin(look, look->every, look->pass_first, look->pass_last);
    look->bounded = bounded;
    if (n->cell < x->cells)
        return INCODE_WORKED;
    if (n->apart) {
        incode_insertion_begin_list(n);
        return INCODE_WORKED;
    }
    /* Without a visit, those that are reached stay. */
    n->shown =
        n->thorough || n->round == 1 || n->final < cells_left(n) / LEAST_SHARE;
    go_on(n, n->shown ? INCODE_INSERTION_VISIT : INCODE_INSERTION_SETTLE);
    return INCODE_WORKED;
}

/* ---- points ---- */

/* The first brick from one on that is wanted; else the number of bricks. */
static uint32_t next_wanted(const struct incode_insertion *n, uint32_t brick) {
    uint32_t bricks = n->maker->tree.bricks;
    while (brick < bricks) {
        uint64_t left = n->touched[brick / 64] >> brick % 64;
        if (left != 0)
            return brick + (uint32_t)__builtin_ctzll(left);
        brick = (brick / 64 + 1) * 64;
    }
    return bricks;
}

/* Shows a point to a cell that is reached; whether it still is. */
static bool show(struct incode_insertion *n, struct incode_cell *c,
                 const double p[3]) {
    incode_maker_yield(n->maker, 1);
    if (!incode_complex_gives_way(&n->complex, &n->maker->counts.tally, c, p))
        return true;
    incode_cell_set_proved(c, UNKNOWN);
    n->reached--;
    return false;
}

/* Shows it to all of them, and lists what is left if it is few. */
static void show_all(struct incode_insertion *n, const double p[3]) {
    const struct incode_complex *x = &n->complex;
    uint32_t left = 0;
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
        struct incode_cell *c = incode_complex_cell(x, i);
        yield_at(n, i);
        if (incode_cell_is_free(c) || incode_cell_proved(c) != REACHED ||
            !show(n, c, p))
            continue;
        if (left < INCODE_INSERTION_LISTED)
            n->work->listed[left] = i;
        left++;
    }
    n->listed = left <= INCODE_INSERTION_LISTED ? left : INCODE_NONE;
    incode_walker_spend(&n->maker->walker, x->cells / SHOWN);
}

static void show_listed(struct incode_insertion *n, const double p[3]) {
    uint32_t *list = n->work->listed, left = 0;
    for (uint32_t i = 0; i < n->listed; i++) {
        struct incode_cell *c = incode_complex_cell(&n->complex, list[i]);
        list[left] = list[i];
        left += incode_cell_proved(c) == REACHED && show(n, c, p);
    }
    n->listed = left;
}

/* Shows it to all that it would make give way.  They are sought from the last
 * ones, but where those that are left are few, or its cavity is large, as those
 * of its neighbours are. */
static void show_point(struct incode_insertion *n, const double p[3]) {
    struct incode_complex *x = &n->complex;
    struct incode_tally *tally = &n->maker->counts.tally;
    uint32_t cells[INCODE_COMPLEX_CAVITY], count = INCODE_NONE;
    if (n->reached > FEW)
        count = incode_complex_cavity(x, tally, p, n->near, cells);
    if (count == INCODE_NONE && n->listed != INCODE_NONE) {
        show_listed(n, p);
    } else if (count == INCODE_NONE &&
               (n->large || n->reached <= INCODE_INSERTION_LISTED)) {
        show_all(n, p);
    } else if (count == INCODE_NONE) {
        uint32_t were;
        count = incode_complex_disprove(x, tally, p, n->near, &were);
        incode_walker_spend(&n->maker->walker, count / INCODE_INSERTION_CELLS);
        n->reached -= were;
        n->large = count > x->cells / LARGE;
    } else {
        for (uint32_t i = 0; i < count; i++) {
            struct incode_cell *c = incode_complex_cell(x, cells[i]);
            n->reached -= incode_cell_proved(c) == REACHED;
            incode_cell_set_proved(c, UNKNOWN);
            n->near = c->v[3];
        }
    }
}

/* Inserts it if it lies in the sphere of a cell at an own point; false: there
 * is no room. */
static bool close_stars(struct incode_insertion *n, const double p[3],
                        uint32_t id) {
    struct incode_complex *x = &n->complex;
    struct incode_tally *tally = &n->maker->counts.tally;
    uint32_t cells[INCODE_COMPLEX_CAVITY];
    uint32_t count = incode_complex_cavity(x, tally, p, n->near, cells);
    bool wanted = count == INCODE_NONE;
    for (uint32_t i = 0; i < count && !wanted; i++) {
        const struct incode_cell *c = incode_complex_cell(x, cells[i]);
        wanted = is_at_own(n, c);
        n->near = c->v[3];
    }
    if (!wanted)
        return true;
    uint32_t v = incode_complex_add(x, p, id);
    if (v == INCODE_NONE || !incode_complex_insert(x, tally, v, n->near))
        return false;
    incode_insertion_note(n, id);
    n->vertices++;
    n->near = v;
    return true;
}

static enum incode_step end_visit(struct incode_insertion *n) {
    n->round++;
    go_on(n, n->round == 1 ? INCODE_INSERTION_LOOK : INCODE_INSERTION_SETTLE);
    incode_look_begin(&n->work->look, true, n->own_first, n->from);
    return INCODE_WORKED;
}

/* Whether a cell may hold it, as far as that was told. */
static bool is_sought(const struct incode_insertion *n, uint32_t id) {
    const uint64_t *sought = n->work->look.sought;
    return sought == NULL ||
           (sought[id / INCODE_BRICK_POINTS] >> id % INCODE_BRICK_POINTS & 1) !=
               0;
}

static bool is_in_bounds(const struct incode_insertion *n, const double p[3]) {
    const struct incode_look *look = &n->work->look;
    bool in = true;
    for (int d = 0; d < 3 && look->bounded; d++)
        in = in && p[d] >= look->lo[d] && p[d] <= look->hi[d];
    return in;
}

enum incode_step incode_insertion_visit(struct incode_insertion *n) {
    struct incode_pager *pager = &n->maker->pager;
    struct incode_walker *walker = &n->maker->walker;
    uint32_t bricks = n->maker->tree.bricks;
    uint32_t brick = next_wanted(n, n->brick), ahead = brick;
    if (brick == bricks || (!n->closing && n->reached == 0))
        return end_visit(n);
    for (unsigned i = 0; i < INCODE_INSERTION_AHEAD && ahead < bricks; i++) {
        (void)incode_pager_get(pager, ahead);
        ahead = next_wanted(n, ahead + 1);
    }
    const struct incode_frame *f = incode_pager_get(pager, brick);
    if (f == NULL)
        return INCODE_WAITING;
    const struct incode_brick *b = &f->page.brick;
    for (uint32_t first = n->next; n->next < f->count; n->next++) {
        const double p[3] = {b->x[n->next], b->y[n->next], b->z[n->next]};
        uint32_t id = brick * INCODE_BRICK_POINTS + n->next;
        if (walker->left == 0 && n->next > first)
            return INCODE_WORKED;
        incode_walker_spend(walker, INCODE_INSERTION_UNITS);
        /* No cell holds a vertex; of one that is released, that is a look at
         * all of them. */
        if (incode_insertion_has_noted(n, id) || !is_in_bounds(n, p) ||
            !is_sought(n, id))
            continue;
        if (!n->closing) {
            show_point(n, p);
        } else if (!close_stars(n, p, id)) {
            n->squeezed = true; /* what is final makes room */
            n->stage = INCODE_INSERTION_REST;
            return INCODE_WORKED;
        }
    }
    n->touched[brick / 64] &= ~(UINT64_C(1) << brick % 64);
    if (n->work->look.sought != NULL)
        n->work->look.sought[brick] = 0;
    if (!n->work->look.bounded)
        incode_insertion_set_bit(n->passed, brick);
    n->brick = brick + 1;
    n->next = 0;
    n->large = false;
    return INCODE_WORKED;
}

/* ---- what has come of it ---- */

enum incode_step incode_insertion_settle(struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    if (n->cell == INCODE_COMPLEX_CELLS_FIRST)
        n->final = 0;
    for (uint32_t end = some_cells(n); n->cell < end; n->cell++) {
        struct incode_cell *c = incode_complex_cell(x, n->cell);
        if (incode_cell_is_free(c))
            continue;
        unsigned proved = incode_cell_proved(c);
        bool final = proved == FINAL || (n->shown && proved == REACHED) ||
                     (n->shown && n->closing && is_at_own(n, c));
        incode_cell_set_proved(c, final ? FINAL : UNKNOWN);
        n->final += final;
    }
    if (n->cell < x->cells)
        return INCODE_WORKED;
    if (!n->closing && n->final < cells_left(n) / LEAST_SHARE)
        return INCODE_FULL;
    n->closed = n->closing && (n->shown || n->final == cells_left(n));
    if (incode_insertion_is_alone(n))
        n->stage = INCODE_INSERTION_OTHERS;
    else
        incode_insertion_begin_list(n);
    return INCODE_WORKED;
}

/* ---- a region alone ---- */

/* Begins to tell which of the cells that are final among the own points are so
 * among all. */
enum incode_step incode_insertion_others(struct incode_insertion *n) {
    struct incode_look *look = &n->work->look;
    if (!incode_rest_set(&n->work->rest, n->maker, n->own_first, n->own_last,
                         n->own_last))
        return INCODE_WAITING;
    incode_look_init(look, n->maker, n->passed, n->touched);
    incode_look_begin(look, false, n->own_first, n->own_last);
    look->closely = true;
    n->apart = true;
    n->reached = 0;
    go_on(n, INCODE_INSERTION_APART);
    return INCODE_WORKED;
}

enum incode_step incode_insertion_apart(struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    uint32_t units = units_of(n);
    for (uint32_t end = some_cells(n); n->cell < end; n->cell++) {
        struct incode_cell *c = incode_complex_cell(x, n->cell);
        incode_maker_yield(n->maker, units);
        if (incode_cell_is_free(c) || incode_cell_proved(c) != FINAL ||
            !incode_rest_reaches(&n->work->rest, x, c))
            continue;
        incode_cell_set_proved(c, REACHED);
        n->reached++;
    }
    if (n->cell < x->cells)
        return INCODE_WORKED;
    if (n->reached > 0)
        go_on(n, INCODE_INSERTION_LOOK);
    else
        incode_insertion_begin_list(n);
    return INCODE_WORKED;
}

/* --- fallback ------------------------------------------------------------- */

enum {
    CELLS = 256,          /* a step */
    FALLBACK_AT_ONCE = 16 /* points or cells between two yields */
};

/* A vertex's `cell`, which is not needed any more. */
enum { NOT_REACHED = 0, FALLBACK_REACHED = 1 };

static void fallback_yield_at(const struct incode_fallback *h, uint32_t i) {
    if (i % FALLBACK_AT_ONCE == 0)
        incode_maker_yield(h->n->maker, FALLBACK_AT_ONCE / 4);
}

void incode_fallback_begin(struct incode_fallback *h,
                           struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    memset(h, 0, sizeof *h);
    h->n = n;
    h->cell = INCODE_COMPLEX_CELLS_FIRST;
    h->vertex = 1;
    h->brick = n->own_first;
    for (uint32_t v = 0; v < x->points; v++) {
        fallback_yield_at(h, v);
        if (incode_complex_is_vertex(x, v))
            x->point[v].cell = NOT_REACHED;
    }
}

/* Sends what waits; false: there is no room for it. */
static bool send(struct incode_fallback *h) {
    const struct incode_front_outside *outside = &h->n->outside;
    if (h->count > 0 && !outside->spill(outside->context, h->faces, h->count))
        return false;
    h->count = 0;
    return true;
}

/* The open face opposite vertex k of a cell, seen so that the cell is on its
 * unknown side. */
static void open_face(struct incode_fallback *h, struct incode_front *front,
                      const struct incode_cell *c, unsigned k) {
    static const uint8_t BEFORE[4][3] = {
        {3, 2, 1}, {2, 3, 0}, {1, 0, 3}, {0, 1, 2}};
    struct incode_complex_point *point = h->n->complex.point;
    uint32_t f[3];
    const double *p[3];
    unsigned turn;
    for (unsigned i = 0; i < 3; i++) {
        uint16_t v = c->v[BEFORE[k][i]];
        point[v].cell = FALLBACK_REACHED;
        f[i] = point[v].id;
        p[i] = point[v].p;
    }
    if (!incode_front_key(front, f, p, &turn))
        return;
    h->faces[h->count++] =
        (struct incode_face){{f[turn], f[(turn + 1) % 3], f[(turn + 2) % 3]}};
}

static enum incode_step send_faces(struct incode_fallback *h,
                                   struct incode_front *front) {
    const struct incode_complex *x = &h->n->complex;
    for (unsigned i = 0; i < CELLS && h->cell < x->cells; i++, h->cell++) {
        const struct incode_cell *c = incode_complex_cell(x, h->cell);
        fallback_yield_at(h, h->cell);
        if (incode_cell_is_free(c))
            continue;
        if (h->count + 4 > INCODE_BRICK_POINTS && !send(h))
            return INCODE_WAITING;
        for (unsigned k = 0; k < 4; k++)
            if (c->n[k].cell == INCODE_COMPLEX_GONE)
                open_face(h, front, c, k);
    }
    return INCODE_WORKED;
}

/* The points of own bricks to come that a released tetrahedron has. */
static enum incode_step send_ahead(struct incode_fallback *h) {
    const struct incode_complex *x = &h->n->complex;
    for (unsigned i = 0; i < CELLS && h->vertex < x->points; i++, h->vertex++) {
        const struct incode_complex_point *v = &x->point[h->vertex];
        uint32_t brick = v->id / INCODE_BRICK_POINTS;
        if (v->cell != FALLBACK_REACHED || brick < h->n->from ||
            brick >= h->n->own_last)
            continue;
        if (h->count == INCODE_BRICK_POINTS && !send(h))
            return INCODE_WAITING;
        h->faces[h->count++] =
            (struct incode_face){{v->id, INCODE_NONE, INCODE_NONE}};
    }
    return INCODE_WORKED;
}

/* The points of a brick that a released tetrahedron has: those that have no
 * cell any more, or an open face. */
static enum incode_step send_reached(struct incode_fallback *h) {
    const struct incode_complex *x = &h->n->complex;
    uint32_t brick = h->brick;
    uint32_t points = incode_maker_count(h->n->maker, brick);
    if (points == 0)
        return INCODE_WAITING;
    if (!send(h))
        return INCODE_WAITING;
    uint64_t reached = ~UINT64_C(0) >> (INCODE_BRICK_POINTS - points);
    for (uint32_t v = 1; v < x->points; v++) {
        fallback_yield_at(h, v);
        if (x->point[v].cell == NOT_REACHED &&
            x->point[v].id / INCODE_BRICK_POINTS == brick)
            reached &= ~(UINT64_C(1) << x->point[v].id % INCODE_BRICK_POINTS);
    }
    for (; reached != 0; reached &= reached - 1)
        h->faces[h->count++] = (struct incode_face){
            {brick * INCODE_BRICK_POINTS + (uint32_t)__builtin_ctzll(reached),
             INCODE_NONE, INCODE_NONE}};
    h->brick++;
    return INCODE_WORKED;
}

enum incode_step incode_fallback_step(struct incode_fallback *h,
                                      struct incode_front *front) {
    const struct incode_insertion *n = h->n;
    if (h->cell < n->complex.cells)
        return send_faces(h, front);
    if (h->vertex < n->complex.points)
        return send_ahead(h);
    while (h->brick < n->from && incode_insertion_has_committed(n, h->brick))
        h->brick++;
    if (h->brick < n->from)
        return send_reached(h);
    return send(h) ? INCODE_FINISHED : INCODE_WAITING;
}
