/* The k-d build: points as records, selected by rank and moved in place until
 * bricks and their leaves are compact.
 *
 * Memory: the records (32 bytes a point), O(log n) stack.  Work: O(n log n),
 * two or three moves a point and level. */
#ifndef HOST_KD_BUILD_H
#define HOST_KD_BUILD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct host_item {
    double c[3];
    uint64_t row;
};

/* Takes the items of one finished brick, leaf after leaf. */
typedef void host_brick_sink(void *context, uint32_t brick,
                             const struct host_item *items, size_t count);

/* Tight box; (+inf, -inf) for none. */
void host_kd_box(const struct host_item *items, size_t n, double lo[3],
                 double hi[3]);

/* The dimension in which the box is longest, the first of equals. */
int host_kd_longest(const double lo[3], const double hi[3]);

/* Moves the items with c[d] < wall to the front; returns how many. */
size_t host_kd_below(struct host_item *items, size_t n, int d, double wall);

/* Moves the k smallest to the front, by c[d], ties by (x, y, z); no two items
 * are equal.  `from_above`: the k largest. */
void host_kd_rank(struct host_item *items, size_t n, size_t k, int d,
                  int from_above);

/* Orders items as bricks first_brick, .. and calls sink once for each, from
 * up to `threads` threads. */
void host_kd_bricks(struct host_item *items, size_t n, uint32_t first_brick,
                    unsigned threads, host_brick_sink *sink, void *context);

/* Of items that are put aside (host/base/scratch.h): cuts them into parts of
 * about equal numbers, a power of two, that stand one behind the other, by
 * walls between items of a sample.  The array is another afterwards.  False:
 * there is no room; nothing has changed.
 *
 * Work: items are read twice and written once, through their files. */
enum { HOST_KD_PARTS_MAX = 64 };

struct host_kd_part {
    size_t n;
    double lo[3], hi[3]; /* its cell; those of all parts tile the box */
};

bool host_kd_spread(struct host_item **items, size_t n, unsigned parts,
                    const double lo[3], const double hi[3],
                    struct host_kd_part part[HOST_KD_PARTS_MAX]);

#endif
