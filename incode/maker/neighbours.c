#include "neighbours.h"

#include <float.h>
#include <string.h>

#include "incode/predicates/simd.h"

/* ---- the list ---- */

/* Rounding outward, in units in which the box is of size 1 or 2. */
#define OUTWARD 0x1p-20

/* Boxes of one page of level 1; leaves: one bit a box that meets the list's. */
static bool copy_boxes(struct incode_walker *walker, struct incode_query *q,
                       const struct incode_frame *frame, uint32_t first,
                       uint32_t boxes, void *context)
{
    struct incode_neighbours *list = context;
    (void)walker, (void)q;
    for (; boxes != 0; boxes &= boxes - 1) {
        unsigned i = (unsigned)__builtin_ctz(boxes);
        if (list->count == INCODE_NEIGHBOURS_BRICKS)
            return false;
        for (int d = 0; d < 3; d++) {
            double lo =
                (frame->page.boxes.lo[d][i] - list->origin[d]) * list->scale;
            double hi =
                (frame->page.boxes.hi[d][i] - list->origin[d]) * list->scale;
            bool over = !(hi - lo < __builtin_inf()); /* tells nothing */
            lo = over ? -1e30 : lo;
            hi = over ? 1e30 : hi;
            lo -= OUTWARD * (1 + __builtin_fabs(lo));
            hi += OUTWARD * (1 + __builtin_fabs(hi));
            list->lo[d][list->count] = (float)(lo > -1e30 ? lo : -1e30);
            list->hi[d][list->count] = (float)(hi < 1e30 ? hi : 1e30);
        }
        if (first + i == list->centre)
            list->self = list->count;
        list->brick[list->count++] = first + i;
    }
    return true;
}

static void set_empty(struct incode_neighbours *list)
{
    list->count = list->next = 0;
    memset(list->copy, INCODE_NO_COPY, sizeof list->copy);
    for (int d = 0; d < 3; d++) {
        list->box_lo[d] = __builtin_inf();
        list->box_hi[d] = -__builtin_inf();
    }
}

enum incode_listed incode_neighbours_make(struct incode_neighbours *list,
                                          struct incode_walker *walker,
                                          uint32_t brick, const double lo[3],
                                          const double hi[3], uint32_t *missing)
{
    struct incode_query q;
    double extent = 0;
    memset(&q, 0, sizeof q);
    q.question = INCODE_QUERY_BOX;
    q.boxed = q.boxes_only = true;
    set_empty(list);
    list->centre = brick;
    list->self = 0;
    for (int d = 0; d < 3; d++) {
        /* A box that overflows ends where doubles do. */
        double from = lo[d] > -DBL_MAX ? lo[d] : -DBL_MAX;
        double to = hi[d] < DBL_MAX ? hi[d] : DBL_MAX;
        double half = to * 0.5 - from * 0.5;
        list->origin[d] = from * 0.5 + to * 0.5;
        extent = half > extent ? half : extent;
        q.lo[d] = lo[d];
        q.hi[d] = hi[d];
    }
    list->scale = incode_scale_for(extent);
    enum incode_walk r = incode_walk(walker, &q, copy_boxes, list);
    *missing = q.missing;
    if (r == INCODE_WALK_WAIT) {
        list->centre = INCODE_NONE;
        return INCODE_LIST_WAIT;
    }
    if (r == INCODE_WALK_STOP) {
        set_empty(list);
        return INCODE_LIST_FULL;
    }
    memcpy(list->box_lo, lo, sizeof list->box_lo);
    memcpy(list->box_hi, hi, sizeof list->box_hi);
    return INCODE_LISTED;
}

/* ---- which bricks ---- */

struct chosen {
    uint64_t word[INCODE_NEIGHBOURS_BRICKS / 64];
};

/* The boxes from i on, a vector of them, that are in doubt. */
INCODE_INLINE void note(struct chosen *chosen, uint32_t i, uint32_t in)
{
    if (i % 64 == 0)
        chosen->word[i / 64] = 0;
    chosen->word[i / 64] |= (uint64_t)in << (i % 64);
}

static incode_vf all_of(double a)
{
    return incode_vf_all((float)a);
}

static void in_box(const struct incode_neighbours *list,
                   const struct incode_query *q, struct chosen *chosen)
{
    incode_vf lo[3], hi[3];
    for (int d = 0; d < 3; d++) {
        double a = (q->lo[d] - list->origin[d]) * list->scale;
        double b = (q->hi[d] - list->origin[d]) * list->scale;
        lo[d] = all_of(a - OUTWARD * (1 + __builtin_fabs(a)));
        hi[d] = all_of(b + OUTWARD * (1 + __builtin_fabs(b)));
    }
    for (uint32_t i = 0; i < list->count; i += INCODE_VF_LANES) {
        incode_vm out = incode_vf_less(hi[0], incode_vf_load(list->lo[0] + i)) |
                        incode_vf_less(incode_vf_load(list->hi[0] + i), lo[0]);
        for (int d = 1; d < 3; d++)
            out |= incode_vf_less(hi[d], incode_vf_load(list->lo[d] + i)) |
                   incode_vf_less(incode_vf_load(list->hi[d] + i), lo[d]);
        note(chosen, i, ~incode_vm_bits(out) & INCODE_VF_ALL);
    }
}

void incode_neighbours_set_ball(const struct incode_neighbours *list,
                                const struct incode_query *q,
                                struct incode_neighbours_ball *ball)
{
    double ratio = list->scale / q->scale, most = 1;
    for (int d = 0; d < 3; d++) {
        double at = (q->pv[d] - list->origin[d]) * list->scale;
        double centre = at + q->centre[d] * ratio;
        double far = __builtin_fabs(centre);
        most = far > most ? far : most;
        ball->centre[d] = (float)centre;
    }
    /* A point in the ball is no farther out than the centre and the radius.
     * (r + e)^2 <= (1 + d) r^2 + (1 + 1 / d) e^2, where d is 2^-12. */
    double error = most * (OUTWARD * 65);
    ball->square =
        (float)(q->square * ratio * ratio * (1 + 0x1p-11) + error * error);
}

/* What meets the ball and is not certainly on the known side of the face. */
static void in_ball(const struct incode_neighbours *list,
                    const struct incode_query *q,
                    struct incode_neighbours_ball *ball, struct chosen *chosen)
{
    const float *corner[3]; /* the farthest beyond the face */
    incode_vf c[3], n[3], zero = incode_vf_all(0);
    double level = 0, extent = incode_max_norm(q->sphere.n);
    incode_neighbours_set_ball(list, q, ball);
    for (int d = 0; d < 3; d++) {
        double at = (q->pv[d] - list->origin[d]) * list->scale;
        double normal = q->sphere.n[d] / extent;
        c[d] = incode_vf_all(ball->centre[d]);
        n[d] = all_of(normal);
        corner[d] = normal > 0 ? list->hi[d] : list->lo[d];
        level += normal * at;
    }
    incode_vf square = incode_vf_all(ball->square);
    incode_vf floor = all_of(level - 0x1p-17);
    for (uint32_t i = 0; i < list->count; i += INCODE_VF_LANES) {
        incode_vf sum = zero, top = zero;
        for (int d = 0; d < 3; d++) {
            incode_vf lo = incode_vf_load(list->lo[d] + i);
            incode_vf hi = incode_vf_load(list->hi[d] + i);
            incode_vf gap =
                incode_vf_max(incode_vf_max(lo - c[d], c[d] - hi), zero);
            sum = incode_vf_fma(gap, gap, sum);
            top = incode_vf_fma(n[d], incode_vf_load(corner[d] + i), top);
        }
        note(chosen, i,
             ~incode_vm_bits(incode_vf_less(square, sum) |
                             incode_vf_less(top, floor)) &
                 INCODE_VF_ALL);
    }
}

uint32_t incode_neighbours_in_ball(
    const struct incode_neighbours *list, const struct incode_query *q,
    struct incode_neighbours_ball *ball,
    uint32_t index[INCODE_NEIGHBOURS_BRICKS + INCODE_NEIGHBOURS_PADDING])
{
    struct chosen chosen;
    uint32_t count = 0;
    in_ball(list, q, ball, &chosen);
    for (uint32_t i = 0; i < list->count; i += INCODE_VF_LANES) {
        uint32_t in =
            (uint32_t)(chosen.word[i / 64] >> (i % 64)) & INCODE_VF_ALL;
        if (list->count - i < INCODE_VF_LANES)
            in &= (UINT32_C(1) << (list->count - i)) - 1;
        incode_vi_pack(index + count, in,
                       incode_vi_count() + incode_vi_all((int32_t)i));
        count += (uint32_t)__builtin_popcount(in);
    }
    return count;
}

/* ---- copies ---- */

void incode_neighbours_copy(struct incode_neighbours *list, uint32_t index,
                            const struct incode_frame *frame)
{
    const struct incode_brick *b = &frame->page.brick;
    const double *const axis[3] = {b->x, b->y, b->z};
    uint32_t copy = list->next;
    incode_vd scale = incode_vd_all(list->scale);
    for (int d = 0; d < 3; d++) {
        /* Scaled first: a difference of large numbers could overflow. */
        incode_vd origin = incode_vd_all(list->origin[d] * list->scale);
        for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES)
            incode_vd_store_float(list->point[copy][d] + i,
                                  incode_vd_load(axis[d] + i) * scale - origin);
    }
    uint8_t *old = &list->copy[list->owner[copy]];
    if (*old == copy)
        *old = INCODE_NO_COPY;
    list->owner[copy] = (uint8_t)index;
    list->copy[index] = (uint8_t)copy;
    list->next = (copy + 1) % list->room;
}

uint64_t incode_neighbours_points(const struct incode_neighbours *list,
                                  uint32_t index,
                                  const struct incode_neighbours_ball *ball)
{
    const float(*point)[INCODE_BRICK_POINTS] = list->point[list->copy[index]];
    incode_vf limit = incode_vf_all(ball->square);
    uint64_t out = 0;
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VF_LANES) {
        incode_vf square = incode_vf_all(0);
        for (int d = 0; d < 3; d++) {
            incode_vf gap =
                incode_vf_load(point[d] + i) - incode_vf_all(ball->centre[d]);
            square = incode_vf_fma(gap, gap, square);
        }
        out |= (uint64_t)incode_vm_bits(incode_vf_less(limit, square)) << i;
    }
    return ~out;
}

/* The next chosen brick from i on, taken out; count where there is none. */
static uint32_t take(struct chosen *chosen, uint32_t i, uint32_t count)
{
    for (; i < count; i = (i / 64 + 1) * 64) {
        uint64_t left = chosen->word[i / 64] >> (i % 64);
        if (left != 0) {
            i += (uint32_t)__builtin_ctzll(left);
            chosen->word[i / 64] &= ~(UINT64_C(1) << (i % 64));
            break;
        }
    }
    return i < count ? i : count;
}

enum incode_walk incode_neighbours_visit(const struct incode_neighbours *list,
                                         struct incode_walker *walker,
                                         struct incode_query *q,
                                         incode_visit *visit, void *context)
{
    struct incode_neighbours_ball ball;
    struct chosen chosen;
    double square = q->square;
    bool round = q->round;
    if (round)
        in_ball(list, q, &ball, &chosen);
    else
        in_box(list, q, &chosen);
    /* From the centre on, for near bricks first, and around. */
    uint32_t i = list->self;
    for (int turns = 0; turns < 2; turns++, i = 0) {
        while ((i = take(&chosen, i, list->count)) < list->count) {
            if (q->pages_max != 0 && q->pages++ == q->pages_max)
                return INCODE_WALK_STOP;
            enum incode_walk r =
                incode_walk_brick(walker, q, list->brick[i], visit, context);
            if (r != INCODE_WALK_DONE)
                return r;
            if (round && q->round && q->square < square) {
                struct chosen left;
                square = q->square;
                in_ball(list, q, &ball, &left);
                for (uint32_t k = 0; k < list->count; k += 64)
                    chosen.word[k / 64] &= left.word[k / 64];
            }
        }
    }
    return INCODE_WALK_DONE;
}
