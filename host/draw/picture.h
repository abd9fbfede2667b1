/* A section as a picture: where its cells lie in it, their colours - the
 * smaller a tetrahedron is, the bluer - and the formats that it is written in.
 */
#ifndef HOST_PICTURE_H
#define HOST_PICTURE_H

#include "host/formats/output.h"
#include "section.h"

/* Convex polygons into pixels, by the part of each pixel that they cover: what
 * cells that adjoin cover adds up to 1, so that no seam shows between them, in
 * whatever order they come.
 *
 * Work: a few ns for each pixel that a polygon covers, and 20 ns for each
 * line of them. */

/* Red, green and blue times the covered part; that part; the part that lines
 * cover. */
enum { HOST_CHANNELS = 5 };

struct host_raster {
    unsigned width, height;
    float (*pixels)[HOST_CHANNELS]; /* [width * height], row by row */
};

/* Adds `channels` times the covered part to each pixel.  What lies outside is
 * left out. */
void host_raster_add(struct host_raster *raster, double corner[][2],
                     unsigned corners, const float channels[HOST_CHANNELS]);

enum {
    HOST_PICTURE_MIN = 16, /* pixels a side */
    HOST_PICTURE_MAX = 8192,
    HOST_COLOURS = 41 /* of cells, from blue to light green */
};

struct host_picture {
    const struct host_section *section;
    unsigned width, height; /* pixels */
    double scale;           /* pixels that the section's longer side takes */
    double line;            /* width of the cells' edges in pixels */
    uint64_t merged;        /* cells too small to be drawn by themselves */
};

/* So many pixels wide; a section that is more than twice as high as wide
 * becomes narrower. */
struct host_picture host_picture_of(const struct host_section *section,
                                    unsigned width);

/* The cell's colour, 0 to HOST_COLOURS - 1, and a colour as 0xrrggbb. */
enum { HOST_PICTURE_EDGES = 0x1b2a41 };

typedef int host_picture_writer(struct host_output *out,
                                struct host_picture *picture,
                                struct host_error *error);

/* A format of pictures is a row of picture.c. */
struct host_picture_format {
    const char *extension;
    host_picture_writer *write;
};
extern host_picture_writer host_picture_svg, host_picture_png;

/* By the extension; "-" is the first of the table.  NULL: none has it. */
const struct host_picture_format *host_picture_format(const char *path);

/* ".svg .png": the extensions that there are. */
void host_picture_formats(char *text, size_t size);

#endif
