/* PNG: the cells and their edges, drawn into pixels (raster.h), on white.
 *
 * Memory: 23 bytes a pixel, and the file. */
#include <math.h>
#include <png.h>
#include <string.h>

#include "host/base/memory.h"
#include "picture.h"
#include "raster.h"

static void channels_of(uint32_t rgb, float channels[HOST_CHANNELS]) {
    for (int k = 0; k < 3; k++) {
        channels[k] = (float)(rgb >> (16 - 8 * k) & 255);
    }
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
        float channels[HOST_CHANNELS];
        double corner[4][2];
        unsigned colour = host_picture_colour(picture, cell);
        channels_of(host_picture_rgb(colour), channels);
        for (unsigned k = 0; k < cell->corners; k++) {
            host_picture_place(picture, cell->corner[k], corner[k]);
        }
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
    if (file == NULL || png_image_write_to_memory(&image, file, &size, 0, bytes,
                                                  0, NULL) == 0) {
        host_fail_memory(error, "the picture");
    } else {
        host_output_bytes(out, file, size);
    }
    host_unmap(file, room);
    return error->code;
}

int host_picture_png(struct host_output *out, struct host_picture *picture,
                     struct host_error *error) {
    struct host_raster raster = {picture->width, picture->height, NULL};
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
