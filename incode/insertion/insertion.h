/* Builds the tetrahedra of own bricks by a Delaunay triangulation that grows
 * point by point (incode/complex).  No apex has to be searched, and flat,
 * stretched or nearly degenerate sets cost little more than others.
 *
 * If all points fit, they are inserted at once.  Otherwise they are inserted
 * brick after brick.  When memory runs short, cells whose spheres hold no point
 * of bricks to come are final: they are emitted and released (Isenburg, Liu,
 * Shewchuk, Snoeyink, Streaming computation of Delaunay triangulations, ACM
 * Transactions on Graphics 25, 2006).  A brick is committed when all cells at
 * its points are emitted.  Points of other nodes' bricks that lie in spheres of
 * own cells are inserted last.
 *
 * Memory: struct incode_insertion, about 2 KB, and a block given by its owner:
 * 34 KB, two bits a brick, the complex the rest. */
#ifndef INCODE_INSERTION_H
#define INCODE_INSERTION_H

#include <stdalign.h>

#include "incode/complex/complex.h"
#include "incode/pages/pages.h"
#include "incode/apex/maker.h"
#include "incode/front/job.h"
#include "incode/front/front.h"

/* The sphere of a cell, or the half-space beyond the facet of an infinite cell,
 * to be tested against boxes of points.  A region that does not meet a box
 * holds none of its points, with all rounding errors included.  A region that
 * meets it may.
 *
 * Memory: struct incode_region, 112 bytes. */

/* |p - o|^2 - X (p - o) < 0, or X (p - o) > 0, up to the errors of X. */
struct incode_region {
    double o[3], x[3], error[3];
    double centre[3], square; /* of a ball that holds the sphere */
    bool infinite;
};

/* From the sphere that the cell keeps; false: it keeps none. */
bool incode_region_set(struct incode_region *r, const struct incode_complex *x,
                       const struct incode_cell *c);

/* The same from its points, with bounds of the errors of each component; false:
 * nothing is known.  scale: 2^k, of relative coordinates. */
bool incode_region_set_sharp(struct incode_region *r,
                             const struct incode_complex *x,
                             const struct incode_cell *c, double scale);

/* All of space. */
void incode_region_set_all(struct incode_region *r);

/* Whether a box reaches to or beyond a facet's plane. */
bool incode_region_is_behind(const struct incode_region *r, const double lo[3],
                             const double hi[3]);

/* Some regions, side by side. */
enum { INCODE_REGIONS = 64 };

struct incode_regions {
    alignas(64) double o[3][INCODE_REGIONS];
    alignas(64) double x[3][INCODE_REGIONS];
    alignas(64) double error[3][INCODE_REGIONS];
    alignas(64) double centre[3][INCODE_REGIONS];
    alignas(64) double square[INCODE_REGIONS];
    alignas(64) double round[INCODE_REGIONS]; /* 1: a sphere, 0: half a space */
    uint64_t infinite;                        /* a bit each */
};

void incode_regions_set(struct incode_regions *regions, unsigned i,
                        const struct incode_region *r);

/* Those of some regions, a bit each, that may hold a point of a box along the
 * axes. */
uint64_t incode_regions_meeting(const struct incode_regions *regions,
                                uint64_t some, const double lo[3],
                                const double hi[3]);

/* The same of a lifted box of a page. */
uint64_t incode_regions_meeting_lifted(const struct incode_regions *regions,
                                       uint64_t some,
                                       const struct incode_boxes *boxes,
                                       const struct incode_lifted *lifted);

/* The points of a brick that region i may hold, a bit each. */
uint64_t incode_regions_points(const struct incode_regions *regions, unsigned i,
                               const struct incode_brick *brick);

/* A look tests some cells against the boxes of all bricks to come, the lifted
 * boxes too: which of these bricks may hold a point of a cell's sphere.
 *
 * Several cells go down the tree together, so a page is requested once for all
 * of them, and each box is unpacked once.
 *
 * Memory: struct incode_look, about 8 KB, and bits of its owner's; stack for
 * the levels of boxes.  Work: some pages a call, 32 boxes of each for each of
 * the spheres that meet it. */

enum { INCODE_LOOK_CELLS = INCODE_REGIONS };

struct incode_look {
    struct incode_maker *maker;
    double scale; /* 2^k, of relative coordinates */
    /* A bit for each brick: to be passed over; reached, now or before. */
    const uint64_t *passed;
    uint64_t *wanted;
    /* A word a brick, a bit a point: those of a brick that is wanted which a
     * cell may reach, of all cells so far; or NULL. */
    uint64_t *sought;
    bool every;          /* all bricks that a cell reaches, not one */
    bool closely;        /* a brick is reached where a point of it is */
    uint32_t first, end; /* no bricks but these, */
    uint32_t pass_first, pass_last; /* of which these are passed, too, */
    bool bounded;                   /* and those outside this box */
    double lo[3], hi[3];
    uint32_t at;    /* bricks before it have been looked at */
    uint32_t pages; /* left in this call */
    uint32_t count;
    uint64_t reached;                 /* a bit a cell */
    uint8_t tried[INCODE_LOOK_CELLS]; /* bricks, closely */
    uint32_t cell[INCODE_LOOK_CELLS];
    struct incode_regions regions;
};

void incode_look_init(struct incode_look *look, struct incode_maker *maker,
                      const uint64_t *passed, uint64_t *wanted);

/* Begins without cells; bricks [first, last) are passed over. every: all bricks
 * that a cell may reach become wanted, and the cells are not reported.
 * Otherwise one such brick becomes wanted for each cell that may reach any. */
void incode_look_begin(struct incode_look *look, bool every, uint32_t first,
                       uint32_t last);

static inline bool incode_look_is_full(const struct incode_look *look) {
    return look->count == INCODE_LOOK_CELLS;
}

void incode_look_add(struct incode_look *look, const struct incode_complex *x,
                     uint32_t cell);

/* Tests some pages. */
enum incode_step incode_look_go(struct incode_look *look);

/* Whether cell i of those added may reach a brick. */
static inline bool incode_look_has_reached(const struct incode_look *look,
                                           uint32_t i) {
    return (look->reached >> i & 1) != 0;
}

/* The points that have not been inserted yet, as far as the highest boxes tell:
 * whether one may lie in the sphere of a cell, which is final otherwise.
 *
 * They are the bricks before one and those from another on: some 30 boxes of
 * each level for each of the two, and what is in those of others' boxes that
 * reach into the own bricks' box.  A sphere within that box is apart from all
 * others.  What these boxes do not tell, a look does.
 *
 * Memory: struct incode_rest, about 21 KB. */

enum { INCODE_REST_MAX = (INCODE_LEVELS_MAX - 1) * 2 * INCODE_FANOUT };

struct incode_rest {
    /* Absolute coordinates; filled up to a multiple of 8 with boxes that
     * nothing reaches. */
    alignas(64) double lo[3][INCODE_REST_MAX];
    alignas(64) double hi[3][INCODE_REST_MAX];
    uint32_t count;
    /* The box of the own bricks, and how many boxes, the first, reach into it:
     * as bricks are cut apart, those of others do not. */
    double own_lo[3], own_hi[3];
    uint32_t inner;
    uint32_t own_first, own_last;
    uint32_t spare; /* room for boxes in those that do */
};

/* All bricks but those of the own ones, [first, last), that have been inserted,
 * [first, from); first < from <= last.  False: a page is missing. */
bool incode_rest_set(struct incode_rest *rest, struct incode_maker *maker,
                     uint32_t first, uint32_t from, uint32_t last);

/* The own bricks [from, last) alone. */
bool incode_rest_set_own(struct incode_rest *rest, struct incode_maker *maker,
                         uint32_t from, uint32_t last);

/* Whether a point of the rest may lie in the sphere of a cell, or beyond its
 * facet or in its plane, as far as the rest's boxes tell. */
bool incode_rest_reaches(const struct incode_rest *rest,
                         const struct incode_complex *x,
                         const struct incode_cell *c);

enum {
    INCODE_INSERTION_EMITTED = 128,    /* tetrahedra at a time */
    INCODE_INSERTION_BRICKS = 32,      /* taken in at a time, unless all fit */
    INCODE_INSERTION_LISTED = 1024,    /* cells */
    INCODE_INSERTION_LEAST = 40 << 10, /* bytes */
    INCODE_INSERTION_KNOWN = 32        /* part of the memory, below */
};

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
    INCODE_INSERTION_OTHERS,
    INCODE_INSERTION_APART,
    INCODE_INSERTION_LIST,
    INCODE_INSERTION_EMIT,
    INCODE_INSERTION_RELEASE,
    INCODE_INSERTION_COMMIT,
    INCODE_INSERTION_DONE
};

struct incode_insertion {
    struct incode_complex complex;
    struct incode_maker *maker;
    struct incode_front_outside outside;
    uint64_t kept, left, vertices; /* tetrahedra emitted, or left to others;
                                      points inserted */
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
    /* The same of points of bricks to be visited at the end: they may lie in
     * the sphere of a cell at an own point.  NULL: any may. */
    uint64_t *sought;
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
    bool apart;    /* a region alone: what is final is told from what others'
                      points may reach */

    enum incode_insertion_stage stage;
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

/* Bytes that the triangulation of so many points usually takes, beside two bits
 * a brick.  If not all points are inserted at once, one or two words a brick
 * are added, unless they are more than one part in INCODE_INSERTION_KNOWN of
 * the memory. */
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

enum incode_step incode_insertion_step(struct incode_insertion *n);

/* The stages of an insertion, for the files of this room only. insertion.c
 * inserts points. rest.c tests boxes of bricks to come. finality.c finds the
 * cells that are final. region.c emits and releases them. */

enum {
    INCODE_INSERTION_AHEAD = 16, /* bricks requested together */
    INCODE_INSERTION_STEPS = 64, /* a call, at most */
    INCODE_INSERTION_UNITS = 4,  /* of work, a point */
    INCODE_INSERTION_CELLS = 16  /* looked at as a unit of work */
};

/* Begins to take the bricks [from, to) in. */
void incode_insertion_take_in(struct incode_insertion *n);

enum incode_step incode_insertion_rest(struct incode_insertion *n);
enum incode_step incode_insertion_judge(struct incode_insertion *n);
enum incode_step incode_insertion_look(struct incode_insertion *n);
enum incode_step incode_insertion_visit(struct incode_insertion *n);
enum incode_step incode_insertion_settle(struct incode_insertion *n);
enum incode_step incode_insertion_others(struct incode_insertion *n);
enum incode_step incode_insertion_apart(struct incode_insertion *n);

/* Begins to emit the cells that are proved. */
void incode_insertion_begin_list(struct incode_insertion *n);

enum incode_step incode_insertion_list(struct incode_insertion *n);
enum incode_step incode_insertion_emit(struct incode_insertion *n);
enum incode_step incode_insertion_release(struct incode_insertion *n);
enum incode_step incode_insertion_commit(struct incode_insertion *n);

static inline void incode_insertion_set_bit(uint64_t *bits, uint32_t i) {
    bits[i / 64] |= UINT64_C(1) << i % 64;
}

/* Records a point that was inserted before its turn, or belongs to another
 * node. */
static inline void incode_insertion_note(const struct incode_insertion *n,
                                         uint32_t id) {
    if (n->inserted != NULL)
        n->inserted[id / INCODE_BRICK_POINTS] |= UINT64_C(1)
                                                 << id % INCODE_BRICK_POINTS;
}

/* Whether a point was recorded in this way, if there is memory for records. */
static inline bool incode_insertion_has_noted(const struct incode_insertion *n,
                                              uint32_t id) {
    return n->inserted != NULL &&
           (n->inserted[id / INCODE_BRICK_POINTS] >> id % INCODE_BRICK_POINTS &
            1) != 0;
}

/* Whether no point of others' bricks is inserted. */
static inline bool incode_insertion_is_alone(const struct incode_insertion *n) {
    return n->outside.left != NULL;
}

/* The bricks whose points may be inserted: [base, end). */
static inline uint32_t incode_insertion_base(const struct incode_insertion *n) {
    return incode_insertion_is_alone(n) ? n->own_first : 0;
}

static inline uint32_t incode_insertion_end(const struct incode_insertion *n) {
    return incode_insertion_is_alone(n) ? n->own_last : n->maker->tree.bricks;
}

/* Whether these are the own ones. */
static inline bool incode_insertion_owns_all(const struct incode_insertion *n) {
    return n->own_last - n->own_first ==
           incode_insertion_end(n) - incode_insertion_base(n);
}

/* The fall back to faces, when an insertion does not fit any more.  The faces
 * between released tetrahedra and cells that are not yet final are open.  They
 * and the reached vertices are sent to the host as spilled toggles.  So the
 * front begins with an empty list, and the toggles of each brick come back in
 * its turn. */

struct incode_fallback {
    struct incode_insertion *n;
    uint32_t cell;   /* at work: facets of cells first, */
    uint32_t vertex; /* then vertices ahead of their turn, */
    uint32_t brick;  /* then points of bricks */
    struct incode_face faces[INCODE_BRICK_POINTS];
    uint32_t count;
};

void incode_fallback_begin(struct incode_fallback *h,
                           struct incode_insertion *n);

/* front: idle, with the rule and the bricks of the job, which is its next job.
 * INCODE_FINISHED: everything has been sent. */
enum incode_step incode_fallback_step(struct incode_fallback *h,
                                      struct incode_front *front);

#endif
