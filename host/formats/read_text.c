/* Points as text: .xyz .txt .csv, TetGen's .node, .off. */
#include <limits.h>
#include <string.h>

#include "read_csv.h"
#include "readers.h"
#include "scan.h"

enum next { NEXT_FIELD, NEXT_EMPTY, NEXT_NONE };

/* Goes to the next field of the line; one with more than `most` delimiters
 * before it comes after an empty one. */
static enum next go_to_field(struct host_scan *s, unsigned most)
{
    const char *c = s->at;
    for (unsigned delimiters = 0; c < s->end; c++) {
        if (*c == ',' || *c == ';') {
            if (++delimiters > most) {
                s->at = c;
                return NEXT_EMPTY;
            }
        } else if (*c != ' ' && *c != '\t' && *c != '\r') {
            s->at = c;
            return *c == '\n' || *c == '#' ? NEXT_NONE : NEXT_FIELD;
        }
    }
    s->at = c;
    return NEXT_NONE;
}

static int wrong_columns(struct host_scan *s, int columns, enum next next,
                         struct host_error *error)
{
    static const char *const few[] = {
        "", "1 column where x, y and z are due; complete the line",
        "2 columns where x, y and z are due; complete the line"};
    return host_scan_fail(s, s->at, error,
                          next == NEXT_EMPTY ? HOST_CSV_EMPTY
                          : columns == 3
                              ? "more than 3 columns; leave only x, y and z"
                              : few[columns]);
}

/* Three numbers and no more on a line; in a .csv no field is empty. */
static int take_three(struct host_scan *s, bool is_csv, double xyz[3],
                      struct host_error *error)
{
    unsigned most = is_csv ? 1 : UINT_MAX;
    if (is_csv && host_csv_begins_empty(s)) {
        return wrong_columns(s, 0, NEXT_EMPTY, error);
    }
    for (int d = 0; d < 3; d++) {
        if (host_scan_double(s, &xyz[d], error) != 0) {
            return error->code;
        }
        enum next next = go_to_field(s, most);
        if (next != (d < 2 ? NEXT_FIELD : NEXT_NONE)) {
            return wrong_columns(s, d + 1, next, error);
        }
    }
    return 0;
}

int host_read_xyz(const struct host_source *source, struct host_mesh *mesh,
                  struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    struct host_csv csv = {0};
    bool is_csv = host_is_csv(source->path);
    if (is_csv && host_csv_header(&csv, &s, error) != 0) {
        return error->code;
    }
    while (host_scan_skip_blank_lines(&s)) {
        double xyz[3];
        int status = csv.fields > 0 ? host_csv_row(&csv, &s, xyz, error)
                                    : take_three(&s, is_csv, xyz, error);
        if (status != 0 || host_points_append(mesh->points, xyz, 1, error)) {
            return error->code;
        }
    }
    return 0;
}

int host_read_node(const struct host_source *source, struct host_mesh *mesh,
                   struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    uint64_t count, dimensions, base = 0;
    if (host_scan_unsigned(&s, UINT32_MAX - 1, &count, error) != 0 ||
        host_scan_unsigned(&s, UINT32_MAX, &dimensions, error) != 0) {
        return error->code;
    }
    if (dimensions != 3) {
        return host_scan_fail(&s, s.at, error,
                              "the points have not 3 dimensions; give a .node "
                              "of 3");
    }
    host_scan_next_line(&s);
    for (uint64_t i = 0; i < count; i++) {
        uint64_t number;
        if (host_scan_unsigned(&s, UINT32_MAX, &number, error) != 0) {
            return error->code;
        }
        base = i == 0 ? number : base;
        if (number != base + i || base > 1) {
            return host_scan_fail(&s, s.at, error,
                                  "points are not numbered from 0 or 1 on "
                                  "without gaps; renumber them");
        }
        double xyz[3];
        for (int d = 0; d < 3; d++) {
            if (host_scan_double(&s, &xyz[d], error) != 0) {
                return error->code;
            }
        }
        host_scan_next_line(&s); /* attributes and boundary marker */
        if (host_points_append(mesh->points, xyz, 1, error) != 0) {
            return error->code;
        }
    }
    mesh->points->base = (uint32_t)base;
    return host_scan_end(&s, error,
                         "a row beyond the number of points in the first "
                         "line; correct that number, or remove the row");
}

/* The faces after the vertices, for their number and that of the vertices. */
static int skip_faces(struct host_scan *s, uint64_t faces, uint64_t vertices,
                      struct host_error *error)
{
    for (; faces > 0; faces--) {
        uint64_t corners, vertex;
        if (!host_scan_skip_blank_lines(s)) {
            return host_scan_fail(s, s->at, error,
                                  "the file has fewer vertices or faces than "
                                  "it begins with; correct these numbers, or "
                                  "get it whole");
        }
        if (host_scan_unsigned(s, UINT32_MAX, &corners, error) != 0) {
            return error->code;
        }
        for (; corners > 0; corners--) {
            if (host_scan_unsigned(s, vertices - 1, &vertex, error) != 0) {
                return error->code;
            }
        }
        host_scan_next_line(s); /* colours */
    }
    return host_scan_end(s, error,
                         "a row beyond the numbers of vertices and faces that "
                         "the file begins with; correct them, or remove it");
}

/* A vertex, and how many numbers the line has: normals and colours follow. */
static int take_vertex(struct host_scan *s, double xyz[3], uint64_t *columns,
                       struct host_error *error)
{
    char word[8];
    *columns = 3;
    if (host_scan_double_anywhere(s, &xyz[0], error) != 0 ||
        host_scan_double(s, &xyz[1], error) != 0 ||
        host_scan_double(s, &xyz[2], error) != 0) {
        return error->code;
    }
    for (; host_scan_more(s); ++*columns) {
        host_scan_word(s, word, sizeof word);
    }
    return 0;
}

int host_read_off(const struct host_source *source, struct host_mesh *mesh,
                  struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    if (!host_scan_skip_blank_lines(&s) ||
        !(host_scan_take(&s, "OFF") || host_scan_take(&s, "COFF") ||
          host_scan_take(&s, "NOFF") || host_scan_take(&s, "CNOFF"))) {
        return host_scan_fail(&s, s.at, error,
                              "the first word is not OFF; give a text file in "
                              "that format");
    }
    if (host_scan_take(&s, "BINARY")) {
        return host_scan_fail(&s, s.at, error,
                              "binary OFF is not read; convert it to text");
    }
    uint64_t count, faces;
    if (host_scan_unsigned(&s, UINT32_MAX - 1, &count, error) != 0 ||
        host_scan_unsigned(&s, UINT64_MAX / 16, &faces, error) != 0) {
        return error->code;
    }
    host_scan_next_line(&s);
    for (uint64_t i = 0, first = 0; i < count; i++) {
        uint64_t columns;
        double xyz[3];
        if (take_vertex(&s, xyz, &columns, error) != 0) {
            return error->code;
        }
        first = i == 0 ? columns : first;
        if (columns != first) {
            return host_scan_fail(&s, s.at, error,
                                  "a vertex with more or fewer numbers than "
                                  "the first; correct it, or the number of "
                                  "vertices");
        }
        if (host_points_append(mesh->points, xyz, 1, error) != 0) {
            return error->code;
        }
    }
    return skip_faces(&s, faces, count, error);
}
