#include "local_points.h"

#include <float.h>
#include <string.h>

#include "incode/predicates/check.h"
#include "simd.h"

#define INFINITE __builtin_inff()

void incode_gather_reset(struct incode_gather *g)
{
    g->leaf = INCODE_NONE;
    g->around = g->count = 0;
    g->near = 0;
}

/* ---- around a leaf ---- */

static bool copy_leaves(struct incode_walker *walker, struct incode_query *q,
                        const struct incode_frame *frame, uint32_t brick,
                        uint32_t leaves, void *context)
{
    struct incode_gather *g = context;
    (void)walker;
    const struct incode_brick *b = &frame->page.brick;
    for (; leaves != 0; leaves &= leaves - 1) {
        uint32_t slot = (uint32_t)__builtin_ctz(leaves) * INCODE_LEAF_POINTS;
        uint32_t end = slot + INCODE_LEAF_POINTS;
        if (g->around + INCODE_LEAF_POINTS > INCODE_AROUND_POINTS)
            return false;
        for (; slot < end && slot < frame->count; slot += INCODE_VD_LANES) {
            incode_vd x = incode_vd_load(b->x + slot),
                      y = incode_vd_load(b->y + slot),
                      z = incode_vd_load(b->z + slot);
            uint32_t n = frame->count - slot;
            uint32_t in = incode_vd_mask((x >= incode_vd_all(q->lo[0])) &
                                         (x <= incode_vd_all(q->hi[0])) &
                                         (y >= incode_vd_all(q->lo[1])) &
                                         (y <= incode_vd_all(q->hi[1])) &
                                         (z >= incode_vd_all(q->lo[2])) &
                                         (z <= incode_vd_all(q->hi[2])));
            if (n < INCODE_VD_LANES)
                in &= (UINT32_C(1) << n) - 1;
            incode_vd_pack(g->p[0] + g->around, in, x);
            incode_vd_pack(g->p[1] + g->around, in, y);
            incode_vd_pack(g->p[2] + g->around, in, z);
            incode_pack_count(g->id + g->around, in,
                              brick * INCODE_BRICK_POINTS + slot);
            g->around += (uint32_t)__builtin_popcount(in);
        }
    }
    return true;
}

enum incode_gathered
incode_gather_around(struct incode_gather *g, struct incode_walker *walker,
                     const struct incode_vicinity *vicinity, uint32_t leaf,
                     const double lo[3], const double hi[3], double radius)
{
    struct incode_query *q = &g->query;
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_BOX;
    q->boxed = true;
    q->pages_max = g->pages_max; /* all must be resident at once */
    g->leaf = INCODE_NONE;
    g->around = 0;
    g->radius = radius;
    for (int d = 0; d < 3; d++) {
        q->lo[d] = g->around_lo[d] = lo[d] - radius;
        q->hi[d] = g->around_hi[d] = hi[d] + radius;
    }
    enum incode_walk r =
        incode_vicinity_holds(vicinity, q->lo, q->hi)
            ? incode_vicinity_visit(vicinity, walker, q, copy_leaves, g)
            : incode_walk(walker, q, copy_leaves, g);
    g->count = g->around;
    g->per_unit = 0;
    if (r == INCODE_WALK_WAIT)
        return INCODE_GATHER_WAIT;
    g->leaf = leaf;
    if (r == INCODE_WALK_DONE)
        return INCODE_GATHER_READY;
    /* Not the whole box: what was copied serves, but certifies nothing. */
    for (int d = 0; d < 3; d++) {
        g->around_lo[d] = __builtin_inf();
        g->around_hi[d] = -__builtin_inf();
    }
    return INCODE_GATHER_CROWDED;
}

/* ---- around a vertex ---- */

/* The points around the leaf in whole units, up to about 2^30 of them to each
 * side of the origin; what lies beyond is moved to the border. */
#define UNITS_HALF 0x1p29
#define UNITS_MOST 1610612736.0 /* 1.5 times 2^30 */
#define UNITS_LEAST 4096        /* a radius */

INCODE_INLINE incode_vd in_units(incode_vd p, double origin, double per_unit)
{
    incode_vd a = (p - incode_vd_all(origin)) * incode_vd_all(per_unit);
    return incode_vd_max(incode_vd_min(a, incode_vd_all(UNITS_MOST)),
                         incode_vd_all(-UNITS_MOST));
}

static int32_t unit_of(const struct incode_gather *g, int d, double p)
{
    double a = (p - g->origin[d]) * g->per_unit;
    a = a < UNITS_MOST ? a : UNITS_MOST;
    return (int32_t)(a > -UNITS_MOST ? a : -UNITS_MOST);
}

static void set_units(struct incode_gather *g, const double origin[3],
                      double half)
{
    g->per_unit =
        incode_scale_for(half > 0x1p-900 ? half : 0x1p-900) * UNITS_HALF;
    memcpy(g->origin, origin, sizeof g->origin);
    for (uint32_t i = 0; i < g->around; i += INCODE_VD_LANES)
        for (int d = 0; d < 3; d++)
            incode_vd_cut(g->unit[d] + i, in_units(incode_vd_load(g->p[d] + i),
                                                   origin[d], g->per_unit));
}

/* Units that tell apart what is around p: those of the leaf as a rule. */
static void choose_units(struct incode_gather *g, const double p[3],
                         double radius)
{
    if (g->per_unit == 0) {
        double origin[3], half = radius;
        for (int d = 0; d < 3; d++) {
            double lo = g->around_lo[d], hi = g->around_hi[d];
            bool whole = lo <= hi;
            double h = whole ? hi * 0.5 - lo * 0.5 : 0;
            origin[d] = whole ? lo * 0.5 + hi * 0.5 : p[d];
            half = h > half ? h : half;
        }
        set_units(g, origin, half);
    }
    bool fine = radius * g->per_unit >= UNITS_LEAST;
    for (int d = 0; d < 3; d++)
        fine = fine && __builtin_fabs(p[d] - g->origin[d]) * g->per_unit +
                               radius * g->per_unit <
                           UNITS_MOST;
    if (!fine)
        set_units(g, p, radius * 2);
}

#define FLOAT_SHARE 0x1p-20F /* 16 roundings of single precision */

/* Relative coordinates from units, w and e of points [0, n), and padding that
 * no scan mistakes for a point: up to two vectors, with e infinite. */
static void set_near(struct incode_gather *g, uint32_t n)
{
    incode_vi lane = incode_vi_count();
    incode_vf zero = incode_vf_all(0), infinite = incode_vf_all(INFINITE);
    double share = g->scale / g->per_unit;
    incode_vf factor = incode_vf_all((float)share);
    incode_vi origin[3];
    for (int d = 0; d < 3; d++)
        origin[d] = incode_vi_all(unit_of(g, d, g->p0[d]));
    /* Two numbers are cut, each by less than a unit; the point itself may have
     * been rounded before. */
    g->doubt = 2.1 * share;
    incode_vf doubt = incode_vf_all((float)(2.1 * g->doubt));
    incode_vf all = incode_vf_all(FLOAT_SHARE);
    for (uint32_t i = 0; i < n + INCODE_VF_LANES; i += INCODE_VF_LANES) {
        incode_vi in = lane < incode_vi_all((int32_t)(n - i));
        incode_vf x = incode_vf_from(
                      incode_vi_minus(incode_vi_load(g->x + i), origin[0])),
                  y = incode_vf_from(
                      incode_vi_minus(incode_vi_load(g->y + i), origin[1])),
                  z = incode_vf_from(
                      incode_vi_minus(incode_vi_load(g->z + i), origin[2]));
        x = incode_vf_select(in, x * factor, zero);
        y = incode_vf_select(in, y * factor, zero);
        z = incode_vf_select(in, z * factor, zero);
        incode_vf l = incode_vf_abs(x) + incode_vf_abs(y) + incode_vf_abs(z);
        *(incode_vf *)(g->x + i) = x;
        *(incode_vf *)(g->y + i) = y;
        *(incode_vf *)(g->z + i) = z;
        *(incode_vf *)(g->w + i) =
            incode_vf_fma(x, x, incode_vf_fma(y, y, z * z));
        *(incode_vf *)(g->e + i) =
            incode_vf_select(in, incode_vf_fma(l, all, doubt), infinite);
    }
}

/* Packs what lies in the box; false: too many.  Cutting is monotone: a point
 * within the box is within it in units. */
static bool select_near(struct incode_gather *g)
{
    incode_vi lo[3], span[3];
    bool whole = true;
    incode_vi at = incode_vi_count();
    for (int d = 0; d < 3; d++) {
        int32_t a = unit_of(g, d, g->lo[d]), b = unit_of(g, d, g->hi[d]);
        lo[d] = incode_vi_all(a);
        span[d] =
            incode_vi_all(b >= a ? (int32_t)((uint32_t)b - (uint32_t)a) : 0);
        whole = whole && b >= a;
    }
    uint32_t n = 0;
    for (uint32_t i = 0; i < g->around && whole; i += INCODE_VF_LANES) {
        incode_vi x = incode_vi_load(g->unit[0] + i),
                  y = incode_vi_load(g->unit[1] + i),
                  z = incode_vi_load(g->unit[2] + i);
        uint32_t in = incode_vm_bits(incode_vi_within(x, lo[0], span[0]) &
                                     incode_vi_within(y, lo[1], span[1]) &
                                     incode_vi_within(z, lo[2], span[2]));
        if (g->around - i < INCODE_VF_LANES)
            in &= (UINT32_C(1) << (g->around - i)) - 1;
        incode_vi_pack(g->x + n, in, x);
        incode_vi_pack(g->y + n, in, y);
        incode_vi_pack(g->z + n, in, z);
        incode_vi_pack(g->at + n, in, at);
        incode_vi_pack(g->near_id + n, in, incode_vi_load(g->id + i));
        at += incode_vi_all(INCODE_VF_LANES);
        n += (uint32_t)__builtin_popcount(in);
        if (n > INCODE_NEAR_POINTS)
            return false;
    }
    g->near = n;
    return true;
}

/* One side of a box: the wall at `wall` of its direction `sign`, relative. */
static double side(const struct incode_gather *g, int d, double wall,
                   double end, double sign)
{
    bool beyond = sign > 0 ? wall >= end : wall <= end;
    double gap = wall - g->p0[d]; /* not infinite by overflow */
    gap = gap < DBL_MAX ? gap : DBL_MAX;
    gap = gap > -DBL_MAX ? gap : -DBL_MAX;
    return beyond ? sign * __builtin_inf() : gap * g->scale;
}

static void set_box(struct incode_gather *g, double radius,
                    const double domain_lo[3], const double domain_hi[3])
{
    g->radius = radius;
    g->scale = incode_scale_for(radius);
    g->wall[3] = g->wall[7] = __builtin_inf();
    for (int d = 0; d < 3; d++) {
        double lo = g->p0[d] - radius, hi = g->p0[d] + radius;
        lo = lo > g->around_lo[d] ? lo : g->around_lo[d];
        hi = hi < g->around_hi[d] ? hi : g->around_hi[d];
        g->lo[d] = lo;
        g->hi[d] = hi;
        g->rlo[d] = side(g, d, lo, domain_lo[d], -1);
        g->rhi[d] = side(g, d, hi, domain_hi[d], 1);
        g->wall[d] = g->rhi[d];
        g->wall[4 + d] = -g->rlo[d];
    }
}

/* More points than there is room for in a box too small for units: none is
 * taken, and the box certifies nothing. */
static void give_up_near(struct incode_gather *g)
{
    g->near = 0;
    for (int d = 0; d < 3; d++) {
        g->lo[d] = g->rlo[d] = __builtin_inf();
        g->hi[d] = g->rhi[d] = -__builtin_inf();
        g->wall[d] = g->wall[4 + d] = -__builtin_inf();
    }
}

void incode_gather_centre(struct incode_gather *g, uint32_t vertex,
                          const double p[3], double radius,
                          const double domain_lo[3], const double domain_hi[3])
{
    g->vertex = vertex;
    memcpy(g->p0, p, sizeof g->p0);
    g->count = g->around; /* far vertices of the last one go */
    g->reach = 6;         /* three coordinates, each below 2 */
    choose_units(g, p, radius);
    set_box(g, radius, domain_lo, domain_hi);
    while (!select_near(g)) {
        if (radius * g->per_unit < UNITS_LEAST * 0.25) {
            give_up_near(g);
            break;
        }
        radius *= 0.8;
        choose_units(g, p, radius);
        set_box(g, radius, domain_lo, domain_hi);
    }
    set_near(g, g->near);
    g->self = incode_gather_find(g, vertex);
}

enum { NEAR_MOST = INCODE_NEAR_POINTS + INCODE_AROUND_EXTRA };

/* Index of the first of n numbers that is `id`, or n. */
static uint32_t find(const uint32_t *ids, uint32_t n, uint32_t id)
{
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
static void see(struct incode_gather *g, uint32_t i)
{
    uint32_t k = g->near++;
    double r[3], square = 0, length = 0;
    incode_gather_relative(g, i, r);
    for (int d = 0; d < 3; d++) {
        length += __builtin_fabs(r[d]);
        square += r[d] * r[d];
    }
    g->reach = length > g->reach ? length : g->reach;
    g->x[k] = (float)r[0];
    g->y[k] = (float)r[1];
    g->z[k] = (float)r[2];
    g->w[k] = (float)square;
    /* Farther than that, single precision says nothing of its square. */
    g->e[k] = length < 0x1p60 ? (float)(length * FLOAT_SHARE + 2.1 * g->doubt)
                              : INFINITE;
    g->at[k] = i;
    g->near_id[k] = g->id[i];
    /* What follows is padding. */
    for (uint32_t next = k + 1; next % INCODE_VF_LANES != 0; next++)
        g->x[next] = g->y[next] = g->z[next] = g->w[next] = 0;
    for (uint32_t next = k + 1; next % INCODE_VF_LANES != 0; next++)
        g->e[next] = INFINITE;
}

uint32_t incode_gather_find(struct incode_gather *g, uint32_t id)
{
    uint32_t near = find(g->near_id, g->near, id);
    if (near < g->near)
        return g->at[near];
    uint32_t i = find(g->id, g->count, id);
    if (i == g->count)
        return INCODE_GATHER_NONE;
    if (g->near < NEAR_MOST)
        see(g, i);
    return i;
}

uint32_t incode_gather_append(struct incode_gather *g, uint32_t id,
                              const double p[3])
{
    if (g->count == INCODE_AROUND_POINTS + INCODE_AROUND_EXTRA ||
        g->near == NEAR_MOST)
        return INCODE_GATHER_NONE;
    uint32_t i = g->count++;
    g->id[i] = id;
    for (int d = 0; d < 3; d++)
        g->p[d][i] = p[d];
    see(g, i);
    return i;
}

/* ---- scans ---- */

struct bits {
    uint64_t word[INCODE_NEAR_ALL / 64 + 1];
};

/* The points whose bit is set. */
static uint32_t list(const struct incode_gather *g, const struct bits *bits,
                     uint16_t out[INCODE_NEAR_ALL])
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < g->near; i += 64) {
        uint64_t word = bits->word[i / 64];
        if (g->near - i < 64)
            word &= (UINT64_C(1) << (g->near - i)) - 1;
        for (; word != 0; word &= word - 1)
            out[count++] = (uint16_t)g->at[i + (uint32_t)__builtin_ctzll(word)];
    }
    return count;
}

INCODE_INLINE void note(struct bits *bits, uint32_t i, incode_vm out)
{
    uint64_t in = ~incode_vm_bits(out) & INCODE_VF_ALL;
    if (i % 64 == 0)
        bits->word[i / 64] = 0;
    bits->word[i / 64] |= in << (i % 64);
}

uint32_t incode_gather_first(const struct incode_gather *g,
                             const struct incode_pencil *pencil, double *t,
                             uint16_t out[INCODE_NEAR_ALL])
{
    alignas(64) float above[INCODE_NEAR_ALL], below[INCODE_NEAR_ALL];
    const double *c = pencil->c0;
    incode_vf nx = incode_vf_all((float)pencil->n[0]),
              ny = incode_vf_all((float)pencil->n[1]),
              nz = incode_vf_all((float)pencil->n[2]);
    incode_vf cx = incode_vf_all((float)(-2 * c[0])),
              cy = incode_vf_all((float)(-2 * c[1])),
              cz = incode_vf_all((float)(-2 * c[2]));
    incode_vf least = incode_vf_all(INFINITE);
    for (uint32_t i = 0; i < g->near; i += INCODE_VF_LANES) {
        incode_vf x = incode_vf_load(g->x + i), y = incode_vf_load(g->y + i),
                  z = incode_vf_load(g->z + i);
        incode_vf b = incode_vf_fma(nx, x, incode_vf_fma(ny, y, nz * z));
        incode_vf a = incode_vf_fma(
            cx, x,
            incode_vf_fma(cy, y,
                          incode_vf_fma(cz, z, incode_vf_load(g->w + i))));
        *(incode_vf *)(above + i) = a;
        *(incode_vf *)(below + i) = b;
        incode_vm beyond = incode_vf_less(incode_vf_load(g->e + i), b);
        least = incode_vf_min_where(beyond, least, incode_vf_ratio(a, b));
    }
    float first = incode_vf_least_of(least);
    if (!(first < INFINITE))
        return 0;
    /* Wider than the ratio's error, as a rule; the caller makes sure. */
    *t = first + __builtin_fabs((double)first) * 0x1p-12 +
         pencil->size * 0x1p-16;
    double length = incode_max_norm(c);
    length = 4 * length + 2 * g->reach + 2 * __builtin_fabs(*t);
    float upper = (float)*t;
    upper += __builtin_fabsf(upper) * 0x1p-23F;
    *t = upper;
    incode_vf last = incode_vf_all(-upper),
              slack = incode_vf_all((float)length);
    struct bits bits;
    for (uint32_t i = 0; i < g->near; i += INCODE_VF_LANES) {
        incode_vf e = incode_vf_load(g->e + i);
        incode_vf b = incode_vf_load(below + i);
        incode_vf late = incode_vf_fma(last, b, incode_vf_load(above + i));
        note(&bits, i, incode_vf_less(slack * e, late) | incode_vf_less(b, -e));
    }
    return list(g, &bits, out);
}

static float float_up(double a)
{
    return (float)a * (1 + 0x1p-22F);
}

uint32_t incode_gather_inside(const struct incode_gather *g,
                              const struct incode_sphere *s,
                              uint16_t out[INCODE_NEAR_ALL])
{
    /* One power of two for all coefficients keeps them in range. */
    double largest = incode_max_norm(s->m), det = __builtin_fabs(s->det);
    double scale = incode_scale_for(largest > det ? largest : det);
    /* e is 2^-20 of the length, and twice the doubt in each coordinate. */
    double slack = 2 * largest + 2 * det * g->reach +
                   0x1p20 * INCODE_SPHERE_EPS *
                       (incode_max_norm(s->pm) + s->pdet * g->reach);
    double square = 0x1p-20 * det + INCODE_SPHERE_EPS * s->pdet - s->det;
    /* The last terms: what underflows in single precision. */
    incode_vf mx = incode_vf_all((float)(s->m[0] * scale)),
              my = incode_vf_all((float)(s->m[1] * scale)),
              mz = incode_vf_all((float)(s->m[2] * scale)),
              mw = incode_vf_all((float)(square * scale) + 1e-37F),
              me = incode_vf_all(float_up(slack * scale) + 1e-37F),
              tiny = incode_vf_all(-1e-34F);
    struct bits bits;
    for (uint32_t i = 0; i < g->near; i += INCODE_VF_LANES) {
        incode_vf value = incode_vf_fma(mx, incode_vf_load(g->x + i),
                                        my * incode_vf_load(g->y + i)) +
                          incode_vf_fma(mz, incode_vf_load(g->z + i),
                                        mw * incode_vf_load(g->w + i));
        value = incode_vf_fma(me, incode_vf_load(g->e + i), value);
        note(&bits, i, incode_vf_less(value, tiny));
    }
    return list(g, &bits, out);
}
