#include "gather.h"

#include <string.h>

#include "check.h"
#include "simd.h"

static void convert(struct incode_gather *g, uint32_t first, uint32_t count)
{
    for (uint32_t i = first; i < first + count; i++) {
        double x = (g->p[0][i] - g->p0[0]) * g->scale;
        double y = (g->p[1][i] - g->p0[1]) * g->scale;
        double z = (g->p[2][i] - g->p0[2]) * g->scale;
        g->x[i] = (float)x;
        g->y[i] = (float)y;
        g->z[i] = (float)z;
        g->w[i] = (float)(x * x + y * y + z * z);
        g->l[i] =
            (float)(__builtin_fabs(x) + __builtin_fabs(y) + __builtin_fabs(z));
    }
}

static bool copy_leaves(struct incode_walker *walker, struct incode_query *q,
                        const struct incode_frame *frame, uint32_t brick,
                        uint32_t leaves, void *context)
{
    struct incode_gather *g = context;
    (void)walker;
    (void)q;
    if (++g->pages > g->pages_max)
        return false;
    for (; leaves != 0; leaves &= leaves - 1) {
        uint32_t slot = (uint32_t)__builtin_ctz(leaves) * INCODE_LEAF_POINTS;
        uint32_t n = frame->count - slot;
        n = n > INCODE_LEAF_POINTS ? INCODE_LEAF_POINTS : n;
        if (g->count + INCODE_LEAF_POINTS > INCODE_GATHER_POINTS)
            return false;
        memcpy(g->p[0] + g->count, frame->page.brick.x + slot, 64);
        memcpy(g->p[1] + g->count, frame->page.brick.y + slot, 64);
        memcpy(g->p[2] + g->count, frame->page.brick.z + slot, 64);
        for (uint32_t i = 0; i < INCODE_LEAF_POINTS; i++)
            g->id[g->count + i] = brick * INCODE_BRICK_POINTS + slot + i;
        convert(g, g->count, INCODE_LEAF_POINTS);
        g->count += n;
    }
    return true;
}

enum incode_gathered
incode_gather_fill(struct incode_gather *g, struct incode_walker *walker,
                   uint32_t vertex, const double p[3], double radius,
                   const double domain_lo[3], const double domain_hi[3])
{
    struct incode_query *q = &g->query;
    memset(q, 0, sizeof *q);
    q->question = INCODE_QUERY_BOX;
    q->boxed = true;
    g->vertex = vertex;
    g->scale = incode_scale_for(radius);
    g->radius = radius;
    g->count = g->pages = 0;
    for (int d = 0; d < 3; d++) {
        g->p0[d] = p[d];
        q->lo[d] = g->lo[d] = p[d] - radius;
        q->hi[d] = g->hi[d] = p[d] + radius;
        g->rlo[d] = (g->lo[d] - p[d]) * g->scale;
        g->rhi[d] = (g->hi[d] - p[d]) * g->scale;
        if (g->lo[d] <= domain_lo[d])
            g->rlo[d] = -__builtin_inf();
        if (g->hi[d] >= domain_hi[d])
            g->rhi[d] = __builtin_inf();
    }
    enum incode_walk r = incode_walk(walker, q, copy_leaves, g);
    g->points = g->count;
    if (r == INCODE_WALK_STOP)
        return INCODE_GATHER_CROWDED;
    return r == INCODE_WALK_WAIT ? INCODE_GATHER_WAIT : INCODE_GATHER_READY;
}

void incode_gather_disclaim(struct incode_gather *g)
{
    for (int d = 0; d < 3; d++) {
        g->lo[d] = g->hi[d] = g->p0[d];
        g->rlo[d] = g->rhi[d] = 0;
    }
}

uint32_t incode_gather_find(const struct incode_gather *g, uint32_t id)
{
    int32_t a = (int32_t)id;
    incode_vi all = {a, a, a, a, a, a, a, a, a, a, a, a, a, a, a, a};
    for (uint32_t i = 0; i < g->count; i += INCODE_VF_LANES) {
        uint32_t m = incode_vf_mask(
            *(const incode_vi *)(const void *)(g->id + i) == all);
        if (m != 0) {
            uint32_t found = i + (uint32_t)__builtin_ctz(m);
            return found < g->count ? found : INCODE_GATHER_NONE;
        }
    }
    return INCODE_GATHER_NONE;
}

uint32_t incode_gather_append(struct incode_gather *g, uint32_t id,
                              const double p[3])
{
    if (g->count == INCODE_GATHER_ALL)
        return INCODE_GATHER_NONE;
    uint32_t i = g->count++;
    g->id[i] = id;
    for (int d = 0; d < 3; d++)
        g->p[d][i] = p[d];
    convert(g, i, 1);
    return i;
}

/* Lanes of the last vector that hold points. */
static incode_vi lanes_below(uint32_t count)
{
    incode_vi lane = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    int32_t n = (int32_t)count;
    return lane < (incode_vi){n, n, n, n, n, n, n, n, n, n, n, n, n, n, n, n};
}

#define PLANE_SLACK 1e-6F /* rounding of n . p, relative to |x|+|y|+|z| */

uint32_t incode_gather_first(const struct incode_gather *g, const double n[3],
                             const double c2[3])
{
    incode_vf nx = incode_vf_all((float)n[0]), ny = incode_vf_all((float)n[1]),
              nz = incode_vf_all((float)n[2]);
    incode_vf cx = incode_vf_all((float)c2[0]),
              cy = incode_vf_all((float)c2[1]),
              cz = incode_vf_all((float)c2[2]);
    incode_vf slack = incode_vf_all(PLANE_SLACK);
    incode_vf top = incode_vf_all(0x1p100F), bottom = incode_vf_all(0x1p-20F);
    incode_vi lane = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    incode_vi step = {16, 16, 16, 16, 16, 16, 16, 16,
                      16, 16, 16, 16, 16, 16, 16, 16};
    incode_vi which = {-1, -1, -1, -1, -1, -1, -1, -1,
                       -1, -1, -1, -1, -1, -1, -1, -1};
    for (uint32_t i = 0; i < g->count; i += INCODE_VF_LANES) {
        incode_vf x = incode_vf_load(g->x + i), y = incode_vf_load(g->y + i),
                  z = incode_vf_load(g->z + i), w = incode_vf_load(g->w + i);
        incode_vf below = nx * x + ny * y + nz * z;
        incode_vf above = w - cx * x - cy * y - cz * z;
        incode_vi better = (below > slack * incode_vf_load(g->l + i)) &
                           (above * bottom < top * below);
        if (g->count - i < INCODE_VF_LANES)
            better &= lanes_below(g->count - i);
        top = incode_vf_select(better, above, top);
        bottom = incode_vf_select(better, below, bottom);
        which = (better & lane) | (~better & which);
        lane += step;
    }
    incode_vf t = top / bottom;
    uint32_t best = INCODE_GATHER_NONE;
    float least = 0;
    for (int k = 0; k < INCODE_VF_LANES; k++) {
        if (which[k] < 0 || (best != INCODE_GATHER_NONE && !(t[k] < least)))
            continue;
        least = t[k];
        best = (uint32_t)which[k];
    }
    return best;
}

static float float_up(double a)
{
    return (float)a * (1 + 0x1p-22F);
}

uint32_t incode_gather_inside(const struct incode_gather *g,
                              const struct incode_sphere *s,
                              uint16_t out[INCODE_GATHER_ALL])
{
    /* One power of two for all coefficients keeps them in range. */
    double largest = __builtin_fabs(s->det), slack = 0;
    for (int d = 0; d < 3; d++)
        largest = largest > __builtin_fabs(s->m[d]) ? largest
                                                    : __builtin_fabs(s->m[d]);
    double scale = incode_scale_for(largest);
    /* Single precision: 8 roundings of 2^-24 on each term, beside those of
     * the coefficients themselves. */
    for (int d = 0; d < 3; d++) {
        double k =
            0x1p-20 * __builtin_fabs(s->m[d]) + INCODE_SPHERE_EPS * s->pm[d];
        slack = k > slack ? k : slack;
    }
    double square =
        0x1p-20 * __builtin_fabs(s->det) + INCODE_SPHERE_EPS * s->pdet - s->det;
    /* The last terms: what underflows in single precision. */
    incode_vf mx = incode_vf_all((float)(s->m[0] * scale)),
              my = incode_vf_all((float)(s->m[1] * scale)),
              mz = incode_vf_all((float)(s->m[2] * scale)),
              mw = incode_vf_all((float)(square * scale) + 1e-37F),
              ml = incode_vf_all(float_up(slack * scale) + 1e-37F),
              tiny = incode_vf_all(-1e-34F);
    uint32_t count = 0;
    for (uint32_t i = 0; i < g->count; i += INCODE_VF_LANES) {
        incode_vf value =
            mx * incode_vf_load(g->x + i) + my * incode_vf_load(g->y + i) +
            mz * incode_vf_load(g->z + i) + mw * incode_vf_load(g->w + i) +
            ml * incode_vf_load(g->l + i);
        uint32_t in = ~incode_vf_mask(value < tiny) & 0xffff;
        for (; in != 0; in &= in - 1) {
            uint32_t k = i + (uint32_t)__builtin_ctz(in);
            if (k < g->count)
                out[count++] = (uint16_t)k;
        }
    }
    return count;
}
