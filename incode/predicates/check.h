/* Assertions that stay on in production: an invariant that fails stops the
 * node at once, on any board.
 *
 * Memory: none.  Work: that of the condition.
 *
 *     INCODE_ASSERT(count <= 64);
 */
#ifndef INCODE_CHECK_H
#define INCODE_CHECK_H

#define INCODE_ASSERT(condition) ((condition) ? (void)0 : __builtin_trap())

#endif
