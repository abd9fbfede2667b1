#include <float.h>
#include <stdalign.h>
#include <string.h>

#include "horizon.h"
#include "incode/predicates/simd.h"
#include "incode/predicates/check.h"

void incode_hits_draw_in(struct incode_query *q,
                         const struct incode_pencil *pencil, double t) {
    double square = 0.25 * t * t;
    for (int d = 0; d < 3; d++) {
        q->centre[d] = pencil->c0[d] + 0.5 * t * pencil->n[d];
        square += pencil->c0[d] * pencil->c0[d];
    }
    q->t = t;
    q->square = square * (1 + 4e-6);
    double far = 2 * pencil->size + __builtin_fabs(t); /* above the radius */
    q->plane_slack = INCODE_SPHERE_TINY + INCODE_SPHERE_EPS * 6 *
                                              incode_max_norm(q->sphere.pn) *
                                              far;
    q->round = true;
}

INCODE_INLINE incode_vd dot(const double a[3], const incode_vd b[3]) {
    return incode_vd_all(a[0]) * b[0] + incode_vd_all(a[1]) * b[1] +
           incode_vd_all(a[2]) * b[2];
}

/* incode_pencil_place for a vector of points at x, y and z; infinite where it
 * is false. */
INCODE_INLINE incode_vd places(const struct incode_query *q,
                               const struct incode_pencil *pencil,
                               const double *const xyz[3], uint32_t i) {
    incode_vd r[3], square = incode_vd_all(0);
    incode_vd far = incode_vd_all(INCODE_PENCIL_LEAST);
    for (int d = 0; d < 3; d++) {
        /* Scaled first: a difference of large numbers could overflow. */
        r[d] = incode_vd_load(xyz[d] + i) * incode_vd_all(q->scale) -
               incode_vd_all(q->pv[d] * q->scale);
        far = incode_vd_max(incode_vd_abs(r[d]), far);
        square += r[d] * r[d];
    }
    incode_vd beyond = dot(pencil->n, r);
    incode_vd t = (square - incode_vd_all(2) * dot(pencil->c0, r)) / beyond;
    return incode_vd_select(beyond > incode_vd_all(2e-3) * far, t,
                            incode_vd_all(__builtin_inf()));
}

void incode_hits_place(struct incode_query *q,
                       const struct incode_pencil *pencil,
                       struct incode_hits *hits) {
    if (hits->placed == hits->count)
        return;
    const double *const xyz[3] = {hits->p[0], hits->p[1], hits->p[2]};
    incode_vd infinite = incode_vd_all(__builtin_inf()), least = infinite;
    incode_vd end = incode_vd_all(hits->count), lane = incode_vd_count();
    for (uint32_t i = hits->placed / INCODE_VD_LANES * INCODE_VD_LANES;
         i < hits->count; i += INCODE_VD_LANES) {
        incode_vd t = places(q, pencil, xyz, i);
        t = incode_vd_select(incode_vd_all(i) + lane < end, t, infinite);
        *(incode_vd *)(hits->t + i) = t;
        least = incode_vd_min(t, least);
    }
    hits->placed = hits->count;
    double first = incode_vd_least_of(least);
    if (first < q->t)
        incode_hits_draw_in(q, pencil, first);
}

bool incode_hits_contends(const struct incode_query *q,
                          const struct incode_hits *hits, uint32_t i,
                          double last) {
    double square = 0;
    if (hits->t[i] < __builtin_inf())
        return hits->t[i] <= last;
    for (int d = 0; d < 3; d++) {
        double r = hits->p[d][i] * q->scale - q->pv[d] * q->scale;
        square += (r - q->centre[d]) * (r - q->centre[d]);
    }
    return !(square > q->square);
}

/* Drops what has fallen out of the ball. */
static void thin_out(const struct incode_query *q,
                     const struct incode_pencil *pencil,
                     struct incode_hits *hits) {
    double last = incode_pencil_later(pencil, q->t);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < hits->count; i++) {
        if (!incode_hits_contends(q, hits, i, last))
            continue;
        for (int d = 0; d < 3; d++)
            hits->p[d][kept] = hits->p[d][i];
        hits->id[kept] = hits->id[i];
        hits->t[kept++] = hits->t[i];
    }
    hits->count = hits->placed = kept;
}

/* Of many points of a brick, those that may be the first, by their places in
 * double precision; the first place draws the ball in. */
static uint64_t contending(const struct incode_pencil *pencil,
                           struct incode_query *q, const struct incode_brick *b,
                           uint64_t in) {
    const double *const xyz[3] = {b->x, b->y, b->z};
    alignas(64) double t[INCODE_BRICK_POINTS];
    double first = __builtin_inf();
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES)
        *(incode_vd *)(t + i) = places(q, pencil, xyz, i);
    for (uint64_t left = in; left != 0; left &= left - 1) {
        double here = t[__builtin_ctzll(left)];
        first = here < first ? here : first;
    }
    if (first < q->t)
        incode_hits_draw_in(q, pencil, first);
    incode_vd last = incode_vd_all(incode_pencil_later(pencil, q->t));
    incode_vd infinite = incode_vd_all(__builtin_inf());
    uint64_t out = 0;
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES) {
        incode_vd place = incode_vd_load(t + i), square = incode_vd_all(0);
        for (int d = 0; d < 3; d++) {
            incode_vd r = incode_vd_load(xyz[d] + i) * incode_vd_all(q->scale) -
                          incode_vd_all(q->pv[d] * q->scale) -
                          incode_vd_all(q->centre[d]);
            square += r * r;
        }
        incode_vl after = (place < infinite) & (place > last);
        incode_vl outside =
            (place >= infinite) & (square > incode_vd_all(q->square));
        out |= (uint64_t)incode_vd_mask(after | outside) << i;
    }
    return in & ~out;
}

enum { MANY = 16 /* points of a brick */ };

bool incode_hits_add(const struct incode_pencil *pencil, struct incode_query *q,
                     const struct incode_frame *frame, uint64_t in,
                     struct incode_hits *hits) {
    const struct incode_brick *b = &frame->page.brick;
    if (__builtin_popcountll(in) >= MANY)
        in = contending(pencil, q, b, in);
    for (; in != 0; in &= in - 1) {
        uint32_t slot = (uint32_t)__builtin_ctzll(in);
        if (hits->count == INCODE_HITS) {
            incode_hits_place(q, pencil, hits);
            thin_out(q, pencil, hits);
            if (hits->count == INCODE_HITS)
                return false;
        }
        uint32_t i = hits->count++;
        hits->p[0][i] = b->x[slot];
        hits->p[1][i] = b->y[slot];
        hits->p[2][i] = b->z[slot];
        hits->id[i] = frame->number * INCODE_BRICK_POINTS + slot;
    }
    return true;
}

/* --- local points --------------------------------------------------------- */

#define INFINITE __builtin_inff()

/* Of work, as incode/predicates/yield.h counts it. */
enum {
    LEAF_UNITS = 5,
    POINTS_A_UNIT = 2,
    AT_ONCE = 128 /* points between two yields */
};

/* So many points are about to be worked on. */
static void yield_over(const struct incode_local_points *local, uint32_t n) {
    if (local->yield != NULL)
        incode_yield_after(local->yield, n / POINTS_A_UNIT);
}

void incode_local_reset(struct incode_local_points *local) {
    local->leaf = INCODE_NONE;
    local->around = local->count = 0;
    local->near = 0;
}

/* ---- around a leaf ---- */

struct sides {
    incode_vd lo[3], hi[3];
};

/* Which points of a leaf lie in a box, one bit each. */
INCODE_INLINE uint32_t inside(const struct sides *box,
                              const double *const axis[3], uint32_t slot) {
    uint32_t in = 0;
    for (uint32_t i = 0; i < INCODE_LEAF_POINTS; i += INCODE_VD_LANES) {
        incode_vl here = incode_vl_ones();
        for (int d = 0; d < 3; d++) {
            incode_vd p = incode_vd_load(axis[d] + slot + i);
            here &= (p >= box->lo[d]) & (p <= box->hi[d]);
        }
        in |= incode_vd_mask(here) << i;
    }
    return in;
}

static bool copy_leaves(struct incode_walker *walker, struct incode_query *q,
                        const struct incode_frame *frame, uint32_t brick,
                        uint32_t leaves, void *context) {
    struct incode_local_points *local = context;
    const struct incode_brick *b = &frame->page.brick;
    const double *const axis[3] = {b->x, b->y, b->z};
    struct sides box;
    for (int d = 0; d < 3; d++) {
        box.lo[d] = incode_vd_all(q->lo[d]);
        box.hi[d] = incode_vd_all(q->hi[d]);
    }
    for (; leaves != 0; leaves &= leaves - 1) {
        incode_walker_yield(walker, LEAF_UNITS);
        uint32_t slot = (uint32_t)__builtin_ctz(leaves) * INCODE_LEAF_POINTS;
        uint32_t in = inside(&box, axis, slot), n = frame->count - slot;
        if (n < INCODE_LEAF_POINTS)
            in &= (UINT32_C(1) << n) - 1;
        if (in == 0)
            continue;
        if (local->around + INCODE_LEAF_POINTS > INCODE_AROUND_POINTS)
            return false;
        for (; in != 0; in >>= INCODE_VD_LANES, slot += INCODE_VD_LANES) {
            uint32_t here = in & INCODE_VD_ALL;
            for (int d = 0; d < 3; d++)
                incode_vd_pack(local->p[d] + local->around, here,
                               incode_vd_load(axis[d] + slot));
            incode_pack_count(local->id + local->around, here,
                              brick * INCODE_BRICK_POINTS + slot);
            local->around += (uint32_t)__builtin_popcount(here);
        }
    }
    return true;
}

enum incode_local_outcome
incode_local_around(struct incode_local_points *local,
                    struct incode_walker *walker,
                    const struct incode_horizon *horizon, uint32_t leaf,
                    const double lo[3], const double hi[3], double radius) {
    struct incode_query *q = &local->query;
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_BOX;
    q->boxed = true;
    q->pages_max = local->pages_max; /* all must be resident at once */
    local->leaf = INCODE_NONE;
    local->around = 0;
    local->radius = radius;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = local->around_lo[d] = lo[d] - radius;
        q->hi[d] = local->around_hi[d] = hi[d] + radius;
    }
    enum incode_step r =
        incode_horizon_holds(horizon, q->lo, q->hi)
            ? incode_horizon_box(horizon, walker, q, copy_leaves, local)
            : incode_walk(walker, q, copy_leaves, local);
    local->count = local->around;
    local->per_unit = 0;
    if (r == INCODE_WAITING)
        return INCODE_LOCAL_WAIT;
    local->leaf = leaf;
    if (r == INCODE_FINISHED)
        return INCODE_LOCAL_READY;
    /* Not the whole box: what was copied serves, but certifies nothing. */
    for (int d = 0; d < 3; d++) {
        local->around_lo[d] = __builtin_inf();
        local->around_hi[d] = -__builtin_inf();
    }
    return INCODE_LOCAL_CROWDED;
}

/* ---- around a vertex ---- */

/* The points around the leaf in whole units, up to about 2^30 of them to each
 * side of the origin; what lies beyond is moved to the border. */
#define UNITS_HALF 0x1p29
#define UNITS_MOST 1610612736.0 /* 1.5 times 2^30 */
#define UNITS_LEAST 4096        /* a radius */

INCODE_INLINE incode_vd in_units(incode_vd p, double origin, double per_unit) {
    incode_vd a = (p - incode_vd_all(origin)) * incode_vd_all(per_unit);
    return incode_vd_max(incode_vd_min(a, incode_vd_all(UNITS_MOST)),
                         incode_vd_all(-UNITS_MOST));
}

static int32_t unit_of(const struct incode_local_points *local, int d,
                       double p) {
    double a = (p - local->origin[d]) * local->per_unit;
    a = a < UNITS_MOST ? a : UNITS_MOST;
    return (int32_t)(a > -UNITS_MOST ? a : -UNITS_MOST);
}

static void set_units(struct incode_local_points *local, const double origin[3],
                      double half) {
    local->per_unit =
        incode_scale_for(half > 0x1p-900 ? half : 0x1p-900) * UNITS_HALF;
    memcpy(local->origin, origin, sizeof local->origin);
    yield_over(local, local->around);
    for (uint32_t i = 0; i < local->around; i += INCODE_VD_LANES)
        for (int d = 0; d < 3; d++)
            incode_vd_cut(local->unit[d] + i,
                          in_units(incode_vd_load(local->p[d] + i), origin[d],
                                   local->per_unit));
}

/* Units that tell apart what is around p: those of the leaf as a rule. */
static void choose_units(struct incode_local_points *local, const double p[3],
                         double radius) {
    if (local->per_unit == 0) {
        double origin[3], half = radius;
        for (int d = 0; d < 3; d++) {
            double lo = local->around_lo[d], hi = local->around_hi[d];
            bool whole = lo <= hi;
            double h = whole ? hi * 0.5 - lo * 0.5 : 0;
            origin[d] = whole ? lo * 0.5 + hi * 0.5 : p[d];
            half = h > half ? h : half;
        }
        set_units(local, origin, half);
    }
    bool fine = radius * local->per_unit >= UNITS_LEAST;
    for (int d = 0; d < 3; d++)
        fine =
            fine && __builtin_fabs(p[d] - local->origin[d]) * local->per_unit +
                            radius * local->per_unit <
                        UNITS_MOST;
    if (!fine)
        set_units(local, p, radius * 2);
}

#define FLOAT_SHARE 0x1p-20F /* 16 roundings of single precision */

/* Relative coordinates from units, w and e of points [0, n), and padding that
 * no scan mistakes for a point: up to two vectors, with e infinite. */
static void set_near(struct incode_local_points *local, uint32_t n) {
    yield_over(local, n);
    incode_vi lane = incode_vi_count();
    incode_vf zero = incode_vf_all(0), infinite = incode_vf_all(INFINITE);
    double share = local->scale / local->per_unit;
    incode_vf factor = incode_vf_all((float)share);
    incode_vi origin[3];
    for (int d = 0; d < 3; d++)
        origin[d] = incode_vi_all(unit_of(local, d, local->p0[d]));
    /* Two numbers are cut, each by less than a unit; the point itself may have
     * been rounded before. */
    local->doubt = 2.1 * share;
    incode_vf doubt = incode_vf_all((float)(2.1 * local->doubt));
    incode_vf all = incode_vf_all(FLOAT_SHARE);
    for (uint32_t i = 0; i < n + INCODE_VF_LANES; i += INCODE_VF_LANES) {
        incode_vi in = lane < incode_vi_all((int32_t)(n - i));
        incode_vf x = incode_vf_from(
                      incode_vi_minus(incode_vi_load(local->x + i), origin[0])),
                  y = incode_vf_from(
                      incode_vi_minus(incode_vi_load(local->y + i), origin[1])),
                  z = incode_vf_from(
                      incode_vi_minus(incode_vi_load(local->z + i), origin[2]));
        x = incode_vf_select(in, x * factor, zero);
        y = incode_vf_select(in, y * factor, zero);
        z = incode_vf_select(in, z * factor, zero);
        incode_vf l = incode_vf_abs(x) + incode_vf_abs(y) + incode_vf_abs(z);
        *(incode_vf *)(local->x + i) = x;
        *(incode_vf *)(local->y + i) = y;
        *(incode_vf *)(local->z + i) = z;
        *(incode_vf *)(local->w + i) =
            incode_vf_fma(x, x, incode_vf_fma(y, y, z * z));
        *(incode_vf *)(local->e + i) =
            incode_vf_select(in, incode_vf_fma(l, all, doubt), infinite);
    }
}

/* Packs what lies in the box; false: too many.  Cutting is monotone: a point
 * within the box is within it in units. */
static bool select_near(struct incode_local_points *local) {
    incode_vi lo[3], span[3];
    bool whole = true;
    incode_vi at = incode_vi_count();
    for (int d = 0; d < 3; d++) {
        int32_t a = unit_of(local, d, local->lo[d]),
                b = unit_of(local, d, local->hi[d]);
        lo[d] = incode_vi_all(a);
        span[d] =
            incode_vi_all(b >= a ? (int32_t)((uint32_t)b - (uint32_t)a) : 0);
        whole = whole && b >= a;
    }
    uint32_t n = 0;
    for (uint32_t i = 0, end = 0; i < local->around && whole;) {
        yield_over(local, AT_ONCE);
        end = end + AT_ONCE < local->around ? end + AT_ONCE : local->around;
        for (; i < end; i += INCODE_VF_LANES) {
            incode_vi x = incode_vi_load(local->unit[0] + i),
                      y = incode_vi_load(local->unit[1] + i),
                      z = incode_vi_load(local->unit[2] + i);
            uint32_t in = incode_vm_bits(incode_vi_within(x, lo[0], span[0]) &
                                         incode_vi_within(y, lo[1], span[1]) &
                                         incode_vi_within(z, lo[2], span[2]));
            if (local->around - i < INCODE_VF_LANES)
                in &= (UINT32_C(1) << (local->around - i)) - 1;
            incode_vi_pack(local->x + n, in, x);
            incode_vi_pack(local->y + n, in, y);
            incode_vi_pack(local->z + n, in, z);
            incode_vi_pack(local->at + n, in, at);
            incode_vi_pack(local->near_id + n, in,
                           incode_vi_load(local->id + i));
            at += incode_vi_all(INCODE_VF_LANES);
            n += (uint32_t)__builtin_popcount(in);
            if (n > INCODE_NEAR_POINTS)
                return false;
        }
    }
    local->near = n;
    return true;
}

/* One side of a box: the wall at `wall` of its direction `sign`, relative. */
static double side(const struct incode_local_points *local, int d, double wall,
                   double end, double sign) {
    bool beyond = sign > 0 ? wall >= end : wall <= end;
    double gap = wall - local->p0[d]; /* not infinite by overflow */
    gap = gap < DBL_MAX ? gap : DBL_MAX;
    gap = gap > -DBL_MAX ? gap : -DBL_MAX;
    return beyond ? sign * __builtin_inf() : gap * local->scale;
}

static void set_box(struct incode_local_points *local, double radius,
                    const double domain_lo[3], const double domain_hi[3]) {
    local->radius = radius;
    local->scale = incode_scale_for(radius);
    local->wall[3] = local->wall[7] = __builtin_inf();
    for (int d = 0; d < 3; d++) {
        double lo = local->p0[d] - radius, hi = local->p0[d] + radius;
        lo = lo > local->around_lo[d] ? lo : local->around_lo[d];
        hi = hi < local->around_hi[d] ? hi : local->around_hi[d];
        local->lo[d] = lo;
        local->hi[d] = hi;
        local->rlo[d] = side(local, d, lo, domain_lo[d], -1);
        local->rhi[d] = side(local, d, hi, domain_hi[d], 1);
        local->wall[d] = local->rhi[d];
        local->wall[4 + d] = -local->rlo[d];
    }
}

/* More points than there is room for in a box too small for units: none is
 * taken, and the box certifies nothing. */
static void give_up_near(struct incode_local_points *local) {
    local->near = 0;
    for (int d = 0; d < 3; d++) {
        local->lo[d] = local->rlo[d] = __builtin_inf();
        local->hi[d] = local->rhi[d] = -__builtin_inf();
        local->wall[d] = local->wall[4 + d] = -__builtin_inf();
    }
}

void incode_local_centre(struct incode_local_points *local, uint32_t vertex,
                         const double p[3], double radius,
                         const double domain_lo[3], const double domain_hi[3]) {
    local->vertex = vertex;
    memcpy(local->p0, p, sizeof local->p0);
    local->count = local->around; /* far vertices of the last one go */
    local->reach = 6;             /* three coordinates, each below 2 */
    choose_units(local, p, radius);
    set_box(local, radius, domain_lo, domain_hi);
    while (!select_near(local)) {
        if (radius * local->per_unit < UNITS_LEAST * 0.25) {
            give_up_near(local);
            break;
        }
        radius *= 0.8;
        choose_units(local, p, radius);
        set_box(local, radius, domain_lo, domain_hi);
    }
    set_near(local, local->near);
    local->self = incode_local_find(local, vertex);
}

enum { NEAR_MOST = INCODE_NEAR_POINTS + INCODE_AROUND_EXTRA };

/* Index of the first of n numbers that is `id`, or n. */
static uint32_t find(const uint32_t *ids, uint32_t n, uint32_t id) {
    incode_vi all = incode_vi_all((int32_t)id);
    for (uint32_t i = 0; i < n; i += INCODE_VF_LANES) {
        uint32_t m = incode_vf_mask(incode_vi_load(ids + i) == all);
        if (m != 0) {
            uint32_t found = i + (uint32_t)__builtin_ctz(m);
            return found < n ? found : n;
        }
    }
    return n;
}

/* Scans see point i from now on. */
static void see(struct incode_local_points *local, uint32_t i) {
    uint32_t k = local->near++;
    double r[3], square = 0, length = 0;
    incode_local_relative(local, i, r);
    for (int d = 0; d < 3; d++) {
        length += __builtin_fabs(r[d]);
        square += r[d] * r[d];
    }
    local->reach = length > local->reach ? length : local->reach;
    local->x[k] = (float)r[0];
    local->y[k] = (float)r[1];
    local->z[k] = (float)r[2];
    local->w[k] = (float)square;
    /* Farther than that, single precision says nothing of its square. */
    local->e[k] = length < 0x1p60
                      ? (float)(length * FLOAT_SHARE + 2.1 * local->doubt)
                      : INFINITE;
    local->at[k] = i;
    local->near_id[k] = local->id[i];
    /* What follows is padding. */
    for (uint32_t next = k + 1; next % INCODE_VF_LANES != 0; next++)
        local->x[next] = local->y[next] = local->z[next] = local->w[next] = 0;
    for (uint32_t next = k + 1; next % INCODE_VF_LANES != 0; next++)
        local->e[next] = INFINITE;
}

uint32_t incode_local_find(struct incode_local_points *local, uint32_t id) {
    uint32_t near = find(local->near_id, local->near, id);
    if (near < local->near)
        return local->at[near];
    uint32_t i = find(local->id, local->count, id);
    if (i == local->count)
        return INCODE_LOCAL_NONE;
    if (local->near < NEAR_MOST)
        see(local, i);
    return i;
}

uint32_t incode_local_append(struct incode_local_points *local, uint32_t id,
                             const double p[3]) {
    if (local->count == INCODE_AROUND_POINTS + INCODE_AROUND_EXTRA ||
        local->near == NEAR_MOST)
        return INCODE_LOCAL_NONE;
    uint32_t i = local->count++;
    local->id[i] = id;
    for (int d = 0; d < 3; d++)
        local->p[d][i] = p[d];
    see(local, i);
    return i;
}

/* ---- scans ---- */

struct bits {
    uint64_t word[INCODE_NEAR_ALL / 64 + 1];
};

/* The points whose bit is set. */
static uint32_t list(const struct incode_local_points *local,
                     const struct bits *bits, uint16_t out[INCODE_NEAR_ALL]) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < local->near; i += 64) {
        uint64_t word = bits->word[i / 64];
        if (local->near - i < 64)
            word &= (UINT64_C(1) << (local->near - i)) - 1;
        for (; word != 0; word &= word - 1)
            out[count++] =
                (uint16_t)local->at[i + (uint32_t)__builtin_ctzll(word)];
    }
    return count;
}

INCODE_INLINE void note(struct bits *bits, uint32_t i, incode_vm out) {
    uint64_t in = ~incode_vm_bits(out) & INCODE_VF_ALL;
    if (i % 64 == 0)
        bits->word[i / 64] = 0;
    bits->word[i / 64] |= in << (i % 64);
}

uint32_t incode_local_first(const struct incode_local_points *local,
                            const struct incode_pencil *pencil, double *t,
                            uint16_t out[INCODE_NEAR_ALL]) {
    alignas(64) float above[INCODE_NEAR_ALL], below[INCODE_NEAR_ALL];
    const double *c = pencil->c0;
    incode_vf nx = incode_vf_all((float)pencil->n[0]),
              ny = incode_vf_all((float)pencil->n[1]),
              nz = incode_vf_all((float)pencil->n[2]);
    incode_vf cx = incode_vf_all((float)(-2 * c[0])),
              cy = incode_vf_all((float)(-2 * c[1])),
              cz = incode_vf_all((float)(-2 * c[2]));
    incode_vf least = incode_vf_all(INFINITE);
    for (uint32_t i = 0; i < local->near; i += INCODE_VF_LANES) {
        incode_vf x = incode_vf_load(local->x + i),
                  y = incode_vf_load(local->y + i),
                  z = incode_vf_load(local->z + i);
        incode_vf b = incode_vf_fma(nx, x, incode_vf_fma(ny, y, nz * z));
        incode_vf a = incode_vf_fma(
            cx, x,
            incode_vf_fma(cy, y,
                          incode_vf_fma(cz, z, incode_vf_load(local->w + i))));
        *(incode_vf *)(above + i) = a;
        *(incode_vf *)(below + i) = b;
        incode_vm beyond = incode_vf_less(incode_vf_load(local->e + i), b);
        least = incode_vf_min_where(beyond, least, incode_vf_ratio(a, b));
    }
    float first = incode_vf_least_of(least);
    if (!(first < INFINITE))
        return 0;
    /* Wider than the ratio's error, as a rule; the caller makes sure. */
    *t = first + __builtin_fabs((double)first) * 0x1p-12 +
         pencil->size * 0x1p-16;
    double length = incode_max_norm(c);
    length = 4 * length + 2 * local->reach + 2 * __builtin_fabs(*t);
    float upper = (float)*t;
    upper += __builtin_fabsf(upper) * 0x1p-23F;
    *t = upper;
    incode_vf last = incode_vf_all(-upper),
              slack = incode_vf_all((float)length);
    struct bits bits;
    for (uint32_t i = 0; i < local->near; i += INCODE_VF_LANES) {
        incode_vf e = incode_vf_load(local->e + i);
        incode_vf b = incode_vf_load(below + i);
        incode_vf late = incode_vf_fma(last, b, incode_vf_load(above + i));
        note(&bits, i, incode_vf_less(slack * e, late) | incode_vf_less(b, -e));
    }
    return list(local, &bits, out);
}

static float float_up(double a) {
    return (float)a * (1 + 0x1p-22F);
}

uint32_t incode_local_inside(const struct incode_local_points *local,
                             const struct incode_sphere *s,
                             uint16_t out[INCODE_NEAR_ALL]) {
    /* One power of two for all coefficients keeps them in range. */
    double largest = incode_max_norm(s->m), det = __builtin_fabs(s->det);
    double scale = incode_scale_for(largest > det ? largest : det);
    /* e is 2^-20 of the length, and twice the doubt in each coordinate. */
    double slack = 2 * largest + 2 * det * local->reach +
                   0x1p20 * INCODE_SPHERE_EPS *
                       (incode_max_norm(s->pm) + s->pdet * local->reach);
    double square = 0x1p-20 * det + INCODE_SPHERE_EPS * s->pdet - s->det;
    /* The last terms: what underflows in single precision. */
    incode_vf mx = incode_vf_all((float)(s->m[0] * scale)),
              my = incode_vf_all((float)(s->m[1] * scale)),
              mz = incode_vf_all((float)(s->m[2] * scale)),
              mw = incode_vf_all((float)(square * scale) + 1e-37F),
              me = incode_vf_all(float_up(slack * scale) + 1e-37F),
              tiny = incode_vf_all(-1e-34F);
    struct bits bits;
    for (uint32_t i = 0; i < local->near; i += INCODE_VF_LANES) {
        incode_vf value = incode_vf_fma(mx, incode_vf_load(local->x + i),
                                        my * incode_vf_load(local->y + i)) +
                          incode_vf_fma(mz, incode_vf_load(local->z + i),
                                        mw * incode_vf_load(local->w + i));
        value = incode_vf_fma(me, incode_vf_load(local->e + i), value);
        note(&bits, i, incode_vf_less(value, tiny));
    }
    return list(local, &bits, out);
}
