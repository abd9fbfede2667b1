/* A triangulator that lends stars (front/loan.h), and uses what was found
 * there between its own steps. */
#ifndef INCODE_LENDING_H
#define INCODE_LENDING_H

#include "incode/front/exchange.h"
#include "triangulator.h"

/* As incode_front_lend_run. */
bool incode_triangulator_lend(struct incode_triangulator *t,
                              struct incode_loan *loan);

/* Uses what was found from *used on, sound, about so many units, 1 at least.
 * INCODE_WORKED: call again; INCODE_WAITING: there is no room for it before its
 * own steps have made some; INCODE_FINISHED: all of it is used, the loan is
 * over; INCODE_BROKEN. */
enum incode_step incode_triangulator_use(struct incode_triangulator *t,
                                         const struct incode_loan *loan,
                                         const struct incode_found *found,
                                         uint32_t *used, uint32_t units);

/* Who closes stars for another: takes a run that a front has lent
 * (front/loan.h), and finds tetrahedra beside its faces by the maker of its own
 * triangulator, whose front it leaves alone.  It keeps the faces that are open
 * at the run's vertices, as the lender does, and goes on across those that it
 * opens: not where a tetrahedron, or a face, is another's to build, as its
 * lowest vertex is, nor where a face waits in the list of a vertex that is not
 * of the run.  It stops when as much is found as fits an answer; what is open
 * then is the lender's as before.
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

/* Whether a triangulator of an exchange should borrow: it is quiet, and half of
 * its bricks at least are committed.  Before, what it waits for is on its way,
 * and the pages that it would ask for hold up those that others begin with. */
bool incode_triangulator_may_borrow(const struct incode_triangulator *t);

/* Whether it is a run of vertices of its lender's bricks, among so many. */
bool incode_loan_is_sound(const struct incode_loan *loan, uint32_t bricks);

/* Begins a run, of which incode_loan_bytes are read; it is sound.  t's search
 * for what is borrowed is its own from now on until it is done. */
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
