/* Convex polygons into pixels, by the part of each pixel that they cover: what
 * cells that adjoin cover adds up to 1, so that no seam shows between them, in
 * whatever order they come.
 *
 * Memory: the raster.  Work: a few ns for each pixel that a polygon covers, and
 * 20 ns for each line of them.
 *
 *     struct host_raster raster = {width, height, pixels};
 *     float red[HOST_CHANNELS] = {1.0f, 0.0f, 0.0f, 1.0f};
 *     double corner[3][2] = {{0.0, 0.0}, {9.5, 0.0}, {0.0, 9.5}};
 *     host_raster_add(&raster, corner, 3, red);
 */
#ifndef HOST_RASTER_H
#define HOST_RASTER_H

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

#endif
