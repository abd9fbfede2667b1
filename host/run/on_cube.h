/* `incode run --cube FILE`: a run on nodes that are wired as a cube file says.
 *
 * Memory: that of the cube file and of remote.h.  Work: as theirs.
 *
 *     if (options.cube != NULL && host_run_on_cube(&options, &error) != 0)
 *         return error.code;
 *     return host_run(&options, &result, &error);
 */
#ifndef HOST_ON_CUBE_H
#define HOST_ON_CUBE_H

#include "run.h"

/* Reads options->cube and makes these options those of its cube, on whose
 * nodes host_run will be.  0, HOST_USAGE for options that do not fit that
 * cube, or what host_cube_file_read says.  Once a program. */
int host_run_on_cube(struct host_run_options *options,
                     struct host_error *error);

#endif
