#include "single.h"

#include "incode/predicates/double_double.h"

static void doubles(struct record *r, double a, double b) {
    record_double(r, "a", a);
    record_double(r, "b", b);
    record_double(r, "a + b", a + b);
    record_double(r, "a - b", a - b);
    record_double(r, "a b", a * b);
    record_double(r, "a / b", a / b);
    record_double(r, "the root of a's magnitude",
                  __builtin_sqrt(__builtin_fabs(a)));
}

/* Each of six, with a number that is none too, as the filters may meet. */
static uint64_t compared(double a, double b) {
    return (uint64_t)(a < b) | (uint64_t)(a <= b) << 1 |
           (uint64_t)(a == b) << 2 | (uint64_t)(a >= b) << 3 |
           (uint64_t)(a > b) << 4 | (uint64_t)(a != b) << 5;
}

static void comparisons(struct record *r, double a, double b) {
    double zero = a - a, none = a / zero - a / zero;
    record_word(r, "a compared with b", compared(a, b));
    record_word(r, "a compared with a", compared(a, a));
    record_word(r, "a compared with -a", compared(a, -a));
    record_word(r, "0 compared with -0", compared(zero, -zero));
    record_word(r, "a compared with none", compared(a, none));
    record_word(r, "a / 0 compared with b", compared(a / zero, b));
}

static void floats(struct record *r, double a, double b) {
    float f = record_float(r, "f = a as a float", (float)a);
    float g = record_float(r, "g = b as a float", (float)b);
    record_float(r, "f + g", f + g);
    record_float(r, "f - g", f - g);
    record_float(r, "f g", f * g);
    record_float(r, "f / g", f / g);
    record_double(r, "f as a double", f);
    record_word(r, "f compared with g",
                (uint64_t)(f < g) | (uint64_t)(f == g) << 1 |
                    (uint64_t)(f <= g) << 2);
}

/* Cut towards zero, within the range of the integers. */
static void to_integers(struct draw *draw, struct record *r) {
    double x = record_double(r, "x", draw_between(draw, -4, 61));
    double y = record_double(r, "y", draw_between(draw, -4, 29));
    record_word(r, "x as 64 bits", (uint64_t)(int64_t)x);
    record_word(r, "twice x as 64 bits without sign",
                (uint64_t)(2 * __builtin_fabs(x)));
    record_word(r, "y as 32 bits", (uint32_t)(int32_t)y);
    record_word(r, "twice y as 32 bits without sign",
                (uint32_t)(2 * __builtin_fabs(y)));
    float z = record_float(r, "z = y as a float", (float)y);
    record_word(r, "z as 32 bits", (uint32_t)(int32_t)z);
    record_word(r, "z as 64 bits", (uint64_t)(int64_t)z);
}

static void from_integers(struct draw *draw, struct record *r) {
    uint64_t n = draw_bits(draw) >> draw_below(draw, 64);
    uint32_t m = (uint32_t)draw_bits(draw) >> draw_below(draw, 32);
    int64_t i = (draw_bits(draw) & 1) != 0 ? -(int64_t)(n >> 1) : (int64_t)n;
    int32_t j = (int32_t)m;
    record_word(r, "n", n);
    record_word(r, "m", m);
    record_double(r, "n as a double", (double)n);
    record_double(r, "n with a sign as a double", (double)i);
    record_double(r, "m as a double", m);
    record_double(r, "m with a sign as a double", j);
    record_float(r, "n as a float", (float)n);
    record_float(r, "n with a sign as a float", (float)i);
    record_float(r, "m as a float", (float)m);
    record_float(r, "m with a sign as a float", (float)j);
}

/* Where nothing leaves the range: then a processor that has a fused product and
 * one that splits its factors have the same bits. */
static void without_error(struct draw *draw, struct record *r) {
    double a = record_double(r, "a", draw_between(draw, -200, 200));
    double b = record_double(r, "b", draw_between(draw, -200, 200));
    double c = record_double(r, "c", a * draw_between(draw, -60, 60));
    double error;
    record_double(r, "a b", incode_two_product(a, b, &error));
    record_double(r, "what is left of a b", error);
    record_double(r, "a b by halves", incode_two_product_dekker(a, b, &error));
    record_double(r, "what is left of a b by halves", error);
    record_double(r, "a + c", incode_two_sum(a, c, &error));
    record_double(r, "what is left of a + c", error);
}

void single_case(struct draw *draw, uint32_t number, struct record *r) {
    double p[5][3], a, b;
    switch (number % 4) {
    case 0: /* any at all */
        a = draw_between(draw, -1023, 1023);
        b = draw_between(draw, -1023, 1023);
        break;
    case 1: /* near enough for sums to round, and products to underflow */
        a = draw_between(draw, -60, 60);
        b = draw_between(draw, -60, 60);
        break;
    case 2: /* for floats to be denormal, or to overflow */
        a = draw_between(draw, -150, 130);
        b = draw_between(draw, -30, 30);
        break;
    default: /* hard ones */
        draw_points(draw, (number >> 2) % DRAW_FAMILIES, p);
        a = p[0][0];
        b = p[1][0];
        break;
    }
    doubles(r, a, b);
    comparisons(r, a, b);
    floats(r, a, b);
    to_integers(draw, r);
    from_integers(draw, r);
    without_error(draw, r);
}
