/* The stages of an insertion, for the files of this room alone: insertion.c
 * takes points in, finality.c says which cells are final, emission.c emits and
 * releases them.
 *
 * Memory: the insertion's.  Work: a bounded part of the stage a call.
 *
 *     if (n->stage == INCODE_INSERTION_JUDGE)
 *         step = incode_insertion_judge(n);
 */
#ifndef INCODE_STAGES_H
#define INCODE_STAGES_H

#include "insertion.h"

enum {
    INCODE_INSERTION_AHEAD = 16, /* bricks asked for together */
    INCODE_INSERTION_STEPS = 64, /* a call, at most */
    INCODE_INSERTION_UNITS = 4,  /* of work, a point */
    INCODE_INSERTION_CELLS = 16  /* looked at as a unit of work */
};

/* Begins to take the bricks [from, to) in. */
void incode_insertion_take_in(struct incode_insertion *n);

enum incode_insertion_step incode_insertion_rest(struct incode_insertion *n);
enum incode_insertion_step incode_insertion_judge(struct incode_insertion *n);
enum incode_insertion_step incode_insertion_look(struct incode_insertion *n);
enum incode_insertion_step incode_insertion_visit(struct incode_insertion *n);
enum incode_insertion_step incode_insertion_settle(struct incode_insertion *n);

/* Begins to emit the cells that are proved. */
void incode_insertion_begin_list(struct incode_insertion *n);

enum incode_insertion_step incode_insertion_list(struct incode_insertion *n);
enum incode_insertion_step incode_insertion_emit(struct incode_insertion *n);
enum incode_insertion_step incode_insertion_release(struct incode_insertion *n);
enum incode_insertion_step incode_insertion_commit(struct incode_insertion *n);

static inline void incode_insertion_set_bit(uint64_t *bits, uint32_t i) {
    bits[i / 64] |= UINT64_C(1) << i % 64;
}

/* A point has become a vertex before its turn, or is another's. */
static inline void incode_insertion_note(const struct incode_insertion *n,
                                         uint32_t id) {
    if (n->inserted != NULL)
        n->inserted[id / INCODE_BRICK_POINTS] |= UINT64_C(1)
                                                 << id % INCODE_BRICK_POINTS;
}

/* Whether it has, as far as that is known. */
static inline bool incode_insertion_has_noted(const struct incode_insertion *n,
                                              uint32_t id) {
    return n->inserted != NULL &&
           (n->inserted[id / INCODE_BRICK_POINTS] >> id % INCODE_BRICK_POINTS &
            1) != 0;
}

/* Whether the own bricks are all there are. */
static inline bool incode_insertion_owns_all(const struct incode_insertion *n) {
    return n->own_last - n->own_first == n->maker->tree.bricks;
}

#endif
