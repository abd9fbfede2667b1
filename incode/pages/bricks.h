/* How vertices are numbered: in bricks of 64 in spatial order, so that
 *
 *   vertex = 64 * brick + slot
 *
 * Every brick except the last of each region is full.  So vertex numbers tell
 * which points lie together, also without a page of points. */
#ifndef INCODE_BRICKS_H
#define INCODE_BRICKS_H

#include <stdint.h>

enum { INCODE_BRICK_POINTS = 64 /* points a brick, at most */ };

/* No vertex, brick or page. */
#define INCODE_NONE UINT32_MAX

#endif
