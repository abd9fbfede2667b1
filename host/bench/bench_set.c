#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "bench_peers.h"
#include "host/formats/read.h"
#include "host/mesh/gen.h"

enum { HEADER = 128 };

static int put(const struct host_bench_set *set, const void *bytes, size_t n) {
    const char *at = bytes;
    while (n > 0) {
        ssize_t done = write(set->file, at, n);
        if (done < 0 && errno != EINTR)
            return -1;
        at += done > 0 ? done : 0;
        n -= done > 0 ? (size_t)done : 0;
    }
    return 0;
}

/* Takes the points over. */
static int hold(struct host_bench_set *set, struct host_points *points,
                struct host_error *error) {
    char header[HEADER + 1];
    (void)snprintf(header, sizeof header,
                   "\x93NUMPY\x01_%c_{'descr': '<f8', 'fortran_order': False, "
                   "'shape': (%llu, 3), }",
                   HEADER - 10, (unsigned long long)points->count);
    size_t used = strlen(header);
    memset(header + used, ' ', HEADER - used);
    header[7] = header[9] = '\0';
    header[HEADER - 1] = '\n';
    set->points = points->count;
    set->file = memfd_create("points", MFD_CLOEXEC);
    (void)snprintf(set->path, sizeof set->path, "/proc/%ld/fd/%d",
                   (long)getpid(), set->file);
    if (set->file < 0 || put(set, header, HEADER) != 0 ||
        put(set, points->xyz, 24 * points->count) != 0) {
        host_fail(error, HOST_BROKEN, "%s: %s; free memory", set->name,
                  strerror(errno));
    }
    host_points_free(points);
    return error->code;
}

int host_bench_set_made(struct host_bench_set *set, const char *kind,
                        uint64_t n, uint64_t seed, struct host_error *error) {
    struct host_points points;
    memset(set, 0, sizeof *set);
    set->file = -1;
    (void)snprintf(set->name, sizeof set->name, "%s", kind);
    return host_gen(kind, n, seed, &points, error) != 0
               ? error->code
               : hold(set, &points, error);
}

int host_bench_set_read(struct host_bench_set *set, const char *path,
                        struct host_error *error) {
    struct host_points points = {0};
    const char *slash = strrchr(path, '/');
    memset(set, 0, sizeof *set);
    set->file = -1;
    (void)snprintf(set->name, sizeof set->name, "%s",
                   slash == NULL ? path : slash + 1);
    set->name[strcspn(set->name, ".")] = '\0';
    return host_points_read(path, &points, error) != 0
               ? error->code
               : hold(set, &points, error);
}

void host_bench_set_free(struct host_bench_set *set) {
    if (set->file >= 0) {
        (void)close(set->file);
        set->file = -1;
    }
}
