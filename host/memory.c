#include "memory.h"

#include <stdint.h>
#include <sys/mman.h>

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
    void *space = reserve(bytes == 0 ? 1 : bytes);
    if (space == NULL) {
        return NULL;
    }
    void *array =
        mremap(old, old_bytes == 0 ? 1 : old_bytes, bytes == 0 ? 1 : bytes,
               MREMAP_MAYMOVE | MREMAP_FIXED, space);
    if (array == MAP_FAILED) {
        (void)munmap(space, bytes == 0 ? 1 : bytes);
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
