/* Multiplication by a power of two that brings numbers near 2^60, whatever
 * their exponents: exact, but for what falls below the least double on the way
 * down. */
#ifndef INCODE_SCALE_H
#define INCODE_SCALE_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* Two factors each way, since their product may leave the range of doubles:
 * the second is 1 where it does not.  plain: up1 alone scales, and exactly. */
struct incode_scale {
    double up1, up2, down1, down2;
    bool plain;
};

static inline double incode_power_of_two(int32_t e) {
    uint64_t bits = (uint64_t)(e + 1023) << 52;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Scales what is at most `most` >= 0 to less than 2^60.  False near overflow:
 * from 2^1022 on. */
static inline bool incode_scale_init(struct incode_scale *s, double most) {
    uint64_t bits;
    memcpy(&bits, &most, sizeof bits);
    int32_t e = (int32_t)(bits >> 52);
    if (e > 2044)
        return false;
    /* most < 2^(e-1022); denormals (e = 0) are below 2^-1022. */
    int32_t k = 1082 - (e == 0 ? 1 : e), half = k > 1022 ? k / 2 : k;
    s->plain = k >= 0 && k == half;
    s->up1 = incode_power_of_two(half);
    s->up2 = incode_power_of_two(k - half);
    s->down1 = incode_power_of_two(-half);
    s->down2 = incode_power_of_two(half - k);
    return true;
}

#endif
