#include "read.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>

#include "formats.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/progress.h"

static const struct host_format *format_of(const char *path, enum host_use use,
                                           const char *what,
                                           struct host_error *error) {
    char list[HOST_FORMAT_LIST_MAX];
    const struct host_format *format = host_format_of(path, use);
    const struct host_format *named = host_format_named(path);
    struct stat status;
    if (format == NULL && stat(path, &status) == 0 && S_ISDIR(status.st_mode)) {
        host_fail(error, HOST_INPUT, "%s: it is a directory; name a file in it",
                  path);
    } else if (named != NULL && named->unread != NULL) {
        host_fail(error, HOST_INPUT, "%s: %s", path, named->unread);
    } else if (format == NULL) {
        host_format_list(use, list, sizeof list);
        host_fail(error, HOST_INPUT,
                  "%s: no format of %s has this extension%s; use %s, or any of "
                  "them with .gz%s",
                  path, what,
                  named == NULL             ? ""
                  : use == HOST_READ_POINTS ? ", which tetrahedra have"
                                            : ", which points have",
                  list,
                  use == HOST_READ_POINTS ? ", or say which with --format"
                                          : "");
    }
    return format;
}

static int check_finite(const char *path, const struct host_points *points,
                        struct host_error *error) {
    enum { BLOCK = 1 << 13 };
    for (uint64_t i = 0; i < 3 * points->count; i++) {
        if (i % BLOCK == 0)
            host_call_trim(BLOCK * sizeof *points->xyz);
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

/* Whether it is text whose lines end in CR alone: the first CR is before the
 * first LF, and not right before it. */
static bool ends_in_cr(const struct host_source *source) {
    const uint8_t *data = source->data, *end = data + source->bytes;
    const uint8_t *lf = memchr(data, '\n', source->bytes);
    const uint8_t *cr =
        memchr(data, '\r', (size_t)((lf == NULL ? end : lf) - data));
    while (cr != NULL && cr < end && *cr == '\r')
        cr++;
    return cr != NULL && cr < end && cr != lf &&
           memchr(data, '\0', source->bytes) == NULL;
}

/* What is certainly of a format that is not read, whatever its name says. */
static int refuse_unread(const struct host_source *source,
                         struct host_error *error) {
    const struct host_format *format =
        host_format_recognised(source->data, source->bytes);
    return format == NULL ? 0 : host_source_fail(source, error, format->unread);
}

/* Refuses what is not read, and replaces such CRs by LFs, in the file's own
 * bytes or, if the bytes are the caller's, in a copy.  The file is held
 * whole if its lines end so, or if its format needs that. */
static int prepare(struct host_source *source, const struct host_format *format,
                   struct host_error *error) {
    enum { PIECE = 1 << 16 };
    if (refuse_unread(source, error) != 0)
        return error->code;
    bool mends = ends_in_cr(source);
    if ((mends || !format->pieces) && host_source_hold(source, error) != 0)
        return error->code;
    if (!mends)
        return 0;
    if (source->owned == NULL) {
        source->owned = host_map(source->bytes);
        if (source->owned == NULL)
            return host_fail_memory(error, source->path);
        source->capacity = source->bytes;
        memcpy(source->owned, source->data, source->bytes);
        source->data = source->owned;
    }
    char *text = source->owned;
    for (size_t i = 0; i < source->bytes; i++) {
        bool alone =
            i + 1 == source->bytes || strchr("\r\n", text[i + 1]) == NULL;
        if (i % PIECE == 0)
            host_call_trim(PIECE);
        text[i] = text[i] == '\r' && alone ? '\n' : text[i];
    }
    return 0;
}

static int take_points(struct host_source *source,
                       const struct host_format *format,
                       struct host_points *points, struct host_error *error) {
    struct host_mesh mesh = {.points = points};
    if (prepare(source, format, error) == 0) {
        host_progress_phase("reading", "Mpoint");
        format->read_points(source, &mesh, error);
        host_source_fault(source, error);
    }
    if (error->code == 0 && points->count == 0) {
        host_source_fail(source, error,
                         "the file holds no point; give one with points");
    }
    if (error->code == 0)
        check_finite(source->path, points, error);
    if (error->code != 0)
        host_points_free(points);
    host_source_close(source);
    return error->code;
}

int host_points_read_as(const char *path, const char *format,
                        struct host_points *points, struct host_error *error) {
    struct host_source source;
    *points = (struct host_points){0};
    const struct host_format *f =
        format == NULL ? format_of(path, HOST_READ_POINTS, "points", error)
                       : host_format_told(format, HOST_READ_POINTS, error);
    bool packed =
        host_is_packed(path) || (format != NULL && host_is_packed(format));
    if (f != NULL && host_source_begin(&source, path, packed, error) == 0)
        take_points(&source, f, points, error);
    return error->code;
}

int host_points_read(const char *path, struct host_points *points,
                     struct host_error *error) {
    return host_points_read_as(path, NULL, points, error);
}

void host_points_note(const char *path, const struct host_points *points) {
    const char *name = strcmp(path, "-") == 0 ? "stdin" : path;
    if (points->named)
        host_note("%s: its first line is taken for names of columns", name);
    if (points->wide) {
        host_note("%s: the first three columns are x, y and z; those after "
                  "them are passed over%s",
                  name,
                  points->doubtful ? " (if its commas are decimal ones, write "
                                     "decimal points instead)"
                                   : "");
    }
}

int host_points_parse(const char *path, const void *data, size_t bytes,
                      struct host_points *points, struct host_error *error) {
    struct host_source source;
    *points = (struct host_points){0};
    const struct host_format *format =
        format_of(path, HOST_READ_POINTS, "points", error);
    if (format != NULL &&
        host_source_wrap(&source, path, data, bytes, error) == 0)
        take_points(&source, format, points, error);
    return error->code;
}

static const struct host_format *start(const char *path,
                                       struct host_tetrahedra *tets,
                                       struct host_points *points,
                                       struct host_error *error) {
    *tets = (struct host_tetrahedra){0};
    if (points != NULL)
        *points = (struct host_points){0};
    return format_of(path, HOST_READ_TETRAHEDRA, "tetrahedra", error);
}

static int take_tetrahedra(struct host_source *source,
                           const struct host_format *format,
                           struct host_tetrahedra *tets,
                           struct host_points *points,
                           struct host_error *error) {
    struct host_mesh mesh = {.points = points, .tets = tets};
    if (prepare(source, format, error) == 0) {
        format->read_tetrahedra(source, &mesh, error);
        host_source_fault(source, error);
    }
    if (error->code != 0) {
        host_tetrahedra_free(tets);
        if (points != NULL)
            host_points_free(points);
    }
    host_source_close(source);
    return error->code;
}

int host_tetrahedra_read(const char *path, struct host_tetrahedra *tets,
                         struct host_points *points, struct host_error *error) {
    struct host_source source;
    const struct host_format *format = start(path, tets, points, error);
    if (format != NULL &&
        host_source_begin(&source, path, host_is_packed(path), error) == 0)
        take_tetrahedra(&source, format, tets, points, error);
    return error->code;
}

int host_tetrahedra_parse(const char *path, const void *data, size_t bytes,
                          struct host_tetrahedra *tets,
                          struct host_points *points,
                          struct host_error *error) {
    struct host_source source;
    const struct host_format *format = start(path, tets, points, error);
    if (format != NULL &&
        host_source_wrap(&source, path, data, bytes, error) == 0)
        take_tetrahedra(&source, format, tets, points, error);
    return error->code;
}

int host_rows_check(const char *path, const struct host_tetrahedra *tets,
                    const struct host_points *points,
                    struct host_error *error) {
    enum { BLOCK = 1 << 12 };
    for (uint64_t i = 0; i < tets->count; i++) {
        if (i % BLOCK == 0)
            host_call_trim(BLOCK * sizeof *tets->v);
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

/* --- stream --------------------------------------------------------------- */

static int at_end(const struct host_stream *s, struct host_error *error) {
    return host_source_fail(s->source, error,
                            "the file ends within its numbers; it is cut "
                            "short, get it whole");
}

int host_stream_next(struct host_stream *s, double *value,
                     struct host_error *error) {
    if (s->text)
        return host_scan_double_anywhere(&s->scan, value, error);
    size_t bytes = host_number_bytes(s->type);
    if ((size_t)(s->end - s->at) < bytes)
        return at_end(s, error);
    *value = host_number_at(s->at, s->type, s->big);
    s->at += bytes;
    return 0;
}

int host_stream_whole(struct host_stream *s, uint64_t *value,
                      struct host_error *error) {
    if (s->text)
        return host_scan_unsigned(&s->scan, UINT64_MAX - 1, value, error);
    size_t bytes = host_number_bytes(s->type);
    if ((size_t)(s->end - s->at) < bytes)
        return at_end(s, error);
    *value = host_whole_at(s->at, s->type, s->big);
    s->at += bytes;
    return *value == UINT64_MAX
               ? host_source_fail(s->source, error,
                                  "a number is negative where none may be; "
                                  "the file is damaged, get it again")
               : 0;
}

int host_stream_skip(struct host_stream *s, uint64_t count,
                     struct host_error *error) {
    if (s->text) {
        double skipped;
        for (; count > 0; count--)
            if (host_scan_double_anywhere(&s->scan, &skipped, error) != 0)
                return error->code;
        return 0;
    }
    size_t bytes = host_number_bytes(s->type);
    if ((size_t)(s->end - s->at) / bytes < count)
        return at_end(s, error);
    s->at += (size_t)count * bytes;
    return 0;
}

bool host_stream_ended(struct host_stream *s) {
    return s->text ? !host_scan_skip_blank_lines(&s->scan) : s->at == s->end;
}

int host_stream_points(struct host_stream *s, uint64_t rows,
                       struct host_points *points, struct host_error *error) {
    if (!s->text) {
        size_t row = 3 * host_number_bytes(s->type);
        if ((size_t)(s->end - s->at) / row < rows)
            return at_end(s, error);
        const uint8_t *from = s->at;
        s->at += (size_t)rows * row;
        return host_append_numbers(points, from, rows, row, s->type, s->big,
                                   error);
    }
    for (; rows > 0; rows--) {
        double xyz[3];
        for (int d = 0; d < 3; d++)
            if (host_stream_next(s, &xyz[d], error) != 0)
                return error->code;
        if (host_points_append(points, xyz, 1, error) != 0)
            return error->code;
    }
    return 0;
}

/* VTK's numbers for cells. */
enum { VTK_QUAD = 9, VTK_TETRA = 10 };

static int take_cell(struct host_stream *connectivity, uint64_t size,
                     uint64_t type, uint64_t first,
                     struct host_tetrahedra *tets, struct host_error *error) {
    if (type <= VTK_QUAD) /* as numbered, all cells without volume */
        return host_stream_skip(connectivity, size, error);
    if (type != VTK_TETRA || size != 4) {
        return host_fail(error, HOST_INPUT,
                         "%s: cell %llu is no tetrahedron of 4 vertices "
                         "(type %llu); leave only tetrahedra",
                         connectivity->source->path,
                         (unsigned long long)tets->count,
                         (unsigned long long)type);
    }
    uint64_t v[4] = {0};
    for (int k = 0; k < 4; k++) {
        if (host_stream_whole(connectivity, &v[k], error) != 0)
            return error->code;
        v[k] = v[k] < UINT32_MAX ? v[k] + first : UINT32_MAX;
    }
    return host_append_tetrahedron(tets, v, connectivity->source, error);
}

int host_stream_cells(struct host_stream *connectivity,
                      struct host_stream *offsets, struct host_stream *types,
                      uint64_t cells, uint64_t first,
                      struct host_tetrahedra *tets, struct host_error *error) {
    uint64_t from = 0;
    for (; cells > 0; cells--) {
        uint64_t type = 0, size = 0;
        if (host_stream_whole(types, &type, error) != 0 ||
            host_stream_whole(offsets == NULL ? connectivity : offsets, &size,
                              error) != 0)
            return error->code;
        if (offsets != NULL) { /* where the cell ends */
            uint64_t to = size;
            if (to < from) {
                return host_source_fail(connectivity->source, error,
                                        "the offsets of cells fall; the file "
                                        "is damaged, get it again");
            }
            size = to - from;
            from = to;
        }
        if (take_cell(connectivity, size, type, first, tets, error) != 0)
            return error->code;
    }
    return 0;
}
