#include "write.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/mesh/adjacency.h"
#include "host/base/memory.h"
#include "host/files/output.h"
#include "host/files/source.h"

static void newline(struct host_output *out)
{
    host_output_bytes(out, "\n", 1);
}

static void blank(struct host_output *out)
{
    host_output_bytes(out, " ", 1);
}

static void write_xyz(struct host_output *out, const double *xyz)
{
    for (int d = 0; d < 3; d++) {
        host_output_double(out, xyz[d] + 0.0);
        if (d < 2) {
            blank(out);
        }
    }
}

static void write_row(struct host_output *out, const uint32_t *v, int n,
                      uint64_t base)
{
    for (int k = 0; k < n; k++) {
        blank(out);
        host_output_unsigned(out, v[k] + base);
    }
}

/* --- TetGen ----------------------------------------------------------- */

static void write_ele(struct host_output *out, const struct host_points *points,
                      const struct host_tetrahedra *tets)
{
    host_output_unsigned(out, tets->count);
    host_output_text(out, " 4 0\n");
    for (uint64_t i = 0; i < tets->count; i++) {
        host_output_unsigned(out, i + points->base);
        write_row(out, tets->v[i], 4, points->base);
        newline(out);
    }
}

static void write_node(struct host_output *out,
                       const struct host_points *points)
{
    host_output_unsigned(out, points->count);
    host_output_text(out, " 3 0 0\n");
    for (uint64_t i = 0; i < points->count; i++) {
        host_output_unsigned(out, i + points->base);
        blank(out);
        write_xyz(out, points->xyz + 3 * i);
        newline(out);
    }
}

/* Neighbours opposite the corners, from the groups of lowest vertices.  The
 * one opposite a tetrahedron's own lowest vertex is of a later group, so a
 * first sweep over all groups notes it. */
struct neighbours {
    struct host_adjacency adjacency;
    struct host_group group;
    uint32_t *opposite_lowest;
    uint32_t (*opposite)[4]; /* of the tetrahedra of the group at hand */
    size_t capacity;
    uint64_t hull_facets;
};

static uint32_t twin(const struct host_group *group, size_t i)
{
    const struct host_facet *f = group->facet;
    if (i > 0 && f[i - 1].others == f[i].others) {
        return f[i - 1].tet;
    }
    if (i + 1 < group->count && f[i + 1].others == f[i].others) {
        return f[i + 1].tet;
    }
    return UINT32_MAX;
}

static int first_sweep(struct neighbours *n, struct host_error *error)
{
    for (uint32_t p = 0; p < n->adjacency.vertices; p++) {
        if (host_adjacency_group(&n->adjacency, p, &n->group, error) != 0) {
            return error->code;
        }
        for (size_t i = 0; i < n->group.count; i++) {
            const struct host_facet *f = &n->group.facet[i];
            uint32_t other = twin(&n->group, i);
            n->hull_facets += other == UINT32_MAX;
            if (f->corner == 0) {
                n->opposite_lowest[f->tet] = other;
            }
        }
    }
    return 0;
}

static int second_group(struct neighbours *n, uint32_t p,
                        struct host_error *error)
{
    uint32_t first = n->adjacency.first_by_lowest[p];
    size_t count = n->adjacency.first_by_lowest[p + 1] - first;
    if (n->capacity < count) {
        void *grown = realloc(n->opposite, 2 * count * sizeof *n->opposite);
        if (grown == NULL) {
            return host_fail_memory(error, "the tetrahedra at a vertex");
        }
        n->opposite = grown;
        n->capacity = 2 * count;
    }
    if (host_adjacency_group(&n->adjacency, p, &n->group, error) != 0) {
        return error->code;
    }
    for (size_t i = 0; i < n->group.count; i++) {
        const struct host_facet *f = &n->group.facet[i];
        if (f->corner != 0) {
            n->opposite[f->tet - first][f->corner] = twin(&n->group, i);
        }
    }
    for (size_t i = 0; i < count; i++) {
        n->opposite[i][0] = n->opposite_lowest[first + i];
    }
    return 0;
}

static void write_neighbours(struct host_output *neigh,
                             struct host_output *face, struct neighbours *n,
                             uint32_t p, uint64_t base, uint64_t *facets)
{
    uint32_t i = n->adjacency.first_by_lowest[p];
    uint32_t first = i, end = n->adjacency.first_by_lowest[p + 1];
    for (; i < end; i++) {
        host_output_unsigned(neigh, i + base);
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t other = n->opposite[i - first][k];
            if (other != UINT32_MAX) {
                blank(neigh);
                host_output_unsigned(neigh, other + base);
                continue;
            }
            host_output_text(neigh, " -1");
            uint32_t v[3];
            host_facet_outward(n->adjacency.tets->v[i], k, v);
            host_output_unsigned(face, (*facets)++ + base);
            write_row(face, v, 3, base);
            host_output_text(face, " 1\n");
        }
        newline(neigh);
    }
}

/* .neigh (-1: none) and .face (the hull, normals outward). */
static int write_topology(struct host_output *neigh, struct host_output *face,
                          const struct host_points *points,
                          const struct host_tetrahedra *tets,
                          struct host_error *error)
{
    struct neighbours n = {.capacity = 0};
    size_t bytes = (size_t)tets->count * sizeof(uint32_t);
    n.opposite_lowest = host_map(bytes);
    if (n.opposite_lowest == NULL) {
        host_fail_memory(error, "the neighbours of the tetrahedra");
    } else if (host_adjacency_make(&n.adjacency, tets, (uint32_t)points->count,
                                   error) == 0 &&
               first_sweep(&n, error) == 0) {
        uint64_t facets = 0;
        host_output_unsigned(neigh, tets->count);
        host_output_text(neigh, " 4\n");
        host_output_unsigned(face, n.hull_facets);
        host_output_text(face, " 1\n");
        for (uint32_t p = 0; p < points->count; p++) {
            if (second_group(&n, p, error) != 0) {
                break;
            }
            write_neighbours(neigh, face, &n, p, points->base, &facets);
        }
    }
    host_adjacency_free(&n.adjacency);
    host_group_free(&n.group);
    free(n.opposite);
    host_unmap(n.opposite_lowest, bytes);
    return error->code;
}

static const char *const beside[] = {".node", ".neigh", ".face"};
enum { BESIDE = sizeof beside / sizeof beside[0] };

const char *host_write_file(const char *path, unsigned k, char *name,
                            size_t size)
{
    size_t length = strlen(path);
    bool more = host_format_of(path) == HOST_ELE && !host_is_packed(path);
    if (strcmp(path, "-") == 0 || length + 8 > size ||
        k > (more ? BESIDE : 0)) {
        return NULL;
    }
    if (k == 0) {
        return path;
    }
    size_t stem = length - strlen(".ele"); /* or .ELE */
    (void)snprintf(name, size, "%.*s%s", (int)stem, path, beside[k - 1]);
    return name;
}

static int write_tetgen(const char *path, const struct host_points *points,
                        const struct host_tetrahedra *tets,
                        struct host_error *error)
{
    struct host_output out[BESIDE + 1];
    char names[BESIDE + 1][HOST_PATH_MAX];
    size_t opened = 0;
    for (; opened <= BESIDE && error->code == 0; opened++) {
        unsigned k = opened < BESIDE ? (unsigned)opened + 1 : 0; /* it last */
        const char *file =
            host_write_file(path, k, names[opened], sizeof names[opened]);
        if (file == NULL) {
            host_fail(error, HOST_INPUT, "%s: too long a name; shorten it",
                      path);
            break;
        }
        if (host_output_open(&out[opened], file, error) != 0) {
            break;
        }
    }
    if (error->code == 0) {
        write_node(&out[0], points);
        write_topology(&out[1], &out[2], points, tets, error);
        write_ele(&out[BESIDE], points, tets);
    }
    return host_output_close(out, opened, error);
}

/* --- VTK -------------------------------------------------------------- */

static void write_word(struct host_output *out, uint64_t value, size_t bytes)
{
    uint8_t little[8];
    for (size_t i = 0; i < bytes; i++) {
        little[i] = (uint8_t)(value >> (8 * i));
    }
    host_output_bytes(out, little, bytes);
}

static void write_big(struct host_output *out, uint64_t value, size_t bytes)
{
    uint8_t big[8];
    for (size_t i = 0; i < bytes; i++) {
        big[i] = (uint8_t)(value >> (8 * (bytes - 1 - i)));
    }
    host_output_bytes(out, big, bytes);
}

static void write_double(struct host_output *out, double value, bool big)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    (big ? write_big : write_word)(out, bits, 8);
}

/* Appended raw data: what ParaView loads fastest. */
static void write_vtu(struct host_output *out, const struct host_points *points,
                      const struct host_tetrahedra *tets)
{
    uint64_t m = tets->count, n = points->count;
    size_t word = 4 * m < INT32_MAX && n < INT32_MAX ? 4 : 8;
    const char *type = word == 4 ? "Int32" : "Int64";
    uint64_t bytes[4] = {24 * n, 4 * m * word, m * word, m};
    uint64_t at[3] = {8 + bytes[0]}; /* past a length and its bytes */
    at[1] = at[0] + 8 + bytes[1];
    at[2] = at[1] + 8 + bytes[2];
    char text[1600];
    (void)snprintf(
        text, sizeof text,
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        "<UnstructuredGrid>\n"
        "<Piece NumberOfPoints=\"%llu\" NumberOfCells=\"%llu\">\n"
        "<Points>\n<DataArray type=\"Float64\" Name=\"Points\" "
        "NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>\n"
        "</Points>\n<Cells>\n"
        "<DataArray type=\"%s\" Name=\"connectivity\" format=\"appended\" "
        "offset=\"%llu\"/>\n"
        "<DataArray type=\"%s\" Name=\"offsets\" format=\"appended\" "
        "offset=\"%llu\"/>\n"
        "<DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" "
        "offset=\"%llu\"/>\n"
        "</Cells>\n</Piece>\n</UnstructuredGrid>\n"
        "<AppendedData encoding=\"raw\">\n_",
        (unsigned long long)n, (unsigned long long)m, type,
        (unsigned long long)at[0], type, (unsigned long long)at[1],
        (unsigned long long)at[2]);
    host_output_text(out, text);
    write_word(out, bytes[0], 8);
    for (uint64_t i = 0; i < 3 * n; i++) {
        write_double(out, points->xyz[i] + 0.0, false);
    }
    write_word(out, bytes[1], 8);
    for (uint64_t i = 0; i < m; i++) {
        for (int k = 0; k < 4; k++) {
            write_word(out, tets->v[i][k], word);
        }
    }
    write_word(out, bytes[2], 8);
    for (uint64_t i = 0; i < m; i++) {
        write_word(out, 4 * (i + 1), word);
    }
    write_word(out, bytes[3], 8);
    for (uint64_t i = 0; i < m; i++) {
        host_output_bytes(out, "\x0a", 1); /* VTK_TETRA */
    }
    host_output_text(out, "\n</AppendedData>\n</VTKFile>\n");
}

static void write_vtk(struct host_output *out, const struct host_points *points,
                      const struct host_tetrahedra *tets)
{
    char text[160];
    host_output_text(out, "# vtk DataFile Version 3.0\nincode\nBINARY\n"
                          "DATASET UNSTRUCTURED_GRID\n");
    (void)snprintf(text, sizeof text, "POINTS %llu double\n",
                   (unsigned long long)points->count);
    host_output_text(out, text);
    for (uint64_t i = 0; i < 3 * points->count; i++) {
        write_double(out, points->xyz[i] + 0.0, true);
    }
    unsigned long long words = 5 * tets->count;
    (void)snprintf(text, sizeof text, "\nCELLS %llu %llu\n",
                   (unsigned long long)tets->count, words);
    host_output_text(out, text);
    for (uint64_t i = 0; i < tets->count; i++) {
        write_big(out, 4, 4);
        for (int k = 0; k < 4; k++) {
            write_big(out, tets->v[i][k], 4);
        }
    }
    (void)snprintf(text, sizeof text, "\nCELL_TYPES %llu\n",
                   (unsigned long long)tets->count);
    host_output_text(out, text);
    for (uint64_t i = 0; i < tets->count; i++) {
        write_big(out, 10, 4);
    }
    newline(out);
}

/* --- Gmsh, Medit, NumPy ----------------------------------------------- */

static void write_msh(struct host_output *out, const struct host_points *points,
                      const struct host_tetrahedra *tets)
{
    host_output_text(out, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n");
    host_output_unsigned(out, points->count);
    newline(out);
    for (uint64_t i = 0; i < points->count; i++) {
        host_output_unsigned(out, i + 1);
        blank(out);
        write_xyz(out, points->xyz + 3 * i);
        newline(out);
    }
    host_output_text(out, "$EndNodes\n$Elements\n");
    host_output_unsigned(out, tets->count);
    newline(out);
    for (uint64_t i = 0; i < tets->count; i++) {
        host_output_unsigned(out, i + 1);
        host_output_text(out, " 4 2 1 1");
        write_row(out, tets->v[i], 4, 1);
        newline(out);
    }
    host_output_text(out, "$EndElements\n");
}

static void write_mesh(struct host_output *out,
                       const struct host_points *points,
                       const struct host_tetrahedra *tets)
{
    host_output_text(out, "MeshVersionFormatted 2\nDimension 3\nVertices\n");
    host_output_unsigned(out, points->count);
    newline(out);
    for (uint64_t i = 0; i < points->count; i++) {
        write_xyz(out, points->xyz + 3 * i);
        host_output_text(out, " 0\n");
    }
    host_output_text(out, "Tetrahedra\n");
    host_output_unsigned(out, tets->count);
    newline(out);
    for (uint64_t i = 0; i < tets->count; i++) {
        for (int k = 0; k < 4; k++) {
            host_output_unsigned(out, tets->v[i][k] + UINT64_C(1));
            blank(out);
        }
        host_output_text(out, "0\n");
    }
    host_output_text(out, "End\n");
}

static void write_npy(struct host_output *out, const struct host_points *points,
                      const struct host_tetrahedra *tets)
{
    (void)points;
    char text[160];
    int n = snprintf(text, sizeof text,
                     "{'descr': '<u4', 'fortran_order': False, "
                     "'shape': (%llu, 4), }",
                     (unsigned long long)tets->count);
    int padded = (10 + n + 1 + 63) / 64 * 64 - 10; /* numbers aligned to 64 */
    host_output_bytes(out, "\x93NUMPY\x01\x00", 8);
    write_word(out, (uint64_t)padded, 2);
    host_output_text(out, text);
    for (; n < padded - 1; n++) {
        blank(out);
    }
    newline(out);
    for (uint64_t i = 0; i < tets->count; i++) {
        for (int k = 0; k < 4; k++) {
            write_word(out, tets->v[i][k], 4);
        }
    }
}

/* --- By extension ----------------------------------------------------- */

typedef void writer(struct host_output *out, const struct host_points *points,
                    const struct host_tetrahedra *tets);

static writer *writer_of(const char *path)
{
    if (strcmp(path, "-") == 0) {
        return write_ele;
    }
    if (host_is_packed(path)) {
        return NULL;
    }
    switch (host_format_of(path)) {
    case HOST_ELE:
        return write_ele;
    case HOST_VTU:
        return write_vtu;
    case HOST_VTK:
        return write_vtk;
    case HOST_MSH:
        return write_msh;
    case HOST_MESH:
        return write_mesh;
    case HOST_NPY:
        return write_npy;
    default:
        return NULL;
    }
}

int host_write_check(const char *path, struct host_error *error)
{
    return writer_of(path) != NULL
               ? 0
               : host_fail(error, HOST_USAGE,
                           "%s: no format of tetrahedra to be written has "
                           "this extension; use .ele .vtu .vtk .msh .mesh "
                           ".npy, or -",
                           path);
}

int host_write_probe(const char *path, struct host_error *error)
{
    char name[HOST_PATH_MAX];
    const char *file = path;
    for (unsigned k = 0; file != NULL && error->code == 0; k++) {
        file = k == 0 ? path : host_write_file(path, k, name, sizeof name);
        if (file != NULL) {
            host_output_probe(file, error);
        }
    }
    return error->code;
}

int host_write(const char *path, const struct host_points *points,
               const struct host_tetrahedra *tets, struct host_error *error)
{
    writer *write_to = writer_of(path);
    if (write_to == NULL) {
        return host_write_check(path, error);
    }
    if (write_to == write_ele && strcmp(path, "-") != 0) {
        return write_tetgen(path, points, tets, error);
    }
    if (write_to == write_vtk && points->count > INT32_MAX) {
        return host_fail(error, HOST_INPUT,
                         "%s: legacy VTK counts points in 31 bits; write .vtu",
                         path);
    }
    struct host_output out;
    if (host_output_open(&out, path, error) == 0) {
        write_to(&out, points, tets);
        host_output_close(&out, 1, error);
    }
    return error->code;
}
