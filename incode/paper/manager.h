/* The face manager: a front without a maker.  It lends its open faces in lists,
 * and takes the answers of any builder in any order.  It has no points.  A lent
 * face stays open.  If another answer closes it first, its own answer does not
 * count (the paper's replication test).  No copy of a list is kept.
 *
 * Memory: struct incode_manager, about 21 KB, and the caller's memory for the
 * active face list.  Faces that do not fit are spilled.  Work: a step uses at
 * most 32 answers, or passes or spills a brick.  To lend a list, the manager
 * reads the bricks of the window or, after the own bricks are passed, all
 * touched bricks. */
#ifndef INCODE_MANAGER_H
#define INCODE_MANAGER_H

#include "incode/front/front.h"
#include "list.h"
#include "incode/triangulator.h"

enum { INCODE_COUNTS = 64 /* bricks whose points are known, at most */ };

struct incode_manager {
    struct incode_yield yield;
    struct incode_front front;
    size_t bytes;                        /* of the active face list */
    struct incode_answers taken;         /* at work, */
    uint32_t used;                       /* as far as this */
    uint32_t lists;                      /* lent and not answered, */
    uint32_t due[INCODE_LIST_COUNT + 1]; /* and what they ask, by kind */
    uint32_t asked; /* bricks below this one have been counted */
    uint32_t brick[INCODE_COUNTS], points[INCODE_COUNTS];
    struct {
        uint32_t task, v;
        bool wanted, asked;
    } seed; /* a first tetrahedron */
    const char *fault;
    uint64_t spent; /* units of work since init */
};

/* The least bytes of memory. */
size_t incode_manager_min(void);

/* memory: aligned to 64 bytes, at least incode_manager_min() of it.  setup:
 * sound, with the face rule `own`, because the other rule needs points. yield:
 * called during long steps. */
void incode_manager_init(struct incode_manager *m, void *memory, size_t bytes,
                         const struct incode_setup *setup,
                         const struct incode_front_outside *outside,
                         const struct incode_yield *yield);

/* Begins a job; no list may be out. */
void incode_manager_start(struct incode_manager *m,
                          const struct incode_job *job);

/* Makes the next list, of at most `most` faces, 1 to INCODE_LIST_MAX.  Returns
 * the number of its entries; 0: there is nothing to ask at present. */
uint32_t incode_manager_lend(struct incode_manager *m, uint32_t most,
                             struct incode_list *list);

/* Whether it takes answers: false until those before are used. */
static inline bool incode_manager_is_free(const struct incode_manager *m) {
    return m->used == m->taken.count;
}

/* Takes answers to a list, of which incode_answers_bytes are read.  The manager
 * must be free.  Answers to something that was not lent are a fault: at once if
 * their kind or number shows it, at the latest when no list is out and a lent
 * face has no answer. */
void incode_manager_take(struct incode_manager *m,
                         const struct incode_answers *answers);

/* Works for about `units` units, at least 1; an answer is a unit.
 * INCODE_WAITING: no work until answers come, something can be lent, a spilled
 * list comes, or there is room outside.  INCODE_FINISHED: the job is done, and
 * no list is out. */
enum incode_step incode_manager_step(struct incode_manager *m, uint32_t units);

/* As incode_triangulator_unspill. */
int incode_manager_unspill(struct incode_manager *m, uint32_t brick,
                           const struct incode_face *faces, size_t count,
                           bool last);

/* NULL, or a static string: why the step is INCODE_BROKEN. */
const char *incode_manager_fault(const struct incode_manager *m);

/* Counts of all jobs since init.  Tetrahedra count as kept here, and as built
 * at the builders. */
void incode_manager_statistics(const struct incode_manager *m,
                               struct incode_statistics *s);

#endif
