#include "stream.h"

static int at_end(const struct host_stream *s, struct host_error *error) {
    return host_source_fail(s->source, error,
                            "the file ends within its numbers; it is cut "
                            "short, get it whole");
}

int host_stream_next(struct host_stream *s, double *value,
                     struct host_error *error) {
    if (s->text) {
        return host_scan_double_anywhere(&s->scan, value, error);
    }
    size_t bytes = host_number_bytes(s->type);
    if ((size_t)(s->end - s->at) < bytes) {
        return at_end(s, error);
    }
    *value = host_number_at(s->at, s->type, s->big);
    s->at += bytes;
    return 0;
}

int host_stream_whole(struct host_stream *s, uint64_t *value,
                      struct host_error *error) {
    if (s->text) {
        return host_scan_unsigned(&s->scan, UINT64_MAX - 1, value, error);
    }
    size_t bytes = host_number_bytes(s->type);
    if ((size_t)(s->end - s->at) < bytes) {
        return at_end(s, error);
    }
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
        for (; count > 0; count--) {
            if (host_scan_double_anywhere(&s->scan, &skipped, error) != 0) {
                return error->code;
            }
        }
        return 0;
    }
    size_t bytes = host_number_bytes(s->type);
    if ((size_t)(s->end - s->at) / bytes < count) {
        return at_end(s, error);
    }
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
        if ((size_t)(s->end - s->at) / row < rows) {
            return at_end(s, error);
        }
        const uint8_t *from = s->at;
        s->at += (size_t)rows * row;
        return host_append_numbers(points, from, rows, row, s->type, s->big,
                                   error);
    }
    for (; rows > 0; rows--) {
        double xyz[3];
        for (int d = 0; d < 3; d++) {
            if (host_stream_next(s, &xyz[d], error) != 0) {
                return error->code;
            }
        }
        if (host_points_append(points, xyz, 1, error) != 0) {
            return error->code;
        }
    }
    return 0;
}

/* VTK's numbers for cells. */
enum { VTK_QUAD = 9, VTK_TETRA = 10 };

static int take_cell(struct host_stream *connectivity, uint64_t size,
                     uint64_t type, uint64_t first,
                     struct host_tetrahedra *tets, struct host_error *error) {
    if (type <= VTK_QUAD) { /* as numbered, all cells without volume */
        return host_stream_skip(connectivity, size, error);
    }
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
        if (host_stream_whole(connectivity, &v[k], error) != 0) {
            return error->code;
        }
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
                              error) != 0) {
            return error->code;
        }
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
        if (take_cell(connectivity, size, type, first, tets, error) != 0) {
            return error->code;
        }
    }
    return 0;
}
