#include "pages.h"

#include <assert.h>
#include <float.h>
#include <string.h>

#include "incode/predicates/scale.h"

static uint32_t divide_up(uint64_t n, uint32_t by) {
    return (uint32_t)((n + by - 1) / by);
}

void incode_tree_init(struct incode_tree *tree, uint32_t bricks,
                      uint32_t cells) {
    *tree = (struct incode_tree){.bricks = bricks};
    uint32_t level = 0, base = 0, count = bricks;
    while (level < 2 || tree->count[level - 1] > 1) {
        tree->base[level] = base;
        tree->count[level] = count;
        base += count;
        count = divide_up(count, INCODE_FANOUT);
        level++;
    }
    tree->levels = level;
    tree->base[level] = base;
    tree->cells_base = tree->list_base = tree->pages = base;
    if (cells != 0) {
        tree->list_base =
            base + divide_up((uint64_t)cells + 1, INCODE_PAGE_WORDS);
        uint64_t vertices = (uint64_t)bricks * INCODE_BRICK_POINTS;
        tree->pages = tree->list_base + divide_up(vertices, INCODE_PAGE_WORDS);
    }
}

uint32_t incode_tree_level(const struct incode_tree *tree, uint32_t page) {
    uint32_t level = 0;
    while (level < tree->levels && page >= tree->base[level + 1])
        level++;
    return level;
}

uint32_t incode_bricks_cut(uint32_t first, uint32_t count) {
    uint64_t from = first, to = from + count, middle = from + count / 2;
    uint64_t fifth = ((uint64_t)count + 4) / 5;
    for (uint64_t step = (uint64_t)1 << 25; step > 1; step >>= 5) {
        uint64_t cut = (middle + step / 2) / step * step;
        if (cut > from && cut < to && cut - from >= fifth && to - cut >= fifth)
            return (uint32_t)(cut - from);
    }
    return count / 2;
}

/* --- boxes ---------------------------------------------------------------- */

static_assert(sizeof(struct incode_boxes) == 1568, "the layout of a page");

static double larger(double a, double b) {
    return a > b ? a : b;
}

/* ---- along the axes ---- */

void incode_boxes_frame(const double lo[3], const double hi[3],
                        double origin[3], double *unit) {
    double half = 0;
    for (int d = 0; d < 3; d++) {
        half = larger(half, 0.5 * hi[d] - 0.5 * lo[d]);
        origin[d] = 0.5 * lo[d] + 0.5 * hi[d];
    }
    uint64_t bits;
    memcpy(&bits, &half, sizeof bits);
    int32_t e = (int32_t)(bits >> 52) - 1022; /* half < 2^e */
    if (e > 1022) {
        /* Differences could overflow, and need not be made. */
        memset(origin, 0, 3 * sizeof origin[0]);
        e = 1023;
    }
    *unit = incode_power_of_two(e);
}

void incode_boxes_init(struct incode_boxes *boxes, const double lo[3],
                       const double hi[3]) {
    memset(boxes, 0, sizeof *boxes);
    incode_boxes_frame(lo, hi, boxes->origin, &boxes->unit);
    for (int d = 0; d < 3; d++) {
        for (int i = 0; i < INCODE_FANOUT; i++) {
            boxes->lo[d][i] = __builtin_inff();
            boxes->hi[d][i] = -__builtin_inff();
        }
    }
}

/* The next number below one that is normal or not 0. */
static float below(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits += x > 0 ? UINT32_MAX : 1;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* The largest number of single precision, 0 or normal, that does not exceed
 * (p - origin) / unit.  What is lost in the difference is computed, too
 * (Knuth's sum of two), so that the comparison is exact. */
static float rounded_down(double p, double origin, double unit) {
    double sum = p - origin, back = p - sum;
    double lost = (p - (sum + back)) + (back - origin);
    double x = sum * (1 / unit);
    if (x < FLT_MIN && x > -FLT_MIN)
        return sum < 0 ? -FLT_MIN : 0;
    float f = (float)x;
    return (double)f > x || ((double)f == x && lost < 0) ? below(f) : f;
}

void incode_boxes_set(struct incode_boxes *boxes, unsigned child,
                      const double lo[3], const double hi[3]) {
    for (int d = 0; d < 3; d++) {
        double origin = boxes->origin[d], unit = boxes->unit;
        boxes->lo[d][child] = rounded_down(lo[d], origin, unit);
        boxes->hi[d][child] = -rounded_down(-hi[d], -origin, unit);
    }
    boxes->is_lifted[child] = 0;
}

/* What was set is beyond origin + unit x in real arithmetic, and a double, so
 * that rounding, which is monotone, does not pass it; nor does a limit to
 * finite numbers. */
void incode_boxes_axes(const struct incode_boxes *boxes,
                       double lo[3][INCODE_FANOUT],
                       double hi[3][INCODE_FANOUT]) {
    for (int d = 0; d < 3; d++) {
        double origin = boxes->origin[d], unit = boxes->unit;
        for (int i = 0; i < INCODE_FANOUT; i++) {
            double a = origin + unit * (double)boxes->lo[d][i];
            double b = origin + unit * (double)boxes->hi[d][i];
            lo[d][i] = a > -DBL_MAX ? a : -DBL_MAX;
            hi[d][i] = b < DBL_MAX ? b : DBL_MAX;
        }
    }
}

/* ---- lifted ---- */

enum { ONE = 32767 };

void incode_boxes_turned(const struct incode_boxes *boxes, unsigned child,
                         double axis[3][3]) {
    int64_t square = (int64_t)ONE * ONE;
    double q[3];
    for (int d = 0; d < 3; d++) {
        int64_t turn = boxes->turn[d][child];
        square -= turn * turn;
        q[d] = (double)turn / ONE;
    }
    double w = __builtin_sqrt(square > 0 ? (double)square : 0) / ONE;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        axis[k][k] = 1 - 2 * (q[i] * q[i] + q[j] * q[j]);
        axis[k][i] = 2 * (q[k] * q[i] + w * q[j]);
        axis[k][j] = 2 * (q[k] * q[j] - w * q[i]);
    }
}

/* Of binary16, as if there were numbers beyond its largest. */
static double half_precision(uint16_t bits) {
    int32_t exponent = bits >> 10 & 31, fraction = bits & 1023;
    return exponent == 0
               ? fraction * 0x1p-24
               : (1024 + fraction) * incode_power_of_two(exponent - 25);
}

bool incode_boxes_lifted(const struct incode_boxes *boxes, unsigned child,
                         struct incode_lifted *lifted) {
    if (!boxes->is_lifted[child])
        return false;
    double e = 0, square = 0;
    for (int d = 0; d < 3; d++) {
        double lo = (double)boxes->lo[d][child];
        double hi = (double)boxes->hi[d][child];
        lifted->o[d] = 0.5 * (lo + hi);
        e = larger(e, 0.5 * (hi - lo));
    }
    incode_boxes_turned(boxes, child, lifted->a);
    for (int k = 0; k < 3; k++) {
        double half = half_precision(boxes->half[k][child]) * e;
        lifted->o[k] += boxes->centre[k][child] * (e / ONE);
        lifted->slope[k] = boxes->slope[k][child] * (e * e * 0x1p-5);
        for (int d = 0; d < 3; d++)
            lifted->a[k][d] *= half;
        square += half * half;
    }
    lifted->lid = boxes->lid[child] * (e * e * 0x1p-13);
    lifted->radius = __builtin_sqrt(square) * (1 + 0x1p-20);
    return true;
}

/* --- sound ---------------------------------------------------------------- */

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
