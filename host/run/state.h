/* The state of `incode run --resume DIR`: what a run has done, in a folder of
 * this user's alone, from which the same command goes on after a crash, kill -9
 * or loss of power.
 *
 * - DIR/state says what the run is of: the input's SHA-256, the options that
 *   matter, the program's version; twice, each with a CRC.
 * - DIR/order is the order of the points, a record (host/base/journal.h).
 * - DIR/spool is records: of a run on threads, its regions; of a cube, the
 *   tetrahedra as they came, and commits (host/service/kept.h).
 *
 * `state` and `order` get their names when they are on the disk; `spool` is
 * synced once a second.  An order that is missing or damaged is made again: the
 * records count if it comes out the same.  A record that is damaged is not
 * used, and what was in it is done again.
 *
 * A run on threads keeps its regions, and those of seams that take half a
 * second or more.  A smaller seam is done again.
 *
 * Memory: 72 bytes a record, and 4 bytes a brick on a cube.  Disk: about 140
 * bytes a point.  Work: a hash of the input, the order and the tetrahedra
 * written once. */
#ifndef HOST_STATE_H
#define HOST_STATE_H

#include "run.h"

struct host_state;

/* Bytes of a point that the state takes where points fill a volume, and some
 * more. */
enum { HOST_STATE_POINT_BYTES = 200 };

/* Opens options->resume, if it is not NULL, for these points.  If the state of
 * an earlier run is there, options->strategy and nodes become those of that
 * run, where they are left open.  HOST_INPUT or HOST_USAGE: the folder is not
 * to be used, another process uses it, or its run had other points or options;
 * nothing in it has changed then.  Sets options->state. */
int host_state_begin(struct host_run_options *options,
                     const struct host_points *points,
                     struct host_error *error);

/* `state` may be NULL: there is no --resume.  Then these functions do nothing
 * but order the points. */

/* As host_order_make, or the order of the earlier run. */
int host_state_order(struct host_state *state, struct host_order *order,
                     const char *where, const struct host_points *points,
                     enum host_partition partition, uint32_t regions, bool grid,
                     struct host_error *error);

/* The order and result->strategy and nodes are final: from now on the run keeps
 * what it does. */
int host_state_start(struct host_state *state, const struct host_order *order,
                     const struct host_run_result *result,
                     struct host_error *error);

/* Regions for so many points on this call's threads: smaller ones than without
 * a state, so that less is lost. */
uint32_t host_state_regions(const struct host_state *state, uint64_t points);

/* What keeps regions; NULL without a state. */
const struct host_direct_store *
host_state_store(const struct host_state *state);
/* What a cube's service keeps; NULL without a state. */
struct host_kept *host_state_kept(struct host_state *state);

/* Returns when the order is kept, and may be freed.  Fills in what of the
 * result came from an earlier run. */
int host_state_order_kept(struct host_state *state,
                          struct host_run_result *result,
                          struct host_error *error);

/* Whether work of an earlier run is used. */
bool host_state_is_resumed(const struct host_state *state);

/* The end of a run.  If it has succeeded, its outputs are synced, and the state
 * is removed.  If its result was wrong, what was kept is dropped.  Else it
 * stays, and a note says how to go on.  0, or error->code. */
int host_state_end(const struct host_run_options *options,
                   struct host_error *error);

#endif
