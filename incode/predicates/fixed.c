#include "exact.h"

#include <string.h>

#include "scale.h"
#include "tie.h"

/* cppcheck-suppress shiftNegativeLHS */
_Static_assert((-1 >> 1) == -1, "shifts of negative numbers keep the sign");

/* ---- from doubles to integers ---- */

/* Four coordinates, of which the fourth is 0: a register, or two. */
typedef double four_d __attribute__((vector_size(32)));
typedef int64_t four_i __attribute__((vector_size(32)));

static inline four_d all4(double a) {
    return (four_d){a, a, a, a};
}

static inline four_d load3(const double p[3]) {
    return (four_d){p[0], p[1], p[2], 0};
}

/* n = v * 2^k; lanes where that is no integer are not 0. */
static inline four_i scaled(four_i *n, four_d v, const struct incode_scale *s) {
    four_i lost = {0};
    four_d u = v * all4(s->up1);
    if (!s->plain) {
        u *= all4(s->up2);
        lost = u * all4(s->down1) * all4(s->down2) != v;
    }
    *n = __builtin_convertvector(u, four_i);
    return lost | (__builtin_convertvector(*n, four_d) != u);
}

static inline bool any4(four_i a) {
    return (a[0] | a[1] | a[2]) != 0;
}

bool incode_fixed_differences(int64_t d[][3], const double *const p[],
                              int count, const double origin[3], double most) {
    struct incode_scale s;
    if (!incode_scale_init(&s, most))
        return false; /* where the two-sum could fail, too */
    four_d b = load3(origin), tail[4];
    four_i n[4], bad = {0}, inexact = {0};
    for (int i = 0; i < count; i++) {
        /* Knuth's two-sum: a - b = x + y without error. */
        four_d a = load3(p[i]), x = a - b, bv = a - x, av = x + bv;
        tail[i] = (a - av) + (bv - b);
        bad |= scaled(&n[i], x, &s);
        inexact |= tail[i] != all4(0);
    }
    if (any4(inexact)) {
        for (int i = 0; i < count; i++) {
            four_i rest;
            bad |= scaled(&rest, tail[i], &s);
            n[i] += rest;
        }
    }
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++)
            d[i][k] = n[i][k];
    return !any4(bad);
}

/* For incode_tie: the four points and the origin in order. */
static uint32_t rank(const int64_t d[4][3]) {
    static const int64_t zero[3] = {0, 0, 0};
    uint32_t above = 0;
    for (int i = 0; i < 5; i++) {
        for (int j = i + 1; j < 5; j++) {
            const int64_t *a = d[i], *b = j < 4 ? d[j] : zero;
            int larger = (a[0] > b[0]) |
                         ((a[0] == b[0]) &
                          ((a[1] > b[1]) | ((a[1] == b[1]) & (a[2] > b[2]))));
            above += INCODE_TIE_ABOVE(i, j, larger);
        }
    }
    return above;
}

/* ---- 32-bit words ---- */

/* Numbers in two's complement, least word first.  r = a * b in na + nb. */
static void product(uint32_t *r, const uint32_t *a, int na, const uint32_t *b,
                    int nb) {
    memset(r, 0, (size_t)(na + nb) * sizeof r[0]);
    for (int i = 0; i < na; i++) {
        uint64_t carry = 0;
        for (int j = 0; j < nb; j++) {
            carry += (uint64_t)a[i] * b[j] + r[i + j];
            r[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        r[i + nb] = (uint32_t)carry;
    }
    /* A negative factor was taken as 2^(32 words) too large. */
    uint32_t a_mask = 0u - (a[na - 1] >> 31), b_mask = 0u - (b[nb - 1] >> 31);
    uint64_t borrow = 0;
    for (int j = 0; j < nb; j++) {
        borrow = (uint64_t)r[na + j] - (b[j] & a_mask) - borrow;
        r[na + j] = (uint32_t)borrow;
        borrow = borrow >> 63;
    }
    borrow = 0;
    for (int i = 0; i < na; i++) {
        borrow = (uint64_t)r[nb + i] - (a[i] & b_mask) - borrow;
        r[nb + i] = (uint32_t)borrow;
        borrow = borrow >> 63;
    }
}

/* r += a or r -= a. */
static void accumulate(uint32_t *r, const uint32_t *a, int n, bool subtract) {
    uint32_t mask = subtract ? UINT32_MAX : 0;
    uint64_t carry = subtract;
    for (int i = 0; i < n; i++) {
        carry += (uint64_t)r[i] + (a[i] ^ mask);
        r[i] = (uint32_t)carry;
        carry >>= 32;
    }
}

static int words_sign(const uint32_t *a, int n) {
    uint32_t any = 0;
    for (int i = 0; i < n; i++)
        any |= a[i];
    return a[n - 1] >> 31 != 0 ? -1 : any != 0;
}

typedef uint32_t words2[2]; /* a difference, below 2^61 */
typedef uint32_t words4[4]; /* a 2 x 2 minor or a squared distance, 2^124 */
typedef uint32_t words6[6]; /* a 3 x 3 minor, 2^186 */

static void words_of(words2 r, int64_t a) {
    r[0] = (uint32_t)(uint64_t)a;
    r[1] = (uint32_t)((uint64_t)a >> 32);
}

/* r += a b or r -= a b */
static void accumulate_product(words4 r, int64_t a, int64_t b, bool subtract) {
    words2 p, q;
    words4 t;
    words_of(p, a);
    words_of(q, b);
    product(t, p, 2, q, 2);
    accumulate(r, t, 4, subtract);
}

static void minor3_portable(words6 r, const int64_t a[3], const int64_t b[3],
                            const int64_t c[3]) {
    memset(r, 0, sizeof(words6));
    for (int k = 0; k < 3; k++) {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        words2 w;
        words4 minor = {0};
        words6 term;
        accumulate_product(minor, b[u], c[v], false);
        accumulate_product(minor, c[u], b[v], true);
        words_of(w, a[k]);
        product(term, minor, 4, w, 2);
        accumulate(r, term, 6, false);
    }
}

int incode_fixed_compare_norm(const int64_t d[2][3]) {
    words4 difference = {0};
    for (int k = 0; k < 3; k++) {
        accumulate_product(difference, d[0][k], d[0][k], false);
        accumulate_product(difference, d[1][k], d[1][k], true);
    }
    return words_sign(difference, 4);
}

bool incode_fixed_parallel(const int64_t d[2][3]) {
    for (int k = 0; k < 3; k++) {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        words4 minor = {0};
        accumulate_product(minor, d[0][u], d[1][v], false);
        accumulate_product(minor, d[1][u], d[0][v], true);
        if (words_sign(minor, 4) != 0)
            return false;
    }
    return true;
}

int incode_fixed_orient3d_portable(const int64_t d[3][3]) {
    words6 det;
    minor3_portable(det, d[0], d[1], d[2]);
    return words_sign(det, 6);
}

int incode_fixed_in_sphere_portable(const int64_t d[4][3]) {
    static const uint8_t rest[4][3] = {
        {1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    uint32_t det[10] = {0};
    int cofactor[5];
    for (int i = 0; i < 4; i++) {
        words4 lift = {0};
        words6 minor;
        uint32_t term[10];
        for (int k = 0; k < 3; k++)
            accumulate_product(lift, d[i][k], d[i][k], false);
        minor3_portable(minor, d[rest[i][0]], d[rest[i][1]], d[rest[i][2]]);
        cofactor[i] = words_sign(minor, 6);
        product(term, lift, 4, minor, 6);
        accumulate(det, term, 10, false);
    }
    int sign = words_sign(det, 10);
    if (sign != 0)
        return sign;
    cofactor[4] = -1;
    return incode_tie(rank(d), cofactor);
}

/* ---- 64-bit words ---- */

#ifdef __SIZEOF_INT128__

__extension__ typedef __int128 i128;
__extension__ typedef unsigned __int128 u128;

/* lo + 2^64 * hi */
struct i192 {
    uint64_t lo;
    i128 hi;
};

static inline i128 times(int64_t a, int64_t b) {
    return (i128)a * b;
}

static inline i128 times_unsigned(uint64_t a, int64_t b) {
    u128 below = (u128)a << 64;
    return (i128)((u128)a * (uint64_t)b - (b < 0 ? below : 0));
}

static inline struct i192 sum3(i128 m, int64_t p, i128 n, int64_t q, i128 o,
                               int64_t r) {
    /* Below 3 * 2^125 and 3 * 2^121. */
    i128 low = times_unsigned((uint64_t)m, p) + times_unsigned((uint64_t)n, q) +
               times_unsigned((uint64_t)o, r);
    i128 high = times((int64_t)(m >> 64), p) + times((int64_t)(n >> 64), q) +
                times((int64_t)(o >> 64), r);
    struct i192 s = {(uint64_t)low, (low >> 64) + high};
    return s;
}

static inline int sign_of(struct i192 a) {
    return a.hi < 0 ? -1 : a.hi > 0 || a.lo != 0;
}

/* The minor of columns x and y. */
static inline i128 minor2(const int64_t a[3], const int64_t b[3]) {
    return times(a[0], b[1]) - times(b[0], a[1]);
}

int incode_fixed_orient3d(const int64_t d[3][3]) {
    const int64_t *a = d[0], *b = d[1], *c = d[2];
    return sign_of(
        sum3(minor2(a, b), c[2], minor2(c, a), b[2], minor2(b, c), a[2]));
}

/* Columns of 64 bits, each with room for carries. */
struct columns {
    i128 c[5];
};

/* s += |d|^2 m */
static inline void add_lifted(struct columns *s, const int64_t d[3],
                              struct i192 m) {
    u128 lift =
        (u128)(times(d[0], d[0]) + times(d[1], d[1])) + (u128)times(d[2], d[2]);
    uint64_t l0 = (uint64_t)lift, l1 = (uint64_t)(lift >> 64);
    uint64_t m1 = (uint64_t)m.hi;
    int64_t m2 = (int64_t)(m.hi >> 64);
    u128 p00 = (u128)l0 * m.lo, p01 = (u128)l0 * m1;
    u128 p10 = (u128)l1 * m.lo, p11 = (u128)l1 * m1;
    i128 p02 = times_unsigned(l0, m2), p12 = times((int64_t)l1, m2);
    s->c[0] += (uint64_t)p00;
    s->c[1] += (i128)(p00 >> 64) + (uint64_t)p01 + (uint64_t)p10;
    s->c[2] +=
        (i128)(p01 >> 64) + (i128)(p10 >> 64) + (uint64_t)p11 + (uint64_t)p02;
    s->c[3] += (i128)(p11 >> 64) + (p02 >> 64) + (uint64_t)p12;
    s->c[4] += p12 >> 64;
}

static int in_sphere_long(const int64_t d[4][3]) {
    const int64_t *a = d[0], *b = d[1], *c = d[2], *e = d[3];
    i128 ab = minor2(a, b), bc = minor2(b, c), ce = minor2(c, e);
    i128 ca = minor2(c, a), ea = minor2(e, a), eb = minor2(e, b);
    struct i192 m[4] = {sum3(bc, e[2], eb, c[2], ce, b[2]),
                        sum3(ca, e[2], ea, -c[2], ce, -a[2]),
                        sum3(ab, e[2], ea, b[2], eb, -a[2]),
                        sum3(ab, -c[2], ca, -b[2], bc, -a[2])};
    struct columns s = {{0}};
    for (int i = 0; i < 4; i++)
        add_lifted(&s, d[i], m[i]);
    uint64_t any = 0;
    i128 carry = 0;
    for (int i = 0; i < 5; i++) {
        carry += s.c[i];
        any |= (uint64_t)carry;
        carry >>= 64;
    }
    if (any != 0 || carry != 0)
        return carry < 0 ? -1 : 1;
    int cofactor[5] = {sign_of(m[0]), sign_of(m[1]), sign_of(m[2]),
                       sign_of(m[3]), -1};
    return incode_tie(rank(d), cofactor);
}

/* As rank, for |d[i][j]| < 2^31: a point is one number, x the highest digit. */
static uint32_t rank_short(const int64_t d[4][3]) {
    i128 key[5];
    uint32_t above = 0;
    for (int i = 0; i < 4; i++) {
        int64_t low = d[i][1] * 0x100000000 + d[i][2];
        key[i] = (i128)d[i][0] * ((i128)1 << 64) + low;
    }
    key[4] = 0;
    for (int i = 0; i < 5; i++)
        for (int j = i + 1; j < 5; j++)
            above += INCODE_TIE_ABOVE(i, j, key[i] > key[j]);
    return above;
}

/* For |d[i][j]| < 2^31 and |det| < 2^127: minors of two are below 2^63, of
 * three below 2^96, lifts below 2^64; products keep what they have below
 * 2^128, and the sum is right in the end. */
static int in_sphere_short(const int64_t d[4][3]) {
    int64_t ab = d[0][0] * d[1][1] - d[1][0] * d[0][1];
    int64_t bc = d[1][0] * d[2][1] - d[2][0] * d[1][1];
    int64_t ce = d[2][0] * d[3][1] - d[3][0] * d[2][1];
    int64_t ca = d[2][0] * d[0][1] - d[0][0] * d[2][1];
    int64_t ea = d[3][0] * d[0][1] - d[0][0] * d[3][1];
    int64_t eb = d[3][0] * d[1][1] - d[1][0] * d[3][1];
    int64_t az = d[0][2], bz = d[1][2], cz = d[2][2], ez = d[3][2];
    i128 m[4] = {times(bc, ez) + times(eb, cz) + times(ce, bz),
                 times(ca, ez) - times(ea, cz) - times(ce, az),
                 times(ab, ez) + times(ea, bz) - times(eb, az),
                 -times(ab, cz) - times(ca, bz) - times(bc, az)};
    u128 sum = 0;
    for (int i = 0; i < 4; i++)
        sum += (u128)m[i] *
               ((uint64_t)(d[i][0] * d[i][0]) + (uint64_t)(d[i][1] * d[i][1]) +
                (uint64_t)(d[i][2] * d[i][2]));
    i128 det = (i128)sum;
    if (det != 0)
        return det < 0 ? -1 : 1;
    int cofactor[5];
    for (int i = 0; i < 4; i++)
        cofactor[i] = (m[i] > 0) - (m[i] < 0);
    cofactor[4] = -1;
    return incode_tie(rank_short(d), cofactor);
}

int incode_fixed_in_sphere(const int64_t d[4][3], bool near_zero) {
    uint64_t ones = 0, bits = 0;
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 3; k++) {
            ones |= (uint64_t)d[i][k];
            bits |= (uint64_t)(d[i][k] < 0 ? -d[i][k] : d[i][k]);
        }
    }
    int zeros = ones == 0 ? 0 : __builtin_ctzll(ones);
    /* 4 * 6 * 3 * 2^(5 * 24) < 2^127, and 2^(5 * 31 - 41) is. */
    if (bits >> zeros >> (near_zero ? 31 : 24) != 0)
        return in_sphere_long(d);
    int64_t n[4][3];
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++)
            n[i][k] = d[i][k] >> zeros;
    return in_sphere_short((const int64_t(*)[3])n);
}

#else

int incode_fixed_orient3d(const int64_t d[3][3]) {
    return incode_fixed_orient3d_portable(d);
}

int incode_fixed_in_sphere(const int64_t d[4][3], bool near_zero) {
    (void)near_zero;
    return incode_fixed_in_sphere_portable(d);
}

#endif
