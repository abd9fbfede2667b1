/* A file as bytes in memory, and what its name says about it.
 *
 * Memory: the bytes (of a .gz, those packed and those unpacked).  Work: one
 * pass.
 *
 *     struct host_source source;
 *     if (host_source_open(&source, "a.xyz.gz", &error) != 0) ...
 *     host_source_close(&source);
 */
#ifndef HOST_SOURCE_H
#define HOST_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "host/base/error.h"

struct host_source {
    const char *path; /* as in messages */
    const uint8_t *data;
    size_t bytes;
    void *owned; /* what close gives back, `capacity` bytes */
    size_t capacity;
};

enum host_format {
    HOST_XYZ, /* .xyz .txt .csv, and "-" for points */
    HOST_NODE,
    HOST_PLY,
    HOST_OFF,
    HOST_NPY,
    HOST_VTK,
    HOST_VTU, /* .vtu .vtp .vts */
    HOST_VTP,
    HOST_VTS,
    HOST_PLOT3D, /* .x .p3d .bin */
    HOST_ELE,    /* and "-" for tetrahedra */
    HOST_MSH,
    HOST_MESH,
    HOST_UNKNOWN
};

/* Whether it ends in .gz, in letters of either case. */
bool host_is_packed(const char *path);

/* By the extension, .gz apart; "-" is HOST_UNKNOWN. */
enum host_format host_format_of(const char *path);

/* Whether the extension is .csv (.gz apart): its first line may name the
 * columns. */
bool host_is_csv(const char *path);

/* Reads it whole ("-": standard input), unpacks .gz.  A missing, unreadable,
 * empty or damaged file: HOST_INPUT. */
int host_source_open(struct host_source *source, const char *path,
                     struct host_error *error);

/* Takes bytes of the caller, unpacks them if `path` ends in .gz. */
int host_source_wrap(struct host_source *source, const char *path,
                     const void *data, size_t bytes, struct host_error *error);

void host_source_close(struct host_source *source);

/* "PATH: what" with HOST_INPUT. */
int host_source_fail(const struct host_source *source, struct host_error *error,
                     const char *what);

#endif
