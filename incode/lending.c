#include "lending.h"

#include <string.h>

#include "state.h"
#include "incode/front/exchange.h"
#include "incode/predicates/check.h"

enum { USED = 32 /* tetrahedra a step, at most: a star's room suffices */ };

bool incode_triangulator_lend(struct incode_triangulator *t,
                              struct incode_loan *loan) {
    return t->phase == INCODE_PHASE_FACES &&
           incode_triangulator_fault(t) == NULL &&
           incode_front_lend_run(&t->front, loan);
}

static uint32_t lesser(uint32_t a, size_t b) {
    return a < b ? a : (uint32_t)b;
}

/* As many as there is room for. */
static uint32_t most_of(const struct incode_front *front, uint32_t units) {
    const struct incode_front_outside *outside = &front->outside;
    const struct incode_front_peers *peers = &front->exchange.peers;
    uint32_t most = lesser(USED, units > 0 ? units : 1);
    most = lesser(most, outside->emit_room(outside->context));
    return lesser(most, peers->room(peers->context));
}

enum incode_step incode_triangulator_use(struct incode_triangulator *t,
                                         const struct incode_loan *loan,
                                         const struct incode_found *found,
                                         uint32_t *used, uint32_t units) {
    uint32_t task;
    struct incode_front *front = &t->front;
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (*used < found->count && !incode_front_is_finished(front)) {
        enum incode_turn turn =
            incode_front_turn(front, incode_front_suspended(front), &task);
        if (turn != INCODE_TURN_NEXT)
            return turn == INCODE_TURN_WORKED ? INCODE_WORKED : INCODE_WAITING;
        uint32_t now =
            incode_front_use_found(front, found, *used, most_of(front, units));
        *used += now;
        t->spent += now;
    }
    t->spent++;
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (*used < found->count && !incode_front_is_finished(front))
        return INCODE_WORKED;
    *used = found->count;
    incode_front_return(front, loan);
    return INCODE_FINISHED;
}

/* --- borrower ------------------------------------------------------------- */

enum { SEARCH = INCODE_TASKS /* of the maker: behind those of tasks */ };

static bool is_among(uint32_t v, uint32_t first, uint32_t last) {
    uint32_t brick = v / INCODE_BRICK_POINTS;
    return brick >= first && brick < last;
}

static bool is_lenders(const struct incode_borrower *b, uint32_t v) {
    return is_among(v, b->first, b->last);
}

bool incode_loan_is_sound(const struct incode_loan *loan, uint32_t bricks) {
    uint32_t vertices = 0;
    bool sound = loan->count >= 1 && loan->count <= INCODE_LOAN_FACES &&
                 loan->first < loan->last && loan->last <= bricks;
    for (uint32_t i = 0; sound && i < loan->count; i++) {
        const uint32_t *f = loan->v[i];
        sound = is_among(f[0], loan->first, loan->last) &&
                f[1] / INCODE_BRICK_POINTS < bricks &&
                f[2] / INCODE_BRICK_POINTS < bricks && f[0] != f[1] &&
                f[0] != f[2] && f[1] != f[2];
        vertices += i == 0 || f[0] != loan->v[i - 1][0];
    }
    return sound && vertices <= INCODE_LOAN_VERTICES;
}

void incode_borrower_begin(struct incode_borrower *b,
                           struct incode_triangulator *t,
                           const struct incode_loan *loan) {
    b->first = loan->first;
    b->last = loan->last;
    memcpy(b->face, loan->v, loan->count * sizeof loan->v[0]);
    b->open = loan->count;
    b->vertices = 0;
    for (uint32_t i = 0; i < loan->count; i++)
        if (i == 0 || loan->v[i][0] != loan->v[i - 1][0])
            b->vertex[b->vertices++] = loan->v[i][0];
    b->found.count = b->stars = 0;
    b->v = INCODE_NONE;
    b->done = b->waits = b->full = false;
    incode_maker_forget(&t->maker, SEARCH);
}

bool incode_triangulator_may_borrow(const struct incode_triangulator *t) {
    uint32_t own = t->job.last - t->job.first;
    return incode_triangulator_is_quiet(t) &&
           incode_triangulator_left(t) <= own / 2;
}

/* ---- the stars at work ---- */

/* Whether the lender pursues a face and has it in the list of a vertex that it
 * has lent: *turn is its index. */
static bool is_pursued(const struct incode_borrower *b, const uint32_t f[3],
                       unsigned *turn) {
    unsigned lowest = f[1] < f[0], highest = 3;
    lowest = f[2] < f[lowest] ? 2 : lowest;
    for (unsigned i = 0; i < 3; i++)
        if (is_lenders(b, f[i]) && (highest == 3 || f[i] > f[highest]))
            highest = i;
    *turn = highest;
    bool lent = false;
    for (uint32_t i = 0; highest < 3 && i < b->vertices; i++)
        lent = lent || b->vertex[i] == f[highest];
    return lent && is_lenders(b, f[lowest]);
}

static void drop(struct incode_borrower *b, uint32_t i) {
    memcpy(b->face[i], b->face[--b->open], sizeof b->face[i]);
}

/* Opens a face or closes its twin, if it is of a star at work; false: there is
 * no room. */
static bool toggle(struct incode_borrower *b, const uint32_t f[3]) {
    unsigned turn;
    if (!is_pursued(b, f, &turn))
        return true;
    const uint32_t g[3] = {f[turn], f[(turn + 1) % 3], f[(turn + 2) % 3]};
    for (uint32_t i = 0; i < b->open; i++)
        if (b->face[i][0] == g[0] && b->face[i][1] == g[2] &&
            b->face[i][2] == g[1]) {
            drop(b, i);
            return true;
        }
    if (b->open == INCODE_BORROWER_OPEN)
        return false;
    memcpy(b->face[b->open++], g, sizeof g);
    return true;
}

/* The face that is next: of the vertex at work, or of the highest one. */
static uint32_t next_face(const struct incode_borrower *b) {
    uint32_t best = 0;
    for (uint32_t i = 0; i < b->open; i++) {
        if (b->face[i][0] == b->v)
            return i;
        if (b->face[i][0] > b->face[best][0])
            best = i;
    }
    return best;
}

/* Notes the tetrahedron beside face i, and goes on across its other faces if it
 * is the lender's to build. */
static void note(struct incode_borrower *b, uint32_t i, const uint32_t f[4]) {
    static const uint8_t face[3][3] = {{0, 3, 2}, {0, 1, 3}, {1, 2, 3}};
    INCODE_ASSERT(b->found.count < INCODE_LOAN_FACES);
    memcpy(b->found.v[b->found.count++], f, sizeof b->found.v[0]);
    drop(b, i);
    if (f[3] == INCODE_NONE || !is_lenders(b, f[incode_lowest(f, 4)]))
        return;
    for (int k = 0; k < 3; k++) {
        const uint32_t g[3] = {f[face[k][0]], f[face[k][1]], f[face[k][2]]};
        b->full = !toggle(b, g) || b->full;
    }
}

/* ---- steps ---- */

static enum incode_step go_on(struct incode_borrower *b,
                              struct incode_maker *maker) {
    enum incode_step r = INCODE_FINISHED;
    while (r == INCODE_FINISHED && maker->walker.left > 0 &&
           maker->fault == NULL && !b->done) {
        if (b->found.count == INCODE_LOAN_FACES || b->open == 0 || b->full) {
            b->done = true;
            break;
        }
        uint32_t i = next_face(b);
        const uint32_t f[1][3] = {
            {b->face[i][0], b->face[i][1], b->face[i][2]}};
        b->stars += b->v != f[0][0];
        b->v = f[0][0];
        struct incode_answer a;
        uint32_t done = 0;
        uint64_t before = maker->counts.candidates;
        r = incode_maker_apexes(maker, SEARCH, f, 1, &a, &done);
        uint64_t looked = maker->counts.candidates - before;
        incode_walker_spend(&maker->walker,
                            1 + (uint32_t)(looked / INCODE_BRICK_POINTS));
        if (r == INCODE_FINISHED)
            note(b, i, a.f);
    }
    return r;
}

enum incode_step incode_borrower_step(struct incode_borrower *b,
                                      struct incode_triangulator *t,
                                      uint32_t units) {
    struct incode_maker *maker = &t->maker;
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    /* Own searches that are suspended may need all page frames. */
    if (incode_front_suspended(&t->front) != 0)
        return INCODE_WAITING;
    bool released = incode_pager_release(&maker->pager, false);
    bool waits =
        b->waits && incode_maker_waiting(maker, UINT32_C(1) << SEARCH) != 0;
    maker->walker.left = units > 0 ? units : 1;
    units = maker->walker.left;
    enum incode_step r = waits ? INCODE_WAITING : go_on(b, maker);
    b->waits = r == INCODE_WAITING;
    t->spent += 1 + (units - maker->walker.left);
    if (incode_triangulator_fault(t) != NULL)
        return INCODE_BROKEN;
    if (b->done)
        return INCODE_FINISHED;
    if (r != INCODE_WAITING)
        return INCODE_WORKED;
    return released || incode_pager_release(&maker->pager, true)
               ? INCODE_WORKED
               : INCODE_WAITING;
}
