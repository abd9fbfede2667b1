#include "predicates.h"

#include <float.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __FAST_MATH__
#error "-ffast-math changes what is exact here; compile without it"
#endif

/* Every operand is volatile, so that the machine computes and not the
 * compiler; every test is one that a single fault of its kind fails. */

/* 1 + 2^-53 is halfway and rounds to the even neighbour, 1; 1 + 2^-52 + 2^-53
 * rounds up; the same below zero. */
static bool rounds_to_even(void) {
    volatile double one = 1, odd = 0x1.0000000000001p0, half = 0x1p-53;
    volatile double a = one + half, b = odd + half;
    volatile double c = -one - half, d = -odd - half;
    return a == 1 && b == 0x1.0000000000002p0 && c == -1 &&
           d == -0x1.0000000000002p0;
}

/* The square, 1 + 2^-26 + 2^-54 (as 0x1.0000002p0 is 1 + 2^-27), rounds to 1 +
 * 2^-26; fused, the sums below keep the 2^-54. */
static bool fuses(void) {
    volatile double x = 0x1.0000002p0, y = -0x1.0000004p0, z = 0x1.0000004p0;
    volatile double one = 1;
    volatile double a = x * x + y, b = y + x * x, c = x * x - z, d = z - x * x;
    volatile double e = x * x - one * z, f = one * z - x * x;
    return a != 0 || b != 0 || c != 0 || d != 0 || e != 0 || f != 0;
}

/* A sum that is not stored first must be rounded all the same: 2^53 + 1 is
 * 2^53, 1 + 2^-52 + 2^-54 is 1 + 2^-52; the largest double squared must
 * overflow. */
static bool keeps_excess(void) {
    volatile double big = 0x1p53, one = 1, odd = 0x1.0000000000001p0;
    volatile double tiny = 0x1p-54, most = DBL_MAX;
    volatile double a = (big + one) - big, b = (odd + tiny) - odd;
    volatile double c = (most * most) / most;
    return a != 0 || b != 0 || c <= DBL_MAX;
}

static bool flushes(void) {
    volatile double least = DBL_MIN, half = 0.5, denormal = 0x1p-1074;
    volatile double a = least * half, b = denormal + denormal;
    volatile double c = least - denormal, d = denormal * 0x1p1000;
    return a + a != least || !(a > 0) || b != 0x1p-1073 || !(c < least) ||
           c + denormal != least || d != 0x1p-74;
}

static bool little_endian(void) {
    volatile double value = 0x1.23456789abcdep-3;
    volatile uint32_t word = 0x01020304;
    double copy = value;
    uint32_t word_copy = word;
    uint64_t bits;
    uint8_t bytes[4];
    memcpy(&bits, &copy, sizeof bits);
    memcpy(bytes, &word_copy, sizeof bytes);
    return bits == 0x3fc23456789abcdeu && bytes[0] == 4 && bytes[1] == 3 &&
           bytes[2] == 2 && bytes[3] == 1;
}

const char *incode_arithmetic_fault(void) {
    if (!little_endian())
        return "words are not little-endian; use a little-endian machine";
    if (!rounds_to_even())
        return "doubles are not rounded to nearest even; set that mode";
    if (keeps_excess())
        return "doubles keep excess precision; compile with -mfpmath=sse";
    if (fuses())
        return "products are fused into sums; compile with -ffp-contract=off";
    if (flushes())
        return "denormals are flushed to zero; clear FTZ and DAZ";
    return NULL;
}
