#include "order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "duplicates.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "incode/pages/pager.h"
#include "incode/predicates/predicates.h"
#include "kd_build.h"
#include "lift.h"

enum {
    FORK_POINTS = 1 << 13,
    /* Bytes of arrays that are touched for a brick, its row numbers and its
     * lump included. */
    BRICK_TOUCHES = 2 * sizeof(struct incode_brick)
};

/* Vertex numbers of all bricks must stay below INCODE_NONE. */
static const uint64_t bricks_max = (UINT64_C(1) << 26) - 1024;

/* --- Regions -------------------------------------------------------------- */

struct cut {
    struct host_order *order;
    struct host_item *items; /* of all points */
    enum host_partition partition;
    unsigned threads;
    uint32_t region, regions; /* [region, region + regions) */
    size_t first, n;
    double lo[3], hi[3];
    int depth;
    unsigned above, below; /* bit d: along d, regions lie beyond that side */
};

/* Of n points in a box, cut along d into equal parts: how many fewer the lower
 * one is to have, as the tetrahedra across the cut are its own; and so are
 * those across the upper side of the upper part, but not those across the lower
 * side of the lower one.  Of uniform points, a point has 6.8 tetrahedra, and a
 * cut crosses some 7 for each point beside it. */
static size_t owned_shift(const struct cut *c, const double lo[3],
                          const double hi[3], int d) {
    int sides = 2 - (int)(c->above >> d & 1) - (int)(c->below >> d & 1);
    double length = 0.5 * hi[d] - 0.5 * lo[d], across = 1;
    for (int e = 0; e < 3; e++)
        across *= e == d ? 1 : (0.5 * hi[e] - 0.5 * lo[e]) / length;
    double points = (double)c->n;
    double shift = sides * 0.26 * cbrt(points * points * across);
    return shift < points / 8 ? (size_t)shift : c->n / 8;
}

/* Equal counts, in whole bricks and whole box pages where that costs at most
 * one part in 64 of the balance. */
static size_t half_rank(size_t n) {
    size_t half = (n + 1) / 2;
    const size_t page = (size_t)INCODE_BRICK_POINTS * INCODE_FANOUT;
    size_t step = n >= 32 * page                          ? page
                  : n >= (size_t)32 * INCODE_BRICK_POINTS ? INCODE_BRICK_POINTS
                                                          : 1;
    return (half + step / 2) / step * step;
}

static void cut_regions(void *argument) {
    struct cut *c = argument;
    struct host_item *items = c->items + c->first;
    if (c->regions == 1) {
        struct host_region *r = c->order->region + c->region;
        r->points = (uint32_t)c->n;
        memcpy(r->lo, c->lo, sizeof r->lo);
        memcpy(r->hi, c->hi, sizeof r->hi);
        return;
    }
    int d = c->depth % 3;
    size_t k;
    double wall;
    if (c->partition == HOST_UNIFORM) {
        wall = 0.5 * c->lo[d] + 0.5 * c->hi[d];
        k = host_kd_below(items, c->n, d, wall);
    } else {
        double lo[3], hi[3];
        host_kd_box(items, c->n, lo, hi);
        d = c->n > 0 ? host_kd_longest(lo, hi) : 0;
        k = half_rank(c->n);
        if (c->partition == HOST_OWNED && k > 0)
            k -= owned_shift(c, lo, hi, d);
        host_kd_rank(items, c->n, k, d, 0);
        host_kd_box(items + k, c->n - k, lo, hi);
        wall = k < c->n ? lo[d] : c->hi[d];
    }
    struct cut lower = *c, upper = *c;
    lower.depth = upper.depth = c->depth + 1;
    lower.regions = upper.regions = c->regions / 2;
    upper.region += lower.regions;
    lower.n = k;
    upper.first += k, upper.n -= k;
    lower.hi[d] = upper.lo[d] = wall;
    lower.above |= 1u << d;
    upper.below |= 1u << d;
    if (c->threads > 1 && c->n >= FORK_POINTS) {
        struct host_fork fork;
        lower.threads = c->threads / 2;
        upper.threads = c->threads - lower.threads;
        host_fork_start(&fork, cut_regions, &lower);
        cut_regions(&upper);
        host_fork_join(&fork);
    } else {
        cut_regions(&lower);
        cut_regions(&upper);
    }
}

/* --- Bricks --------------------------------------------------------------- */

struct spread {
    struct host_order *order;
    struct host_item *items;
    struct host_lump *lump; /* of each brick */
    uint32_t region, regions;
    size_t first, n;
    unsigned threads;
};

static void store_brick(void *context, uint32_t number,
                        const struct host_item *items, size_t count) {
    const struct spread *spread = context;
    struct host_order *order = spread->order;
    struct incode_brick *brick = &order->brick[number];
    uint32_t *row = order->row + (size_t)number * INCODE_BRICK_POINTS;
    for (size_t i = 0; i < INCODE_BRICK_POINTS; i++) {
        const struct host_item *item = &items[i < count ? i : count - 1];
        brick->x[i] = item->c[0];
        brick->y[i] = item->c[1];
        brick->z[i] = item->c[2];
        row[i] = i < count ? (uint32_t)item->row : INCODE_NONE;
    }
    order->fill[number] = (uint8_t)count;
    host_call_trim(BRICK_TOUCHES);
    host_lump_brick(&spread->lump[number], brick);
}

/* Builds a run of regions, forking where there are threads and points. */
static void build_regions(void *argument) {
    struct spread *s = argument;
    if (s->regions == 1) {
        host_kd_bricks(s->items + s->first, s->n,
                       s->order->region[s->region].first, s->threads,
                       store_brick, s);
        return;
    }
    struct spread lower = *s, upper = *s;
    lower.regions = upper.regions = s->regions / 2;
    upper.region += lower.regions;
    lower.n = 0;
    for (uint32_t i = 0; i < lower.regions; i++)
        lower.n += s->order->region[s->region + i].points;
    upper.first += lower.n, upper.n -= lower.n;
    if (s->threads > 1 && s->n >= FORK_POINTS) {
        struct host_fork fork;
        lower.threads = s->threads / 2;
        upper.threads = s->threads - lower.threads;
        host_fork_start(&fork, build_regions, &lower);
        build_regions(&upper);
        host_fork_join(&fork);
    } else {
        build_regions(&lower);
        build_regions(&upper);
    }
}

static uint64_t number_bricks(struct host_order *order) {
    uint64_t bricks = 0;
    for (uint32_t r = 0; r < order->regions; r++) {
        struct host_region *region = &order->region[r];
        region->first = (uint32_t)bricks;
        bricks += ((uint64_t)region->points + INCODE_BRICK_POINTS - 1) /
                  INCODE_BRICK_POINTS;
        region->last = (uint32_t)bricks;
    }
    return bricks;
}

/* --- Box pages ------------------------------------------------------------ */

/* A level of box pages, a share of it for each thread. */
struct level {
    struct host_order *order;
    struct host_lump *lump; /* of each page of the tree */
    uint32_t level;
    unsigned parts;
};

static uint32_t share(uint32_t count, unsigned part, unsigned parts) {
    return (uint32_t)((uint64_t)count * part / parts);
}

static struct incode_boxes *boxes_above(const struct level *l, uint32_t child) {
    const struct incode_tree *tree = &l->order->tree;
    return l->order->boxes + (tree->base[l->level] - tree->base[1]) +
           child / INCODE_FANOUT;
}

static bool is_a_point(const struct host_lump *lump) {
    return lump->lo[0] == lump->hi[0] && lump->lo[1] == lump->hi[1] &&
           lump->lo[2] == lump->hi[2];
}

/* Boxes are finest around the origin.  If children differ much in size, it
 * moves to the smallest one that is not a point. */
static void move_origin(struct incode_boxes *boxes,
                        const struct host_lump *child, uint32_t count) {
    double least = boxes->unit * 0x1p-12;
    if (boxes->unit >= 0x1p1022) /* differences could overflow */
        return;
    for (uint32_t c = 0; c < count; c++) {
        if (child[c].unit >= least || is_a_point(&child[c]))
            continue;
        least = child[c].unit;
        memcpy(boxes->origin, child[c].origin, sizeof boxes->origin);
    }
}

static void make_pages(void *context, unsigned part) {
    const struct level *l = context;
    const struct incode_tree *tree = &l->order->tree;
    const struct host_lump *below = l->lump + tree->base[l->level - 1];
    uint32_t pages = tree->count[l->level],
             children = tree->count[l->level - 1];
    for (uint32_t i = share(pages, part, l->parts);
         i < share(pages, part + 1, l->parts) && !host_call_cancelled(); i++) {
        struct host_lump *all = &l->lump[tree->base[l->level] + i];
        struct incode_boxes *boxes = boxes_above(l, i * INCODE_FANOUT);
        const struct host_lump *first = below + i * INCODE_FANOUT;
        uint32_t count = children - i * INCODE_FANOUT;
        count = count > INCODE_FANOUT ? INCODE_FANOUT : count;
        host_call_trim((count + 1) * sizeof *first + sizeof *boxes);
        host_lump_join(all, first, count);
        incode_boxes_init(boxes, all->lo, all->hi);
        move_origin(boxes, first, count);
        for (uint32_t c = 0; c < count; c++)
            incode_boxes_set(boxes, c, first[c].lo, first[c].hi);
    }
}

static void lift_children(void *context, unsigned part) {
    const struct level *l = context;
    const struct host_order *order = l->order;
    const struct incode_tree *tree = &order->tree;
    uint32_t children = tree->count[l->level - 1];
    unsigned shift = 5 * (l->level - 1); /* to bricks */
    for (uint32_t c = share(children, part, l->parts);
         c < share(children, part + 1, l->parts) && !host_call_cancelled();
         c++) {
        uint64_t first = (uint64_t)c << shift, last = (c + UINT64_C(1))
                                                      << shift;
        last = last < order->bricks ? last : order->bricks;
        host_lift(boxes_above(l, c), c % INCODE_FANOUT,
                  &l->lump[tree->base[l->level - 1] + c], order->brick + first,
                  (uint32_t)(last - first));
    }
}

static void make_boxes(struct host_order *order, struct host_lump *lump) {
    struct level l = {.order = order, .lump = lump};
    l.parts = order->points >= FORK_POINTS ? host_threads() : 1;
    for (l.level = 1; l.level < order->tree.levels; l.level++) {
        host_fork_all(l.parts, make_pages, &l);
        host_fork_all(l.parts, lift_children, &l);
    }
}

/* --- The uniform grid ----------------------------------------------------- */

static uint32_t cells_along(double extent, double side) {
    double cells = extent / side;
    return cells >= 1e9 ? 1000000000u : cells > 1 ? (uint32_t)cells : 1;
}

/* Cubic cells, as many as points or a few less. */
static void choose_cells(struct host_order *order) {
    double extent[3], longest = 0;
    for (int d = 0; d < 3; d++) {
        extent[d] = 0.5 * order->hi[d] - 0.5 * order->lo[d];
        longest = extent[d] > longest ? extent[d] : longest;
        order->cells[d] = 1;
    }
    /* 2^-30 of the longest side to all of it: 60 halvings of the interval. */
    double small = longest / 0x1p30, large = longest * 2;
    for (int i = 0; i < 60 && longest > 0; i++) {
        double side = 0.5 * small + 0.5 * large;
        if (!(side > 0))
            break; /* denormal extents: one cell does */
        uint32_t cells[3];
        double product = 1;
        for (int d = 0; d < 3; d++) {
            cells[d] = cells_along(extent[d], side);
            product *= cells[d];
        }
        if (product <= order->points) {
            large = side;
            memcpy(order->cells, cells, sizeof cells);
        } else {
            small = side;
        }
    }
}

static int make_grid(struct host_order *order, struct host_error *error) {
    choose_cells(order);
    size_t cells = (size_t)order->cells[0] * order->cells[1] * order->cells[2];
    order->first_of_cell = host_map((cells + 1) * sizeof(uint32_t));
    order->by_cell = host_map((size_t)order->points * sizeof(uint32_t));
    if (order->first_of_cell == NULL || order->by_cell == NULL)
        return host_fail_memory(error, "the lists of the uniform grid");
    uint32_t *first = order->first_of_cell;
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t b = order->bricks; b-- > 0;) {
            host_call_trim(BRICK_TOUCHES);
            for (uint32_t i = order->fill[b]; i-- > 0;) {
                uint32_t v = b * INCODE_BRICK_POINTS + i;
                double p[3];
                host_vertex(order, v, p);
                uint32_t cell =
                    incode_cell_of(order->lo, order->hi, order->cells, p);
                host_call_trim(HOST_CALL_AROUND);
                if (pass == 0)
                    first[cell]++;
                else
                    order->by_cell[--first[cell]] = v;
            }
        }
        for (size_t cell = 1; pass == 0 && cell <= cells; cell++) {
            host_call_trim(sizeof *first);
            first[cell] += first[cell - 1];
        }
    }
    return 0;
}

/* --- Dimension ------------------------------------------------------------ */

/* Points that span the space: the first that is off the first two's line, the
 * first that is off that plane.  Neighbours in this order are close, so
 * the second point is taken from the far end. */
static int check_dimension(struct host_order *order, const char *where,
                           struct host_error *error) {
    struct incode_tally tally = {0};
    double a[3], b[3], c[3], d[3];
    host_vertex(order, 0, a);
    uint32_t last = order->bricks - 1;
    host_vertex(order, last * INCODE_BRICK_POINTS + order->fill[last] - 1u, b);
    bool plane = false;
    for (uint32_t k = 0; k < order->bricks && !host_call_cancelled(); k++) {
        host_call_trim(BRICK_TOUCHES);
        for (uint32_t i = 0; i < order->fill[k]; i++) {
            host_vertex(order, k * INCODE_BRICK_POINTS + i, d);
            if (!plane) {
                plane = !incode_collinear(a, b, d);
                memcpy(c, d, sizeof c);
            } else if (incode_orient3d(&tally, a, b, c, d) != 0) {
                return 0;
            }
        }
    }
    order->fault = HOST_ORDER_FLAT;
    return host_fail(error, HOST_INPUT,
                     "%s: all %u distinct points lie on one %s, so there is "
                     "no tetrahedron; give points that span three dimensions",
                     where, order->points, plane ? "plane" : "line");
}

/* --- All together --------------------------------------------------------- */

static int allocate(struct host_order *order, struct host_error *error) {
    size_t bricks = order->bricks;
    order->brick = host_map(bricks * sizeof *order->brick);
    order->fill = host_map(bricks);
    order->row = host_map(bricks * INCODE_BRICK_POINTS * sizeof(uint32_t));
    order->boxes = host_map((order->tree.base[order->tree.levels] - bricks) *
                            sizeof *order->boxes);
    if (order->brick == NULL || order->fill == NULL || order->row == NULL ||
        order->boxes == NULL)
        return host_fail_memory(error, "the order of the points");
    return 0;
}

/* As many parts as are ordered in memory each, where all are put aside. */
static unsigned parts_aside(const struct host_order *order) {
    size_t most = host_call_share() / sizeof(struct host_item);
    unsigned parts = 1;
    while (parts < HOST_KD_PARTS_MAX && parts < order->regions &&
           order->points / parts / 2 > most)
        parts *= 2;
    return parts;
}

/* Regions of parts that stand one behind the other. */
static void cut_parts(const struct cut *all, const struct host_kd_part *part,
                      unsigned parts) {
    struct cut cut = *all;
    cut.regions = all->regions / parts;
    for (unsigned k = 0; k < parts && !host_call_cancelled(); k++) {
        cut.n = part[k].n;
        memcpy(cut.lo, part[k].lo, sizeof cut.lo);
        memcpy(cut.hi, part[k].hi, sizeof cut.hi);
        cut_regions(&cut);
        cut.region += cut.regions;
        cut.first += cut.n;
    }
}

static int build_items(struct host_order *order, struct host_distinct *distinct,
                       enum host_partition partition,
                       struct host_error *error) {
    struct host_kd_part part[HOST_KD_PARTS_MAX];
    unsigned parts = partition == HOST_ADAPTIVE ? parts_aside(order) : 1;
    if (parts > 1 && !host_kd_spread(&distinct->items, order->points, parts,
                                     order->lo, order->hi, part))
        parts = 1;
    struct host_item *items = distinct->items;
    struct cut cut = {.order = order,
                      .items = items,
                      .partition = partition,
                      .threads = host_threads(),
                      .regions = order->regions,
                      .n = order->points};
    memcpy(cut.lo, order->lo, sizeof cut.lo);
    memcpy(cut.hi, order->hi, sizeof cut.hi);
    if (parts > 1)
        cut_parts(&cut, part, parts);
    else
        cut_regions(&cut);
    if (host_call_cancelled())
        return host_fail(error, HOST_BROKEN, "host: cancelled");
    uint64_t bricks = number_bricks(order);
    if (bricks > bricks_max) {
        order->fault = HOST_ORDER_MANY;
        return host_fail(error, HOST_INPUT,
                         "host: %u points are more than vertex numbers of 32 "
                         "bits allow; split the input",
                         order->points);
    }
    order->bricks = (uint32_t)bricks;
    incode_tree_init(&order->tree, order->bricks, 0);
    if (allocate(order, error) != 0)
        return error->code;
    size_t lumps =
        order->tree.base[order->tree.levels] * sizeof(struct host_lump);
    struct host_lump *lump = host_map(lumps);
    if (lump == NULL)
        return host_fail_memory(error, "the boxes of the points");
    struct spread spread = {.order = order,
                            .items = items,
                            .lump = lump,
                            .regions = order->regions,
                            .n = order->points,
                            .threads = host_threads()};
    build_regions(&spread);
    if (!host_call_cancelled())
        make_boxes(order, lump);
    host_unmap(lump, lumps);
    return 0;
}

int host_order_make(struct host_order *order, const char *where,
                    const double *xyz, uint64_t rows,
                    enum host_partition partition, uint32_t regions, bool grid,
                    struct host_error *error) {
    *order = (struct host_order){
        .rows = rows, .regions = regions, .regions_made = regions};
    struct host_distinct distinct;
    if (host_distinct_make(&distinct, xyz, rows, error) != 0)
        return error->code;
    order->points = (uint32_t)distinct.count;
    order->duplicates = rows - distinct.count;
    order->negative_zeros = distinct.negative_zeros;
    if (distinct.count < 4) {
        order->fault = HOST_ORDER_FEW;
        host_fail(error, HOST_INPUT,
                  "%s: %u distinct points (of %llu) where a tetrahedron has 4; "
                  "give more points",
                  where, order->points, (unsigned long long)rows);
    }
    memcpy(order->lo, distinct.lo, sizeof order->lo);
    memcpy(order->hi, distinct.hi, sizeof order->hi);
    order->region = host_map(regions * sizeof *order->region);
    if (order->region == NULL)
        host_fail_memory(error, "the regions");
    else if (error->code == 0)
        build_items(order, &distinct, partition, error);
    host_distinct_free(&distinct);
    if (error->code == 0 && !host_call_cancelled())
        check_dimension(order, where, error);
    if (error->code == 0 && grid && make_grid(order, error) == 0) {
        incode_tree_init(&order->tree, order->bricks,
                         order->cells[0] * order->cells[1] * order->cells[2]);
    }
    if (error->code == 0 && host_call_cancelled())
        host_fail(error, HOST_BROKEN, "%s: cancelled", where);
    if (error->code != 0) {
        enum host_order_fault fault = order->fault;
        host_order_free(order);
        order->fault = fault;
    }
    return error->code;
}

uint64_t host_key(const uint32_t *word, uint64_t count, uint64_t before) {
    enum { POLL = 1 << 14 };
    uint64_t h = before ^ count;
    for (uint64_t i = 0; i < count; i++) {
        h = (h ^ word[i]) * UINT64_C(0x9e3779b97f4a7c15);
        h ^= h >> 29;
        if (i % POLL == 0)
            host_call_trim(POLL * sizeof *word);
    }
    return h;
}

uint64_t host_order_key(const struct host_order *order, uint64_t before) {
    uint64_t key = host_key(
        order->row, (uint64_t)order->bricks * INCODE_BRICK_POINTS, before);
    for (uint32_t r = 0; r < order->regions; r++)
        key = host_key(&order->region[r].last, 1, key);
    return key;
}

void host_order_join(struct host_order *order) {
    struct host_region *all = &order->region[0];
    *all = (struct host_region){.last = order->bricks, .points = order->points};
    memcpy(all->lo, order->lo, sizeof all->lo);
    memcpy(all->hi, order->hi, sizeof all->hi);
    order->regions = 1;
}

void host_order_free(struct host_order *order) {
    size_t bricks = order->bricks;
    size_t cells = (size_t)order->cells[0] * order->cells[1] * order->cells[2];
    host_unmap(order->brick, bricks * sizeof *order->brick);
    host_unmap(order->fill, bricks);
    host_unmap(order->row, bricks * INCODE_BRICK_POINTS * sizeof(uint32_t));
    host_unmap(order->boxes, (order->tree.base[order->tree.levels] - bricks) *
                                 sizeof *order->boxes);
    host_unmap(order->first_of_cell, (cells + 1) * sizeof(uint32_t));
    host_unmap(order->by_cell, (size_t)order->points * sizeof(uint32_t));
    host_unmap(order->region, order->regions_made * sizeof *order->region);
    *order = (struct host_order){0};
}

static size_t copy_words(const uint32_t *from, size_t count, uint32_t page,
                         void *buffer) {
    size_t first = (size_t)page * INCODE_PAGE_WORDS;
    size_t n = first < count ? count - first : 0;
    n = n > INCODE_PAGE_WORDS ? INCODE_PAGE_WORDS : n;
    memset(buffer, 0xff, sizeof(struct incode_words));
    if (n > 0)
        memcpy(buffer, from + first, n * sizeof *from);
    return sizeof(struct incode_words);
}

size_t host_page(const struct host_order *order, uint32_t page, void *buffer) {
    const struct incode_tree *tree = &order->tree;
    if (page < order->bricks) {
        const struct incode_brick *brick = &order->brick[page];
        size_t axis = order->fill[page] * sizeof(double);
        memcpy(buffer, brick->x, axis);
        memcpy((char *)buffer + axis, brick->y, axis);
        memcpy((char *)buffer + 2 * axis, brick->z, axis);
        return 3 * axis;
    }
    if (page < tree->base[tree->levels]) {
        const struct incode_boxes *boxes = &order->boxes[page - tree->base[1]];
        memcpy(buffer, boxes, sizeof *boxes);
        return sizeof *boxes;
    }
    if (page < tree->list_base) {
        size_t cells =
            (size_t)order->cells[0] * order->cells[1] * order->cells[2];
        return copy_words(order->first_of_cell, cells + 1,
                          page - tree->cells_base, buffer);
    }
    if (page < tree->pages) {
        return copy_words(order->by_cell, order->points, page - tree->list_base,
                          buffer);
    }
    return 0;
}
