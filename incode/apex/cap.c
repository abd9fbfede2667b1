#include "apex.h"
#include "incode/predicates/simd.h"

/* Whether the cap of a sphere beyond a face lies in a box. */

/* Three numbers along the axes' two directions, in the order of a box's walls;
 * the lanes from `first` on. */
INCODE_INLINE incode_vd both_ways(const double a[3], int first) {
#if INCODE_VECTOR == 64
    (void)first;
    return (incode_vd){a[0], a[1], a[2], 0, -a[0], -a[1], -a[2], 0};
#elif INCODE_VECTOR == 32
    incode_vd up = {a[0], a[1], a[2], 0};
    return first == 0 ? up : -up;
#elif INCODE_VECTOR == 16
    incode_vd up = {a[first % 4], first % 4 == 0 ? a[1] : 0};
    return first < 4 ? up : -up;
#else
    incode_vd up = {first % 4 == 3 ? 0 : a[first % 4]};
    return first < 4 ? up : -up;
#endif
}

bool incode_cap_fits(const double walls[8], const struct incode_pencil *pencil,
                     double t) {
    double circle = incode_dot(pencil->c0, pencil->c0);
    double square = circle + 0.25 * t * t, radius = __builtin_sqrt(square);
    incode_vd zero = incode_vd_all(0);
    incode_vl all = incode_vl_ones();
    for (int first = 0; first < 8; first += INCODE_VD_LANES) {
        incode_vd n = both_ways(pencil->n, first);
        incode_vd c0 = both_ways(pencil->c0, first);
        incode_vd wall = incode_vd_load(walls + first);
        incode_vd gap = wall - (c0 + incode_vd_all(0.5 * t) * n);
        incode_vl in =
            (gap > zero) & (gap * gap > incode_vd_all(square * (1 + 4e-6)));
        incode_vl known =
            n * incode_vd_all(radius) < incode_vd_all(-0.5 * t - 2e-6 * radius);
        incode_vd rim = incode_vd_all(circle + 4e-6 * square) -
                        incode_vd_all(circle) * n * n;
        incode_vd short_gap = wall - c0;
        in |= known & (short_gap > zero) & (short_gap * short_gap > rim);
        all &= in;
    }
    return incode_vd_mask(all) == INCODE_VD_ALL;
}

/* The centre is m / (2 det), the radius its length. */
bool incode_sphere_fits(const double wall[8], const struct incode_sphere *s) {
    if (!(s->det > 1e9 * INCODE_SPHERE_EPS * s->pdet) ||
        !(s->det > INCODE_SPHERE_LEAST)) /* squares below would underflow */
        return false;
    double nn = incode_dot(s->n, s->n), half = 0.5 / s->det;
    double centre[3], t = 2 * incode_dot(s->n, s->m) * half;
    struct incode_pencil pencil;
    double unit = 1 / __builtin_sqrt(nn);
    double length = __builtin_sqrt(incode_dot(s->m, s->m)) * half;
    double error = 12 * INCODE_SPHERE_EPS * incode_max_norm(s->pm) * half;
    if (!(error < 1e-7 * length))
        return false;
    /* Without a good normal, the whole sphere. */
    if (!(nn > 1e-60) || !(INCODE_SPHERE_EPS * incode_max_norm(s->pn) <
                           1e-8 * incode_max_norm(s->n)))
        t = unit = 0;
    for (int d = 0; d < 3; d++) {
        centre[d] = s->m[d] * half;
        pencil.n[d] = s->n[d] * unit;
        pencil.c0[d] = centre[d] - 0.5 * t * unit * pencil.n[d];
    }
    return incode_cap_fits(wall, &pencil, t * unit);
}
