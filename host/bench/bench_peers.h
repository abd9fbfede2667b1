/* `incode bench peers`: this program and other triangulators on the same points
 * by turns, in classes, with medians, ratios and goals. */
#ifndef HOST_BENCH_PEERS_H
#define HOST_BENCH_PEERS_H

#include <stdbool.h>
#include <stdint.h>

#include "host/base/error.h"

enum { HOST_BENCH_ROUNDS_MAX = 99, HOST_BENCH_NAMES_MAX = 256 };

struct host_bench_peers_options {
    const char *name[HOST_BENCH_NAMES_MAX]; /* files and directories */
    unsigned names;
    const char *class; /* its name, or NULL: all */
    const char *peers; /* names with commas between, or NULL: all */
    unsigned rounds, limit_s;
    bool large;
};

/* 0, whatever was measured; HOST_BROKEN where a run failed or gave other
 * tetrahedra than CGAL. */
int host_bench_peers(const struct host_bench_peers_options *options,
                     struct host_error *error);

/* The classes of point sets of `incode bench peers`: which sets, how the
 * program is run on them, and what it is held to. */

enum {
    HOST_BENCH_MADE_MAX = 13,
    /* CGAL, TetGen, Qhull, HXT, HXT on two threads: in this order everywhere */
    HOST_BENCH_PEERS = 5,
    HOST_BENCH_QHULL = 2,    /* by scipy, where queries are located */
    HOST_BENCH_THREADED = 4, /* its times are always the clock's */
    HOST_BENCH_FEW = 5000    /* points; below, what is fixed counts */
};

/* How the program is run. */
enum host_bench_way {
    HOST_WAY_NONE,
    HOST_WAY_ALONE,  /* sequential, one node of 4M */
    HOST_WAY_NARROW, /* the same in 512K */
    HOST_WAY_USUAL,  /* no option */
    HOST_WAY_ROOMY,  /* --memory 64M alone */
    HOST_WAY_CUBE,   /* spatial, 8 nodes of 512K */
    HOST_WAY_CUBE_2, /* the same in 1M */
    HOST_WAYS
};

/* One set that is made, and its goals; 0: none. */
struct host_bench_made {
    const char *kind;
    uint64_t n;
    double ratio;   /* the least of CGAL's time to the program's */
    double seconds; /* the most */
    double step;    /* the most, against the row that the class says */
    bool large;     /* on request alone */
};

enum host_bench_files { HOST_FILES_NONE, HOST_FILES_MANY, HOST_FILES_FEW };

struct host_bench_class {
    const char *name, *title;
    struct host_bench_made made[HOST_BENCH_MADE_MAX]; /* kind NULL: the end */
    enum host_bench_files files; /* those given, of so many points */
    enum host_bench_way way, other;
    uint64_t queries;   /* that are located; 0: sets are triangulated */
    bool wall;          /* times are the clock's, else the processor's */
    bool whole;         /* and of whole programs, file to file, CGAL's too */
    bool first;         /* steps are against the first row, a tetrahedron; else
                           against the one before, the set */
    bool narrower;      /* the other way has less memory */
    bool means;         /* ratios are summed up as geometric means */
    const char *versus; /* the heading of both ways' ratio */
    double versus_most; /* goals, 0: none */
    double pages_most;  /* pages asked for, to those that there are */
    double ratio;       /* of each file */
    double extra_ms;    /* the most beyond CGAL, the host's time included */
    double summary[HOST_BENCH_PEERS]; /* of the median, or mean, of ratios */
};

/* NULL: none has the name. */
const struct host_bench_class *host_bench_class_named(const char *name);

/* "real, small, cube", for help and messages. */
const char *host_bench_class_names(void);

/* A set of points for several programs to read, as a .npy that has no name on
 * any disk and is gone with this process.
 *
 * Memory: 24 bytes a point, and the points once more while it is made. */

struct host_bench_set {
    char name[64];
    char path[64]; /* by which other processes open it while this one lives */
    uint64_t points;
    int file;
};

/* Of host_gen. */
int host_bench_set_made(struct host_bench_set *set, const char *kind,
                        uint64_t n, uint64_t seed, struct host_error *error);

/* Of a file that `incode run` reads; named as it, without its extensions. */
int host_bench_set_read(struct host_bench_set *set, const char *path,
                        struct host_error *error);

/* Also after a failure. */
void host_bench_set_free(struct host_bench_set *set);

#endif
