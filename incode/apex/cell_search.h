/* MakeTetra's search by the paper's uniform grid: its cells in shells around
 * the face, each shell twice as far out as the one before, until no cell that
 * is left meets the sphere of the best point so far.  Points come from the
 * pages of the grid's two lists and from their bricks; the search can be
 * suspended at a missing page, and resumed there.
 *
 * Memory: struct incode_cell_search.  Work: INCODE_CELL_SEARCH_WORK rows and
 * points a call and at most one shell; a shell's rows of cells are tested whole
 * against the sphere, and halved as long as they hold many points.
 *
 *     incode_cell_search_begin(&c, &grid, &q);
 *     walked = incode_cell_search_run(&c, &grid, &walker, &q);
 *     if (walked == INCODE_WALK_WAIT)
 *         page = q.missing;   // and INCODE_WALK_STOP: come back when you like
 */
#ifndef INCODE_CELL_SEARCH_H
#define INCODE_CELL_SEARCH_H

#include "incode/pages/cells.h"
#include "query.h"

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

/* INCODE_WALK_DONE: q->best is the apex, or INCODE_NONE at a hull facet. */
enum incode_walk incode_cell_search_run(struct incode_cell_search *c,
                                        const struct incode_grid *grid,
                                        struct incode_walker *walker,
                                        struct incode_query *q);

#endif
