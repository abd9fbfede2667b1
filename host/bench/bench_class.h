/* The classes of point sets of `incode bench peers`: which sets, how the
 * program is run on them, and what it is held to.
 *
 * Memory: the table.  Work: a comparison a row.
 *
 *     const struct host_bench_class *c = host_bench_class_named("growth");
 *     for (unsigned i = 0; c != NULL && c->made[i].kind != NULL; i++)
 *         printf("%s\n", c->made[i].kind);
 */
#ifndef HOST_BENCH_CLASS_H
#define HOST_BENCH_CLASS_H

#include <stdbool.h>
#include <stdint.h>

enum {
    HOST_BENCH_MADE_MAX = 13,
    HOST_BENCH_PEERS = 3, /* CGAL, TetGen, Qhull: in this order everywhere */
    HOST_BENCH_FEW = 5000 /* points; below, what is fixed counts */
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

/* Row i; NULL past the last. */
const struct host_bench_class *host_bench_class_row(unsigned i);

/* NULL: none has the name. */
const struct host_bench_class *host_bench_class_named(const char *name);

/* "real, small, cube", for help and messages. */
const char *host_bench_class_names(void);

/* Its options, ended by NULL. */
const char *const *host_bench_way_options(enum host_bench_way way);

/* The ratio that a file of this name is held to in a class; *named: it has one
 * of its own, and counts as one of many points. */
double host_bench_goal(const struct host_bench_class *c, const char *name,
                       bool *named);

#endif
