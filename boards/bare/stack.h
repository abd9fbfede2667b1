/* The node's stack: the start-up code has filled it with BARE_PAINT, so that
 * what was never used can be told from what was.
 *
 * Work: a pass over the words that were never used. */
#ifndef BOARDS_BARE_STACK_H
#define BOARDS_BARE_STACK_H

#include <stddef.h>
#include <stdint.h>

#define BARE_PAINT UINT32_C(0x5AC3A53C)

/* Bytes above the painted ones at its lower end. */
size_t bare_stack_used(const uint32_t *lowest, size_t bytes);

/* The same of the node's own. */
uint32_t bare_stack_high_water(void);

#endif
