/* A region at a time of a run on threads: what its triangulator asks for, and
 * what it gets. */
#ifndef HOST_LIBRARY_REGION_H
#define HOST_LIBRARY_REGION_H

#include "delaunay.h"
#include "host/mesh/spill.h"

enum {
    PAGES_QUEUE = 1024,
    AROUND = 1 << 16 /* bytes that one place far from others touches */
};

/* What is known of a vertex of a region that is triangulated alone. */
enum {
    AT_FINAL = 1, /* it is a tetrahedron's that is final */
    AT_SEAM = 2   /* or of one that is not, or of the hull where others' points
                     lie beyond */
};

/* What all runs of a call share. */
struct direct_call {
    struct host_direct_sums *sums;         /* or NULL */
    const struct host_direct_store *store; /* or NULL */
    struct host_error *error;
    /* What the triangulators of threads work in; NULL: nothing yet. */
    void *arena[HOST_THREADS_MAX];
    size_t bytes[HOST_THREADS_MAX];
};

/* The threads of one run. */
struct direct {
    struct direct_call *common;
    const struct host_order *order;
    struct host_tetrahedra *tets; /* [threads] */
    struct host_tetrahedra *left; /* [threads] not final: vertex numbers */
    uint8_t *mark;                /* [64 * bricks] or NULL: not alone */
    unsigned level;               /* 0: its bricks count as progress, and its
                                     tetrahedra go to the sink */
    const struct host_direct_store *store; /* or NULL */
    uint64_t key;                          /* then: of the order */
    unsigned threads;
    struct incode_setup setup;
    size_t arena;              /* bytes for each thread, if there are so many */
    _Atomic uint32_t regions;  /* that were taken */
    _Atomic int outcome;       /* enum host_direct: the worst so far */
    _Atomic(const char *) why; /* of HOST_DIRECT_BROKEN */
};

struct direct_worker {
    struct direct *run;
    struct host_call *call; /* or NULL */
    bool is_caller;         /* it is the calling thread's */
    struct host_tetrahedra *tets, *left;
    uint64_t tets_before, left_before; /* rows of other regions */
    bool is_hopeless; /* hardly anything of this one is final */
    struct incode_triangulator *t;
    struct host_spill spill;
    struct host_error error;
    uint32_t pages[PAGES_QUEUE], page_count; /* requested */
    uint32_t wanted; /* brick whose spilled faces are wanted, or INCODE_NONE */
};

/* The first outcome that is not DONE is that of the run, and ends it.  True:
 * this is the first. */
bool direct_fail(struct direct *run, enum host_direct outcome, const char *why);

struct incode_outside direct_outside(struct direct_worker *w);

/* Triangulates a region, or takes what an earlier run has kept of it. */
void direct_region(struct direct_worker *w, uint32_t number);

#endif
