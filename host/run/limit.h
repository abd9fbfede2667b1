/* The memory that a run on threads may use: --host-memory, --scratch. */
#ifndef HOST_RUN_LIMIT_H
#define HOST_RUN_LIMIT_H

#include "host/base/parallel.h"
#include "host/base/scratch.h"
#include "run.h"

/* Makes all that follows on this thread one call, with the run's threads and,
 * where that is limited, memory.  The scratch is used then alone. */
int host_limit_begin(const struct host_run_options *options,
                     struct host_call *call, struct host_scratch *scratch,
                     struct host_error *error);

/* Says how much may be put aside, or refuses what the disk has no room for,
 * before the run takes time. */
int host_limit_check(const struct host_run_options *options,
                     const struct host_scratch *scratch, uint64_t points,
                     struct host_error *error);

/* Ends the call, and notes what was put aside. */
void host_limit_end(struct host_call *call, struct host_run_result *result);

#endif
