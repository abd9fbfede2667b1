/* A node's triangulator: closes the star of every vertex of its bricks and
 * emits the tetrahedra that are its own.  Points arrive page by page, and the
 * front may spill.  It joins a maker and a front: the front asks for apexes,
 * and the maker finds them.  Or it inserts its points into a triangulation, if
 * what is not yet final fits the memory.
 *
 * Work: a call of incode_triangulator_step closes at most one star, or takes
 * one search as far as one missing page, or some steps of an insertion
 * (insertion/insertion.h).  With the indexes `naive` and `grid` it builds at
 * most one tetrahedron, and reads at most 256 pages of points or about 4,096
 * rows of cells and points.
 *
 *     t = incode_triangulator_init(arena, bytes, &setup, &outside, &why);
 *     incode_triangulator_start(t, &job);
 *     while (incode_triangulator_step(t) != INCODE_FINISHED)
 *         deliver(t);   // by incode_triangulator_page, what was asked for */
#ifndef INCODE_TRIANGULATOR_H
#define INCODE_TRIANGULATOR_H

#include <stddef.h>
#include <stdint.h>

#include "incode/front/job.h"
#include "incode/pages/pager.h"
#include "incode/pages/pages.h"
#include "incode/predicates/predicates.h"

enum { INCODE_CELLS_MAX = 1 << 30 /* of the grid, along one side */ };

/* How tetrahedra are found: by faces, as InCoDe does, or by points, from a
 * triangulation that grows point by point.  INCODE_BUILD_AUTO takes points for
 * all bricks of a surface; for all bricks of a volume if the cells that are not
 * yet final take at most half of the memory; and for some bricks of a surface
 * if as many points of a volume would fit in the same way.  It takes faces
 * otherwise, and always with the indexes `naive` and `grid` and the face rule
 * `paper`. */
enum incode_build {
    INCODE_BUILD_AUTO,
    INCODE_BUILD_FACES,
    INCODE_BUILD_POINTS
};

/* What every node of a run gets once. incode_setup_fault names a field that is
 * out of its limits. */
struct incode_setup {
    /* Bricks of at most INCODE_BRICK_POINTS points, 1 or more; vertex numbers,
     * brick * INCODE_BRICK_POINTS and up, stay below INCODE_NONE. */
    uint32_t bricks;

    /* How points are searched: enum incode_index. */
    uint8_t index;

    /* Which faces are pursued: enum incode_face_rule. */
    uint8_t face_rule;

    /* How tetrahedra are found: enum incode_build. */
    uint8_t build;

    /* Which brick owns a tetrahedron: enum incode_owner_rule.
     * INCODE_OWNER_LOWEST builds by faces. */
    uint8_t owner_rule;

    /* For tests: seed of the order in which arrived pages are taken; 0: the
     * order of arrival. */
    uint64_t shuffle_seed;

    /* Box of all points, tight and finite, lo <= hi, in the points' unit. */
    double lo[3], hi[3];

    /* Index `grid`: cells in x, y and z, 1 to INCODE_CELLS_MAX, together fewer
     * than INCODE_NONE; else 0. */
    uint32_t cells[3];

    uint32_t reserved2; /* 0 */
};

/* How the triangulator reaches its surroundings.  All calls return at once. */
struct incode_outside {
    struct incode_page_source pages;   /* what its maker asks for */
    struct incode_front_outside front; /* what its front gives and takes back */
    /* Fronts of other nodes that share one active face list with this one
     * (front/exchange.h).  The owner rule is then INCODE_OWNER_LOWEST and the
     * face rule `own`. share = NULL: there are none. */
    struct incode_front_peers peers;
    /* Called during long steps; poll = NULL: nothing is called. */
    struct incode_yield yield;
};

/* The memory map in bytes, except for the three counts. total is the sum of
 * control, frames, afl and bricks, with the alignment of tables, and is at most
 * the arena.  By points, the triangulation takes the memory of the active face
 * list, the bricks and all frames except a few. */
struct incode_map {
    size_t control;               /* the triangulator itself, the horizon too */
    size_t frames, frame_count;   /* of pages */
    size_t afl, afl_faces;        /* of the active face list */
    size_t bricks, brick_entries; /* that the front has touched */
    size_t local_points, tasks;   /* part of control */
    size_t total;
};

struct incode_statistics {
    uint64_t tetrahedra_built, tetrahedra_kept, make_tetra_calls, hull_facets;
    uint64_t tetrahedra_by_points; /* kept, of the triangulation of all points;
                                      built and as many calls, too */
    uint64_t candidates;           /* points whose distance was evaluated */
    uint64_t tree_searches, seeds, vertices, vertices_waited;
    uint64_t stars_lent, stars_borrowed;
    uint64_t tetrahedra_late; /* found on what was lent, and there already */
    uint64_t page_requests, page_faults, page_evictions;
    uint64_t afl_max, afl_spilled;
    uint64_t memory_high_water; /* bytes of the arena ever in use: with faces,
                                   all but frames that never were */
    struct {
        uint64_t exact_orient3d, exact_in_sphere;
    } tally;                           /* as incode_tally counts them */
    uint64_t candidates_histogram[24]; /* calls by log2 of candidates, half
                                          octaves */
};

/* How much of the memory is in use now. */
struct incode_gauge {
    uint32_t pages, held; /* that there is room for, and that are there */
    uint32_t faces, open; /* likewise, of the active face list; point by point
                             it has none */
};

struct incode_triangulator; /* opaque: lives at the start of the arena */

/* Smallest arena that works for this setup, bytes.  It is the same for every
 * index: a face under search needs one page at a time.  `naive` is slow where
 * not all pages of points fit, `grid` where those around the front do not. */
size_t incode_arena_min(const struct incode_setup *setup);

/* NULL, or a static string that says which field is out of its limits. */
const char *incode_setup_fault(const struct incode_setup *setup);

/* Divides the arena (aligned to 64 bytes).  Returns the triangulator inside it,
 * or NULL with *why set to a static string: the arena is too small, or the text
 * of incode_setup_fault. */
struct incode_triangulator *incode_triangulator_init(
    void *arena, size_t bytes, const struct incode_setup *setup,
    const struct incode_outside *outside, const char **why);

/* Begins a job; the one before must be finished or is abandoned.  Resident
 * pages stay. */
void incode_triangulator_start(struct incode_triangulator *t,
                               const struct incode_job *job);

/* Delivers a page of `bytes` bytes: those of its kind (pages/pages.h) or, for a
 * brick, 24 times its number of points: x[count], y[count], z[count]. Returns
 * 0.  Returns INCODE_PAGE_UNASKED (pages/pages.h) for a page that was not
 * requested, and INCODE_PAGE_UNSOUND for one that cannot be the page of that
 * number, and drops the page. */
int incode_triangulator_page(struct incode_triangulator *t, uint32_t page,
                             const void *data, size_t bytes);

/* Delivers a page that was not requested.  It is kept if it is on its way, or
 * if no page has to be evicted for it.  0, or INCODE_PAGE_UNSOUND. */
int incode_triangulator_put(struct incode_triangulator *t, uint32_t page,
                            const void *data, size_t bytes);

/* _has: whether a page is resident. _copy: copies a resident page of points or
 * boxes for another node, and returns its bytes, at most INCODE_PAGE_BYTES; 0:
 * it is not resident, or of another kind. */
bool incode_triangulator_has(const struct incode_triangulator *t,
                             uint32_t page);
size_t incode_triangulator_copy(const struct incode_triangulator *t,
                                uint32_t page, void *data);

/* The caller's label of a page that has a frame or is on its way, 0 at first;
 * NULL: neither. */
uint64_t *incode_triangulator_label(const struct incode_triangulator *t,
                                    uint32_t page);

/* Whether a page is on its way. */
bool incode_triangulator_awaits(const struct incode_triangulator *t,
                                uint32_t page);

/* Requests a page that is not resident, if no page has to be evicted for it.
 * Returns whether the page is on its way. */
bool incode_triangulator_fetch(struct incode_triangulator *t, uint32_t page);

/* A page that was requested and has not arrived; INCODE_NONE: there is none.
 * Work: a pass over the frames. */
uint32_t incode_triangulator_awaited(const struct incode_triangulator *t);

/* Delivers spilled toggles of a brick that was requested, in the order in which
 * they were spilled; `last`: there are no more.  Returns 0, or -1 if the brick
 * was not requested or a face is not of this brick. */
int incode_triangulator_unspill(struct incode_triangulator *t, uint32_t brick,
                                const struct incode_face *faces, size_t count,
                                bool last);

/* With peers: whether `count` calls of incode_triangulator_take are possible
 * now (incode_front_may_take). */
bool incode_triangulator_may_take(struct incode_triangulator *t,
                                  uint32_t count);

/* With peers: a tetrahedron or facet of the hull that another front has built
 * (incode_front_take).  Returns 0, or -1 if it is impossible. */
int incode_triangulator_take(struct incode_triangulator *t,
                             const uint32_t v[4]);

/* With peers, when all are quiet: tries first tetrahedra. */
void incode_triangulator_seed(struct incode_triangulator *t);

/* With peers. _is_quiet: whether there is no work until a tetrahedron arrives.
 * _left: the number of bricks of the job that are not committed. */
bool incode_triangulator_is_quiet(const struct incode_triangulator *t);
uint32_t incode_triangulator_left(const struct incode_triangulator *t);

/* Works on: see enum incode_step.  Bounds are stated at the top. */
enum incode_step incode_triangulator_step(struct incode_triangulator *t);

/* From now on a step ends after about so many units of work; at first there is
 * no limit.  A unit is a step, a face, or the points of one brick: a
 * microsecond or less with doubles in hardware.  The next steps do the rest;
 * the results are the same. */
void incode_triangulator_allow(struct incode_triangulator *t, uint32_t units);

/* Units of work since init. */
uint64_t incode_triangulator_spent(const struct incode_triangulator *t);

/* Counts of all jobs since init. */
void incode_triangulator_gauge(const struct incode_triangulator *t,
                               struct incode_gauge *gauge);
void incode_triangulator_statistics(const struct incode_triangulator *t,
                                    struct incode_statistics *s);

/* How the arena is divided. */
const struct incode_map *
incode_triangulator_map(const struct incode_triangulator *t);

/* NULL, or a static string: why the step is INCODE_BROKEN. */
const char *incode_triangulator_fault(const struct incode_triangulator *t);

#endif
