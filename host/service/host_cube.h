/* The host's end of a cube, on a machine's wires.
 *
 * Memory: its windows, a kilobyte or two a frame.  Work: one allocation.
 *
 *     cube = host_cube_make(&machine, 0, &memory, &error);
 *     if (cube == NULL)
 *         return error.code;
 *     free(memory);
 */
#ifndef HOST_HOST_CUBE_H
#define HOST_HOST_CUBE_H

#include "machine.h"

/* window: frames; 0: a large one.  NULL: HOST_BROKEN.  The caller frees
 * *memory, in both cases. */
struct cube *host_cube_make(const struct host_machine *machine, unsigned window,
                            void **memory, struct host_error *error);

#endif
