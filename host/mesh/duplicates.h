/* Input rows without their duplicates, -0.0 turned into 0.0, as records for the
 * k-d build.
 *
 * Memory: 32 bytes a distinct point, 12 to 25 more a row while it works.  Work:
 * O(n) expected, one hash table a thread. */
#ifndef HOST_DUPLICATES_H
#define HOST_DUPLICATES_H

#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"
#include "kd_build.h"

struct host_distinct {
    struct host_item *items; /* in input order; row = the lowest of equals */
    size_t count;
    size_t capacity;
    uint64_t negative_zeros; /* coordinates of all rows */
    double lo[3], hi[3];     /* tight box */
};

int host_distinct_make(struct host_distinct *distinct, const double *xyz,
                       uint64_t rows, struct host_error *error);
void host_distinct_free(struct host_distinct *distinct);

/* For every row the lowest row of the same point, into lowest[rows] (all
 * threads).  Returns the number of distinct points, 0 without memory. */
uint64_t host_distinct_rows(const double *xyz, uint64_t rows, uint32_t *lowest);

#endif
