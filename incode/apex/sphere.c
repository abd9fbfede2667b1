#include "sphere.h"

#include <stddef.h>
#include <string.h>

/* What underflows in a determinant is lost to all points, however far. */
#define LOST 1e-290

void incode_sphere_plane(struct incode_sphere *s, const double b[3],
                         const double c[3]) {
    incode_cross(s->n, b, c);
    s->lb = incode_max_norm(b);
    s->lc = incode_max_norm(c);
    s->bb = incode_dot(b, b);
    s->cc = incode_dot(c, c);
    s->pn[0] = s->pn[1] = s->pn[2] = 2 * s->lb * s->lc + LOST;
    s->has_apex = false;
}

void incode_sphere_apex(struct incode_sphere *s, const double b[3],
                        const double c[3], const double a[3]) {
    double ca[3], ab[3];
    incode_cross(ca, c, a);
    incode_cross(ab, a, b);
    double aa = incode_dot(a, a), la = incode_max_norm(a);
    s->det = incode_dot(a, s->n);
    for (int d = 0; d < 3; d++)
        s->m[d] = s->bb * ca[d] + s->cc * ab[d] + aa * s->n[d];
    /* Each of the two products of a cross product is at most that of the
     * maximum norms; the determinant has three such pairs. */
    s->pm[0] = s->pm[1] = s->pm[2] =
        2 * (s->bb * s->lc * la + s->cc * la * s->lb + aa * s->lb * s->lc) +
        LOST * (1 + s->bb + s->cc + aa);
    s->pdet = 6 * la * s->lb * s->lc + LOST * (1 + la);
    s->has_apex = true;
}

/* ---- twice the precision ---- */

/* What is left: the roundings of the evaluation, at most 7 units on a term with
 * m or n, 8 on that with det, and 2^-100 of the old bounds.  As large as the
 * value itself, so that a bound overflows where a product does. */
static double refined(double value, double bound) {
    return __builtin_fabs(value) + 1e-15 * bound;
}

void incode_sphere_fine(struct incode_fine *f, const double v[3],
                        const double b[3], const double c[3], const double *a,
                        double scale) {
    struct incode_dd_vector rb = incode_dd_relative(b, v, scale),
                            rc = incode_dd_relative(c, v, scale);
    struct incode_dd_vector n = incode_dd_vector_product(rb.d, rc.d);
    memcpy(f->n, n.d, sizeof f->n);
    if (a == NULL)
        return;
    struct incode_dd_vector ra = incode_dd_relative(a, v, scale);
    struct incode_dd_vector ca = incode_dd_vector_product(rc.d, ra.d),
                            ab = incode_dd_vector_product(ra.d, rb.d);
    struct incode_dd squares[3] = {incode_dd_dot(rb.d, rb.d),
                                   incode_dd_dot(rc.d, rc.d),
                                   incode_dd_dot(ra.d, ra.d)};
    for (int k = 0; k < 3; k++) {
        struct incode_dd normals[3] = {ca.d[k], ab.d[k], n.d[k]};
        f->m[k] = incode_dd_dot(squares, normals);
    }
    f->det = incode_dd_dot(ra.d, n.d);
}

/* ---- bounds of each component ---- */

static void relative(double r[3], const double p[3], const double v[3],
                     double scale) {
    for (int d = 0; d < 3; d++)
        r[d] = (p[d] - v[d]) * scale;
}

/* Of the components of a cross product: the sum of its two products. */
static void cross_bound(double out[3], const double a[3], const double b[3]) {
    for (int d = 0; d < 3; d++) {
        int j = (d + 1) % 3, k = (d + 2) % 3;
        out[d] = __builtin_fabs(a[j] * b[k]) + __builtin_fabs(a[k] * b[j]);
    }
}

/* Bounds that tell the axes apart: where these have different scales, the
 * maximum norms are far too much. */
static void sharpen(struct incode_sphere *s, const double b[3],
                    const double c[3], const double *a) {
    double bc[3], ca[3], ab[3];
    cross_bound(bc, b, c);
    if (a == NULL) {
        for (int d = 0; d < 3; d++)
            s->pn[d] = bc[d] + LOST;
        return;
    }
    double aa = incode_dot(a, a), lost = LOST * (1 + s->bb + s->cc + aa);
    cross_bound(ca, c, a);
    cross_bound(ab, a, b);
    for (int d = 0; d < 3; d++)
        s->pm[d] = s->bb * ca[d] + s->cc * ab[d] + aa * bc[d] + lost;
    s->pdet = incode_absolute_dot(bc, a) + LOST * (1 + incode_max_norm(a));
}

void incode_sphere_refine(struct incode_sphere *s, const double v[3],
                          const double b[3], const double c[3], const double *a,
                          double scale) {
    struct incode_fine fine;
    double rb[3], rc[3], ra[3];
    relative(rb, b, v, scale);
    relative(rc, c, v, scale);
    if (a != NULL)
        relative(ra, a, v, scale);
    sharpen(s, rb, rc, a == NULL ? NULL : ra);
    if (!(a == NULL ? incode_plane_is_ill_conditioned(s)
                    : incode_sphere_is_ill_conditioned(s)))
        return;
    incode_sphere_fine(&fine, v, b, c, a, scale);
    for (int k = 0; k < 3; k++) {
        s->n[k] = fine.n[k].hi;
        s->pn[k] = refined(s->n[k], 2 * s->lb * s->lc + LOST);
    }
    if (a == NULL)
        return;
    for (int k = 0; k < 3; k++) {
        s->m[k] = fine.m[k].hi;
        s->pm[k] = refined(s->m[k], s->pm[k]);
    }
    s->det = fine.det.hi;
    s->pdet = refined(s->det, s->pdet);
}
