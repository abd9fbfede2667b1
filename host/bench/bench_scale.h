/* `incode bench scale`: what a point costs of time, memory and scratch disk
 * from file to file, as the number of points grows, without a limit of memory
 * and within one.
 *
 * Each row is a run of `incode run points.npy -o out.npy --stats -` on uniform
 * points, in a folder that is made and removed.  Its time is the whole
 * program's, without the check that the statistics have it make; its memory is
 * the most that it has resident, that check included.
 *
 * Disk: 24 bytes a point for the points and 108 for the output, and about 260
 * for what is put aside. */
#ifndef HOST_BENCH_SCALE_H
#define HOST_BENCH_SCALE_H

#include "host/base/error.h"

struct host_scale_options {
    const char *sizes;     /* numbers of points, with commas between */
    const char *memory;    /* the limit, as of --host-memory */
    const char *folder;    /* where files are made; NULL: $TMPDIR or /tmp */
    const char *csv, *svg; /* files for all rows and the figure, or NULL */
};

/* 0, or what a run ends with; HOST_USAGE: sizes that are no numbers;
 * HOST_INPUT where the figure needs gnuplot, or a file cannot be made;
 * HOST_BROKEN where a run fails, or the limit changes the tetrahedra. */
int host_bench_scale(const struct host_scale_options *options,
                     struct host_error *error);

#endif
