/* Points as text: .xyz and .txt, with blanks, commas or semicolons between the
 * numbers, and .csv.  The first line of either may name the columns. */
#include "csv.h"
#include "format.h"
#include "rows.h"
#include "scan.h"

static int read_text(const struct host_source *source, bool is_csv,
                     struct host_points *points, struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    struct host_csv csv = {0};
    double xyz[3];
    if (host_csv_header(&csv, &s, error) != 0) {
        return error->code;
    }
    points->named = csv.fields > 0;
    while (host_scan_skip_blank_lines(&s)) {
        int status = csv.fields == 0
                         ? host_take_point(&s, is_csv, points, error)
                     : host_csv_row(&csv, &s, xyz, error) == 0
                         ? host_points_append(points, xyz, 1, error)
                         : error->code;
        if (status != 0) {
            return status;
        }
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
