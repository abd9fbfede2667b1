#include "sound.h"

#include <float.h>
#include <string.h>

/* Numbers outside [lo, hi], NaN included; data need not be aligned to them. */
static bool outside(const uint8_t *data, uint32_t count, double lo, double hi) {
    int bad = 0;
    for (uint32_t i = 0; i < count; i++) {
        double a;
        memcpy(&a, data + i * sizeof a, sizeof a);
        bad |= !(a >= lo) | !(a <= hi);
    }
    return bad != 0;
}

static bool brick_is_sound(const double lo[3], const double hi[3],
                           const uint8_t *data, size_t bytes) {
    uint32_t points = (uint32_t)(bytes / (3 * sizeof *lo));
    bool good = points >= 1 && bytes <= INCODE_BRICK_BYTES &&
                points * 3 * sizeof *lo == bytes;
    for (unsigned d = 0; d < 3 && good; d++)
        good = !outside(data + d * points * sizeof *lo, points, lo[d], hi[d]);
    return good;
}

/* A normal power of two. */
static bool is_power_of_two(double unit) {
    uint64_t bits;
    memcpy(&bits, &unit, sizeof bits);
    return bits << 12 == 0 && bits >> 52 >= 1 && bits >> 52 <= 2046;
}

/* Boxes of children in the box of all, but for being rounded outward; those of
 * none are empty. */
static bool axes_are_sound(const struct incode_boxes *boxes, const double lo[3],
                           const double hi[3], uint32_t children) {
    double unit = boxes->unit, slack = unit * 0x1p-20;
    int bad = !is_power_of_two(unit);
    for (int d = 0; d < 3; d++) {
        double origin = boxes->origin[d];
        bad |= !(origin >= -DBL_MAX) | !(origin <= DBL_MAX);
        for (uint32_t i = 0; i < INCODE_FANOUT; i++) {
            float a = boxes->lo[d][i], b = boxes->hi[d][i];
            double from = origin + unit * (double)a;
            double to = origin + unit * (double)b;
            bad |= i < children
                       ? !(a >= -2) | !(b <= 2) | !(a <= b) |
                             !(from >= lo[d] - slack) | !(to <= hi[d] + slack)
                       : !(a > 2) | !(b < -2);
        }
    }
    return bad == 0;
}

/* Turns are of unit quaternions, half axes finite; where there is no child
 * there is no lifted box. */
static bool lifted_are_sound(const struct incode_boxes *boxes,
                             uint32_t children) {
    int bad = 0;
    for (uint32_t i = 0; i < INCODE_FANOUT; i++) {
        int64_t square = 0;
        for (int d = 0; d < 3; d++) {
            int64_t turn = boxes->turn[d][i];
            square += turn * turn;
            bad |= boxes->half[d][i] >= 0x7c00;
        }
        bad |= square > INT64_C(32767) * 32767;
        bad |= boxes->is_lifted[i] > (i < children);
    }
    return bad == 0;
}

static bool boxes_are_sound(const double lo[3], const double hi[3],
                            const uint8_t *data, uint32_t children) {
    struct incode_boxes boxes;
    memcpy(&boxes, data, sizeof boxes);
    return axes_are_sound(&boxes, lo, hi, children) &&
           lifted_are_sound(&boxes, children);
}

/* Beyond the end of a list stands INCODE_NONE. */
static bool words_are_sound(uint32_t vertices, const uint8_t *data) {
    int bad = 0;
    for (uint32_t i = 0; i < INCODE_PAGE_WORDS; i++) {
        uint32_t word;
        memcpy(&word, data + i * sizeof word, sizeof word);
        bad |= (word > vertices) & (word != INCODE_NONE);
    }
    return bad == 0;
}

bool incode_page_is_sound(const struct incode_tree *tree, const double lo[3],
                          const double hi[3], uint32_t page, const void *data,
                          size_t bytes) {
    uint32_t level = incode_tree_level(tree, page);
    if (level == 0)
        return brick_is_sound(lo, hi, data, bytes);
    if (page >= tree->pages)
        return false;
    if (level == tree->levels)
        return bytes == sizeof(struct incode_words) &&
               words_are_sound(tree->bricks * INCODE_BRICK_POINTS, data);
    uint32_t first = (page - tree->base[level]) * INCODE_FANOUT;
    return bytes == sizeof(struct incode_boxes) &&
           boxes_are_sound(lo, hi, data, tree->count[level - 1] - first);
}
