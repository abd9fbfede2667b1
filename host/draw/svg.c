/* SVG, in quarters of a pixel: one path a colour, its cells as relative moves,
 * some 15 bytes each.  Cells that lie within one pixel are not worth a line of
 * their own: a pixel that holds any is painted once, in their mean colour,
 * beneath the others, so that the file is bounded by its pixels and by the
 * cells that can be seen.
 *
 * Memory: 8 bytes a pixel. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include "host/base/memory.h"
#include "picture.h"

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
        if (p->cells == 0 || p->colours / p->cells != colour) {
            continue;
        }
        if (!any) {
            begin_path(s, colour);
        }
        any = true;
        move(s, QUARTERS * (long)(i % width), QUARTERS * (long)(i / width));
        host_output_text(s->out, "h4v4h-4z");
    }
    if (any) {
        end_path(s);
    }
}

static void put_cells(struct svg *s, unsigned colour) {
    const struct host_section *section = s->picture->section;
    bool any = false;
    for (uint64_t i = 0; i < section->count; i++) {
        const struct host_cell *cell = &section->cells[i];
        if (host_picture_colour(s->picture, cell) != colour) {
            continue;
        }
        long at[4][2] = {{0}};
        unsigned n = quarters(s->picture, cell, at);
        if (pixel_of(s, at, n) != NULL) {
            continue;
        }
        if (!any) {
            begin_path(s, colour);
        }
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
    if (any) {
        end_path(s);
    }
}

int host_picture_svg(struct host_output *out, struct host_picture *picture,
                     struct host_error *error) {
    struct svg s = {.out = out, .picture = picture};
    size_t pixels = (size_t)picture->width * picture->height;
    char text[256];
    s.pixels = host_map(pixels * sizeof *s.pixels);
    if (s.pixels == NULL) {
        return host_fail_memory(error, "the picture");
    }
    merge(&s);
    snprintf(text, sizeof text,
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%u\" "
             "height=\"%u\" viewBox=\"0 0 %u %u\">\n",
             picture->width, picture->height, QUARTERS * picture->width,
             QUARTERS * picture->height);
    host_output_text(out, text);
    for (unsigned colour = 0; colour < HOST_COLOURS; colour++) {
        put_pixels(&s, colour);
    }
    snprintf(text, sizeof text,
             "<g stroke=\"#%06x\" stroke-width=\"%.2g\" "
             "stroke-linejoin=\"round\"%s>\n",
             HOST_PICTURE_EDGES, QUARTERS * picture->line,
             picture->line > 0.0 ? "" : " shape-rendering=\"crispEdges\"");
    host_output_text(out, text);
    for (unsigned colour = 0; colour < HOST_COLOURS; colour++) {
        put_cells(&s, colour);
    }
    host_output_text(out, "</g>\n</svg>\n");
    host_unmap(s.pixels, pixels * sizeof *s.pixels);
    return 0;
}
