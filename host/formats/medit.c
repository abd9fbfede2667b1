/* Medit's .mesh, as text.  Sections other than vertices and tetrahedra are left
 * out. */
#include "format.h"
#include "rows.h"
#include "scan.h"

static int medit_vertices(struct host_scan *s, struct host_mesh *mesh,
                          struct host_error *error) {
    uint64_t count;
    if (host_scan_unsigned(s, UINT32_MAX - 1, &count, error) != 0)
        return error->code;
    for (; count > 0; count--) {
        double xyz[3], reference;
        for (int d = 0; d < 3; d++)
            if (host_scan_double_anywhere(s, &xyz[d], error) != 0)
                return error->code;
        if (host_scan_double(s, &reference, error) != 0 ||
            (mesh->points != NULL &&
             host_points_append(mesh->points, xyz, 1, error) != 0))
            return error->code;
    }
    return host_take_section_end(s, error);
}

static int medit_tetrahedra(const struct host_source *source,
                            struct host_scan *s, struct host_mesh *mesh,
                            struct host_error *error) {
    uint64_t count;
    if (host_scan_unsigned(s, UINT64_MAX / 64, &count, error) != 0)
        return error->code;
    for (; count > 0; count--) {
        uint64_t v[5]; /* the fifth is a reference */
        for (int k = 0; k < 5; k++)
            if (host_scan_unsigned(s, UINT64_MAX / 16, &v[k], error) != 0)
                return error->code;
        if (host_take_element(mesh, v, 1, source, s, error) != 0)
            return error->code;
    }
    return host_take_section_end(s, error);
}

static int read_mesh(const struct host_source *source, struct host_mesh *mesh,
                     struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    bool any = false;
    if (!host_scan_skip_blank_lines(&s) ||
        !host_scan_take(&s, "MeshVersionFormatted")) {
        return host_scan_fail(&s, s.at, error,
                              "the first word is not MeshVersionFormatted; "
                              "give a Medit file in text");
    }
    host_scan_next_line(&s);
    while (host_scan_skip_blank_lines(&s)) {
        if (host_scan_take(&s, "Vertices")) {
            medit_vertices(&s, mesh, error);
        } else if (host_scan_take(&s, "Tetrahedra")) {
            medit_tetrahedra(source, &s, mesh, error);
            any = true;
        } else { /* another section: its lines are passed over */
            host_scan_next_line(&s);
        }
        if (error->code != 0)
            return error->code;
    }
    return any ? 0
               : host_source_fail(source, error,
                                  "there is no Tetrahedra section; the file "
                                  "is cut short or no mesh of them");
}

static void put_head(struct host_output *out,
                     const struct host_points *points) {
    host_output_text(out, "MeshVersionFormatted 2\nDimension 3\nVertices\n");
    host_output_unsigned(out, points->count);
    host_output_text(out, "\n");
    for (uint64_t i = 0; i < points->count; i++) {
        host_put_xyz(out, points->xyz + 3 * i);
        host_output_text(out, " 0\n");
    }
    host_output_text(out, "Tetrahedra\n");
}

static void put_tetrahedra(struct host_output *out, const uint32_t (*v)[4],
                           uint64_t n, uint64_t first) {
    (void)first;
    for (uint64_t i = 0; i < n; i++) {
        for (int k = 0; k < 4; k++) {
            host_output_unsigned(out, v[i][k] + UINT64_C(1));
            host_output_text(out, " ");
        }
        host_output_text(out, "0\n");
    }
}

static void put_tail(struct host_output *out) {
    host_output_text(out, "End\n");
}

static const struct host_row_writer mesh_rows = {put_head, host_put_count,
                                                 put_tetrahedra, put_tail};

static int write_mesh(struct host_output *out, struct host_output *beside,
                      const struct host_points *points,
                      const struct host_tetrahedra *tets,
                      struct host_error *error) {
    (void)beside;
    host_put_rows(out, &mesh_rows, points, tets);
    return error->code;
}

const struct host_format host_format_mesh = {
    .name = "Medit",
    .extensions = {".mesh"},
    .read_tetrahedra = read_mesh,
    .pieces = true,
    .write_tetrahedra = write_mesh,
    .rows = &mesh_rows,
};
