/* Why the check suffices.
 *
 * Add up the boundaries of all tetrahedra, each facet seen from outside.  What
 * does not cancel is the boundary of the whole, as a chain.  If all tetrahedra
 * are positive, the number of them that cover a place (on no facet) is the
 * number of times that this boundary winds round the place.  If it is one
 * closed surface, convex at every edge and wound once, it bounds a convex body,
 * winds once round every place inside and not at all round one outside.  So the
 * tetrahedra tile that body.  As none overlaps another, each facet inside has
 * one tetrahedron on either side: they meet facet to facet.  Every point is a
 * vertex, so the body is the convex hull of the points.
 *
 * A tiling whose every inner facet has no vertex of one side inside the sphere
 * of the other is the Delaunay triangulation (Delaunay 1934): lifted, it is a
 * surface convex at each facet.  With the tie rule the lifted points are in
 * general position, and it is the only one. */
#include "check.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/adjacency.h"
#include "judge.h"
#include "parts.h"

enum { NAMED_MAX = 8 }; /* faults in the report's text */

/* --- Faults --------------------------------------------------------------- */

static bool make_fault_room(struct check *c) {
    uint64_t room = c->faults_room + c->faults_room / 2 + NAMED_MAX;
    struct check_fault *grown =
        realloc(c->fault, (size_t)room * sizeof *c->fault);
    if (grown == NULL) {
        host_fail_memory(c->error, "the faults");
        return false;
    }
    c->fault = grown;
    c->faults_room = room;
    return true;
}

void check_fault(struct check *c, const char *subject, const char *what,
                 const uint64_t *tets, int tet_count, const uint32_t *vertices,
                 int count) {
    struct check_fault f = {.subject = subject, .what = what};
    f.tets = (uint8_t)tet_count;
    f.vertices = (uint8_t)count;
    for (int i = 0; i < tet_count; i++)
        f.tet[i] = tets[i];
    for (int i = 0; i < count; i++)
        f.vertex[i] = vertices[i];
    (void)pthread_mutex_lock(&c->lock);
    c->report->faults++;
    /* Half of the slots are kept for faults at facets, which say more than
     * points without a tetrahedron. */
    uint64_t most = tet_count == 0 ? (c->faults_max + 1) / 2 : c->faults_max;
    if (c->faults_kept < most &&
        (c->faults_kept < c->faults_room || make_fault_room(c)))
        c->fault[c->faults_kept++] = f;
    (void)pthread_mutex_unlock(&c->lock);
}

/* Notes an error, unless there is one. */
static void check_fail(struct check *c, const struct host_error *error) {
    (void)pthread_mutex_lock(&c->lock);
    if (error->code != 0 && c->error->code == 0)
        *c->error = *error;
    (void)pthread_mutex_unlock(&c->lock);
}

/* The row of the input that a vertex stands for. */
static unsigned row_of(const struct check *c, uint32_t vertex) {
    const struct host_order *order = c->sites->order;
    return order == NULL || vertex >= c->sites->count ? vertex
                                                      : order->row[vertex];
}

static void add_line(const struct check *c, const struct check_fault *f) {
    char *text = c->report->text;
    size_t used = strlen(text), room = sizeof c->report->text;
    used += (size_t)snprintf(text + used, room - used, "%s", f->subject);
    for (int i = 0; i < f->vertices; i++) {
        used += (size_t)snprintf(text + used, room - used, "%s%u",
                                 i == 0 ? " (" : " ", row_of(c, f->vertex[i]));
    }
    (void)snprintf(text + used, room - used, "%s%s\n",
                   f->vertices > 0 ? ") " : " ", f->what);
}

static void deliver(const struct check *c,
                    const struct host_check_listener *listener) {
    static_assert(sizeof c->report->text / NAMED_MAX >= 160,
                  "a line has a subject, five numbers, and what is wrong");
    for (uint64_t i = 0; i < c->faults_kept; i++) {
        const struct check_fault *f = &c->fault[i];
        if (i < NAMED_MAX)
            add_line(c, f);
        if (listener != NULL && i < listener->faults_max) {
            listener->fault(listener->context, f->tet, f->tets, f->vertex,
                            f->vertices, f->what);
        }
    }
}

static void verdict(const struct check *c) {
    const struct host_check_report *r = c->report;
    if (c->error->code == 0 && r->faults > 0) {
        int length = (int)strcspn(r->text, "\n");
        host_fail(c->error, HOST_UNVERIFIED,
                  "verify: %llu fault%s, the first: %.*s; this is not the "
                  "Delaunay triangulation of these points, make it again",
                  (unsigned long long)r->faults, r->faults == 1 ? "" : "s",
                  length, r->text);
    }
}

/* --- The boundary --------------------------------------------------------- */

static void hull_fault(void *context, const uint64_t *tets, int tet_count,
                       const uint32_t *vertices, int count, const char *what) {
    static const char *const subject[] = {"hull:", "point", "edge", "facet"};
    check_fault(context, subject[count], what, tets, tet_count, vertices,
                count);
}

struct beyond {
    struct check *c;
    struct host_judge judge;
};

/* A facet of the boundary with a point beyond it is not on the hull: a
 * tetrahedron there is missing or wrong. */
static void find_beyond(void *context, unsigned number) {
    (void)number;
    struct beyond *b = context;
    struct check *c = b->c;
    enum { TURN = 16 };
    uint64_t i;
    while ((i = check_take(c, TURN, c->hull.count)) < c->hull.count) {
        uint64_t end = check_end(i, TURN, c->hull.count);
        for (; i < end; i++) {
            const struct host_hull_facet *f = &c->hull.facet[i];
            uint32_t v[3];
            host_call_trim((size_t)4 * HOST_CALL_AROUND);
            host_facet_outward(c->tets->v[f->tet], f->corner, v);
            if (host_judge_beyond(&b->judge, v)) {
                check_fault(c, "facet",
                            "has one tetrahedron, and points on the other side",
                            &f->tet, 1, v, 3);
            }
        }
    }
}

static int check_boundary(struct check *c) {
    struct host_hull_listener listener = {c, hull_fault};
    struct beyond b = {.c = c};
    uint64_t before = c->report->faults;
    if (host_hull_check(&c->hull, &listener, c->error) != 0)
        return c->error->code;
    c->report->hull_facets = c->hull.count;
    c->report->hull_vertices = c->hull.vertices;
    if (c->report->faults == before && !c->any_unused)
        return 0;
    if (host_judge_make(&b.judge, c->sites, c->error) == 0) {
        c->next = 0;
        host_fork_all(host_threads(), find_beyond, &b);
        host_judge_free(&b.judge);
    }
    return c->error->code;
}

/* --- All together --------------------------------------------------------- */

/* Ranges of whole words of `bad`, whose entries have 32 bits. */
static int cut_parts(struct check *c) {
    uint64_t count = c->tets->count, words = count / 64 + 1;
    unsigned threads = host_threads();
    c->parts = threads < CHECK_THREADS_MAX ? threads : CHECK_THREADS_MAX;
    while (c->parts < CHECK_PARTS_MAX && count / c->parts >= 1u << 30)
        c->parts++;
    if (count / c->parts >= 1u << 30) {
        return host_fail(c->error, HOST_BROKEN,
                         "verify: %llu tetrahedra cannot be checked, 2^34 at "
                         "most; take fewer points",
                         (unsigned long long)count);
    }
    for (unsigned i = 0; i < c->parts; i++) {
        uint64_t first = words * i / c->parts * 64;
        uint64_t last = words * (i + 1) / c->parts * 64;
        c->part[i].first = first < count ? first : count;
        c->part[i].last = last < count ? last : count;
    }
    return 0;
}

static int check_twins(struct check *c);

static int check_all(struct check *c) {
    if (getrandom(c->key, sizeof c->key, 0) != (ssize_t)sizeof c->key) {
        return host_fail(c->error, HOST_BROKEN,
                         "verify: the system gives no random numbers; look "
                         "into getrandom(2)");
    }
    if (cut_parts(c) != 0 || check_sums(c) != 0 || check_twins(c) != 0)
        return c->error->code;
    return check_boundary(c);
}

int host_check(const struct host_sites *sites,
               const struct host_tetrahedra *tets, enum host_check_depth depth,
               const struct host_check_listener *listener,
               struct host_check_report *report, struct host_error *error) {
    struct check c = {.sites = sites,
                      .tets = tets,
                      .depth = depth,
                      .report = report,
                      .error = error,
                      .faults_max = NAMED_MAX,
                      .hull = {.sites = sites, .tets = tets}};
    *report = (struct host_check_report){.points = sites->count,
                                         .tetrahedra = tets->count};
    if (listener != NULL && listener->faults_max > NAMED_MAX)
        c.faults_max = listener->faults_max;
    (void)pthread_mutex_init(&c.lock, NULL);
    check_all(&c);
    deliver(&c, listener);
    verdict(&c);
    for (unsigned i = 0; i < c.parts; i++) {
        host_unmap(c.part[i].list, (size_t)(c.part[i].last - c.part[i].first) *
                                       sizeof *c.part[i].list);
    }
    host_unmap(c.hot, (size_t)sites->count);
    host_unmap(c.bad, ((size_t)tets->count / 64 + 1) * sizeof *c.bad);
    host_hull_free(&c.hull);
    free(c.fault);
    (void)pthread_mutex_destroy(&c.lock);
    return error->code;
}

/* Facets in pairs.  A facet is found at its lowest vertex: each part of the
 * tetrahedra lists them by their lowest and by their second vertex, as all
 * facets of a tetrahedron but one have its lowest vertex.  At a vertex, a small
 * hash table holds the facets that wait for their twin.
 *
 * Without a fault every facet has a tetrahedron on either side, or on one side
 * only: then it belongs to the boundary. */

enum { BATCH = 64, TABLE_MIN = 64 };

/* Bytes that so many tetrahedra touch.  Where vertices lie in no order, each
 * has pages of its own. */
static size_t touched(const struct check *c, size_t tets) {
    return tets * (c->sites->order != NULL ? 1 << 10 : 12 << 10);
}

/* --- The lists ------------------------------------------------------------ */

static uint64_t size_of(const struct check_part *part) {
    return part->list == NULL ? part->last - part->first : part->listed;
}

static uint32_t tet_of(const struct check_part *part, uint64_t i) {
    return part->list == NULL ? (uint32_t)i : part->list[i];
}

/* Counts, then fills: end[v + 1] becomes the first entry of v and, as it is
 * filled, the end of the entries. */
static void list_entries(void *context, unsigned number) {
    struct check *c = context;
    struct check_part *part = &c->part[number];
    const uint32_t(*v)[4] = (const uint32_t(*)[4])c->tets->v + part->first;
    uint64_t n = size_of(part), count = c->sites->count;
    uint32_t *next = part->end + 1, sum = 0;
    for (int fill = 0; fill < 2; fill++) {
        for (uint64_t i = 0; i < n; i++) {
            uint32_t tet = tet_of(part, i), low[2];
            if (i % BATCH == 0)
                host_call_trim(touched(c, BATCH));
            if (check_is_bad(c, part->first + tet))
                continue;
            check_lowest_two(v[tet], low);
            if (fill == 0) {
                next[low[0]]++;
                next[low[1]]++;
            } else {
                part->entry[next[low[0]]++] = tet;
                part->entry[next[low[1]]++] = tet;
            }
        }
        for (uint64_t i = 0; i < count && fill == 0; i++) {
            uint32_t here = next[i];
            if (i % BATCH == 0)
                host_call_trim(BATCH * sizeof *next);
            next[i] = sum;
            sum += here;
        }
    }
}

/* --- Spheres -------------------------------------------------------------- */

/* Pairs of tetrahedra: the apex of the second and the sphere of the first. */
struct spheres {
    uint32_t n;
    uint64_t tet[BATCH][2];
    uint32_t vertex[BATCH][5];
    double p[5][3][BATCH];
    int64_t sure[BATCH];
};

static inline double magnitude(double a) {
    return a < 0 ? -a : a;
}

static inline double larger(double a, double b) {
    return a > b ? a : b;
}

/* sure[i]: not 0 where the apex is outside by the static filter of
 * incode_in_sphere. */
static void filter_spheres(struct spheres *s) {
    for (uint32_t i = 0; i < BATCH; i++) {
        double d[4][3], m[3], w[4];
        for (int k = 0; k < 3; k++) {
            for (int j = 0; j < 4; j++)
                d[j][k] = s->p[j][k][i] - s->p[4][k][i];
            m[k] = larger(larger(magnitude(d[0][k]), magnitude(d[1][k])),
                          larger(magnitude(d[2][k]), magnitude(d[3][k])));
        }
        for (int j = 0; j < 4; j++)
            w[j] = d[j][0] * d[j][0] + d[j][1] * d[j][1] + d[j][2] * d[j][2];
        double ab = d[0][0] * d[1][1] - d[1][0] * d[0][1];
        double ac = d[0][0] * d[2][1] - d[2][0] * d[0][1];
        double ad = d[0][0] * d[3][1] - d[3][0] * d[0][1];
        double bc = d[1][0] * d[2][1] - d[2][0] * d[1][1];
        double bd = d[1][0] * d[3][1] - d[3][0] * d[1][1];
        double cd = d[2][0] * d[3][1] - d[3][0] * d[2][1];
        double abc = ab * d[2][2] - ac * d[1][2] + bc * d[0][2];
        double abd = ab * d[3][2] - ad * d[1][2] + bd * d[0][2];
        double acd = ac * d[3][2] - ad * d[2][2] + cd * d[0][2];
        double bcd = bc * d[3][2] - bd * d[2][2] + cd * d[1][2];
        double det = w[0] * bcd - w[1] * acd + (w[2] * abd - w[3] * abc);
        double most = larger(m[0], larger(m[1], m[2]));
        double least = m[0] < m[1] ? m[0] : m[1];
        least = least < m[2] ? least : m[2];
        s->sure[i] =
            (least > INCODE_IN_SPHERE_LEAST) & (most < INCODE_IN_SPHERE_MOST) &
            (det <
             -(INCODE_IN_SPHERE_BOUND * m[0] * m[1] * m[2] * (most * most)));
    }
}

static void check_spheres(struct check *c, struct spheres *s,
                          struct incode_tally *tally) {
    for (uint32_t i = 0; i < s->n; i++) {
        for (int k = 0; k < 5; k++) {
            double xyz[3];
            host_site(c->sites, s->vertex[i][k], xyz);
            s->p[k][0][i] = xyz[0];
            s->p[k][1][i] = xyz[1];
            s->p[k][2][i] = xyz[2];
        }
    }
    filter_spheres(s);
    for (uint32_t i = 0; i < s->n; i++) {
        double p[5][3];
        if (s->sure[i] != 0)
            continue;
        for (int k = 0; k < 5; k++)
            host_site(c->sites, s->vertex[i][k], p[k]);
        if (incode_in_sphere(tally, p[0], p[1], p[2], p[3], p[4]) > 0) {
            check_fault(c, "tetrahedron and point",
                        "are not Delaunay: the point lies in the sphere",
                        s->tet[i], 2, s->vertex[i], 5);
        }
    }
    s->n = 0;
}

/* --- Facets of a vertex --------------------------------------------------- */

/* A facet that waits: its other vertices, ascending; tetrahedron, corner
 * opposite, side.  PAIRED once its twin was there. */
struct slot {
    uint64_t others, facet;
};

#define PAIRED UINT64_MAX

struct walk {
    struct check *c;
    struct slot *slot; /* others == 0: free */
    size_t capacity;   /* a power of two */
    size_t mask;       /* of the slots in use at this vertex */
    struct spheres spheres;
    struct incode_tally tally;
    struct host_error error;
};

static uint64_t pack(uint64_t tet, uint32_t corner, uint32_t side) {
    return tet << 3 | corner << 1 | side;
}

/* Reports a facet that belongs to two tetrahedra on one side, or to more than
 * two. */
static void facet_fault(struct walk *w, uint64_t facet, uint64_t other,
                        const char *what) {
    const uint32_t(*v)[4] = (const uint32_t(*)[4])w->c->tets->v;
    uint64_t tets[2] = {facet >> 3, other >> 3};
    uint32_t p[3];
    host_facet_outward(v[tets[0]], (uint32_t)(facet >> 1 & 3), p);
    check_fault(w->c, "facet", what, tets, other == PAIRED ? 1 : 2, p, 3);
}

static void pair(struct walk *w, uint64_t facet, uint64_t twin) {
    struct spheres *s = &w->spheres;
    const uint32_t(*v)[4] = (const uint32_t(*)[4])w->c->tets->v;
    if (w->c->depth != HOST_CHECK_DELAUNAY)
        return;
    s->tet[s->n][0] = facet >> 3;
    s->tet[s->n][1] = twin >> 3;
    memcpy(s->vertex[s->n], v[facet >> 3], sizeof *v);
    s->vertex[s->n][4] = v[twin >> 3][twin >> 1 & 3];
    if (++s->n == BATCH)
        check_spheres(w->c, s, &w->tally);
}

static void add_facet(struct walk *w, uint32_t x, uint32_t y, uint64_t tet,
                      uint32_t corner) {
    uint64_t others = x < y ? (uint64_t)x << 32 | y : (uint64_t)y << 32 | x;
    uint64_t facet = pack(tet, corner, x < y);
    size_t i = (size_t)((others * UINT64_C(0x9e3779b97f4a7c15)) >> 32);
    i &= w->mask;
    while (w->slot[i].others != others && w->slot[i].others != 0)
        i = (i + 1) & w->mask;
    struct slot *slot = &w->slot[i];
    if (slot->others == 0) {
        *slot = (struct slot){others, facet};
    } else if (slot->facet == PAIRED) {
        facet_fault(w, facet, PAIRED, "belongs to more than two tetrahedra");
    } else if (((slot->facet ^ facet) & 1) == 0) {
        facet_fault(w, facet, slot->facet,
                    "has both its tetrahedra on one side");
    } else {
        pair(w, slot->facet, facet);
        slot->facet = PAIRED;
    }
}

/* Adds the facets of a tetrahedron whose lowest vertex is p: three, or one
 * where p is its second vertex. */
static void add_tetrahedron(struct walk *w, uint32_t p, uint64_t tet) {
    /* [corner opposite][index of p]: the others, in order seen from outside */
    static const uint8_t after[4][4][2] = {{{0, 0}, {2, 3}, {3, 1}, {1, 2}},
                                           {{3, 2}, {0, 0}, {0, 3}, {2, 0}},
                                           {{1, 3}, {3, 0}, {0, 0}, {0, 1}},
                                           {{2, 1}, {0, 2}, {1, 0}, {0, 0}}};
    const uint32_t *t = w->c->tets->v[tet];
    int place = 0, least = -1;
    for (int k = 0; k < 4; k++) {
        place = t[k] == p ? k : place;
        least = t[k] < p ? k : least;
    }
    for (int k = 0; k < 4; k++) {
        if (k == place || (least >= 0 && k != least))
            continue;
        add_facet(w, t[after[k][place][0]], t[after[k][place][1]], tet,
                  (uint32_t)k);
    }
}

static void free_slots(struct walk *w) {
    host_unmap(w->slot, w->capacity * sizeof *w->slot);
    w->slot = NULL;
}

/* Room for twice as many facets as there may be, all slots free. */
static int clear_slots(struct walk *w, size_t tets) {
    size_t wanted = TABLE_MIN;
    while (wanted < 6 * tets)
        wanted *= 2;
    if (wanted > w->capacity) {
        free_slots(w);
        w->slot = host_map(wanted * sizeof *w->slot);
        w->capacity = w->slot == NULL ? 0 : wanted;
        if (w->slot == NULL)
            return host_fail_memory(&w->error, "the facets at a vertex");
    }
    for (size_t i = 0; i < wanted; i += TABLE_MIN) {
        memset(w->slot + i, 0, TABLE_MIN * sizeof *w->slot);
        host_call_trim(TABLE_MIN * sizeof *w->slot);
    }
    w->mask = wanted - 1;
    return 0;
}

/* The facets without a twin belong to the boundary. */
static void keep_open(struct walk *w) {
    struct check *c = w->c;
    for (size_t i = 0; i <= w->mask; i++) {
        host_call_trim(sizeof *w->slot);
        if (w->slot[i].others != 0 && w->slot[i].facet != PAIRED) {
            uint64_t facet = w->slot[i].facet;
            (void)pthread_mutex_lock(&c->lock);
            host_hull_add(&c->hull, facet >> 3, (uint32_t)(facet >> 1 & 3),
                          &w->error);
            (void)pthread_mutex_unlock(&c->lock);
        }
    }
}

static void walk_vertex(struct walk *w, uint32_t p) {
    struct check *c = w->c;
    size_t tets = 0;
    if (c->depth == HOST_CHECK_TILING && c->hot[p] == 0)
        return; /* most */
    for (unsigned i = 0; i < c->parts; i++)
        tets += c->part[i].end[(size_t)p + 1] - c->part[i].end[p];
    if (tets == 0 || clear_slots(w, tets) != 0)
        return;
    bool hub = w->mask * sizeof *w->slot > HOST_CALL_AROUND;
    size_t each = touched(c, 1) + (hub ? (size_t)3 * HOST_CALL_AROUND : 0);
    for (unsigned i = 0; i < c->parts; i++) {
        const struct check_part *part = &c->part[i];
        for (uint32_t e = part->end[p]; e < part->end[(size_t)p + 1]; e++) {
            host_call_trim(each);
            add_tetrahedron(w, p, part->first + part->entry[e]);
        }
    }
    keep_open(w);
}

static void walk_vertices(void *context, unsigned number) {
    (void)number;
    struct check *c = context;
    struct walk w = {.c = c};
    uint64_t count = c->sites->count, i;
    while ((i = check_take(c, CHECK_VERTICES, count)) < count) {
        uint64_t end = check_end(i, CHECK_VERTICES, count);
        host_call_trim(CHECK_VERTICES * (c->parts + 1) * sizeof(uint32_t));
        for (; i < end && w.error.code == 0; i++)
            walk_vertex(&w, (uint32_t)i);
    }
    check_spheres(c, &w.spheres, &w.tally);
    free_slots(&w);
    check_fail(c, &w.error);
}

/* --- All together --------------------------------------------------------- */

/* twins.c: pairs the facets of all tetrahedra, or of those that are listed, and
 * adds the facets without a twin to the hull. */
static int check_twins(struct check *c) {
    size_t bytes = ((size_t)c->sites->count + 1) * sizeof(uint32_t);
    bool enough = true;
    for (unsigned i = 0; i < c->parts; i++) {
        struct check_part *part = &c->part[i];
        c->report->paired += size_of(part);
        part->end = host_map(bytes);
        part->entry = host_map(2 * (size_t)size_of(part) * sizeof *part->entry);
        enough = enough && part->end != NULL && part->entry != NULL;
    }
    if (enough) {
        host_fork_all(c->parts, list_entries, c);
        c->next = 0;
        host_fork_all(host_threads(), walk_vertices, c);
    } else {
        host_fail_memory(c->error, "the neighbours of the tetrahedra");
    }
    for (unsigned i = 0; i < c->parts; i++) {
        struct check_part *part = &c->part[i];
        host_unmap(part->end, bytes);
        host_unmap(part->entry,
                   2 * (size_t)size_of(part) * sizeof *part->entry);
    }
    return c->error->code;
}
