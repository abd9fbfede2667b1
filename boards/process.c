#include "process.h"

#include <link.h>
#include <sys/mman.h>

/* The program is the first of the list. */
static int add_segments(struct dl_phdr_info *info, size_t size, void *context) {
    size_t *bytes = context;
    (void)size;
    for (unsigned i = 0; i < info->dlpi_phnum; i++) {
        const ElfW(Phdr) *header = &info->dlpi_phdr[i];
        if (header->p_type == PT_LOAD && (header->p_flags & PF_W) != 0) {
            size_t from = header->p_vaddr / PROCESS_PAGE * PROCESS_PAGE;
            size_t to = header->p_vaddr + header->p_memsz;
            *bytes +=
                (to - from + PROCESS_PAGE - 1) / PROCESS_PAGE * PROCESS_PAGE;
        }
    }
    return 1;
}

size_t process_static_bytes(void) {
    size_t bytes = 0;
    (void)dl_iterate_phdr(add_segments, &bytes);
    return bytes;
}

uint64_t process_clock_us(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

void *process_arena(size_t bytes) {
    int at_once = bytes <= PROCESS_AT_ONCE ? MAP_POPULATE : 0;
    void *arena = mmap(NULL, bytes, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | at_once, -1, 0);
    return arena == MAP_FAILED ? NULL : arena;
}
