/* What Open MPI's look at the machine (hwloc) is not to do: ask an X server for
 * its graphics cards, which takes seconds where "localhost" is no known name,
 * and write to standard error where there is no /sys.  What the user has set
 * stays. */
#ifndef TRANSPORT_DRIVERS_MPI_ENVIRONMENT_H
#define TRANSPORT_DRIVERS_MPI_ENVIRONMENT_H

#include <stdlib.h>

static inline void mpi_environment(void) {
    (void)setenv("HWLOC_COMPONENTS", "-gl", 0);
    (void)setenv("HWLOC_HIDE_ERRORS", "2", 0);
}

#endif
