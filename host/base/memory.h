/* Large arrays straight from the kernel: zeroed, on huge pages where there are
 * any, grown without a copy, given back at once; and how much is left.  In a
 * call whose resident memory is limited they are put aside (scratch.h).
 *
 * Memory: what is touched, rounded up to 4 KiB. */
#ifndef HOST_MEMORY_H
#define HOST_MEMORY_H

#include <stddef.h>
#include <stdint.h>

/* NULL where there is no memory, or no more for this thread's call
 * (parallel.h); 0 bytes are taken as 1. */
void *host_map(size_t bytes);

/* The same of an array that is never put aside: at most two of a thread's parts
 * of the limit (host_call_share). */
void *host_map_resident(size_t bytes);

/* Copies a part of an array, or into one.  If the array is put aside, none of
 * its pages becomes resident. */
void host_fetch(void *to, const void *from, size_t bytes);
void host_store(void *to, const void *from, size_t bytes);

/* Like realloc: on NULL the old array still stands. */
void *host_remap(void *old, size_t old_bytes, size_t bytes);

/* NULL is allowed. */
void host_unmap(void *array, size_t bytes);

/* The most bytes of memory that this program ever had: its own, not those of
 * the process that became it. */
uint64_t host_memory_peak(void);

/* Bytes that this program can still take without swapping: the least of what
 * the kernel holds available on this machine, what the control groups of this
 * process leave, and what its limits (ulimit -v, -d) leave.  What does not say
 * anything, limits nothing. */
uint64_t host_memory_available(void);

/* What the memory controllers of both versions leave to the groups in `list`
 * (as /proc/self/cgroup has them) and to those above them, which are mounted at
 * `mount`; the cache of files that nobody uses counts as free.  UINT64_MAX: no
 * limit. */
uint64_t host_memory_in_groups(const char *list, const char *mount);

#endif
