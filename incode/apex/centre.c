#include <stdalign.h>

#include "search.h"

/* The points around a vertex, brought to hand, and the bricks around its own.
 */

enum {
    HORIZON_UNITS =
        16, /* of incode/predicates/pause.h: a look over its boxes */
    NEAR_WANTED = 96,
    COPY_TRIES = 64
};

static double longest_side(const double lo[3], const double hi[3]) {
    double extent = 0;
    for (int d = 0; d < 3; d++)
        extent = hi[d] - lo[d] > extent ? hi[d] - lo[d] : extent;
    return extent;
}

/* Half-width of the box of local points: the extent of the leaf, times what has
 * lately given the wanted number of points around a vertex. */
static double first_radius(const struct incode_maker *m, const double lo[3],
                           const double hi[3]) {
    double extent = longest_side(lo, hi);
    if (!(extent > 0)) {
        for (int d = 0; d < 3; d++) {
            double e = m->hi[d] * 0x1p-10 - m->lo[d] * 0x1p-10;
            extent = e > extent ? e : extent;
        }
    }
    double radius = extent * m->spread;
    radius = radius > 0x1p-1070 ? radius : 0x1p-1070; /* it must grow by 4s */
    return radius < 0x1p1000 ? radius : 0x1p1000;
}

static void learn_spread(struct incode_maker *m, uint32_t points) {
    if (points > NEAR_WANTED * 9 / 8)
        m->spread *= 0.98;
    else if (points < NEAR_WANTED * 7 / 8)
        m->spread *= 1.02;
    m->spread = m->spread < 0.25 ? 0.25 : m->spread > 16 ? 16 : m->spread;
}

/* Brings the points around the leaf of a vertex to hand. */
static enum incode_outcome copy_around_leaf(struct incode_maker *m,
                                            struct incode_search *s, uint32_t v,
                                            const struct incode_frame *f) {
    struct incode_local_points *local = &m->local;
    uint32_t leaf = v % INCODE_BRICK_POINTS / INCODE_LEAF_POINTS;
    alignas(64) double leaf_lo[3][INCODE_BRICK_LEAVES],
        leaf_hi[3][INCODE_BRICK_LEAVES];
    double lo[3], hi[3];
    incode_frame_leaf_boxes(f, leaf_lo, leaf_hi);
    for (int d = 0; d < 3; d++) {
        lo[d] = leaf_lo[d][leaf];
        hi[d] = leaf_hi[d][leaf];
    }
    double radius = first_radius(m, lo, hi);
    for (int tries = 0;; tries++) {
        incode_maker_breathe(m, HORIZON_UNITS);
        enum incode_local_outcome r =
            incode_local_around(local, &m->walker, &m->horizon,
                                v / INCODE_LEAF_POINTS, lo, hi, radius);
        s->page = local->query.missing;
        if (r == INCODE_LOCAL_WAIT)
            return INCODE_WAIT;
        if (r == INCODE_LOCAL_READY || tries == COPY_TRIES)
            return INCODE_ANSWERED;
        radius *= 0.75;
        m->spread *= 0.9;
    }
}

enum { HORIZON_TRIES = 12 };

/* Lists the bricks around that of a vertex: more of them where there are few,
 * none where there are too many whatever the box. */
static enum incode_outcome list_bricks(struct incode_maker *m,
                                       struct incode_search *s, uint32_t brick,
                                       const struct incode_frame *f) {
    struct incode_horizon *h = &m->horizon;
    double lo[3], hi[3];
    bool full = false;
    (void)incode_frame_box(f, lo, hi);
    double extent = longest_side(lo, hi);
    for (int tries = 0; tries < HORIZON_TRIES; tries++) {
        double radius = extent * m->reach, around_lo[3], around_hi[3];
        bool all = true;
        for (int d = 0; d < 3; d++) {
            around_lo[d] = lo[d] - radius;
            around_hi[d] = hi[d] + radius;
            all = all && around_lo[d] <= m->lo[d] && around_hi[d] >= m->hi[d];
        }
        enum incode_horizon_made r = incode_horizon_make(
            h, &m->walker, brick, around_lo, around_hi, &s->page);
        if (r == INCODE_HORIZON_WAIT)
            return INCODE_WAIT;
        if (r == INCODE_HORIZON_MADE &&
            (full || all || h->count >= incode_horizon_near(h) / 3))
            break;
        full = full || r == INCODE_HORIZON_FULL;
        m->reach *= full ? 0.75 : 1.25;
        m->reach = m->reach < 0x1p-10  ? 0x1p-10
                   : m->reach > 0x1p10 ? 0x1p10
                                       : m->reach;
    }
    for (int d = 0; d < 3; d++) {
        if (h->box_lo[d] <= m->lo[d])
            h->box_lo[d] = -__builtin_inf();
        if (h->box_hi[d] >= m->hi[d])
            h->box_hi[d] = __builtin_inf();
    }
    return INCODE_ANSWERED;
}

enum incode_outcome incode_maker_centre(struct incode_maker *m, unsigned search,
                                        uint32_t v) {
    struct incode_search *s = &m->search[search];
    struct incode_local_points *local = &m->local;
    uint32_t brick = v / INCODE_BRICK_POINTS, slot = v % INCODE_BRICK_POINTS;
    const struct incode_frame *f = incode_pager_get(&m->pager, brick);
    s->page = brick;
    if (f == NULL)
        return INCODE_WAIT;
    if (slot >= f->count) {
        m->fault = INCODE_NO_VERTEX;
        return INCODE_WAIT;
    }
    if (m->horizon.centre != brick &&
        list_bricks(m, s, brick, f) == INCODE_WAIT)
        return INCODE_WAIT;
    if (local->leaf != v / INCODE_LEAF_POINTS &&
        copy_around_leaf(m, s, v, f) == INCODE_WAIT)
        return INCODE_WAIT;
    const double p[3] = {f->page.brick.x[slot], f->page.brick.y[slot],
                         f->page.brick.z[slot]};
    bool again = local->vertex == v; /* after a wait: nothing new to learn */
    incode_local_centre(local, v, p, local->radius, m->lo, m->hi);
    if (!again)
        learn_spread(m, local->near);
    return INCODE_ANSWERED;
}
