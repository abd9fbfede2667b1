#include "insertion.h"

#include <string.h>

#include "incode/front/owner.h"
#include "incode/predicates/check.h"

enum {
    AHEAD = 16,              /* bricks asked for together */
    STEPS = 64,              /* a call, at most */
    SAMPLE = 500,            /* points of the first round, about */
    ROUND = 2,               /* bits: 4 times as many in each that follows */
    INSERT_UNITS = 4,        /* of work, an insertion */
    CELLS = 16,              /* judged or listed as a unit of work */
    EMIT_A_UNIT = 8,         /* tetrahedra */
    JUDGED = 1024,           /* cells a step */
    LOOKED = 64,             /* the same */
    HALF_CELLS_A_POINT = 13, /* in volumes and on surfaces */
    LEFT_A_POINT = 4,        /* cells that are not final */
    SAMPLE_SHARE = 16,       /* of the room for points */
    RESERVE = 4096           /* bytes */
};

/* ---- memory ---- */

size_t incode_insertion_bytes(uint64_t points)
{
    size_t each = sizeof(struct incode_complex_point) +
                  HALF_CELLS_A_POINT * sizeof(struct incode_cell) / 2;
    return (size_t)points * each + RESERVE;
}

void incode_insertion_init(struct incode_insertion *n,
                           struct incode_maker *maker,
                           const struct incode_front_outside *outside)
{
    memset(n, 0, sizeof *n);
    n->maker = maker;
    n->outside = *outside;
    n->stage = INCODE_INSERTION_DONE;
}

/* Sets room for points apart, one in LEFT_A_POINT cells, and says how many
 * bricks are taken in at a time. */
static uint32_t divide(struct incode_insertion *n)
{
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

void incode_insertion_start(struct incode_insertion *n, uint64_t *committed,
                            void *memory, size_t bytes, uint32_t first,
                            uint32_t last)
{
    uint32_t bricks = n->maker->tree.bricks, words = (bricks + 63) / 64;
    size_t bits = words * sizeof(uint64_t);
    INCODE_ASSERT(first < last && last <= bricks && bits < bytes);
    n->committed = committed;
    n->touched = memory;
    memset(committed, 0, bits);
    incode_complex_init(&n->complex, (uint8_t *)memory + bits, bytes - bits);
    uint64_t points = (uint64_t)bricks * INCODE_BRICK_POINTS;
    n->whole = points <= INCODE_COMPLEX_POINTS_MAX &&
               incode_insertion_bytes(points) <= n->complex.bytes;
    n->emitted = false;
    n->own_first = first;
    n->own_last = last;
    n->from = n->to = 0;
    n->most = n->whole ? bricks : divide(n);
    n->again = false;
    n->sample_first = n->sample_end = 0;
    n->sample_step = 1 + bricks / (1 + n->complex.points_kept / SAMPLE_SHARE);
    n->stage = INCODE_INSERTION_CHOOSE;
}

/* Bricks that there is room for, a quarter to spare. */
static uint32_t room_for(const struct incode_insertion *n)
{
    const struct incode_complex *x = &n->complex;
    uint32_t points = x->points < x->points_kept ? x->points_kept : x->points;
    size_t used = points * sizeof *x->point +
                  (x->cells - (size_t)x->free_count) * sizeof *x->cell;
    size_t brick = INCODE_BRICK_POINTS * HALF_CELLS_A_POINT *
                   sizeof(struct incode_cell) / 2;
    return (uint32_t)((x->bytes - used) / (brick + brick / 4));
}

/* ---- the points ---- */

/* The next bricks: the largest part, of those that cutting all bricks leads to,
 * that begins with the first of them and is not too large. */
static enum incode_insertion_step choose(struct incode_insertion *n)
{
    uint32_t all = n->maker->tree.bricks, first = 0, last = all;
    uint32_t room = room_for(n), most = n->most;
    if (!n->whole && room < most)
        most = room > 0 ? room : 1;
    n->from = n->to;
    while (last - first > 1 && (first != n->from || last - first > most)) {
        uint32_t cut = first + incode_bricks_cut(first, last - first);
        if (n->from < cut)
            last = cut;
        else
            first = cut;
    }
    n->to = last;
    n->again = false;
    n->brick = n->from;
    n->staged_count = 0;
    memset(n->there, 0, sizeof n->there);
    n->stage = INCODE_INSERTION_LOAD;
    return INCODE_INSERTION_WORKED;
}

/* Of a set that is inserted whole, points are in the order of bricks. */
static uint32_t staged(const struct incode_insertion *n, uint32_t i)
{
    return n->whole ? 1 + i : n->staged[i];
}

static enum incode_insertion_step make_room(struct incode_insertion *n);

/* Whether the first point of a brick is a vertex already. */
static bool is_sampled(const struct incode_insertion *n, uint32_t brick)
{
    return brick >= n->sample_first && brick < n->sample_end &&
           (brick - n->sample_first) % n->sample_step == 0;
}

/* Inserts the first point of a brick to come, or of every other, so that those
 * before it are not bounded by large cells that all change again: twice as fast
 * on some surfaces, and no slower elsewhere. */
static enum incode_insertion_step sample(struct incode_insertion *n)
{
    struct incode_complex *x = &n->complex;
    struct incode_pager *pager = &n->maker->pager;
    uint32_t bricks = n->maker->tree.bricks, step = n->sample_step;
    if (n->sample_end >= bricks) {
        n->stage = INCODE_INSERTION_CHOOSE;
        return INCODE_INSERTION_WORKED;
    }
    uint32_t left = (bricks - 1 - n->sample_end) / step;
    for (uint32_t i = 0; i < AHEAD && i <= left; i++)
        (void)incode_pager_get(pager, n->sample_end + i * step);
    const struct incode_frame *f = incode_pager_get(pager, n->sample_end);
    if (f == NULL)
        return INCODE_INSERTION_WAITING;
    const struct incode_brick *b = &f->page.brick;
    const double p[3] = {b->x[0], b->y[0], b->z[0]};
    uint32_t v = incode_complex_add(x, p, n->sample_end * INCODE_BRICK_POINTS);
    incode_walker_spend(&n->maker->walker, INSERT_UNITS);
    if (v == INCODE_NONE ||
        !incode_complex_insert(x, &n->maker->counts.tally, v, n->near)) {
        n->stage = INCODE_INSERTION_REST; /* it has taken the room */
        return INCODE_INSERTION_WORKED;
    }
    n->vertices++;
    n->near = v;
    n->sample_end = left > 0 ? n->sample_end + step : bricks;
    return INCODE_INSERTION_WORKED;
}

static enum incode_insertion_step load(struct incode_insertion *n)
{
    struct incode_pager *pager = &n->maker->pager;
    (void)incode_pager_get(pager, n->brick); /* with the first credit */
    for (uint32_t i = 1; i < AHEAD && n->brick + i < n->to; i++)
        (void)incode_pager_get(pager, n->brick + i);
    const struct incode_frame *f = incode_pager_get(pager, n->brick);
    if (f == NULL)
        return INCODE_INSERTION_WAITING;
    const struct incode_brick *b = &f->page.brick;
    for (uint32_t i = 0; i < f->count; i++) {
        const double p[3] = {b->x[i], b->y[i], b->z[i]};
        uint32_t id = n->brick * INCODE_BRICK_POINTS + i;
        if (!n->whole && (n->there[n->brick - n->from] >> i & 1) != 0)
            continue;
        if (i == 0 && is_sampled(n, n->brick))
            continue;
        uint32_t v = incode_complex_add(&n->complex, p, id);
        if (v == INCODE_NONE)
            return make_room(n);
        if (!n->whole)
            n->staged[n->staged_count] = (uint16_t)v;
        n->staged_count++;
    }
    if (++n->brick == n->to)
        n->stage = INCODE_INSERTION_BEGIN;
    return INCODE_INSERTION_WORKED;
}

/* The first point from `from` on, all around, that is not on the line of two or
 * the plane of three others; 0: there is none. */
static uint32_t find_off(struct incode_insertion *n, uint32_t from,
                         const uint32_t *v, unsigned count)
{
    const struct incode_complex_point *p = n->complex.point;
    uint32_t all = n->complex.points - 1;
    for (uint32_t i = 0; i < all; i++) {
        uint32_t at = 1 + (from + i) % all;
        if (count == 2 ? !incode_collinear(p[v[0]].p, p[v[1]].p, p[at].p)
                       : incode_orient3d(&n->maker->counts.tally, p[v[0]].p,
                                         p[v[1]].p, p[v[2]].p, p[at].p) != 0)
            return at;
    }
    return 0;
}

/* Four points that span space, far apart in the order of bricks.  Where the
 * first bricks have none, the set goes by faces, whose search of a first
 * tetrahedron says where there are none at all. */
static bool find_four(struct incode_insertion *n)
{
    uint32_t all = n->complex.points - 1;
    uint32_t four[4] = {1, 1 + all / 2, 0, 0};
    if (all < 4)
        return false;
    four[2] = find_off(n, all / 4, four, 2);
    four[3] = four[2] == 0 ? 0 : find_off(n, all / 4 * 3, four, 3);
    n->near = four[0];
    if (four[3] == 0 ||
        !incode_complex_begin(&n->complex, &n->maker->counts.tally, four))
        return false;
    n->vertices += 4;
    return true;
}

static enum incode_insertion_step begin(struct incode_insertion *n)
{
    n->next = 0;
    n->level = 0;
    for (uint32_t left = n->staged_count; left > SAMPLE; left >>= ROUND)
        n->level++;
    if (n->complex.cells == 0 && !find_four(n))
        return INCODE_INSERTION_FULL;
    n->stage = INCODE_INSERTION_INSERT;
    return INCODE_INSERTION_WORKED;
}

/* The round in which a point is inserted: a random sample first, four times as
 * many in each round that follows, each in the order of bricks (Amenta, Choi,
 * Rote, SoCG 2003). */
static unsigned round_of(uint32_t id)
{
    uint32_t h = id * UINT32_C(0x9e3779b1);
    h ^= h >> 15;
    h *= UINT32_C(0x85ebca6b);
    h ^= h >> 13;
    return h == 0 ? 0 : (unsigned)__builtin_ctz(h) / ROUND;
}

/* Inserts points of the round, or begins the next. */
static enum incode_insertion_step insert(struct incode_insertion *n)
{
    struct incode_complex *x = &n->complex;
    struct incode_walker *walker = &n->maker->walker;
    unsigned done = 0;
    for (; n->next < n->staged_count; n->next++) {
        uint32_t v = staged(n, n->next);
        if (!incode_complex_is_vertex(x, v)) {
            if (round_of(x->point[v].id) < n->level)
                continue;
            if (done > 0 && (done == STEPS || walker->left == 0))
                return INCODE_INSERTION_WORKED;
            incode_walker_spend(walker, INSERT_UNITS);
            if (!incode_complex_insert(x, &n->maker->counts.tally, v, n->near))
                return make_room(n);
            n->vertices++;
            done++;
        }
        n->near = v;
    }
    n->next = 0;
    if (n->level-- > 0)
        return INCODE_INSERTION_WORKED;
    bool last = n->to == n->maker->tree.bricks;
    n->from = n->to;
    n->stage = last || room_for(n) < (n->most + 3) / 4
                   ? INCODE_INSERTION_REST
                   : INCODE_INSERTION_CHOOSE;
    if (!last && n->sample_first == 0) { /* after the first bricks */
        n->sample_first = n->sample_end = n->to;
        n->stage = INCODE_INSERTION_SAMPLE;
    }
    return INCODE_INSERTION_WORKED;
}

/* ---- which cells are final ---- */

static enum incode_insertion_step begin_list(struct incode_insertion *n);

/* In the midst of some bricks: these count among the rest, and what is not a
 * vertex yet is taken in again, once. */
static enum incode_insertion_step make_room(struct incode_insertion *n)
{
    if (n->whole || n->complex.cells == 0 || n->again)
        return INCODE_INSERTION_FULL;
    n->again = true;
    n->stage = INCODE_INSERTION_REST;
    return INCODE_INSERTION_WORKED;
}

static enum incode_insertion_step set_rest(struct incode_insertion *n)
{
    struct incode_complex *x = &n->complex;
    if (!incode_rest_set(&n->rest, n->maker, n->from))
        return INCODE_INSERTION_WAITING;
    incode_complex_tell_free(x);
    n->releases++;
    n->cell = INCODE_COMPLEX_CELLS_FIRST;
    n->final = 0;
    n->stage = INCODE_INSERTION_JUDGE;
    return INCODE_INSERTION_WORKED;
}

static uint32_t cells_left(const struct incode_insertion *n)
{
    const struct incode_complex *x = &n->complex;
    return x->cells - INCODE_COMPLEX_CELLS_FIRST - x->free_count;
}

static enum incode_insertion_step judge(struct incode_insertion *n)
{
    const struct incode_complex *x = &n->complex;
    uint32_t end = x->cells - n->cell < JUDGED ? x->cells : n->cell + JUDGED;
    for (; n->cell < end; n->cell++) {
        struct incode_cell *c = incode_complex_cell(x, n->cell);
        if (incode_cell_is_free(c))
            continue;
        bool final = !incode_rest_reaches(&n->rest, x, c);
        incode_cell_set_proved(c, final);
        n->final += final;
    }
    incode_walker_spend(&n->maker->walker, JUDGED / CELLS);
    if (n->cell < x->cells)
        return INCODE_INSERTION_WORKED;
    n->cell = INCODE_COMPLEX_CELLS_FIRST;
    if (n->final >= cells_left(n) / 2)
        return begin_list(n);
    n->stage = INCODE_INSERTION_LOOK;
    return INCODE_INSERTION_WORKED;
}

/* Looks closely at those that are not final as far as the rest's boxes tell. */
static enum incode_insertion_step look(struct incode_insertion *n)
{
    const struct incode_complex *x = &n->complex;
    uint32_t looked = 0;
    for (; n->cell < x->cells && looked < LOOKED; n->cell++) {
        struct incode_cell *c = incode_complex_cell(x, n->cell);
        if (incode_cell_is_free(c) || incode_cell_proved(c) != 0)
            continue;
        bool final = !incode_rest_looks(&n->rest, x, c);
        incode_cell_set_proved(c, final);
        n->final += final;
        looked++;
    }
    incode_walker_spend(&n->maker->walker, looked);
    if (n->cell < x->cells)
        return INCODE_INSERTION_WORKED;
    if (n->final < cells_left(n) / 8)
        return INCODE_INSERTION_FULL;
    return begin_list(n);
}

/* ---- the tetrahedra ---- */

/* Which of a cell's vertices is the smallest, whose brick owns it. */
static unsigned owner_of(const struct incode_complex *x,
                         const struct incode_cell *c)
{
    const double *const p[4] = {x->point[c->v[0]].p, x->point[c->v[1]].p,
                                x->point[c->v[2]].p, x->point[c->v[3]].p};
    return incode_owner(p);
}

static bool is_own(const struct incode_insertion *n, uint32_t id)
{
    uint32_t brick = id / INCODE_BRICK_POINTS;
    return brick >= n->own_first && brick < n->own_last;
}

/* From now on points' `cell` is the first of what they own. */
static enum incode_insertion_step begin_list(struct incode_insertion *n)
{
    struct incode_complex *x = &n->complex;
    for (uint32_t v = 0; v < x->points; v++)
        x->point[v].cell = INCODE_NONE;
    n->cell = INCODE_COMPLEX_CELLS_FIRST;
    n->emitted = true;
    n->stage = INCODE_INSERTION_LIST;
    return INCODE_INSERTION_WORKED;
}

/* Lists some final tetrahedra by the vertex that owns them; the triangulation
 * is set right when they are released. */
static enum incode_insertion_step list(struct incode_insertion *n)
{
    struct incode_complex *x = &n->complex;
    uint32_t end = x->cells - n->cell < CELLS ? x->cells : n->cell + CELLS;
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
    n->v = 1;
    n->stage = INCODE_INSERTION_EMIT;
    return INCODE_INSERTION_WORKED;
}

/* The vertices of a cell after v, so that all have positive orientation. */
static void apexes_of(const struct incode_complex *x,
                      const struct incode_cell *c, uint32_t v,
                      uint32_t apexes[3])
{
    static const uint8_t EVEN[4][3] = {
        {1, 2, 3}, {0, 3, 2}, {3, 0, 1}, {2, 1, 0}};
    const uint8_t *others = EVEN[incode_cell_index(c, v)];
    for (unsigned k = 0; k < 3; k++)
        apexes[k] = x->point[c->v[others[k]]].id;
}

/* The next cell of such a list. */
static uint32_t next_of(const struct incode_cell *c)
{
    uint32_t next = c->n[0].cell;
    return next == INCODE_CELL_NONE ? INCODE_NONE : next;
}

/* Emits tetrahedra of v, as far as there is room for them. */
static enum incode_insertion_step emit_some(struct incode_insertion *n,
                                            struct incode_complex_point *v)
{
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
    incode_walker_spend(&n->maker->walker, (uint32_t)count / EMIT_A_UNIT);
    return INCODE_INSERTION_WORKED;
}

static enum incode_insertion_step emit(struct incode_insertion *n)
{
    struct incode_complex *x = &n->complex;
    for (unsigned i = 0; i < STEPS && n->v < x->points; i++, n->v++)
        if (x->point[n->v].cell != INCODE_NONE)
            return emit_some(n, &x->point[n->v]);
    if (n->v == x->points)
        n->stage = INCODE_INSERTION_RELEASE;
    return INCODE_INSERTION_WORKED;
}

static void set_bit(uint64_t *bits, uint32_t i)
{
    bits[i / 64] |= UINT64_C(1) << i % 64;
}

/* The points of the bricks at work that are vertices. */
static void mark_there(struct incode_insertion *n)
{
    const struct incode_complex *x = &n->complex;
    memset(n->there, 0, sizeof n->there);
    for (uint32_t v = 1; v < x->points; v++) {
        uint32_t id = x->point[v].id, brick = id / INCODE_BRICK_POINTS;
        if (incode_complex_is_vertex(x, v) && brick >= n->from && brick < n->to)
            n->there[brick - n->from] |= UINT64_C(1)
                                         << id % INCODE_BRICK_POINTS;
    }
}

/* Releases what has been emitted. */
static enum incode_insertion_step release(struct incode_insertion *n)
{
    struct incode_complex *x = &n->complex;
    uint32_t words = (n->maker->tree.bricks + 63) / 64, latest = 0;
    incode_complex_release(x);
    memset(n->touched, 0, words * sizeof *n->touched);
    for (uint32_t v = 1; v < x->points; v++) {
        uint32_t id = x->point[v].id;
        if (!incode_complex_is_vertex(x, v))
            continue;
        set_bit(n->touched, id / INCODE_BRICK_POINTS);
        if (id >= latest) {
            latest = id;
            n->near = v;
        }
    }
    n->brick = n->own_first;
    n->stage = INCODE_INSERTION_COMMIT;
    return INCODE_INSERTION_WORKED;
}

/* Commits the bricks at whose points no cell is left. */
static enum incode_insertion_step commit(struct incode_insertion *n)
{
    uint32_t end = n->from < n->own_last ? n->from : n->own_last;
    for (; n->brick < end; n->brick++) {
        if ((n->touched[n->brick / 64] >> n->brick % 64 & 1) != 0 ||
            incode_insertion_has_committed(n, n->brick))
            continue;
        if (n->outside.emit_room(n->outside.context) == 0)
            return INCODE_INSERTION_WAITING;
        set_bit(n->committed, n->brick);
        n->outside.commit(n->outside.context, n->brick);
    }
    n->stage = INCODE_INSERTION_CHOOSE;
    if (n->from == n->maker->tree.bricks) {
        n->stage = INCODE_INSERTION_DONE;
    } else if (n->from < n->to) { /* in the midst of some bricks */
        mark_there(n);
        n->brick = n->from;
        n->staged_count = 0;
        n->stage = INCODE_INSERTION_LOAD;
    }
    return INCODE_INSERTION_WORKED;
}

static enum incode_insertion_step step(struct incode_insertion *n)
{
    switch (n->stage) {
    case INCODE_INSERTION_CHOOSE:
        return choose(n);
    case INCODE_INSERTION_LOAD:
        return load(n);
    case INCODE_INSERTION_BEGIN:
        return begin(n);
    case INCODE_INSERTION_INSERT:
        return insert(n);
    case INCODE_INSERTION_SAMPLE:
        return sample(n);
    case INCODE_INSERTION_REST:
        return set_rest(n);
    case INCODE_INSERTION_JUDGE:
        return judge(n);
    case INCODE_INSERTION_LOOK:
        return look(n);
    case INCODE_INSERTION_LIST:
        return list(n);
    case INCODE_INSERTION_EMIT:
        return emit(n);
    case INCODE_INSERTION_RELEASE:
        return release(n);
    case INCODE_INSERTION_COMMIT:
        return commit(n);
    case INCODE_INSERTION_DONE:
    default:
        return INCODE_INSERTION_FINISHED;
    }
}

static void note_used(struct incode_insertion *n)
{
    const struct incode_complex *x = &n->complex;
    size_t used = x->points * sizeof *x->point + x->cells * sizeof *x->cell;
    n->used = used > n->used ? used : n->used;
}

enum incode_insertion_step incode_insertion_step(struct incode_insertion *n)
{
    enum incode_insertion_step r = INCODE_INSERTION_WORKED;
    for (unsigned i = 0; i < STEPS && r == INCODE_INSERTION_WORKED; i++) {
        r = step(n);
        note_used(n);
        incode_walker_spend(&n->maker->walker, 1);
        if (n->maker->walker.left == 0)
            break;
    }
    return r;
}
