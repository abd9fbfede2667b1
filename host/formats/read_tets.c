/* Tetrahedra as text: TetGen's .ele, Gmsh's .msh (version 2), Medit's .mesh.
 * Other kinds of element are left out. */
#include <ctype.h>
#include <string.h>

#include "readers.h"
#include "scan.h"

/* The tetrahedron on the line that is being read. */
static int append(struct host_mesh *mesh, const uint64_t number[4],
                  uint64_t base, const struct host_source *source,
                  const struct host_scan *s, struct host_error *error)
{
    uint64_t v[4];
    for (int k = 0; k < 4; k++) {
        v[k] = number[k] - base;
        if (number[k] < base || v[k] >= UINT32_MAX) {
            return host_scan_fail(s, s->at, error,
                                  "a vertex of this tetrahedron is no row of "
                                  "points; correct it");
        }
    }
    return mesh->tets == NULL
               ? 0
               : host_append_tetrahedron(mesh->tets, v, source, error);
}

int host_read_ele(const struct host_source *source, struct host_mesh *mesh,
                  struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    uint64_t count, corners, base = 0;
    if (host_scan_unsigned(&s, UINT64_MAX / 64, &count, error) != 0 ||
        host_scan_unsigned(&s, UINT32_MAX, &corners, error) != 0) {
        return error->code;
    }
    if (corners != 4) {
        return host_scan_fail(&s, s.at, error,
                              "elements of other than 4 vertices; give "
                              "tetrahedra of 4");
    }
    host_scan_next_line(&s);
    for (uint64_t i = 0; i < count; i++) {
        uint64_t number, v[4];
        if (host_scan_unsigned(&s, UINT64_MAX / 16, &number, error) != 0) {
            return error->code;
        }
        base = i == 0 ? number : base;
        if (base > 1 || number != base + i) {
            return host_scan_fail(&s, s.at, error,
                                  "tetrahedra are not numbered from 0 or 1 on "
                                  "without gaps; renumber them");
        }
        for (int k = 0; k < 4; k++) {
            if (!host_scan_more(&s)) {
                return host_scan_fail(&s, s.at, error,
                                      "fewer than 4 vertices; complete the "
                                      "line");
            }
            if (host_scan_unsigned(&s, UINT64_MAX / 16, &v[k], error) != 0) {
                return error->code;
            }
        }
        if (append(mesh, v, base, source, &s, error) != 0) {
            return error->code;
        }
        host_scan_next_line(&s); /* attributes */
    }
    return host_scan_end(&s, error,
                         "a row beyond the number of tetrahedra in the first "
                         "line; correct that number, or remove the row");
}

/* --- Gmsh ------------------------------------------------------------- */

static int msh_format(struct host_scan *s, struct host_error *error)
{
    double version;
    uint64_t binary;
    if (host_scan_double_anywhere(s, &version, error) != 0 ||
        host_scan_unsigned(s, 1, &binary, error) != 0) {
        return error->code;
    }
    if (!(version >= 2 && version < 3) || binary != 0) {
        return host_scan_fail(s, s->at, error,
                              "only text files of version 2 are read; save "
                              "with Mesh.MshFileVersion = 2.2");
    }
    return 0;
}

/* After the rows of a section a word begins the next. */
static int check_section_end(struct host_scan *s, struct host_error *error)
{
    return !host_scan_skip_blank_lines(s) || *s->at == '$' ||
                   isalpha((unsigned char)*s->at)
               ? 0
               : host_scan_fail(s, s->at, error,
                                "a row beyond the number that its section "
                                "begins with; correct that number, or remove "
                                "the row");
}

static int msh_nodes(struct host_scan *s, struct host_mesh *mesh,
                     struct host_error *error)
{
    uint64_t count;
    if (host_scan_unsigned(s, UINT32_MAX - 1, &count, error) != 0) {
        return error->code;
    }
    for (uint64_t i = 0; i < count; i++) {
        uint64_t number;
        double xyz[3];
        if (host_scan_unsigned(s, UINT32_MAX, &number, error) != 0) {
            return error->code;
        }
        if (number != i + 1) {
            return host_scan_fail(s, s->at, error,
                                  "nodes are not numbered from 1 on without "
                                  "gaps; renumber the mesh");
        }
        for (int d = 0; d < 3; d++) {
            if (host_scan_double(s, &xyz[d], error) != 0) {
                return error->code;
            }
        }
        if (mesh->points != NULL &&
            host_points_append(mesh->points, xyz, 1, error) != 0) {
            return error->code;
        }
    }
    host_scan_next_line(s);
    return check_section_end(s, error);
}

/* A whole number of the row at hand: a row that is short takes none of the
 * next. */
static int msh_number(struct host_scan *s, uint64_t most, uint64_t *value,
                      struct host_error *error)
{
    return host_scan_more(s)
               ? host_scan_unsigned(s, most, value, error)
               : host_scan_fail(s, s->at, error,
                                "an element with fewer numbers than its type "
                                "and tags have; complete the line");
}

static int msh_elements(const struct host_source *source, struct host_scan *s,
                        struct host_mesh *mesh, struct host_error *error)
{
    enum { TETRAHEDRON = 4 };
    uint64_t count;
    if (host_scan_unsigned(s, UINT64_MAX / 64, &count, error) != 0) {
        return error->code;
    }
    for (; count > 0; count--) {
        uint64_t number, type = 0, tags = 0, v[4];
        if (host_scan_unsigned(s, UINT64_MAX / 16, &number, error) != 0 ||
            msh_number(s, UINT32_MAX, &type, error) != 0 ||
            msh_number(s, 64, &tags, error) != 0) {
            return error->code;
        }
        if (type != TETRAHEDRON) {
            host_scan_next_line(s);
            continue;
        }
        for (; tags > 0; tags--) {
            if (msh_number(s, UINT64_MAX / 16, &number, error) != 0) {
                return error->code;
            }
        }
        for (int k = 0; k < 4; k++) {
            if (msh_number(s, UINT64_MAX / 16, &v[k], error) != 0) {
                return error->code;
            }
        }
        if (append(mesh, v, 1, source, s, error) != 0) {
            return error->code;
        }
    }
    return check_section_end(s, error);
}

int host_read_msh(const struct host_source *source, struct host_mesh *mesh,
                  struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
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
        if (error->code != 0) {
            return error->code;
        }
    }
    return any ? 0
               : host_source_fail(source, error,
                                  "there is no $Elements section; the file is "
                                  "cut short or no Gmsh mesh");
}

/* --- Medit ------------------------------------------------------------ */

static int medit_vertices(struct host_scan *s, struct host_mesh *mesh,
                          struct host_error *error)
{
    uint64_t count;
    if (host_scan_unsigned(s, UINT32_MAX - 1, &count, error) != 0) {
        return error->code;
    }
    for (; count > 0; count--) {
        double xyz[3], reference;
        for (int d = 0; d < 3; d++) {
            if (host_scan_double_anywhere(s, &xyz[d], error) != 0) {
                return error->code;
            }
        }
        if (host_scan_double(s, &reference, error) != 0 ||
            (mesh->points != NULL &&
             host_points_append(mesh->points, xyz, 1, error) != 0)) {
            return error->code;
        }
    }
    return check_section_end(s, error);
}

static int medit_tetrahedra(const struct host_source *source,
                            struct host_scan *s, struct host_mesh *mesh,
                            struct host_error *error)
{
    uint64_t count;
    if (host_scan_unsigned(s, UINT64_MAX / 64, &count, error) != 0) {
        return error->code;
    }
    for (; count > 0; count--) {
        uint64_t v[5]; /* the fifth is a reference */
        for (int k = 0; k < 5; k++) {
            if (host_scan_unsigned(s, UINT64_MAX / 16, &v[k], error) != 0) {
                return error->code;
            }
        }
        if (append(mesh, v, 1, source, s, error) != 0) {
            return error->code;
        }
    }
    return check_section_end(s, error);
}

int host_read_mesh(const struct host_source *source, struct host_mesh *mesh,
                   struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
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
        if (error->code != 0) {
            return error->code;
        }
    }
    return any ? 0
               : host_source_fail(source, error,
                                  "there is no Tetrahedra section; the file "
                                  "is cut short or no mesh of them");
}

/* --- By extension ----------------------------------------------------- */

static host_reader *reader_of(const char *path)
{
    if (strcmp(path, "-") == 0) {
        return host_read_ele;
    }
    switch (host_format_of(path)) {
    case HOST_ELE:
        return host_read_ele;
    case HOST_MSH:
        return host_read_msh;
    case HOST_MESH:
        return host_read_mesh;
    case HOST_VTK:
        return host_read_vtk;
    case HOST_VTU:
        return host_read_vtkxml;
    case HOST_NPY:
        return host_read_npy;
    default:
        return NULL;
    }
}

static int read_source(const struct host_source *source, host_reader *reader,
                       struct host_tetrahedra *tets, struct host_points *points,
                       struct host_error *error)
{
    struct host_mesh mesh = {.points = points, .tets = tets};
    if (reader(source, &mesh, error) != 0) {
        host_tetrahedra_free(tets);
        if (points != NULL) {
            host_points_free(points);
        }
    }
    return error->code;
}

static int start(const char *path, host_reader *reader,
                 struct host_tetrahedra *tets, struct host_points *points,
                 struct host_error *error)
{
    *tets = (struct host_tetrahedra){0};
    if (points != NULL) {
        *points = (struct host_points){0};
    }
    return reader != NULL
               ? 0
               : host_fail(error, HOST_INPUT,
                           "%s: no format of tetrahedra has this extension; "
                           "use .ele .vtu .vtk .msh .mesh .npy",
                           path);
}

int host_tetrahedra_read(const char *path, struct host_tetrahedra *tets,
                         struct host_points *points, struct host_error *error)
{
    host_reader *reader = reader_of(path);
    struct host_source source;
    if (start(path, reader, tets, points, error) == 0 &&
        host_source_open(&source, path, error) == 0) {
        read_source(&source, reader, tets, points, error);
        host_source_close(&source);
    }
    return error->code;
}

int host_tetrahedra_parse(const char *path, const void *data, size_t bytes,
                          struct host_tetrahedra *tets,
                          struct host_points *points, struct host_error *error)
{
    host_reader *reader = reader_of(path);
    struct host_source source;
    if (start(path, reader, tets, points, error) == 0 &&
        host_source_wrap(&source, path, data, bytes, error) == 0) {
        read_source(&source, reader, tets, points, error);
        host_source_close(&source);
    }
    return error->code;
}
