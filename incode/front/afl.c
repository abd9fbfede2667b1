#include "afl.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "incode/pages/bricks.h"

/* Points that are not the same in every page, or false boxes. */
static const char *const INCONSISTENT =
    "a face is open twice: pages contradict each other, or spilled faces";

static uint32_t power_below(uint32_t n) {
    uint32_t power = 1;
    while (power <= n / 2)
        power *= 2;
    return power;
}

static size_t held_words(uint32_t capacity) {
    return ((size_t)capacity + 63) / 64;
}

size_t incode_afl_bytes(uint32_t capacity, uint32_t bricks) {
    size_t heads = (size_t)power_below(capacity) + power_below(bricks);
    return capacity * sizeof(struct incode_afl_node) +
           bricks * sizeof(struct incode_touched) +
           2 * held_words(capacity) * sizeof(uint64_t) +
           heads * sizeof(uint32_t);
}

void incode_afl_init(struct incode_afl *afl, void *memory, uint32_t capacity,
                     uint32_t bricks, struct incode_yield *yield) {
    INCODE_ASSERT(capacity > 0 && bricks > 0);
    memset(afl, 0, sizeof *afl);
    afl->yield = yield;
    afl->touched = memory;
    afl->held = (uint64_t *)(void *)(afl->touched + bricks);
    afl->foreign = afl->held + held_words(capacity);
    afl->nodes =
        (struct incode_afl_node *)(void *)(afl->foreign + held_words(capacity));
    afl->heads = (uint32_t *)(void *)(afl->nodes + capacity);
    afl->capacity = capacity;
    afl->mask = power_below(capacity) - 1;
    afl->touched_heads = afl->heads + afl->mask + 1;
    afl->touched_capacity = bricks;
    afl->touched_mask = power_below(bricks) - 1;
    incode_afl_clear(afl);
}

enum { AT_ONCE = 512 /* entries emptied between two yields */ };

static void empty_heads(const struct incode_afl *afl, uint32_t *heads,
                        uint32_t mask) {
    for (uint32_t from = 0; from <= mask; from += AT_ONCE) {
        uint32_t left = mask + 1 - from;
        uint32_t end = from + (left < AT_ONCE ? left : AT_ONCE);
        incode_afl_yield(afl, AT_ONCE / INCODE_AFL_BREATH);
        for (uint32_t i = from; i < end; i++)
            heads[i] = INCODE_AFL_NIL;
    }
}

static void empty_entries(struct incode_afl *afl) {
    uint32_t all = afl->touched_capacity;
    for (uint32_t from = 0; from < all; from += AT_ONCE) {
        uint32_t end = from + (all - from < AT_ONCE ? all - from : AT_ONCE);
        incode_afl_yield(afl, AT_ONCE / INCODE_AFL_BREATH);
        for (uint32_t i = from; i < end; i++) {
            afl->touched[i].brick = INCODE_NONE;
            afl->touched[i].next = i + 1 < all ? i + 1 : INCODE_AFL_NIL;
        }
    }
}

void incode_afl_clear(struct incode_afl *afl) {
    empty_heads(afl, afl->heads, afl->mask);
    empty_heads(afl, afl->touched_heads, afl->touched_mask);
    empty_entries(afl);
    afl->free = INCODE_AFL_NIL;
    afl->unused = afl->touched_free = 0;
    afl->count = afl->held_count = afl->touched_count = 0;
    afl->crowded = INCODE_NONE;
    afl->wide_count = afl->wide_next = 0;
    afl->still = false;
    afl->fault = NULL;
}

static uint32_t *touched_head(const struct incode_afl *afl, uint32_t brick) {
    return &afl->touched_heads[(brick * UINT32_C(2654435761) >> 8) &
                               afl->touched_mask];
}

struct incode_touched *incode_afl_find(const struct incode_afl *afl,
                                       uint32_t brick) {
    uint32_t i = *touched_head(afl, brick);
    while (i != INCODE_AFL_NIL && afl->touched[i].brick != brick)
        i = afl->touched[i].next;
    return i == INCODE_AFL_NIL ? NULL : &afl->touched[i];
}

struct incode_touched *incode_afl_touch(struct incode_afl *afl,
                                        uint32_t brick) {
    struct incode_touched *entry = incode_afl_find(afl, brick);
    if (entry != NULL)
        return entry;
    uint32_t i = afl->touched_free;
    if (i == INCODE_AFL_NIL) {
        afl->fault = INCONSISTENT;
        memset(&afl->spare, 0, sizeof afl->spare);
        return &afl->spare;
    }
    entry = &afl->touched[i];
    afl->touched_free = entry->next;
    memset(entry, 0, sizeof *entry);
    entry->brick = brick;
    uint32_t *head = touched_head(afl, brick);
    entry->next = *head;
    *head = i;
    afl->touched_count++;
    if (afl->touched_count > afl->touched_max)
        afl->touched_max = afl->touched_count;
    return entry;
}

void incode_afl_drop(struct incode_afl *afl, uint32_t brick) {
    uint32_t *link = touched_head(afl, brick);
    while (*link != INCODE_AFL_NIL && afl->touched[*link].brick != brick)
        link = &afl->touched[*link].next;
    if (*link == INCODE_AFL_NIL)
        return;
    uint32_t i = *link;
    if (afl->touched[i].faces > 0) {
        afl->fault = INCONSISTENT;
        return;
    }
    *link = afl->touched[i].next;
    afl->touched[i].brick = INCODE_NONE;
    afl->touched[i].next = afl->touched_free;
    afl->touched_free = i;
    afl->touched_count--;
}

/* ---- lists ---- */

enum { PARTS = 64 /* of a list that is spread */ };

static bool is_wide(const struct incode_afl *afl, uint32_t key) {
    for (uint32_t i = 0; i < afl->wide_count; i++)
        if (afl->wide[i] == key)
            return true;
    return false;
}

/* Parts of a vertex's list: distinct heads. */
static uint32_t parts_of(const struct incode_afl *afl, uint32_t key) {
    if (afl->wide_count == 0 || !is_wide(afl, key))
        return 1;
    return afl->mask < PARTS ? afl->mask + 1 : (uint32_t)PARTS;
}

static uint32_t *head_of(const struct incode_afl *afl, uint32_t key,
                         uint32_t part) {
    return &afl->heads[((key * UINT32_C(2654435761) >> 7) + part) & afl->mask];
}

uint32_t *incode_afl_list(const struct incode_afl *afl, uint32_t key,
                          uint32_t b, uint32_t c) {
    uint32_t part = 0;
    if (afl->wide_count > 0)
        part = ((b + c) * UINT32_C(2654435761) >> 16) % parts_of(afl, key);
    return head_of(afl, key, part);
}

/* A walk through the faces of one vertex and those that share their heads. */
struct walk {
    uint32_t key, part, parts, looks;
};

static uint32_t walk_from(const struct incode_afl *afl, struct walk *walk) {
    uint32_t i = INCODE_AFL_NIL;
    while (i == INCODE_AFL_NIL && walk->part < walk->parts)
        i = *head_of(afl, walk->key, walk->part++);
    return i;
}

static uint32_t walk_begin(const struct incode_afl *afl, uint32_t key,
                           struct walk *walk) {
    *walk = (struct walk){key, 0, parts_of(afl, key), 0};
    return walk_from(afl, walk);
}

static uint32_t walk_on(const struct incode_afl *afl, struct walk *walk,
                        uint32_t i) {
    incode_afl_yield_at(afl, ++walk->looks);
    i = afl->nodes[i].next;
    return i != INCODE_AFL_NIL ? i : walk_from(afl, walk);
}

/* Puts the faces of a vertex that are in `parts` heads where they belong now.
 */
static void list_anew(struct incode_afl *afl, uint32_t key, uint32_t parts) {
    uint32_t all = INCODE_AFL_NIL;
    for (uint32_t part = 0; part < parts; part++) {
        uint32_t *link = head_of(afl, key, part);
        while (*link != INCODE_AFL_NIL) {
            uint32_t i = *link;
            struct incode_afl_node *node = &afl->nodes[i];
            incode_afl_yield_at(afl, (uint32_t)afl->looks++);
            if (node->key != key) {
                link = &node->next;
                continue;
            }
            *link = node->next;
            node->next = all;
            all = i;
        }
    }
    while (all != INCODE_AFL_NIL) {
        struct incode_afl_node *node = &afl->nodes[all];
        incode_afl_yield_at(afl, all);
        uint32_t *head = incode_afl_list(afl, key, node->b, node->c);
        uint32_t next = node->next;
        node->next = *head;
        *head = all;
        all = next;
    }
}

/* Makes room for one more list to be spread, if the next one in turn is short;
 * false: there is none. */
static bool narrow_one(struct incode_afl *afl) {
    if (afl->wide_count < INCODE_AFL_WIDE)
        return true;
    struct walk walk;
    uint32_t at = afl->wide_next++ % INCODE_AFL_WIDE, v = afl->wide[at];
    uint32_t i = walk_begin(afl, v, &walk), faces = 0;
    for (; i != INCODE_AFL_NIL && faces < INCODE_AFL_CROWD / 2;
         i = walk_on(afl, &walk, i)) {
        afl->looks++;
        faces += afl->nodes[i].key == v;
    }
    if (faces == INCODE_AFL_CROWD / 2)
        return false;
    afl->wide[at] = afl->wide[--afl->wide_count];
    list_anew(afl, v, walk.parts);
    return true;
}

/* Spreads a list that no hub has kept short. */
static void widen(struct incode_afl *afl, uint32_t key) {
    if (afl->still || is_wide(afl, key) || !narrow_one(afl))
        return;
    afl->wide[afl->wide_count++] = key;
    list_anew(afl, key, 1);
}

static uint64_t bit_of(uint32_t v) {
    return UINT64_C(1) << v % INCODE_BRICK_POINTS;
}

static bool is_held(const struct incode_afl *afl, uint32_t i) {
    return (afl->held[i / 64] >> i % 64 & 1) != 0;
}

static bool is_foreign(const struct incode_afl *afl, uint32_t i) {
    return (afl->foreign[i / 64] >> i % 64 & 1) != 0;
}

static void hold(struct incode_afl *afl, uint32_t i) {
    afl->held_count += !is_held(afl, i);
    afl->held[i / 64] |= UINT64_C(1) << i % 64;
}

static void let_go(struct incode_afl *afl, uint32_t i) {
    afl->held_count -= is_held(afl, i);
    afl->held[i / 64] &= ~(UINT64_C(1) << i % 64);
}

static uint32_t take_node(struct incode_afl *afl) {
    uint32_t i = afl->free;
    if (i == INCODE_AFL_NIL) {
        INCODE_ASSERT(afl->unused < afl->capacity);
        i = afl->unused++;
        afl->held[i / 64] &= ~(UINT64_C(1) << i % 64);
    } else {
        afl->free = afl->nodes[i].next;
    }
    afl->foreign[i / 64] &= ~(UINT64_C(1) << i % 64);
    return i;
}

static void unlink_node(struct incode_afl *afl, uint32_t *link) {
    uint32_t i = *link;
    let_go(afl, i);
    *link = afl->nodes[i].next;
    afl->nodes[i].next = afl->free;
    afl->free = i;
    afl->count--;
}

/* So many faces of a list have been passed. */
static __attribute__((noinline)) void yield_over(const struct incode_afl *afl,
                                                 uint32_t passed) {
    for (; passed > INCODE_AFL_BREATH; passed -= INCODE_AFL_BREATH)
        incode_afl_yield(afl, 1);
}

bool incode_afl_close_twin(struct incode_afl *afl, uint32_t key, uint32_t b,
                           uint32_t c) {
    uint32_t *link = incode_afl_list(afl, key, b, c), passed = 0;
    afl->searches++;
    while (*link != INCODE_AFL_NIL) {
        struct incode_afl_node *node = &afl->nodes[*link];
        afl->looks++;
        if (node->key == key && node->b == c && node->c == b) {
            struct incode_touched *entry =
                incode_afl_find(afl, key / INCODE_BRICK_POINTS);
            if (entry != NULL) {
                entry->faces--;
                entry->pending |= is_held(afl, *link) ? bit_of(key) : 0;
            }
            unlink_node(afl, link);
            if (passed > INCODE_AFL_BREATH)
                yield_over(afl, passed);
            return true;
        }
        if (node->key == key && node->b == b && node->c == c) {
            afl->fault = INCONSISTENT;
            return true;
        }
        passed += node->key == key;
        link = &node->next;
    }
    if (passed >= INCODE_AFL_CROWD && afl->crowded == INCODE_NONE)
        afl->crowded = key;
    if (passed > INCODE_AFL_BREATH)
        yield_over(afl, passed);
    if (passed >= 2 * INCODE_AFL_CROWD)
        widen(afl, key);
    return false;
}

void incode_afl_open(struct incode_afl *afl, uint32_t key, uint32_t b,
                     uint32_t c, enum incode_face_state state) {
    uint32_t i = take_node(afl);
    struct incode_afl_node *node = &afl->nodes[i];
    uint32_t *head = incode_afl_list(afl, key, b, c);
    *node = (struct incode_afl_node){key, b, c, *head};
    *head = i;
    struct incode_touched *entry =
        incode_afl_touch(afl, key / INCODE_BRICK_POINTS);
    entry->faces++;
    if (state == INCODE_FACE_OPEN)
        entry->pending |= bit_of(key);
    else
        hold(afl, i);
    if (state == INCODE_FACE_FOREIGN)
        afl->foreign[i / 64] |= UINT64_C(1) << i % 64;
    afl->count++;
    if (afl->count > afl->count_max)
        afl->count_max = afl->count;
}

void incode_afl_toggle(struct incode_afl *afl, uint32_t key, uint32_t b,
                       uint32_t c) {
    if (!incode_afl_close_twin(afl, key, b, c))
        incode_afl_open(afl, key, b, c, INCODE_FACE_OPEN);
}

uint32_t incode_afl_take(struct incode_afl *afl, uint32_t v,
                         uint32_t (*pairs)[2], uint32_t limit, bool *more) {
    uint32_t taken = 0, looks = 0, parts = parts_of(afl, v);
    bool pending = false;
    *more = false;
    for (uint32_t part = 0; part < parts && !pending; part++) {
        uint32_t *link = head_of(afl, v, part);
        while (*link != INCODE_AFL_NIL && !pending) {
            struct incode_afl_node *node = &afl->nodes[*link];
            bool held = is_held(afl, *link);
            incode_afl_yield_at(afl, ++looks);
            if (node->key != v || held || taken == limit) {
                *more = *more || node->key == v;
                pending = node->key == v && !held;
                link = &node->next;
                continue;
            }
            pairs[taken][0] = node->b;
            pairs[taken][1] = node->c;
            taken++;
            unlink_node(afl, link);
        }
    }
    struct incode_touched *entry =
        incode_afl_find(afl, v / INCODE_BRICK_POINTS);
    if (entry != NULL) {
        entry->faces -= taken;
        if (!pending)
            entry->pending &= ~bit_of(v);
    }
    return taken;
}

uint32_t incode_afl_tell(const struct incode_afl *afl, uint32_t v,
                         uint32_t (*pairs)[2], uint32_t limit) {
    struct walk walk;
    uint32_t count = 0, i = walk_begin(afl, v, &walk);
    for (; i != INCODE_AFL_NIL && count < limit; i = walk_on(afl, &walk, i)) {
        const struct incode_afl_node *node = &afl->nodes[i];
        if (node->key != v || is_held(afl, i))
            continue;
        pairs[count][0] = node->b;
        pairs[count][1] = node->c;
        count++;
    }
    return count;
}

/* Whether a held face of v has b or c too. */
static bool meets_held(struct incode_afl *afl, uint32_t v, uint32_t b,
                       uint32_t c) {
    struct walk walk;
    uint32_t i = walk_begin(afl, v, &walk);
    for (; i != INCODE_AFL_NIL; i = walk_on(afl, &walk, i)) {
        const struct incode_afl_node *node = &afl->nodes[i];
        afl->looks++;
        if (node->key == v && is_held(afl, i) &&
            (node->b == b || node->b == c || node->c == b || node->c == c))
            return true;
    }
    return false;
}

/* The vertices of a list's held faces.  Of a long list they are told apart by a
 * bit alone: what looks held then and is not waits until one of them closes. */
enum { HELD_BITS = 1024 };

struct held_vertices {
    uint64_t word[HELD_BITS / 64];
    uint32_t faces; /* of the list, held or not */
};

static uint32_t held_bit(uint32_t v) {
    return v * UINT32_C(2654435761) >> 22;
}

static void add_vertex(struct held_vertices *held, uint32_t v) {
    held->word[held_bit(v) / 64] |= UINT64_C(1) << held_bit(v) % 64;
}

static bool has_vertex(const struct held_vertices *held, uint32_t v) {
    return (held->word[held_bit(v) / 64] >> held_bit(v) % 64 & 1) != 0;
}

static void find_held(struct incode_afl *afl, uint32_t v,
                      struct held_vertices *held) {
    struct walk walk;
    uint32_t i = walk_begin(afl, v, &walk);
    memset(held, 0, sizeof *held);
    for (; i != INCODE_AFL_NIL; i = walk_on(afl, &walk, i)) {
        const struct incode_afl_node *node = &afl->nodes[i];
        afl->looks++;
        held->faces += node->key == v;
        if (node->key == v && is_held(afl, i)) {
            add_vertex(held, node->b);
            add_vertex(held, node->c);
        }
    }
}

/* Whether the face shares an edge at v with a held one, as far as is known. */
static bool may_meet(struct incode_afl *afl, const struct held_vertices *held,
                     const struct incode_afl_node *node) {
    return (has_vertex(held, node->b) || has_vertex(held, node->c)) &&
           (held->faces > INCODE_AFL_CROWD ||
            meets_held(afl, node->key, node->b, node->c));
}

uint32_t incode_afl_hold(struct incode_afl *afl, uint32_t v,
                         uint32_t (*pairs)[2], uint32_t limit) {
    struct held_vertices held;
    find_held(afl, v, &held);
    struct walk walk;
    uint32_t count = 0, i = walk_begin(afl, v, &walk);
    for (; i != INCODE_AFL_NIL; i = walk_on(afl, &walk, i)) {
        const struct incode_afl_node *node = &afl->nodes[i];
        afl->looks++;
        if (node->key != v || is_held(afl, i) || may_meet(afl, &held, node))
            continue;
        if (count == limit)
            return count;
        pairs[count][0] = node->b;
        pairs[count][1] = node->c;
        hold(afl, i);
        add_vertex(&held, node->b);
        add_vertex(&held, node->c);
        count++;
    }
    struct incode_touched *entry =
        incode_afl_find(afl, v / INCODE_BRICK_POINTS);
    if (entry != NULL)
        entry->pending &= ~bit_of(v);
    return count;
}

/* The node of an open face, or INCODE_AFL_NIL. */
static uint32_t find_face(const struct incode_afl *afl, uint32_t key,
                          uint32_t b, uint32_t c) {
    uint32_t i = *incode_afl_list(afl, key, b, c);
    while (i != INCODE_AFL_NIL &&
           (afl->nodes[i].key != key || afl->nodes[i].b != b ||
            afl->nodes[i].c != c))
        i = afl->nodes[i].next;
    return i;
}

bool incode_afl_hold_face(struct incode_afl *afl, uint32_t key, uint32_t b,
                          uint32_t c) {
    uint32_t i = find_face(afl, key, b, c);
    if (i != INCODE_AFL_NIL)
        hold(afl, i);
    return i != INCODE_AFL_NIL;
}

bool incode_afl_is_open(const struct incode_afl *afl, uint32_t key, uint32_t b,
                        uint32_t c) {
    return find_face(afl, key, b, c) != INCODE_AFL_NIL;
}

uint32_t incode_afl_let_go(struct incode_afl *afl, uint32_t v) {
    struct walk walk;
    uint32_t count = 0, i = walk_begin(afl, v, &walk);
    for (; i != INCODE_AFL_NIL; i = walk_on(afl, &walk, i))
        if (afl->nodes[i].key == v && is_held(afl, i) && !is_foreign(afl, i)) {
            let_go(afl, i);
            count++;
        }
    if (count > 0)
        incode_afl_touch(afl, v / INCODE_BRICK_POINTS)->pending |= bit_of(v);
    return count;
}

void incode_afl_free(struct incode_afl *afl, uint32_t v) {
    struct walk walk;
    uint32_t i = walk_begin(afl, v, &walk);
    for (; i != INCODE_AFL_NIL; i = walk_on(afl, &walk, i))
        if (afl->nodes[i].key == v)
            afl->foreign[i / 64] &= ~(UINT64_C(1) << i % 64);
    (void)incode_afl_let_go(afl, v);
}
