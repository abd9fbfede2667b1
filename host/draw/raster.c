#include "raster.h"

#include <math.h>
#include <stddef.h>

/* Lines that are sampled in each row of pixels; along them, the covered part is
 * exact. */
enum { LINES = 4 };

static void add_part(struct host_raster *raster, unsigned x, unsigned y,
                     double part, const float channels[HOST_CHANNELS]) {
    float *pixel = raster->pixels[(size_t)y * raster->width + x];
    for (unsigned k = 0; k < HOST_CHANNELS; k++) {
        pixel[k] += (float)(part / LINES) * channels[k];
    }
}

/* From x0 to x1 of one line in row y. */
static void add_line(struct host_raster *raster, unsigned y, double x0,
                     double x1, const float channels[HOST_CHANNELS]) {
    x0 = fmax(x0, 0.0);
    x1 = fmin(x1, raster->width);
    for (unsigned x = (unsigned)fmax(x0, 0.0); x < x1; x++) {
        add_part(raster, x, y, fmin(x1, x + 1.0) - fmax(x0, x), channels);
    }
}

void host_raster_add(struct host_raster *raster, double corner[][2],
                     unsigned corners, const float channels[HOST_CHANNELS]) {
    double top = corner[0][1], bottom = corner[0][1];
    for (unsigned k = 1; k < corners; k++) {
        top = fmin(top, corner[k][1]);
        bottom = fmax(bottom, corner[k][1]);
    }
    long last = (long)(fmin(bottom, raster->height) * LINES);
    for (long line = (long)(fmax(top, 0.0) * LINES); line <= last; line++) {
        double y = ((double)line + 0.5) / LINES, x0 = INFINITY, x1 = -INFINITY;
        for (unsigned k = 0; k < corners; k++) {
            const double *a = corner[k], *b = corner[(k + 1) % corners];
            if ((a[1] <= y) != (b[1] <= y)) {
                double x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
                x0 = fmin(x0, x);
                x1 = fmax(x1, x);
            }
        }
        if (x0 < x1 && line < (long)raster->height * LINES) {
            add_line(raster, (unsigned)(line / LINES), x0, x1, channels);
        }
    }
}
