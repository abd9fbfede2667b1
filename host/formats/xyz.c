/* Points as text: .xyz and .txt, with blanks, commas or semicolons between the
 * numbers, and .csv.  The first line of either may name the columns. */
#include <stdio.h>

#include "csv.h"
#include "format.h"
#include "rows.h"
#include "scan.h"

static int read_text(const struct host_source *source, bool is_csv,
                     struct host_points *points, struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    struct host_csv csv = {0};
    double xyz[3];
    if (host_csv_header(&csv, &s, error) != 0)
        return error->code;
    points->named = csv.fields > 0;
    while (host_scan_skip_blank_lines(&s)) {
        int status = csv.fields == 0
                         ? host_take_point(&s, is_csv, points, error)
                     : host_csv_row(&csv, &s, xyz, error) == 0
                         ? host_points_append(points, xyz, 1, error)
                         : error->code;
        if (status != 0)
            return status;
    }
    return 0;
}

static int read_xyz(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    return read_text(source, false, mesh->points, error);
}

static int read_csv(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    int status = read_text(source, true, mesh->points, error);
    mesh->points->named = false; /* in a .csv, names are usual */
    return status;
}

static void write_xyz(struct host_output *out,
                      const struct host_points *points) {
    host_put_points(out, points, " ", false);
}

static void write_csv(struct host_output *out,
                      const struct host_points *points) {
    host_put_points(out, points, ",", false);
}

const struct host_format host_format_xyz = {
    .name = "text",
    .extensions = {".xyz", ".txt"},
    .read_points = read_xyz,
    .pieces = true,
    .write_points = write_xyz,
};

const struct host_format host_format_csv = {
    .name = "comma-separated",
    .extensions = {".csv"},
    .read_points = read_csv,
    .pieces = true,
    .write_points = write_csv,
};

/* Leica's .pts, as scanners write it: a line with the number of points, which
 * may be missing, and as many lines of x, y and z, an intensity and colours
 * behind them.  Several such blocks may follow one another. */

/* Whether the line at hand is a number of points; takes it if so. */
static bool take_count(struct host_scan *s, uint64_t *count) {
    struct host_error none = {0};
    struct host_scan line = *s;
    uint64_t number;
    if (host_scan_unsigned(&line, UINT64_MAX / 16, &number, &none) != 0 ||
        host_scan_more(&line))
        return false;
    *s = line;
    *count = number;
    return true;
}

static int wrong_count(const struct host_scan *s, uint64_t rows, uint64_t count,
                       struct host_error *error) {
    char text[160];
    (void)snprintf(text, sizeof text,
                   "%s than the %llu points that the line before them tells "
                   "of; get the file whole, or correct that line",
                   rows > count ? "more" : "fewer", (unsigned long long)count);
    return host_scan_fail(s, s->at, error, text);
}

static int read_pts(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    uint64_t rows = 0, count = 0;
    bool more = host_scan_skip_blank_lines(&s);
    const bool counted = more && take_count(&s, &count);
    while (host_scan_skip_blank_lines(&s))
        if (counted && rows == count && take_count(&s, &count))
            rows = 0;
        else if (counted && rows == count)
            return wrong_count(&s, rows + 1, count, error);
        else if (host_take_point(&s, false, mesh->points, error) != 0)
            return error->code;
        else
            rows++;
    return counted && rows < count ? wrong_count(&s, rows, count, error) : 0;
}

static void write_pts(struct host_output *out,
                      const struct host_points *points) {
    host_put_line(out, "", points->count, "\n");
    host_put_points(out, points, " ", false);
}

const struct host_format host_format_pts = {
    .name = "Leica",
    .extensions = {".pts"},
    .read_points = read_pts,
    .pieces = true,
    .write_points = write_pts,
};
