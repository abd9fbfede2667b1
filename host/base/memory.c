#include "memory.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include "parallel.h"
#include "scratch.h"

/* Huge pages need their own alignment.  An array that has a part of one takes
 * it whole: a fault for each of its pages costs more than clearing it. */
enum { PAGE = 4096, HUGE = 2 << 20, HUGE_FROM = 256 << 10 };

/* What an array takes. */
static size_t space_of(size_t bytes) {
    size_t unit = bytes < HUGE_FROM ? PAGE : HUGE;
    return (bytes + (bytes == 0) + unit - 1) / unit * unit;
}

/* Address space, aligned to huge pages where it is large enough. */
static void *reserve(size_t bytes) {
    size_t size = space_of(bytes), extra = size >= HUGE ? HUGE : 0;
    char *space = mmap(NULL, size + extra, PROT_READ | PROT_WRITE,
                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (space == MAP_FAILED)
        return NULL;
    size_t skip = extra == 0 ? 0 : (HUGE - (uintptr_t)space % HUGE) % HUGE;
    if (skip > 0)
        (void)munmap(space, skip);
    if (extra > skip)
        (void)munmap(space + skip + size, extra - skip);
    return space + skip;
}

/* Takes bytes from what the call of this thread may use; false: it may not. */
static bool charge(size_t bytes) {
    struct host_call *call = host_call();
    if (call == NULL)
        return true;
    uint64_t before = atomic_fetch_add(&call->memory, bytes);
    if (bytes <= call->memory_max && before <= call->memory_max - bytes)
        return true;
    atomic_fetch_sub(&call->memory, bytes);
    return false;
}

static void refund(size_t bytes) {
    struct host_call *call = host_call();
    if (call != NULL)
        atomic_fetch_sub(&call->memory, bytes);
}

/* What this thread's call puts aside; NULL: nothing. */
static struct host_scratch *aside(void) {
    struct host_call *call = host_call();
    return call == NULL ? NULL : call->scratch;
}

/* Whether an array of so many bytes, which are charged already, is one that is
 * put aside. */
static bool goes_aside(const struct host_scratch *scratch, size_t bytes) {
    return scratch != NULL && bytes >= scratch->array_min &&
           atomic_load(&host_call()->memory) > scratch->memory_first;
}

static void *map(size_t bytes, bool resident) {
    struct host_scratch *scratch = aside();
    void *array = reserve(bytes);
    if (array == NULL)
        return NULL;
    bool large = scratch == NULL || resident || bytes >= scratch->array_min;
    if (resident || !goes_aside(scratch, bytes)) {
        (void)madvise(array, space_of(bytes),
                      large ? MADV_HUGEPAGE : MADV_NOHUGEPAGE);
    } else if (!host_scratch_map(scratch, array, bytes)) {
        (void)munmap(array, space_of(bytes));
        return NULL;
    }
    return array;
}

static void *map_charged(size_t bytes, bool resident) {
    bytes = bytes == 0 ? 1 : bytes;
    if (!charge(bytes))
        return NULL;
    void *array = map(bytes, resident);
    if (array == NULL)
        refund(bytes);
    return array;
}

void *host_map(size_t bytes) {
    return map_charged(bytes, false);
}

void *host_map_resident(size_t bytes) {
    return map_charged(bytes, true);
}

void host_fetch(void *to, const void *from, size_t bytes) {
    if (aside() == NULL || !host_scratch_read(aside(), to, from, bytes))
        memcpy(to, from, bytes);
}

void host_store(void *to, const void *from, size_t bytes) {
    if (aside() == NULL || !host_scratch_write(aside(), to, from, bytes))
        memcpy(to, from, bytes);
}

/* Copies what was in memory to where it is put aside, and gives it back on the
 * way. */
static void copy_aside(char *to, char *from, size_t bytes) {
    enum { BLOCK = 256 << 10 };
    for (size_t at = 0; at < bytes; at += BLOCK) {
        size_t n = bytes - at < BLOCK ? bytes - at : BLOCK;
        memcpy(to + at, from + at, n);
        (void)madvise(from + at, n, MADV_DONTNEED);
        host_call_trim(n);
    }
}

/* The same of an array that is put aside, or will be. */
static void *move_aside(struct host_scratch *scratch, void *old,
                        size_t old_bytes, size_t bytes) {
    bool has = host_scratch_has(scratch, old);
    void *space = has ? reserve(bytes) : map(bytes, false);
    if (space == NULL)
        return NULL;
    if (!has) {
        copy_aside(space, old, old_bytes);
    } else if (!host_scratch_move(scratch, old, space, bytes)) {
        (void)munmap(space, space_of(bytes));
        return NULL;
    }
    (void)munmap(old, space_of(old_bytes));
    return space;
}

static void *move(void *old, size_t old_bytes, size_t bytes) {
    struct host_scratch *scratch = aside();
    size_t from = space_of(old_bytes), to = space_of(bytes);
    if (bytes > old_bytes &&
        (goes_aside(scratch, bytes) ||
         (scratch != NULL && host_scratch_has(scratch, old))))
        return move_aside(scratch, old, old_bytes, bytes);
    if (to <= from) { /* which cannot fail */
        /* No trim may reach what is mapped there next. */
        if (scratch != NULL)
            host_scratch_cut(scratch, old, bytes);
        if (to < from)
            (void)munmap((char *)old + to, from - to);
        return old;
    }
    char *space = reserve(bytes);
    if (space == NULL)
        return NULL;
    /* Move, then grow: one call for both is more than valgrind can follow.
     * Until it has grown, its old place stays mapped (since Linux 5.7): another
     * thread may map there otherwise, what a failure would bring back. */
    const int to_space = MREMAP_MAYMOVE | MREMAP_FIXED;
    void *array = mremap(old, from, from, to_space | MREMAP_DONTUNMAP, space);
    bool is_kept = array != MAP_FAILED;
    if (!is_kept && errno == EINVAL)
        array = mremap(old, from, from, to_space, space);
    if (array == MAP_FAILED) {
        (void)munmap(space, to);
        return NULL;
    }
    (void)munmap(space + from, to - from);
    array = mremap(space, from, to, MREMAP_MAYMOVE);
    if (array == MAP_FAILED) { /* the old array stays as it was */
        (void)mremap(space, from, from, to_space, old);
        return NULL;
    }
    if (is_kept)
        (void)munmap(old, from);
    return array;
}

void *host_remap(void *old, size_t old_bytes, size_t bytes) {
    if (old == NULL)
        return host_map(bytes);
    size_t from = old_bytes == 0 ? 1 : old_bytes, to = bytes == 0 ? 1 : bytes;
    if (to > from && !charge(to - from))
        return NULL;
    void *array = move(old, old_bytes, bytes);
    if (array == NULL && to > from)
        refund(to - from);
    if (array != NULL && to < from)
        refund(from - to);
    return array;
}

void host_unmap(void *array, size_t bytes) {
    bytes = bytes == 0 ? 1 : bytes;
    if (array != NULL) {
        if (aside() != NULL)
            (void)host_scratch_unmap(aside(), array);
        (void)munmap(array, space_of(bytes));
        refund(bytes);
    }
}

/* The number behind `name` on a line of a file that begins with it, or of the
 * first line where it is ""; `without` where there is none. */
static uint64_t number_in(const char *path, const char *name,
                          uint64_t without) {
    char line[256], *end;
    uint64_t value = without;
    size_t n = strlen(name);
    FILE *file = fopen(path, "re");
    while (file != NULL && value == without &&
           fgets(line, sizeof line, file) != NULL) {
        if (strncmp(line, name, n) == 0) {
            unsigned long long number = strtoull(line + n, &end, 10);
            value = end == line + n ? without : number;
        }
    }
    if (file != NULL)
        (void)fclose(file);
    return value;
}

static uint64_t status_bytes(const char *name) {
    uint64_t kib = number_in("/proc/self/status", name, 0);
    return kib * 1024;
}

uint64_t host_memory_peak(void) {
    uint64_t bytes = status_bytes("VmHWM:");
    struct rusage usage;
    if (bytes == 0 && getrusage(RUSAGE_SELF, &usage) == 0)
        bytes = (uint64_t)usage.ru_maxrss * 1024; /* survives exec */
    return bytes;
}

/* --- what is left --------------------------------------------------------- */

static uint64_t least(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

/* What a limit leaves, of which some is in use that can be had back. */
static uint64_t left_of(uint64_t limit, uint64_t used, uint64_t reclaimable) {
    used -= least(used, reclaimable);
    return limit - least(limit, used);
}

/* The files of a group, as one version of the controller names them. */
struct controller {
    const char *folder, *limit, *used, *reclaimable;
};

static uint64_t left_in_group(const char *directory,
                              const struct controller *c) {
    char name[4096 + 64];
    (void)snprintf(name, sizeof name, "%s/%s", directory, c->limit);
    uint64_t limit = number_in(name, "", UINT64_MAX); /* may be "max" */
    if (limit == UINT64_MAX)
        return limit;
    (void)snprintf(name, sizeof name, "%s/%s", directory, c->used);
    uint64_t used = number_in(name, "", 0);
    (void)snprintf(name, sizeof name, "%s/memory.stat", directory);
    return left_of(limit, used, number_in(name, c->reclaimable, 0));
}

/* In the group `path` and all above it.  A container may see none but the
 * uppermost, which is its own. */
static uint64_t left_above(const char *mount, const char *path,
                           const struct controller *c) {
    char directory[4096];
    uint64_t left = UINT64_MAX;
    size_t root = strlen(mount) + strlen(c->folder);
    int n =
        snprintf(directory, sizeof directory, "%s%s%s", mount, c->folder, path);
    if (n < 0 || (size_t)n >= sizeof directory)
        return left;
    for (char *end = directory + n; end != NULL;) {
        *end = '\0';
        left = least(left, left_in_group(directory, c));
        end = strrchr(directory + root, '/');
    }
    return left;
}

uint64_t host_memory_in_groups(const char *list, const char *mount) {
    static const struct controller first = {"/memory", "memory.limit_in_bytes",
                                            "memory.usage_in_bytes",
                                            "total_inactive_file "},
                                   second = {"", "memory.max", "memory.current",
                                             "inactive_file "};
    char line[4096];
    uint64_t left = UINT64_MAX;
    FILE *file = fopen(list, "re");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        char *names = strchr(line, ':');
        char *path = names == NULL ? NULL : strchr(names + 1, ':');
        if (path == NULL)
            continue;
        *path++ = '\0';
        path[strcspn(path, "\n")] = '\0';
        if (names[1] == '\0')
            left = least(left, left_above(mount, path, &second));
        else if (strcmp(names + 1, "memory") == 0)
            left = least(left, left_above(mount, path, &first));
    }
    if (file != NULL)
        (void)fclose(file);
    return left;
}

/* used: the line of this process's status that the limit is of. */
static uint64_t left_by(const struct rlimit *limit, const char *used) {
    return limit->rlim_cur == RLIM_INFINITY
               ? UINT64_MAX
               : left_of(limit->rlim_cur, status_bytes(used), 0);
}

uint64_t host_memory_available(void) {
    uint64_t kib = number_in("/proc/meminfo", "MemAvailable:", UINT64_MAX);
    uint64_t left = kib == UINT64_MAX ? kib : kib * 1024;
    struct rlimit limit;
    left = least(left,
                 host_memory_in_groups("/proc/self/cgroup", "/sys/fs/cgroup"));
    if (getrlimit(RLIMIT_AS, &limit) == 0)
        left = least(left, left_by(&limit, "VmSize:"));
    if (getrlimit(RLIMIT_DATA, &limit) == 0)
        left = least(left, left_by(&limit, "VmData:"));
    return left;
}
