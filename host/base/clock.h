/* The clock by which the host measures and waits.
 *
 * Memory: none.  Work: one look at the clock, no system call.
 *
 *     uint64_t start_us = host_now_us();
 *     uint64_t elapsed_us = host_now_us() - start_us;
 *     return elapsed_us > 1000000;
 */
#ifndef HOST_CLOCK_H
#define HOST_CLOCK_H

#include <stdint.h>

/* Microseconds since any fixed time, never going back. */
uint64_t host_now_us(void);

#endif
