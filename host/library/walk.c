#include "walk.h"

#include <math.h>
#include <string.h>

#include "host/base/memory.h"

enum {
    LANES = 16,       /* walks at a time, whose loads from memory overlap */
    LANE_QUERIES = 8, /* fewer are not worth another lane */
    POLL_STEPS = 4096,
    SAMPLE = 4, /* times the cube root of the tetrahedra */
    FACETS = 4,
    NOWHERE = 4 /* no facet */
};

/* --- one tetrahedron ------------------------------------------------------ */

static inline void cross(const double a[3], const double b[3], double n[3]) {
    n[0] = a[1] * b[2] - a[2] * b[1];
    n[1] = a[2] * b[0] - a[0] * b[2];
    n[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double larger(double a, double b) {
    return a > b ? a : b;
}

static inline double smaller(double a, double b) {
    return a < b ? a : b;
}

/* The six-fold volumes of the tetrahedron with q in the place of each vertex,
 * rounded; returns the most that each may be wrong by.
 *
 * Each is a sum of six products of three differences, with 8 roundings on the
 * way of each, so it is wrong by at most 48 roundings, of second order apart,
 * of the product of the largest differences.  The limits of the filters of
 * orient3d keep overflow and underflow away. */
static inline double volumes(const double *const v[4], const double q[3],
                             double volume[4]) {
    double d[4][3], most[3] = {0, 0, 0}, m[3], n[3];
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 3; k++) {
            d[i][k] = v[i][k] - q[k];
            most[k] = larger(most[k], fabs(d[i][k]));
        }
    }
    cross(d[0], d[1], m);
    cross(d[2], d[3], n);
    volume[0] = dot(d[1], n);
    volume[1] = -dot(d[0], n);
    volume[2] = dot(d[3], m);
    volume[3] = -dot(d[2], m);
    double lower = smaller(most[0], smaller(most[1], most[2]));
    double upper = larger(most[0], larger(most[1], most[2]));
    return lower > INCODE_ORIENT3D_LEAST && upper < INCODE_ORIENT3D_MOST
               ? 64 * 0x1p-53 * most[0] * most[1] * most[2]
               : INFINITY;
}

static bool is_same(const double a[3], const double b[3]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* NOWHERE, or the facet to leave through, where the filter is not sure.  Bit i
 * of *zeros: the query is on the plane of facet i. */
static unsigned leave_exactly(struct incode_tally *tally,
                              const double *const v[4], const double q[3],
                              const double volume[4], double bound,
                              unsigned *zeros) {
    *zeros = 0;
    for (unsigned i = 0; i < FACETS; i++) {
        if (is_same(v[i], q)) {
            *zeros = 15U & ~(1U << i);
            return NOWHERE;
        }
    }
    for (unsigned i = 0; i < FACETS; i++) {
        if (volume[i] > bound)
            continue;
        const double *p[4] = {v[0], v[1], v[2], v[3]};
        p[i] = q;
        int sign = incode_orient3d(tally, p[0], p[1], p[2], p[3]);
        if (sign < 0)
            return i;
        *zeros |= sign == 0 ? 1U << i : 0;
    }
    return NOWHERE;
}

/* Of several facets, that of the largest volume beyond it. */
static inline unsigned leave_through(struct incode_tally *tally,
                                     const double *const v[4],
                                     const double q[3], unsigned *zeros) {
    double volume[4], bound = volumes(v, q, volume);
    unsigned a = volume[1] < volume[0] ? 1 : 0;
    unsigned b = volume[3] < volume[2] ? 3 : 2;
    unsigned least = volume[b] < volume[a] ? b : a;
    *zeros = 0;
    if (volume[least] < -bound)
        return least;
    if (volume[least] > bound)
        return NOWHERE;
    return leave_exactly(tally, v, q, volume, bound, zeros);
}

/* --- stars ---------------------------------------------------------------- */

/* Where vertex p stands in a tetrahedron; 4: nowhere. */
static unsigned place_of(const uint32_t v[4], uint32_t p) {
    unsigned i = 0;
    while (i < 4 && v[i] != p)
        i++;
    return i;
}

enum turned { TURNED_ROUND, TURNED_TO_HULL, TURNED_WRONG };

/* Goes round the edge that facets i and `other` of `tet` have in common, out
 * through facet i.  Lowers *lowest, and counts in *size.  TURNED_WRONG: the
 * result is damaged. */
static enum turned turn(const struct library_mesh *mesh, uint64_t tet,
                        unsigned i, unsigned other, uint64_t *lowest,
                        uint64_t *size) {
    const struct incode_tetrahedra *t = mesh->t;
    unsigned a = 0, sum = 6 - i - other; /* of the places of both ends */
    while (a == i || a == other)
        a++;
    uint32_t ends[2] = {t->vertex[tet][a], t->vertex[tet][sum - a]};
    uint32_t common = t->vertex[tet][other];
    uint64_t at = tet;
    while ((at = t->neighbor[at][i]) != INCODE_NONE64 && at != tet) {
        if (at >= t->count || ++*size > t->count)
            return TURNED_WRONG;
        *lowest = at < *lowest ? at : *lowest;
        const uint32_t *v = t->vertex[at];
        unsigned p = place_of(v, ends[0]), q = place_of(v, ends[1]);
        i = place_of(v, common);
        if (p == 4 || q == 4 || i == 4 || p + q + i < 3 || p + q + i > 6)
            return TURNED_WRONG;
        common = v[6 - p - q - i];
    }
    return at == tet ? TURNED_ROUND : TURNED_TO_HULL;
}

/* The slot of a tetrahedron in the table, which has a free one. */
static uint32_t *slot_of(struct library_walker *w, uint32_t tet) {
    uint64_t mask = 2 * w->room - 1;
    uint64_t i = tet * UINT64_C(0x9e3779b97f4a7c15) >> 32 & mask;
    while (w->table[i] != 0 && w->table[i] != tet + 1)
        i = (i + 1) & mask;
    return &w->table[i];
}

/* Frees the table of the first `count` of the list. */
static void clear(struct library_walker *w, uint64_t count) {
    if (count > w->room / 4) {
        memset(w->table, 0, 2 * w->room * sizeof *w->table);
        return;
    }
    /* From the last on, so that what is left is where it is looked for. */
    while (count > 0)
        *slot_of(w, w->list[--count]) = 0;
}

static void free_list(struct library_walker *w) {
    if (w->list != w->own)
        host_unmap(w->list, 3 * w->room * sizeof *w->list);
}

/* The list stays, and the table comes behind the room that it has then. */
static bool grow(struct library_walker *w, uint64_t count) {
    uint64_t room = 2 * w->room;
    bool is_own = w->list == w->own;
    uint32_t *list =
        host_remap(is_own ? NULL : w->list, 3 * w->room * sizeof *list,
                   3 * room * sizeof *list);
    if (list == NULL)
        return false;
    if (is_own)
        memcpy(list, w->own, count * sizeof *list);
    else
        memset(list + count, 0, (3 * w->room - count) * sizeof *list);
    w->list = list;
    w->table = list + room;
    w->room = room;
    for (uint64_t i = 0; i < count; i++)
        *slot_of(w, list[i]) = list[i] + 1;
    return true;
}

/* Gathers the tetrahedra at vertex p from one of them. */
static enum incode_status gather(struct library_walker *w,
                                 const struct library_mesh *mesh, uint64_t tet,
                                 uint32_t p, uint64_t *lowest, uint64_t *size) {
    const struct incode_tetrahedra *t = mesh->t;
    enum incode_status status = INCODE_OK;
    uint64_t count = 0;
    w->list[count++] = (uint32_t)tet;
    *slot_of(w, (uint32_t)tet) = (uint32_t)tet + 1;
    for (uint64_t i = 0; i < count && status == INCODE_OK; i++) {
        uint64_t at = w->list[i];
        unsigned place = place_of(t->vertex[at], p);
        *lowest = at < *lowest ? at : *lowest;
        if (place == 4)
            status = INCODE_BAD_ARGUMENT;
        for (unsigned k = 0; k < FACETS && status == INCODE_OK; k++) {
            uint64_t next = t->neighbor[at][k];
            if (k == place || next == INCODE_NONE64)
                continue;
            if (next >= t->count) {
                status = INCODE_BAD_ARGUMENT;
                continue;
            }
            uint32_t *slot = slot_of(w, (uint32_t)next);
            if (*slot != 0)
                continue;
            if (count == w->room) {
                if (!grow(w, count)) {
                    status = INCODE_NO_MEMORY;
                    continue;
                }
                slot = slot_of(w, (uint32_t)next);
            }
            *slot = (uint32_t)next + 1;
            w->list[count++] = (uint32_t)next;
        }
    }
    clear(w, count);
    *size = count;
    return status;
}

/* The lowest of the tetrahedra that contain a query on the planes `zeros` of
 * `tet`, which contains it. */
static enum incode_status lowest_of(struct library_walker *w,
                                    const struct library_mesh *mesh,
                                    uint64_t tet, unsigned zeros,
                                    uint64_t *lowest) {
    const uint32_t *v = mesh->t->vertex[tet];
    unsigned count = (unsigned)__builtin_popcount(zeros);
    *lowest = tet;
    if (count == 1) {
        uint64_t next = mesh->t->neighbor[tet][__builtin_ctz(zeros)];
        *lowest = next < tet ? next : tet;
    }
    if (count <= 1)
        return INCODE_OK;
    if (count == FACETS) /* flat */
        return INCODE_BAD_ARGUMENT;
    unsigned i = (unsigned)__builtin_ctz(~zeros);
    unsigned j = 31 - (unsigned)__builtin_clz(~zeros & 15U);
    uint32_t a = v[i] < v[j] ? v[i] : v[j], b = v[i] < v[j] ? v[j] : v[i];
    uint64_t key = ((uint64_t)b << 32 | a) + 1, size = 0;
    uint64_t hash = key * UINT64_C(0x9e3779b97f4a7c15) >> 58;
    if (w->star[hash].key == key) {
        *lowest = w->star[hash].lowest;
        return INCODE_OK;
    }
    enum incode_status status = INCODE_OK;
    if (count == 3) {
        status = gather(w, mesh, tet, v[i], lowest, &size);
    } else {
        unsigned p = (unsigned)__builtin_ctz(zeros);
        unsigned q = 31 - (unsigned)__builtin_clz(zeros);
        enum turned turned = turn(mesh, tet, p, q, lowest, &size);
        if (turned == TURNED_TO_HULL)
            turned = turn(mesh, tet, q, p, lowest, &size);
        status = turned == TURNED_WRONG ? INCODE_BAD_ARGUMENT : INCODE_OK;
    }
    if (status == INCODE_OK && size >= LIBRARY_STAR_FIRST) {
        w->star[hash].key = key;
        w->star[hash].lowest = *lowest;
    }
    return status;
}

/* --- walks ---------------------------------------------------------------- */

/* One walk after the other, over some of the queries. */
struct lane {
    const struct library_query *query, *end;
    uint64_t tet, steps;
    bool has_vertices; /* their coordinates are on their way */
    bool is_far;       /* the query, from the tetrahedron */
    bool are_sparse;   /* its queries: all are far from each other */
};

static void ask_for(const struct library_mesh *mesh, uint64_t tet) {
    __builtin_prefetch(mesh->t->vertex[tet]);
    __builtin_prefetch(mesh->t->neighbor[tet]);
}

/* So many tetrahedra, spread over the list, are worth a look before a walk. */
static uint64_t sample_of(const struct library_mesh *mesh) {
    return 8 + (uint64_t)(SAMPLE * cbrt((double)mesh->t->count));
}

/* Goes to the nearest of a sample, or stays (Muecke, Saias and Zhu,
 * Computational Geometry 12:63-83, 1999). */
static bool jump(const struct library_mesh *mesh, struct lane *lane) {
    const struct incode_tetrahedra *t = mesh->t;
    uint64_t sample = sample_of(mesh), best_tet = lane->tet;
    double best = INFINITY;
    for (uint64_t i = 0; i <= sample; i++) {
        uint64_t tet =
            i == sample ? lane->tet : (2 * i + 1) * (t->count / (2 * sample));
        if (tet >= t->count)
            continue;
        if (t->vertex[tet][1] >= mesh->points)
            return false;
        const double *p = mesh->xyz + 3 * (uint64_t)t->vertex[tet][1];
        double d[3] = {p[0] - lane->query->at[0], p[1] - lane->query->at[1],
                       p[2] - lane->query->at[2]};
        double distance = dot(d, d);
        if (distance < best) {
            best = distance;
            best_tet = tet;
        }
    }
    lane->tet = best_tet;
    lane->is_far = lane->has_vertices = false;
    ask_for(mesh, lane->tet);
    return true;
}

/* Asks for what the next step needs: half a step. */
static bool fetch(const struct library_mesh *mesh, struct lane *lane) {
    const uint32_t *v = mesh->t->vertex[lane->tet];
    for (int i = 0; i < 4; i++) {
        if (v[i] >= mesh->points)
            return false;
        const double *p = mesh->xyz + 3 * (uint64_t)v[i];
        __builtin_prefetch(p);
        __builtin_prefetch(p + 2);
    }
    lane->has_vertices = true;
    return true;
}

/* Goes on to the next tetrahedron, or writes the answer. */
static enum incode_status step(struct library_walker *w,
                               const struct library_mesh *mesh,
                               struct lane *lane, uint64_t *found) {
    const struct incode_tetrahedra *t = mesh->t;
    const uint32_t *v = t->vertex[lane->tet];
    const double *corner[4];
    unsigned zeros;
    for (int i = 0; i < 4; i++)
        corner[i] = mesh->xyz + 3 * (uint64_t)v[i];
    unsigned facet = leave_through(&w->tally, corner, lane->query->at, &zeros);
    if (facet != NOWHERE) {
        uint64_t next = t->neighbor[lane->tet][facet];
        if (next < t->count && lane->steps++ < t->count) {
            lane->tet = next;
            lane->has_vertices = false;
            ask_for(mesh, next);
            return INCODE_OK;
        }
        if (next != INCODE_NONE64)
            return INCODE_BAD_ARGUMENT;
        found[lane->query->number] = INCODE_NONE64;
    } else {
        enum incode_status status =
            lowest_of(w, mesh, lane->tet, zeros, &found[lane->query->number]);
        if (status != INCODE_OK)
            return status;
    }
    lane->query++;
    lane->steps = 0;
    lane->is_far = lane->are_sparse;
    return INCODE_OK;
}

enum incode_status library_walk(struct library_walker *w,
                                const struct library_mesh *mesh,
                                const struct library_query *query,
                                uint64_t count, uint64_t *found) {
    struct lane lane[LANES];
    bool are_sparse = count < sample_of(mesh);
    unsigned lanes = (unsigned)(count < (uint64_t)LANES * LANE_QUERIES
                                    ? (count + LANE_QUERIES - 1) / LANE_QUERIES
                                    : LANES);
    for (unsigned i = 0; i < lanes; i++) {
        lane[i] = (struct lane){.query = query + count * i / lanes,
                                .end = query + count * (i + 1) / lanes,
                                .tet = w->last,
                                .is_far = true,
                                .are_sparse = are_sparse};
    }
    enum incode_status status = INCODE_OK;
    for (uint64_t steps = 0; lanes > 0 && status == INCODE_OK; steps++) {
        if (steps % POLL_STEPS == 0 && host_call_cancelled())
            return INCODE_CANCELLED;
        for (unsigned i = 0; i < lanes && status == INCODE_OK; i++) {
            struct lane *l = &lane[i];
            if (l->is_far)
                status = jump(mesh, l) ? INCODE_OK : INCODE_BAD_ARGUMENT;
            else if (!l->has_vertices)
                status = fetch(mesh, l) ? INCODE_OK : INCODE_BAD_ARGUMENT;
            else
                status = step(w, mesh, l, found);
            if (l->query < l->end)
                continue;
            w->last = (uint32_t)l->tet;
            *l = lane[--lanes];
        }
    }
    return status;
}

void library_walker_begin(struct library_walker *w,
                          const struct library_mesh *mesh) {
    memset(w, 0, sizeof *w);
    w->room = LIBRARY_STAR_FIRST;
    w->list = w->own;
    w->table = w->own + LIBRARY_STAR_FIRST;
    w->last = (uint32_t)(mesh->t->count / 2);
}

void library_walker_end(struct library_walker *w) {
    free_list(w);
}
