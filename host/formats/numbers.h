/* Numbers in binary files, of every type and either byte order.
 *
 * Memory: none.  Work: a load or a copy a number.
 *
 *     enum host_number type = host_number_named("Float32");
 *     double x = host_number_at(data, type, true);
 *     host_put_double(&out, x, false);
 */
#ifndef HOST_NUMBERS_H
#define HOST_NUMBERS_H

#include "format.h"

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

/* Appends one tetrahedron; HOST_INPUT where a vertex is no row number. */
int host_append_tetrahedron(struct host_tetrahedra *tets,
                            const uint64_t vertex[4],
                            const struct host_source *source,
                            struct host_error *error);

/* The lowest `bytes` bytes of a whole number, at most 8. */
void host_put_whole(struct host_output *out, uint64_t value, size_t bytes,
                    bool big);

void host_put_double(struct host_output *out, double value, bool big);

/* Many at once, little-endian. */
void host_put_words(struct host_output *out, const uint32_t *values, size_t n);
void host_put_doubles(struct host_output *out, const double *values, size_t n);

#endif
