/* A drawing of the cube's wires in letters, dead and wrong ones marked: as a
 * person sees it up to dimension 4, as a matrix beyond.
 *
 * Memory: the text.  Work: a few letters a wire. */
#ifndef HOST_CONSOLE_DRAWING_H
#define HOST_CONSOLE_DRAWING_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "transport/cube.h"

enum { HOST_DRAWING_MAX = 4 }; /* dimensions */

enum host_wire_state {
    HOST_WIRE_UP,
    HOST_WIRE_UNKNOWN, /* nobody at its ends has answered */
    HOST_WIRE_DOWN,
    HOST_WIRE_DEAD,
    HOST_WIRE_WRONG
};

struct host_drawing {
    unsigned dimension;
    uint8_t wire[CUBE_NODES_MAX][CUBE_LINKS_MAX]; /* of the lower end; link
                                                     `dimension` of node 0: the
                                                     host's */
    bool absent[CUBE_NODES_MAX];
};

/* Up to HOST_DRAWING_MAX. */
void host_drawing_draw(const struct host_drawing *drawing, FILE *out);

/* A letter for each link of a node. */
void host_drawing_row(const struct host_drawing *drawing, unsigned node,
                      char text[CUBE_LINKS_MAX + 1]);

#endif
