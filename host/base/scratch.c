#include "scratch.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/magic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>
#include <unistd.h>

enum {
    PAGE = 4096,
    ARRAY_MIN = 1 << 20, /* smaller ones may be many, and cost little */
    SHARE = 64,          /* of the limit, such an array at most */
    BETWEEN = 32,        /* of the limit, what is touched between two looks, */
    BETWEEN_SMALL = 24,  /* and in the simulation */
    ZEROS = 1 << 16
};

/* A file without a name: it goes when the program goes. */
static int make_file(const char *directory) {
    char name[4096];
    int n = snprintf(name, sizeof name, "%s/incode-scratch-XXXXXX", directory);
    if (n < 0 || (size_t)n >= sizeof name) {
        errno = ENAMETOOLONG;
        return -1;
    }
    int file = mkostemp(name, O_CLOEXEC);
    if (file >= 0)
        (void)unlink(name);
    return file;
}

/* Bytes by field `at` of statm, from 0. */
static uint64_t bytes_of(const struct host_scratch *s, unsigned at) {
    char text[256], *next = text;
    uint64_t pages = 0;
    ssize_t n = pread(s->statm, text, sizeof text - 1, 0);
    if (n <= 0)
        return UINT64_MAX;
    text[n] = '\0';
    for (unsigned i = 0; i <= at; i++)
        pages = strtoull(next, &next, 10);
    return pages * PAGE;
}

static uint64_t resident(const struct host_scratch *s) {
    return bytes_of(s, 1);
}

/* Arenas of triangulators, a quarter of the limit, are touched all the time. */
static bool is_over(const struct host_scratch *s) {
    return s->own ? s->since > s->resident_max / 2
                  : resident(s) > s->resident_max / 4 * 3;
}

static int fail_over(const struct host_scratch *s, struct host_error *error) {
    const uint64_t mb = 1 << 20;
    uint64_t here = resident(s) / mb + 1, enough = 2 * here;
    return host_fail(error, HOST_USAGE,
                     "--host-memory %lluM: this process takes %lluM before it "
                     "has read a point, libraries included; give %lluM or more",
                     (unsigned long long)(s->resident_max / mb),
                     (unsigned long long)here, (unsigned long long)enough);
}

static void prepare(struct host_scratch *scratch, const char *directory,
                    uint64_t resident_max, unsigned threads) {
    uint64_t share = resident_max / SHARE;
    memset(scratch, 0, sizeof *scratch);
    scratch->directory = directory;
    scratch->resident_max = resident_max;
    scratch->array_min = share < ARRAY_MIN ? (size_t)share : ARRAY_MIN;
    scratch->step = (size_t)(resident_max / BETWEEN / threads);
    scratch->statm = scratch->pagemap = -1;
    (void)pthread_mutex_init(&scratch->lock, NULL);
}

static int probe(struct host_scratch *scratch, struct host_error *error) {
    int file = make_file(scratch->directory);
    if (file < 0) {
        scratch->failure = errno;
        return host_fail(error, HOST_INPUT,
                         "%s: no scratch file can be made here (%s); give "
                         "another folder as --scratch DIR",
                         scratch->directory, strerror(errno));
    }
    (void)close(file);
    return 0;
}

int host_scratch_begin(struct host_scratch *scratch, const char *directory,
                       uint64_t resident_max, unsigned threads,
                       struct host_error *error) {
    prepare(scratch, directory, resident_max, threads);
    scratch->statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (scratch->statm < 0) {
        return host_fail(error, HOST_BROKEN,
                         "/proc/self/statm: %s; mount /proc, or leave the "
                         "limit of memory out",
                         strerror(errno));
    }
    if (probe(scratch, error) == 0 && resident(scratch) > resident_max / 8 * 7)
        fail_over(scratch, error);
    if (error->code != 0)
        (void)close(scratch->statm);
    return error->code;
}

int host_scratch_begin_own(struct host_scratch *scratch, const char *directory,
                           uint64_t resident_max, unsigned threads,
                           struct host_error *error) {
    prepare(scratch, directory, resident_max, threads);
    scratch->own = true;
    scratch->statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (probe(scratch, error) != 0 && scratch->statm >= 0)
        (void)close(scratch->statm);
    return error->code;
}

int host_scratch_begin_small(struct host_scratch *scratch,
                             const char *directory, uint64_t resident_max,
                             struct host_error *error) {
    prepare(scratch, directory, resident_max, 1);
    scratch->array_min = PAGE;
    scratch->step = (size_t)(resident_max / BETWEEN_SMALL);
    scratch->pagemap = open("/proc/self/pagemap", O_RDONLY | O_CLOEXEC);
    if (scratch->pagemap < 0) {
        return host_fail(error, HOST_BROKEN,
                         "/proc/self/pagemap: %s; mount /proc",
                         strerror(errno));
    }
    if (probe(scratch, error) != 0)
        (void)close(scratch->pagemap);
    return error->code;
}

void host_scratch_end(struct host_scratch *scratch) {
    while (scratch->arrays > 0)
        (void)close(scratch->array[--scratch->arrays].file);
    if (scratch->statm >= 0)
        (void)close(scratch->statm);
    if (scratch->pagemap >= 0)
        (void)close(scratch->pagemap);
    (void)pthread_mutex_destroy(&scratch->lock);
}

uint64_t host_scratch_free(const struct host_scratch *scratch) {
    struct statvfs about;
    return statvfs(scratch->directory, &about) != 0
               ? UINT64_MAX
               : (uint64_t)about.f_bavail * about.f_frsize;
}

bool host_scratch_in_memory(const struct host_scratch *scratch) {
    struct statfs about;
    return statfs(scratch->directory, &about) == 0 &&
           ((unsigned long)about.f_type == TMPFS_MAGIC ||
            (unsigned long)about.f_type == RAMFS_MAGIC);
}

/* --- trims ---------------------------------------------------------------- */

static void let_leave(const struct host_scratch *s) {
    for (unsigned i = 0; i < s->arrays; i++)
        (void)madvise(s->array[i].at, s->array[i].bytes, MADV_DONTNEED);
}

static uint64_t resident_of(const struct host_scratch *s,
                            const struct host_scratch_array *a) {
    enum { ENTRIES = 512 };
    uint64_t entry[ENTRIES], first = (uintptr_t)a->at / PAGE, bytes = 0;
    size_t pages = a->bytes / PAGE;
    for (size_t i = 0; i < pages; i += ENTRIES) {
        size_t n = pages - i < ENTRIES ? pages - i : ENTRIES;
        ssize_t got = pread(s->pagemap, entry, n * sizeof entry[0],
                            (off_t)((first + i) * sizeof entry[0]));
        for (size_t k = 0; (ssize_t)(k * sizeof entry[0]) < got; k++)
            bytes += entry[k] >> 63 != 0 ? PAGE : 0;
    }
    return bytes;
}

/* Whether threads have not touched the same pages again and again: the call has
 * no more in files than all that this process has mapped. */
static bool own_is_over(struct host_scratch *s) {
    uint64_t mapped = bytes_of(s, 2);
    bool fit = mapped < s->resident_max / 8 * 3;
    s->since = fit ? mapped : 0;
    return !fit && s->bytes >= s->resident_max / 4 * 3;
}

static void trim_small(struct host_scratch *s) {
    uint64_t bytes = 0;
    for (unsigned i = 0; i < s->arrays; i++)
        bytes += resident_of(s, &s->array[i]);
    s->resident_seen = bytes > s->resident_seen ? bytes : s->resident_seen;
    s->trims += bytes > 0;
    let_leave(s);
}

/* A thread that finds too much waits for the one that lets pages leave, and
 * touches no more in the meantime. */
void host_scratch_trim(struct host_scratch *scratch, size_t touched) {
    if (scratch->own)
        (void)atomic_fetch_add(&scratch->since, touched);
    if (scratch->pagemap < 0 && !is_over(scratch))
        return;
    (void)pthread_mutex_lock(&scratch->lock);
    if (scratch->pagemap >= 0)
        trim_small(scratch);
    else if (is_over(scratch) && (!scratch->own || own_is_over(scratch)))
        let_leave(scratch); /* it is over still */
    (void)pthread_mutex_unlock(&scratch->lock);
}

void host_scratch_ended(struct host_scratch *scratch, size_t touched) {
    uint64_t before = atomic_fetch_add(&scratch->touched, touched);
    if (before + touched < scratch->step)
        return;
    atomic_store(&scratch->touched, 0);
    host_scratch_trim(scratch, before + touched);
}

/* --- arrays --------------------------------------------------------------- */

static size_t whole_pages(size_t bytes) {
    return (bytes + PAGE - 1) / PAGE * PAGE;
}

static struct host_scratch_array *find(struct host_scratch *s,
                                       const void *array) {
    for (unsigned i = 0; i < s->arrays; i++)
        if (s->array[i].at == array)
            return &s->array[i];
    return NULL;
}

/* The file of the array that `at` lies in, and where; -1: there is none. */
static int file_at(struct host_scratch *s, const void *at, size_t bytes,
                   off_t *where) {
    int file = -1;
    uintptr_t p = (uintptr_t)at;
    (void)pthread_mutex_lock(&s->lock);
    for (unsigned i = 0; i < s->arrays && file < 0; i++) {
        uintptr_t first = (uintptr_t)s->array[i].at;
        if (p < first || p - first > s->array[i].bytes ||
            bytes > s->array[i].bytes - (p - first))
            continue;
        file = s->array[i].file;
        *where = (off_t)(p - first);
    }
    (void)pthread_mutex_unlock(&s->lock);
    return file;
}

bool host_scratch_read(struct host_scratch *scratch, void *to, const void *from,
                       size_t bytes) {
    off_t where = 0;
    int file = file_at(scratch, from, bytes, &where);
    char *byte = to;
    for (size_t done = 0; file >= 0 && done < bytes;) {
        ssize_t n = pread(file, byte + done, bytes - done, where + (off_t)done);
        if (n == 0 || (n < 0 && errno != EINTR))
            return false;
        done += n > 0 ? (size_t)n : 0;
    }
    return file >= 0;
}

bool host_scratch_write(struct host_scratch *scratch, void *to,
                        const void *from, size_t bytes) {
    off_t where = 0;
    int file = file_at(scratch, to, bytes, &where);
    const char *byte = from;
    for (size_t done = 0; file >= 0 && done < bytes;) {
        ssize_t n =
            pwrite(file, byte + done, bytes - done, where + (off_t)done);
        if (n == 0 || (n < 0 && errno != EINTR))
            return false;
        done += n > 0 ? (size_t)n : 0;
    }
    return file >= 0;
}

bool host_scratch_has(struct host_scratch *scratch, const void *array) {
    (void)pthread_mutex_lock(&scratch->lock);
    bool has = find(scratch, array) != NULL;
    (void)pthread_mutex_unlock(&scratch->lock);
    return has;
}

/* Where the file system reserves nothing, zeros do. */
static int write_zeros(int file, size_t from, size_t to) {
    static const char zeros[ZEROS];
    while (from < to) {
        size_t n = to - from < sizeof zeros ? to - from : sizeof zeros;
        ssize_t written = pwrite(file, zeros, n, (off_t)from);
        if (written == 0)
            return ENOSPC;
        if (written < 0 && errno != EINTR)
            return errno;
        from += written > 0 ? (size_t)written : 0;
    }
    return 0;
}

/* Makes a file longer: every byte of it has its place on the disk then.  0 or
 * errno; then it is as long as before. */
static int lengthen(int file, size_t from, size_t to) {
    int failure = 0;
    do {
        failure = fallocate(file, 0, (off_t)from, (off_t)(to - from)) != 0
                      ? errno
                      : 0;
    } while (failure == EINTR);
    if (failure == EOPNOTSUPP || failure == ENOSYS)
        failure = write_zeros(file, from, to);
    if (failure != 0)
        (void)ftruncate(file, (off_t)from);
    return failure;
}

static void count(struct host_scratch *s, size_t from, size_t to) {
    s->bytes += to - from; /* modulo 2^64, where it is less */
    s->bytes_max = s->bytes > s->bytes_max ? s->bytes : s->bytes_max;
}

/* Gives the array's file so many bytes and maps it at `space`. */
static bool place(struct host_scratch *s, struct host_scratch_array *a,
                  void *space, size_t bytes) {
    int failure = bytes > a->bytes ? lengthen(a->file, a->bytes, bytes) : 0;
    if (failure == 0 &&
        mmap(space, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED,
             a->file, 0) == MAP_FAILED) {
        failure = errno;
        (void)ftruncate(a->file, (off_t)a->bytes);
    }
    if (failure != 0) {
        s->failure = failure;
        s->wanted = bytes - a->bytes;
        return false;
    }
    /* What the kernel reads ahead, it keeps in pieces of up to 2 MiB, and maps
     * a whole piece once a byte of it is touched (since Linux 6.18). */
    (void)madvise(space, bytes, MADV_NOHUGEPAGE);
    (void)madvise(space, bytes, MADV_RANDOM);
    count(s, a->bytes, bytes);
    a->at = space;
    a->bytes = bytes;
    return true;
}

bool host_scratch_map(struct host_scratch *scratch, void *space, size_t bytes) {
    bool done = false;
    (void)pthread_mutex_lock(&scratch->lock);
    if (scratch->arrays < HOST_SCRATCH_ARRAYS) {
        struct host_scratch_array *a = &scratch->array[scratch->arrays];
        *a = (struct host_scratch_array){.file = make_file(scratch->directory)};
        done = a->file >= 0 && place(scratch, a, space, whole_pages(bytes));
        if (a->file < 0) {
            scratch->failure = errno;
            scratch->wanted = bytes;
        } else if (!done) {
            (void)close(a->file);
        }
        scratch->arrays += done;
    } else {
        scratch->failure = ENFILE;
        scratch->wanted = bytes;
    }
    (void)pthread_mutex_unlock(&scratch->lock);
    return done;
}

bool host_scratch_move(struct host_scratch *scratch, const void *array,
                       void *space, size_t bytes) {
    (void)pthread_mutex_lock(&scratch->lock);
    struct host_scratch_array *a = find(scratch, array);
    bool done = a != NULL && place(scratch, a, space, whole_pages(bytes));
    (void)pthread_mutex_unlock(&scratch->lock);
    return done;
}

void host_scratch_cut(struct host_scratch *scratch, const void *array,
                      size_t bytes) {
    (void)pthread_mutex_lock(&scratch->lock);
    struct host_scratch_array *a = find(scratch, array);
    size_t to = whole_pages(bytes);
    if (a != NULL && to < a->bytes) {
        (void)ftruncate(a->file, (off_t)to); /* else its end stays unused */
        count(scratch, a->bytes, to);
        a->bytes = to;
    }
    (void)pthread_mutex_unlock(&scratch->lock);
}

bool host_scratch_unmap(struct host_scratch *scratch, const void *array) {
    (void)pthread_mutex_lock(&scratch->lock);
    struct host_scratch_array *a = find(scratch, array);
    if (a != NULL) {
        count(scratch, a->bytes, 0);
        (void)close(a->file);
        *a = scratch->array[--scratch->arrays];
    }
    (void)pthread_mutex_unlock(&scratch->lock);
    return a != NULL;
}
