#include "pages.h"

static uint32_t divide_up(uint64_t n, uint32_t by)
{
    return (uint32_t)((n + by - 1) / by);
}

void incode_tree_init(struct incode_tree *tree, uint32_t bricks, uint32_t cells)
{
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

uint32_t incode_tree_level(const struct incode_tree *tree, uint32_t page)
{
    uint32_t level = 0;
    while (level < tree->levels && page >= tree->base[level + 1]) {
        level++;
    }
    return level;
}
