/* The readers, one for each format: bytes in memory to points, tetrahedra or
 * both.  Whatever the bytes, they return; sizes that a file claims are checked
 * against its length before anything is reserved.
 *
 * Memory: what they append.  Work: one pass over the bytes.
 *
 *     struct host_mesh mesh = {.points = &points};
 *     if (host_read_ply(&source, &mesh, &error) != 0) ...
 *     host_points_free(&points);
 */
#ifndef HOST_READERS_H
#define HOST_READERS_H

#include "host/mesh/points.h"
#include "host/files/source.h"
#include "host/mesh/tetrahedra.h"

/* Where a reader puts what it finds; NULL: not wanted. */
struct host_mesh {
    struct host_points *points;
    struct host_tetrahedra *tets;
};

typedef int host_reader(const struct host_source *source,
                        struct host_mesh *mesh, struct host_error *error);

host_reader host_read_xyz, host_read_node, host_read_off; /* read_text.c */
host_reader host_read_ply, host_read_npy, host_read_vtk, host_read_vtkxml;
host_reader host_read_plot3d;
host_reader host_read_ele, host_read_msh, host_read_mesh; /* read_tets.c */

/* --- Numbers in binary files ------------------------------------------ */

enum host_number {
    HOST_F64,
    HOST_F32,
    HOST_I8,
    HOST_U8,
    HOST_I16,
    HOST_U16,
    HOST_I32,
    HOST_U32,
    HOST_I64,
    HOST_U64,
    HOST_NO_NUMBER
};

/* Bytes of a number; 0 for HOST_NO_NUMBER. */
size_t host_number_bytes(enum host_number type);

/* By the names that VTK, PLY and Gmsh use ("float", "Float32", "double",
 * "int", "uchar", "vtktypeint64", ...), upper or lower case. */
enum host_number host_number_named(const char *name);

/* A number at `from`, which need not be aligned. */
double host_number_at(const uint8_t *from, enum host_number type, bool big);

/* A whole number; UINT64_MAX where it is negative. */
uint64_t host_whole_at(const uint8_t *from, enum host_number type, bool big);

/* Appends `rows` points of three numbers each, `stride` bytes apart. */
int host_append_numbers(struct host_points *points, const uint8_t *from,
                        uint64_t rows, size_t stride, enum host_number type,
                        bool big, struct host_error *error);

/* Appends one tetrahedron. */
int host_append_tetrahedron(struct host_tetrahedra *tets,
                            const uint64_t vertex[4],
                            const struct host_source *source,
                            struct host_error *error);

#endif
