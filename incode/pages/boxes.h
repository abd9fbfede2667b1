/* Pages of the tree: for each of up to 32 children a box along the axes and a
 * lifted box, that of its points in four dimensions.
 *
 * Lifted to (p, |p|^2), what is inside a sphere is a half-space (Brown,
 * Information Processing Letters 9, 1979), and points of one plane, one sphere
 * or one line are flat.  A lifted box has a centre o and three half axes a_k in
 * space, along the principal axes of the points, and below them a lid: each
 * point p is o + sum(s_k a_k) with every |s_k| <= 1, up to a part in 2^20 of
 * the radius, and
 *
 *   |p - o|^2 >= lid + sum(s_k slope_k).
 *
 * So for any D >= 0 and F(p) = D |p|^2 + linear terms, with g the gradient of F
 * at o, no point has less than
 *
 *   F(o) + D lid - sum |g . a_k + D slope_k|      (widened by its rounding)
 *
 * and where that is above 0, none lies in the sphere F = 0.
 *
 * Memory: 1,568 bytes a page, in single precision and less, relative to the
 * page's own origin, everything rounded outward.  Work: constant.
 *
 *     incode_boxes_axes(boxes, from, to);
 *     if (incode_boxes_lifted(boxes, child, &lifted))
 *         radius = lifted.radius * boxes->unit;
 */
#ifndef INCODE_BOXES_H
#define INCODE_BOXES_H

#include <stdbool.h>
#include <stdint.h>

enum { INCODE_FANOUT = 32 /* children a box page, at most */ };

/* Rows begin at multiples of 64 bytes.  Coordinates are origin + unit x, unit a
 * normal power of two, about half the longest side of all children; |x| <= 2.
 * Absent children have lo > hi (+inf, -inf) in every dimension. */
struct incode_boxes {
    float lo[3][INCODE_FANOUT];
    float hi[3][INCODE_FANOUT];
    /* Of the lifted boxes; the axes' box has centre m and size e, half its
     * longest side. */
    int16_t centre[3][INCODE_FANOUT]; /* of the centre less m, e / 32767 each */
    int16_t turn[3][INCODE_FANOUT];   /* x, y and z of the unit quaternion that
                                         turns the axes, 1 / 32767 each; its w
                                         is not negative */
    uint16_t half[3][INCODE_FANOUT];  /* lengths of half axes, in half
                                         precision (binary16), times e */
    int8_t slope[3][INCODE_FANOUT];   /* e^2 / 32 each */
    uint8_t
        is_lifted[INCODE_FANOUT]; /* 0: it says no more than the axes' box */
    int16_t lid[INCODE_FANOUT];   /* e^2 / 8192 each */
    double origin[3];
    double unit;
};

/* A lifted box, relative to the page's origin and in its units. */
struct incode_lifted {
    double o[3];
    double a[3][3]; /* a[k]: half axis k */
    double slope[3];
    double lid;
    double radius; /* no point is farther from o: in rounding's bounds */
};

/* The frame of all that lies in a box: x = (p - origin) / unit overflows
 * nowhere, and is between -2 and 2. */
void incode_boxes_frame(const double lo[3], const double hi[3],
                        double origin[3], double *unit);

/* No children yet; lo..hi: the box of all that there will be. */
void incode_boxes_init(struct incode_boxes *boxes, const double lo[3],
                       const double hi[3]);

/* Sets a child's box along the axes, rounded outward; no lifted box. */
void incode_boxes_set(struct incode_boxes *boxes, unsigned child,
                      const double lo[3], const double hi[3]);

/* The children's boxes along the axes in absolute coordinates, which hold all
 * that was set. */
void incode_boxes_axes(const struct incode_boxes *boxes,
                       double lo[3][INCODE_FANOUT],
                       double hi[3][INCODE_FANOUT]);

/* The directions of a child's half axes, axis[k] that of k: of length 1 and at
 * right angles within a part in 2^48, in any case finite. */
void incode_boxes_turned(const struct incode_boxes *boxes, unsigned child,
                         double axis[3][3]);

/* A child's lifted box, the same numbers on every machine; false: it has none.
 */
bool incode_boxes_lifted(const struct incode_boxes *boxes, unsigned child,
                         struct incode_lifted *lifted);

#endif
