/* Geomview's .off, as text: its vertices are the points, its faces are passed
 * over. */
#include "format.h"
#include "rows.h"
#include "scan.h"

/* The faces after the vertices, for their number and that of the vertices. */
static int skip_faces(struct host_scan *s, uint64_t faces, uint64_t vertices,
                      struct host_error *error) {
    for (; faces > 0; faces--) {
        uint64_t corners, vertex;
        if (!host_scan_skip_blank_lines(s)) {
            return host_scan_fail(s, s->at, error,
                                  "the file has fewer vertices or faces than "
                                  "it begins with; correct these numbers, or "
                                  "get it whole");
        }
        if (host_scan_unsigned(s, UINT32_MAX, &corners, error) != 0)
            return error->code;
        for (; corners > 0; corners--)
            if (host_scan_unsigned(s, vertices - 1, &vertex, error) != 0)
                return error->code;
        host_scan_next_line(s); /* colours */
    }
    return host_scan_end(s, error,
                         "a row beyond the numbers of vertices and faces that "
                         "the file begins with; correct them, or remove it");
}

/* A vertex, and how many numbers the line has: normals and colours follow. */
static int take_vertex(struct host_scan *s, double xyz[3], uint64_t *columns,
                       struct host_error *error) {
    char word[8];
    *columns = 3;
    if (host_scan_double_anywhere(s, &xyz[0], error) != 0 ||
        host_scan_double(s, &xyz[1], error) != 0 ||
        host_scan_double(s, &xyz[2], error) != 0)
        return error->code;
    for (; host_scan_more(s); ++*columns)
        host_scan_word(s, word, sizeof word);
    return 0;
}

static int read_off(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct host_scan s = host_scan_source(source);
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
        host_scan_unsigned(&s, UINT64_MAX / 16, &faces, error) != 0)
        return error->code;
    host_scan_next_line(&s);
    for (uint64_t i = 0, first = 0; i < count; i++) {
        uint64_t columns;
        double xyz[3];
        if (take_vertex(&s, xyz, &columns, error) != 0)
            return error->code;
        first = i == 0 ? columns : first;
        if (columns != first) {
            return host_scan_fail(&s, s.at, error,
                                  "a vertex with more or fewer numbers than "
                                  "the first; correct it, or the number of "
                                  "vertices");
        }
        if (host_points_append(mesh->points, xyz, 1, error) != 0)
            return error->code;
    }
    return skip_faces(&s, faces, count, error);
}

static void write_off(struct host_output *out,
                      const struct host_points *points) {
    host_put_line(out, "OFF\n", points->count, " 0 0\n");
    host_put_points(out, points, " ", false);
}

const struct host_format host_format_off = {
    .name = "Geomview",
    .extensions = {".off"},
    .read_points = read_off,
    .pieces = true,
    .write_points = write_off,
};
