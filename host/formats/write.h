/* Points and tetrahedra out to files, in the format that the extension says.
 * A file has its name when host_output_commit gives it.
 *
 * Memory: 1 MiB of buffer a file; for .neigh and .face also 8 bytes a
 * tetrahedron and 8 a point.  Work: one pass, about 100 ns a tetrahedron as
 * text. */
#ifndef HOST_WRITE_H
#define HOST_WRITE_H

#include <stdbool.h>
#include <sys/stat.h>

#include "host/formats/output.h"
#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"
#include "host/base/error.h"

enum { HOST_PATH_MAX = 4096 }; /* bytes of a file's name, by the kernel */

/* Writes points, so that reading gives the same doubles; "-" is standard
 * output, in the first format of the table that is written. */
int host_points_write(const char *path, const struct host_points *points,
                      struct host_error *error);

/* The same in the format that host_format_told has for `format`, if not NULL.
 */
int host_points_write_as(const char *path, const char *format,
                         const struct host_points *points,
                         struct host_error *error);

/* Writes the tetrahedra (sorted, vertices = rows of points), and the files that
 * belong beside them; "-" as above.  input: the file of the points, or NULL; it
 * is never written, even if it is one of the files beside them. */
int host_write(const char *path, const char *input,
               const struct host_points *points,
               const struct host_tetrahedra *tets, struct host_error *error);

/* The same in blocks, as tetrahedra are made, in a format of which the count
 * can be written last. */
struct host_format;

struct host_row_output {
    struct host_output out;
    const struct host_format *format;
    uint64_t count, place; /* rows; where their count stands */
};

/* Whether `path` is such an output: it is a file, as yet or by now. */
bool host_rows_can(const char *path);
int host_rows_open(struct host_row_output *rows, const char *path,
                   const struct host_points *points, struct host_error *error);
/* By one thread at a time. */
void host_rows_put(struct host_row_output *rows, const uint32_t (*v)[4],
                   uint64_t count);
int host_rows_close(struct host_row_output *rows, struct host_error *error);

/* Whether `name`, a file beside an output, is `input` in the same format, so
 * that it has the points already.  input: NULL is none. */
bool host_write_leaves(const char *input, const char *name);

/* 0 where `path` has an extension that host_write knows, else HOST_USAGE with
 * the list of those that are allowed; HOST_INPUT where the format lacks its
 * library.  For checking before the work starts. */
int host_write_check(const char *path, struct host_error *error);

/* File k of those that the output `path` makes, 0 being itself; NULL: there is
 * none, or its name is too long for `size` bytes.  "-" makes none. */
const char *host_write_file(const char *path, unsigned k, char *name,
                            size_t size);

/* Calls act(context, file) for each file of the outputs path[count]. */
void host_write_files(const char *const *path, unsigned count,
                      void (*act)(void *context, const char *file),
                      void *context);

/* 0 where a file can be made beside `path`, else HOST_INPUT.  `input`: as of
 * host_write. */
int host_write_probe(const char *path, const char *input,
                     struct host_error *error);

/* Which files a command reads and which it will write, so that it writes over
 * no file that it reads, and writes no file twice.  Two names are one file if
 * they have the same device and inode, links followed.  For a file that does
 * not exist yet, the directory and the last name are compared, links followed.
 */

struct host_claim;

struct host_claims {
    struct host_claim *claim;
    unsigned count, capacity;
};

/* Notes a file that is read; "-" is standard input. */
int host_claims_read(struct host_claims *claims, const char *path,
                     struct host_error *error);

/* Notes an output, which the command line gives as `option` and `path`, with
 * all files that belong to it; "-" is standard output.  `input`: as of
 * host_write.  HOST_USAGE where one of them is read, or written for another
 * output. */
int host_claims_write(struct host_claims *claims, const char *option,
                      const char *path, const char *input,
                      struct host_error *error);

void host_claims_free(struct host_claims *claims);

/* Where a name leads in the end, by the kernel's own word: links are followed
 * by it alone, so that one which the system does not follow (another user's in
 * a sticky directory, or on a mount without links) is not followed here. */

/* What `path` is in the end, links followed, also those that lead to where
 * nothing is yet (there a file is made and removed at once).  To be freed; NULL
 * with errno where the kernel does not follow it. */
char *host_target(const char *path);

/* Whether `name` is this very file, and no link to it. */
bool host_is_file(const struct stat *file, const char *name);

#endif
