#include "read.h"

#include <math.h>
#include <string.h>

#include "formats.h"
#include "host/base/progress.h"

static const struct host_format *format_of(const char *path, enum host_use use,
                                           const char *what,
                                           struct host_error *error)
{
    char list[HOST_FORMAT_LIST_MAX];
    const struct host_format *format = host_format_of(path, use);
    const struct host_format *named = host_format_named(path);
    if (named != NULL && named->unread != NULL) {
        host_fail(error, HOST_INPUT, "%s: %s", path, named->unread);
    } else if (format == NULL) {
        host_format_list(use, list, sizeof list);
        host_fail(error, HOST_INPUT,
                  "%s: no format of %s has this extension; use %s, or any of "
                  "them with .gz%s",
                  path, what, list,
                  use == HOST_READ_POINTS ? ", or say which with --format"
                                          : "");
    }
    return format;
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

static int take_points(struct host_source *source,
                       const struct host_format *format,
                       struct host_points *points, struct host_error *error)
{
    struct host_mesh mesh = {.points = points};
    host_progress_phase("reading", "Mpoint");
    if (!format->pieces && host_source_hold(source, error) != 0) {
        return error->code;
    }
    format->read_points(source, &mesh, error);
    host_source_fault(source, error);
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
    host_source_close(source);
    return error->code;
}

int host_points_read_as(const char *path, const char *format,
                        struct host_points *points, struct host_error *error)
{
    struct host_source source;
    *points = (struct host_points){0};
    const struct host_format *f =
        format == NULL ? format_of(path, HOST_READ_POINTS, "points", error)
                       : host_format_told(format, HOST_READ_POINTS, error);
    bool packed =
        host_is_packed(path) || (format != NULL && host_is_packed(format));
    if (f != NULL && host_source_begin(&source, path, packed, error) == 0) {
        take_points(&source, f, points, error);
    }
    return error->code;
}

int host_points_read(const char *path, struct host_points *points,
                     struct host_error *error)
{
    return host_points_read_as(path, NULL, points, error);
}

void host_points_note(const char *path, const struct host_points *points)
{
    if (points->wide) {
        host_note("%s: the first three columns are x, y and z; those after "
                  "them are passed over",
                  strcmp(path, "-") == 0 ? "stdin" : path);
    }
}

int host_points_parse(const char *path, const void *data, size_t bytes,
                      struct host_points *points, struct host_error *error)
{
    struct host_source source;
    *points = (struct host_points){0};
    const struct host_format *format =
        format_of(path, HOST_READ_POINTS, "points", error);
    if (format != NULL &&
        host_source_wrap(&source, path, data, bytes, error) == 0) {
        take_points(&source, format, points, error);
    }
    return error->code;
}

static const struct host_format *start(const char *path,
                                       struct host_tetrahedra *tets,
                                       struct host_points *points,
                                       struct host_error *error)
{
    *tets = (struct host_tetrahedra){0};
    if (points != NULL) {
        *points = (struct host_points){0};
    }
    return format_of(path, HOST_READ_TETRAHEDRA, "tetrahedra", error);
}

static int take_tetrahedra(struct host_source *source,
                           const struct host_format *format,
                           struct host_tetrahedra *tets,
                           struct host_points *points, struct host_error *error)
{
    struct host_mesh mesh = {.points = points, .tets = tets};
    if (!format->pieces && host_source_hold(source, error) != 0) {
        return error->code;
    }
    format->read_tetrahedra(source, &mesh, error);
    if (host_source_fault(source, error) != 0) {
        host_tetrahedra_free(tets);
        if (points != NULL) {
            host_points_free(points);
        }
    }
    host_source_close(source);
    return error->code;
}

int host_tetrahedra_read(const char *path, struct host_tetrahedra *tets,
                         struct host_points *points, struct host_error *error)
{
    struct host_source source;
    const struct host_format *format = start(path, tets, points, error);
    if (format != NULL &&
        host_source_begin(&source, path, host_is_packed(path), error) == 0) {
        take_tetrahedra(&source, format, tets, points, error);
    }
    return error->code;
}

int host_tetrahedra_parse(const char *path, const void *data, size_t bytes,
                          struct host_tetrahedra *tets,
                          struct host_points *points, struct host_error *error)
{
    struct host_source source;
    const struct host_format *format = start(path, tets, points, error);
    if (format != NULL &&
        host_source_wrap(&source, path, data, bytes, error) == 0) {
        take_tetrahedra(&source, format, tets, points, error);
    }
    return error->code;
}

int host_rows_check(const char *path, const struct host_tetrahedra *tets,
                    const struct host_points *points, struct host_error *error)
{
    for (uint64_t i = 0; i < tets->count; i++) {
        for (int k = 0; k < 4; k++) {
            if (tets->v[i][k] >= points->count) {
                return host_fail(error, HOST_INPUT,
                                 "%s: tetrahedron %llu has vertex %u of %llu "
                                 "points; give the points that belong to it",
                                 path, (unsigned long long)i, tets->v[i][k],
                                 (unsigned long long)points->count);
            }
        }
    }
    return 0;
}
