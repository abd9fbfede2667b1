#include "exact.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "check.h"

enum {
    POINTS_MAX = 5,
    FACTORS_MAX = 5,
    /* A double is an integer below 2^53 times 2^e, -1074 <= e <= 971. */
    EXPONENT_LEAST = -1074,
    EXPONENT_SPAN = 971 + 1074 + 53,
    /* 5 factors, and fewer than 2^10 monomials; one limb for the sign. */
    LIMBS_MAX = (FACTORS_MAX * EXPONENT_SPAN + 10) / 32 + 2,
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
    int32_t limbs;           /* in use */
    int64_t limb[LIMBS_MAX]; /* of 32 bits, with carries not yet passed on */
};

static void term_of(struct term *t, double value)
{
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
static int32_t bits_of(const struct term *t)
{
    return 32 * t->limbs - __builtin_clz(t->m[t->limbs - 1]);
}

/* The determinants depend on differences alone: where all those from the last
 * point are doubles, they take the points' place and that point becomes 0,
 * which leaves a fifth of the monomials.  False where they are not. */
static bool translate(double q[POINTS_MAX][3], const double *const p[],
                      int32_t points)
{
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

/* Reads the points and clears an accumulator for sums of products of `degree`
 * coordinates. */
static void problem_init(struct problem *s, const double *const p[],
                         int32_t points, int32_t degree)
{
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
    s->limbs = 2;
    if (most > least)
        s->limbs = (degree * (most - least) + 10) / 32 + 2;
    INCODE_ASSERT(s->limbs <= LIMBS_MAX);
    memset(s->limb, 0, (size_t)s->limbs * sizeof s->limb[0]);
    for (int32_t i = 0; i < points; i++) {
        for (int32_t k = 0; k < 3; k++)
            s->p[i][k].e -= s->p[i][k].sign != 0 ? least : 0;
    }
}

/* r = a * b, neither of which is zero. */
static void term_product(struct term *r, const struct term *a,
                         const struct term *b)
{
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
static void problem_add(struct problem *s, const struct term *t, int32_t factor)
{
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

static int problem_sign(const struct problem *s)
{
    int64_t carry = 0;
    uint32_t any = 0;
    for (int32_t i = 0; i < s->limbs; i++) {
        carry += s->limb[i];
        any |= (uint32_t)carry;
        carry >>= 32; /* rounds down: a negative sum ends in -1 */
    }
    return carry < 0 ? -1 : any != 0 || carry > 0;
}

/* The monomials of det(p_i, p_j, p_k) that are not zero, with their signs;
 * returns their number. */
static int32_t minor3(struct term t[6], const struct problem *s, int32_t i,
                      int32_t j, int32_t k)
{
    static const uint8_t order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                        {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    int32_t n = 0;
    for (int32_t o = 0; o < 6; o++) {
        const struct term *x = &s->p[i][order[o][0]];
        const struct term *y = &s->p[j][order[o][1]];
        const struct term *z = &s->p[k][order[o][2]];
        if (x->sign == 0 || y->sign == 0 || z->sign == 0)
            continue;
        struct term xy;
        term_product(&xy, x, y);
        term_product(&t[n], &xy, z);
        t[n].sign = o < 3 ? t[n].sign : -t[n].sign;
        n++;
    }
    return n;
}

int incode_exact_orient3d(const double *const p[4])
{
    struct problem s;
    struct term t[6];
    problem_init(&s, p, 4, 3);
    /* Determinant with rows (p_i, 1), by its column of ones. */
    static const uint8_t rows[4][3] = {
        {1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
    for (int32_t r = 0; r < 4; r++) {
        int32_t n = minor3(t, &s, rows[r][0], rows[r][1], rows[r][2]);
        for (int32_t m = 0; m < n; m++)
            problem_add(&s, &t[m], r % 2 == 0 ? 1 : -1);
    }
    return problem_sign(&s);
}

/* s += sign * t * |p_i|^2, squares being those of the coordinates of p_i. */
static void add_lifted(struct problem *s, const struct term *t,
                       const struct term squares[3], int32_t sign)
{
    struct term product;
    for (int32_t k = 0; k < 3; k++) {
        if (squares[k].sign == 0)
            continue;
        term_product(&product, t, &squares[k]);
        problem_add(s, &product, sign);
    }
}

int incode_exact_in_sphere(const double *const p[5])
{
    struct problem s;
    struct term squares[5][3], t[6];
    problem_init(&s, p, 5, 5);
    for (int32_t i = 0; i < 5; i++) {
        for (int32_t k = 0; k < 3; k++) {
            squares[i][k].sign = 0;
            if (s.p[i][k].sign != 0)
                term_product(&squares[i][k], &s.p[i][k], &s.p[i][k]);
        }
    }
    /* -det with rows (x, y, z, |p|^2, 1): for each pair i < j of rows that
     * give the last two columns, (-1)^(i+j) (|p_i|^2 - |p_j|^2) det3. */
    for (int32_t i = 0; i < 5; i++) {
        for (int32_t j = i + 1; j < 5; j++) {
            int32_t rest[3], n = 0, sign = (i + j) % 2 == 0 ? 1 : -1;
            for (int32_t k = 0; k < 5; k++) {
                if (k != i && k != j)
                    rest[n++] = k;
            }
            n = minor3(t, &s, rest[0], rest[1], rest[2]);
            for (int32_t m = 0; m < n; m++) {
                add_lifted(&s, &t[m], squares[i], sign);
                add_lifted(&s, &t[m], squares[j], -sign);
            }
        }
    }
    return problem_sign(&s);
}

/* s += factor * x * y, factor being 1, -1, 2 or -2. */
static void add_product(struct problem *s, int32_t factor, const struct term *x,
                        const struct term *y)
{
    if (x->sign == 0 || y->sign == 0)
        return;
    struct term xy;
    term_product(&xy, x, y);
    problem_add(s, &xy, factor);
}

int incode_exact_compare_distance(const double *const p[3])
{
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

bool incode_exact_collinear(const double *const p[3])
{
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
