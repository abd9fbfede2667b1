/* Assertions that stay on in production: an invariant that fails stops the
 * node at once, on any board. */
#ifndef TRANSPORT_CHECK_H
#define TRANSPORT_CHECK_H

#define LINK_ASSERT(condition) ((condition) ? (void)0 : __builtin_trap())

#endif
