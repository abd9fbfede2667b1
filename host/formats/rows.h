/* Rows of text as several formats have them, in and out.
 *
 * Memory: none.  Work: that of the numbers.
 *
 *     if (host_take_element(&mesh, number, 1, &source, &scan, &error) != 0 ||
 *         host_take_section_end(&scan, &error) != 0)
 *         return error.code;
 *     host_put_row(&out, tets.v[0], 4, 1);
 */
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

/* n numbers, each plus base and with a blank before it. */
void host_put_row(struct host_output *out, const uint32_t *v, int n,
                  uint64_t base);

/* A line a point, as it is, its number first where `numbered`; numbers as
 * above. */
void host_put_points(struct host_output *out, const struct host_points *points,
                     const char *separator, bool numbered);

#endif
