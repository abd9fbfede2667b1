/* A triangulator that lends stars (front/exchange.h), and uses the tetrahedra
 * that a borrower found between its own steps. */
#ifndef INCODE_LENDING_H
#define INCODE_LENDING_H

#include "incode/front/exchange.h"
#include "triangulator.h"

/* As incode_front_lend_run. */
bool incode_triangulator_lend(struct incode_triangulator *t,
                              struct incode_loan *loan);

/* Uses the tetrahedra in found from *used on, for about so many units of work,
 * at least 1. found must be sound.  INCODE_WORKED: call again.  INCODE_WAITING:
 * steps of the lender must make room first.  INCODE_FINISHED: all are used, and
 * the loan is over.  Or INCODE_BROKEN. */
enum incode_step incode_triangulator_use(struct incode_triangulator *t,
                                         const struct incode_loan *loan,
                                         const struct incode_found *found,
                                         uint32_t *used, uint32_t units);

/* A borrower closes stars for another node.  It takes a run of vertices that a
 * front has lent (front/exchange.h), and finds tetrahedra beside their faces
 * with the maker of its own triangulator; it does not change that
 * triangulator's front.  Like the lender, it keeps a list of the open faces at
 * the run's vertices, and continues across the faces that it opens.  It does
 * not continue across a face or tetrahedron whose lowest vertex belongs to
 * another node, nor across a face in the list of a vertex outside the run.  It
 * stops when the answer is full.  Faces that are then open remain with the
 * lender.
 *
 * Memory: struct incode_borrower, about 2.6 KB, and a search of the maker. */

enum { INCODE_BORROWER_OPEN = 128 /* faces at once; where more, it ends */ };

struct incode_borrower {
    uint32_t first, last; /* the lender's bricks */
    struct incode_found found;
    uint32_t vertices, vertex[INCODE_LOAN_VERTICES];
    uint32_t open, face[INCODE_BORROWER_OPEN][3]; /* v[0]: its star's vertex */
    uint32_t v;                                   /* of the star at work */
    uint32_t stars;                               /* at which it has worked */
    bool waits;                                   /* for a page */
    bool full;                                    /* there is no room */
    bool done;
};

/* Whether a triangulator of an exchange should borrow: it is quiet, and at
 * least half of its bricks are committed.  Before that, the tetrahedra that it
 * waits for are on their way, and its page requests would delay the first pages
 * of other nodes. */
bool incode_triangulator_may_borrow(const struct incode_triangulator *t);

/* Whether the loan is a run of vertices of its lender's bricks, in a set of
 * `bricks` bricks. */
bool incode_loan_is_sound(const struct incode_loan *loan, uint32_t bricks);

/* Begins a run, which must be sound, and of which incode_loan_bytes are read.
 * The borrower uses t's search for borrowed faces until it is done. */
void incode_borrower_begin(struct incode_borrower *b,
                           struct incode_triangulator *t,
                           const struct incode_loan *loan);

/* Works on, about so many units, 1 at least: INCODE_WORKED; INCODE_WAITING for
 * a page; INCODE_FINISHED: b->found is complete; INCODE_BROKEN, with t's fault
 * set. */
enum incode_step incode_borrower_step(struct incode_borrower *b,
                                      struct incode_triangulator *t,
                                      uint32_t units);

#endif
