#include "exact.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "check.h"
#include "double_double.h"
#include "scale.h"

enum {
    POINTS_MAX = 5,
    FACTORS_MAX = 3, /* of a monomial that is added as it is */
    LIFTED_MAX = 5,  /* of one that is a square, too */
    /* A double is an integer below 2^53 times 2^e, -1074 <= e <= 971. */
    EXPONENT_LEAST = -1074,
    EXPONENT_SPAN = 971 + 1074 + 53,
    /* Fewer than 2^10 monomials; one limb for the sign. */
    LIMBS_MAX = (FACTORS_MAX * EXPONENT_SPAN + 10) / 32 + 2,
    LIFTED_LIMBS_MAX = (LIFTED_MAX * EXPONENT_SPAN + 10) / 32 + 2,
    TERM_LIMBS = 2 * FACTORS_MAX + 1
};

/* sign * m * 2^e, m of `limbs` limbs of 32 bits, the top one not zero; sign 0
 * for zero.  e >= 0 is counted from the least exponent present. */
struct term {
    uint32_t m[TERM_LIMBS];
    int32_t limbs;
    int32_t e;
    int32_t sign;
};

struct problem {
    struct term p[POINTS_MAX][3];
    int32_t span;            /* of the coordinates' bits, from the least on */
    int32_t limbs;           /* in use */
    int64_t limb[LIMBS_MAX]; /* of 32 bits, with carries not yet passed on */
};

static void term_of(struct term *t, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint64_t m = bits & 0xfffffffffffffu;
    int32_t e = (int32_t)(bits >> 52 & 0x7ff);
    INCODE_ASSERT(e != 0x7ff);
    if (e != 0)
        m |= 0x10000000000000u;
    else
        e = 1;
    if (m == 0) {
        t->sign = 0;
        return;
    }
    /* Trailing zeros go to the exponent: data of few bits stay short. */
    int32_t zeros = __builtin_ctzll(m);
    m >>= zeros;
    t->m[0] = (uint32_t)m;
    t->m[1] = (uint32_t)(m >> 32);
    t->limbs = t->m[1] != 0 ? 2 : 1;
    t->e = e - 1 + zeros + EXPONENT_LEAST;
    t->sign = (bits >> 63) != 0 ? -1 : 1;
}

/* Of a coordinate. */
static int32_t bits_of(const struct term *t) {
    return 32 * t->limbs - __builtin_clz(t->m[t->limbs - 1]);
}

/* The determinants depend on differences alone: where all those from the last
 * point are doubles, they take the points' place and that point becomes 0,
 * which leaves a fifth of the monomials.  False where they are not. */
static bool translate(double q[POINTS_MAX][3], const double *const p[],
                      int32_t points) {
    const double *origin = p[points - 1];
    for (int32_t i = 0; i < points; i++) {
        for (int32_t k = 0; k < 3; k++) {
            /* Knuth's two-sum; after an overflow its error is no number. */
            double a = p[i][k], x = a - origin[k], bv = a - x, av = x + bv;
            if ((a - av) + (bv - origin[k]) != 0)
                return false;
            q[i][k] = x;
        }
    }
    return true;
}

/* Limbs that hold a sum of products of `degree` coordinates. */
static int32_t limbs_of(const struct problem *s, int32_t degree) {
    return (degree * s->span + 10) / 32 + 2;
}

static void problem_clear(struct problem *s, int32_t degree) {
    s->limbs = limbs_of(s, degree);
    INCODE_ASSERT(s->limbs <= LIMBS_MAX);
    memset(s->limb, 0, (size_t)s->limbs * sizeof s->limb[0]);
}

/* Reads the points and clears an accumulator for sums of products of `degree`
 * coordinates. */
static void problem_init(struct problem *s, const double *const p[],
                         int32_t points, int32_t degree) {
    double moved[POINTS_MAX][3];
    bool translated = translate(moved, p, points);
    int32_t least = INT32_MAX, most = INT32_MIN;
    for (int32_t i = 0; i < points; i++) {
        for (int32_t k = 0; k < 3; k++) {
            struct term *t = &s->p[i][k];
            term_of(t, translated ? moved[i][k] : p[i][k]);
            if (t->sign == 0)
                continue;
            int32_t end = t->e + bits_of(t);
            least = t->e < least ? t->e : least;
            most = end > most ? end : most;
        }
    }
    s->span = most > least ? most - least : 0;
    problem_clear(s, degree);
    for (int32_t i = 0; i < points; i++)
        for (int32_t k = 0; k < 3; k++)
            s->p[i][k].e -= s->p[i][k].sign != 0 ? least : 0;
}

/* r = a * b, neither of which is zero. */
static void term_product(struct term *r, const struct term *a,
                         const struct term *b) {
    INCODE_ASSERT(a->limbs > 0 && b->limbs > 0);
    INCODE_ASSERT(a->limbs + b->limbs <= TERM_LIMBS);
    for (int32_t j = 0; j < b->limbs; j++) {
        uint64_t carry = 0;
        for (int32_t i = 0; i < a->limbs; i++) {
            carry += (uint64_t)a->m[i] * b->m[j] + (j != 0 ? r->m[i + j] : 0);
            r->m[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        r->m[a->limbs + j] = (uint32_t)carry;
    }
    r->limbs = a->limbs + b->limbs;
    r->limbs -= r->m[r->limbs - 1] == 0;
    r->e = a->e + b->e;
    r->sign = a->sign * b->sign;
}

/* s += factor * t, factor being 1, -1, 2 or -2. */
static void problem_add(struct problem *s, const struct term *t,
                        int32_t factor) {
    int32_t e = t->e + (factor == 2 || factor == -2);
    int32_t at = e / 32, shift = e % 32;
    INCODE_ASSERT(at + t->limbs < s->limbs);
    int64_t flip = (t->sign < 0) != (factor < 0) ? -1 : 0;
    uint64_t carry = 0;
    for (int32_t i = 0; i < t->limbs; i++) {
        carry |= (uint64_t)t->m[i] << shift;
        s->limb[at + i] += ((int64_t)(carry & 0xffffffffu) ^ flip) - flip;
        carry >>= 32;
    }
    s->limb[at + t->limbs] += ((int64_t)carry ^ flip) - flip;
}

static int problem_sign(const struct problem *s) {
    int64_t carry = 0;
    uint32_t any = 0;
    for (int32_t i = 0; i < s->limbs; i++) {
        carry += s->limb[i];
        any |= (uint32_t)carry;
        carry >>= 32; /* rounds down: a negative sum ends in -1 */
    }
    return carry < 0 ? -1 : any != 0 || carry > 0;
}

/* s += sign * x * (z - w), x being a product of two coordinates. */
static void add_triples(struct problem *s, const struct term *x,
                        const struct term *z, const struct term *w,
                        int32_t sign) {
    struct term t;
    if (z->sign != 0) {
        term_product(&t, x, z);
        problem_add(s, &t, sign);
    }
    if (w->sign != 0) {
        term_product(&t, x, w);
        problem_add(s, &t, -sign);
    }
}

/* s = the determinant with rows p_i - p_h of four points h, i, j, k, which is
 * that with rows (1, p): by pairs of rows, x_a y_b - x_b y_a times z_c - z_d.
 */
static void set_orient3d(struct problem *s, const uint8_t row[4]) {
    /* Each pair, then the other two, all in their order, and the sign. */
    static const int8_t PAIR[6][5] = {{0, 1, 2, 3, -1}, {0, 2, 1, 3, 1},
                                      {0, 3, 1, 2, -1}, {1, 2, 0, 3, -1},
                                      {1, 3, 0, 2, 1},  {2, 3, 0, 1, -1}};
    problem_clear(s, 3);
    for (int32_t n = 0; n < 6; n++) {
        const int8_t *pair = PAIR[n];
        const struct term *a = s->p[row[pair[0]]], *b = s->p[row[pair[1]]];
        const struct term *z = &s->p[row[pair[2]]][2];
        const struct term *w = &s->p[row[pair[3]]][2];
        struct term xy;
        if (a[0].sign != 0 && b[1].sign != 0) {
            term_product(&xy, &a[0], &b[1]);
            add_triples(s, &xy, z, w, pair[4]);
        }
        if (b[0].sign != 0 && a[1].sign != 0) {
            term_product(&xy, &b[0], &a[1]);
            add_triples(s, &xy, z, w, -pair[4]);
        }
    }
}

int incode_exact_orient3d(const double *const p[4]) {
    struct problem s;
    static const uint8_t ALL[4] = {0, 1, 2, 3};
    problem_init(&s, p, 4, 3);
    set_orient3d(&s, ALL);
    return problem_sign(&s);
}

/* A sum without its sign, in limbs of 32 bits, of which [first, last) are not
 * all zero. */
struct settled {
    uint32_t limb[LIMBS_MAX];
    int32_t first, last;
    int sign;
};

/* Passes on all carries. */
static void settle(struct settled *to, const struct problem *s) {
    int64_t carry = 0;
    int32_t last = s->limbs, first = 0;
    for (int32_t i = 0; i < last; i++) {
        carry += s->limb[i];
        to->limb[i] = (uint32_t)carry;
        carry >>= 32; /* rounds down: a negative sum ends in -1 */
    }
    while (first < last && to->limb[first] == 0)
        first++;
    if (carry < 0) /* the complement, and 1 more */
        for (int32_t i = first; i < last; i++)
            to->limb[i] = ~to->limb[i] + (i == first);
    while (last > first && to->limb[last - 1] == 0)
        last--;
    to->first = first;
    to->last = last;
    to->sign = carry < 0 ? -1 : last > first;
}

enum {
    TOP = 8,   /* limbs of an orient3d: the others seldom matter */
    UNITS = 40 /* of yield.h, an orient3d or its product with a square */
};

/* Sums of positive terms and of negative ones. */
struct sums {
    uint32_t limb[2][LIFTED_LIMBS_MAX];
    int32_t limbs; /* in use */
    int32_t doubt; /* what has been left out is below 2^doubt; 0: nothing */
};

/* sum += factor * limb[0..count). */
static void add_times(uint32_t *sum, const uint32_t *limb, int32_t count,
                      uint32_t factor) {
    uint64_t carry = 0;
    for (; count >= 4; count -= 4, sum += 4, limb += 4) {
        for (int32_t i = 0; i < 4; i++) {
            carry += (uint64_t)limb[i] * factor;
            carry += sum[i];
            sum[i] = (uint32_t)carry;
            carry >>= 32;
        }
    }
    for (; count > 0; count--) {
        carry += (uint64_t)*limb++ * factor;
        carry += *sum;
        *sum++ = (uint32_t)carry;
        carry >>= 32;
    }
    for (; carry != 0; sum++) {
        carry += *sum;
        *sum = (uint32_t)carry;
        carry >>= 32;
    }
}

/* sums += sign * |p|^2 * (limbs [first, last) of d), square by square. */
static void add_lifted(struct sums *sums, struct incode_yield *yield,
                       const struct settled *d, const struct term p[3],
                       int32_t first, int32_t last, int sign) {
    uint32_t *sum = sums->limb[sign < 0];
    for (int32_t k = 0; k < 3; k++) {
        struct term square;
        uint64_t carry = 0;
        if (p[k].sign == 0)
            continue;
        incode_yield_after(yield, UNITS);
        term_product(&square, &p[k], &p[k]);
        int32_t at = first + square.e / 32, shift = square.e % 32;
        for (int32_t i = 0; i <= square.limbs; i++) {
            carry |= i < square.limbs ? (uint64_t)square.m[i] << shift : 0;
            if ((uint32_t)carry != 0) {
                INCODE_ASSERT(at + i + last - first <= sums->limbs);
                add_times(sum + at + i, d->limb + first, last - first,
                          (uint32_t)carry);
            }
            carry >>= 32;
        }
        int32_t end = 32 * first + square.e + bits_of(&square) + 4;
        if (first > d->first && end > sums->doubt)
            sums->doubt = end;
    }
}

/* The sign of the difference, or 0 if it is below 2^bits. */
static int compare(const struct sums *sums, int32_t bits) {
    int32_t i = sums->limbs - 1;
    while (i >= 0 && sums->limb[0][i] == sums->limb[1][i])
        i--;
    if (i < 0)
        return 0;
    int sign = sums->limb[0][i] > sums->limb[1][i] ? 1 : -1;
    const uint32_t *more = sums->limb[sign < 0], *less = sums->limb[sign > 0];
    /* The difference is at least 2^(32 i) less what is borrowed from there. */
    uint64_t rest = more[i] - less[i];
    while (rest < 2 && --i >= 0)
        rest = (rest << 32) + more[i] - less[i];
    return i < 0 ? (bits <= 0 ? sign : 0) : 32 * i >= bits ? sign : 0;
}

/* The sums of the top limbs of each orient3d, or of the others. */
static void add_all(struct sums *sums, struct problem *s,
                    struct incode_yield *yield, bool top) {
    /* -det with rows (x, y, z, |p|^2, 1), by its fourth column: the orient3d of
     * the four other points, times -(-1)^i |p_i|^2. */
    for (int32_t i = 0; i < 5; i++) {
        const struct term *q = s->p[i];
        struct settled d;
        uint8_t rest[4];
        int32_t n = 0;
        if (q[0].sign == 0 && q[1].sign == 0 && q[2].sign == 0)
            continue;
        for (uint8_t k = 0; k < 5; k++)
            if (k != i)
                rest[n++] = k;
        incode_yield_after(yield, UNITS);
        set_orient3d(s, rest);
        settle(&d, s);
        int32_t middle = d.last - TOP > d.first ? d.last - TOP : d.first;
        int sign = i % 2 == 0 ? -d.sign : d.sign;
        if (sign != 0 && (top || middle > d.first))
            add_lifted(sums, yield, &d, q, top ? middle : d.first,
                       top ? d.last : middle, sign);
    }
}

int incode_exact_in_sphere(const double *const p[5],
                           struct incode_yield *yield) {
    struct problem s;
    struct sums sums;
    problem_init(&s, p, 5, 3);
    sums.limbs = limbs_of(&s, 5);
    sums.doubt = 0;
    INCODE_ASSERT(sums.limbs <= LIFTED_LIMBS_MAX);
    for (int32_t i = 0; i < 2; i++)
        memset(sums.limb[i], 0, (size_t)sums.limbs * sizeof sums.limb[0][0]);
    add_all(&sums, &s, yield, true);
    int sign = compare(&sums, sums.doubt);
    if (sign != 0 || sums.doubt == 0)
        return sign;
    add_all(&sums, &s, yield, false);
    return compare(&sums, 0);
}

/* s += factor * x * y, factor being 1, -1, 2 or -2. */
static void add_product(struct problem *s, int32_t factor, const struct term *x,
                        const struct term *y) {
    if (x->sign == 0 || y->sign == 0)
        return;
    struct term xy;
    term_product(&xy, x, y);
    problem_add(s, &xy, factor);
}

int incode_exact_compare_distance(const double *const p[3]) {
    struct problem s;
    problem_init(&s, p, 3, 2);
    /* |a|^2 - |b|^2 - 2 p.a + 2 p.b */
    for (int32_t k = 0; k < 3; k++) {
        add_product(&s, 1, &s.p[1][k], &s.p[1][k]);
        add_product(&s, -1, &s.p[2][k], &s.p[2][k]);
        add_product(&s, -2, &s.p[0][k], &s.p[1][k]);
        add_product(&s, 2, &s.p[0][k], &s.p[2][k]);
    }
    return problem_sign(&s);
}

bool incode_exact_collinear(const double *const p[3]) {
    struct problem s;
    for (int32_t k = 0; k < 3; k++) {
        int32_t u = (k + 1) % 3, v = (k + 2) % 3;
        problem_init(&s, p, 3, 2);
        /* det with rows (u_i, v_i, 1) */
        for (int32_t i = 0; i < 3; i++) {
            int32_t j = (i + 1) % 3;
            add_product(&s, 1, &s.p[i][u], &s.p[j][v]);
            add_product(&s, -1, &s.p[j][u], &s.p[i][v]);
        }
        if (problem_sign(&s) != 0)
            return false;
    }
    return true;
}

/* --- pair ----------------------------------------------------------------- */

/* Bounds of the error, in units of the products of the largest entries: 210
 * (orient3d) and 6,100 (in_sphere) times 2^-106 by those of double_double.h,
 * rounded up.  What underflows is below the other term,
 * since every factor is below 2^61. */
#define ORIENT3D_BOUND 0x1p-96
#define IN_SPHERE_BOUND 0x1p-92
#define UNDERFLOW_BOUND 0x1p-600

static bool decide(struct incode_dd det, double bound, int *sign) {
    *sign = det.hi > 0 ? 1 : -1;
    return __builtin_fabs(det.hi) > bound + UNDERFLOW_BOUND;
}

/* d = (p[i] - origin) * 2^k; m = the largest of each column, plus a little. */
static bool differences(struct incode_dd d[][3], double m[3],
                        const double *const p[], int count,
                        const double *origin, double most) {
    struct incode_scale s;
    if (!incode_scale_init(&s, most))
        return false;
    for (int k = 0; k < 3; k++) {
        m[k] = 0;
        for (int i = 0; i < count; i++) {
            double e, x = incode_two_sum(p[i][k], -origin[k], &e);
            x = x * s.up1 * s.up2;
            d[i][k].hi = x;
            d[i][k].lo = e * s.up1 * s.up2;
            x = __builtin_fabs(x) * 0x1.0000000000002p0;
            m[k] = x > m[k] ? x : m[k];
        }
    }
    return true;
}

static struct incode_dd minor3(const struct incode_dd a[3],
                               const struct incode_dd b[3],
                               const struct incode_dd c[3]) {
    struct incode_dd bc =
        incode_dd_times(incode_dd_cross(b[0], c[1], c[0], b[1]), a[2]);
    struct incode_dd ca =
        incode_dd_times(incode_dd_cross(c[0], a[1], a[0], c[1]), b[2]);
    struct incode_dd ab =
        incode_dd_times(incode_dd_cross(a[0], b[1], b[0], a[1]), c[2]);
    return incode_dd_plus(incode_dd_plus(bc, ca), ab);
}

bool incode_pair_orient3d(const double *const p[4], double most, int *sign) {
    struct incode_dd d[3][3];
    double m[3];
    if (!differences(d, m, p + 1, 3, p[0], most))
        return false;
    return decide(minor3(d[0], d[1], d[2]), ORIENT3D_BOUND * m[0] * m[1] * m[2],
                  sign);
}

bool incode_pair_in_sphere(const double *const p[5], double most, int *sign) {
    struct incode_dd d[4][3];
    double m[3];
    if (!differences(d, m, p, 4, p[4], most))
        return false;
    struct incode_dd a =
        incode_dd_times(incode_dd_dot(d[0], d[0]), minor3(d[1], d[2], d[3]));
    struct incode_dd b =
        incode_dd_times(incode_dd_dot(d[1], d[1]), minor3(d[0], d[2], d[3]));
    struct incode_dd c =
        incode_dd_times(incode_dd_dot(d[2], d[2]), minor3(d[0], d[1], d[3]));
    struct incode_dd e =
        incode_dd_times(incode_dd_dot(d[3], d[3]), minor3(d[0], d[1], d[2]));
    double w = m[0] > m[1] ? m[0] : m[1];
    w = m[2] > w ? m[2] : w;
    return decide(incode_dd_plus(incode_dd_minus(a, b), incode_dd_minus(c, e)),
                  IN_SPHERE_BOUND * m[0] * m[1] * m[2] * (w * w), sign);
}

/* --- scaled --------------------------------------------------------------- */

/* Roundings, in units of 2^-53 of the sum of the sizes of all terms: at most 8
 * (orient3d) and 17 (in_sphere) of them lead to a term's share of the sum
 * (Shewchuk, Discrete and Computational Geometry 18:305-363, 1997).  The sum of
 * sizes is rounded as often, which half as much again covers. */
#define SCALED_ORIENT3D_BOUND (12 * 0x1p-53)
#define SCALED_IN_SPHERE_BOUND (24 * 0x1p-53)
/* What underflows is below 2^-1022 a time, and no factor exceeds 16. */
#define SCALED_LOST 0x1p-1000

/* The exponent e of a number, 2^e <= |a| < 2^(e + 1); at least -1023, for 0 and
 * denormals. */
static int32_t exponent_of(double a) {
    uint64_t bits;
    memcpy(&bits, &a, sizeof bits);
    return (int32_t)(bits >> 52 & 0x7ff) - 1023;
}

/* a * 2^e, |e| <= 3069, where it does not overflow. */
static double shifted(double a, int32_t e) {
    int32_t third = e / 3;
    double by = incode_power_of_two(third);
    return a * by * by * incode_power_of_two(e - 2 * third);
}

/* Differences from a point, each axis divided by a power of two, so that its
 * largest is about 1, and then each row.  The sign of a determinant stays. */
struct scaled_rows {
    double d[4][3];
    double square[4]; /* of the row's length, likewise */
};

static void set_squares(struct scaled_rows *s, double x[][3],
                        const int32_t row[4]) {
    int32_t e[4], most = INT32_MIN;
    for (int i = 0; i < 4; i++) {
        int32_t size = -1023;
        s->square[i] = 0;
        for (int k = 0; k < 3; k++)
            size = exponent_of(x[i][k]) > size ? exponent_of(x[i][k]) : size;
        for (int k = 0; k < 3; k++) {
            double u = shifted(x[i][k], -size);
            s->square[i] += u * u;
        }
        e[i] = 2 * size - row[i];
        most = e[i] > most ? e[i] : most;
    }
    for (int i = 0; i < 4; i++)
        s->square[i] =
            e[i] - most < -1022 ? 0 : shifted(s->square[i], e[i] - most);
}

static void set_rows(struct scaled_rows *s, const double *const p[], int count,
                     const double *origin) {
    double x[4][3];
    int32_t column[3] = {-1023, -1023, -1023}, row[4];
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < 3; k++) {
            x[i][k] = p[i][k] - origin[k];
            int32_t e = exponent_of(x[i][k]);
            column[k] = e > column[k] ? e : column[k];
        }
    }
    for (int i = 0; i < count; i++) {
        row[i] = INT32_MIN;
        for (int k = 0; k < 3; k++) {
            int32_t e = exponent_of(x[i][k]) - column[k];
            row[i] = e > row[i] ? e : row[i];
        }
        for (int k = 0; k < 3; k++)
            s->d[i][k] = shifted(x[i][k], -column[k] - row[i]);
    }
    if (count == 4)
        set_squares(s, x, row);
}

/* A determinant, and the sum of its terms' sizes. */
struct sized {
    double value, size;
};

static struct sized sized_minor3(const double a[3], const double b[3],
                                 const double c[3]) {
    struct sized m = {0, 0};
    for (int k = 0; k < 3; k++) {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        double p = b[u] * c[v], q = c[u] * b[v];
        m.value += (p - q) * a[k];
        m.size +=
            (__builtin_fabs(p) + __builtin_fabs(q)) * __builtin_fabs(a[k]);
    }
    return m;
}

static bool decide_sized(struct sized m, double bound, int *sign) {
    *sign = m.value > 0 ? 1 : -1;
    return __builtin_fabs(m.value) > bound * m.size + SCALED_LOST;
}

/* No difference of two of the points overflows, where those from one of them
 * are at most `most`. */
static bool is_in_range(double most) {
    return most < 0x1p1021;
}

/* Takes each point in turn for the origin, from the last on: what differences
 * from one lose, those from another may keep. */
bool incode_scaled_orient3d(const double *const p[4], double most, int *sign) {
    struct scaled_rows s;
    for (int i = 3; i >= 0 && is_in_range(most); i--) {
        const double *q[3] = {p[i == 0 ? 3 : 0], p[i == 1 ? 3 : 1],
                              p[i == 2 ? 3 : 2]};
        set_rows(&s, q, 3, p[i]);
        if (decide_sized(sized_minor3(s.d[0], s.d[1], s.d[2]),
                         SCALED_ORIENT3D_BOUND, sign)) {
            *sign = i == 3 ? -*sign : *sign;
            return true;
        }
    }
    return false;
}

static struct sized sized_in_sphere(const struct scaled_rows *s) {
    static const uint8_t REST[4][3] = {
        {1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    struct sized sum = {0, 0};
    for (int i = 0; i < 4; i++) {
        struct sized m =
            sized_minor3(s->d[REST[i][0]], s->d[REST[i][1]], s->d[REST[i][2]]);
        sum.value += s->square[i] * m.value;
        sum.size += s->square[i] * m.size;
    }
    return sum;
}

bool incode_scaled_in_sphere(const double *const p[5], double most, int *sign) {
    struct scaled_rows s;
    for (int i = 4; i >= 0 && is_in_range(most); i--) {
        const double *q[4] = {p[i == 0 ? 4 : 0], p[i == 1 ? 4 : 1],
                              p[i == 2 ? 4 : 2], p[i == 3 ? 4 : 3]};
        set_rows(&s, q, 4, p[i]);
        if (decide_sized(sized_in_sphere(&s), SCALED_IN_SPHERE_BOUND, sign)) {
            *sign = i == 4 ? *sign : -*sign;
            return true;
        }
    }
    return false;
}
