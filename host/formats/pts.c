/* Leica's .pts, as scanners write it: a line with the number of points, which
 * may be missing, and as many lines of x, y and z, an intensity and colours
 * behind them.  Several such blocks may follow one another. */
#include <stdio.h>

#include "format.h"
#include "rows.h"
#include "scan.h"

/* Whether the line at hand is a number of points; takes it if so. */
static bool take_count(struct host_scan *s, uint64_t *count) {
    struct host_error none = {0};
    struct host_scan line = *s;
    uint64_t number;
    if (host_scan_unsigned(&line, UINT64_MAX / 16, &number, &none) != 0 ||
        host_scan_more(&line)) {
        return false;
    }
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
    while (host_scan_skip_blank_lines(&s)) {
        if (counted && rows == count && take_count(&s, &count)) {
            rows = 0;
        } else if (counted && rows == count) {
            return wrong_count(&s, rows + 1, count, error);
        } else if (host_take_point(&s, false, mesh->points, error) != 0) {
            return error->code;
        } else {
            rows++;
        }
    }
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
