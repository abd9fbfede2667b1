#include "picture.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { HEIGHT_MAX = 2, MARGIN = 1 };

static const struct host_picture_format formats[] = {
    {".svg", host_picture_svg}, {".png", host_picture_png}};
enum { FORMATS = sizeof formats / sizeof formats[0] };

const struct host_picture_format *host_picture_format(const char *path) {
    const char *dot = strrchr(path, '.');
    for (unsigned i = 0; i < FORMATS; i++) {
        if (strcmp(path, "-") == 0 ||
            (dot != NULL && strcasecmp(dot, formats[i].extension) == 0)) {
            return &formats[i];
        }
    }
    return NULL;
}

void host_picture_formats(char *text, size_t size) {
    size_t used = 0;
    for (unsigned i = 0; i < FORMATS && used < size; i++) {
        used += (size_t)snprintf(text + used, size - used, "%s%s",
                                 i == 0 ? "" : " ", formats[i].extension);
    }
}

struct host_picture host_picture_of(const struct host_section *section,
                                    unsigned width) {
    struct host_picture p = {.section = section};
    double inner = (double)width - 2 * MARGIN;
    double wide = section->proportion[0], high = section->proportion[1];
    p.scale = inner / (wide > high / HEIGHT_MAX ? wide : high / HEIGHT_MAX);
    p.width = (unsigned)ceil(p.scale * wide - 1e-6) + 2 * MARGIN;
    p.height = (unsigned)ceil(p.scale * high - 1e-6) + 2 * MARGIN;
    /* As many squares of one size would have it. */
    double cell = p.scale * sqrt(wide * high / (double)(section->count | 1));
    p.line = cell < 2.0 ? 0.0 : cell < 10.0 ? cell / 20.0 : 0.5;
    return p;
}

void host_picture_place(const struct host_picture *picture,
                        const float corner[2], double at[2]) {
    at[0] = MARGIN + picture->scale * (double)corner[0];
    at[1] = MARGIN + picture->scale *
                         (picture->section->proportion[1] - (double)corner[1]);
}

unsigned host_picture_colour(const struct host_picture *picture,
                             const struct host_cell *cell) {
    double less = picture->section->size_mean - (double)cell->size;
    double colour = 22.0 - 11.0 * less;
    return colour < 0.0                ? 0
           : colour > HOST_COLOURS - 1 ? HOST_COLOURS - 1
                                       : (unsigned)colour;
}

/* Hue, of which 60 % are saturated, and lightness, as CSS has them. */
uint32_t host_picture_rgb(unsigned colour) {
    double hue = (225.0 - 4.0 * colour) / 30.0;
    double light = 0.38 + 0.012 * colour;
    double half = 0.6 * (light < 0.5 ? light : 1.0 - light);
    static const double shift[3] = {0.0, 8.0, 4.0};
    uint32_t rgb = 0;
    for (int k = 0; k < 3; k++) {
        double at = fmod(shift[k] + hue, 12.0);
        double peak = fmin(fmin(at - 3.0, 9.0 - at), 1.0);
        double value = light - half * fmax(-1.0, peak);
        rgb = rgb << 8 | (uint32_t)lround(255.0 * value);
    }
    return rgb;
}
