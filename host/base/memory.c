#include "memory.h"

#include <stdio.h>
#include <sys/mman.h>
#include <sys/resource.h>

/* Huge pages need their own alignment; below this size they do not matter. */
static const size_t huge = (size_t)2 << 20;

/* Address space, aligned to huge pages where it is large enough. */
static void *reserve(size_t bytes)
{
    size_t extra = bytes >= 2 * huge ? huge : 0;
    char *space = mmap(NULL, bytes + extra, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (space == MAP_FAILED) {
        return NULL;
    }
    if (extra == 0) {
        return space;
    }
    size_t skip = (huge - (uintptr_t)space % huge) % huge;
    if (skip > 0) {
        (void)munmap(space, skip);
    }
    if (extra > skip) {
        size_t page = 4096, end = (bytes + page - 1) / page * page;
        (void)munmap(space + skip + end, extra - skip);
    }
    return space + skip;
}

void *host_map(size_t bytes)
{
    bytes = bytes == 0 ? 1 : bytes;
    void *array = reserve(bytes);
    if (array != NULL) {
        (void)madvise(array, bytes, MADV_HUGEPAGE);
    }
    return array;
}

void *host_remap(void *old, size_t old_bytes, size_t bytes)
{
    if (old == NULL) {
        return host_map(bytes);
    }
    enum { PAGE = 4096 };
    size_t from = (old_bytes + (old_bytes == 0) + PAGE - 1) / PAGE * PAGE;
    size_t to = (bytes + (bytes == 0) + PAGE - 1) / PAGE * PAGE;
    char *space = reserve(to);
    if (space == NULL) {
        return NULL;
    }
    /* Move, then grow: one call for both is more than valgrind can follow. */
    size_t kept = from < to ? from : to;
    void *array = mremap(old, from, kept, MREMAP_MAYMOVE | MREMAP_FIXED, space);
    if (array == MAP_FAILED) {
        (void)munmap(space, to);
        return NULL;
    }
    if (kept < to) {
        (void)munmap(space + kept, to - kept);
        array = mremap(space, kept, to, MREMAP_MAYMOVE);
    }
    if (array == MAP_FAILED) { /* the old array stays as it was */
        (void)mremap(space, kept, kept, MREMAP_MAYMOVE | MREMAP_FIXED, old);
        return NULL;
    }
    return array;
}

void host_unmap(void *array, size_t bytes)
{
    if (array != NULL) {
        (void)munmap(array, bytes == 0 ? 1 : bytes);
    }
}

uint64_t host_memory_peak(void)
{
    char line[128];
    unsigned long long kib = 0;
    struct rusage usage;
    FILE *status = fopen("/proc/self/status", "re");
    while (status != NULL && kib == 0 &&
           fgets(line, sizeof line, status) != NULL) {
        (void)sscanf(line, "VmHWM: %llu kB", &kib);
    }
    if (status != NULL) {
        (void)fclose(status);
    }
    if (kib == 0 && getrusage(RUSAGE_SELF, &usage) == 0) {
        kib = (unsigned long long)usage.ru_maxrss; /* survives exec */
    }
    return kib * 1024;
}
