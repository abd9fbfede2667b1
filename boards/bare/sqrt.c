/* The square root of a double, correctly rounded to nearest, for processors
 * that have none: digit by digit, in integers. */
#include <stdint.h>
#include <string.h>

double sqrt(double x);

enum { FRACTION = 52, BIAS = 1023, DIGITS = 54 /* 53, and one to round by */ };

static double from_bits(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* DIGITS digits of the root of m 2^DIGITS, m in [2^52, 2^54), rounded to one
 * less.  The rest is never half a digit: a square has twice the digits. */
static uint64_t root(uint64_t m) {
    uint64_t digits = 0, rest = 0;
    for (int i = 0; i < DIGITS; i++) {
        rest = rest << 2 | (m >> (DIGITS - 2) & 3);
        m = m << 2 & ((UINT64_C(1) << DIGITS) - 1);
        uint64_t trial = digits << 2 | 1;
        digits <<= 1;
        if (rest >= trial) {
            rest -= trial;
            digits |= 1;
        }
    }
    return (digits + 1) >> 1;
}

double sqrt(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int exponent = (int)(bits >> FRACTION & 2047);
    uint64_t m = bits & ((UINT64_C(1) << FRACTION) - 1);
    if (bits << 1 == 0 || (exponent == 2047 && bits >> 63 == 0))
        return x; /* zeros; infinity and a NaN */
    if (bits >> 63 != 0 || exponent == 2047)
        return from_bits(UINT64_C(0x7ff8) << 48);
    if (exponent == 0) { /* subnormal */
        exponent = 1;
        for (; m >> FRACTION == 0; m <<= 1)
            exponent--;
    } else {
        m |= UINT64_C(1) << FRACTION;
    }
    exponent -= BIAS;
    if (exponent % 2 != 0) {
        m <<= 1;
        exponent--;
    }
    return from_bits(((uint64_t)(exponent / 2 + BIAS - 1) << FRACTION) +
                     root(m));
}
