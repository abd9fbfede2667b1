/* MakeTetra: finds the apexes of faces.  The maker holds the points, in pages
 * that arrive on demand, and data derived from them: the local points of the
 * vertex at work, the horizon of its brick, empty spheres, half-spaces and
 * planes of the hull.  A search that misses a page is suspended, up to
 * INCODE_SEARCHES at a time, and resumed when the page has arrived.  The maker
 * knows no list of faces and no order of work.
 *
 * The same searches have two interfaces.  A tetrahedron builder, which receives
 * faces, calls incode_maker_apexes.  The triangulator, which has all open faces
 * of a star, goes step by step: it calls incode_maker_centre, _apex and _resume
 * with the index `kd`, and incode_maker_face with the other indexes.
 *
 * Memory: struct incode_maker, about 63 KB, and the share of an arena that
 * incode_maker_bytes states: the horizon's boxes and copies, frames of pages.
 * Work: a call takes one search as far as its next missing page; with the
 * indexes `naive` and `grid` it reads at most 256 pages of points or about
 * 4,096 rows of cells and points. */
#ifndef INCODE_MAKER_H
#define INCODE_MAKER_H

#include "query.h"
#include "horizon.h"

enum {
    INCODE_SEARCHES = 17, /* suspended at a time */
    INCODE_HULL_PLANES = 8,
    INCODE_HALF_SPACES = 8,
    INCODE_FRAMES_MIN = 48, /* a search needs no more at once */
    INCODE_FRAMES_MAX = INCODE_NO_FRAME - 1
};

/* The points as a whole. */
struct incode_points {
    uint32_t bricks; /* 1 to INCODE_NONE / INCODE_BRICK_POINTS */
    enum incode_index index;
    double lo[3], hi[3];   /* tight box of all points */
    uint32_t cells[3];     /* index `grid`: cells in x, y, z, 1 to 2^30 each,
                              together fewer than INCODE_NONE; else 0 */
    uint64_t shuffle_seed; /* 0: pages are ready as they arrive */
};

enum incode_search_stage {
    INCODE_SEARCH_NONE,
    INCODE_SEARCH_POINTS, /* beyond the local points */
    INCODE_SEARCH_FOUND,  /* it is over, its answer not yet given */
    INCODE_SEARCH_FIRST   /* of a first tetrahedron */
};

/* The search of a first tetrahedron (apex.c). */
struct incode_first {
    enum incode_first_stage {
        INCODE_FIRST_NEAREST,
        INCODE_FIRST_CIRCLE,
        INCODE_FIRST_APEX,
        INCODE_FIRST_BACK
    } stage;
    uint32_t u, w, a;
    double pu[3], pw[3], pa[3];
};

/* A search that can be suspended: box after box, then the sphere. */
struct incode_search {
    enum incode_search_stage stage;
    uint32_t page; /* that it waits for, or INCODE_NONE */
    struct incode_query query;
    double radius;
    bool final;
    bool advanced;   /* `naive`, `grid`: it got on since it was asked */
    bool degenerate; /* the face is of the hull's side up to rounding */
    uint64_t looked; /* candidates so far */
    union {
        struct incode_first first;
        struct {
            struct incode_cell_search cells; /* index `grid` */
            uint32_t sweep_left; /* index `naive`: bricks still to be seen, */
            uint32_t sweep;      /* from this one on */
        };
    };
};

/* A plane with every point on it or below it, and some location below it. */
struct incode_hull_plane {
    double p[3][3], below[3];
};

struct incode_maker_counts {
    uint64_t calls;         /* of MakeTetra */
    uint64_t candidates;    /* points whose distance was evaluated */
    uint64_t tree_searches; /* beyond the local points and the horizon */
    struct incode_tally tally;
    uint64_t histogram[24]; /* calls by log2 of candidates, half octaves */
};

struct incode_maker {
    enum incode_index index;
    uint32_t sweep;     /* index `naive`: the brick last looked at */
    uint32_t ahead;     /* bricks below have been requested, or so many */
    uint32_t lookahead; /* so many before the one at work, at most */
    bool walks_down;    /* the last walk of a search did */
    double lo[3], hi[3];
    uint32_t cells[3];
    struct incode_tree tree;
    struct incode_pager pager;
    struct incode_walker walker;
    struct incode_maker_counts counts;
    const char *fault; /* NULL, or a static string */
    double spread;     /* radius of the local points, in the leaf's extent */
    double reach;      /* of the horizon, in the brick's extent */
    struct incode_search search[INCODE_SEARCHES];
    struct incode_hull_plane planes[INCODE_HULL_PLANES];
    uint32_t plane_count, plane_next;
    struct incode_half_space half_spaces[INCODE_HALF_SPACES];
    uint32_t half_space_count, half_space_next;
    struct incode_empty_spheres empty;
    struct incode_horizon horizon;
    struct incode_local_points local;
};

/* Called before `units` units of work (incode/predicates/yield.h). */
static inline void incode_maker_yield(struct incode_maker *m, uint32_t units) {
    incode_yield_after(&m->counts.tally.yield, units);
}

/* ---- memory ---- */

/* The memory of a maker beside its struct. */
struct incode_maker_share {
    uint32_t boxes, copies; /* of the horizon: incode_horizon_init */
    uint32_t frames;        /* INCODE_FRAMES_MIN to INCODE_FRAMES_MAX */
};

/* Bytes of such a share. */
size_t incode_maker_bytes(const struct incode_maker_share *share);

/* The most frames that fit in so many bytes beside the rest of a share; 0:
 * none. */
uint32_t incode_maker_frames(const struct incode_maker_share *share,
                             size_t bytes);

/* memory: aligned to 64 bytes, incode_maker_bytes of the share.  yield: called
 * during long work; the maker keeps a copy. */
void incode_maker_init(struct incode_maker *m, void *memory,
                       const struct incode_maker_share *share,
                       const struct incode_points *points,
                       const struct incode_page_source *source,
                       const struct incode_yield *yield);

/* Moves to other memory, of another share.  The content of the old memory is
 * forgotten; counts stay.  No page may be on its way. */
void incode_maker_move(struct incode_maker *m, void *memory,
                       const struct incode_maker_share *share);

/* Begins other work on the same points: clears the fault and the look-ahead.
 * The caller forgets each search that it gives up. */
void incode_maker_start(struct incode_maker *m);

/* ---- faces ---- */

/* A tetrahedron f of positive orientation beside the face (f[0], f[1], f[2]),
 * and the coordinates of its vertices; f[3] = INCODE_NONE: the face is of the
 * hull, and only f counts.  near: where f[1], f[2] and f[3] are among the local
 * points, or INCODE_LOCAL_NONE. */
struct incode_answer {
    uint32_t f[4];
    uint16_t near[4];
    double p[4][3];
};

/* Answers faces[*done] to faces[count - 1] (v[0], v[1], v[2]: the side where
 * orient3d is positive is unknown), one after another, in search `slot`.
 * INCODE_FINISHED: all are answered.  Otherwise call again with the same
 * arguments: after INCODE_WAITING when page search[slot].page has arrived,
 * after INCODE_WORKED at once.  Consecutive faces with the same first vertex
 * share its local points.  Every face must belong to the triangulation;
 * otherwise empty spheres may rule out its apex. */
enum incode_step incode_maker_apexes(struct incode_maker *m, unsigned slot,
                                     const uint32_t (*faces)[3], uint32_t count,
                                     struct incode_answer *answers,
                                     uint32_t *done);

/* Ends the work of search `slot`. */
void incode_maker_forget(struct incode_maker *m, unsigned slot);

/* Whether the search of an apex or a first tetrahedron is under way. */
static inline bool incode_maker_is_searching(const struct incode_maker *m,
                                             unsigned slot) {
    return m->search[slot].stage != INCODE_SEARCH_NONE;
}

/* Indexes `naive` and `grid`: whether the last call advanced the search. */
static inline bool incode_maker_has_advanced(const struct incode_maker *m,
                                             unsigned slot) {
    return m->search[slot].advanced;
}

/* Index `kd`, step by step.  First, gathers the local points of a vertex:
 * INCODE_FINISHED or INCODE_WAITING. */
enum incode_step incode_maker_centre(struct incode_maker *m, unsigned slot,
                                     uint32_t v);

/* Then finds the apex of (v, b, c). near[0] and near[1] are the indices of b
 * and c among the local points, or INCODE_LOCAL_NONE; the call sets them.
 * INCODE_FINISHED: *a is the answer.  INCODE_WORKED: continue with
 * incode_maker_resume.  INCODE_WAITING, INCODE_AGAIN: no search was begun. */
enum incode_step incode_maker_apex(struct incode_maker *m, unsigned slot,
                                   uint32_t b, uint32_t c, uint16_t near[2],
                                   struct incode_answer *a);

/* Continues the search of an apex, after incode_maker_centre at the same
 * vertex.  INCODE_FINISHED: *a is the answer.  INCODE_WORKED: there is no
 * answer yet; call incode_maker_apex for the face again. */
enum incode_step incode_maker_resume(struct incode_maker *m, unsigned slot,
                                     struct incode_answer *a);

/* Indexes `naive` and `grid`: begins the search of the apex of f.  If a search
 * is under way, continues it and ignores f. */
enum incode_step incode_maker_face(struct incode_maker *m, unsigned slot,
                                   const uint32_t f[3],
                                   struct incode_answer *a);

/* A first tetrahedron at v (MakeFirstTetra): INCODE_FINISHED, with m->fault set
 * where there is none, INCODE_WAITING, or INCODE_WORKED: ask again. */
enum incode_step incode_maker_first(struct incode_maker *m, unsigned slot,
                                    uint32_t v, struct incode_answer *a);

/* ---- pages ---- */

/* Which of some searches, one bit each, wait for a page that is on its way. */
uint32_t incode_maker_waiting(const struct incode_maker *m, uint32_t slots);

/* A page has arrived: as incode_triangulator_page of incode/triangulator.h. */
int incode_maker_page(struct incode_maker *m, uint32_t page, const void *data,
                      size_t bytes);

/* A page that was not requested (incode_triangulator_put).  0, or
 * INCODE_PAGE_UNSOUND. */
int incode_maker_put(struct incode_maker *m, uint32_t page, const void *data,
                     size_t bytes);

/* Requests a page that is not resident, if no page has to be evicted for it.
 * Returns whether the page is on its way. */
bool incode_maker_fetch(struct incode_maker *m, uint32_t page);

/* Requests the pages of a brick, of up to `more` bricks after it, and of the
 * bricks around the first.  True: all possible requests have been made. */
bool incode_maker_prefetch(struct incode_maker *m, uint32_t brick,
                           uint32_t more);

/* Bricks [first, last) come next, in this order: requests the pages of some of
 * them, as far ahead as the frames allow, once each. */
void incode_maker_look_ahead(struct incode_maker *m, uint32_t first,
                             uint32_t last);

/* The same for `count` bricks from brick last - 1 down, of which `passed` are
 * done. */
void incode_maker_look_down(struct incode_maker *m, uint32_t last,
                            uint32_t passed, uint32_t count);

/* Number of points of a brick, or 0: its page is missing and has been
 * requested. */
uint32_t incode_maker_count(struct incode_maker *m, uint32_t brick);

#endif
