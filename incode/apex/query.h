/* Walks down the tree of boxes to the leaves that a query concerns, in page
 * order or in reverse.  A walk can be suspended at a missing page and resumed
 * there.
 *
 * Memory: the struct; stack for INCODE_LEVELS_MAX levels. */
#ifndef INCODE_QUERY_H
#define INCODE_QUERY_H

#include <stdbool.h>
#include <stdint.h>

#include "sphere.h"
#include "incode/pages/pager.h"
#include "incode/predicates/predicates.h"

enum incode_question {
    INCODE_QUERY_BOX,     /* bricks that meet a box, all their leaves */
    INCODE_QUERY_APEX,    /* the apex of a face: first in Delaunay distance */
    INCODE_QUERY_NEAREST, /* the nearest neighbour of v */
    INCODE_QUERY_HALF_SPACE, /* the half-space of a normal that holds all points
                              */
    INCODE_QUERY_CIRCLE      /* the smallest circle through v and b: a start for
                                the search of a first face, approximate */
};

struct incode_query {
    enum incode_question question;
    bool boxed;           /* only what meets [lo, hi] */
    bool strictly_beyond; /* APEX: only points clearly beyond the face */
    bool ahead;          /* BOX: asks for missing bricks and passes them over */
    bool shrinking;      /* APEX: the box is that of the best's sphere */
    bool round;          /* APEX: what matters lies in the ball below */
    bool lens;           /* round: it is less than the sphere (sphere.h) */
    bool large;          /* round, and the sphere itself excludes boxes, too */
    bool done;           /* not what lies within [done_lo, done_hi] */
    bool yields;         /* the walk is suspended where the walker has no more
                            units left, with INCODE_NONE missing */
    double lo[3], hi[3]; /* absolute coordinates */
    double done_lo[3], done_hi[3];
    uint32_t v, b, c;            /* vertex numbers */
    double pv[3], pb[3], pc[3];  /* absolute coordinates */
    double scale;                /* relative = (p - pv) * scale */
    double rb[3], rc[3];         /* b and c, relative */
    struct incode_sphere sphere; /* HALF_SPACE: its plane's normal alone */
    struct incode_near_degenerate
        degenerate; /* APEX: bounds the box of a best without a ball */
    const struct incode_empty_spheres *empty; /* APEX, or NULL */
    struct incode_radical_bound radical;      /* by these, of the best */
    struct incode_half_space
        half_space;     /* HALF_SPACE: what holds all points so far */
    double peak[3];     /* centre of the sphere, where its value peaks */
    double centre[3];   /* of the ball */
    double square;      /* of its radius, widened */
    double plane_slack; /* of n . p within the ball */
    double t; /* where in a pencil the ball is, of the first candidate so far */
    double limit;      /* NEAREST, CIRCLE: squared, relative */
    uint32_t contests; /* APEX: points in doubt so far */
    uint32_t looked;   /* APEX: leaves so far */
    uint32_t best;     /* vertex number, or INCODE_NONE */
    double best_p[3];
    uint32_t pages, pages_max; /* needed so far; a walk stops at more than that,
                                  unless it is 0 */
    uint32_t cursor;           /* so many bricks are done */
    bool down; /* from the last brick to the first, set before the first page */
    uint32_t missing; /* the page a suspended walk waits for */
};

/* Coordinates relative to the query's vertex, scaled. */
static inline void incode_query_relative(double out[3],
                                         const struct incode_query *q,
                                         const double p[3]) {
    for (int d = 0; d < 3; d++)
        out[d] = (p[d] - q->pv[d]) * q->scale;
}

/* What a walk needs. */
struct incode_walker {
    struct incode_pager *pager;
    const struct incode_tree *tree;
    struct incode_tally *tally;
    uint64_t *candidates;
    uint32_t left; /* units of work of this call, as it goes on: the bricks
                      that may be visited; one is always */
};

/* Counts `units` units of work. */
static inline void incode_walker_spend(struct incode_walker *walker,
                                       uint32_t units) {
    walker->left = walker->left > units ? walker->left - units : 0;
}

/* Called before `units` units of work (incode/predicates/yield.h). */
static inline void incode_walker_yield(const struct incode_walker *walker,
                                       uint32_t units) {
    incode_yield_after(&walker->tally->yield, units);
}

/* Called with a brick and its leaves that pass, one bit each; false stops the
 * walk. */
typedef bool incode_visit(struct incode_walker *walker, struct incode_query *q,
                          const struct incode_frame *frame, uint32_t brick,
                          uint32_t leaves, void *context);

enum incode_step incode_walk(struct incode_walker *walker,
                             struct incode_query *q, incode_visit *visit,
                             void *context);

/* The same for one brick. */
enum incode_step incode_walk_brick(struct incode_walker *walker,
                                   struct incode_query *q, uint32_t brick,
                                   incode_visit *visit, void *context);

/* Sets the direction of a HALF_SPACE query: that of a face at pv. */
void incode_query_half_space(struct incode_query *q, const double pv[3],
                             const double n[3], double scale);

/* Sets the face (v, b, c) of an APEX query: plane and scale. */
void incode_query_face(struct incode_query *q);

/* Sets the sphere through the face and a point beyond it. */
void incode_query_apex(struct incode_query *q, struct incode_tally *tally,
                       const double p[3]);

/* The first candidate, known to be beyond the face; the sphere is that through
 * it already. */
void incode_query_start(struct incode_query *q, uint32_t id, const double p[3]);

/* From now on only what meets the sphere of the best so far matters. */
void incode_query_shrink(struct incode_query *q);

enum { INCODE_QUERY_CROWD = 64 }; /* so many leaves are many */

/* Counts a leaf; where they are many, a radical plane may rule out others. */
void incode_query_look(struct incode_query *q);

/* A candidate for the apex: takes it if it is strictly on the unknown side and
 * inside the sphere of the best so far.  Exact. */
void incode_query_consider(struct incode_query *q, struct incode_tally *tally,
                           uint32_t id, const double p[3]);

/* Which of up to 32 boxes the question concerns, one bit each.  lo, hi: arrays
 * aligned to 64 bytes, filled up to a multiple of 8. */
uint32_t incode_query_boxes(const struct incode_query *q,
                            const double *const lo[3],
                            const double *const hi[3], unsigned count);

/* Which of 8 points, in arrays aligned to 64 bytes, an APEX query must
 * consider, one bit each. */
uint32_t incode_query_lanes(const struct incode_query *q,
                            const double *const axis[3]);

/* Visits the points of the leaves for all but BOX. */
incode_visit incode_visit_points;

/* 2^k with k such that 2^k * extent is about 1; exact, never 0 or infinite. */
double incode_scale_for(double extent);

/* MakeTetra's search in the paper's uniform grid.  It takes the cells in shells
 * around the face, each shell twice as far out as the one before, until no
 * remaining cell meets the sphere of the best point so far.  Points come from
 * the pages of the grid's two lists and from their bricks; the search can be
 * suspended at a missing page, and resumed there.
 *
 * Work: INCODE_CELL_SEARCH_WORK rows and points a call and at most one shell; a
 * shell's rows of cells are tested whole against the sphere, and halved as long
 * as they hold many points. */

enum {
    INCODE_CELL_SEARCH_WORK = 4096,
    INCODE_CELL_SEARCH_UNIT = 64, /* of these make a unit of the walker */
    INCODE_CELL_SEARCH_PIECE = 24 /* points of a row that need no halving */
};

struct incode_cell_search {
    uint32_t centre[3];   /* the cell that the shells lie around */
    uint32_t done, reach; /* shells up to done are through, reach is at work */
    bool any_done;        /* done counts */
    uint32_t z, y, x;     /* next cells of the shell */
    uint32_t list, end;   /* entries of the list still to be looked at */
    bool has_below;       /* below: a point short of the face, if one was met */
    double below[3];
};

/* Begins at an INCODE_QUERY_APEX whose face is set. */
void incode_cell_search_begin(struct incode_cell_search *c,
                              const struct incode_grid *grid,
                              const struct incode_query *q);

/* INCODE_FINISHED: q->best is the apex, or INCODE_NONE at a hull facet. */
enum incode_step incode_cell_search_run(struct incode_cell_search *c,
                                        const struct incode_grid *grid,
                                        struct incode_walker *walker,
                                        struct incode_query *q);

#endif
