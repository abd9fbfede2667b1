/* The points in the order of the run: duplicates merged, -0.0 turned into 0.0,
 * cut into regions, each region a balanced k-d order of bricks of 64
 * points and leaves of 8 (see incode/pages/pages.h), with the pages that nodes
 * ask for.
 *
 * Memory: 28 bytes a point at the end, 63 at most while it works (input rows
 * not counted).  Work: O(n log n), about 100 ms a million points on two cores.
 */
#ifndef HOST_ORDER_H
#define HOST_ORDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"
#include "incode/pages/pages.h"

/* Regions of equal numbers of points, equal cells, or as equal numbers of
 * tetrahedra as can be told beforehand, where the lowest vertex owns. */
enum host_partition { HOST_ADAPTIVE, HOST_UNIFORM, HOST_OWNED };

/* Bricks [first, last) hold the points of the region; none where it is empty.
 * lo..hi is its cell of the space; the cells tile the box of all points.  A
 * point on a wall of `uniform` belongs to the upper cell. */
struct host_region {
    uint32_t first, last;
    uint32_t points;
    double lo[3], hi[3];
};

/* Why points have no order. */
enum host_order_fault {
    HOST_ORDER_SOUND, /* or there was no memory, or the call was cancelled */
    HOST_ORDER_FEW,   /* fewer than 4 distinct points */
    HOST_ORDER_FLAT,  /* all points on one plane or line */
    HOST_ORDER_MANY   /* more than 2^32 - 2^16 vertex numbers */
};

struct host_order {
    uint64_t rows;           /* of the input */
    uint64_t duplicates;     /* rows that stand for an earlier row */
    uint64_t negative_zeros; /* coordinates of the input that are -0.0 */
    uint32_t points;         /* distinct points */
    uint32_t bricks;
    struct incode_brick *brick; /* [bricks]; unused slots repeat the last */
    uint8_t *fill;              /* [bricks] points of each brick, 1..64 */
    uint32_t *row; /* [64 * bricks] vertex number -> lowest input row;
                      INCODE_NONE in unused slots */
    uint32_t regions;
    struct host_region *region; /* [regions]; made for regions_made */
    uint32_t regions_made;
    double lo[3], hi[3]; /* tight box of all points */
    uint32_t cells[3];   /* uniform grid of index `grid`, else 0 */
    struct incode_tree tree;
    struct incode_boxes *boxes;  /* box pages, from tree.base[1] */
    uint32_t *first_of_cell;     /* [cells + 1], with a grid */
    uint32_t *by_cell;           /* [points] vertex numbers, with a grid */
    enum host_order_fault fault; /* of one that could not be made */
};

/* Orders `rows` points xyz[3 * row + d], all finite, into `regions` (a power of
 * two) regions.  `grid`: also the lists of index `grid`.  HOST_INPUT for fewer
 * than 4 distinct points, for points all on one line or plane, and for more
 * than 2^32 - 2^16 vertex numbers: order->fault.  `where` names the input in
 * the message. */
int host_order_make(struct host_order *order, const char *where,
                    const double *xyz, uint64_t rows,
                    enum host_partition partition, uint32_t regions, bool grid,
                    struct host_error *error);

/* A number by which two orders of the same input differ, if they do; `before`:
 * that of what the input was made from, or 0.  host_key: the same of words. */
uint64_t host_order_key(const struct host_order *order, uint64_t before);
uint64_t host_key(const uint32_t *word, uint64_t count, uint64_t before);

/* Appends the order to a journal (host/base/journal.h).  Takes it from one that
 * has it alone, with that key; false: it is not there, or damaged. */
struct host_journal;
int host_order_append(const struct host_order *order,
                      struct host_journal *journal, uint64_t key,
                      struct host_error *error);
bool host_order_take(struct host_order *order,
                     const struct host_journal *journal, uint64_t key);

/* Makes one region of all. */
void host_order_join(struct host_order *order);

void host_order_free(struct host_order *order);

/* Copies page `page` into buffer (INCODE_PAGE_BYTES).  Returns its bytes:
 * those of its kind, or 24 a point for a brick that is not full (x[count],
 * y[count], z[count]); 0 where there is no such page. */
size_t host_page(const struct host_order *order, uint32_t page, void *buffer);

/* Coordinates of a vertex. */
static inline void host_vertex(const struct host_order *order, uint32_t vertex,
                               double xyz[3]) {
    const struct incode_brick *b = &order->brick[vertex / INCODE_BRICK_POINTS];
    uint32_t slot = vertex % INCODE_BRICK_POINTS;
    xyz[0] = b->x[slot];
    xyz[1] = b->y[slot];
    xyz[2] = b->z[slot];
}

/* How many tetrahedra are open at a time where points come in the order of
 * bricks: some of their points are there, and others are still to come.  A node
 * that inserts points has to keep at least these
 * (incode/insertion/insertion.h).
 *
 * A sample of the points is triangulated, and one of a fourth of them; how the
 * number grows between the two tells how it goes on: as n^(1/2) for a surface
 * that the order sweeps, as n^(2/3) for a volume, as n where the points lie on
 * the edges of large walls, whose tetrahedra reach across.
 *
 * Memory: 1 MB, while it works.  Work: 2,500 insertions. */

/* About so many, no more than 14 times the points; 0: the sample lies in a
 * plane, or there is no memory. */
uint64_t host_order_open(const struct host_order *order);

#endif
