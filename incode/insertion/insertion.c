#include "insertion.h"

#include <assert.h>
#include <string.h>

#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

enum {
    SAMPLE = 500,            /* points of the first round, about */
    ROUND = 2,               /* bits: 4 times as many in each that follows */
    HALF_CELLS_A_POINT = 13, /* in volumes and on surfaces */
    LEFT_A_POINT = 4,        /* cells that are not final */
    FILL = 15,               /* of the room for cells, in 16 */
    FILL_PART = 12,          /* the same where points of others' come in */
    SAMPLE_SHARE = 16,       /* of the room for points */
    RESERVE = 4096,          /* bytes */
    ALIGNED = 64,            /* the same */
    AT_ONCE = 16,            /* points between two yields */
    A_STEP = 8,              /* units, of what is the same for all points */
    LOAD_A_UNIT = 2          /* points */
};

static_assert(sizeof(struct incode_insertion_work) + RESERVE <=
                  INCODE_INSERTION_LEAST,
              "it leaves room for some cells");

/* ---- memory ---- */

size_t incode_insertion_bytes(uint64_t points) {
    size_t each = sizeof(struct incode_complex_point) +
                  HALF_CELLS_A_POINT * sizeof(struct incode_cell) / 2;
    return (size_t)points * each + INCODE_INSERTION_LEAST;
}

void incode_insertion_init(struct incode_insertion *n,
                           struct incode_maker *maker,
                           const struct incode_front_outside *outside) {
    memset(n, 0, sizeof *n);
    n->maker = maker;
    n->outside = *outside;
    n->stage = INCODE_INSERTION_DONE;
}

/* Sets room for points apart, one in LEFT_A_POINT cells, and says how many
 * bricks are taken in at a time. */
static uint32_t divide(struct incode_insertion *n) {
    size_t room =
        n->complex.bytes / (sizeof(struct incode_complex_point) +
                            LEFT_A_POINT * sizeof(struct incode_cell));
    uint32_t points = (uint32_t)(room < INCODE_COMPLEX_POINTS_MAX
                                     ? room
                                     : INCODE_COMPLEX_POINTS_MAX);
    uint32_t bricks = points / 8 / INCODE_BRICK_POINTS;
    incode_complex_reserve(&n->complex, points);
    return bricks < 1                         ? 1
           : bricks < INCODE_INSERTION_BRICKS ? bricks
                                              : INCODE_INSERTION_BRICKS;
}

/* Nothing is inserted yet.  whole: all bricks at once. */
static void begin_job(struct incode_insertion *n, bool whole) {
    uint32_t bricks = n->maker->tree.bricks;
    incode_complex_clear(&n->complex);
    if (n->inserted != NULL)
        incode_yield_fill(&n->maker->counts.tally.yield, n->inserted, 0,
                          bricks * sizeof *n->inserted);
    n->whole = whole;
    n->from = n->to = n->own_first;
    n->sampled = n->thorough = false;
    n->most = whole ? bricks : divide(n);
    bricks = incode_insertion_end(n) - incode_insertion_base(n);
    n->sample_step = 1 + bricks / (1 + n->complex.points_kept / SAMPLE_SHARE);
    n->stage = INCODE_INSERTION_CHOOSE;
}

void incode_insertion_start(struct incode_insertion *n, uint64_t *committed,
                            void *memory, size_t bytes, uint32_t first,
                            uint32_t last) {
    uint32_t bricks = n->maker->tree.bricks, words = (bricks + 63) / 64;
    size_t bits = words * sizeof(uint64_t), before = 2 * bits;
    size_t known = bricks * sizeof *n->inserted;
    uint64_t points = (uint64_t)(last - first) * INCODE_BRICK_POINTS;
    INCODE_ASSERT(first < last && last <= bricks &&
                  bytes >= before + INCODE_INSERTION_LEAST);
    n->own_first = first;
    n->own_last = last;
    bool whole = incode_insertion_owns_all(n) &&
                 points <= INCODE_COMPLEX_POINTS_MAX &&
                 before + incode_insertion_bytes(points) <= bytes;
    n->committed = committed;
    n->touched = memory;
    n->passed = n->touched + words;
    memset(committed, 0, bits);
    n->inserted = n->sought = NULL;
    if (!whole && known <= bytes / INCODE_INSERTION_KNOWN &&
        before + known + INCODE_INSERTION_LEAST <= bytes) {
        n->inserted = n->passed + words;
        before += known;
        if (2 * known <= bytes / INCODE_INSERTION_KNOWN &&
            before + known + INCODE_INSERTION_LEAST <= bytes) {
            n->sought = n->inserted + bricks;
            before += known;
        }
    }
    before += -((uintptr_t)memory + before) % ALIGNED;
    n->work = (void *)((uint8_t *)memory + before);
    before += sizeof *n->work;
    incode_complex_init(&n->complex, (uint8_t *)memory + before,
                        bytes - before);
    n->emitted = n->squeezed = n->closed = false;
    begin_job(n, whole);
}

/* Bytes of cells that are there, and that there is room for. */
static size_t used_of(const struct incode_insertion *n, size_t *room) {
    const struct incode_complex *x = &n->complex;
    uint32_t points = x->points < x->points_kept ? x->points_kept : x->points;
    *room = x->bytes - points * sizeof *x->point;
    return incode_complex_cells_used(x) * sizeof *x->cell;
}

/* Bricks that there is room for, a quarter to spare. */
static uint32_t room_for(const struct incode_insertion *n) {
    size_t room, used = used_of(n, &room);
    size_t brick = INCODE_BRICK_POINTS * HALF_CELLS_A_POINT *
                   sizeof(struct incode_cell) / 2;
    return (uint32_t)((room - used) / (brick + brick / 4));
}

/* Whether what is free should be left to points that are inserted ahead of
 * their turn. */
static bool is_short(const struct incode_insertion *n) {
    size_t room, used = used_of(n, &room);
    uint32_t fill = incode_insertion_owns_all(n) ? FILL : FILL_PART;
    return !n->whole && (used > room / 16 * fill || room_for(n) < 1);
}

/* ---- the points ---- */

/* Now and then in a loop over all points. */
static inline void yield_at(const struct incode_insertion *n, uint32_t v) {
    if (v % AT_ONCE == 0)
        incode_maker_yield(n->maker, 2);
}

/* The points of the bricks at work that are vertices. */
static void mark_there(struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    memset(n->there, 0, sizeof n->there);
    for (uint32_t v = 1; v < x->points; v++) {
        yield_at(n, v);
        uint32_t id = x->point[v].id, brick = id / INCODE_BRICK_POINTS;
        if (incode_complex_is_vertex(x, v) && brick >= n->from && brick < n->to)
            n->there[brick - n->from] |= UINT64_C(1)
                                         << id % INCODE_BRICK_POINTS;
    }
}

void incode_insertion_take_in(struct incode_insertion *n) {
    if (!n->whole)
        mark_there(n);
    n->brick = n->from;
    n->staged_count = 0;
    n->stage = INCODE_INSERTION_LOAD;
}

/* The next bricks: the largest part, of those that cutting all bricks leads to,
 * that begins with the first of them and is not too large. */
static enum incode_step choose(struct incode_insertion *n) {
    uint32_t first = 0, last = n->maker->tree.bricks;
    uint32_t room = room_for(n), most = n->most;
    if (!n->whole && room < most)
        most = room > 0 ? room : 1;
    n->from = n->to;
    n->squeezed = false;
    if (n->from == n->own_last) {
        n->stage = INCODE_INSERTION_REST;
        return INCODE_WORKED;
    }
    if (n->whole) {
        first = n->own_first;
        last = n->own_last;
    }
    while (!n->whole && last - first > 1 &&
           (first != n->from || last - first > most || last > n->own_last)) {
        uint32_t cut = first + incode_bricks_cut(first, last - first);
        if (n->from < cut)
            last = cut;
        else
            first = cut;
    }
    n->to = last;
    incode_insertion_take_in(n);
    return INCODE_WORKED;
}

/* Of a set that is inserted whole, points are in the order of bricks. */
static uint32_t staged(const struct incode_insertion *n, uint32_t i) {
    return n->whole ? 1 + i : n->work->staged[i];
}

/* Of a set that is inserted whole, those that are. */
static uint32_t vertices(const struct incode_insertion *n) {
    uint32_t count = 0;
    for (uint32_t v = 1; v < n->complex.points; v++) {
        yield_at(n, v);
        count += incode_complex_is_vertex(&n->complex, v);
    }
    return count;
}

/* Whether a set that is inserted whole will fit, going by its first rounds. */
static bool will_fit(const struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    uint64_t cells = (uint64_t)incode_complex_cells_used(x) * n->staged_count;
    size_t room = x->bytes - x->points * sizeof *x->point;
    return cells / vertices(n) <= room / sizeof *x->cell / 4 * 5;
}

/* In the midst of some bricks: these count among the rest, and what is not a
 * vertex yet is taken in again. */
static enum incode_step make_room(struct incode_insertion *n) {
    if (n->whole || (n->from == n->own_first && n->most > 1)) {
        /* More cells than is thought: brick after brick, or fewer at a time. */
        uint32_t most = n->whole ? n->most : (n->most + 3) / 4;
        n->vertices -= vertices(n);
        begin_job(n, false);
        n->most = most < n->most ? most : n->most;
        return INCODE_WORKED;
    }
    if (n->complex.cells == 0)
        return INCODE_FULL;
    n->stage = INCODE_INSERTION_REST;
    return INCODE_WORKED;
}

/* The brick from one on, or of every other from there, that is not among those
 * taken in. */
static uint32_t past_own(const struct incode_insertion *n, uint32_t brick) {
    return brick >= n->own_first && brick < n->to ? n->to : brick;
}

static bool is_of_four(const struct incode_insertion *n, uint32_t id) {
    bool is = false;
    for (unsigned i = 0; i < 4; i++)
        is = is || n->complex.point[n->four[i]].id == id;
    return is;
}

/* Inserts the first point of a brick to come, or of every other, so that those
 * before it are not bounded by large cells that all change again: twice as fast
 * on some surfaces, and no slower elsewhere. */
static enum incode_step sample(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    struct incode_pager *pager = &n->maker->pager;
    uint32_t bricks = incode_insertion_end(n);
    uint32_t brick = past_own(n, n->brick), id = brick * INCODE_BRICK_POINTS;
    if (brick >= bricks) {
        n->stage = INCODE_INSERTION_CHOOSE;
        return INCODE_WORKED;
    }
    for (uint32_t i = 0, ahead = brick;
         i < INCODE_INSERTION_AHEAD && ahead < bricks; i++) {
        (void)incode_pager_get(pager, ahead);
        ahead = past_own(n, ahead + n->sample_step);
    }
    const struct incode_frame *f = incode_pager_get(pager, brick);
    if (f == NULL)
        return INCODE_WAITING;
    n->brick = brick + n->sample_step;
    if (is_of_four(n, id))
        return INCODE_WORKED;
    const struct incode_brick *b = &f->page.brick;
    const double p[3] = {b->x[0], b->y[0], b->z[0]};
    uint32_t v = incode_complex_add(x, p, id);
    incode_walker_spend(&n->maker->walker, INCODE_INSERTION_UNITS);
    if (v == INCODE_NONE ||
        !incode_complex_insert(x, &n->maker->counts.tally, v, n->near)) {
        n->stage = INCODE_INSERTION_REST; /* it has taken the room */
        return INCODE_WORKED;
    }
    incode_insertion_note(n, id);
    n->vertices++;
    n->near = v;
    return INCODE_WORKED;
}

static enum incode_step load(struct incode_insertion *n) {
    struct incode_pager *pager = &n->maker->pager;
    (void)incode_pager_get(pager, n->brick); /* with the first credit */
    for (uint32_t i = 1; i < INCODE_INSERTION_AHEAD && n->brick + i < n->to;
         i++)
        (void)incode_pager_get(pager, n->brick + i);
    const struct incode_frame *f = incode_pager_get(pager, n->brick);
    if (f == NULL)
        return INCODE_WAITING;
    const struct incode_brick *b = &f->page.brick;
    incode_maker_yield(n->maker, f->count / LOAD_A_UNIT);
    for (uint32_t i = 0; i < f->count; i++) {
        const double p[3] = {b->x[i], b->y[i], b->z[i]};
        uint32_t id = n->brick * INCODE_BRICK_POINTS + i;
        if (!n->whole && (n->there[n->brick - n->from] >> i & 1) != 0)
            continue;
        uint32_t v = incode_complex_add(&n->complex, p, id);
        if (v == INCODE_NONE)
            return make_room(n);
        if (!n->whole)
            n->work->staged[n->staged_count] = (uint16_t)v;
        n->staged_count++;
    }
    if (++n->brick == n->to)
        n->stage = INCODE_INSERTION_BEGIN;
    return INCODE_WORKED;
}

/* The first point from `from` on, all around, that is not on the line of two or
 * the plane of three others; 0: there is none. */
static uint32_t find_off(struct incode_insertion *n, uint32_t from,
                         const uint32_t *v, unsigned count) {
    const struct incode_complex_point *p = n->complex.point;
    uint32_t all = n->complex.points - 1;
    for (uint32_t i = 0; i < all; i++) {
        uint32_t at = 1 + (from + i) % all;
        incode_maker_yield(n->maker, 1);
        if (count == 2 ? !incode_collinear(p[v[0]].p, p[v[1]].p, p[at].p)
                       : incode_orient3d(&n->maker->counts.tally, p[v[0]].p,
                                         p[v[1]].p, p[v[2]].p, p[at].p) != 0)
            return at;
    }
    return 0;
}

/* Begins with the four points, or looks for more of them elsewhere. */
static enum incode_step begin_with(struct incode_insertion *n) {
    n->near = n->four[0];
    n->stage = INCODE_INSERTION_SPAN;
    if (n->four_count < 4)
        return INCODE_WORKED;
    if (!incode_complex_begin(&n->complex, &n->maker->counts.tally, n->four))
        return INCODE_FULL;
    n->vertices += 4;
    n->stage = INCODE_INSERTION_INSERT;
    return INCODE_WORKED;
}

/* Four points that span space, as far as these bricks have them, far apart in
 * their order. */
static enum incode_step find_four(struct incode_insertion *n) {
    uint32_t all = n->complex.points - 1, *four = n->four;
    four[0] = 1;
    four[1] = 1 + all / 2;
    n->four_count = 2;
    if (all < 4)
        return INCODE_FULL;
    four[2] = find_off(n, all / 4, four, 2);
    n->four_count += four[2] != 0;
    four[3] = four[2] == 0 ? 0 : find_off(n, all / 4 * 3, four, 3);
    n->four_count += four[3] != 0;
    n->brick = incode_insertion_base(n);
    return begin_with(n);
}

/* Bricks that are in one plane or on one line, as those of a building's wall or
 * a lake: the first points of others may be elsewhere.  Where they are not, the
 * set goes by faces, whose search of a first tetrahedron says whether there is
 * one at all. */
static enum incode_step span(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    struct incode_pager *pager = &n->maker->pager;
    const struct incode_complex_point *q = x->point;
    uint32_t bricks = incode_insertion_end(n);
    n->brick = past_own(n, n->brick);
    if (n->brick >= bricks)
        return INCODE_FULL;
    for (uint32_t i = 1; i < INCODE_INSERTION_AHEAD && n->brick + i < bricks;
         i++)
        (void)incode_pager_get(pager, n->brick + i);
    const struct incode_frame *f = incode_pager_get(pager, n->brick);
    if (f == NULL)
        return INCODE_WAITING;
    const double p[3] = {f->page.brick.x[0], f->page.brick.y[0],
                         f->page.brick.z[0]};
    uint32_t id = n->brick++ * INCODE_BRICK_POINTS, *four = n->four;
    incode_walker_spend(&n->maker->walker, 1);
    if (n->four_count == 2
            ? incode_collinear(q[four[0]].p, q[four[1]].p, p)
            : incode_orient3d(&n->maker->counts.tally, q[four[0]].p,
                              q[four[1]].p, q[four[2]].p, p) == 0)
        return INCODE_WORKED;
    four[n->four_count] = incode_complex_add(x, p, id);
    if (four[n->four_count++] == INCODE_NONE)
        return INCODE_FULL;
    return begin_with(n);
}

static enum incode_step begin(struct incode_insertion *n) {
    n->next = 0;
    n->level = 0;
    for (uint32_t left = n->staged_count; left > SAMPLE; left >>= ROUND)
        n->level++;
    n->stage = INCODE_INSERTION_INSERT;
    return n->complex.cells == 0 ? find_four(n) : INCODE_WORKED;
}

/* The round in which a point is inserted: a random sample first, four times as
 * many in each round that follows, each in the order of bricks (Amenta, Choi,
 * Rote, SoCG 2003). */
static unsigned round_of(uint32_t id) {
    uint32_t h = id * UINT32_C(0x9e3779b1);
    h ^= h >> 15;
    h *= UINT32_C(0x85ebca6b);
    h ^= h >> 13;
    return h == 0 ? 0 : (unsigned)__builtin_ctz(h) / ROUND;
}

/* Inserts points of the round, or begins the next. */
static enum incode_step insert(struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    struct incode_walker *walker = &n->maker->walker;
    unsigned done = 0;
    for (; n->next < n->staged_count; n->next++) {
        uint32_t v = staged(n, n->next);
        yield_at(n, n->next);
        if (!incode_complex_is_vertex(x, v)) {
            if (round_of(x->point[v].id) < n->level)
                continue;
            if (done > 0 &&
                (done == INCODE_INSERTION_STEPS || walker->left == 0))
                return INCODE_WORKED;
            incode_walker_spend(walker, INCODE_INSERTION_UNITS);
            if (!incode_complex_insert(x, &n->maker->counts.tally, v, n->near))
                return make_room(n);
            n->vertices++;
            done++;
        }
        n->near = v;
    }
    n->next = 0;
    if (n->level-- > 0)
        return n->whole && !will_fit(n) ? make_room(n) : INCODE_WORKED;
    n->from = n->to;
    n->stage = is_short(n) ? INCODE_INSERTION_REST : INCODE_INSERTION_CHOOSE;
    if (!n->sampled) { /* after the first bricks */
        n->sampled = true;
        n->brick = incode_insertion_base(n);
        n->stage = INCODE_INSERTION_SAMPLE;
    }
    return INCODE_WORKED;
}

/* ---- steps ---- */

static enum incode_step step(struct incode_insertion *n) {
    switch (n->stage) {
    case INCODE_INSERTION_CHOOSE:
        return choose(n);
    case INCODE_INSERTION_LOAD:
        return load(n);
    case INCODE_INSERTION_BEGIN:
        return begin(n);
    case INCODE_INSERTION_SPAN:
        return span(n);
    case INCODE_INSERTION_INSERT:
        return insert(n);
    case INCODE_INSERTION_SAMPLE:
        return sample(n);
    case INCODE_INSERTION_REST:
        return incode_insertion_rest(n);
    case INCODE_INSERTION_JUDGE:
        return incode_insertion_judge(n);
    case INCODE_INSERTION_LOOK:
        return incode_insertion_look(n);
    case INCODE_INSERTION_VISIT:
        return incode_insertion_visit(n);
    case INCODE_INSERTION_SETTLE:
        return incode_insertion_settle(n);
    case INCODE_INSERTION_OTHERS:
        return incode_insertion_others(n);
    case INCODE_INSERTION_APART:
        return incode_insertion_apart(n);
    case INCODE_INSERTION_LIST:
        return incode_insertion_list(n);
    case INCODE_INSERTION_EMIT:
        return incode_insertion_emit(n);
    case INCODE_INSERTION_RELEASE:
        return incode_insertion_release(n);
    case INCODE_INSERTION_COMMIT:
        return incode_insertion_commit(n);
    case INCODE_INSERTION_DONE:
    default:
        return INCODE_FINISHED;
    }
}

static void note_used(struct incode_insertion *n) {
    const struct incode_complex *x = &n->complex;
    size_t used = sizeof *n->work + x->points * sizeof *x->point +
                  x->cells * sizeof *x->cell;
    n->used = used > n->used ? used : n->used;
}

enum incode_step incode_insertion_step(struct incode_insertion *n) {
    enum incode_step r = INCODE_WORKED;
    for (unsigned i = 0; i < INCODE_INSERTION_STEPS && r == INCODE_WORKED;
         i++) {
        incode_maker_yield(n->maker, A_STEP);
        r = step(n);
        note_used(n);
        incode_walker_spend(&n->maker->walker, 1);
        if (n->maker->walker.left == 0)
            break;
    }
    return r;
}
