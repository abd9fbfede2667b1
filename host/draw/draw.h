/* `incode draw`: a plane section through a triangulation, as a picture. */
#ifndef HOST_DRAW_H
#define HOST_DRAW_H

#include <stdbool.h>

#include "host/base/error.h"
#include "host/base/limits.h"

struct host_draw_options {
    const char *points, *tets, *output;
    int axis;    /* 0 to 2; -1: the one in which the points extend least */
    bool has_at; /* else in the middle */
    double at;
    unsigned width; /* pixels */
    bool quiet;
    struct host_limits limits; /* which the caller enters */
};

/* The command's arguments.  Wrong usage: HOST_USAGE, as in arguments.h. */
int host_draw_arguments(int argc, char **argv,
                        struct host_draw_options *options,
                        struct host_error *error);

/* The command: its last act is host_output_commit. */
int host_draw(const struct host_draw_options *options,
              struct host_error *error);

#endif
