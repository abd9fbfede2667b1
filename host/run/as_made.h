/* --order as-made: outputs that take tetrahedra as they are made, without the
 * sort and the digest.
 *
 * Memory: a buffer of 1 MiB an output.  Work: a pass over the rows. */
#ifndef HOST_AS_MADE_H
#define HOST_AS_MADE_H

#include "host/library/delaunay.h"
#include "run.h"

/* Before the outputs are probed: HOST_USAGE where one of them has to be in
 * canonical order. */
int host_as_made_check(const struct host_run_options *options,
                       struct host_error *error);

/* Where all outputs can take tetrahedra while threads make them, and nothing
 * else has use for them, opens the outputs, and sets sums->sink.  There is one
 * such run at a time. */
int host_as_made_begin(const struct host_run_options *options,
                       const struct host_points *points,
                       struct host_direct_sums *sums, struct host_error *error);

/* Of a run that has failed: if that is because such an output takes no more,
 * the error says so.  error->code. */
int host_as_made_fail(struct host_error *error);

/* Ends such outputs, and counts what they have: true.  Without them, turns the
 * rows of `tets` into what they are in every order, for outputs that take them
 * now: false. */
bool host_as_made_end(struct host_tetrahedra *tets,
                      struct host_run_result *result, struct host_error *error);

#endif
