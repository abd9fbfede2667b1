#include <string.h>

#include "exchange.h"
#include "front.h"
#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"

/* Closing the star of a vertex: its open faces are taken out of the active face
 * list, each gets its tetrahedron, and the new faces toggle, those at the
 * vertex at hand, the others in the list.  What is left when an answer is
 * missing goes back, the face asked about too: its tetrahedron may be built
 * from another side meanwhile. */

static const uint16_t NO_HINTS[4] = {INCODE_HINT_NONE, INCODE_HINT_NONE,
                                     INCODE_HINT_NONE, INCODE_HINT_NONE};

static void put_back(struct incode_front *front) {
    struct incode_star *star = &front->star;
    for (uint32_t i = 0; i < star->faces; i++) {
        const uint32_t f[3] = {star->v, star->b[i], star->c[i]};
        if (front->exchange.on)
            incode_exchange_toggle(front, f, INCODE_FACE_OPEN);
        else
            incode_afl_toggle(&front->afl, f[0], f[1], f[2]);
    }
    star->faces = 0;
}

static inline void push_face(struct incode_star *star, uint32_t b, uint32_t c,
                             uint16_t ib, uint16_t ic) {
    INCODE_ASSERT(star->faces < INCODE_STAR_FACES);
    uint32_t i = star->faces++;
    star->b[i] = b;
    star->c[i] = c;
    star->ib[i] = ib;
    star->ic[i] = ic;
}

static bool remove_face(struct incode_star *star, uint32_t b, uint32_t c) {
    incode_vi bs = incode_vi_all((int32_t)b), cs = incode_vi_all((int32_t)c);
    for (uint32_t i = 0; i < star->faces; i += INCODE_VF_LANES) {
        uint32_t found = incode_vf_mask((incode_vi_load(star->b + i) == bs) &
                                        (incode_vi_load(star->c + i) == cs));
        if (star->faces - i < INCODE_VF_LANES)
            found &= (UINT32_C(1) << (star->faces - i)) - 1;
        if (found == 0)
            continue;
        uint32_t k = i + (uint32_t)__builtin_ctz(found);
        uint32_t last = --star->faces;
        star->b[k] = star->b[last];
        star->c[k] = star->c[last];
        star->ib[k] = star->ib[last];
        star->ic[k] = star->ic[last];
        return true;
    }
    return false;
}

static void toggle_here(struct incode_front *front, uint32_t b, uint32_t c,
                        uint16_t ib, uint16_t ic) {
    struct incode_star *star = &front->star;
    if (remove_face(star, c, b))
        return;
    if (star->more && incode_afl_close_twin(&front->afl, star->v, b, c))
        return;
    push_face(star, b, c, ib, ic);
}

/* Toggles what has waited, when the lists of the last ones are there, too. */
static void toggle_later(struct incode_front *front) {
    enum { ROUNDS = 3 };
    struct incode_star *star = &front->star;
    for (unsigned i = 0; i < ROUNDS && star->links > 0; i++)
        star->links = incode_afl_fetch(&front->afl, star->link, star->links);
    for (uint32_t i = 0; i < star->later_count; i++)
        incode_front_toggle(front, star->later[i], false);
    star->later_count = star->links = 0;
}

/* A face toggles in another vertex's list: where nobody else looks there before
 * the star is shut, it waits until then, and its list comes meanwhile. */
static void toggle_there(struct incode_front *front, const uint32_t f[3],
                         bool held) {
    struct incode_star *star = &front->star;
    if (held) {
        incode_front_toggle(front, f, true);
        return;
    }
    memcpy(star->later[star->later_count++], f, sizeof star->later[0]);
    star->links = incode_afl_fetch(&front->afl, star->link, star->links);
    const uint32_t *link = incode_afl_list(&front->afl, f[0], f[1], f[2]);
    __builtin_prefetch(link, 1);
    star->link[star->links++] = link;
    if (star->later_count == INCODE_STAR_LATER)
        toggle_later(front);
}

/* A tetrahedron is inside where all its vertices are own and none is a hub. */
static void toggle_face(struct incode_front *front, const uint32_t v[3],
                        const double *const p[3], const uint16_t hint[3],
                        bool inside, bool near) {
    unsigned turn;
    if (inside)
        turn = incode_front_first(front, v);
    else if (!incode_front_key(front, v, p, &turn))
        return;
    const uint32_t f[3] = {v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]};
    bool held = near && incode_exchange_is_outward(front, p);
    if (f[0] != front->star.v ||
        (!inside && incode_exchange_is_foreign(front, f, 3))) {
        toggle_there(front, f, held);
        return;
    }
    if (held) {
        if (!remove_face(&front->star, f[2], f[1])) {
            incode_front_toggle(front, f, true);
            front->star.more = true;
        }
        return;
    }
    toggle_here(front, f[1], f[2], hint[(turn + 1) % 3], hint[(turn + 2) % 3]);
}

static bool all_own(const struct incode_front *front, const uint32_t v[4]) {
    return incode_own(front, v[0]) && incode_own(front, v[1]) &&
           incode_own(front, v[2]) && incode_own(front, v[3]);
}

/* Emits the tetrahedron v of positive orientation if it is the region's own,
 * and toggles its faces; `through`: the face (v[0], v[1], v[2]) was open and is
 * taken out already. */
static void build(struct incode_front *front, const uint32_t v[4],
                  const double *const p[4], const uint16_t hint[4],
                  bool through) {
    struct incode_star *star = &front->star;
    bool all = all_own(front, v);
    star->built++;
    front->counts.built++;
    /* The region of its owner keeps it. */
    if (all || incode_own(front, v[incode_owner(front->owner_rule, v, p)])) {
        memcpy(star->apexes[star->kept++], v + 1, 3 * sizeof *v);
        front->counts.kept++;
        INCODE_ASSERT(star->kept <= INCODE_STAR_BUILT);
    }
    incode_front_reached(front, v[3]);
    bool near = false;
    if (front->exchange.on) {
        near = p[0] != NULL && incode_exchange_is_near(front, p);
        incode_exchange_share(front, v, !all);
    }
    bool inside = all && front->hub_count == 0;
    /* Faces with their unknown side outward: of (v, b, c, a) these are
     * (v, c, b) behind, (v, a, c), (v, b, a) and (b, c, a). */
    static const uint8_t face[4][3] = {
        {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 1}};
    for (int k = 0; k < (through ? 3 : 4); k++) {
        const uint8_t *j = face[k];
        const uint32_t f[3] = {v[j[0]], v[j[1]], v[j[2]]};
        const double *const q[3] = {p[j[0]], p[j[1]], p[j[2]]};
        const uint16_t i[3] = {hint[j[0]], hint[j[1]], hint[j[2]]};
        toggle_face(front, f, q, i, inside, near);
    }
}

/* A fault that the simulation has to find: a face that is its owner's to pursue
 * is pursued here as well. */
static bool is_planted(const struct incode_front *front) {
#ifdef INCODE_PLANT_KEPT
    return front->counts.built % 16 == 0;
#else
    (void)front;
    return false;
#endif
}

/* The face (v[0], v[1], v[2]) is of the hull. */
static void find_hull(struct incode_front *front, const uint32_t v[4]) {
    front->counts.hull_facets++;
    if (front->exchange.on) {
        front->star.built++; /* it takes as much room */
        bool all = incode_own(front, v[0]) && incode_own(front, v[1]) &&
                   incode_own(front, v[2]);
        incode_exchange_share(front, v, !all);
    }
}

/* The tetrahedron beside the face that was taken out, whose first vertex has it
 * in its list, is another's: the face stays open until it comes. */
static void leave(struct incode_front *front, const uint32_t v[4]) {
    front->star.built++;
    front->counts.built++;
    front->counts.foreign++;
    incode_exchange_toggle(front, v, INCODE_FACE_FOREIGN);
}

static void emit(struct incode_front *front) {
    struct incode_star *star = &front->star;
    if (star->kept > 0)
        front->outside.emit(front->outside.context, star->v,
                            (const uint32_t(*)[3])star->apexes, star->kept);
    star->kept = 0;
}

/* ---- a whole star ---- */

bool incode_star_open(struct incode_front *front, uint32_t v) {
    struct incode_star *star = &front->star;
    uint32_t pairs[INCODE_STAR_FACES / 2][2];
    star->v = v;
    star->faces = star->built = star->kept = 0;
    star->later_count = star->links = 0;
    uint32_t n = incode_afl_take(&front->afl, v, pairs, INCODE_STAR_FACES / 2,
                                 &star->more);
    for (uint32_t i = 0; i < n; i++)
        push_face(star, pairs[i][0], pairs[i][1], INCODE_HINT_NONE,
                  INCODE_HINT_NONE);
    return n > 0;
}

void incode_star_put(struct incode_front *front,
                     const struct incode_star_face *face) {
    push_face(&front->star, face->b, face->c, face->hint[0], face->hint[1]);
}

bool incode_star_find(struct incode_front *front, uint32_t b, uint32_t c) {
    struct incode_star *star = &front->star;
    /* It may be among those that did not fit at hand. */
    return remove_face(star, b, c) ||
           (star->more && incode_afl_close_twin(&front->afl, star->v, c, b));
}

void incode_star_build(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4], const uint16_t hint[4]) {
    if (v[3] == INCODE_NONE)
        find_hull(front, v);
    else if (incode_exchange_is_foreign(front, v, 4) && !is_planted(front))
        leave(front, v);
    else
        build(front, v, p, hint, true);
}

void incode_star_shut(struct incode_front *front) {
    toggle_later(front);
    put_back(front);
    emit(front);
}

/* ---- by itself ---- */

static void build_alone(struct incode_front *front, const uint32_t v[4],
                        const double *const p[4], bool through) {
    struct incode_star *star = &front->star;
    star->v = v[0];
    star->faces = star->built = star->kept = 0;
    star->later_count = star->links = 0;
    star->more = true;
    build(front, v, p, NO_HINTS, through);
    incode_star_shut(front);
}

bool incode_front_face(struct incode_front *front, uint32_t v,
                       uint32_t face[3]) {
    uint32_t pair[1][2];
    bool more;
    if (incode_afl_take(&front->afl, v, pair, 1, &more) == 0)
        return false;
    face[0] = v;
    face[1] = pair[0][0];
    face[2] = pair[0][1];
    incode_afl_toggle(&front->afl, v, face[1], face[2]);
    if (front->exchange.on)
        incode_exchange_ready(front, v);
    return true;
}

bool incode_front_use(struct incode_front *front, const uint32_t v[4],
                      const double *const p[4]) {
    unsigned turn;
    if (!incode_front_key(front, v, p, &turn)) {
        front->fault = "a vertex has moved while its face was under search";
        return false;
    }
    uint32_t key = v[turn], b = v[(turn + 1) % 3], c = v[(turn + 2) % 3];
    uint32_t brick = key / INCODE_BRICK_POINTS;
    /* Of a brick that is not wholly here it is not known what is open. */
    if (incode_position(front, brick) >= front->spill_from ||
        (front->unspill_pending && front->unspill_brick == brick) ||
        !incode_afl_close_twin(&front->afl, key, c, b))
        return false;
    const uint32_t f[4] = {key, b, c, v[3]};
    if (v[3] == INCODE_NONE)
        find_hull(front, v);
    else if (incode_exchange_is_foreign(front, v, 4))
        leave(front, f);
    else
        build_alone(front, v, p, true);
    return true;
}

void incode_front_seed(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4]) {
    if (incode_exchange_is_foreign(front, v, 4)) {
        front->counts.built++; /* in vain */
        front->counts.foreign++;
        return;
    }
    front->counts.seeds++;
    front->exchange.tries = UINT32_MAX; /* enough */
    for (int i = 0; i < 3; i++)
        incode_front_reached(front, v[i]);
    build_alone(front, v, p, false);
}
