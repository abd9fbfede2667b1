/* Rows of text as several formats have them, in and out. */
#ifndef HOST_ROWS_H
#define HOST_ROWS_H

#include "format.h"
#include "scan.h"

/* Appends the point in the first three columns of the current line, whatever is
 * in later columns, and goes to the end of the line.  Fewer columns are
 * HOST_INPUT.  So are columns separated by commas that look like decimal ones;
 * if they may be either, points->doubtful is set.  In a .csv none of the three
 * columns may be empty. */
int host_take_point(struct host_scan *s, bool is_csv,
                    struct host_points *points, struct host_error *error);

/* Appends the tetrahedron on the line that is being read, whose vertices are
 * numbered from `base`.  HOST_INPUT for one that is no row number. */
int host_take_element(struct host_mesh *mesh, const uint64_t number[4],
                      uint64_t base, const struct host_source *source,
                      const struct host_scan *s, struct host_error *error);

/* HOST_INPUT where neither a word nor the end follows a section's rows. */
int host_take_section_end(struct host_scan *s, struct host_error *error);

/* A line with one number in it. */
void host_put_line(struct host_output *out, const char *before, uint64_t number,
                   const char *after);

/* x, y and z, with blanks between them; -0.0 as 0.0.  Each is the decimal with
 * the fewest digits that reads back as the same double, and the nearest of
 * these; at most 17 digits. */
void host_put_xyz(struct host_output *out, const double *xyz);

/* A number of at least so many digits or blanks, and the end of the line: the
 * count of a host_row_writer. */
void host_put_count(struct host_output *out, uint64_t count, int width);

/* What a format with `rows` writes of tetrahedra that are all there: a
 * host_tetrahedra_writer calls it. */
void host_put_rows(struct host_output *out, const struct host_row_writer *rows,
                   const struct host_points *points,
                   const struct host_tetrahedra *tets);

/* n numbers, each plus base and with a blank before it. */
void host_put_row(struct host_output *out, const uint32_t *v, int n,
                  uint64_t base);

/* A line a point, as it is, its number first where `numbered`; numbers as
 * above. */
void host_put_points(struct host_output *out, const struct host_points *points,
                     const char *separator, bool numbered);

/* Numbers in binary files, of every type and either byte order. */

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
