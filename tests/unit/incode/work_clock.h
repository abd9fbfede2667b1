/* A clock of work instead of time: the compiler has each basic block of incode/
 * call a function here, and what is copied or cleared counts by its size.  So
 * the number is the same on every machine, however busy, and what a test does
 * itself does not count.  The Makefile names the tests that are linked with
 * incode/ compiled so. */
#ifndef TESTS_UNIT_WORK_CLOCK_H
#define TESTS_UNIT_WORK_CLOCK_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { WORK_BYTES = 64 }; /* moved or compared in the time of a block */

static uint64_t work_blocks;

/* NOLINTNEXTLINE(bugprone-reserved-identifier) */
void __sanitizer_cov_trace_pc(void);
void *work_memcpy(void *to, const void *from, size_t bytes);
void *work_memmove(void *to, const void *from, size_t bytes);
void *work_memset(void *to, int byte, size_t bytes);
int work_memcmp(const void *a, const void *b, size_t bytes);

/* NOLINTNEXTLINE(bugprone-reserved-identifier) */
void __sanitizer_cov_trace_pc(void) {
    work_blocks++;
}

void *work_memcpy(void *to, const void *from, size_t bytes) {
    work_blocks += bytes / WORK_BYTES;
    return memcpy(to, from, bytes);
}

void *work_memmove(void *to, const void *from, size_t bytes) {
    work_blocks += bytes / WORK_BYTES;
    return memmove(to, from, bytes);
}

void *work_memset(void *to, int byte, size_t bytes) {
    work_blocks += bytes / WORK_BYTES;
    return memset(to, byte, bytes);
}

int work_memcmp(const void *a, const void *b, size_t bytes) {
    work_blocks += bytes / WORK_BYTES;
    return memcmp(a, b, bytes);
}

#endif
