#include "picture.h"

#include <math.h>
#include <png.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"

enum {
    HEIGHT_MAX = 2,
    MARGIN = 1,
    AROUND = 1 << 16 /* bytes that one place far from others touches */
};

static const struct host_picture_format formats[] = {
    {".svg", host_picture_svg}, {".png", host_picture_png}};
enum { FORMATS = sizeof formats / sizeof formats[0] };

const struct host_picture_format *host_picture_format(const char *path) {
    const char *dot = strrchr(path, '.');
    for (unsigned i = 0; i < FORMATS; i++)
        if (strcmp(path, "-") == 0 ||
            (dot != NULL && strcasecmp(dot, formats[i].extension) == 0))
            return &formats[i];
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

/* A corner's place in pixels, from the upper left. */
static void host_picture_place(const struct host_picture *picture,
                               const float corner[2], double at[2]) {
    at[0] = MARGIN + picture->scale * (double)corner[0];
    at[1] = MARGIN + picture->scale *
                         (picture->section->proportion[1] - (double)corner[1]);
}

static unsigned host_picture_colour(const struct host_picture *picture,
                                    const struct host_cell *cell) {
    double less = picture->section->size_mean - (double)cell->size;
    double colour = 22.0 - 11.0 * less;
    return colour < 0.0                ? 0
           : colour > HOST_COLOURS - 1 ? HOST_COLOURS - 1
                                       : (unsigned)colour;
}

/* Hue, of which 60 % are saturated, and lightness, as CSS has them. */
static uint32_t host_picture_rgb(unsigned colour) {
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

/* --- raster --------------------------------------------------------------- */

/* Lines that are sampled in each row of pixels; along them, the covered part is
 * exact. */
enum { LINES = 4 };

static void add_part(struct host_raster *raster, unsigned x, unsigned y,
                     double part, const float channels[HOST_CHANNELS]) {
    float *pixel = raster->pixels[(size_t)y * raster->width + x];
    for (unsigned k = 0; k < HOST_CHANNELS; k++)
        pixel[k] += (float)(part / LINES) * channels[k];
}

/* From x0 to x1 of one line in row y. */
static void add_line(struct host_raster *raster, unsigned y, double x0,
                     double x1, const float channels[HOST_CHANNELS]) {
    x0 = fmax(x0, 0.0);
    x1 = fmin(x1, raster->width);
    host_call_trim(AROUND);
    for (unsigned x = (unsigned)fmax(x0, 0.0); x < x1; x++)
        add_part(raster, x, y, fmin(x1, x + 1.0) - fmax(x0, x), channels);
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
        if (x0 < x1 && line < (long)raster->height * LINES)
            add_line(raster, (unsigned)(line / LINES), x0, x1, channels);
    }
}

/* PNG: the cells and their edges, drawn into pixels (raster.h), on white.
 *
 * Memory: 23 bytes a pixel, and the file. */

static void channels_of(uint32_t rgb, float channels[HOST_CHANNELS]) {
    for (int k = 0; k < 3; k++)
        channels[k] = (float)(rgb >> (16 - 8 * k) & 255);
    channels[3] = 1.0f;
    channels[4] = 0.0f;
}

/* A line as a rectangle of half the weight: two cells share it. */
static void draw_edge(struct host_raster *raster, const double a[2],
                      const double b[2], double line) {
    static const float dark[HOST_CHANNELS] = {0.0f, 0.0f, 0.0f, 0.0f, 0.5f};
    double dx = b[0] - a[0], dy = b[1] - a[1], length = hypot(dx, dy);
    if (length > 0.0) {
        double u = -0.5 * line * dy / length, v = 0.5 * line * dx / length;
        double corner[4][2] = {{a[0] + u, a[1] + v},
                               {b[0] + u, b[1] + v},
                               {b[0] - u, b[1] - v},
                               {a[0] - u, a[1] - v}};
        host_raster_add(raster, corner, 4, dark);
    }
}

static void draw_cells(struct host_raster *raster,
                       const struct host_picture *picture) {
    const struct host_section *section = picture->section;
    for (uint64_t i = 0; i < section->count; i++) {
        const struct host_cell *cell = &section->cells[i];
        host_call_trim(sizeof *cell);
        float channels[HOST_CHANNELS];
        double corner[4][2];
        unsigned colour = host_picture_colour(picture, cell);
        channels_of(host_picture_rgb(colour), channels);
        for (unsigned k = 0; k < cell->corners; k++)
            host_picture_place(picture, cell->corner[k], corner[k]);
        host_raster_add(raster, corner, cell->corners, channels);
        for (unsigned k = 0; picture->line > 0.0 && k < cell->corners; k++) {
            draw_edge(raster, corner[k], corner[(k + 1) % cell->corners],
                      picture->line);
        }
    }
}

static png_byte level(double value) {
    return (png_byte)lround(fmin(fmax(value, 0.0), 255.0));
}

/* Cells over white, edges over cells. */
static void blend(const struct host_raster *raster, png_byte *bytes) {
    float edges[HOST_CHANNELS];
    channels_of(HOST_PICTURE_EDGES, edges);
    for (size_t i = 0; i < (size_t)raster->width * raster->height; i++) {
        const float *pixel = raster->pixels[i];
        host_call_trim(sizeof raster->pixels[i] + 3);
        double clear = fmax(0.0, 1.0 - (double)pixel[3]);
        double dark = fmin(1.0, (double)pixel[4]);
        for (int k = 0; k < 3; k++) {
            double cells = (double)pixel[k] + 255.0 * clear;
            bytes[3 * i + (size_t)k] =
                level(cells + dark * ((double)edges[k] - cells));
        }
    }
}

static int write_png(struct host_output *out, unsigned width, unsigned height,
                     const png_byte *bytes, struct host_error *error) {
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = width,
                       .height = height,
                       .format = PNG_FORMAT_RGB};
    png_alloc_size_t room = PNG_IMAGE_PNG_SIZE_MAX(image), size = room;
    void *file = host_map(room);
    if (file == NULL ||
        png_image_write_to_memory(&image, file, &size, 0, bytes, 0, NULL) == 0)
        host_fail_memory(error, "the picture");
    else
        host_output_bytes(out, file, size);
    host_unmap(file, room);
    return error->code;
}

/* libpng takes pixels and file as a whole, which the limit of memory has to
 * allow. */
static int check_size(const struct host_picture *picture,
                      struct host_error *error) {
    size_t once = (size_t)6 * picture->width * picture->height;
    if (once / host_threads() / 2 <= host_call_share())
        return 0;
    return host_fail(error, HOST_INPUT,
                     "--width: a .png of %u x %u pixels is made as a whole; "
                     "give --host-memory %zuM or more, a smaller --width, or "
                     "an .svg",
                     picture->width, picture->height, (4 * once >> 20) + 1);
}

int host_picture_png(struct host_output *out, struct host_picture *picture,
                     struct host_error *error) {
    struct host_raster raster = {picture->width, picture->height, NULL};
    if (check_size(picture, error) != 0)
        return error->code;
    size_t pixels = (size_t)picture->width * picture->height;
    png_byte *bytes = host_map(3 * pixels);
    raster.pixels = host_map(pixels * sizeof *raster.pixels);
    if (raster.pixels == NULL || bytes == NULL) {
        host_fail_memory(error, "the picture");
    } else {
        draw_cells(&raster, picture);
        blend(&raster, bytes);
        write_png(out, picture->width, picture->height, bytes, error);
    }
    host_unmap(raster.pixels, pixels * sizeof *raster.pixels);
    host_unmap(bytes, 3 * pixels);
    return error->code;
}

/* SVG, in quarters of a pixel: one path a colour, its cells as relative moves,
 * some 15 bytes each.  Cells that lie within one pixel are not worth a line of
 * their own: a pixel that holds any is painted once, in their mean colour,
 * beneath the others, so that the file is bounded by its pixels and by the
 * cells that can be seen.
 *
 * Memory: 8 bytes a pixel. */

enum { QUARTERS = 4, NUMBER = 20 };

/* Of the cells that lie within it. */
struct pixel {
    uint32_t cells, colours; /* how many; the sum of their colours */
};

struct svg {
    struct host_output *out;
    struct host_picture *picture;
    struct pixel *pixels;
    long at[2]; /* where the path's last cell began */
};

/* The cell's corners in quarters, those that fall together taken as one. */
static unsigned quarters(const struct host_picture *picture,
                         const struct host_cell *cell, long at[4][2]) {
    unsigned n = 0;
    for (unsigned k = 0; k < cell->corners; k++) {
        double place[2];
        host_picture_place(picture, cell->corner[k], place);
        at[n][0] = lround(QUARTERS * place[0]);
        at[n][1] = lround(QUARTERS * place[1]);
        bool same =
            n > 0 && at[n][0] == at[n - 1][0] && at[n][1] == at[n - 1][1];
        n += same ? 0 : 1;
    }
    bool closed = n > 1 && at[0][0] == at[n - 1][0] && at[0][1] == at[n - 1][1];
    return closed ? n - 1 : n;
}

/* The one pixel that all of it lies in; NULL: it is larger. */
static struct pixel *pixel_of(const struct svg *s, long at[4][2], unsigned n) {
    long lo[2] = {at[0][0], at[0][1]}, hi[2] = {lo[0], lo[1]};
    for (unsigned k = 1; k < n; k++) {
        for (unsigned d = 0; d < 2; d++) {
            lo[d] = at[k][d] < lo[d] ? at[k][d] : lo[d];
            hi[d] = at[k][d] > hi[d] ? at[k][d] : hi[d];
        }
    }
    return hi[0] - lo[0] > QUARTERS || hi[1] - lo[1] > QUARTERS
               ? NULL
               : &s->pixels[(size_t)(lo[1] / QUARTERS) * s->picture->width +
                            (size_t)(lo[0] / QUARTERS)];
}

static void merge(struct svg *s) {
    const struct host_section *section = s->picture->section;
    for (uint64_t i = 0; i < section->count; i++) {
        const struct host_cell *cell = &section->cells[i];
        host_call_trim(sizeof *cell + AROUND);
        long at[4][2] = {{0}};
        unsigned n = quarters(s->picture, cell, at);
        struct pixel *pixel = pixel_of(s, at, n);
        if (pixel != NULL) {
            pixel->cells++;
            pixel->colours += host_picture_colour(s->picture, cell);
            s->picture->merged++;
        }
    }
}

static void put_pair(struct svg *s, const char *command, long x, long y) {
    char text[2 * NUMBER + 4];
    snprintf(text, sizeof text, "%s%ld%s%ld", command, x, y < 0 ? "" : " ", y);
    host_output_text(s->out, text);
}

static void begin_path(struct svg *s, unsigned colour) {
    char text[64];
    snprintf(text, sizeof text, "<path fill=\"#%06x\" d=\"M0 0",
             host_picture_rgb(colour));
    host_output_text(s->out, text);
    s->at[0] = s->at[1] = 0;
}

static void end_path(struct svg *s) {
    host_output_text(s->out, "\"/>\n");
}

/* To the start of another cell. */
static void move(struct svg *s, long x, long y) {
    put_pair(s, "m", x - s->at[0], y - s->at[1]);
    s->at[0] = x;
    s->at[1] = y;
}

static void put_pixels(struct svg *s, unsigned colour) {
    unsigned width = s->picture->width, height = s->picture->height;
    bool any = false;
    for (size_t i = 0; i < (size_t)width * height; i++) {
        const struct pixel *p = &s->pixels[i];
        host_call_trim(sizeof *p);
        if (p->cells == 0 || p->colours / p->cells != colour)
            continue;
        if (!any)
            begin_path(s, colour);
        any = true;
        move(s, QUARTERS * (long)(i % width), QUARTERS * (long)(i / width));
        host_output_text(s->out, "h4v4h-4z");
    }
    if (any)
        end_path(s);
}

static void put_cells(struct svg *s, unsigned colour) {
    const struct host_section *section = s->picture->section;
    bool any = false;
    for (uint64_t i = 0; i < section->count; i++) {
        const struct host_cell *cell = &section->cells[i];
        host_call_trim(sizeof *cell);
        if (host_picture_colour(s->picture, cell) != colour)
            continue;
        long at[4][2] = {{0}};
        unsigned n = quarters(s->picture, cell, at);
        if (pixel_of(s, at, n) != NULL)
            continue;
        if (!any)
            begin_path(s, colour);
        any = true;
        move(s, at[0][0], at[0][1]);
        for (unsigned k = 1; k < n; k++) {
            put_pair(s,
                     k == 1                        ? "l"
                     : at[k][0] - at[k - 1][0] < 0 ? ""
                                                   : " ",
                     at[k][0] - at[k - 1][0], at[k][1] - at[k - 1][1]);
        }
        host_output_text(s->out, "z");
    }
    if (any)
        end_path(s);
}

int host_picture_svg(struct host_output *out, struct host_picture *picture,
                     struct host_error *error) {
    struct svg s = {.out = out, .picture = picture};
    size_t pixels = (size_t)picture->width * picture->height;
    char text[256];
    s.pixels = host_map(pixels * sizeof *s.pixels);
    if (s.pixels == NULL)
        return host_fail_memory(error, "the picture");
    merge(&s);
    snprintf(text, sizeof text,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%u\" "
             "height=\"%u\" viewBox=\"0 0 %u %u\">\n",
             picture->width, picture->height, QUARTERS * picture->width,
             QUARTERS * picture->height);
    host_output_text(out, text);
    for (unsigned colour = 0; colour < HOST_COLOURS; colour++)
        put_pixels(&s, colour);
    snprintf(text, sizeof text,
             "<g stroke=\"#%06x\" stroke-width=\"%.2g\" "
             "stroke-linejoin=\"round\"%s>\n",
             HOST_PICTURE_EDGES, QUARTERS * picture->line,
             picture->line > 0.0 ? "" : " shape-rendering=\"crispEdges\"");
    host_output_text(out, text);
    for (unsigned colour = 0; colour < HOST_COLOURS; colour++)
        put_cells(&s, colour);
    host_output_text(out, "</g>\n</svg>\n");
    host_unmap(s.pixels, pixels * sizeof *s.pixels);
    return 0;
}
