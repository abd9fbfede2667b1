/* The tetrahedra of own bricks from a Delaunay triangulation grown point by
 * point (incode/complex): no face has to be searched, and what is flat,
 * stretched or nearly degenerate costs little more than what is not.
 *
 * Where all points fit, they are inserted at once.  Otherwise brick after
 * brick; when memory runs short, cells whose spheres hold no point that is
 * still to come are final: they are emitted and released (Isenburg, Liu,
 * Shewchuk, Snoeyink, Streaming computation of Delaunay triangulations, ACM
 * Transactions on Graphics 25, 2006).  A brick is committed when all cells at
 * its points are.  Of others' bricks, the points that have to do with own ones
 * are inserted last.
 *
 * Memory: struct incode_insertion, about 2 KB, and a block given by its owner:
 * 34 KB, two bits a brick, the complex the rest.  Work: a step takes a brick
 * in, or inserts or emits some, or looks at some cells; releasing looks at each
 * once.  It listens to the maker's walker.
 *
 *     incode_insertion_init(&n, &maker, &outside);
 *     incode_insertion_start(&n, bits, memory, bytes, first, last);
 *     while ((step = incode_insertion_step(&n)) == INCODE_INSERTION_WORKED)
 *         continue;
 */
#ifndef INCODE_INSERTION_H
#define INCODE_INSERTION_H

#include "incode/complex/complex.h"
#include "incode/front/job.h"
#include "incode/apex/maker.h"
#include "look.h"
#include "rest.h"

enum {
    INCODE_INSERTION_EMITTED = 128,    /* tetrahedra at a time */
    INCODE_INSERTION_BRICKS = 32,      /* taken in at a time, unless all fit */
    INCODE_INSERTION_LISTED = 1024,    /* cells */
    INCODE_INSERTION_LEAST = 40 << 10, /* bytes */
    INCODE_INSERTION_KNOWN = 32        /* part of the memory, below */
};

enum incode_insertion_step {
    INCODE_INSERTION_WORKED,  /* call again */
    INCODE_INSERTION_WAITING, /* for a page, or for room outside */
    INCODE_INSERTION_FULL,    /* what is not final does not fit */
    INCODE_INSERTION_FINISHED /* the own bricks are committed */
};

struct incode_insertion {
    struct incode_complex complex;
    struct incode_maker *maker;
    struct incode_front_outside outside;
    uint64_t kept, vertices; /* tetrahedra emitted, points inserted */
    uint64_t releases;
    size_t used; /* most bytes of the memory so far, of all jobs */

    uint32_t own_first, own_last; /* own bricks */
    uint64_t *committed;          /* a bit a brick, its owner's */
    /* A bit a brick: a cell is left at one of its points; before that, it is to
     * be visited. */
    uint64_t *touched;
    uint64_t *passed; /* a bit a brick: it has been visited */
    /* A word a brick, a bit a point: the point became a vertex before its turn,
     * or belongs to another node, and may have been released since.  NULL: the
     * memory has no room for it. */
    uint64_t *inserted;
    struct incode_insertion_work *work;
    bool whole;    /* all bricks are taken in at once */
    bool emitted;  /* something has been */
    bool sampled;  /* bricks to come have been */
    bool closing;  /* points of others' bricks are inserted where they matter */
    bool closed;   /* that is done */
    bool squeezed; /* they did not fit */
    bool thorough; /* boxes alone are not enough */
    bool large;    /* the cavities of points near by */
    bool shown;    /* points to come, to the cells */

    enum incode_insertion_stage {
        INCODE_INSERTION_CHOOSE,
        INCODE_INSERTION_LOAD,
        INCODE_INSERTION_BEGIN,
        INCODE_INSERTION_SPAN,
        INCODE_INSERTION_INSERT,
        INCODE_INSERTION_SAMPLE,
        INCODE_INSERTION_REST,
        INCODE_INSERTION_JUDGE,
        INCODE_INSERTION_LOOK,
        INCODE_INSERTION_VISIT,
        INCODE_INSERTION_SETTLE,
        INCODE_INSERTION_LIST,
        INCODE_INSERTION_EMIT,
        INCODE_INSERTION_RELEASE,
        INCODE_INSERTION_COMMIT,
        INCODE_INSERTION_DONE
    } stage;
    /* Own bricks [from, to) are being inserted; all before them are. */
    uint32_t from, to;
    uint32_t sample_step; /* one point of so many bricks to come */
    uint32_t most;        /* bricks at a time */
    uint32_t brick;       /* to be loaded */
    uint32_t four[4];     /* the first vertices */
    uint32_t four_count;
    uint64_t there[INCODE_INSERTION_BRICKS]; /* of their points, which are
                                                vertices already */
    uint32_t staged_count;
    unsigned level;      /* of the points that are inserted now */
    uint32_t next, near; /* the staged point at work, and a vertex near by */
    uint32_t cell, v;    /* that is judged, whose tetrahedra are emitted */
    uint32_t fetched;    /* the lists of points before it are in the cache */
    uint32_t final;      /* cells so far */
    uint32_t reached;    /* cells, by boxes and by no point yet */
    uint32_t listed;     /* of these; INCODE_NONE: none is */
    unsigned round;      /* of looks and visits: 0, 1 */
    uint32_t apexes[INCODE_INSERTION_EMITTED][3];
};

/* What of it is in the memory that is given. */
struct incode_insertion_work {
    struct incode_rest rest;
    struct incode_look look;
    union {
        uint16_t staged[INCODE_INSERTION_BRICKS * INCODE_BRICK_POINTS];
        uint32_t listed[INCODE_INSERTION_LISTED]; /* cells, in a visit */
    };
};

/* Bytes that the triangulation of so many points takes, as a rule, beside two
 * bits a brick.  If not all points are inserted at once, a word a brick is
 * added, unless that is more than one part in INCODE_INSERTION_KNOWN of the
 * memory. */
size_t incode_insertion_bytes(uint64_t points);

void incode_insertion_init(struct incode_insertion *n,
                           struct incode_maker *maker,
                           const struct incode_front_outside *outside);

/* Begins with own bricks [first, last), first < last.  committed: a bit a brick
 * of the set, that tells which are when it is full.  memory: aligned to 8
 * bytes; bytes: at least INCODE_INSERTION_LEAST and two bits a brick. */
void incode_insertion_start(struct incode_insertion *n, uint64_t *committed,
                            void *memory, size_t bytes, uint32_t first,
                            uint32_t last);

static inline bool
incode_insertion_has_committed(const struct incode_insertion *n,
                               uint32_t brick) {
    return (n->committed[brick / 64] >> brick % 64 & 1) != 0;
}

enum incode_insertion_step incode_insertion_step(struct incode_insertion *n);

#endif
