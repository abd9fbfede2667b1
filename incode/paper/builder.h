/* The tetrahedron builder: a maker without a front.  It takes lists of faces,
 * finds the apex of each, and keeps the answers until they are fetched.  It has
 * no list of open faces.  While a list waits for a page, the builder works on
 * the next one.
 *
 * Memory: struct incode_builder, about 63 KB, and the caller's memory for
 * lists, their answers and page frames. */
#ifndef INCODE_BUILDER_H
#define INCODE_BUILDER_H

#include "incode/apex/maker.h"
#include "list.h"
#include "incode/triangulator.h"

enum {
    INCODE_LISTS_MAX = 16,   /* a search each */
    INCODE_LIST_PATIENCE = 8 /* retries before a list goes on alone */
};

/* A list at work. */
struct incode_lent {
    struct incode_list list;
    struct incode_answers answers;
    uint64_t known[(INCODE_LIST_MAX + 63) / 64]; /* found on others' behalf */
    uint64_t born;                               /* 0: the slot is empty */
    uint32_t done;                               /* faces answered */
    uint32_t retries;                            /* since it got on last */
};

struct incode_builder {
    struct incode_maker maker;
    struct incode_lent *lent;
    uint32_t lists;         /* places for them */
    uint16_t number;        /* of the builder, in its answers; 0 at first */
    uint64_t clock;         /* lists taken */
    uint64_t built, faults; /* tetrahedra found, searches that had to wait */
    size_t bytes;           /* of memory */
    const char *fault;
    uint64_t spent; /* units of work since init */
};

/* The least bytes of memory for so many lists. */
size_t incode_builder_min(uint32_t lists);

/* memory: aligned to 64 bytes, at least incode_builder_min(lists) of it; lists:
 * at a time, 1 to INCODE_LISTS_MAX.  setup: sound. yield: called during long
 * steps. */
void incode_builder_init(struct incode_builder *b, void *memory, size_t bytes,
                         const struct incode_setup *setup, uint32_t lists,
                         const struct incode_page_source *source,
                         const struct incode_yield *yield);

/* Takes a list, of which incode_list_bytes are read; false: there is no slot
 * for it.  An unsound list is a fault. */
bool incode_builder_take(struct incode_builder *b,
                         const struct incode_list *list);

/* Works for about `units` units, at least 1.  INCODE_WORKED; INCODE_WAITING for
 * a list, for a page, or until answers are fetched; INCODE_BROKEN. */
enum incode_step incode_builder_step(struct incode_builder *b, uint32_t units);

/* Complete answers, those of the oldest list first, or NULL.  The same answers
 * are returned until they are dropped. */
const struct incode_answers *
incode_builder_answers(const struct incode_builder *b);
void incode_builder_drop(struct incode_builder *b);

/* Lists that it has, answered or not. */
uint32_t incode_builder_held(const struct incode_builder *b);

/* NULL, or a static string: why the step is INCODE_BROKEN. */
const char *incode_builder_fault(const struct incode_builder *b);

/* Counts since init.  Tetrahedra count as built here, once for each face that
 * found them, and as kept at the manager that lent the faces. */
void incode_builder_statistics(const struct incode_builder *b,
                               struct incode_statistics *s);

#endif
