/* TetGen's files: .node for points; .ele for tetrahedra, with their points, the
 * neighbours of each and the facets of the hull beside it. */
#include <stdlib.h>

#include "format.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/adjacency.h"
#include "rows.h"
#include "scan.h"

/* --- .node ---------------------------------------------------------------- */

static int read_node(const struct host_source *source, struct host_mesh *mesh,
                     struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    uint64_t count, dimensions, base = 0;
    if (host_scan_unsigned(&s, UINT32_MAX - 1, &count, error) != 0 ||
        host_scan_unsigned(&s, UINT32_MAX, &dimensions, error) != 0)
        return error->code;
    if (dimensions != 3) {
        return host_scan_fail(&s, s.at, error,
                              "the points have not 3 dimensions; give a .node "
                              "of 3");
    }
    host_scan_next_line(&s);
    for (uint64_t i = 0; i < count; i++) {
        uint64_t number;
        if (host_scan_unsigned(&s, UINT32_MAX, &number, error) != 0)
            return error->code;
        base = i == 0 ? number : base;
        if (number != base + i || base > 1) {
            return host_scan_fail(&s, s.at, error,
                                  "points are not numbered from 0 or 1 on "
                                  "without gaps; renumber them");
        }
        double xyz[3];
        for (int d = 0; d < 3; d++)
            if (host_scan_double(&s, &xyz[d], error) != 0)
                return error->code;
        host_scan_next_line(&s); /* attributes and boundary marker */
        if (host_points_append(mesh->points, xyz, 1, error) != 0)
            return error->code;
    }
    mesh->points->base = (uint32_t)base;
    return host_scan_end(&s, error,
                         "a row beyond the number of points in the first "
                         "line; correct that number, or remove the row");
}

static void write_node(struct host_output *out,
                       const struct host_points *points) {
    host_put_line(out, "", points->count, " 3 0 0\n");
    host_put_points(out, points, " ", true);
}

/* Beside an .ele, where -0.0 is 0.0. */
static void write_node_beside(struct host_output *out,
                              const struct host_points *points) {
    host_put_line(out, "", points->count, " 3 0 0\n");
    for (uint64_t i = 0; i < points->count; i++) {
        host_put_line(out, "", i + points->base, " ");
        host_put_xyz(out, points->xyz + 3 * i);
        host_output_text(out, "\n");
    }
}

/* --- .neigh and .face ----------------------------------------------------- */

/* Neighbours opposite the corners, from the groups of lowest vertices.  The
 * one opposite a tetrahedron's own lowest vertex is of a later group, so a
 * first sweep over all groups notes it: where tetrahedra are put aside, in a
 * list that is sorted. */
struct neighbours {
    struct host_adjacency adjacency;
    struct host_group group;
    uint32_t *opposite_lowest;    /* [tetrahedra]; or NULL, and */
    struct host_tetrahedra pairs; /* of each its number, that one, 0, 0 */
    uint32_t (*opposite)[4];      /* of the tetrahedra of the group at hand */
    size_t capacity;
    uint64_t hull_facets;
};

static uint32_t twin(const struct host_group *group, size_t i) {
    const struct host_facet *f = group->facet;
    if (i > 0 && f[i - 1].others == f[i].others)
        return f[i - 1].tet;
    if (i + 1 < group->count && f[i + 1].others == f[i].others)
        return f[i + 1].tet;
    return UINT32_MAX;
}

static void note(struct neighbours *n, uint32_t tet, uint32_t other) {
    if (n->opposite_lowest != NULL) {
        n->opposite_lowest[tet] = other;
        return;
    }
    uint32_t *pair = n->pairs.v[n->pairs.count];
    pair[0] = tet;
    pair[1] = other;
    host_tetrahedra_keep(&n->pairs, 1);
    host_call_trim(sizeof n->pairs.v[0]);
}

static uint32_t noted(const struct neighbours *n, uint32_t tet) {
    if (n->opposite_lowest != NULL)
        return n->opposite_lowest[tet];
    host_call_trim(sizeof n->pairs.v[0]);
    return n->pairs.v[tet][1];
}

static int first_sweep(struct neighbours *n, struct host_error *error) {
    for (uint32_t p = 0; p < n->adjacency.vertices; p++) {
        if (host_adjacency_group(&n->adjacency, p, &n->group, error) != 0)
            return error->code;
        for (size_t i = 0; i < n->group.count; i++) {
            const struct host_facet *f = &n->group.facet[i];
            uint32_t other = twin(&n->group, i);
            n->hull_facets += other == UINT32_MAX;
            if (f->corner == 0)
                note(n, f->tet, other);
        }
    }
    host_rows_sort(&n->pairs);
    return 0;
}

static int second_group(struct neighbours *n, uint32_t p,
                        struct host_error *error) {
    uint32_t first = n->adjacency.first_by_lowest[p];
    size_t count = n->adjacency.first_by_lowest[p + 1] - first;
    if (n->capacity < count) {
        void *grown = realloc(n->opposite, 2 * count * sizeof *n->opposite);
        if (grown == NULL)
            return host_fail_memory(error, "the tetrahedra at a vertex");
        n->opposite = grown;
        n->capacity = 2 * count;
    }
    if (host_adjacency_group(&n->adjacency, p, &n->group, error) != 0)
        return error->code;
    for (size_t i = 0; i < n->group.count; i++) {
        const struct host_facet *f = &n->group.facet[i];
        if (f->corner != 0)
            n->opposite[f->tet - first][f->corner] = twin(&n->group, i);
    }
    for (size_t i = 0; i < count; i++)
        n->opposite[i][0] = noted(n, first + (uint32_t)i);
    return 0;
}

static void write_neighbours(struct host_output *neigh,
                             struct host_output *face, struct neighbours *n,
                             uint32_t p, uint64_t base, uint64_t *facets) {
    uint32_t i = n->adjacency.first_by_lowest[p];
    uint32_t first = i, end = n->adjacency.first_by_lowest[p + 1];
    for (; i < end; i++) {
        host_output_unsigned(neigh, i + base);
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t other = n->opposite[i - first][k];
            if (other != UINT32_MAX) {
                host_output_text(neigh, " ");
                host_output_unsigned(neigh, other + base);
                continue;
            }
            host_output_text(neigh, " -1");
            uint32_t v[3];
            host_facet_outward(n->adjacency.tets->v[i], k, v);
            host_output_unsigned(face, (*facets)++ + base);
            host_put_row(face, v, 3, base);
            host_output_text(face, " 1\n");
        }
        host_output_text(neigh, "\n");
    }
}

/* .neigh (-1: none) and .face (the hull, normals outward). */
static int write_topology(struct host_output *neigh, struct host_output *face,
                          const struct host_points *points,
                          const struct host_tetrahedra *tets,
                          struct host_error *error) {
    struct neighbours n = {.capacity = 0};
    size_t bytes = (size_t)tets->count * sizeof(uint32_t);
    if (host_adjacency_make(&n.adjacency, tets, (uint32_t)points->count,
                            error) != 0)
        return error->code;
    if (n.adjacency.seconds.v != NULL) {
        (void)host_tetrahedra_room(&n.pairs, tets->count, error);
    } else {
        n.opposite_lowest = host_map(bytes);
        if (n.opposite_lowest == NULL)
            host_fail_memory(error, "the neighbours of the tetrahedra");
    }
    if (error->code == 0 && first_sweep(&n, error) == 0) {
        uint64_t facets = 0;
        host_put_line(neigh, "", tets->count, " 4\n");
        host_put_line(face, "", n.hull_facets, " 1\n");
        for (uint32_t p = 0; p < points->count; p++) {
            if (second_group(&n, p, error) != 0)
                break;
            write_neighbours(neigh, face, &n, p, points->base, &facets);
        }
    }
    host_adjacency_free(&n.adjacency);
    host_group_free(&n.group);
    free(n.opposite);
    host_unmap(n.opposite_lowest, bytes);
    host_tetrahedra_free(&n.pairs);
    return error->code;
}

/* --- .ele ----------------------------------------------------------------- */

static int read_ele(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    uint64_t count, corners, base = 0;
    if (host_scan_unsigned(&s, UINT64_MAX / 64, &count, error) != 0 ||
        host_scan_unsigned(&s, UINT32_MAX, &corners, error) != 0)
        return error->code;
    if (corners != 4) {
        return host_scan_fail(&s, s.at, error,
                              "elements of other than 4 vertices; give "
                              "tetrahedra of 4");
    }
    host_scan_next_line(&s);
    for (uint64_t i = 0; i < count; i++) {
        uint64_t number, v[4];
        if (host_scan_unsigned(&s, UINT64_MAX / 16, &number, error) != 0)
            return error->code;
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
            if (host_scan_unsigned(&s, UINT64_MAX / 16, &v[k], error) != 0)
                return error->code;
        }
        if (host_take_element(mesh, v, base, source, &s, error) != 0)
            return error->code;
        host_scan_next_line(&s); /* attributes */
    }
    return host_scan_end(&s, error,
                         "a row beyond the number of tetrahedra in the first "
                         "line; correct that number, or remove the row");
}

static int write_ele(struct host_output *out, struct host_output *beside,
                     const struct host_points *points,
                     const struct host_tetrahedra *tets,
                     struct host_error *error) {
    enum { NODE, NEIGH, FACE };
    if (beside != NULL) {
        if (beside[NODE].file >= 0)
            write_node_beside(&beside[NODE], points);
        write_topology(&beside[NEIGH], &beside[FACE], points, tets, error);
    }
    host_put_line(out, "", tets->count, " 4 0\n");
    for (uint64_t i = 0; i < tets->count; i++) {
        host_output_unsigned(out, i + points->base);
        host_put_row(out, tets->v[i], 4, points->base);
        host_output_text(out, "\n");
    }
    return error->code;
}

const struct host_format host_format_node = {
    .name = "TetGen",
    .extensions = {".node"},
    .read_points = read_node,
    .pieces = true,
    .write_points = write_node,
};

const struct host_format host_format_ele = {
    .name = "TetGen",
    .extensions = {".ele"},
    .read_tetrahedra = read_ele,
    .pieces = true,
    .write_tetrahedra = write_ele,
    .beside = {".node", ".neigh", ".face"},
    .rows_only = true,
};
