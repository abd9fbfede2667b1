/* The points of a run in the order in which the user gave them, and a list that
 * grows.
 *
 * Memory: 24 bytes a point, grown by half at a time without a second copy.
 * Work: appending is amortised O(1). */
#ifndef HOST_POINTS_H
#define HOST_POINTS_H

#include <stdbool.h>
#include <stdint.h>

#include "host/base/error.h"

/* Rows 0 to count-1: xyz[3 * row + dimension], every value finite. */
struct host_points {
    double *xyz;
    uint64_t count;
    uint64_t capacity; /* rows that xyz has room for */
    uint32_t base;     /* number of row 0 in the input: 0, or 1 in a .node */
    bool wide;         /* columns after the third were passed over */
    bool named;        /* a line of names was taken for those of columns */
    /* Every row was of more than three whole numbers, parted by commas alone,
     * which may be decimal ones. */
    bool doubtful;
};

/* Appends rows; HOST_INPUT past 2^32 - 2 rows, or what the memory holds. */
int host_points_append(struct host_points *points, const double *xyz,
                       uint64_t rows, struct host_error *error);

void host_points_free(struct host_points *points);

/* The names of the choices that a run leaves to the user, by their values, as
 * options, statistics and the simulator have them; a NULL behind the last. */

extern const char *const host_partitions[]; /* enum host_partition */
extern const char *const host_indexes[];    /* enum incode_index */
extern const char *const host_face_rules[]; /* enum incode_face_rule */
extern const char *const host_builds[];     /* enum incode_build */

#endif
