/* The active face list: faces with one of their two tetrahedra built, each in
 * the list of its key vertex (its first), found by a hash of that key; and the
 * table of bricks that the front has touched.
 *
 * Memory: incode_afl_bytes(faces, bricks), fixed.  If a list grows although its
 * vertex cannot become a hub, because all hubs are in use, the list is spread
 * over neighbouring heads by its faces' other vertices, and a toggle searches
 * one part of it.  At most INCODE_AFL_WIDE lists are spread at a time.  A list
 * that is short again is joined to make room for another.
 *
 * A face may be held, because its apex is being searched elsewhere.  A held
 * face stays open, and its twin closes it like any other, but it is not taken
 * until it is released.  A face may be foreign: the tetrahedron beyond it is
 * another front's to build.  A foreign face is not released either. */
#ifndef INCODE_AFL_H
#define INCODE_AFL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "incode/predicates/yield.h"

enum incode_face_state {
    INCODE_FACE_OPEN,
    INCODE_FACE_HELD,
    INCODE_FACE_FOREIGN
};

/* The state of a brick from its first touch until it is finished. */
struct incode_touched {
    uint64_t reached; /* a tetrahedron has this vertex */
    uint64_t pending; /* its list may have faces that can be taken or held */
    uint64_t waiting; /* a task waits for a page on its behalf */
    uint32_t brick;
    uint32_t faces; /* in the lists of its vertices */
    uint32_t next;
    uint32_t mark; /* the last sweep that met an open face of it: exchange.h */
};

struct incode_afl_node {
    uint32_t key, b, c, next;
};

enum {
    INCODE_AFL_CROWD = 224, /* faces: a long list */
    INCODE_AFL_WIDE = 32,   /* lists that are spread, at a time */
    INCODE_AFL_BREATH = 16  /* faces or bricks read in a unit of work */
};

struct incode_afl {
    struct incode_yield *yield; /* or NULL */
    struct incode_afl_node *nodes;
    uint32_t *heads;
    uint64_t *held, *foreign; /* a bit a node; what is foreign is held, too */
    struct incode_touched *touched;
    uint32_t *touched_heads;
    uint32_t capacity, mask, count, count_max; /* of faces */
    uint32_t held_count;                       /* of them are held */
    uint32_t free, unused; /* nodes: a list, and all from this one on */
    uint32_t touched_capacity, touched_mask, touched_free, touched_count;
    uint32_t touched_max; /* at a time; entries from here on were never used */
    uint32_t crowded;     /* a vertex with a long list, or INCODE_NONE */
    uint32_t wide[INCODE_AFL_WIDE]; /* vertices whose lists are spread */
    uint32_t wide_count, wide_next; /* the next list to be joined again */
    bool still; /* set while heads are walked: no list is spread */
    uint64_t searches, looks; /* for twins; faces looked at, then or to hold */
    const char *fault; /* NULL, or a static string: what the faces that it
                          was given cannot be */
    struct incode_touched spare; /* the entry of a brick too many */
};

#define INCODE_AFL_NIL UINT32_MAX

static inline bool incode_touched_used(const struct incode_touched *entry) {
    return entry->brick != UINT32_MAX;
}

static inline void incode_afl_yield(const struct incode_afl *afl,
                                    uint32_t units) {
    if (afl->yield != NULL)
        incode_yield_after(afl->yield, units);
}

/* Yields in a loop over many, at index i, every INCODE_AFL_BREATH rounds. */
static inline void incode_afl_yield_at(const struct incode_afl *afl,
                                       uint32_t i) {
    if (i % INCODE_AFL_BREATH == 0)
        incode_afl_yield(afl, 1);
}

/* Prefetches the next node of each of some lists, and advances each link to it;
 * best called when the nodes prefetched before have arrived.  Returns the
 * number of lists that have not ended, which are now the first.  If faces were
 * removed meanwhile, a prefetch may be useless. */
static inline uint32_t incode_afl_fetch(const struct incode_afl *afl,
                                        const uint32_t **link, uint32_t count) {
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t next = *link[i];
        if (next == INCODE_AFL_NIL)
            continue;
        link[left] = &afl->nodes[next].next;
        __builtin_prefetch(link[left++], 1);
    }
    return left;
}

/* Bytes for so many faces and touched bricks. */
size_t incode_afl_bytes(uint32_t capacity, uint32_t bricks);
void incode_afl_init(struct incode_afl *afl, void *memory, uint32_t capacity,
                     uint32_t bricks, struct incode_yield *yield);
void incode_afl_clear(struct incode_afl *afl);

/* The entry of a brick, made if there is none.  The caller keeps enough entries
 * free for faces of one triangulation.  With other faces there may be none
 * left: then afl->fault is set, and the entry is useless. */
struct incode_touched *incode_afl_touch(struct incode_afl *afl, uint32_t brick);
/* The entry of a brick, or NULL. */
struct incode_touched *incode_afl_find(const struct incode_afl *afl,
                                       uint32_t brick);
/* Forgets a brick, which must have no face left. */
void incode_afl_drop(struct incode_afl *afl, uint32_t brick);

/* The head of the list for a face and its twin. */
uint32_t *incode_afl_list(const struct incode_afl *afl, uint32_t key,
                          uint32_t b, uint32_t c);

/* Closes the twin (key, c, b) if it is open.  Otherwise opens the face (key, b,
 * c), whose unknown side is where orient3d(key, b, c, p) > 0.  A face that is
 * open already is afl->fault. */
void incode_afl_toggle(struct incode_afl *afl, uint32_t key, uint32_t b,
                       uint32_t c);

/* Opens the face, whose twin is not open, in that state. */
void incode_afl_open(struct incode_afl *afl, uint32_t key, uint32_t b,
                     uint32_t c, enum incode_face_state state);

/* Closes the twin (key, c, b) if it is open; false: it is not. */
bool incode_afl_close_twin(struct incode_afl *afl, uint32_t key, uint32_t b,
                           uint32_t c);

/* Takes up to `limit` faces that are not held out of the list of v; *more: some
 * remain, held or not. */
uint32_t incode_afl_take(struct incode_afl *afl, uint32_t v,
                         uint32_t (*pairs)[2], uint32_t limit, bool *more);

/* Copies up to `limit` faces of v that are not held; the list does not change.
 */
uint32_t incode_afl_tell(const struct incode_afl *afl, uint32_t v,
                         uint32_t (*pairs)[2], uint32_t limit);

/* Copies up to `limit` faces of v that are not held, and holds them.  Of faces
 * that share an edge at v only one is held at a time, because they may have the
 * same tetrahedron.  Work: each face of the list is read twice, and up to
 * INCODE_AFL_CROWD times more if v has at most that many faces.  In a longer
 * list, some faces that share no edge are passed over, and offered again when a
 * held one closes. */
uint32_t incode_afl_hold(struct incode_afl *afl, uint32_t v,
                         uint32_t (*pairs)[2], uint32_t limit);

/* Holds the open face (key, b, c); false: it is not open. */
bool incode_afl_hold_face(struct incode_afl *afl, uint32_t key, uint32_t b,
                          uint32_t c);

/* Whether the face (key, b, c) is open, held or not. */
bool incode_afl_is_open(const struct incode_afl *afl, uint32_t key, uint32_t b,
                        uint32_t c);

/* Releases all held faces of v that are not foreign; returns how many were
 * held. */
uint32_t incode_afl_let_go(struct incode_afl *afl, uint32_t v);

/* Releases all faces of v, foreign ones too, before they move. */
void incode_afl_free(struct incode_afl *afl, uint32_t v);

#endif
