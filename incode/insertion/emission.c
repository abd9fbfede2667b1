/* What is final goes out: tetrahedra by the vertex that owns them, then the
 * bricks at whose points no cell is left. */
#include <string.h>

#include "incode/front/owner.h"
#include "stages.h"

enum {
    EMIT_A_UNIT = 8,   /* tetrahedra, of what a step may work */
    EMIT_A_BREATH = 2, /* of incode/predicates/pause.h */
    FETCHED = 32,      /* lists, side by side */
    FETCHED_MOST = 8,  /* of each, cells that come first */
    AT_ONCE = 16       /* points or cells, in a breath */
};

/* Which of a cell's vertices is the smallest, whose brick owns it. */
static unsigned owner_of(const struct incode_complex *x,
                         const struct incode_cell *c) {
    const double *const p[4] = {x->point[c->v[0]].p, x->point[c->v[1]].p,
                                x->point[c->v[2]].p, x->point[c->v[3]].p};
    return incode_smallest(p);
}

static bool is_own(const struct incode_insertion *n, uint32_t id) {
    uint32_t brick = id / INCODE_BRICK_POINTS;
    return brick >= n->own_first && brick < n->own_last;
}

/* No point has a cell. */
static void forget_cells(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    for (uint32_t v = 0; v < x->points; v++) {
        if (v % AT_ONCE == 0)
            incode_maker_breathe(n->maker, 1);
        x->point[v].cell = INCODE_NONE;
    }
}

/* Leaves a cell at each vertex of an own brick that has not been taken in, so
 * that it is known as one when it is. */
static void keep_pending(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    uint32_t from = n->from * INCODE_BRICK_POINTS;
    uint32_t pending = n->own_last * INCODE_BRICK_POINTS - from;
    forget_cells(n);
    for (unsigned pass = 0; pass < 2; pass++)
        for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
            struct incode_cell *c = incode_complex_cell(x, i);
            bool kept = incode_cell_proved(c) == 0;
            if (i % AT_ONCE == 0)
                incode_maker_breathe(n->maker, AT_ONCE / 4);
            if (incode_cell_is_free(c) || kept != (pass == 0))
                continue;
            for (unsigned k = 0; k < 4 && pass == 1; k++)
                kept = kept || (x->point[c->v[k]].cell == INCODE_NONE &&
                                x->point[c->v[k]].id - from < pending);
            for (unsigned k = 0; k < 4 && kept; k++)
                x->point[c->v[k]].cell = i;
            if (kept)
                incode_cell_set_proved(c, 0);
        }
}

/* From now on points' `cell` is the first of what they own. */
void incode_insertion_begin_list(struct incode_insertion *n) {
    if (n->shown)
        keep_pending(n);
    forget_cells(n);
    n->cell = INCODE_COMPLEX_CELLS_FIRST;
    n->emitted = true;
    n->stage = INCODE_INSERTION_LIST;
}

/* Lists some final tetrahedra by the vertex that owns them; the triangulation
 * is set right when they are released. */
enum incode_insertion_step incode_insertion_list(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    uint32_t end = x->cells - n->cell < INCODE_INSERTION_CELLS
                       ? x->cells
                       : n->cell + INCODE_INSERTION_CELLS;
    incode_maker_breathe(n->maker, INCODE_INSERTION_CELLS / 4);
    for (; n->cell < end; n->cell++) {
        struct incode_cell *c = incode_complex_cell(x, n->cell);
        if (incode_cell_is_free(c) || incode_cell_proved(c) == 0 ||
            incode_cell_is_infinite(c))
            continue;
        struct incode_complex_point *owner = &x->point[c->v[owner_of(x, c)]];
        if (!is_own(n, owner->id))
            continue;
        incode_cell_join(c, 0, owner->cell);
        owner->cell = n->cell;
    }
    if (n->cell < x->cells)
        return INCODE_INSERTION_WORKED;
    n->v = n->fetched = 1;
    n->stage = INCODE_INSERTION_EMIT;
    return INCODE_INSERTION_WORKED;
}

/* The vertices of a cell after v, so that all have positive orientation. */
static void apexes_of(const struct incode_complex *x,
                      const struct incode_cell *c, uint32_t v,
                      uint32_t apexes[3]) {
    static const uint8_t EVEN[4][3] = {
        {1, 2, 3}, {0, 3, 2}, {3, 0, 1}, {2, 1, 0}};
    const uint8_t *others = EVEN[incode_cell_index(c, v)];
    for (unsigned k = 0; k < 3; k++)
        apexes[k] = x->point[c->v[others[k]]].id;
}

/* The next cell of such a list. */
static uint32_t next_of(const struct incode_cell *c) {
    uint32_t next = c->n[0].cell;
    return next == INCODE_CELL_NONE ? INCODE_NONE : next;
}

/* Emits tetrahedra of v, as far as there is room for them. */
static enum incode_insertion_step emit_some(struct incode_insertion *n,
                                            struct incode_complex_point *v) {
    const struct incode_complex *x = &n->complex;
    size_t room = n->outside.emit_room(n->outside.context), count = 0;
    if (room == 0)
        return INCODE_INSERTION_WAITING;
    if (room > INCODE_INSERTION_EMITTED)
        room = INCODE_INSERTION_EMITTED;
    for (; v->cell != INCODE_NONE && count < room; count++) {
        const struct incode_cell *c = incode_complex_cell(x, v->cell);
        v->cell = next_of(c);
        apexes_of(x, c, n->v, n->apexes[count]);
    }
    n->outside.emit(n->outside.context, v->id, (const uint32_t(*)[3])n->apexes,
                    count);
    n->kept += count;
    incode_maker_breathe(n->maker, (uint32_t)count / EMIT_A_BREATH);
    incode_walker_spend(&n->maker->walker, (uint32_t)count / EMIT_A_UNIT);
    return INCODE_INSERTION_WORKED;
}

/* The lists of the points from v on come into the cache, all at a time: one
 * after the other, each cell waits for the one before it, a fifth of a node's
 * time on uniform points. */
static void fetch(const struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    uint32_t next[FETCHED], count = 0, end = x->points - n->v;
    incode_maker_breathe(n->maker, FETCHED * FETCHED_MOST / 8);
    for (uint32_t i = 0; i < FETCHED && i < end; i++) {
        next[count] = x->point[n->v + i].cell;
        if (next[count] == INCODE_NONE)
            continue;
        __builtin_prefetch(incode_complex_cell(x, next[count]));
        count++;
    }
    for (unsigned round = 1; round < FETCHED_MOST && count > 0; round++) {
        uint32_t left = 0;
        for (uint32_t i = 0; i < count; i++) {
            next[left] = incode_complex_cell(x, next[i])->n[0].cell;
            if (next[left] == INCODE_CELL_NONE)
                continue;
            __builtin_prefetch(incode_complex_cell(x, next[left]));
            left++;
        }
        count = left;
    }
}

enum incode_insertion_step incode_insertion_emit(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    if (n->v >= n->fetched) {
        fetch(n);
        n->fetched = n->v + FETCHED;
    }
    for (; n->v < x->points && n->v < n->fetched; n->v++)
        if (x->point[n->v].cell != INCODE_NONE)
            return emit_some(n, &x->point[n->v]);
    if (n->v == x->points)
        n->stage = INCODE_INSERTION_RELEASE;
    return INCODE_INSERTION_WORKED;
}

/* Releases what has been emitted. */
enum incode_insertion_step
incode_insertion_release(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    uint32_t words = (n->maker->tree.bricks + 63) / 64, latest = 0;
    uint32_t free = x->free_count;
    incode_complex_release(x, &n->maker->counts.tally.pause);
    if (free == x->free_count && !n->closed)
        return INCODE_INSERTION_FULL; /* all of it is kept for bricks to come */
    memset(n->touched, 0, words * sizeof *n->touched);
    for (uint32_t v = 1; v < x->points; v++) {
        uint32_t id = x->point[v].id;
        if (v % AT_ONCE == 0)
            incode_maker_breathe(n->maker, 1);
        if (!incode_complex_is_vertex(x, v))
            continue;
        incode_insertion_set_bit(n->touched, id / INCODE_BRICK_POINTS);
        if (id >= latest) {
            latest = id;
            n->near = v;
        }
    }
    n->brick = n->own_first;
    n->stage = INCODE_INSERTION_COMMIT;
    return INCODE_INSERTION_WORKED;
}

static bool is_half_full(const struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    return incode_complex_cells_used(x) * sizeof *x->cell > x->bytes / 2;
}

/* Commits the bricks at whose points no cell is left. */
enum incode_insertion_step incode_insertion_commit(struct incode_insertion *n) {
    for (; n->brick < n->from; n->brick++) {
        if (n->brick % AT_ONCE == 0)
            incode_maker_breathe(n->maker, 1);
        if ((n->touched[n->brick / 64] >> n->brick % 64 & 1) != 0 ||
            incode_insertion_has_committed(n, n->brick))
            continue;
        if (n->outside.emit_room(n->outside.context) == 0)
            return INCODE_INSERTION_WAITING;
        incode_maker_breathe(n->maker, 1);
        incode_insertion_set_bit(n->committed, n->brick);
        n->outside.commit(n->outside.context, n->brick);
    }
    /* What boxes told has made room for a thorough look. */
    n->thorough = !n->shown && (n->from == n->own_last || is_half_full(n));
    if (n->closed)
        n->stage = INCODE_INSERTION_DONE;
    else if (n->thorough)
        n->stage = INCODE_INSERTION_REST;
    else if (n->from < n->to) /* in the midst of some bricks */
        incode_insertion_take_in(n);
    else
        n->stage = INCODE_INSERTION_CHOOSE;
    return INCODE_INSERTION_WORKED;
}
