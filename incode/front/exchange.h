/* Fronts that share one active face list: each has the faces of its own
 * vertices, and sends the tetrahedra that it builds to the others that need
 * them.
 *
 * Regions are runs of bricks.  A tetrahedron belongs to the front that owns its
 * vertex of the lowest number (job.h).  Only that front builds it.  It toggles
 * its own faces and sends the tetrahedron to the owners of the other vertices,
 * which toggle theirs (incode_front_take).  The owner of the lowest vertex of a
 * hull facet finds the facet, and sends it in the same way.  So each
 * tetrahedron toggles once at each front, and no front has to recognise
 * duplicates.
 *
 * Only the owner of a face's lowest vertex pursues it.  The others keep it open
 * until its tetrahedra arrive.  If the apex is still lower and foreign, the
 * owner of the apex builds the tetrahedron, and the face stays open until it
 * arrives.  No front ever has to build across such a face.
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
 * So when all fronts are quiet, the lowest vertex at which something is missing
 * has no tetrahedron at all.  Therefore it is enough to try a first tetrahedron
 * once at each vertex that has none (incode_front_seed_all).  If the first
 * tetrahedron is foreign, the vertex has a lower neighbour and will be reached.
 * At the start one first tetrahedron of the front's own gives it work.
 *
 * Order of work: highest bricks first, because the lower regions' fronts wait
 * for the low borders.  Faces that look out of the region towards lower regions
 * come last, because their tetrahedra may arrive from other fronts.
 *
 * A brick is committed when no open face has a vertex of it and all of its
 * vertices are reached: then its stars stay closed.  A periodic sweep over the
 * list finds such bricks.  It marks the bricks that an open face touches; a
 * face that is opened meanwhile marks its bricks.
 *
 * A front may lend stars to fronts that have nothing to do (below).  A
 * tetrahedron that a borrower finds counts only if its face is still open, so
 * all of the above holds.  Until the stars are returned, the bricks of lent
 * vertices are not committed, and the front is not quiet.
 *
 * Work: a call of incode_front_next does one of three things.  In a sweep it
 * reads 256 lists of the hash with all their faces, or 512 entries, and makes
 * 64 commits.  In search of a vertex it reads 256 bricks or entries, and a bit
 * for each own brick, 64 at a time.  To release faces it reads the lists of one
 * brick. */
#ifndef INCODE_EXCHANGE_H
#define INCODE_EXCHANGE_H

#include "front.h"

/* A loaded front lends stars to a front that has nothing to do: a run of its
 * ready vertices with their open faces.  The borrower (incode/lending.h) finds
 * tetrahedra beside these faces, and beside the faces that these tetrahedra
 * open at the same vertices, and returns them in the order in which it found
 * them.  Meanwhile the faces stay open, and the lender does not work at their
 * vertices.
 *
 * A returned tetrahedron counts only if its face is open when it arrives.  The
 * lender then builds it like one of its own: it emits it, sends it to the other
 * owners, and toggles its faces.  So each tetrahedron is still toggled once at
 * each front, whatever other fronts have built while the run was out.  Only the
 * lender and the borrower know of a loan.
 *
 * A run is taken from the far end of the order of work, which the lender would
 * reach last: the lowest vertices of the lowest bricks.  Faces that are
 * spilled, on their way back, or of a hub are not lent.
 *
 * Memory: struct incode_loan, 780 bytes, and struct incode_found, 1,028, of
 * which the used parts also travel.  Work: to lend, 64 bricks and the faces of
 * 4 vertices are read; to use, four toggles for each tetrahedron. */

enum {
    INCODE_LOAN_VERTICES = 4, /* of a loan, at most */
    INCODE_LOAN_FACES = 64,   /* that it has, and that are found, at most */
    INCODE_LOAN_LEAST = 8,    /* ready vertices of a front that lends */
    INCODE_LOAN_SHARE = 4     /* one of so many ready vertices is lent */
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

/* Lends a run; false: too few vertices are ready.  Each loan is to be returned,
 * unless another job begins before. */
bool incode_front_lend_run(struct incode_front *front,
                           struct incode_loan *loan);

/* Whether the content of found is possible in a set of `bricks` bricks. */
bool incode_found_is_sound(const struct incode_found *found, uint32_t bricks);

/* Builds up to `most` tetrahedra, found->v[from] and those after it, if their
 * faces are open.  The front must have room (incode_front_turn, emit_room).
 * Returns how many it has tested. */
uint32_t incode_front_use_found(struct incode_front *front,
                                const struct incode_found *found, uint32_t from,
                                uint32_t most);

/* The loan is over: the front works at its vertices again. */
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

/* Whether incode_front_take may be called `count` times now, at most
 * INCODE_TAKEN_MAX: there is room for the faces that it may spill.  False:
 * there must be room outside first. */
bool incode_front_may_take(struct incode_front *front, uint32_t count);

/* Takes a tetrahedron of positive orientation, with an own vertex, that another
 * front has built. v[3] = INCODE_NONE: a facet of the hull, as it was open.
 * Returns 0, or -1 if no front can send it. front->fault is set if it should
 * not have been sent, or if the list is full. */
int incode_front_take(struct incode_front *front, const uint32_t v[4]);

/* All fronts are quiet, and no tetrahedron is under way: the front tries first
 * tetrahedra at vertices that have none. */
void incode_front_seed_all(struct incode_front *front);

/* Whether there is no work until a tetrahedron arrives. */
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

/* Requests the next spilled brick, if there is one and room for it (order.c).
 */
bool incode_front_fetch(struct incode_front *front);

/* Whether another front owns the lowest vertex of a face or tetrahedron. */
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

/* A tetrahedron or facet of the hull was built; shared: it is sent to other
 * fronts, which own a vertex of it. */
static inline void incode_exchange_share(struct incode_front *front,
                                         const uint32_t v[4], bool shared) {
    struct incode_exchange *e = &front->exchange;
    e->changes++;
    e->fetched = 0;
    if (shared)
        e->peers.share(e->peers.context, v);
}

#endif
