/* Whether bytes that have arrived can be the page that they are said to be.
 * Who has checked them once need not ask again: coordinates are finite and in
 * the box of all points, boxes too, numbers in lists are those of vertices.
 * That the points are the right ones, no node can tell.
 *
 * Memory: none.  Work: a pass over the page, a few operations a number.
 *
 *     if (!incode_page_is_sound(&tree, lo, hi, page, data, bytes))
 *         return -1; // whoever sent it
 */
#ifndef INCODE_SOUND_H
#define INCODE_SOUND_H

#include <stdbool.h>
#include <stddef.h>

#include "pages.h"

/* lo, hi: the box of all points.  data: aligned to 4 bytes. */
bool incode_page_is_sound(const struct incode_tree *tree, const double lo[3],
                          const double hi[3], uint32_t page, const void *data,
                          size_t bytes);

#endif
