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

/* A coordinate: sign * (m[0] + 2^32 m[1]) * 2^e, e >= 0 counted from the least
 * exponent present; sign 0 for zero. */
struct part {
    uint32_t m[2];
    int32_t e;
    int32_t sign;
};

struct problem {
    struct part p[POINTS_MAX][3];
    int32_t limbs;           /* in use */
    int64_t limb[LIMBS_MAX]; /* of 32 bits, with carries not yet passed on */
};

/* A monomial under way, of `limbs` limbs. */
struct term {
    uint32_t limb[TERM_LIMBS];
    int32_t limbs;
    int32_t e;
    int32_t sign;
};

static struct part part_of(double value)
{
    struct part part = {{0, 0}, 0, 0};
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint64_t m = bits & 0xfffffffffffffu;
    int32_t e = (int32_t)(bits >> 52 & 0x7ff);
    INCODE_ASSERT(e != 0x7ff);
    if (e != 0)
        m |= 0x10000000000000u;
    else
        e = 1;
    if (m == 0)
        return part;
    /* Trailing zeros go to the exponent: data of few bits stay short. */
    int32_t zeros = __builtin_ctzll(m);
    m >>= zeros;
    part.m[0] = (uint32_t)m;
    part.m[1] = (uint32_t)(m >> 32);
    part.e = e - 1 + zeros + EXPONENT_LEAST;
    part.sign = (bits >> 63) != 0 ? -1 : 1;
    return part;
}

/* Reads the points and clears an accumulator for sums of products of `degree`
 * coordinates. */
static void problem_init(struct problem *s, const double *const p[],
                         int32_t points, int32_t degree)
{
    int32_t least = 0, most = 0;
    bool any = false;
    for (int32_t i = 0; i < points; i++) {
        for (int32_t k = 0; k < 3; k++) {
            struct part part = part_of(p[i][k]);
            s->p[i][k] = part;
            if (part.sign == 0)
                continue;
            if (!any || part.e < least)
                least = part.e;
            if (!any || part.e > most)
                most = part.e;
            any = true;
        }
    }
    for (int32_t i = 0; i < points; i++) {
        for (int32_t k = 0; k < 3; k++)
            s->p[i][k].e -= s->p[i][k].sign != 0 ? least : 0;
    }
    s->limbs = (degree * (most - least + 53) + 10) / 32 + 2;
    INCODE_ASSERT(s->limbs <= LIMBS_MAX);
    memset(s->limb, 0, (size_t)s->limbs * sizeof s->limb[0]);
}

static struct term term_one(int32_t sign)
{
    struct term t = {{1}, 1, 0, sign};
    return t;
}

/* t * f; the caller has seen to it that f is not zero. */
static struct term term_times(const struct term *t, const struct part *f)
{
    struct term r;
    int32_t n = t->limbs;
    INCODE_ASSERT(n + 2 <= TERM_LIMBS);
    memset(r.limb, 0, (size_t)(n + 2) * sizeof r.limb[0]);
    for (int32_t j = 0; j < 2; j++) {
        uint64_t carry = 0;
        for (int32_t i = 0; i < n; i++) {
            carry += (uint64_t)t->limb[i] * f->m[j] + r.limb[i + j];
            r.limb[i + j] = (uint32_t)carry;
            carry >>= 32;
        }
        r.limb[n + j] = (uint32_t)carry;
    }
    r.limbs = n + 2;
    while (r.limb[r.limbs - 1] == 0)
        r.limbs--;
    r.e = t->e + f->e;
    r.sign = t->sign * f->sign;
    return r;
}

static void problem_add(struct problem *s, const struct term *t)
{
    int32_t at = t->e / 32, shift = t->e % 32;
    INCODE_ASSERT(at + t->limbs < s->limbs);
    uint64_t carry = 0;
    for (int32_t i = 0; i < t->limbs; i++) {
        carry |= (uint64_t)t->limb[i] << shift;
        int64_t digit = (int64_t)(carry & 0xffffffffu);
        s->limb[at + i] += t->sign < 0 ? -digit : digit;
        carry >>= 32;
    }
    int64_t digit = (int64_t)carry;
    s->limb[at + t->limbs] += t->sign < 0 ? -digit : digit;
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

/* sign * det(i, j, k) of three points, in each monomial; hands the monomials
 * that are not zero to t[0..5] and returns their number. */
static int32_t minor3(const struct problem *s, int32_t i, int32_t j, int32_t k,
                      int32_t sign, struct term t[6])
{
    static const uint8_t order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                        {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    int32_t n = 0;
    for (int32_t o = 0; o < 6; o++) {
        const struct part *x = &s->p[i][order[o][0]];
        const struct part *y = &s->p[j][order[o][1]];
        const struct part *z = &s->p[k][order[o][2]];
        if (x->sign == 0 || y->sign == 0 || z->sign == 0)
            continue;
        struct term one = term_one(o < 3 ? sign : -sign);
        struct term fx = term_times(&one, x);
        struct term fxy = term_times(&fx, y);
        t[n++] = term_times(&fxy, z);
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
        int32_t n = minor3(&s, rows[r][0], rows[r][1], rows[r][2],
                           r % 2 == 0 ? 1 : -1, t);
        for (int32_t m = 0; m < n; m++)
            problem_add(&s, &t[m]);
    }
    return problem_sign(&s);
}

/* Adds sign * t * |p_i|^2. */
static void add_lifted(struct problem *s, const struct term *t, int32_t i,
                       int32_t sign)
{
    for (int32_t k = 0; k < 3; k++) {
        const struct part *f = &s->p[i][k];
        if (f->sign == 0)
            continue;
        struct term once = term_times(t, f);
        struct term twice = term_times(&once, f);
        twice.sign *= sign;
        problem_add(s, &twice);
    }
}

int incode_exact_in_sphere(const double *const p[5])
{
    struct problem s;
    struct term t[6];
    problem_init(&s, p, 5, 5);
    /* -det with rows (x, y, z, |p|^2, 1): for each pair i < j of rows that
     * give the last two columns, (-1)^(i+j) (|p_i|^2 - |p_j|^2) det3. */
    for (int32_t i = 0; i < 5; i++) {
        for (int32_t j = i + 1; j < 5; j++) {
            int32_t rest[3], n = 0;
            for (int32_t k = 0; k < 5; k++) {
                if (k != i && k != j)
                    rest[n++] = k;
            }
            n = minor3(&s, rest[0], rest[1], rest[2], (i + j) % 2 == 0 ? 1 : -1,
                       t);
            for (int32_t m = 0; m < n; m++) {
                add_lifted(&s, &t[m], i, 1);
                add_lifted(&s, &t[m], j, -1);
            }
        }
    }
    return problem_sign(&s);
}

/* Adds factor * x * y, factor being 1, -1, 2 or -2. */
static void add_product(struct problem *s, int32_t factor, const struct part *x,
                        const struct part *y)
{
    if (x->sign == 0 || y->sign == 0)
        return;
    struct term one = term_one(factor < 0 ? -1 : 1);
    if (factor == 2 || factor == -2)
        one.limb[0] = 2;
    struct term fx = term_times(&one, x);
    struct term fxy = term_times(&fx, y);
    problem_add(s, &fxy);
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
