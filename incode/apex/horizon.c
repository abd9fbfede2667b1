#include "horizon.h"

#include <float.h>
#include <string.h>

#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

/* ---- memory ---- */

enum {
    NUMBERS = 24, /* floats a box */
    BOX_BYTES = NUMBERS * 4 + 2 * 4 + 2,
    PAGE_UNITS = 24, /* of incode/predicates/yield.h */
    BOX_UNITS = 2
};

size_t incode_horizon_bytes(uint32_t boxes, uint32_t copies) {
    struct incode_horizon *h = NULL;
    return boxes * (size_t)BOX_BYTES + copies * sizeof *h->point;
}

void incode_horizon_init(struct incode_horizon *h, void *memory, uint32_t boxes,
                         uint32_t copies, struct incode_yield *yield) {
    INCODE_ASSERT(boxes >= INCODE_HORIZON_MIN && boxes <= INCODE_HORIZON_MAX &&
                  boxes % 64 == 0 && copies >= 1 &&
                  copies <= INCODE_HORIZON_COPIES);
    incode_yield_fill(yield, memory, 0, incode_horizon_bytes(boxes, copies));
    memset(h, 0, sizeof *h);
    h->boxes = boxes;
    h->room = copies;
    h->centre = INCODE_NONE;
    h->point = memory;
    float *number = h->point[copies][0];
    float **const each[NUMBERS] = {
        &h->lo[0],    &h->lo[1],   &h->lo[2],   &h->hi[0],    &h->hi[1],
        &h->hi[2],    &h->o[0],    &h->o[1],    &h->o[2],     &h->a[0][0],
        &h->a[0][1],  &h->a[0][2], &h->a[1][0], &h->a[1][1],  &h->a[1][2],
        &h->a[2][0],  &h->a[2][1], &h->a[2][2], &h->slope[0], &h->slope[1],
        &h->slope[2], &h->lid,     &h->far,     &h->doubt};
    for (int i = 0; i < NUMBERS; i++, number += boxes)
        *each[i] = number;
    h->page = (uint32_t *)(void *)number;
    h->left = h->page + boxes;
    h->level = (uint8_t *)(void *)(h->left + boxes);
    h->copy = h->level + boxes;
}

/* ---- boxes in the horizon's units ---- */

/* Rounding outward, a part of a coordinate. */
#define OUTWARD 0x1p-22

/* INCODE_HORIZON_DOUBT for the half axes, as a part of radius (D far + |M|),
 * with the part in 2^20 of the radius that a lifted box does not hold. */
#define AXES_DOUBT 0x1p-17

/* Below that, a coordinate is 0, and a distance too small for squares to be
 * numbers of single precision. */
#define SMALLEST 1e-30F
#define LEAST_FAR 1e-15F

/* Beyond that, a coordinate tells nothing. */
#define FARTHEST 1e15

/* What is not a number may be anywhere. */
static inline float below(double a) {
    a -= OUTWARD * (1 + __builtin_fabs(a));
    a = a < FARTHEST ? a : FARTHEST;
    return (float)(a > -FARTHEST ? a : -1e30);
}

static inline float below_number(double a) {
    return a == a ? below(a) : -1e30F;
}

static inline float above_number(double a) {
    return -below_number(-a);
}

/* A page in the horizon's units: its origin, its unit, and its children's boxes
 * along the axes. */
struct view {
    const struct incode_boxes *boxes;
    double at[3], unit;
    alignas(64) float lo[3][INCODE_FANOUT];
    alignas(64) float hi[3][INCODE_FANOUT];
    alignas(64) float far[INCODE_FANOUT];
};

/* The boxes' coordinates, widened by what their rounding may do: a part of
 * each, and in double precision a part of the page, so that small boxes stay
 * small where they lie near the origin. */
static void set_sides(struct view *view) {
    const struct incode_boxes *boxes = view->boxes;
    float far[INCODE_FANOUT] = {0};
    for (int d = 0; d < 3; d++) {
        double slack = 0x1p-50 * (__builtin_fabs(view->at[d]) + 2 * view->unit);
        double unit = view->unit, at = view->at[d];
        for (int i = 0; i < INCODE_FANOUT; i++) {
            double a = boxes->lo[d][i] * unit + at - slack;
            double b = boxes->hi[d][i] * unit + at + slack;
            /* Of either sign; where there is no child, infinite. */
            float lo = (float)(a * (a > 0 ? 1 - OUTWARD : 1 + OUTWARD));
            float hi = (float)(b * (b > 0 ? 1 + OUTWARD : 1 - OUTWARD));
            view->lo[d][i] = lo - SMALLEST;
            view->hi[d][i] = hi + SMALLEST;
            far[i] += -lo > hi ? -lo : hi;
        }
    }
    for (int i = 0; i < INCODE_FANOUT; i++)
        view->far[i] = far[i] * (1 + 0x1p-20F) + LEAST_FAR;
}

/* Too far off to be told apart: anywhere. */
static void set_anywhere(struct view *view) {
    for (int i = 0; i < INCODE_FANOUT; i++) {
        for (int d = 0; d < 3; d++) {
            view->lo[d][i] = -1e30F;
            view->hi[d][i] = 1e30F;
        }
        view->far[i] = INCODE_ANYWHERE;
    }
}

static void set_view(struct view *view, const struct incode_horizon *h,
                     const struct incode_frame *frame) {
    bool near = true;
    view->boxes = &frame->page.boxes;
    view->unit = view->boxes->unit * h->scale;
    near = view->unit < FARTHEST && view->unit > 1e-15;
    for (int d = 0; d < 3; d++) { /* halves: a difference could overflow */
        view->at[d] =
            (view->boxes->origin[d] * 0.5 - h->origin[d] * 0.5) * h->scale * 2;
        near = near && __builtin_fabs(view->at[d]) < FARTHEST;
    }
    if (near)
        set_sides(view);
    else
        set_anywhere(view);
}

/* Adds a box of a page, with the axes' box of its child. */
static uint32_t add_box(struct incode_horizon *h, const struct view *view,
                        unsigned child, uint32_t page, uint32_t level) {
    uint32_t i = h->count++;
    h->page[i] = page;
    h->level[i] = (uint8_t)level;
    h->left[i] = 0;
    h->copy[i] = INCODE_NO_COPY;
    h->far[i] = view->far[child];
    h->lid[i] = -__builtin_inff();
    h->doubt[i] = 0;
    for (int d = 0; d < 3; d++) {
        h->lo[d][i] = view->lo[d][child];
        h->hi[d][i] = view->hi[d][child];
    }
    return i;
}

static void set_lifted(struct incode_horizon *h, uint32_t i,
                       const struct view *view, unsigned child) {
    struct incode_lifted l;
    double square = view->unit * view->unit;
    if (!(h->far[i] < FARTHEST) || !(square > 1e-30) ||
        !incode_boxes_lifted(view->boxes, child, &l))
        return;
    double far = 2 * view->unit;
    for (int d = 0; d < 3; d++) {
        far += __builtin_fabs(view->at[d]);
        h->o[d][i] = (float)(view->at[d] + view->unit * l.o[d]);
        h->slope[d][i] = (float)(square * l.slope[d]);
        for (int k = 0; k < 3; k++)
            h->a[k][d][i] = (float)(view->unit * l.a[k][d]);
    }
    h->lid[i] = (float)(square * l.lid);
    /* What is added are the roundings of o in double precision. */
    h->doubt[i] = (float)(AXES_DOUBT * view->unit * l.radius + 0x1p-48 * far);
}

/* ---- making it ---- */

struct making {
    struct incode_horizon *h;
    struct incode_walker *walker;
    float lo[3], hi[3];
    uint32_t missing;
};

/* The children of a page, one bit each. */
static uint32_t children_of(const struct incode_tree *tree, uint32_t level,
                            uint32_t index) {
    uint32_t count = tree->count[level - 1] - index * INCODE_FANOUT;
    return count >= INCODE_FANOUT ? UINT32_MAX : (UINT32_C(1) << count) - 1;
}

/* The children that meet the horizon's box. */
static uint32_t near_children(const struct making *m, const struct view *view) {
    uint32_t near = 0;
    for (unsigned i = 0; i < INCODE_FANOUT; i += INCODE_VF_LANES) {
        incode_vm out = incode_vf_less(incode_vf_all(m->hi[0]),
                                       incode_vf_load(view->lo[0] + i));
        for (int d = 0; d < 3; d++)
            out |= incode_vf_less(incode_vf_all(m->hi[d]),
                                  incode_vf_load(view->lo[d] + i)) |
                   incode_vf_less(incode_vf_load(view->hi[d] + i),
                                  incode_vf_all(m->lo[d]));
        near |= (~incode_vm_bits(out) & INCODE_VF_ALL) << i;
    }
    return near;
}

static bool add_brick(struct incode_horizon *h, const struct view *view,
                      unsigned child, uint32_t brick) {
    if (h->count == incode_horizon_near(h))
        return false;
    uint32_t i = add_box(h, view, child, brick, 0);
    set_lifted(h, i, view, child);
    if (brick == h->centre)
        h->self = i;
    return true;
}

/* One box for all children that have none of their own. */
static bool add_rest(struct incode_horizon *h, const struct view *view,
                     uint32_t page, uint32_t level, uint32_t left) {
    if (left == 0)
        return true;
    if (h->count == incode_horizon_near(h))
        return false;
    uint32_t i = add_box(h, view, (unsigned)__builtin_ctz(left), page, level);
    h->left[i] = left;
    for (left &= left - 1; left != 0; left &= left - 1) {
        unsigned child = (unsigned)__builtin_ctz(left);
        for (int d = 0; d < 3; d++) {
            float lo = view->lo[d][child], hi = view->hi[d][child];
            h->lo[d][i] = lo < h->lo[d][i] ? lo : h->lo[d][i];
            h->hi[d][i] = hi > h->hi[d][i] ? hi : h->hi[d][i];
        }
    }
    /* Its corner may be farther off than that of any of them. */
    float far = 0;
    for (int d = 0; d < 3; d++) {
        float lo = __builtin_fabsf(h->lo[d][i]);
        float hi = __builtin_fabsf(h->hi[d][i]);
        far += lo > hi ? lo : hi;
    }
    h->far[i] = far * (1 + 0x1p-20F) + LEAST_FAR;
    return true;
}

static enum incode_step add_page(struct making *m, uint32_t level,
                                 uint32_t index) {
    const struct incode_tree *tree = m->walker->tree;
    uint32_t page = tree->base[level] + index, first = index * INCODE_FANOUT;
    const struct incode_frame *f = incode_pager_get(m->walker->pager, page);
    struct view view;
    m->missing = page;
    if (f == NULL)
        return INCODE_WAITING;
    incode_walker_yield(m->walker, PAGE_UNITS);
    set_view(&view, m->h, f);
    uint32_t all = children_of(tree, level, index);
    uint32_t near = all & near_children(m, &view);
    if (!add_rest(m->h, &view, page, level, all & ~near))
        return INCODE_FULL;
    for (; near != 0; near &= near - 1) {
        unsigned child = (unsigned)__builtin_ctz(near);
        enum incode_step r = INCODE_FINISHED;
        incode_walker_yield(m->walker, BOX_UNITS);
        if (level > 1)
            r = add_page(m, level - 1, first + child);
        else if (!add_brick(m->h, &view, child, first + child))
            r = INCODE_FULL;
        if (r != INCODE_FINISHED)
            return r;
    }
    return INCODE_FINISHED;
}

static void set_empty(struct incode_horizon *h) {
    h->count = h->near = h->next = 0;
    for (int d = 0; d < 3; d++) {
        h->box_lo[d] = __builtin_inf();
        h->box_hi[d] = -__builtin_inf();
    }
}

enum incode_step incode_horizon_make(struct incode_horizon *h,
                                     struct incode_walker *walker,
                                     uint32_t brick, const double lo[3],
                                     const double hi[3], uint32_t *missing) {
    struct making m = {.h = h, .walker = walker};
    double extent = 0;
    set_empty(h);
    h->self = 0;
    for (int d = 0; d < 3; d++) {
        /* A box that overflows ends where doubles do. */
        double from = lo[d] > -DBL_MAX ? lo[d] : -DBL_MAX;
        double to = hi[d] < DBL_MAX ? hi[d] : DBL_MAX;
        double half = to * 0.5 - from * 0.5;
        h->origin[d] = from * 0.5 + to * 0.5;
        extent = half > extent ? half : extent;
        h->box_lo[d] = lo[d];
        h->box_hi[d] = hi[d];
    }
    h->scale = incode_scale_for(extent);
    for (int d = 0; d < 3; d++) {
        m.lo[d] = below_number((lo[d] - h->origin[d]) * h->scale);
        m.hi[d] = above_number((hi[d] - h->origin[d]) * h->scale);
    }
    h->centre = brick;
    enum incode_step r = add_page(&m, walker->tree->levels - 1, 0);
    *missing = m.missing;
    h->near = h->count;
    if (r != INCODE_FINISHED)
        set_empty(h);
    if (r == INCODE_WAITING)
        h->centre = INCODE_NONE;
    return r;
}

/* ---- what a cap reaches ---- */

bool incode_horizon_cap(const struct incode_horizon *h,
                        struct incode_horizon_cap *cap, const double pv[3],
                        double scale, const double m[3], double det,
                        const double n[3]) {
    /* r = y ratio; the value is divided by ratio and by the size of M. */
    double ratio = scale / h->scale, d = det * ratio;
    double size = incode_max_norm(m), normal = incode_max_norm(n);
    size = size > d ? size : d;
    if (!(size > 1e-280) || !(size < 1e280) || !(normal > 1e-280) ||
        !(normal < 1e280) || !(det >= 0))
        return false;
    float down = (float)(d / size * (1 - 0x1p-22));
    cap->d = down > 1e-30F ? down : 0; /* less holds more */
    cap->m_sum = cap->near = 0;
    cap->bounded = false;
    for (int k = 0; k < 3; k++) {
        double v = (pv[k] - h->origin[k]) * h->scale;
        if (!(__builtin_fabs(v) < 0x1p20))
            return false;
        cap->v[k] = (float)v;
        cap->near += __builtin_fabsf(cap->v[k]);
        cap->m[k] = (float)(m[k] / size);
        cap->n[k] = (float)(n[k] / normal);
        cap->m_sum += __builtin_fabsf(cap->m[k]);
        cap->peak[k] = cap->m[k] / (2 * cap->d);
        if (cap->d == 0) /* the least is at an end */
            cap->peak[k] = cap->m[k] > 0 ? 1e30F : -1e30F;
    }
    return true;
}

void incode_horizon_bound(const struct incode_horizon *h,
                          struct incode_horizon_cap *cap, double scale,
                          const struct incode_radical_bound *radical) {
    double size = incode_max_norm(radical->g), ratio = scale / h->scale;
    double level = radical->level / (size * ratio);
    cap->bounded = radical->set && size > 1e-280 && size < 1e280 &&
                   __builtin_fabs(level) < FARTHEST;
    if (!cap->bounded)
        return;
    cap->level = (float)(level + 0x1p-22 * __builtin_fabs(level));
    cap->slack = (float)(radical->slack / size) + INCODE_HORIZON_DOUBT;
    for (int k = 0; k < 3; k++)
        cap->g[k] = (float)(radical->g[k] / size);
}

/* Boxes along the axes. */
struct sides {
    const float *lo[3], *hi[3], *far;
};

static struct sides sides_of(const struct incode_horizon *h) {
    return (struct sides){
        {h->lo[0], h->lo[1], h->lo[2]}, {h->hi[0], h->hi[1], h->hi[2]}, h->far};
}

/* A vector of them, from i on, that are certainly outside; and their doubt. */
INCODE_INLINE uint32_t axes_outside(const struct sides *h,
                                    const struct incode_horizon_cap *cap,
                                    uint32_t i, incode_vf *weight) {
    incode_vf zero = incode_vf_all(0), value = zero, level = zero;
    incode_vf d = incode_vf_all(cap->d);
    incode_vf far = incode_vf_load(h->far + i) + incode_vf_all(cap->near);
    for (int k = 0; k < 3; k++) {
        incode_vf v = incode_vf_all(cap->v[k]), m = incode_vf_all(cap->m[k]);
        incode_vf lo = incode_vf_load(h->lo[k] + i) - v;
        incode_vf hi = incode_vf_load(h->hi[k] + i) - v;
        incode_vf y =
            incode_vf_max(incode_vf_min(incode_vf_all(cap->peak[k]), hi), lo);
        value = incode_vf_fma(incode_vf_fma(d, y, -m), y, value);
        level = incode_vf_fma(incode_vf_all(cap->n[k]), cap->n[k] > 0 ? hi : lo,
                              level);
    }
    *weight = incode_vf_fma(d, far, incode_vf_all(cap->m_sum));
    incode_vf doubt = far * incode_vf_all(INCODE_HORIZON_DOUBT);
    return incode_vm_bits(incode_vf_less(*weight * doubt, value) |
                          incode_vf_less(level, -doubt));
}

/* Those that are certainly beyond the cap's bound. */
INCODE_INLINE uint32_t beyond_bound(const struct sides *h,
                                    const struct incode_horizon_cap *cap,
                                    uint32_t i) {
    incode_vf least = incode_vf_all(0);
    incode_vf far = incode_vf_load(h->far + i) + incode_vf_all(cap->near);
    for (int k = 0; k < 3; k++) {
        const float *side = cap->g[k] > 0 ? h->lo[k] : h->hi[k];
        least = incode_vf_fma(
            incode_vf_all(cap->g[k]),
            incode_vf_load(side + i) - incode_vf_all(cap->v[k]), least);
    }
    least -= far * incode_vf_all(cap->slack);
    return incode_vm_bits(incode_vf_less(incode_vf_all(cap->level), least));
}

/* The same for lifted boxes. */
INCODE_INLINE uint32_t lifted_outside(const struct incode_horizon *h,
                                      const struct incode_horizon_cap *cap,
                                      uint32_t i, incode_vf weight) {
    incode_vf g[3], d = incode_vf_all(cap->d), two = d + d;
    incode_vf value = d * incode_vf_load(h->lid + i);
    for (int k = 0; k < 3; k++) {
        incode_vf m = incode_vf_all(cap->m[k]);
        incode_vf y = incode_vf_load(h->o[k] + i) - incode_vf_all(cap->v[k]);
        value = incode_vf_fma(incode_vf_fma(d, y, -m), y, value);
        g[k] = incode_vf_fma(two, y, -m);
    }
    for (int k = 0; k < 3; k++) {
        incode_vf reach = d * incode_vf_load(h->slope[k] + i);
        for (int c = 0; c < 3; c++)
            reach = incode_vf_fma(g[c], incode_vf_load(h->a[k][c] + i), reach);
        value -= incode_vf_abs(reach);
    }
    incode_vf far = incode_vf_load(h->far + i) + incode_vf_all(cap->near);
    incode_vf doubt = incode_vf_fma(far, incode_vf_all(INCODE_HORIZON_DOUBT),
                                    incode_vf_load(h->doubt + i));
    return incode_vm_bits(incode_vf_less(weight * doubt, value));
}

uint32_t incode_horizon_reached(
    const struct incode_horizon *h, const struct incode_horizon_cap *cap,
    const uint64_t done[INCODE_HORIZON_MAX / 64],
    uint32_t index[INCODE_HORIZON_MAX + INCODE_HORIZON_PADDING]) {
    const struct sides sides = sides_of(h);
    uint32_t count = 0;
    for (uint32_t i = 0; i < h->count; i += INCODE_VF_LANES) {
        incode_vf weight;
        uint32_t in = ~axes_outside(&sides, cap, i, &weight) & INCODE_VF_ALL;
        in &= ~(uint32_t)(done[i / 64] >> (i % 64));
        if (h->count - i < INCODE_VF_LANES)
            in &= (UINT32_C(1) << (h->count - i)) - 1;
        if (in == 0)
            continue;
        in &= ~lifted_outside(h, cap, i, weight);
        if (cap->bounded)
            in &= ~beyond_bound(&sides, cap, i);
        incode_vi_pack(index + count, in,
                       incode_vi_count() + incode_vi_all((int32_t)i));
        count += (uint32_t)__builtin_popcount(in);
    }
    return count;
}

/* ---- looking into a page ---- */

/* The children that the cap reaches, by their axes' boxes. */
static uint32_t reached_children(const struct view *view,
                                 const struct incode_horizon_cap *cap) {
    struct sides sides = {{view->lo[0], view->lo[1], view->lo[2]},
                          {view->hi[0], view->hi[1], view->hi[2]},
                          view->far};
    uint32_t reached = 0;
    for (uint32_t i = 0; i < INCODE_FANOUT; i += INCODE_VF_LANES) {
        incode_vf weight;
        reached |= (~axes_outside(&sides, cap, i, &weight) & INCODE_VF_ALL)
                   << i;
    }
    return reached;
}

enum { SPARE = 32 /* boxes: for what is reached for certain */ };

/* Whether the cap reaches the lifted box of the last one added. */
static bool last_is_reached(const struct incode_horizon *h,
                            const struct incode_horizon_cap *cap) {
    uint32_t last = h->count - 1, lane = last % INCODE_VF_LANES;
    incode_vf far =
        incode_vf_load(h->far + last - lane) + incode_vf_all(cap->near);
    incode_vf weight =
        incode_vf_fma(incode_vf_all(cap->d), far, incode_vf_all(cap->m_sum));
    return !(lifted_outside(h, cap, last - lane, weight) >> lane & 1);
}

enum incode_step incode_horizon_split(struct incode_horizon *h,
                                      struct incode_walker *walker,
                                      uint32_t index,
                                      const struct incode_horizon_cap *cap,
                                      uint32_t *missing) {
    const struct incode_tree *tree = walker->tree;
    uint32_t page = h->page[index], level = h->level[index];
    const struct incode_frame *f = incode_pager_get(walker->pager, page);
    struct view view;
    *missing = page;
    if (f == NULL)
        return INCODE_WAITING;
    incode_walker_yield(walker, PAGE_UNITS);
    set_view(&view, h, f);
    uint32_t first = (page - tree->base[level]) * INCODE_FANOUT;
    uint32_t in = h->left[index] & reached_children(&view, cap);
    for (; in != 0; in &= in - 1) {
        unsigned child = (unsigned)__builtin_ctz(in);
        if (h->count == h->boxes)
            return INCODE_FULL;
        uint32_t at = tree->base[level - 1] + first + child;
        incode_walker_yield(walker, BOX_UNITS);
        uint32_t i = add_box(h, &view, child, at, level - 1);
        set_lifted(h, i, &view, child);
        /* It is likely to be looked at again, which costs less here. */
        if (h->count > h->boxes - SPARE && !last_is_reached(h, cap)) {
            h->count--;
            continue;
        }
        if (level > 1)
            h->left[i] = children_of(tree, level - 1, first + child);
        h->left[index] &= ~(UINT32_C(1) << child);
    }
    return INCODE_FINISHED;
}

/* ---- by a box ---- */

enum incode_step incode_horizon_box(const struct incode_horizon *h,
                                    struct incode_walker *walker,
                                    struct incode_query *q, incode_visit *visit,
                                    void *context) {
    incode_vf lo[3], hi[3];
    for (int d = 0; d < 3; d++) {
        lo[d] =
            incode_vf_all(below_number((q->lo[d] - h->origin[d]) * h->scale));
        hi[d] =
            incode_vf_all(above_number((q->hi[d] - h->origin[d]) * h->scale));
    }
    /* From the centre on, for near bricks first, and around. */
    uint32_t i = h->self / INCODE_VF_LANES * INCODE_VF_LANES;
    for (uint32_t k = 0; k < h->near; k += INCODE_VF_LANES) {
        incode_vm out = incode_vf_less(hi[0], incode_vf_load(h->lo[0] + i)) |
                        incode_vf_less(incode_vf_load(h->hi[0] + i), lo[0]);
        for (int d = 1; d < 3; d++)
            out |= incode_vf_less(hi[d], incode_vf_load(h->lo[d] + i)) |
                   incode_vf_less(incode_vf_load(h->hi[d] + i), lo[d]);
        uint32_t in = ~incode_vm_bits(out) & INCODE_VF_ALL;
        if (h->near - i < INCODE_VF_LANES)
            in &= (UINT32_C(1) << (h->near - i)) - 1;
        for (; in != 0; in &= in - 1) {
            uint32_t at = i + (uint32_t)__builtin_ctz(in);
            if (h->level[at] != 0)
                continue;
            if (q->pages_max != 0 && q->pages++ == q->pages_max)
                return INCODE_WORKED;
            enum incode_step r =
                incode_walk_brick(walker, q, h->page[at], visit, context);
            if (r != INCODE_FINISHED)
                return r;
        }
        i = i + INCODE_VF_LANES < h->near ? i + INCODE_VF_LANES : 0;
    }
    return INCODE_FINISHED;
}
