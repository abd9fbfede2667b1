#include "empty_spheres.h"

#include <string.h>

#include "half_space.h"

/* Relative error of a sum of some numbers of twice the precision. */
#define FINE 1e-29

static struct incode_dd ratio(struct incode_dd a, struct incode_dd b) {
    struct incode_dd q = {a.hi / b.hi, 0}, r;
    double rest = incode_dd_minus(a, incode_dd_times(q, b)).hi / b.hi;
    r.hi = incode_fast_two_sum(q.hi, rest, &r.lo);
    return r;
}

/* False: too little is known of it. */
static bool circum_of(struct incode_circum *c, const double *const p[4],
                      double scale) {
    struct incode_near_degenerate degenerate;
    degenerate.known = degenerate.regular = false;
    degenerate.count = 0;
    incode_near_degenerate_sphere(&degenerate, p, scale);
    struct incode_dd det = degenerate.sphere.det;
    /* The spread bounds the errors of det and of m. */
    if (!(det.hi > 1e9 * degenerate.spread) || !(det.hi > INCODE_SPHERE_LEAST))
        return false;
    memcpy(c->p, p[0], sizeof c->p);
    c->scale = scale;
    for (int k = 0; k < 3; k++)
        c->twice[k] = ratio(degenerate.sphere.m[k], det);
    double size = incode_dd_max_norm(c->twice);
    c->error = 2 * degenerate.spread * (1 + size) / det.hi + FINE * size;
    double longest = 0, r[3];
    for (int i = 1; i < 4; i++) {
        for (int k = 0; k < 3; k++)
            r[k] = (p[i][k] - p[0][k]) * scale;
        double square = incode_dot(r, r);
        longest = square > longest ? square : longest;
    }
    c->thickness = det.hi / longest / scale;
    return c->error < 1e300;
}

/* Nearly the same sphere, as far as doubles can tell. */
static bool is_same(const struct incode_circum *a,
                    const struct incode_circum *b) {
    double gap[3], size = incode_dd_max_norm(a->twice) / a->scale;
    for (int k = 0; k < 3; k++)
        gap[k] = a->p[k] * 2 + a->twice[k].hi / a->scale - b->p[k] * 2 -
                 b->twice[k].hi / b->scale;
    return incode_max_norm(gap) < 1e-3 * size;
}

void incode_empty_spheres_add(struct incode_empty_spheres *e,
                              const double *const p[4], double scale) {
    struct incode_circum c;
    if (!circum_of(&c, p, scale))
        return;
    for (uint32_t i = 0; i < e->count; i++) {
        if (!is_same(&c, &e->sphere[i]))
            continue;
        if (c.thickness > e->sphere[i].thickness)
            e->sphere[i] = c;
        return;
    }
    e->sphere[e->next] = c;
    e->next = (e->next + 1) % INCODE_EMPTY_SPHERES;
    if (e->count < INCODE_EMPTY_SPHERES)
        e->count++;
}

/* With d = v - p of the empty sphere, M and N twice the centres: the power of r
 * less that in the empty sphere is (N - M - 2 d) . r - (|d|^2 - N . d). */
static bool bound_of(struct incode_radical_bound *c,
                     const struct incode_circum *b,
                     const struct incode_circum *empty) {
    struct incode_dd_vector d = incode_dd_relative(b->p, empty->p, b->scale);
    struct incode_dd there[3], negative[3];
    double share = b->scale / empty->scale, size = 0;
    double far = 2 * incode_dd_max_norm(d.d) + incode_dd_max_norm(b->twice);
    for (int k = 0; k < 3; k++) {
        there[k].hi = empty->twice[k].hi * share;
        there[k].lo = empty->twice[k].lo * share;
        struct incode_dd twice = {2 * d.d[k].hi, 2 * d.d[k].lo};
        struct incode_dd g =
            incode_dd_minus(incode_dd_minus(there[k], twice), b->twice[k]);
        c->g[k] = g.hi;
        size += __builtin_fabs(g.hi);
        negative[k] = incode_dd_minus(d.d[k], there[k]);
    }
    far += incode_dd_max_norm(there);
    double error = empty->error * share;
    c->slack = error + b->error + FINE * far + 1e-15 * size;
    /* |d|^2 - N . d = d . (d - N) */
    c->level = incode_dd_dot(d.d, negative).hi * (1 + 1e-15) +
               (3 * error + FINE * far) * far;
    /* What overflows is not a number, and stays so. */
    c->level = c->level < 0 ? 0 : c->level;
    c->set = c->level < 1e300 && c->slack < 1e300;
    return c->set;
}

void incode_radical_bound_set(struct incode_radical_bound *c,
                              const struct incode_empty_spheres *e,
                              const double *const p[4], double scale,
                              const double n[3]) {
    struct incode_circum best;
    double most = 0;
    c->set = false;
    if (e->count == 0 || !circum_of(&best, p, scale))
        return;
    for (uint32_t i = 0; i < e->count; i++) {
        struct incode_radical_bound here;
        if (!bound_of(&here, &best, &e->sphere[i]))
            continue;
        double steep = incode_dot(here.g, n) / (here.level + 1e-200);
        if (steep > most) {
            *c = here;
            most = steep;
        }
    }
}
