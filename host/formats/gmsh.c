/* Gmsh's .msh, version 2, as text.  Elements other than tetrahedra are left
 * out. */
#include "format.h"
#include "rows.h"
#include "scan.h"

static int msh_format(struct host_scan *s, struct host_error *error) {
    double version;
    uint64_t binary;
    if (host_scan_double_anywhere(s, &version, error) != 0 ||
        host_scan_unsigned(s, 1, &binary, error) != 0)
        return error->code;
    if (!(version >= 2 && version < 3) || binary != 0) {
        return host_scan_fail(s, s->at, error,
                              "only text files of version 2 are read; save "
                              "with Mesh.MshFileVersion = 2.2");
    }
    return 0;
}

static int msh_nodes(struct host_scan *s, struct host_mesh *mesh,
                     struct host_error *error) {
    uint64_t count;
    if (host_scan_unsigned(s, UINT32_MAX - 1, &count, error) != 0)
        return error->code;
    for (uint64_t i = 0; i < count; i++) {
        uint64_t number;
        double xyz[3];
        if (host_scan_unsigned(s, UINT32_MAX, &number, error) != 0)
            return error->code;
        if (number != i + 1) {
            return host_scan_fail(s, s->at, error,
                                  "nodes are not numbered from 1 on without "
                                  "gaps; renumber the mesh");
        }
        for (int d = 0; d < 3; d++)
            if (host_scan_double(s, &xyz[d], error) != 0)
                return error->code;
        if (mesh->points != NULL &&
            host_points_append(mesh->points, xyz, 1, error) != 0)
            return error->code;
    }
    host_scan_next_line(s);
    return host_take_section_end(s, error);
}

/* A whole number of the row at hand: a row that is short takes none of the
 * next. */
static int msh_number(struct host_scan *s, uint64_t most, uint64_t *value,
                      struct host_error *error) {
    return host_scan_more(s)
               ? host_scan_unsigned(s, most, value, error)
               : host_scan_fail(s, s->at, error,
                                "an element with fewer numbers than its type "
                                "and tags have; complete the line");
}

static int msh_elements(const struct host_source *source, struct host_scan *s,
                        struct host_mesh *mesh, struct host_error *error) {
    enum { TETRAHEDRON = 4 };
    uint64_t count;
    if (host_scan_unsigned(s, UINT64_MAX / 64, &count, error) != 0)
        return error->code;
    for (; count > 0; count--) {
        uint64_t number, type = 0, tags = 0, v[4];
        if (host_scan_unsigned(s, UINT64_MAX / 16, &number, error) != 0 ||
            msh_number(s, UINT32_MAX, &type, error) != 0 ||
            msh_number(s, 64, &tags, error) != 0)
            return error->code;
        if (type != TETRAHEDRON) {
            host_scan_next_line(s);
            continue;
        }
        for (; tags > 0; tags--)
            if (msh_number(s, UINT64_MAX / 16, &number, error) != 0)
                return error->code;
        for (int k = 0; k < 4; k++)
            if (msh_number(s, UINT64_MAX / 16, &v[k], error) != 0)
                return error->code;
        if (host_take_element(mesh, v, 1, source, s, error) != 0)
            return error->code;
    }
    return host_take_section_end(s, error);
}

static int read_msh(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    bool any = false;
    while (host_scan_skip_blank_lines(&s)) {
        if (host_scan_take(&s, "$MeshFormat")) {
            msh_format(&s, error);
        } else if (host_scan_take(&s, "$Nodes")) {
            msh_nodes(&s, mesh, error);
        } else if (host_scan_take(&s, "$Elements")) {
            msh_elements(source, &s, mesh, error);
            any = true;
        } else {
            host_scan_next_line(&s);
        }
        if (error->code != 0)
            return error->code;
    }
    return any ? 0
               : host_source_fail(source, error,
                                  "there is no $Elements section; the file is "
                                  "cut short or no Gmsh mesh");
}

static void put_head(struct host_output *out,
                     const struct host_points *points) {
    host_output_text(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n");
    host_output_unsigned(out, points->count);
    host_output_text(out, "\n");
    for (uint64_t i = 0; i < points->count; i++) {
        host_output_unsigned(out, i + 1);
        host_output_text(out, " ");
        host_put_xyz(out, points->xyz + 3 * i);
        host_output_text(out, "\n");
    }
    host_output_text(out, "$EndNodes\n$Elements\n");
}

static void put_elements(struct host_output *out, const uint32_t (*v)[4],
                         uint64_t n, uint64_t first) {
    for (uint64_t i = 0; i < n; i++) {
        host_output_unsigned(out, first + i + 1);
        host_output_text(out, " 4 2 1 1");
        host_put_row(out, v[i], 4, 1);
        host_output_text(out, "\n");
    }
}

static void put_tail(struct host_output *out) {
    host_output_text(out, "$EndElements\n");
}

static const struct host_row_writer msh_rows = {put_head, host_put_count,
                                                put_elements, put_tail};

static int write_msh(struct host_output *out, struct host_output *beside,
                     const struct host_points *points,
                     const struct host_tetrahedra *tets,
                     struct host_error *error) {
    (void)beside;
    host_put_rows(out, &msh_rows, points, tets);
    return error->code;
}

const struct host_format host_format_msh = {
    .name = "Gmsh",
    .extensions = {".msh"},
    .read_tetrahedra = read_msh,
    .pieces = true,
    .write_tetrahedra = write_msh,
    .rows = &msh_rows,
};
