/* What nodes that are processes of a system have in common, whatever brings
 * their bytes. */
#ifndef BOARDS_PROCESS_H
#define BOARDS_PROCESS_H

#include <stddef.h>
#include <stdint.h>
#include <time.h>

enum { PROCESS_PAGE = 4096, PROCESS_AT_ONCE = 16 << 20 };

/* Bytes of the program's own .data and .bss, in whole pages, as the kernel
 * counts them. */
size_t process_static_bytes(void);

uint64_t process_clock_us(clockid_t clock);

/* Memory for an arena, zeroed; up to PROCESS_AT_ONCE all of it at once, so that
 * no page is found missing while others wait.  More would take the system
 * seconds, and much of it may never be used.  NULL: it is not granted. */
void *process_arena(size_t bytes);

#endif
