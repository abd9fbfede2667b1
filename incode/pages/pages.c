#include "pages.h"

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
    while (level < tree->levels && page >= tree->base[level + 1]) {
        level++;
    }
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
