#include "bench_build.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "bench_table.h"
#include "bench_trial.h"
#include "host/base/progress.h"

enum { MAKE_S = 600 };

static const struct {
    const char *name, *header, *package;
} peers[HOST_BENCH_PEERS] = {
    {"cgal", "/usr/include/CGAL/version.h", "libcgal-dev"},
    {"tetgen", "/usr/include/tetgen.h", "libtet1.5-dev"},
    {"qhull", "/usr/include/libqhull_r/qhull_ra.h", "libqhull-dev"},
};

/* Where this program was made; "build" where it is installed. */
static void build_folder(char folder[PATH_MAX]) {
    char archive[PATH_MAX + 32];
    ssize_t n = readlink("/proc/self/exe", folder, PATH_MAX - 1);
    folder[n > 0 ? n : 0] = '\0';
    char *slash = strrchr(folder, '/');
    if (slash != NULL) {
        *slash = '\0';
    }
    (void)snprintf(archive, sizeof archive, "%s/libcore.a", folder);
    if (access(archive, R_OK) != 0) {
        (void)snprintf(folder, PATH_MAX, "build");
    }
}

/* Bit i: peer i is wanted. */
static int parse(const char *wanted, unsigned *set, struct host_error *error) {
    *set = 0;
    for (const char *at = wanted; *at != '\0';) {
        size_t n = strcspn(at, ",");
        unsigned i = 0;
        while (i < HOST_BENCH_PEERS && (strlen(peers[i].name) != n ||
                                        memcmp(peers[i].name, at, n) != 0)) {
            i++;
        }
        if (i == HOST_BENCH_PEERS) {
            return host_fail(error, HOST_USAGE,
                             "--peers %.*s: not in this version; allowed: "
                             "cgal, tetgen, qhull",
                             (int)n, at);
        }
        *set |= 1u << i;
        at += n + (at[n] == ',' ? 1 : 0);
    }
    return 0;
}

static int make(const char *folder, const char *path,
                struct host_error *error) {
    char program[] = "make", silent[] = "-s", build[PATH_MAX + 16];
    char target[PATH_MAX + 32];
    char *const words[] = {program, silent, build, target, NULL};
    struct host_trial trial;
    (void)snprintf(build, sizeof build, "BUILD=%s", folder);
    (void)snprintf(target, sizeof target, "%s", path);
    if (host_trial_run(words, MAKE_S, &trial, error) != 0) {
        return error->code;
    }
    return trial.status == 0
               ? 0
               : host_fail(error, HOST_BROKEN,
                           "%s: it cannot be made (%s); run make %s, or leave "
                           "it out",
                           path, trial.said, path);
}

static int need_source(const char *bench, struct host_error *error) {
    return access("Makefile", R_OK) == 0 &&
                   access("tests/bench/peer.hpp", R_OK) == 0
               ? 0
               : host_fail(error, HOST_USAGE,
                           "bench %s: there is no tests/bench here, of which "
                           "it is made; run it at the top of the source tree",
                           bench);
}

int host_bench_made(const char *name, char path[4096],
                    struct host_error *error) {
    char folder[PATH_MAX];
    if (need_source("boards", error) != 0) {
        return error->code;
    }
    build_folder(folder);
    (void)snprintf(path, 4096, "%.4000s/peers/%s", folder, name);
    return make(folder, path, error);
}

int host_bench_build(struct host_bench_builds *builds, const char *wanted,
                     struct host_error *error) {
    char folder[PATH_MAX];
    unsigned set;
    memset(builds, 0, sizeof *builds);
    if (parse(wanted == NULL ? "cgal,tetgen,qhull" : wanted, &set, error) !=
        0) {
        return error->code;
    }
    if (need_source("peers", error) != 0) {
        return error->code;
    }
    build_folder(folder);
    host_progress_phase("making the peers", NULL);
    for (unsigned i = 0; i < HOST_BENCH_PEERS && error->code == 0; i++) {
        if ((set >> i & 1) == 0) {
            continue;
        }
        if (access(peers[i].header, R_OK) != 0) {
            host_note("%s: left out, as it is not installed; to have it: apt "
                      "install %s",
                      host_bench_peer_titles[i], peers[i].package);
            continue;
        }
        (void)snprintf(builds->path[i], sizeof builds->path[i],
                       "%.4000s/peers/%s", folder, peers[i].name);
        builds->there[i] = make(folder, builds->path[i], error) == 0;
    }
    return error->code;
}
