/* A horizon against all points: what lies in a cap by exact arithmetic is in
 * one of the boxes that are reached, and its bit is set; and few boxes are
 * reached where the points are flat. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "host/order/order.h"
#include "incode/maker/horizon.h"

static uint64_t state = 1;

static double draw(void)
{
    state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
    return (double)(state >> 11) * 0x1p-53;
}

static double even(void)
{
    return 2 * draw() - 1;
}

static uint32_t below(uint32_t n)
{
    return (uint32_t)(draw() * n);
}

/* ---- point sets ---- */

/* A direction that is no axis. */
static void tilted(double p[3], double a, double b, double c)
{
    p[0] = 0.36 * a - 0.8 * b + 0.48 * c;
    p[1] = 0.48 * a + 0.6 * b + 0.64 * c;
    p[2] = -0.8 * a + 0.6 * c;
}

static void times(double p[3], double factor)
{
    for (int d = 0; d < 3; d++)
        p[d] *= factor;
}

static void volume(double p[3])
{
    tilted(p, even(), even(), even());
}

static void plane(double p[3])
{
    tilted(p, even(), even(), 0.3);
}

static void line(double p[3])
{
    tilted(p, even(), 0.1, 0.3);
}

static void sphere(double p[3])
{
    double z = even(), angle = 6.283185307179586 * draw(), r = sqrt(1 - z * z);
    tilted(p, r * cos(angle), r * sin(angle), z);
}

static void cylinder(double p[3])
{
    double angle = 6.283185307179586 * draw();
    tilted(p, 0.2 * cos(angle), 0.2 * sin(angle), even());
}

static void terrain(double p[3])
{
    p[0] = even(), p[1] = even();
    p[2] = 0.1 * sin(3 * p[0]) * cos(4 * p[1]) + 0.001 * draw();
}

/* Few points far off, and all others in a corner of what they span. */
static void tiny_cluster(double p[3])
{
    volume(p);
    if (draw() < 0.98)
        for (int d = 0; d < 3; d++)
            p[d] = 0.7 + 0x1p-30 * p[d];
}

static void uneven_axes(double p[3])
{
    sphere(p);
    p[0] *= 1e6, p[2] *= 1e-6;
}

static void far_plane(double p[3])
{
    plane(p);
    for (int d = 0; d < 3; d++)
        p[d] += 1e6 * (d + 1);
}

static void large(double p[3])
{
    sphere(p);
    times(p, 0x1p1023);
}

static void huge(double p[3])
{
    terrain(p);
    times(p, 1e300);
}

static void small(double p[3])
{
    plane(p);
    times(p, 1e-300);
}

static void denormal(double p[3])
{
    sphere(p);
    times(p, 1e-312);
}

/* Each lump is as far from the next as it is large. */
static void all_scales(double p[3])
{
    sphere(p);
    times(p, ldexp(1, 40 * (int)(draw() * 40) - 800));
}

static void each_scale(double p[3])
{
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

static bool request(void *context, uint32_t page)
{
    struct scene *s = context;
    assert_true(s->pages < QUEUE);
    s->page[s->pages++] = page;
    return true;
}

static void deliver(struct scene *s)
{
    uint8_t page[INCODE_PAGE_BYTES];
    while (s->pages > 0) {
        uint32_t number = s->page[--s->pages];
        size_t bytes = host_page(&s->order, number, page);
        assert_int_equal(incode_pager_deliver(&s->pager, number, page, bytes),
                         0);
    }
}

static const struct incode_frame *frame_of(struct scene *s, uint32_t page)
{
    const struct incode_frame *f = incode_pager_get(&s->pager, page);
    if (f != NULL)
        return f;
    deliver(s);
    f = incode_pager_get(&s->pager, page);
    assert_non_null(f);
    return f;
}

/* No page is there; there is room for all. */
static void forget_pages(struct scene *s)
{
    const struct incode_page_source source = {s, request};
    incode_pager_init(&s->pager, s->frames, s->order.tree.pages,
                      s->order.bricks);
    s->pager.source = source;
    s->pages = 0;
}

static void *aligned(size_t bytes)
{
    void *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    assert_non_null(memory);
    return memory;
}

/* Two points make a plane or a line span the space. */
static void open_scene(struct scene *s, making *make, size_t n)
{
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
    incode_horizon_init(s->h, s->memory, BOXES, COPIES);
    s->walker = (struct incode_walker){&s->pager, &s->order.tree, &s->tally,
                                       &s->candidates, UINT32_MAX};
    forget_pages(s);
}

static void close_scene(struct scene *s)
{
    host_order_free(&s->order);
    free(s->frames);
    free(s->memory);
    free(s->h);
}

static uint32_t draw_vertex(const struct scene *s, uint32_t brick)
{
    return brick * INCODE_BRICK_POINTS + below(s->order.fill[brick]);
}

/* The horizon of a brick, of some times its extent. */
static enum incode_horizon_made try_horizon(struct scene *s, uint32_t brick,
                                            double reach, uint32_t *missing)
{
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
static void make_horizon(struct scene *s, uint32_t brick, double reach)
{
    uint32_t missing;
    enum incode_horizon_made made;
    while ((made = try_horizon(s, brick, reach, &missing)) !=
           INCODE_HORIZON_MADE) {
        if (made == INCODE_HORIZON_WAIT)
            deliver(s);
        else
            reach *= 0.75;
    }
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
static bool split_all(struct scene *s, const struct incode_horizon_cap *cap)
{
    done_boxes done = {0};
    struct reached r;
    bool any = true;
    while (any) {
        any = false;
        r.count = incode_horizon_reached(s->h, cap, done, r.index);
        for (uint32_t i = 0; i < r.count; i++) {
            uint32_t at = r.index[i], missing;
            enum incode_horizon_made made;
            if (s->h->level[at] == 0)
                continue;
            any = true;
            while ((made = incode_horizon_split(s->h, &s->walker, at, cap,
                                                &missing)) ==
                   INCODE_HORIZON_WAIT)
                deliver(s);
            if (made == INCODE_HORIZON_FULL)
                return false;
            done[at / 64] |= UINT64_C(1) << (at % 64);
        }
    }
    return true;
}

/* Bricks that are reached, or pages above that have no box of their own for
 * what is beneath. */
static void mark(const struct scene *s, const struct reached *r, bool full,
                 uint16_t *where)
{
    const struct incode_tree *tree = &s->order.tree;
    for (uint32_t b = 0; b < tree->bricks; b++)
        where[b] = NO_BOX;
    for (uint32_t i = 0; i < r->count; i++) {
        uint32_t at = r->index[i], level = s->h->level[at];
        uint32_t left = s->h->left[at], width = 1;
        if (level == 0)
            where[s->h->page[at]] = (uint16_t)at;
        if (level == 0 || !full)
            continue;
        for (uint32_t k = 1; k < level; k++)
            width *= INCODE_FANOUT;
        uint32_t first =
            (s->h->page[at] - tree->base[level]) * INCODE_FANOUT * width;
        for (; left != 0; left &= left - 1)
            for (uint32_t k = 0; k < width; k++) {
                uint32_t b = first + (uint32_t)__builtin_ctz(left) * width + k;
                if (b < tree->bricks && where[b] == NO_BOX)
                    where[b] = (uint16_t)at;
            }
    }
}

/* The bits of a brick's points: copied, where it was not. */
static uint64_t bits_of(struct scene *s, uint32_t at,
                        const struct incode_horizon_cap *cap)
{
    if (s->h->copy[at] == INCODE_NO_COPY)
        incode_horizon_copy(s->h, at, frame_of(s, s->h->page[at]));
    return incode_horizon_points(s->h, at, cap);
}

/* in: the points of each brick that are in the cap, one bit each.  False: there
 * was no room to look into all pages. */
static bool check_cap(struct scene *s, const struct incode_horizon_cap *cap,
                      const uint64_t *in, const char *what)
{
    const done_boxes none = {0};
    struct reached r;
    bool full = !split_all(s, cap);
    uint16_t *where = malloc(s->order.bricks * sizeof *where);
    assert_non_null(where);
    r.count = incode_horizon_reached(s->h, cap, none, r.index);
    assert_true(r.count <= s->h->count);
    mark(s, &r, full, where);
    for (uint32_t b = 0; b < s->order.bricks; b++) {
        if (in[b] == 0)
            continue;
        if (where[b] == NO_BOX)
            fail_msg("%s: brick %u is in the cap and not reached", what, b);
        if (s->h->level[where[b]] != 0)
            continue;
        assert_int_equal(s->h->page[where[b]], b);
        uint64_t lost = in[b] & ~bits_of(s, where[b], cap);
        if (lost != 0)
            fail_msg("%s: point %d of brick %u is in the cap and lost", what,
                     __builtin_ctzll(lost), b);
    }
    free(where);
    return !full;
}

/* ---- caps of faces ---- */

struct face {
    double v[3], b[3], c[3], a[3];
    double scale;
    uint32_t id[4];
};

/* A vertex of the set: of the horizon's brick, of one that is listed, or
 * anywhere. */
static uint32_t draw_near(const struct scene *s)
{
    double chance = draw();
    uint32_t brick = s->h->centre;
    if (chance < 0.3) {
        uint32_t at = below(s->h->count);
        brick = s->h->level[at] == 0 ? s->h->page[at] : brick;
    } else if (chance < 0.4) {
        brick = below(s->order.bricks);
    }
    return draw_vertex(s, brick);
}

/* False: it is no face, or nothing is beyond it. */
static bool draw_face(struct scene *s, struct face *f)
{
    double *const p[4] = {f->v, f->b, f->c, f->a};
    double extent = 0;
    for (int i = 0; i < 4; i++) {
        f->id[i] = i == 0 ? draw_vertex(s, s->h->centre) : draw_near(s);
        host_vertex(&s->order, f->id[i], p[i]);
        for (int k = 0; k < i; k++)
            if (f->id[k] == f->id[i])
                return false;
        for (int d = 0; i < 3 && d < 3; d++)
            extent = fmax(extent, fabs(p[i][d] - f->v[d]));
    }
    f->scale = incode_scale_for(extent);
    int side = incode_orient3d(&s->tally, f->v, f->b, f->c, f->a);
    for (int d = 0; side < 0 && d < 3; d++) {
        double t = f->b[d];
        f->b[d] = f->c[d];
        f->c[d] = t;
    }
    return side != 0;
}

static void relative(double r[3], const struct face *f, const double p[3])
{
    for (int d = 0; d < 3; d++)
        r[d] = (p[d] - f->v[d]) * f->scale;
}

/* Errors vanish among the roundings to single precision. */
static bool is_sure(const double a[3], const double bound[3])
{
    return INCODE_SPHERE_EPS * incode_max_norm(bound) <
           0x1p-26 * incode_max_norm(a);
}

/* That of the face's sphere or, without an apex, of all its spheres. */
static bool face_cap(const struct scene *s, const struct face *f, bool apex,
                     struct incode_horizon_cap *cap)
{
    struct incode_sphere q;
    double b[3], c[3], a[3];
    relative(b, f, f->b);
    relative(c, f, f->c);
    relative(a, f, f->a);
    incode_sphere_plane(&q, b, c);
    incode_sphere_refine(&q, f->v, f->b, f->c, NULL, f->scale);
    if (!is_sure(q.n, q.pn))
        return false;
    if (!apex)
        return incode_horizon_cap(s->h, cap, f->v, f->scale, q.n, 0, q.n);
    incode_sphere_apex(&q, b, c, a);
    incode_sphere_refine(&q, f->v, f->b, f->c, f->a, f->scale);
    double det = q.det - INCODE_SPHERE_EPS * q.pdet;
    return is_sure(q.m, q.pm) && incode_horizon_cap(s->h, cap, f->v, f->scale,
                                                    q.m, fmax(det, 0), q.n);
}

/* What is beyond the face and inside its sphere, ties included. */
static uint64_t points_of_face(struct scene *s, const struct face *f, bool apex,
                               uint32_t brick)
{
    uint64_t in = 0;
    for (uint32_t slot = 0; slot < s->order.fill[brick]; slot++) {
        uint32_t id = brick * INCODE_BRICK_POINTS + slot;
        double p[3];
        if (id == f->id[0] || id == f->id[1] || id == f->id[2])
            continue;
        host_vertex(&s->order, id, p);
        if (incode_orient3d(&s->tally, f->v, f->b, f->c, p) > 0 &&
            (!apex || id == f->id[3] ||
             incode_in_sphere(&s->tally, f->v, f->b, f->c, f->a, p) > 0))
            in |= UINT64_C(1) << slot;
    }
    return in;
}

/* ---- caps of any size ---- */

struct ball {
    double v[3], m[3], n[3], det, scale;
};

/* A sphere of any radius from far below to far above the horizon's, or a
 * half-space. */
static void draw_ball(const struct scene *s, struct ball *q)
{
    double radius = ldexp(1, (int)below(50) - 15),
           any = ldexp(1, (int)below(99));
    host_vertex(&s->order, draw_near(s), q->v);
    q->scale = s->h->scale > 0x1p900 ? s->h->scale * ldexp(1, -(int)below(8))
                                     : s->h->scale * ldexp(1, (int)below(8));
    q->det = below(4) == 0 ? 0 : any;
    for (int d = 0; d < 3; d++) {
        q->n[d] = even() * 1e-9;
        q->m[d] = even() * radius * any * (q->scale / s->h->scale);
    }
    if (below(2) == 0) /* the cap of a sphere that is cut low */
        memcpy(q->n, q->m, sizeof q->n);
}

/* Certainly in it, with long doubles' rounding and range. */
static bool is_in_ball(const struct ball *q, const double p[3])
{
    long double value = 0, size = 0, level = 0, level_size = 0;
    for (int d = 0; d < 3; d++) {
        long double r = ((long double)p[d] - q->v[d]) * q->scale;
        value += q->det * r * r - q->m[d] * r;
        size += q->det * r * r + fabsl(q->m[d] * r);
        level += q->n[d] * r;
        level_size += fabsl(q->n[d] * r);
    }
    return value < -0x1p-50L * size && level > 0x1p-50L * level_size;
}

static uint64_t points_of_ball(const struct scene *s, const struct ball *q,
                               uint32_t brick)
{
    uint64_t in = 0;
    for (uint32_t slot = 0; slot < s->order.fill[brick]; slot++) {
        double p[3];
        host_vertex(&s->order, brick * INCODE_BRICK_POINTS + slot, p);
        in |= (uint64_t)is_in_ball(q, p) << slot;
    }
    return in;
}

/* ---- no point is lost ---- */

enum { CAPS = 24 };

struct tried {
    unsigned caps, spheres, full;
};

static void try_cap(struct scene *s, uint64_t *in, const char *name,
                    struct tried *tried)
{
    struct incode_horizon_cap cap;
    struct face f;
    struct ball q;
    uint32_t kind = below(4);
    bool made = false, apex = kind > 0;
    if (kind < 3) {
        made = draw_face(s, &f) && face_cap(s, &f, apex, &cap);
        tried->spheres += made && apex;
    } else {
        draw_ball(s, &q);
        made = incode_horizon_cap(s->h, &cap, q.v, q.scale, q.m, q.det, q.n);
    }
    for (uint32_t b = 0; made && b < s->order.bricks; b++)
        in[b] = kind < 3 ? points_of_face(s, &f, apex, b)
                         : points_of_ball(s, &q, b);
    tried->caps += made;
    if (made && !check_cap(s, &cap, in, name)) {
        tried->full++;
        make_horizon(s, s->h->centre, draw());
    }
}

static void check_set(making *make, const char *name, uint32_t n,
                      uint32_t horizons, struct tried *tried)
{
    struct scene s;
    open_scene(&s, make, n);
    uint64_t *in = malloc(s.order.bricks * sizeof *in);
    assert_non_null(in);
    for (uint32_t i = 0; i < horizons; i++) {
        make_horizon(&s, below(s.order.bricks), 2 * draw());
        for (uint32_t k = 0; k < CAPS; k++)
            try_cap(&s, in, name, tried);
    }
    free(in);
    close_scene(&s);
}

static void no_point_is_lost(void **unused)
{
    (void)unused;
    static const struct {
        making *make;
        const char *name;
    } sets[] = {{volume, "volume"},
                {plane, "plane"},
                {line, "line"},
                {sphere, "sphere"},
                {cylinder, "cylinder"},
                {terrain, "terrain"},
                {tiny_cluster, "cluster"},
                {uneven_axes, "uneven axes"},
                {far_plane, "far plane"},
                {large, "large"},
                {huge, "huge"},
                {small, "small"},
                {denormal, "denormal"},
                {all_scales, "all scales"},
                {each_scale, "each coordinate of its own scale"}};
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        struct tried tried = {0};
        check_set(sets[i].make, sets[i].name, 2000, 3, &tried);
        assert_true(tried.caps > CAPS && tried.spheres > CAPS / 4);
    }
}

/* More bricks than there is room for boxes; three levels of box pages. */
static void no_point_is_lost_where_it_is_full(void **unused)
{
    (void)unused;
    struct tried tried = {0};
    check_set(terrain, "large terrain", 70000, 1, &tried);
    assert_true(tried.full > 0 && tried.full < tried.caps);
}

/* ---- outcomes ---- */

/* All points but the vertex, or those on one side of its plane. */
static void half_space(const struct scene *s, uint32_t v, const double m[3],
                       struct incode_horizon_cap *cap)
{
    double pv[3];
    host_vertex(&s->order, v, pv);
    assert_true(incode_horizon_cap(s->h, cap, pv, s->h->scale, m, 0, m));
}

static void a_missing_page_is_named(void **unused)
{
    (void)unused;
    struct scene s;
    uint32_t missing = 0, waits = 0, brick;
    struct incode_horizon_cap cap;
    open_scene(&s, terrain, 20000);
    brick = s.order.bricks / 2;
    while (try_horizon(&s, brick, 0.5, &missing) == INCODE_HORIZON_WAIT) {
        assert_true(missing >= s.order.bricks);
        assert_true(missing < s.order.tree.pages);
        assert_true(waits > 0 || missing == s.order.tree.pages - 1);
        assert_int_equal(s.h->count, 0);
        assert_int_equal(s.h->centre, INCODE_NONE);
        assert_false(incode_horizon_holds(s.h, s.lo, s.hi));
        deliver(&s);
        assert_true(waits++ < s.order.tree.pages);
    }
    assert_true(waits > 1);
    assert_int_equal(s.h->centre, brick);
    assert_true(incode_horizon_holds(s.h, s.lo, s.hi));

    const double up[3] = {0.1, 0.2, 1};
    const done_boxes none = {0};
    half_space(&s, draw_vertex(&s, brick), up, &cap);
    struct reached r;
    uint32_t i = 0, count = s.h->count;
    r.count = incode_horizon_reached(s.h, &cap, none, r.index);
    while (i < r.count && s.h->level[r.index[i]] == 0)
        i++;
    assert_true(i < r.count);
    uint32_t at = r.index[i], left = s.h->left[at];
    forget_pages(&s);
    assert_int_equal(incode_horizon_split(s.h, &s.walker, at, &cap, &missing),
                     INCODE_HORIZON_WAIT);
    assert_int_equal(missing, s.h->page[at]);
    assert_true(s.h->count == count && s.h->left[at] == left);
    deliver(&s);
    /* Once it is looked into, the same cap finds nothing new there. */
    for (int k = 0; k < 2; k++) {
        assert_int_equal(
            incode_horizon_split(s.h, &s.walker, at, &cap, &missing),
            INCODE_HORIZON_MADE);
        assert_true(s.h->count > count && s.h->left[at] != left);
        assert_int_equal(s.h->count - count,
                         __builtin_popcount(left & ~s.h->left[at]));
        count = k == 0 ? count : s.h->count;
    }
    close_scene(&s);
}

static void too_many_bricks_are_told(void **unused)
{
    (void)unused;
    struct scene s;
    uint32_t missing, brick = 7;
    open_scene(&s, volume, 30000);
    for (uint32_t p = 0; p < s.order.tree.pages; p++)
        (void)frame_of(&s, p);
    assert_int_equal(try_horizon(&s, brick, 1e3, &missing),
                     INCODE_HORIZON_FULL);
    assert_int_equal(s.h->count, 0);
    assert_int_equal(s.h->centre, brick); /* it need not be tried again */
    assert_false(incode_horizon_holds(s.h, s.lo, s.hi));
    close_scene(&s);
}

/* What is done is not reached, and all else is. */
static void what_is_done_is_left_out(void **unused)
{
    (void)unused;
    struct scene s;
    const double up[3] = {0.1, 0.2, 1};
    struct incode_horizon_cap cap;
    open_scene(&s, terrain, 9000);
    make_horizon(&s, s.order.bricks / 2, 2);
    half_space(&s, draw_vertex(&s, s.h->centre), up, &cap);
    assert_true(split_all(&s, &cap));
    for (int k = 0; k < 20; k++) {
        done_boxes none = {0}, done = {0};
        struct reached all, rest;
        uint32_t kept = 0;
        for (size_t i = 0; i < sizeof done / sizeof *done; i++)
            for (unsigned bit = 0; bit < 64; bit++)
                done[i] |= (uint64_t)(below(3) == 0) << bit;
        all.count = incode_horizon_reached(s.h, &cap, none, all.index);
        rest.count = incode_horizon_reached(s.h, &cap, done, rest.index);
        for (uint32_t i = 0; i < all.count; i++) {
            uint32_t at = all.index[i];
            if ((done[at / 64] >> (at % 64) & 1) == 0)
                assert_true(kept < rest.count && rest.index[kept++] == at);
        }
        assert_int_equal(kept, rest.count);
        assert_true(kept > 0 && kept < all.count);
    }
    close_scene(&s);
}

/* ---- copies ---- */

/* As many copies as there is room for, no two the same. */
static void check_copies(const struct incode_horizon *h)
{
    bool taken[COPIES] = {false};
    for (uint32_t i = 0; i < h->count; i++) {
        uint32_t copy = h->copy[i];
        if (copy == INCODE_NO_COPY)
            continue;
        assert_true(copy < h->room && !taken[copy]);
        taken[copy] = true;
    }
}

static void copies_give_way(void **unused)
{
    (void)unused;
    struct scene s;
    const double up[3] = {0.1, 0.2, 1}, down[3] = {-0.1, -0.2, -1};
    struct incode_horizon_cap cap;
    open_scene(&s, terrain, 40000);
    make_horizon(&s, s.order.bricks / 2, 2);
    uint32_t v = draw_vertex(&s, s.h->centre);
    half_space(&s, v, up, &cap);
    (void)split_all(&s, &cap);
    half_space(&s, v, down, &cap);
    (void)split_all(&s, &cap);
    assert_true(s.h->count > COPIES + 1);
    uint64_t *in = malloc(s.order.bricks * sizeof *in);
    assert_non_null(in);
    struct ball q = {.scale = s.h->scale, .det = 1};
    host_vertex(&s.order, v, q.v);
    for (s.h->room = COPIES / 2; s.h->room <= COPIES; s.h->room += 5) {
        for (uint32_t k = 0; k < 3 * s.h->count; k++) {
            uint32_t at = below(2) == 0 ? below(s.h->count) : k % s.h->count;
            for (int d = 0; d < 3; d++)
                q.m[d] = q.n[d] = even() * 0x1p5;
            if (s.h->level[at] != 0 ||
                !incode_horizon_cap(s.h, &cap, q.v, q.scale, q.m, q.det, q.n))
                continue;
            uint32_t b = s.h->page[at];
            in[b] = points_of_ball(&s, &q, b);
            assert_true((in[b] & ~bits_of(&s, at, &cap)) == 0);
            check_copies(s.h);
        }
        s.h->next = 0;
    }
    free(in);
    close_scene(&s);
}

/* ---- by a box ---- */

struct seen {
    const struct scene *s;
    uint64_t in[512]; /* leaves' points of each brick */
};

static bool see(struct incode_walker *walker, struct incode_query *q,
                const struct incode_frame *frame, uint32_t brick,
                uint32_t leaves, void *context)
{
    struct seen *seen = context;
    (void)walker;
    (void)q;
    assert_int_equal(frame->number, brick);
    for (; leaves != 0; leaves &= leaves - 1)
        seen->in[brick] |= UINT64_C(0xff) << 8 * __builtin_ctz(leaves);
    return true;
}

static void a_box_misses_no_leaf(void **unused)
{
    (void)unused;
    static making *const sets[] = {volume, tiny_cluster, large, denormal};
    for (size_t k = 0; k < sizeof sets / sizeof *sets; k++) {
        struct scene s;
        open_scene(&s, sets[k], 5000);
        for (int tries = 0; tries < 20; tries++) {
            struct seen seen = {&s, {0}};
            struct incode_query q = {.question = INCODE_QUERY_BOX,
                                     .boxed = true};
            make_horizon(&s, below(s.order.bricks), draw());
            for (int d = 0; d < 3; d++) {
                double a = draw(), b = draw(), lo = s.lo[d], hi = s.hi[d];
                q.lo[d] = lo * fmax(a, b) + hi * (1 - fmax(a, b));
                q.hi[d] = lo * fmin(a, b) + hi * (1 - fmin(a, b));
            }
            assert_true(incode_horizon_holds(s.h, q.lo, q.hi));
            while (incode_horizon_box(s.h, &s.walker, &q, see, &seen) ==
                   INCODE_WALK_WAIT)
                deliver(&s);
            for (uint32_t v = 0; v < s.order.bricks * INCODE_BRICK_POINTS;
                 v++) {
                uint32_t b = v / INCODE_BRICK_POINTS, slot = v % 64;
                double p[3];
                bool in = slot < s.order.fill[b];
                host_vertex(&s.order, v, p);
                for (int d = 0; d < 3; d++)
                    in = in && p[d] >= q.lo[d] && p[d] <= q.hi[d];
                assert_true(!in || (seen.in[b] >> slot & 1) != 0);
            }
        }
        close_scene(&s);
    }
}

/* ---- few boxes are reached ---- */

/* Bricks that the ball of some radius reaches which touches the unit sphere at
 * a vertex, from within (side 1) or from without (-1); on average. */
static double touched(struct scene *s, double radius, double side)
{
    uint32_t tries = 60, bricks = 0;
    for (uint32_t i = 0; i < tries; i++) {
        struct incode_horizon_cap cap;
        struct reached r;
        const done_boxes none = {0};
        double p[3], m[3], n[3];
        make_horizon(s, below(s->order.bricks), 0.5);
        host_vertex(&s->order, draw_vertex(s, s->h->centre), p);
        for (int d = 0; d < 3; d++) {
            n[d] = -side * p[d];
            m[d] = 2 * radius * s->h->scale * n[d];
        }
        assert_true(incode_horizon_cap(s->h, &cap, p, s->h->scale, m, 1, n));
        assert_true(split_all(s, &cap));
        r.count = incode_horizon_reached(s->h, &cap, none, r.index);
        for (uint32_t k = 0; k < r.count; k++)
            bricks += s->h->level[r.index[k]] == 0;
    }
    return (double)bricks / tries;
}

static void a_cap_beside_a_surface_reaches_little(void **unused)
{
    (void)unused;
    static const struct {
        double radius, side, most; /* twice what was counted */
    } balls[] = {{0.01, 1, 2.1}, {0.5, 1, 12}, {0.98, 1, 17},
                 {0.5, -1, 6},   {10, -1, 8},  {1000, -1, 8}};
    struct scene s;
    open_scene(&s, sphere, 4096);
    for (size_t i = 0; i < sizeof balls / sizeof *balls; i++) {
        double bricks = touched(&s, balls[i].radius, balls[i].side);
        assert_true(bricks >= 1 && bricks <= balls[i].most);
    }
    close_scene(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_point_is_lost),
        cmocka_unit_test(no_point_is_lost_where_it_is_full),
        cmocka_unit_test(a_missing_page_is_named),
        cmocka_unit_test(too_many_bricks_are_told),
        cmocka_unit_test(what_is_done_is_left_out),
        cmocka_unit_test(copies_give_way),
        cmocka_unit_test(a_box_misses_no_leaf),
        cmocka_unit_test(a_cap_beside_a_surface_reaches_little),
    };
    return cmocka_run_group_tests_name("horizon", tests, NULL, NULL);
}
