/* The front: which faces are open, in which order vertices are closed, and
 * which tetrahedra are kept.  It holds the active face list, spills faces that
 * do not fit, and asks for apexes.  It does not know how, or from which points,
 * the apexes are found.
 *
 * Memory: struct incode_front, about 19 KB, and the share of an arena that
 * incode_front_bytes states, for the active face list.
 *
 * Work.  To put a face into a list, or to take it out, the faces of one vertex,
 * and of vertices with the same hash, are read. incode_front_start clears all
 * hash heads and entries of bricks. incode_front_next, after the own bricks or
 * at the end of the job, may read every entry of a brick.  So may
 * incode_front_room, which incode_front_turn calls, when it decides what to
 * spill; it empties the lists of at most one brick, as far as there is room
 * outside. incode_front_drain moves at most 128 faces, incode_front_unspill
 * those that it is given.  A star has at most INCODE_STAR_FACES faces and
 * builds at most INCODE_STAR_BUILT tetrahedra.  Everything else is constant, or
 * reads the 16 tasks or the 32 hubs.
 *
 * A task is the work at one vertex; it may be suspended and resumed.  It runs
 * between incode_front_run and incode_front_done or _suspend.  There are two
 * kinds of tasks.  One opens the whole star (incode_star_open), takes its faces
 * one by one (_take), builds the tetrahedron of each (_build), and puts faces
 * without an answer back (_put, _shut).  The other copies one face
 * (incode_front_face) and uses its answer later, if the face is still open
 * (incode_front_use). */
#ifndef INCODE_FRONT_H
#define INCODE_FRONT_H

#include <stdalign.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "afl.h"
#include "incode/pages/bricks.h"
#include "job.h"

enum {
    INCODE_STAR_FACES = 256, /* open faces at one vertex held at hand */
    INCODE_STAR_BUILT = 256, /* tetrahedra a step, at most */
    INCODE_STAR_LATER = 32,  /* faces that wait to toggle elsewhere */
    INCODE_TASKS = 16,       /* vertices that wait for an answer */
    INCODE_SPILL_FACES = 1024,
    INCODE_SPILL_BUILT = 128, /* tetrahedra a step while faces are spilled */
    INCODE_HUBS = 32,
    INCODE_PATIENCE = 8, /* retries before a task runs alone */
    INCODE_FACES_MIN = 4096,
    INCODE_ENTRIES_MIN = 512,
    INCODE_HINT_NONE = 0xffff
};

struct incode_task {
    uint32_t v;
    uint32_t retries;
    uint64_t born; /* when it was first suspended, or 0 */
    bool seed;     /* no tetrahedron has v: a first one is wanted */
};

/* A face (v, b, c) of the star at v.  hint: the maker's notes on b and c, or
 * INCODE_HINT_NONE. */
struct incode_star_face {
    uint32_t b, c;
    uint16_t hint[2];
};

struct incode_star {
    uint32_t v, faces, built;
    bool more; /* further faces of v are in the active face list */
    alignas(64) uint32_t b[INCODE_STAR_FACES];
    alignas(64) uint32_t c[INCODE_STAR_FACES];
    uint16_t ib[INCODE_STAR_FACES], ic[INCODE_STAR_FACES];
    uint32_t kept, later_count, links;
    const uint32_t *link[INCODE_STAR_LATER]; /* ways through their lists */
    uint32_t later[INCODE_STAR_LATER][3];    /* in other vertices' lists */
    uint32_t apexes[INCODE_STAR_BUILT][3];
};

struct incode_front_counts {
    uint64_t built, kept; /* tetrahedra */
    uint64_t hull_facets, seeds, spilled;
    uint64_t vertices; /* tasks begun */
    uint64_t waited;   /* of these were suspended */
    uint64_t faults;   /* suspensions for what was not there */
    uint64_t foreign;  /* tetrahedra found, and left to their owner */
    uint64_t taken;    /* that came of others */
    uint64_t lent;     /* vertices, to other fronts: exchange.h */
    uint64_t late;     /* tetrahedra found there, whose faces were closed */
};

/* The state of a front that shares its list with others: exchange.h.  A map has
 * a bit for each position of an own brick. */
struct incode_exchange {
    bool on;
    struct incode_front_peers peers;
    uint64_t *ready;     /* it may have faces to be pursued */
    uint64_t *deferred;  /* it may have faces that were put off */
    uint64_t *committed; /* its stars are closed */
    double lo[3];        /* of all points */
    double floor[3];     /* of the region: below are lower ones; or -inf */
    unsigned below;      /* bit d: there are some along d */
    uint32_t words;      /* of a map */
    uint32_t ready_from, deferred_from; /* no bit in words before */
    uint32_t elsewhere; /* entries of others' bricks, from `at` on, whose lists
                           may have faces: those of hubs */
    uint32_t at;
    bool quiet;          /* nothing to do until something comes */
    uint32_t fetched;    /* bricks, since something came or was built */
    uint32_t left;       /* own bricks that are not committed */
    uint32_t lent;       /* loans that are out: exchange.h */
    uint32_t last_count; /* points of the last own brick; 0: not known yet */
    /* First tetrahedra: tries at the start, then brick by brick. */
    uint32_t tries;
    bool seeding;
    uint32_t seed_position, seed_slot;
    /* The sweep under way. */
    uint32_t sweep; /* its number */
    bool sweeping;
    uint32_t sweep_head, sweep_entry;
    uint32_t changes; /* tetrahedra since the last one began */
};

struct incode_front {
    uint32_t bricks; /* of all regions */
    enum incode_face_rule face_rule;
    enum incode_owner_rule owner_rule; /* after init: the smallest vertex */
    struct incode_front_outside outside;
    struct incode_exchange exchange;
    struct incode_job job;
    struct incode_afl afl;
    struct incode_front_counts counts;
    const char *fault; /* NULL, or a static string */

    /* Order of work (positions: incode_position; bricks counted from the job's
     * first, or, in an exchange, from its last one down). */
    uint32_t current;       /* own bricks before this position are passed */
    uint32_t window;        /* positions worked on together */
    uint32_t spill_from;    /* faces of positions from here on are spilled */
    const uint64_t *passed; /* a bit a brick: committed before; or NULL */
    bool foreign;           /* own bricks are passed, others' faces remain */
    bool finished;
    uint32_t busy; /* tasks that are suspended, one bit each */
    uint64_t clock;
    struct incode_task task[INCODE_TASKS];

    /* Spilling. */
    struct incode_face spill[INCODE_SPILL_FACES];
    uint32_t spill_count;
    uint32_t spill_cursor; /* hash head under eviction, or INCODE_NONE */
    bool unspill_pending, spilled_any;
    uint32_t unspill_brick;

    uint32_t hubs[INCODE_HUBS], hub_count;
    uint32_t draining; /* a hub whose list is not yet empty, or INCODE_NONE */

    uint32_t room_faces, room_entries; /* kept free before a star */
    uint32_t built_max;
    struct incode_star star;
};

/* ---- memory ---- */

/* The memory of a front beside its struct. */
struct incode_front_share {
    uint32_t faces;   /* open at a time, INCODE_FACES_MIN at least */
    uint32_t entries; /* bricks touched at a time, INCODE_ENTRIES_MIN at least,
                         or what all bricks take */
};

/* Entries with which a fourth is free when all of some bricks are touched. */
static inline uint32_t incode_front_entries(uint32_t bricks) {
    return bricks + bricks / 3 + 1;
}

/* Bytes of such a share. */
size_t incode_front_bytes(const struct incode_front_share *share);

/* memory: aligned to 64 bytes, incode_front_bytes of the share.  bricks: of the
 * whole set, 1 at least.  yield: called during long work, or NULL; it must
 * outlive the front. */
void incode_front_init(struct incode_front *front, void *memory,
                       const struct incode_front_share *share, uint32_t bricks,
                       enum incode_face_rule rule,
                       const struct incode_front_outside *outside,
                       struct incode_yield *yield);

/* Abandons the current job, its fault and its outstanding requests, if there
 * are any. */
void incode_front_abandon(struct incode_front *front);

/* Moves to other memory, of another share: counts stay.  No job may be at work.
 */
void incode_front_move(struct incode_front *front, void *memory,
                       const struct incode_front_share *share);

/* Begins a job; the one before must be finished or is abandoned. */
void incode_front_start(struct incode_front *front,
                        const struct incode_job *job);

/* Begins a job some of whose bricks have been committed (`passed`, a bit a
 * brick), and all of whose open faces and reached vertices have been spilled.
 */
void incode_front_take_over(struct incode_front *front,
                            const struct incode_job *job,
                            const uint64_t *passed);

/* Delivers spilled toggles of the requested brick. -1: the brick was not
 * requested, or a face is not of it. */
int incode_front_unspill(struct incode_front *front, uint32_t brick,
                         const struct incode_face *faces, size_t count,
                         bool last);

/* ---- order of work (order.c) ---- */

enum incode_turn {
    INCODE_TURN_WORKED, /* something was done: take a turn again */
    INCODE_TURN_WAIT,   /* no work until an answer or a spilled list comes, or
                           there is room outside */
    INCODE_TURN_RESUME, /* task *task may go on */
    INCODE_TURN_NEXT,   /* none may: ask incode_front_next */
    INCODE_TURN_TASK,   /* task *task is new */
    INCODE_TURN_COUNT,  /* how many vertices are in brick *brick? */
    INCODE_TURN_END     /* the job is done, every brick committed */
};

/* Begins a step.  waiting: the suspended tasks, one bit each, whose answers are
 * not there yet. */
enum incode_turn incode_front_turn(struct incode_front *front, uint32_t waiting,
                                   uint32_t *task);

/* The next vertex to work on: INCODE_TURN_TASK and *which the task, or
 * INCODE_TURN_COUNT and *which the brick, or INCODE_TURN_WAIT, _WORKED or _END.
 */
enum incode_turn incode_front_next(struct incode_front *front, uint32_t *which);

/* The answer to INCODE_TURN_COUNT: passes the brick, or begins a task at one of
 * its vertices that no tetrahedron has. */
enum incode_turn incode_front_count(struct incode_front *front, uint32_t count,
                                    uint32_t *which);

/* Lends up to `most` faces of the next vertices, and returns how many.  They
 * are held, and stay open until incode_front_use gets their answers, or other
 * tetrahedra close them.  Faces that are moved or spilled meanwhile are lent
 * again. */
uint32_t incode_front_lend(struct incode_front *front, uint32_t (*faces)[3],
                           uint32_t most);

/* A task runs.  It may build at most `most` tetrahedra, at least 1. */
void incode_front_run(struct incode_front *front, uint32_t most);

/* A task is suspended: for an answer that needs a missing page (fault), or by
 * choice. advanced: its search made progress, so the task need not run alone.
 */
void incode_front_suspend(struct incode_front *front, unsigned task, bool fault,
                          bool advanced);

/* A task is over. */
void incode_front_done(struct incode_front *front, unsigned task);

/* The vertex that a task works on. */
static inline uint32_t incode_front_vertex(const struct incode_front *front,
                                           unsigned task) {
    return front->task[task].v;
}

/* Whether a task searches a first tetrahedron, because no tetrahedron has its
 * vertex. */
static inline bool incode_front_is_seed(const struct incode_front *front,
                                        unsigned task) {
    return front->task[task].seed;
}

/* The tasks that are suspended, one bit each. */
static inline uint32_t
incode_front_suspended(const struct incode_front *front) {
    return front->busy;
}

/* The job is done, or none was begun. */
static inline bool incode_front_is_finished(const struct incode_front *front) {
    return front->finished;
}

/* The own bricks that are not passed yet: [*first, *last), none where *first is
 * not less. */
static inline void incode_front_own_left(const struct incode_front *front,
                                         uint32_t *first, uint32_t *last) {
    *first = front->job.first + front->current;
    *last = front->job.last;
}

/* ---- faces (front.c) ---- */

static inline bool incode_own_brick(const struct incode_front *front,
                                    uint32_t brick) {
    return brick - front->job.first < front->job.last - front->job.first;
}

static inline bool incode_own(const struct incode_front *front, uint32_t v) {
    return incode_own_brick(front, v / INCODE_BRICK_POINTS);
}

/* Bricks counted from the job's first, the others after its last; or, in an
 * exchange, from the last one down. */
static inline uint32_t incode_position(const struct incode_front *front,
                                       uint32_t brick) {
    if (front->exchange.on)
        return brick < front->job.last
                   ? front->job.last - 1 - brick
                   : front->job.last - 1 + front->bricks - brick;
    return brick >= front->job.first ? brick - front->job.first
                                     : brick + front->bricks - front->job.first;
}

/* The brick there. */
static inline uint32_t incode_brick_at(const struct incode_front *front,
                                       uint32_t position) {
    if (front->exchange.on)
        return (front->job.last - 1 + front->bricks - position) % front->bricks;
    return (front->job.first + position) % front->bricks;
}

/* Of two vertices, whether the first comes before in the order of work. */
static inline bool incode_precedes(const struct incode_front *front, uint32_t v,
                                   uint32_t w) {
    return front->exchange.on ? v > w : v < w;
}

/* Which of three vertices comes first. */
static inline unsigned incode_front_first(const struct incode_front *front,
                                          const uint32_t v[3]) {
    unsigned least = incode_precedes(front, v[1], v[0]);
    return incode_precedes(front, v[2], v[least]) ? 2 : least;
}

/* Which of v's vertices has the face in its list: *turn is its index; false:
 * the face is not pursued.  p: the coordinates of its vertices. */
bool incode_front_key_slow(const struct incode_front *front,
                           const uint32_t v[3], const double *const p[3],
                           unsigned *turn);

static inline bool incode_front_key(const struct incode_front *front,
                                    const uint32_t v[3],
                                    const double *const p[3], unsigned *turn) {
    if (front->hub_count != 0 || !incode_own(front, v[0]) ||
        !incode_own(front, v[1]) || !incode_own(front, v[2]))
        return incode_front_key_slow(front, v, p, turn);
    *turn = incode_front_first(front, v);
    return true;
}

/* Toggles a face whose key is not the vertex at work; held: if it opens, it is
 * put off. */
void incode_front_toggle(struct incode_front *front, const uint32_t v[3],
                         bool held);
/* Notes that a tetrahedron has this vertex. */
void incode_front_reached(struct incode_front *front, uint32_t v);
/* Whether one has. */
bool incode_front_is_reached(const struct incode_front *front, uint32_t v);
/* Makes room for one star, and spills the last faces in the order of work.
 * False: the caller must wait or, if front->fault is set, stop. */
bool incode_front_room(struct incode_front *front);
/* Sends the spill buffer; false: there is no room for it outside. */
bool incode_front_flush(struct incode_front *front);
/* Makes a vertex with too many open faces a hub, and moves some of them to its
 * neighbours' lists, so that its list stays as short as the work around it.
 * Nothing else may run before all are moved.  False: there is nothing to do.
 * Needs room for a star. */
bool incode_front_drain(struct incode_front *front);
/* Whether a vertex of the brick is a hub. */
bool incode_front_has_hub(const struct incode_front *front, uint32_t brick);

/* ---- stars ---- */

/* Takes the open faces of a vertex out of the list; false: it has none. */
bool incode_star_open(struct incode_front *front, uint32_t v);

/* Whether the star is nearly full; has no faces left; has built enough.  In
 * each case the task ends or is suspended. */
static inline bool incode_star_is_full(const struct incode_front *front) {
    return front->star.faces > INCODE_STAR_FACES - 4;
}

static inline bool incode_star_is_closed(const struct incode_front *front) {
    return front->star.faces == 0;
}

static inline bool incode_star_is_enough(const struct incode_front *front) {
    return front->star.built >= front->built_max;
}

/* Takes one face out of the star, the last one opened; false: there is none. */
static inline bool incode_star_take(struct incode_front *front,
                                    struct incode_star_face *face) {
    struct incode_star *star = &front->star;
    if (star->faces == 0)
        return false;
    uint32_t i = --star->faces;
    *face = (struct incode_star_face){
        star->b[i], star->c[i], {star->ib[i], star->ic[i]}};
    return true;
}

/* Puts a face without an answer back. */
void incode_star_put(struct incode_front *front,
                     const struct incode_star_face *face);

/* Takes (v, b, c) out of the star; false: it has been closed meanwhile. */
bool incode_star_find(struct incode_front *front, uint32_t b, uint32_t c);

/* Builds the tetrahedron v of positive orientation, v[0] the star's vertex,
 * beside the face (v[0], v[1], v[2]) that was taken out: it is emitted if it is
 * the region's own, and its other faces toggle.  v[3] = INCODE_NONE: there is
 * none, the face is of the hull, and p and hint do not count.  p: coordinates;
 * hint: of each vertex. */
void incode_star_build(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4], const uint16_t hint[4]);

/* Puts what is left of the star back and emits what it has kept. */
void incode_star_shut(struct incode_front *front);

/* ---- one face at a time ---- */

/* An open face of a vertex, which stays open; false: there is none. */
bool incode_front_face(struct incode_front *front, uint32_t v,
                       uint32_t face[3]);

/* Builds the tetrahedron v beside the face (v[0], v[1], v[2]), v[3] =
 * INCODE_NONE at the hull, if that is still open.  p: coordinates; only the
 * face rule `paper` and the lexicographic owner look at them.  False: it is
 * not, and nothing was done. */
bool incode_front_use(struct incode_front *front, const uint32_t v[4],
                      const double *const p[4]);

/* Builds a first tetrahedron at v[0]. */
void incode_front_seed(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4]);

#endif
