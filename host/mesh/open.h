/* How many tetrahedra are open at a time where points come in the order of
 * bricks: some of their points are there, and others are still to come.  A node
 * that inserts points has to keep at least these
 * (incode/insertion/insertion.h).
 *
 * A sample of the points is triangulated, and one of a fourth of them; how the
 * number grows between the two tells how it goes on: as n^(1/2) for a surface
 * that the order sweeps, as n^(2/3) for a volume, as n where the points lie on
 * the edges of large walls, whose tetrahedra reach across.
 *
 * Memory: 1 MB, while it works.  Work: 2,500 insertions.
 *
 *     if (host_order_open(&order) * 40 > memory)
 *         puts("they will not fit");
 */
#ifndef HOST_ORDER_OPEN_H
#define HOST_ORDER_OPEN_H

#include "order.h"

/* About so many, no more than 14 times the points; 0: the sample lies in a
 * plane, or there is no memory. */
uint64_t host_order_open(const struct host_order *order);

#endif
