/* Fronts that share one active face list: each has the faces of its own
 * vertices, and they tell each other the tetrahedra that they build.
 *
 * Regions are runs of bricks.  A tetrahedron belongs to the front that owns its
 * lowest vertex (its number; owner.h); only that front builds it, toggles its
 * own faces and shares it with the owners of its other vertices, who toggle
 * theirs (incode_front_take).  A facet of the hull is the business of its
 * lowest vertex, and is shared likewise.  So each tetrahedron toggles once
 * everywhere, and no double has to be recognised.
 *
 * A face is pursued by the owner of its lowest vertex alone; the others keep it
 * open until they hear of its tetrahedra.  Where the apex found is lower still
 * and foreign, the tetrahedron is the apex's owner's to build: the face stays
 * open until it comes.  Nobody ever has to build across such a face:
 *
 *   All tetrahedra are built if each vertex without a lower neighbour has a
 *   first one.  By induction on the number of a vertex v: all tetrahedra of v
 *   with a lower vertex are built, as their lowest vertex is below v.  The link
 *   of v is a sphere or a disk, so its triangles hang together by edges.  If v
 *   has a lower neighbour, there are triangles with a lower vertex, and a way
 *   leads from them to each triangle that has none; where it enters such
 *   triangles it crosses an edge (b, c), b and c above v: the face (v, b, c)
 *   has v lowest and is open, its owner pursues it and builds the next
 *   tetrahedron, which is v's, and so on.  If v has no lower neighbour, the
 *   same way leads on from its first tetrahedron.
 *
 * When all fronts are quiet, the lowest vertex at which something is missing
 * has thus no tetrahedron at all, so it is enough to try a first one at each
 * vertex that has none (incode_front_seed_all), once: where it is foreign, the
 * vertex has a lower neighbour and will be reached.  One at the start, wherever
 * it is the front's own, sets it to work.
 *
 * Order of work: highest bricks first, as it is low ones that wait for others;
 * and faces that look out of the region to where lower ones are come last, as
 * their tetrahedra may come by themselves.
 *
 * A brick is committed when no open face has a vertex of it and all of its
 * vertices are reached: its stars are closed for good.  A sweep over the list
 * now and then finds such bricks: it marks those that a face touches, and
 * whatever is opened meanwhile marks its own.
 *
 * A front may lend stars to others that have nothing to do (loan.h).  What they
 * find counts only while its face is open, so that all of this holds as before;
 * the bricks of vertices that are lent are not committed, and the front is not
 * quiet, until they are back.
 *
 * Work: a call of incode_front_next looks at 256 lists of the hash and all
 * that is in them, or 512 entries and 64 commits of a sweep; or at 256 bricks
 * or entries in search of a vertex, and at a bit for each own brick, 64 at a
 * time; or, to let faces go, at the lists of one brick. */
#ifndef INCODE_EXCHANGE_H
#define INCODE_EXCHANGE_H

#include "front.h"

/* Stars that a loaded front lends to who has nothing to do: a run of its ready
 * vertices with their open faces.  Who borrows them (incode/lending.h) finds
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
 * and at the faces of 4 vertices; to use, four toggles a tetrahedron. */

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

/* Bytes of the maps for so many bricks. */
static inline size_t incode_exchange_bytes(uint32_t bricks) {
    return 3 * (((size_t)bricks + 63) / 64) * sizeof(uint64_t);
}

/* From now on the front exchanges.  lo: of the box of all points.  maps:
 * incode_exchange_bytes of all bricks, aligned to 8 bytes; they stay.  The
 * owner rule is INCODE_OWNER_LOWEST, the face rule INCODE_FACE_OWN. */
void incode_front_exchange(struct incode_front *front,
                           const struct incode_front_peers *peers,
                           const double lo[3], uint64_t *maps);

/* Whether so many tetrahedra may come now, INCODE_TAKEN_MAX at most: what they
 * may spill has room.  False: not before there is room outside. */
bool incode_front_may_take(struct incode_front *front, uint32_t count);

/* A tetrahedron that another front has built, of positive orientation, with an
 * own vertex; v[3] = INCODE_NONE: a facet of the hull, as it was open.  0; -1:
 * it is none that can come.  Where it might not come, or the list is full,
 * front->fault says so. */
int incode_front_take(struct incode_front *front, const uint32_t v[4]);

/* All fronts are quiet, and nothing is under way: first tetrahedra are to be
 * tried where there are none. */
void incode_front_seed_all(struct incode_front *front);

/* Whether there is nothing to do until a tetrahedron comes. */
static inline bool incode_front_is_quiet(const struct incode_front *front) {
    return front->finished || front->exchange.quiet;
}

/* Own bricks that are not committed. */
static inline uint32_t incode_front_left(const struct incode_front *front) {
    return front->finished ? 0 : front->exchange.left;
}

/* ---- for the other files of the front ---- */

/* A job begins. */
void incode_exchange_start(struct incode_front *front);

/* As incode_front_next and incode_front_count. */
enum incode_turn incode_exchange_next(struct incode_front *front,
                                      uint32_t *which);
enum incode_turn incode_exchange_count(struct incode_front *front,
                                       uint32_t count);

/* Begins a task; INCODE_TURN_WAIT: all are in use (order.c). */
enum incode_turn incode_front_begin(struct incode_front *front, uint32_t v,
                                    bool seed, uint32_t *which);

/* Whether there is room for a star (front.c). */
bool incode_front_has_room(const struct incode_front *front);

/* Asks for the next spilled brick, if there is one and room for it (order.c).
 */
bool incode_front_fetch(struct incode_front *front);

/* Whether a face, or a tetrahedron, is another's to build. */
static inline bool incode_exchange_is_foreign(const struct incode_front *front,
                                              const uint32_t *v,
                                              unsigned count) {
    return front->exchange.on && !incode_own(front, v[incode_lowest(v, count)]);
}

/* Whether a tetrahedron is so near a side of the region beyond which there are
 * lower ones that its faces may look out there; p: its vertices' coordinates.
 */
bool incode_exchange_is_near_side(const struct incode_front *front,
                                  const double *const p[4]);

static inline bool incode_exchange_is_near(const struct incode_front *front,
                                           const double *const p[4]) {
    return front->exchange.below != 0 && incode_exchange_is_near_side(front, p);
}

/* Whether a face does: a step of an edge's length from its centre outward leads
 * below the region's box. */
bool incode_exchange_is_outward(const struct incode_front *front,
                                const double *const p[3]);

/* Opens f, whose twin is not open, in the list of f[0]. */
void incode_exchange_open(struct incode_front *front, const uint32_t f[3],
                          enum incode_face_state state);

/* The same, or closes its twin. */
static inline void incode_exchange_toggle(struct incode_front *front,
                                          const uint32_t f[3],
                                          enum incode_face_state state) {
    if (!incode_afl_close_twin(&front->afl, f[0], f[1], f[2]))
        incode_exchange_open(front, f, state);
}

/* A face of the vertex may be open. */
void incode_exchange_ready(struct incode_front *front, uint32_t v);

/* The vertices of an own brick whose faces can be pursued, a bit each. */
uint64_t incode_exchange_pending(const struct incode_front *front,
                                 uint32_t brick);

/* A brick that was spilled is whole again. */
void incode_exchange_returned(struct incode_front *front, uint32_t brick);

/* A tetrahedron or facet of the hull was built; shared: others have a vertex of
 * it, and are told. */
static inline void incode_exchange_share(struct incode_front *front,
                                         const uint32_t v[4], bool shared) {
    struct incode_exchange *e = &front->exchange;
    e->changes++;
    e->fetched = 0;
    if (shared)
        e->peers.share(e->peers.context, v);
}

#endif
