/* What the tests of the horizon share: sets of points in pages, a horizon over
 * them, and what is in a cap by exact or by long arithmetic. */
#ifndef TESTS_HORIZON_SCENE_H
#define TESTS_HORIZON_SCENE_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "host/mesh/order.h"
#include "incode/apex/horizon.h"
#include "tests/unit/test.h"

static uint64_t state = 1;

static inline double draw(void) {
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static inline double even(void) {
    return 2 * draw() - 1;
}

static inline uint32_t below(uint32_t n) {
    return (uint32_t)(draw() * n);
}

/* ---- point sets ---- */

/* A direction that is no axis. */
static inline void tilted(double p[3], double a, double b, double c) {
    p[0] = 0.36 * a - 0.8 * b + 0.48 * c;
    p[1] = 0.48 * a + 0.6 * b + 0.64 * c;
    p[2] = -0.8 * a + 0.6 * c;
}

static inline void times(double p[3], double factor) {
    for (int d = 0; d < 3; d++)
        p[d] *= factor;
}

static inline void volume(double p[3]) {
    tilted(p, even(), even(), even());
}

static inline void plane(double p[3]) {
    tilted(p, even(), even(), 0.3);
}

static inline void line(double p[3]) {
    tilted(p, even(), 0.1, 0.3);
}

static inline void sphere(double p[3]) {
    double z = even(), angle = 6.283185307179586 * draw(), r = sqrt(1 - z * z);
    tilted(p, r * cos(angle), r * sin(angle), z);
}

static inline void cylinder(double p[3]) {
    double angle = 6.283185307179586 * draw();
    tilted(p, 0.2 * cos(angle), 0.2 * sin(angle), even());
}

static inline void terrain(double p[3]) {
    p[0] = even(), p[1] = even();
    p[2] = 0.1 * sin(3 * p[0]) * cos(4 * p[1]) + 0.001 * draw();
}

/* Few points far off, and all others in a corner of what they span. */
static inline void tiny_cluster(double p[3]) {
    volume(p);
    if (draw() < 0.98)
        for (int d = 0; d < 3; d++)
            p[d] = 0.7 + 0x1p-30 * p[d];
}

static inline void uneven_axes(double p[3]) {
    sphere(p);
    p[0] *= 1e6, p[2] *= 1e-6;
}

static inline void far_plane(double p[3]) {
    plane(p);
    for (int d = 0; d < 3; d++)
        p[d] += 1e6 * (d + 1);
}

static inline void large(double p[3]) {
    sphere(p);
    times(p, 0x1p1023);
}

static inline void huge(double p[3]) {
    terrain(p);
    times(p, 1e300);
}

static inline void small(double p[3]) {
    plane(p);
    times(p, 1e-300);
}

static inline void denormal(double p[3]) {
    sphere(p);
    times(p, 1e-312);
}

/* Each lump is as far from the next as it is large. */
static inline void all_scales(double p[3]) {
    sphere(p);
    times(p, ldexp(1, 40 * (int)(draw() * 40) - 800));
}

/* Each point: most of a page lies close to one corner of it. */
static inline void point_scales(double p[3]) {
    volume(p);
    times(p, ldexp(1, (int)(draw() * 80) - 40));
}

static inline void each_scale(double p[3]) {
    for (int d = 0; d < 3; d++)
        p[d] = ldexp(even(), (int)(draw() * 2000) - 1000);
}

typedef void making(double p[3]);

/* ---- a set, its pages, and the horizon ---- */

enum {
    QUEUE = 4096,
    NO_BOX = UINT16_MAX,
    BOXES = INCODE_HORIZON_MAX,
    COPIES = 32
};

struct scene {
    struct host_order order;
    struct incode_pager pager;
    void *frames;
    uint32_t page[QUEUE], pages; /* asked for */
    struct incode_tally tally;
    uint64_t candidates;
    struct incode_walker walker;
    struct incode_horizon *h;
    void *memory;        /* its */
    double lo[3], hi[3]; /* of the horizon's centre */
};

static inline bool request(void *context, uint32_t page) {
    struct scene *s = context;
    assert_true(s->pages < QUEUE);
    s->page[s->pages++] = page;
    return true;
}

static inline void deliver(struct scene *s) {
    uint8_t page[INCODE_PAGE_BYTES];
    while (s->pages > 0) {
        uint32_t number = s->page[--s->pages];
        size_t bytes = host_page(&s->order, number, page);
        assert_int_equal(incode_pager_deliver(&s->pager, number, page, bytes),
                         0);
    }
}

static inline const struct incode_frame *frame_of(struct scene *s,
                                                  uint32_t page) {
    const struct incode_frame *f = incode_pager_get(&s->pager, page);
    if (f != NULL)
        return f;
    deliver(s);
    f = incode_pager_get(&s->pager, page);
    assert_non_null(f);
    return f;
}

/* No page is there; there is room for all. */
static inline void forget_pages(struct scene *s) {
    const struct incode_page_source source = {s, request};
    struct incode_yield none = {0};
    incode_pager_init(&s->pager, s->frames, s->order.tree.pages,
                      s->order.bricks, &none);
    s->pager.source = source;
    s->pages = 0;
}

static inline void *aligned(size_t bytes) {
    void *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    assert_non_null(memory);
    return memory;
}

/* Two points make a plane or a line span the space. */
static inline void open_scene(struct scene *s, making *make, size_t n) {
    struct host_error error = {0};
    double *xyz = malloc(3 * n * sizeof *xyz);
    assert_non_null(xyz);
    for (size_t i = 0; i < n; i++)
        make(xyz + 3 * i);
    for (int i = 0; i < 6; i++)
        xyz[i] += xyz[i] * 0x1p-2 * (i % 3 + 1.) * (i < 3 ? 1 : -1.);
    memset(s, 0, sizeof *s);
    assert_int_equal(host_order_make(&s->order, "test", xyz, n, HOST_ADAPTIVE,
                                     1, false, &error),
                     0);
    free(xyz);
    s->frames = aligned(incode_pager_bytes(s->order.tree.pages));
    s->memory = aligned(incode_horizon_bytes(BOXES, COPIES));
    s->h = aligned(sizeof *s->h);
    struct incode_yield nobody = {NULL, NULL, 0};
    incode_horizon_init(s->h, s->memory, BOXES, COPIES, &nobody);
    s->walker = (struct incode_walker){&s->pager, &s->order.tree, &s->tally,
                                       &s->candidates, UINT32_MAX};
    forget_pages(s);
}

static inline void close_scene(struct scene *s) {
    host_order_free(&s->order);
    free(s->frames);
    free(s->memory);
    free(s->h);
}

static inline uint32_t draw_vertex(const struct scene *s, uint32_t brick) {
    return brick * INCODE_BRICK_POINTS + below(s->order.fill[brick]);
}

/* The horizon of a brick, of some times its extent. */
static inline enum incode_step try_horizon(struct scene *s, uint32_t brick,
                                           double reach, uint32_t *missing) {
    double extent = 0;
    incode_frame_box(frame_of(s, brick), s->lo, s->hi);
    for (int d = 0; d < 3; d++)
        extent = fmax(extent, s->hi[d] - s->lo[d]);
    for (int d = 0; d < 3; d++) {
        s->lo[d] -= reach * extent;
        s->hi[d] += reach * extent;
    }
    return incode_horizon_make(s->h, &s->walker, brick, s->lo, s->hi, missing);
}

/* Smaller and smaller, until there is room. */
static inline void make_horizon(struct scene *s, uint32_t brick, double reach) {
    uint32_t missing;
    enum incode_step made;
    while ((made = try_horizon(s, brick, reach, &missing)) != INCODE_FINISHED)
        if (made == INCODE_WAITING)
            deliver(s);
        else
            reach *= 0.75;
    assert_int_equal(s->h->centre, brick);
    assert_int_equal(s->h->page[s->h->self], brick);
    assert_int_equal(s->h->level[s->h->self], 0);
}

/* ---- what is reached ---- */

typedef uint64_t done_boxes[INCODE_HORIZON_MAX / 64];

struct reached {
    uint32_t index[INCODE_HORIZON_MAX + INCODE_HORIZON_PADDING], count;
    bool full; /* pages are left */
};

/* Splits all pages that are reached; false: there is no room for that. */
static inline bool split_all(struct scene *s,
                             const struct incode_horizon_cap *cap) {
    done_boxes done = {0};
    struct reached r;
    bool any = true;
    while (any) {
        any = false;
        r.count = incode_horizon_reached(s->h, cap, done, r.index);
        for (uint32_t i = 0; i < r.count; i++) {
            uint32_t at = r.index[i], missing;
            enum incode_step made;
            if (s->h->level[at] == 0)
                continue;
            any = true;
            while ((made = incode_horizon_split(s->h, &s->walker, at, cap,
                                                &missing)) == INCODE_WAITING)
                deliver(s);
            if (made == INCODE_FULL)
                return false;
            done[at / 64] |= UINT64_C(1) << (at % 64);
        }
    }
    return true;
}

/* The bits of a brick's points: copied, where it was not. */
static inline uint64_t bits_of(struct scene *s, uint32_t at,
                               const struct incode_horizon_cap *cap) {
    if (s->h->copy[at] == INCODE_NO_COPY)
        incode_horizon_copy(s->h, at, frame_of(s, s->h->page[at]));
    return incode_horizon_points(s->h, at, cap);
}

/* ---- balls ---- */

struct ball {
    double v[3], m[3], n[3], det, scale;
    struct incode_radical_bound radical;
};

/* Certainly in it, with long doubles' rounding and range. */
static inline bool is_in_ball(const struct ball *q, const double p[3]) {
    long double value = 0, size = 0, level = 0, level_size = 0;
    long double beyond = 0, far = 0;
    for (int d = 0; d < 3; d++) {
        long double r = ((long double)p[d] - q->v[d]) * q->scale;
        value += q->det * r * r - q->m[d] * r;
        size += q->det * r * r + fabsl(q->m[d] * r);
        level += q->n[d] * r;
        level_size += fabsl(q->n[d] * r);
        beyond += q->radical.g[d] * r;
        far += fabsl(r);
    }
    return value < -0x1p-50L * size && level > 0x1p-50L * level_size &&
           (!q->radical.set ||
            beyond < q->radical.level + q->radical.slack * far);
}

static inline uint64_t points_of_ball(const struct scene *s,
                                      const struct ball *q, uint32_t brick) {
    uint64_t in = 0;
    for (uint32_t slot = 0; slot < s->order.fill[brick]; slot++) {
        double p[3];
        host_vertex(&s->order, brick * INCODE_BRICK_POINTS + slot, p);
        in |= (uint64_t)is_in_ball(q, p) << slot;
    }
    return in;
}

/* ---- leaves that are visited ---- */

struct seen {
    uint64_t in[512]; /* the points of each brick, one bit each */
};

static inline bool see(struct incode_walker *walker, struct incode_query *q,
                       const struct incode_frame *frame, uint32_t brick,
                       uint32_t leaves, void *context) {
    struct seen *seen = context;
    (void)walker;
    (void)q;
    assert_int_equal(frame->number, brick);
    for (; leaves != 0; leaves &= leaves - 1)
        seen->in[brick] |= UINT64_C(0xff) << 8 * __builtin_ctz(leaves);
    return true;
}

#endif
