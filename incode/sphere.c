#include "sphere.h"

/* The permanents of a cross product: the same sums with all signs positive. */
static void permanents(double out[3], const double a[3], const double b[3])
{
    double x = __builtin_fabs(a[0]), y = __builtin_fabs(a[1]),
           z = __builtin_fabs(a[2]);
    double u = __builtin_fabs(b[0]), v = __builtin_fabs(b[1]),
           w = __builtin_fabs(b[2]);
    out[0] = y * w + z * v;
    out[1] = z * u + x * w;
    out[2] = x * v + y * u;
}

void incode_sphere_plane(struct incode_sphere *s, const double b[3],
                         const double c[3])
{
    incode_cross(s->n, b, c);
    permanents(s->pn, b, c);
    s->has_apex = false;
}

void incode_sphere_apex(struct incode_sphere *s, const double b[3],
                        const double c[3], const double a[3])
{
    double ca[3], ab[3], pca[3], pab[3];
    incode_cross(ca, c, a);
    incode_cross(ab, a, b);
    permanents(pca, c, a);
    permanents(pab, a, b);
    double bb = incode_dot(b, b), cc = incode_dot(c, c), aa = incode_dot(a, a);
    s->det = incode_dot(a, s->n);
    s->pdet = 0;
    for (int d = 0; d < 3; d++) {
        s->m[d] = bb * ca[d] + cc * ab[d] + aa * s->n[d];
        s->pm[d] = bb * pca[d] + cc * pab[d] + aa * s->pn[d];
        s->pdet += __builtin_fabs(a[d]) * s->pn[d];
    }
    s->has_apex = true;
}
