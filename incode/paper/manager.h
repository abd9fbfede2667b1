/* The face manager: a front alone.  It lends its open faces in lists, takes the
 * answers, of whichever builder and in whatever order, and knows no point.  A
 * face that is lent stays open: if another answer closes it first, its own does
 * not count any more (the paper's replication test).  No copy of a list is
 * kept.
 *
 * Memory: struct incode_manager, about 21 KB, and what it is given, which is
 * the active face list's: as many faces as fit, and what does not is spilled.
 * Work: a step uses 32 answers at most, or passes or spills a brick; lending a
 * list looks at the bricks of the window, or at all that are touched when the
 * own ones are passed. */
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

/* Bytes of memory that it does with. */
size_t incode_manager_min(void);

/* memory: aligned to 64 bytes, at least incode_manager_min() of it.  setup:
 * sound, and of the face rule `own`, as the other one asks for points.  yield:
 * who is called while a step is long. */
void incode_manager_init(struct incode_manager *m, void *memory, size_t bytes,
                         const struct incode_setup *setup,
                         const struct incode_front_outside *outside,
                         const struct incode_yield *yield);

/* Begins a job; no list may be out. */
void incode_manager_start(struct incode_manager *m,
                          const struct incode_job *job);

/* What is to be asked next, `most` faces at most, 1 to INCODE_LIST_MAX: how
 * much is in the list; 0: nothing at present. */
uint32_t incode_manager_lend(struct incode_manager *m, uint32_t most,
                             struct incode_list *list);

/* Whether it takes answers: false until those before are used. */
static inline bool incode_manager_is_free(const struct incode_manager *m) {
    return m->used == m->taken.count;
}

/* Answers to a list, if it is free; incode_answers_bytes of them are read. What
 * cannot answer what is lent is a fault, at once where the kind or the number
 * tells, at the latest when no list is out and something lent has no answer. */
void incode_manager_take(struct incode_manager *m,
                         const struct incode_answers *answers);

/* Works on, about so many units, an answer each, 1 at least.
 * INCODE_WAITING: nothing to do until answers come, something can be lent, a
 * spilled list comes or there is room outside; INCODE_FINISHED: no list is out
 * either. */
enum incode_step incode_manager_step(struct incode_manager *m, uint32_t units);

/* As incode_triangulator_unspill. */
int incode_manager_unspill(struct incode_manager *m, uint32_t brick,
                           const struct incode_face *faces, size_t count,
                           bool last);

/* NULL, or a static string: why the step is INCODE_BROKEN. */
const char *incode_manager_fault(const struct incode_manager *m);

/* Counts of all jobs since init.  Tetrahedra are kept here, and built where
 * they are found. */
void incode_manager_statistics(const struct incode_manager *m,
                               struct incode_statistics *s);

#endif
