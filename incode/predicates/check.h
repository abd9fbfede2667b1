/* Assertions that stay on in production: an invariant that fails stops the
 * node at once, on any board. */
#ifndef INCODE_CHECK_H
#define INCODE_CHECK_H

#define INCODE_ASSERT(condition) ((condition) ? (void)0 : __builtin_trap())

#endif
