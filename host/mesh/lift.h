/* Lumps of points, bricks and all that is below a page, and their lifted boxes
 * (incode/pages/pages.h). */
#ifndef HOST_LIFT_H
#define HOST_LIFT_H

#include <stdint.h>

#include "incode/pages/pages.h"

/* Its tight box, and sums over its points y in the box's own frame
 * (incode_boxes_frame).  A point that is repeated to fill a brick counts each
 * time: the sums only propose. */
struct host_lump {
    double lo[3], hi[3];
    double origin[3], unit;
    double count;
    double y[3];
    double yy[6];     /* xx, yy, zz, yz, zx, xy */
    double y_square;  /* |y|^4 */
    double y_cube[3]; /* |y|^2 y */
};

void host_lump_brick(struct host_lump *lump, const struct incode_brick *brick);

/* Of `count` lumps, at least one. */
void host_lump_join(struct host_lump *lump, const struct host_lump *of,
                    uint32_t count);

/* Sets a child's lifted box, after its box along the axes; the lump is that of
 * these bricks. */
void host_lift(struct incode_boxes *boxes, unsigned child,
               const struct host_lump *lump, const struct incode_brick *brick,
               uint32_t bricks);

#endif
