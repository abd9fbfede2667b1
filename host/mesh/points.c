#include "points.h"

#include <math.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/formats/readers.h"

static host_reader *reader_of(const char *path)
{
    if (strcmp(path, "-") == 0) {
        return host_read_xyz;
    }
    switch (host_format_of(path)) {
    case HOST_XYZ:
        return host_read_xyz;
    case HOST_NODE:
        return host_read_node;
    case HOST_PLY:
        return host_read_ply;
    case HOST_OFF:
        return host_read_off;
    case HOST_NPY:
        return host_read_npy;
    case HOST_VTK:
        return host_read_vtk;
    case HOST_VTU:
    case HOST_VTP:
    case HOST_VTS:
        return host_read_vtkxml;
    case HOST_PLOT3D:
        return host_read_plot3d;
    default:
        return NULL;
    }
}

static int unknown_format(const char *path, struct host_error *error)
{
    return host_fail(error, HOST_INPUT,
                     "%s: no format of points has this extension; use .xyz "
                     ".txt .csv .node .ply .off .npy .vtk .vtu .vtp .vts .x "
                     ".p3d .bin, or any of them with .gz",
                     path);
}

static int check_finite(const char *path, const struct host_points *points,
                        struct host_error *error)
{
    for (uint64_t i = 0; i < 3 * points->count; i++) {
        if (!isfinite(points->xyz[i])) {
            return host_fail(error, HOST_INPUT,
                             "%s: point %llu (counted from 0): %c is %s; "
                             "remove the point",
                             path, (unsigned long long)(i / 3), "xyz"[i % 3],
                             isnan(points->xyz[i]) ? "NaN" : "infinite");
        }
    }
    return 0;
}

static int read_source(const struct host_source *source, host_reader *reader,
                       struct host_points *points, struct host_error *error)
{
    struct host_mesh mesh = {.points = points};
    reader(source, &mesh, error);
    if (error->code == 0 && points->count == 0) {
        host_source_fail(source, error,
                         "the file holds no point; give one with points");
    }
    if (error->code == 0) {
        check_finite(source->path, points, error);
    }
    if (error->code != 0) {
        host_points_free(points);
    }
    return error->code;
}

int host_points_read(const char *path, struct host_points *points,
                     struct host_error *error)
{
    *points = (struct host_points){0};
    host_reader *reader = reader_of(path);
    if (reader == NULL) {
        return unknown_format(path, error);
    }
    struct host_source source;
    if (host_source_open(&source, path, error) == 0) {
        read_source(&source, reader, points, error);
        host_source_close(&source);
    }
    return error->code;
}

int host_points_parse(const char *path, const void *data, size_t bytes,
                      struct host_points *points, struct host_error *error)
{
    *points = (struct host_points){0};
    host_reader *reader = reader_of(path);
    if (reader == NULL) {
        return unknown_format(path, error);
    }
    struct host_source source;
    if (host_source_wrap(&source, path, data, bytes, error) == 0) {
        read_source(&source, reader, points, error);
        host_source_close(&source);
    }
    return error->code;
}

int host_points_append(struct host_points *points, const double *xyz,
                       uint64_t rows, struct host_error *error)
{
    const size_t row = 3 * sizeof *points->xyz;
    if (points->count + rows >= UINT32_MAX) {
        return host_fail(error, HOST_INPUT,
                         "host: more points than row numbers of 32 bits "
                         "allow; split the input");
    }
    if (points->capacity - points->count < rows) {
        uint64_t capacity = points->capacity * 3 / 2 + rows + 1024;
        void *grown =
            host_remap(points->xyz, points->capacity * row, capacity * row);
        if (grown == NULL) {
            return host_fail_memory(error, "the points");
        }
        points->xyz = grown;
        points->capacity = capacity;
    }
    memcpy(points->xyz + 3 * points->count, xyz, rows * row);
    points->count += rows;
    return 0;
}

void host_points_free(struct host_points *points)
{
    host_unmap(points->xyz, points->capacity * 3 * sizeof *points->xyz);
    *points = (struct host_points){0};
}
