/* The columns of a text whose first line names them. */
#ifndef HOST_CSV_H
#define HOST_CSV_H

#include "scan.h"

#define HOST_CSV_EMPTY "an empty field where a number is due; fill it in"

struct host_csv {
    char delimiter;
    uint64_t fields;    /* a line; 0: no line names the columns */
    uint64_t column[3]; /* of x, y and z */
};

/* Takes the line at hand if it names columns.  x, y and z may be in any order,
 * in quotes, followed by a unit ("x [m]"), with other columns among them. Three
 * columns of other names are x, y and z; else HOST_INPUT. */
int host_csv_header(struct host_csv *csv, struct host_scan *s,
                    struct host_error *error);

/* Whether an empty field comes before the word at hand, the line's first. */
bool host_csv_begins_empty(const struct host_scan *s);

/* Takes a line of as many fields as the header has, parted as it is, or by
 * another delimiter throughout.  A comment may follow x, y and z, or the last
 * field. */
int host_csv_row(const struct host_csv *csv, struct host_scan *s, double xyz[3],
                 struct host_error *error);

#endif
