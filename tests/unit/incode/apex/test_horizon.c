/* A horizon against all points: what lies in a cap by exact arithmetic is in
 * one of the boxes that are reached, and its bit is set. */
#include "tests/unit/incode/apex/horizon_scene.h"

/* ---- what must hold ---- */

/* Bricks that are reached, or pages above that have no box of their own for
 * what is beneath. */
static void mark(const struct scene *s, const struct reached *r, bool full,
                 uint16_t *where) {
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

/* No coordinate in a box is beyond its farness, of which errors are parts. */
static void check_far(const struct incode_horizon *h) {
    for (uint32_t i = 0; i < h->count; i++) {
        for (int d = 0; d < 3; d++) {
            assert_true(h->lo[d][i] <= h->hi[d][i]);
            assert_true(-h->lo[d][i] <= h->far[i]);
            assert_true(h->hi[d][i] <= h->far[i]);
        }
    }
}

/* in: the points of each brick that are in the cap, one bit each.  False: there
 * was no room to look into all pages. */
static bool check_cap(struct scene *s, const struct incode_horizon_cap *cap,
                      const uint64_t *in, const char *what) {
    const done_boxes none = {0};
    struct reached r;
    bool full = !split_all(s, cap);
    uint16_t *where = malloc(s->order.bricks * sizeof *where);
    assert_non_null(where);
    r.count = incode_horizon_reached(s->h, cap, none, r.index);
    assert_true(r.count <= s->h->count);
    check_far(s->h);
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
static uint32_t draw_near(const struct scene *s) {
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
static bool draw_face(struct scene *s, struct face *f) {
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

static void relative(double r[3], const struct face *f, const double p[3]) {
    for (int d = 0; d < 3; d++)
        r[d] = (p[d] - f->v[d]) * f->scale;
}

/* Errors vanish among the roundings to single precision. */
static bool is_sure(const double a[3], const double bound[3]) {
    return INCODE_SPHERE_EPS * incode_max_norm(bound) <
           0x1p-26 * incode_max_norm(a);
}

/* That of the face's sphere or, without an apex, of all its spheres. */
static bool face_cap(const struct scene *s, const struct face *f, bool apex,
                     struct incode_horizon_cap *cap) {
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
                               uint32_t brick) {
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

/* A sphere of any radius from far below to far above the horizon's, or a
 * half-space. */
static void draw_ball(const struct scene *s, struct ball *q) {
    double radius = ldexp(1, (int)below(50) - 15),
           any = ldexp(1, (int)below(99));
    host_vertex(&s->order, draw_near(s), q->v);
    q->scale = s->h->scale > 0x1p900 ? s->h->scale * ldexp(1, -(int)below(8))
                                     : s->h->scale * ldexp(1, (int)below(8));
    q->det = below(4) == 0 ? 0 : any;
    q->radical = (struct incode_radical_bound){
        below(2) == 0, {even(), even(), even()}, radius * draw(), 0x1p-40};
    for (int d = 0; d < 3; d++) {
        q->n[d] = even() * 1e-9;
        q->m[d] = even() * radius * any * (q->scale / s->h->scale);
    }
    if (below(2) == 0) /* the cap of a sphere that is cut low */
        memcpy(q->n, q->m, sizeof q->n);
}

static bool ball_cap(const struct scene *s, const struct ball *q,
                     struct incode_horizon_cap *cap) {
    if (!incode_horizon_cap(s->h, cap, q->v, q->scale, q->m, q->det, q->n))
        return false;
    if (q->radical.set)
        incode_horizon_bound(s->h, cap, q->scale, &q->radical);
    return true;
}

/* ---- no point is lost ---- */

enum { CAPS = 24 };

struct tried {
    unsigned caps, spheres, full, walks, unseen;
};

static void try_cap(struct scene *s, uint64_t *in, const char *name,
                    struct tried *tried) {
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
        made = ball_cap(s, &q, &cap);
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

/* The walk down the tree, with what it knows of boxes: by the sphere of the
 * best so far, as a box and a ball or not. */
static void try_walk(struct scene *s, const char *name, struct tried *tried) {
    struct face f;
    struct seen seen = {{0}};
    struct incode_query q = {.question = INCODE_QUERY_APEX,
                             .best = INCODE_NONE};
    double a[3];
    bool apex = below(4) > 0;
    if (!draw_face(s, &f))
        return;
    memcpy(q.pv, f.v, sizeof q.pv);
    memcpy(q.pb, f.b, sizeof q.pb);
    memcpy(q.pc, f.c, sizeof q.pc);
    q.v = f.id[0], q.b = f.id[1], q.c = f.id[2];
    q.shrinking = below(2) == 0;
    incode_query_face(&q);
    if (apex) {
        relative(a, &f, f.a);
        incode_sphere_apex(&q.sphere, q.rb, q.rc, a);
        if (incode_sphere_is_ill_conditioned(&q.sphere))
            incode_sphere_refine(&q.sphere, f.v, f.b, f.c, f.a, f.scale);
        incode_query_start(&q, f.id[3], f.a);
    }
    while (incode_walk(&s->walker, &q, see, &seen) == INCODE_WAITING)
        deliver(s);
    tried->walks++;
    for (uint32_t b = 0; b < s->order.bricks; b++) {
        uint64_t lost = points_of_face(s, &f, apex, b) & ~seen.in[b];
        if (lost != 0)
            fail_msg("%s: a walk misses point %d of brick %u", name,
                     __builtin_ctzll(lost), b);
        tried->unseen += seen.in[b] == 0;
    }
}

static void check_set(making *make, const char *name, uint32_t n,
                      uint32_t horizons, struct tried *tried) {
    struct scene s;
    open_scene(&s, make, n);
    uint64_t *in = malloc(s.order.bricks * sizeof *in);
    assert_non_null(in);
    for (uint32_t i = 0; i < horizons; i++) {
        make_horizon(&s, below(s.order.bricks), 2 * draw());
        for (uint32_t k = 0; k < CAPS; k++)
            try_cap(&s, in, name, tried);
        for (uint32_t k = 0; k < CAPS / 2 && n < 10000; k++)
            try_walk(&s, name, tried);
    }
    free(in);
    close_scene(&s);
}

TEST(no_point_is_lost) {
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
                {point_scales, "each point of its own scale"},
                {each_scale, "each coordinate of its own scale"}};
    unsigned unseen = 0;
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        struct tried tried = {0};
        check_set(sets[i].make, sets[i].name, 2000, 3, &tried);
        assert_true(tried.caps > CAPS && tried.spheres > CAPS / 3);
        assert_true(tried.walks > CAPS);
        unseen += tried.unseen;
    }
    assert_true(unseen > 1000); /* bricks that a walk did not look into */
}

/* More bricks than there is room for boxes; three levels of box pages. */
TEST(no_point_is_lost_where_it_is_full) {
    struct tried tried = {0};
    check_set(terrain, "large terrain", 70000, 1, &tried);
    assert_true(tried.full > 0 && tried.full < tried.caps);
}

/* Planes through the horizon, of sets in which most is beyond all bounds. */
TEST(half_spaces_hold_what_is_far) {
    struct scene s;
    open_scene(&s, all_scales, 2000);
    uint64_t *in = malloc(s.order.bricks * sizeof *in);
    assert_non_null(in);
    for (int i = 0; i < 100; i++) {
        struct incode_horizon_cap cap;
        struct ball q;
        if (i % 5 == 0)
            make_horizon(&s, below(s.order.bricks), 0.5);
        draw_ball(&s, &q);
        q.det = 0;
        memcpy(q.n, q.m, sizeof q.n);
        if (!ball_cap(&s, &q, &cap))
            continue;
        for (uint32_t b = 0; b < s.order.bricks; b++)
            in[b] = points_of_ball(&s, &q, b);
        assert_true(check_cap(&s, &cap, in, "half-spaces"));
    }
    free(in);
    close_scene(&s);
}
