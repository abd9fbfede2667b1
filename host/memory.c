#include "memory.h"

#include <sys/mman.h>

void *host_map(size_t bytes) {
    bytes = bytes == 0 ? 1 : bytes;
    void *array = mmap(NULL, bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (array == MAP_FAILED) {
        return NULL;
    }
    (void)madvise(array, bytes, MADV_HUGEPAGE);
    return array;
}

void *host_remap(void *old, size_t old_bytes, size_t bytes) {
    if (old == NULL) {
        return host_map(bytes);
    }
    void *array = mremap(old, old_bytes == 0 ? 1 : old_bytes,
                         bytes == 0 ? 1 : bytes, MREMAP_MAYMOVE);
    return array == MAP_FAILED ? NULL : array;
}

void host_unmap(void *array, size_t bytes) {
    if (array != NULL) {
        (void)munmap(array, bytes == 0 ? 1 : bytes);
    }
}
