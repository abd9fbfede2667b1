/* What a format is: a name, the extensions by which files are known to have
 * it, and what reads and writes points and tetrahedra in it.  A new format is a
 * file of this room that defines one, host_format_NAME, and a row of formats.c.
 *
 * A reader takes bytes in memory.  If its format sets `pieces`, it takes the
 * beginning of a file that is packed, or that a call which puts arrays aside
 * reads, and then what host_source_more adds; else all of it.  It returns
 * whatever the bytes are.  Sizes that a file claims are checked against its
 * length before memory is reserved. */
#ifndef HOST_FORMAT_H
#define HOST_FORMAT_H

#include "host/formats/output.h"
#include "host/formats/source.h"
#include "host/mesh/points.h"
#include "host/mesh/tetrahedra.h"

enum { HOST_EXTENSIONS_MAX = 4, HOST_BESIDE_MAX = 4 };

/* Where a reader puts what it finds; NULL: not wanted.  Of the two, a reader of
 * points has points, and a reader of tetrahedra has tets. */
struct host_mesh {
    struct host_points *points;
    struct host_tetrahedra *tets;
};

/* Appends what the file holds; coordinates need not be finite.  0, or
 * HOST_INPUT with the place. */
typedef int host_reader(const struct host_source *source,
                        struct host_mesh *mesh, struct host_error *error);

/* Before the work for it begins: 0, or HOST_INPUT where the output cannot be
 * written in this format. */
typedef int host_output_checker(const char *path, struct host_error *error);

/* The same doubles come back when it is read. */
typedef void host_points_writer(struct host_output *out,
                                const struct host_points *points);

/* tets: sorted, vertices = rows of points.  beside: the outputs of the format's
 * `beside`, in that order.  NULL: none is wanted; an output
 * whose file is below 0 is not wanted either.  0, or an error. */
typedef int host_tetrahedra_writer(struct host_output *out,
                                   struct host_output *beside,
                                   const struct host_points *points,
                                   const struct host_tetrahedra *tets,
                                   struct host_error *error);

/* Of a file whose rows may come in blocks: it is the head, the count, the rows
 * and the tail.  The count is written twice, at first as 0 and at last in the
 * same place, each time in as many bytes. */
struct host_row_writer {
    void (*head)(struct host_output *out, const struct host_points *points);
    /* width: that of the number, at least. */
    void (*count)(struct host_output *out, uint64_t count, int width);
    /* n rows, of which the first has the number `first`. */
    void (*rows)(struct host_output *out, const uint32_t (*v)[4], uint64_t n,
                 uint64_t first);
    void (*tail)(struct host_output *out);
};

struct host_format {
    const char *name;
    /* With their dots, in lower case; a file may have them in either case, and
     * .gz behind them where it is read. */
    const char *extensions[HOST_EXTENSIONS_MAX + 1];
    /* NULL: the format has none. */
    host_reader *read_points, *read_tetrahedra;
    host_points_writer *write_points;
    host_tetrahedra_writer *write_tetrahedra;
    host_output_checker *check_output;  /* of tetrahedra */
    const struct host_row_writer *rows; /* NULL: they do not come in blocks */
    /* Of the files that belong to an output of tetrahedra, and are written
     * beside it.  If it holds no points, the first has them, and its extension
     * is that of a format that reads points. */
    const char *beside[HOST_BESIDE_MAX + 1];
    bool rows_only; /* a file of tetrahedra holds no points */
    bool pieces;    /* its readers take a file piece by piece, see above */
    bool apart;     /* its bytes are read in a process of its own (hdf5.h) */
    /* Of a format that is known and not read: the message "WHY; WHAT TO DO
     * NEXT", and the test whether a file that begins with these bytes has the
     * format, whatever its extension. */
    const char *unread;
    bool (*recognises)(const uint8_t *data, size_t bytes);
};

#endif
