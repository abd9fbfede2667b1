/* The formats that the host knows, one row each: files are read and written by
 * it, and what help and messages list of formats and extensions is from it. */
#ifndef HOST_FORMATS_H
#define HOST_FORMATS_H

#include "host/formats/format.h"

enum host_use {
    HOST_READ_POINTS,
    HOST_WRITE_POINTS,
    HOST_READ_TETRAHEDRA,
    HOST_WRITE_TETRAHEDRA
};

enum { HOST_FORMAT_LIST_MAX = 1024 }; /* bytes of a list, at most */

/* Row i; NULL past the last. */
const struct host_format *host_format_row(unsigned i);

/* By the extension of `path`, .gz apart; NULL: none has it, as with "-". */
const struct host_format *host_format_named(const char *path);

/* The format in which `path` is read or written; NULL: it cannot be.  "-" is
 * the first of the table that has that use.  What ends in .gz is read and not
 * written. */
const struct host_format *host_format_of(const char *path, enum host_use use);

/* Of the formats that are not read, the one that a file which begins so has;
 * NULL: none. */
const struct host_format *host_format_recognised(const uint8_t *data,
                                                 size_t bytes);

/* The format that an option --format names, as an extension does, with or
 * without its dot ("las", ".xyz.gz").  NULL with HOST_USAGE, and what is
 * allowed, where none that has the use is called so. */
const struct host_format *host_format_told(const char *name, enum host_use use,
                                           struct host_error *error);

/* ".ele .vtu .vtk": the extensions that have that use. */
void host_format_list(enum host_use use, char *text, size_t size);

/* ".ele (TetGen; with .node beside it), .vtu (VTK XML)": the same for help. */
void host_format_help(enum host_use use, char *text, size_t size);

#endif
