/* Settings for hwloc, by which Open MPI examines the machine.  It should not
 * ask an X server for graphics cards, which takes seconds if the name
 * "localhost" is unknown, nor write to standard error if there is no /sys.
 * Settings of the user stay. */
#ifndef TRANSPORT_DRIVERS_MPI_ENVIRONMENT_H
#define TRANSPORT_DRIVERS_MPI_ENVIRONMENT_H

#include <stdlib.h>

static inline void mpi_environment(void) {
    (void)setenv("HWLOC_COMPONENTS", "-gl", 0);
    (void)setenv("HWLOC_HIDE_ERRORS", "2", 0);
}

#endif
