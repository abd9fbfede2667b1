/* The triangulator's state, shared by its parts: front.c (whose face is whose,
 * spilling), apex.c (MakeTetra), star.c (closing a vertex), seed.c (a first
 * tetrahedron), facewise.c (the paper's face by face), triangulator.c (memory
 * and order of work).
 *
 * Memory: divided by triangulator.c alone.  Work: stated at each part.
 */
#ifndef INCODE_STATE_H
#define INCODE_STATE_H

#include "incode/front/afl.h"
#include "incode/maker/cells.h"
#include "incode/maker/local_points.h"
#include "incode/maker/query.h"
#include "triangulator.h"

enum {
    INCODE_STAR_FACES = 256, /* open faces at one vertex held at hand */
    INCODE_STAR_BUILT = 256, /* tetrahedra a step, at most */
    INCODE_TASKS = 16,       /* vertices that wait for a page */
    INCODE_SPILL_FACES = 1024,
    INCODE_SPILL_BUILT = 128, /* tetrahedra a step while faces are spilled */
    INCODE_HULL_PLANES = 8,
    INCODE_HALF_SPACES = 8,
    INCODE_HUBS = 32,
    INCODE_PATIENCE = 8 /* retries before a task runs alone */
};

/* A search beyond the local points: box after box, then the sphere. */
struct incode_search {
    struct incode_query query;
    double radius;
    bool final;
    bool degenerate; /* the face is of the hull's side up to rounding */
    uint64_t looked; /* candidates so far */
};

enum incode_task_kind {
    INCODE_TASK_IDLE,
    INCODE_TASK_STAR,   /* waits for the points around its vertex */
    INCODE_TASK_SEARCH, /* waits within the search of an apex */
    INCODE_TASK_FOUND,  /* the search is over, the face not yet built */
    INCODE_TASK_SEED
};

enum incode_seed_stage {
    INCODE_SEED_NEAREST,
    INCODE_SEED_CIRCLE,
    INCODE_SEED_APEX,
    INCODE_SEED_BACK
};

struct incode_seed {
    enum incode_seed_stage stage;
    uint32_t u, w, a;
    double pu[3], pw[3], pa[3];
};

struct incode_task {
    enum incode_task_kind kind;
    uint32_t v, page;
    uint32_t retries;
    uint64_t born;
    struct incode_search search;
    struct incode_seed seed;
    struct incode_cells cells; /* index `grid` */
    uint32_t sweep_left; /* index `naive`: bricks still to be seen, from */
    uint32_t sweep;      /* this one on */
};

struct incode_star_face {
    uint32_t b, c;
    uint16_t ib, ic; /* among the local points, or INCODE_LOCAL_NONE */
};

struct incode_star {
    uint32_t v, faces, built;
    bool more; /* further faces of v are in the active face list */
    alignas(64) uint32_t b[INCODE_STAR_FACES];
    alignas(64) uint32_t c[INCODE_STAR_FACES];
    uint16_t ib[INCODE_STAR_FACES], ic[INCODE_STAR_FACES];
    uint32_t kept;
    uint32_t apexes[INCODE_STAR_BUILT][3];
};

/* A plane with every point on it or below, and a point below. */
struct incode_hull_plane {
    double p[3][3], below[3];
};

struct incode_triangulator {
    struct incode_setup setup;
    struct incode_outside outside;
    struct incode_job job;
    struct incode_tree tree;
    struct incode_pager pager;
    struct incode_afl afl;
    struct incode_walker walker;
    struct incode_statistics stats;
    struct incode_map map;
    const char *fault;

    /* Order of work (positions: bricks counted from the job's first). */
    uint32_t current; /* own bricks before this position are passed */
    uint32_t ahead;   /* positions below have been asked for */
    uint32_t lookahead, window;
    uint32_t spill_from; /* faces of positions from here on are spilled */
    bool foreign;        /* own bricks are passed, others' faces remain */
    bool finished;
    uint64_t clock;

    /* Spilling. */
    struct incode_face spill[INCODE_SPILL_FACES];
    uint32_t spill_count;
    uint32_t spill_cursor; /* hash head under eviction, or INCODE_NONE */
    bool unspill_pending, spilled_any;
    uint32_t unspill_brick;

    uint32_t hubs[INCODE_HUBS], hub_count;
    uint32_t draining; /* a hub whose list is not yet empty, or INCODE_NONE */

    uint32_t room_faces, room_bricks; /* kept free before a star */
    uint32_t built_max;
    double
        spread;   /* radius of the local points in units of the leaf's extent */
    double reach; /* of the neighbours, in units of the brick's extent */
    uint32_t sweep; /* index `naive`: the brick last looked at */
    struct incode_task tasks[INCODE_TASKS];
    struct incode_hull_plane planes[INCODE_HULL_PLANES];
    uint32_t plane_count, plane_next;
    struct incode_half_space half_spaces[INCODE_HALF_SPACES];
    uint32_t half_space_count, half_space_next;
    struct incode_empty_spheres empty;
    struct incode_star star;
    struct incode_neighbours neighbours;
    struct incode_local_points local;
};

enum incode_outcome {
    INCODE_OK,
    INCODE_WAIT,  /* task->page is missing */
    INCODE_AGAIN, /* unfinished, begin anew without waiting */
    INCODE_MORE   /* unfinished, go on with the task without waiting */
};

/* ---- front.c ---- */

static inline bool incode_own_brick(const struct incode_triangulator *t,
                                    uint32_t brick)
{
    return brick - t->job.first < t->job.last - t->job.first;
}

static inline bool incode_own(const struct incode_triangulator *t, uint32_t v)
{
    return incode_own_brick(t, v / INCODE_BRICK_POINTS);
}

/* Bricks counted from the job's first, the others after its last. */
static inline uint32_t incode_position(const struct incode_triangulator *t,
                                       uint32_t brick)
{
    return brick >= t->job.first ? brick - t->job.first
                                 : brick + t->setup.bricks - t->job.first;
}

/* Which of f's vertices has it in its list: *turn is its index; false: the face
 * is not pursued.  p: the coordinates of f's vertices. */
bool incode_front_key_slow(const struct incode_triangulator *t,
                           const uint32_t f[3], const double *const p[3],
                           unsigned *turn);

static inline bool incode_front_key(const struct incode_triangulator *t,
                                    const uint32_t f[3],
                                    const double *const p[3], unsigned *turn)
{
    if (t->hub_count != 0 || !incode_own(t, f[0]) || !incode_own(t, f[1]) ||
        !incode_own(t, f[2]))
        return incode_front_key_slow(t, f, p, turn);
    unsigned least = f[1] < f[0];
    *turn = f[2] < f[least] ? 2 : least;
    return true;
}

/* Toggles a face whose key is not the vertex at work. */
void incode_front_toggle(struct incode_triangulator *t, const uint32_t f[3]);
/* Notes that a tetrahedron has this vertex. */
void incode_front_reached(struct incode_triangulator *t, uint32_t v);
/* Makes room for one star, spilling what comes last; false: the caller waits
 * (INCODE_AGAIN) or, with t->fault set, is broken. */
bool incode_front_room(struct incode_triangulator *t);
/* Sends what waits in the spill buffer; false: it has no room. */
bool incode_front_flush(struct incode_triangulator *t);
/* Where a vertex has too many open faces, makes it a hub and moves some of them
 * to its neighbours' lists, so that the front at it stays as short as the work
 * around it; nothing else may run before all are moved.  False: there is
 * nothing to do.  Needs the room of a star. */
bool incode_front_drain(struct incode_triangulator *t);
/* Whether a vertex of the brick is a hub. */
bool incode_front_has_hub(const struct incode_triangulator *t, uint32_t brick);

/* ---- apex.c ---- */

/* Begins the search of the apex of (v, b, c). */
void incode_search_begin(struct incode_triangulator *t, struct incode_search *s,
                         const uint32_t f[3], const double pv[3],
                         const double pb[3], const double pc[3], double radius);
/* Goes on with it: INCODE_OK with query.best (INCODE_NONE: a hull facet), or
 * INCODE_WAIT for query.missing. */
enum incode_outcome incode_search_run(struct incode_triangulator *t,
                                      struct incode_search *s);
/* Learns from the search of the apex of an open face that is over. */
void incode_search_learn(struct incode_triangulator *t,
                         const struct incode_query *q);
enum incode_near {
    INCODE_NEAR_FOUND, /* *apex is certain */
    INCODE_NEAR_HULL,  /* no point lies beyond the face */
    INCODE_NEAR_SEARCH /* only the whole set can tell: *s is begun */
};
/* MakeTetra among the local points for the face (vertex, b, c); b, c and
 * *apex are indices among them. */
enum incode_near incode_apex_near(struct incode_triangulator *t, uint32_t b,
                                  uint32_t c, uint32_t *apex,
                                  struct incode_search *s);
/* Whether the face lies on a hull plane already certified, facing out. */
bool incode_hull_known(struct incode_triangulator *t, const double pv[3],
                       const double pb[3], const double pc[3]);
/* Remembers a hull facet; below: a point strictly on its known side. */
void incode_hull_remember(struct incode_triangulator *t,
                          const struct incode_query *q, const double below[3]);
/* The coordinates of a vertex; false: *page is missing. */
bool incode_fetch_point(struct incode_triangulator *t, uint32_t v, double p[3],
                        uint32_t *page);

/* Notes a MakeTetra that is over: how many candidates it looked at. */
void incode_count_candidates(struct incode_triangulator *t, uint64_t looked);

/* ---- star.c, seed.c ---- */

/* Closes the star of task->v as far as it goes. */
enum incode_outcome incode_star_close(struct incode_triangulator *t,
                                      struct incode_task *task);
/* Takes in one tetrahedron f of positive orientation, by itself; `through`: the
 * face (f[0], f[1], f[2]) was open and is taken out of the list. */
void incode_star_take(struct incode_triangulator *t, const uint32_t f[4],
                      const double *const p[4], bool through);
/* Builds a first tetrahedron at task->v, which none has reached. */
enum incode_outcome incode_seed_run(struct incode_triangulator *t,
                                    struct incode_task *task);

/* ---- facewise.c ---- */

/* Builds the tetrahedron beside one open face of task->v. */
enum incode_outcome incode_face_pursue(struct incode_triangulator *t,
                                       struct incode_task *task);

#endif
