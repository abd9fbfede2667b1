/* Points as text: .xyz and .txt, with blanks, commas or semicolons between the
 * numbers, and .csv, whose first line may name the columns. */
#include <limits.h>
#include <string.h>

#include "csv.h"
#include "format.h"
#include "rows.h"
#include "scan.h"

enum next { NEXT_FIELD, NEXT_EMPTY, NEXT_NONE };

/* Goes to the next field of the line; one with more than `most` delimiters
 * before it comes after an empty one. */
static enum next go_to_field(struct host_scan *s, unsigned most)
{
    const char *c = s->at;
    for (unsigned delimiters = 0; c < s->end; c++) {
        if (*c == ',' || *c == ';') {
            if (++delimiters > most) {
                s->at = c;
                return NEXT_EMPTY;
            }
        } else if (*c != ' ' && *c != '\t' && *c != '\r') {
            s->at = c;
            return *c == '\n' || *c == '#' ? NEXT_NONE : NEXT_FIELD;
        }
    }
    s->at = c;
    return NEXT_NONE;
}

static int wrong_columns(struct host_scan *s, int columns, enum next next,
                         struct host_error *error)
{
    static const char *const few[] = {
        "", "1 column where x, y and z are due; complete the line",
        "2 columns where x, y and z are due; complete the line"};
    return host_scan_fail(s, s->at, error,
                          next == NEXT_EMPTY ? HOST_CSV_EMPTY
                          : columns == 3
                              ? "more than 3 columns; leave only x, y and z"
                              : few[columns]);
}

/* Three numbers and no more on a line; in a .csv no field is empty. */
static int take_three(struct host_scan *s, bool is_csv, double xyz[3],
                      struct host_error *error)
{
    unsigned most = is_csv ? 1 : UINT_MAX;
    if (is_csv && host_csv_begins_empty(s)) {
        return wrong_columns(s, 0, NEXT_EMPTY, error);
    }
    for (int d = 0; d < 3; d++) {
        if (host_scan_double(s, &xyz[d], error) != 0) {
            return error->code;
        }
        enum next next = go_to_field(s, most);
        if (next != (d < 2 ? NEXT_FIELD : NEXT_NONE)) {
            return wrong_columns(s, d + 1, next, error);
        }
    }
    return 0;
}

static int read_xyz(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    double xyz[3];
    while (host_scan_skip_blank_lines(&s)) {
        if (take_three(&s, false, xyz, error) != 0 ||
            host_points_append(mesh->points, xyz, 1, error) != 0) {
            return error->code;
        }
    }
    return 0;
}

static int read_csv(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error)
{
    struct host_scan s =
        host_scan_start(source->path, source->data, source->bytes);
    struct host_csv csv = {0};
    double xyz[3];
    if (host_csv_header(&csv, &s, error) != 0) {
        return error->code;
    }
    while (host_scan_skip_blank_lines(&s)) {
        int status = csv.fields > 0 ? host_csv_row(&csv, &s, xyz, error)
                                    : take_three(&s, true, xyz, error);
        if (status != 0 ||
            host_points_append(mesh->points, xyz, 1, error) != 0) {
            return error->code;
        }
    }
    return 0;
}

static void write_xyz(struct host_output *out, const struct host_points *points)
{
    host_put_points(out, points, " ", false);
}

static void write_csv(struct host_output *out, const struct host_points *points)
{
    host_put_points(out, points, ",", false);
}

const struct host_format host_format_xyz = {
    .name = "text",
    .extensions = {".xyz", ".txt"},
    .read_points = read_xyz,
    .write_points = write_xyz,
};

const struct host_format host_format_csv = {
    .name = "comma-separated",
    .extensions = {".csv"},
    .read_points = read_csv,
    .write_points = write_csv,
};
