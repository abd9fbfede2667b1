#include "sound.h"

#include <string.h>

/* Numbers outside [lo, hi], NaN included; data need not be aligned to them. */
static bool outside(const uint8_t *data, uint32_t count, double lo, double hi)
{
    int bad = 0;
    for (uint32_t i = 0; i < count; i++) {
        double a;
        memcpy(&a, data + i * sizeof a, sizeof a);
        bad |= !(a >= lo) | !(a <= hi);
    }
    return bad != 0;
}

static bool brick_is_sound(const double lo[3], const double hi[3],
                           const uint8_t *data, size_t bytes)
{
    uint32_t points = (uint32_t)(bytes / (3 * sizeof *lo));
    bool good = points >= 1 && bytes <= INCODE_PAGE_BYTES &&
                points * 3 * sizeof *lo == bytes;
    for (unsigned d = 0; d < 3 && good; d++)
        good = !outside(data + d * points * sizeof *lo, points, lo[d], hi[d]);
    return good;
}

/* Boxes of children in the box of all; those of none are empty. */
static bool boxes_are_sound(const double lo[3], const double hi[3],
                            const uint8_t *data, uint32_t children)
{
    struct incode_boxes boxes;
    int bad = 0;
    memcpy(&boxes, data, sizeof boxes);
    for (int d = 0; d < 3; d++) {
        for (uint32_t i = 0; i < INCODE_FANOUT; i++) {
            double a = boxes.lo[d][i], b = boxes.hi[d][i];
            bad |= i < children ? !(a >= lo[d]) | !(b <= hi[d]) | !(a <= b)
                                : !(a > b);
        }
    }
    return bad == 0;
}

/* Beyond the end of a list stands INCODE_NONE. */
static bool words_are_sound(uint32_t vertices, const uint8_t *data)
{
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
                          size_t bytes)
{
    uint32_t level = incode_tree_level(tree, page);
    if (level == 0)
        return brick_is_sound(lo, hi, data, bytes);
    if (page >= tree->pages || bytes != INCODE_PAGE_BYTES)
        return false;
    if (level == tree->levels)
        return words_are_sound(tree->bricks * INCODE_BRICK_POINTS, data);
    uint32_t first = (page - tree->base[level]) * INCODE_FANOUT;
    return boxes_are_sound(lo, hi, data, tree->count[level - 1] - first);
}
