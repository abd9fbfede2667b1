#include <string.h>

#include "front.h"
#include "incode/predicates/check.h"
#include "incode/predicates/simd.h"
#include "owner.h"

/* Closing the star of a vertex: its open faces are taken out of the active face
 * list, each gets its tetrahedron, and the new faces toggle, those at the
 * vertex at hand, the others in the list.  What is left when an answer is
 * missing goes back, the face asked about too: its tetrahedron may be built
 * from another side meanwhile. */

static const uint16_t NO_HINTS[4] = {INCODE_HINT_NONE, INCODE_HINT_NONE,
                                     INCODE_HINT_NONE, INCODE_HINT_NONE};

static void put_back(struct incode_front *front)
{
    struct incode_star *star = &front->star;
    for (uint32_t i = 0; i < star->faces; i++)
        incode_afl_toggle(&front->afl, star->v, star->b[i], star->c[i]);
    star->faces = 0;
}

static inline void push_face(struct incode_star *star, uint32_t b, uint32_t c,
                             uint16_t ib, uint16_t ic)
{
    INCODE_ASSERT(star->faces < INCODE_STAR_FACES);
    uint32_t i = star->faces++;
    star->b[i] = b;
    star->c[i] = c;
    star->ib[i] = ib;
    star->ic[i] = ic;
}

static bool remove_face(struct incode_star *star, uint32_t b, uint32_t c)
{
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
                        uint16_t ib, uint16_t ic)
{
    struct incode_star *star = &front->star;
    if (remove_face(star, c, b))
        return;
    if (star->more && incode_afl_close_twin(&front->afl, star->v, b, c))
        return;
    push_face(star, b, c, ib, ic);
}

static void toggle_face(struct incode_front *front, const uint32_t v[3],
                        const double *const p[3], const uint16_t hint[3])
{
    unsigned turn;
    if (!incode_front_key(front, v, p, &turn))
        return;
    const uint32_t f[3] = {v[turn], v[(turn + 1) % 3], v[(turn + 2) % 3]};
    if (f[0] != front->star.v) {
        incode_front_toggle(front, f);
        return;
    }
    toggle_here(front, f[1], f[2], hint[(turn + 1) % 3], hint[(turn + 2) % 3]);
}

/* The region of its owner keeps a tetrahedron. */
static bool is_kept(const struct incode_front *front, const uint32_t v[4],
                    const double *const p[4])
{
    bool own[4], all = true;
    for (int i = 0; i < 4; i++) {
        own[i] = incode_own(front, v[i]);
        all = all && own[i];
    }
    return all || own[incode_owner(p)];
}

/* Emits the tetrahedron v of positive orientation if it is the region's own,
 * and toggles its faces; `through`: the face (v[0], v[1], v[2]) was open and is
 * taken out already. */
static void build(struct incode_front *front, const uint32_t v[4],
                  const double *const p[4], const uint16_t hint[4],
                  bool through)
{
    struct incode_star *star = &front->star;
    star->built++;
    front->counts.built++;
    if (is_kept(front, v, p)) {
        memcpy(star->apexes[star->kept++], v + 1, 3 * sizeof *v);
        front->counts.kept++;
        INCODE_ASSERT(star->kept <= INCODE_STAR_BUILT);
    }
    incode_front_reached(front, v[3]);
    /* Faces with their unknown side outward: of (v, b, c, a) these are
     * (v, c, b) behind, (v, a, c), (v, b, a) and (b, c, a). */
    static const uint8_t face[4][3] = {
        {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 1}};
    for (int k = 0; k < (through ? 3 : 4); k++) {
        const uint8_t *j = face[k];
        const uint32_t f[3] = {v[j[0]], v[j[1]], v[j[2]]};
        const double *const q[3] = {p[j[0]], p[j[1]], p[j[2]]};
        const uint16_t i[3] = {hint[j[0]], hint[j[1]], hint[j[2]]};
        toggle_face(front, f, q, i);
    }
}

static void emit(struct incode_front *front)
{
    struct incode_star *star = &front->star;
    if (star->kept > 0)
        front->outside.emit(front->outside.context, star->v,
                            (const uint32_t(*)[3])star->apexes, star->kept);
    star->kept = 0;
}

/* ---- a whole star ---- */

bool incode_star_open(struct incode_front *front, uint32_t v)
{
    struct incode_star *star = &front->star;
    uint32_t pairs[INCODE_STAR_FACES / 2][2];
    star->v = v;
    star->faces = star->built = star->kept = 0;
    uint32_t n = incode_afl_take(&front->afl, v, pairs, INCODE_STAR_FACES / 2,
                                 &star->more);
    for (uint32_t i = 0; i < n; i++)
        push_face(star, pairs[i][0], pairs[i][1], INCODE_HINT_NONE,
                  INCODE_HINT_NONE);
    return n > 0;
}

void incode_star_put(struct incode_front *front,
                     const struct incode_star_face *face)
{
    push_face(&front->star, face->b, face->c, face->hint[0], face->hint[1]);
}

bool incode_star_find(struct incode_front *front, uint32_t b, uint32_t c)
{
    struct incode_star *star = &front->star;
    /* It may be among those that did not fit at hand. */
    return remove_face(star, b, c) ||
           (star->more && incode_afl_close_twin(&front->afl, star->v, c, b));
}

void incode_star_build(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4], const uint16_t hint[4])
{
    if (v[3] == INCODE_NONE)
        front->counts.hull_facets++;
    else
        build(front, v, p, hint, true);
}

void incode_star_shut(struct incode_front *front)
{
    put_back(front);
    emit(front);
}

/* ---- by itself ---- */

static void build_alone(struct incode_front *front, const uint32_t v[4],
                        const double *const p[4], bool through)
{
    struct incode_star *star = &front->star;
    star->v = v[0];
    star->faces = star->built = star->kept = 0;
    star->more = true;
    build(front, v, p, NO_HINTS, through);
    incode_star_shut(front);
}

bool incode_front_face(struct incode_front *front, uint32_t v, uint32_t face[3])
{
    uint32_t pair[1][2];
    bool more;
    if (incode_afl_take(&front->afl, v, pair, 1, &more) == 0)
        return false;
    face[0] = v;
    face[1] = pair[0][0];
    face[2] = pair[0][1];
    incode_afl_toggle(&front->afl, v, face[1], face[2]);
    return true;
}

void incode_front_use(struct incode_front *front, const uint32_t v[4],
                      const double *const p[4])
{
    unsigned turn;
    if (!incode_front_key(front, v, p, &turn)) {
        front->fault = "a vertex has moved while its face was under search";
        return;
    }
    uint32_t key = v[turn], b = v[(turn + 1) % 3], c = v[(turn + 2) % 3];
    if (incode_position(front, key / INCODE_BRICK_POINTS) >=
            front->spill_from ||
        !incode_afl_close_twin(&front->afl, key, c, b))
        return;
    if (v[3] == INCODE_NONE)
        front->counts.hull_facets++;
    else
        build_alone(front, v, p, true);
}

void incode_front_seed(struct incode_front *front, const uint32_t v[4],
                       const double *const p[4])
{
    front->counts.seeds++;
    for (int i = 0; i < 3; i++)
        incode_front_reached(front, v[i]);
    build_alone(front, v, p, false);
}
