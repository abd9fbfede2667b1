#include "cavity.h"

#include "incode/predicates/simd.h"

enum { BATCH = INCODE_SPHERE_BATCH };

_Static_assert(BATCH % INCODE_VD_LANES == 0, "whole vectors");

typedef incode_vd vector[3];
typedef uint64_t words __attribute__((vector_size(INCODE_VECTOR), may_alias));

INCODE_INLINE void cross(vector r, const vector a, const vector b) {
    r[0] = a[1] * b[2] - a[2] * b[1];
    r[1] = a[2] * b[0] - a[0] * b[2];
    r[2] = a[0] * b[1] - a[1] * b[0];
}

INCODE_INLINE incode_vd dot(const vector a, const vector b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

INCODE_INLINE incode_vd largest3(incode_vd a, incode_vd b, incode_vd c) {
    return incode_vd_max(incode_vd_abs(a),
                         incode_vd_max(incode_vd_abs(b), incode_vd_abs(c)));
}

/* Rounds to multiples of the next power of two not below the scale. */
INCODE_INLINE void keep(struct incode_sphere_batch *b, int at, const vector n,
                        incode_vd scale, incode_vl known, incode_vl infinite) {
    const words zero = {0};
    words kept = zero, low = zero, up = zero + ((UINT64_C(1) << 52) - 1);
    words bits = ((words)scale + up) & ~up;
    bits = ((words)known & bits) | (~(words)known & (UINT64_C(0x7ff) << 52));
    words inverse = (UINT64_C(2046) << 52) - bits;
    for (int k = 2; k >= 0; k--) {
        /* The last bits of this sum are the nearest whole number. */
        words whole = (words)(n[k] * (incode_vd)inverse + 0x1.8p52);
        kept = (kept << 16) | (whole >> 8 & 0xffff);
        low = (low << 8) | (whole & 0xff);
    }
    kept |= (bits >> 7 & (UINT64_C(0xff) << 48)) | bits << 9;
    kept |= (words)infinite & ((uint64_t)INCODE_CELL_INFINITE << 56);
    *(words *)&b->kept[at] = kept;
    *(words *)&b->low[at] = low;
}

/* With m[k] the largest |coordinate k|, W the largest |a|^2 and u = 2^-53:
 * coordinates have relative errors of u, products of two of them of 3 u; so
 * those of cross products are below 8 u m[i] m[j], that of the determinant D
 * below 64 u m[0] m[1] m[2], those of the three sums N of squares and cross
 * products below 96 u W m[i] m[j].  N / D then is wrong by at most
 *
 *     2 (96 u W m[i] m[j] + 64 u m[0] m[1] m[2] |N / D|) / |D|
 *
 * where |D| > 128 u m[0] m[1] m[2], and by its own rounding.  An infinite
 * vertex has no part in N but for the cross product of the others, D is the
 * 1-norm of N, and neither rounding of D nor W matters. */
INCODE_INLINE void compute(struct incode_sphere_batch *b, int at) {
    const incode_vd zero = {0}, one = zero + 1;
    incode_vd lift[3], some = zero, m[3];
    vector v[3], n, part[3];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            v[i][k] = incode_vd_load(&b->p[i][k][at]);
        lift[i] = dot(v[i], v[i]);
        some += incode_vd_load(&b->infinite[i][at]);
    }
    incode_vl infinite = some > zero;
    incode_vd w = incode_vd_max(incode_vd_max(lift[0], lift[1]), lift[2]);
    w = incode_vd_select(infinite, one, w);
    cross(part[0], v[1], v[2]);
    cross(part[1], v[2], v[0]);
    cross(part[2], v[0], v[1]);
    for (int i = 0; i < 3; i++)
        lift[i] = incode_vd_select(
            infinite, incode_vd_load(&b->infinite[i][at]), lift[i]);
    for (int k = 0; k < 3; k++) {
        n[k] =
            lift[0] * part[0][k] + lift[1] * part[1][k] + lift[2] * part[2][k];
        m[k] = largest3(v[0][k], v[1][k], v[2][k]);
    }
    incode_vd pair = largest3(m[0] * m[1], m[1] * m[2], m[2] * m[0]);
    incode_vd volume = m[0] * m[1] * m[2], most = largest3(m[0], m[1], m[2]);
    incode_vd det = dot(v[0], part[0]);
    incode_vd norm =
        incode_vd_abs(n[0]) + incode_vd_abs(n[1]) + incode_vd_abs(n[2]);
    det = incode_vd_select(infinite, -norm, det);
    incode_vd low = incode_vd_select(infinite, pair, volume);
    volume = incode_vd_select(infinite, zero, volume);
    incode_vd inverse = one / det;
    for (int k = 0; k < 3; k++)
        n[k] *= inverse;
    incode_vd size = largest3(n[0], n[1], n[2]);
    incode_vd error = 0x1p-45 * (w * pair + size * volume);
    incode_vd scale = incode_vd_max(0x1.000002p-23 * size,
                                    0x1p4 * error * incode_vd_abs(inverse));
    incode_vl known = (low > 1e-200 - zero) & (most < 1e50 - zero) &
                      (incode_vd_abs(det) > 0x1p-46 * volume) &
                      (scale > 0x1p-250 - zero) & (scale < 0x1p249 - zero);
    keep(b, at, n, scale, known, infinite);
}

void incode_sphere_compute(struct incode_sphere_batch *b) {
    for (int at = 0; at < BATCH; at += INCODE_VD_LANES)
        compute(b, at);
}

static void load(const struct incode_complex *x, struct incode_sphere_batch *b,
                 const double o[3], const uint32_t *cell, uint32_t count) {
    for (uint32_t j = 0; j < count; j++) {
        const struct incode_cell *c = incode_complex_cell(x, cell[j]);
        for (int i = 0; i < 3; i++) {
            bool infinite = c->v[i] == INCODE_COMPLEX_INFINITE;
            const double *p = infinite ? o : x->point[c->v[i]].p;
            for (int k = 0; k < 3; k++)
                b->p[i][k][j] = p[k] - o[k];
            b->infinite[i][j] = infinite;
        }
    }
}

void incode_complex_set_spheres(struct incode_complex *x, uint32_t last,
                                const uint32_t *cell, uint32_t count) {
    struct incode_sphere_batch b;
    memset(&b, 0, sizeof b);
    for (uint32_t first = 0; first < count; first += BATCH) {
        uint32_t some = count - first < BATCH ? count - first : BATCH;
        load(x, &b, x->point[last].p, cell + first, some);
        incode_sphere_compute(&b);
        for (uint32_t j = 0; j < some; j++)
            incode_sphere_keep(incode_complex_cell(x, cell[first + j]), &b, j);
    }
}
