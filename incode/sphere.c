#include "sphere.h"

void incode_sphere_plane(struct incode_sphere *s, const double b[3],
                         const double c[3])
{
    incode_cross(s->n, b, c);
    s->lb = incode_max_norm(b);
    s->lc = incode_max_norm(c);
    s->bb = incode_dot(b, b);
    s->cc = incode_dot(c, c);
    s->pn = 2 * s->lb * s->lc;
    s->has_apex = false;
}

void incode_sphere_apex(struct incode_sphere *s, const double b[3],
                        const double c[3], const double a[3])
{
    double ca[3], ab[3];
    incode_cross(ca, c, a);
    incode_cross(ab, a, b);
    double aa = incode_dot(a, a), la = incode_max_norm(a);
    s->det = incode_dot(a, s->n);
    for (int d = 0; d < 3; d++)
        s->m[d] = s->bb * ca[d] + s->cc * ab[d] + aa * s->n[d];
    /* Each of the two products of a cross product is at most that of the
     * maximum norms; the determinant has three such pairs. */
    s->pm = 2 * (s->bb * s->lc * la + s->cc * la * s->lb + aa * s->lb * s->lc);
    s->pdet = 3 * la * s->pn;
    s->has_apex = true;
}
