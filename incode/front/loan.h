/* Stars that a loaded front lends to who has nothing to do: a run of its ready
 * vertices with their open faces.  Who borrows them (incode/borrower.h) finds
 * tetrahedra beside those faces, and beside the faces that these open at the
 * same vertices, and tells them in the order in which it found them.  The
 * faces stay open meanwhile, and their vertices are not worked on here.
 *
 * What comes back counts only as far as its face is open when it comes, and is
 * then built as if it had been found here: emitted, shared with the others, its
 * faces toggled.  So each tetrahedron is still toggled once everywhere,
 * whatever has been built from elsewhere while the run was out, and nobody but
 * the lender and the borrower knows of a loan.
 *
 * A run is taken from the far end of the order of work: the lowest vertices of
 * the lowest bricks.  There is less of it that work here will come to next.
 * Only what is at hand is lent: nothing that is spilled, on its way back, or of
 * a hub.
 *
 * Memory: struct incode_loan, 780 bytes, and struct incode_found, 1,028, which
 * also travel, as far as they are in use.  Work: to lend, a look at 64 bricks
 * and at the faces of 4 vertices; to use, four toggles a tetrahedron.
 *
 *     if (incode_front_lend_run(&front, &loan))
 *         send(&loan, incode_loan_bytes(&loan));
 *     used += incode_front_use_found(&front, &found, used, 32);
 *     if (used == found.count)
 *         incode_front_return(&front, &loan);
 */
#ifndef INCODE_LOAN_H
#define INCODE_LOAN_H

#include "front.h"

enum {
    INCODE_LOAN_VERTICES = 4, /* of a loan, at most */
    INCODE_LOAN_FACES = 64,   /* that it has, and that are found, at most */
    INCODE_LOAN_LEAST = 8,    /* ready vertices: who has fewer lends none */
    INCODE_LOAN_SHARE = 4     /* of those that are ready one is lent */
};

struct incode_loan {
    uint32_t first, last; /* the lender's bricks, [first, last) */
    uint32_t count;       /* faces, those of a vertex one after another */
    uint32_t v[INCODE_LOAN_FACES][3]; /* v[0]: the vertex of its star */
};

/* A face of a star that was lent and the apex of the tetrahedron beside it, or
 * INCODE_NONE where it is of the hull. */
struct incode_found {
    uint32_t count;
    uint32_t v[INCODE_LOAN_FACES][4];
};

static inline size_t incode_loan_bytes(const struct incode_loan *loan) {
    return offsetof(struct incode_loan, v) + loan->count * sizeof loan->v[0];
}

static inline size_t incode_found_bytes(const struct incode_found *found) {
    return offsetof(struct incode_found, v) + found->count * sizeof found->v[0];
}

/* Lends a run; false: there is too little to do.  Each loan is to be returned,
 * unless another job begins before. */
bool incode_front_lend_run(struct incode_front *front,
                           struct incode_loan *loan);

/* Whether what was found can have been, among so many bricks. */
bool incode_found_is_sound(const struct incode_found *found, uint32_t bricks);

/* Builds found->v[from] and up, `most` of them at most, as far as their faces
 * are open: the front has room for that (incode_front_turn, emit_room).  How
 * many it has looked at. */
uint32_t incode_front_use_found(struct incode_front *front,
                                const struct incode_found *found, uint32_t from,
                                uint32_t most);

/* The loan is over: its vertices are worked on here again. */
void incode_front_return(struct incode_front *front,
                         const struct incode_loan *loan);

#endif
