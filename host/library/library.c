/* The functions of incode.h over the pieces that `incode run` uses, too. */
#include <math.h>
#include <string.h>

#include "call.h"
#include "delaunay.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/mesh/adjacency.h"
#include "host/mesh/duplicates.h"
#include "host/mesh/order.h"
#include "node/version.h"

enum {
    POLL_ROWS = 1 << 16,
    THREAD_POINTS = 6000, /* fewer a thread take longer than on one */
    FORK_ROWS = 1 << 16   /* fewer rows are not worth a thread */
};

/* One call of incode_delaunay. */
struct work {
    struct library_call call;
    const double *xyz;
    uint64_t rows;
    unsigned flags;
    struct incode_tetrahedra *out;
    struct host_order order;
    struct host_tetrahedra tets;
    struct host_error error;
};

/* --- points --------------------------------------------------------------- */

struct scan {
    const double *xyz;
    uint64_t rows;
    unsigned parts;
    uint64_t first[HOST_THREADS_MAX]; /* row that is not finite, or rows */
};

static void scan_part(void *context, unsigned part) {
    struct scan *s = context;
    uint64_t row = s->rows / s->parts * part;
    uint64_t last =
        part + 1 == s->parts ? s->rows : s->rows / s->parts * (part + 1);
    s->first[part] = s->rows;
    while (row < last && !host_call_cancelled()) {
        uint64_t end = last - row > POLL_ROWS ? row + POLL_ROWS : last;
        double sum = 0; /* of zeros, or NaN */
        for (uint64_t i = 3 * row; i < 3 * end; i++)
            sum += s->xyz[i] * 0.0;
        for (; row < end && sum != 0; row++) {
            const double *p = s->xyz + 3 * row;
            if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
                s->first[part] = row;
                return;
            }
        }
        row = end;
    }
}

/* The first row with a coordinate that is not finite; `rows`: none has. */
static uint64_t find_infinite(const double *xyz, uint64_t rows) {
    struct scan s = {.xyz = xyz, .rows = rows};
    s.parts = rows < FORK_ROWS ? 1 : host_threads();
    host_fork_all(s.parts, scan_part, &s);
    for (unsigned i = 0; i < s.parts; i++)
        if (s.first[i] < rows)
            return s.first[i];
    return rows;
}

/* --- what else is wanted -------------------------------------------------- */

/* A share of the facets, by their lowest vertices. */
struct facets {
    uint32_t (*v)[3];
    uint64_t count, capacity;
    bool failed;
};

struct join {
    const struct host_adjacency *adjacency;
    uint64_t (*neighbor)[4]; /* or NULL */
    bool hull;
    unsigned parts;
    struct facets facets[HOST_THREADS_MAX];
};

static void add_facet(struct facets *f, const uint32_t tet[4],
                      uint32_t corner) {
    if (f->count == f->capacity) {
        uint64_t capacity = f->capacity + f->capacity / 2 + 1024;
        void *v = host_remap(f->v, f->capacity * sizeof *f->v,
                             capacity * sizeof *f->v);
        if (v == NULL) {
            f->failed = true;
            return;
        }
        f->v = v;
        f->capacity = capacity;
    }
    uint32_t facet[3];
    host_facet_outward(tet, corner, facet);
    unsigned least = facet[0] < facet[1] ? 0 : 1;
    least = facet[2] < facet[least] ? 2 : least;
    for (unsigned i = 0; i < 3; i++)
        f->v[f->count][i] = facet[(least + i) % 3];
    f->count++;
}

/* Twins stand side by side; what has none is of the hull. */
static void join_group(struct join *j, struct facets *facets,
                       const struct host_group *group) {
    const struct host_facet *f = group->facet;
    for (size_t i = 0; i < group->count; i++) {
        bool twin = i + 1 < group->count && f[i].others == f[i + 1].others;
        if (j->neighbor != NULL) {
            j->neighbor[f[i].tet][f[i].corner] =
                twin ? f[i + 1].tet : INCODE_NONE64;
            if (twin)
                j->neighbor[f[i + 1].tet][f[i + 1].corner] = f[i].tet;
        }
        if (!twin && j->hull)
            add_facet(facets, j->adjacency->tets->v[f[i].tet], f[i].corner);
        i += twin;
    }
}

static void join_part(void *context, unsigned part) {
    struct join *j = context;
    struct facets *facets = &j->facets[part];
    struct host_group group = {0};
    struct host_error error = {0};
    uint64_t vertices = j->adjacency->vertices;
    uint32_t p = (uint32_t)(vertices * part / j->parts);
    uint32_t last = (uint32_t)(vertices * (part + 1) / j->parts);
    for (; p < last && !facets->failed && !host_call_cancelled(); p++)
        if (host_adjacency_group(j->adjacency, p, &group, &error) != 0)
            facets->failed = true;
        else
            join_group(j, facets, &group);
    host_group_free(&group);
}

static bool gather_hull(struct join *j, struct incode_tetrahedra *out) {
    for (unsigned i = 0; i < j->parts; i++)
        out->hull_count += j->facets[i].count;
    out->hull = host_map(out->hull_count * sizeof *out->hull);
    if (out->hull == NULL)
        return false;
    uint64_t done = 0;
    for (unsigned i = 0; i < j->parts; i++) {
        if (j->facets[i].count > 0)
            memcpy(out->hull + done, j->facets[i].v,
                   j->facets[i].count * sizeof *out->hull);
        done += j->facets[i].count;
    }
    return true;
}

static enum incode_status join_facets(struct work *w) {
    struct host_adjacency adjacency;
    enum incode_status status = INCODE_OK;
    w->out->count = w->tets.count; /* which neighbours there are */
    if (w->tets.count >= UINT32_MAX)
        return INCODE_TOO_MANY;
    if (host_adjacency_make(&adjacency, &w->tets, (uint32_t)w->rows,
                            &w->error) != 0)
        return INCODE_NO_MEMORY;
    struct join j = {.adjacency = &adjacency,
                     .hull = (w->flags & INCODE_HULL) != 0,
                     .parts = w->rows < FORK_ROWS ? 1 : host_threads()};
    if ((w->flags & INCODE_NEIGHBORS) != 0) {
        w->out->neighbor = host_map(w->tets.count * sizeof *w->out->neighbor);
        j.neighbor = w->out->neighbor;
    }
    if ((w->flags & INCODE_NEIGHBORS) != 0 && j.neighbor == NULL)
        status = INCODE_NO_MEMORY;
    else
        host_fork_all(j.parts, join_part, &j);
    for (unsigned i = 0; i < j.parts; i++)
        status = j.facets[i].failed ? INCODE_NO_MEMORY : status;
    if (status == INCODE_OK && j.hull && !gather_hull(&j, w->out))
        status = INCODE_NO_MEMORY;
    for (unsigned i = 0; i < j.parts; i++)
        host_unmap(j.facets[i].v, j.facets[i].capacity * sizeof *j.facets[i].v);
    host_adjacency_free(&adjacency);
    return status;
}

static enum incode_status list_duplicates(struct work *w) {
    struct incode_tetrahedra *out = w->out;
    size_t bytes = (size_t)w->rows * sizeof(uint32_t);
    if (w->order.duplicates == 0)
        return INCODE_OK;
    uint32_t *lowest = host_map(bytes);
    out->duplicate = host_map(w->order.duplicates * sizeof *out->duplicate);
    bool enough = lowest != NULL && out->duplicate != NULL &&
                  host_distinct_rows(w->xyz, w->rows, lowest) != 0;
    out->duplicate_count = out->duplicate == NULL ? 0 : w->order.duplicates;
    if (enough && !host_call_cancelled()) {
        uint64_t n = 0;
        for (uint64_t row = 0; row < w->rows; row++) {
            if (lowest[row] != row) {
                out->duplicate[n][0] = (uint32_t)row;
                out->duplicate[n++][1] = lowest[row];
            }
        }
    }
    host_unmap(lowest, bytes);
    return enough ? INCODE_OK : INCODE_NO_MEMORY;
}

/* --- all together --------------------------------------------------------- */

enum incode_status library_order(struct host_order *order, const double *xyz,
                                 uint64_t rows, struct host_error *error) {
    static const enum incode_status status[] = {
        [HOST_ORDER_SOUND] = INCODE_NO_MEMORY,
        [HOST_ORDER_FEW] = INCODE_TOO_FEW,
        [HOST_ORDER_FLAT] = INCODE_FLAT,
        [HOST_ORDER_MANY] = INCODE_TOO_MANY};
    if (rows < 4)
        return INCODE_TOO_FEW;
    return host_order_make(order, "points", xyz, rows, HOST_ADAPTIVE,
                           host_direct_regions(host_threads(), rows), false,
                           error) == 0
               ? INCODE_OK
               : status[order->fault];
}

static enum incode_status make_order(struct work *w) {
    uint64_t row = find_infinite(w->xyz, w->rows);
    if (row < w->rows) {
        w->out->at = row;
        return INCODE_NOT_FINITE;
    }
    return library_order(&w->order, w->xyz, w->rows, &w->error);
}

enum incode_status library_direct(enum host_direct outcome) {
    static const enum incode_status status[] = {
        [HOST_DIRECT_DONE] = INCODE_OK,
        [HOST_DIRECT_CANCELLED] = INCODE_CANCELLED,
        [HOST_DIRECT_MEMORY] = INCODE_NO_MEMORY,
        [HOST_DIRECT_BROKEN] = INCODE_INTERNAL,
        [HOST_DIRECT_UNKEPT] = INCODE_INTERNAL}; /* there is no store */
    return status[outcome];
}

static enum incode_status triangulate(struct work *w) {
    enum incode_status status = make_order(w);
    w->call.host.phases = 1;
    if (status == INCODE_OK)
        status = library_direct(
            host_direct_run(&w->order, &w->tets, NULL, &w->error));
    if (status != INCODE_OK)
        return status;
    w->call.host.phases = 2;
    status = list_duplicates(w);
    host_order_free(&w->order);
    bool facets = (w->flags & (INCODE_NEIGHBORS | INCODE_HULL)) != 0;
    if (status == INCODE_OK && (facets || (w->flags & INCODE_ANY_ORDER) == 0))
        host_tetrahedra_sort(&w->tets);
    w->call.host.phases = 3;
    host_tetrahedra_trim(&w->tets);
    if (status == INCODE_OK && facets && !host_call_cancelled())
        status = join_facets(w);
    w->call.host.phases = 4;
    return status;
}

static enum incode_status work(struct library_call *call) {
    struct work *w = (struct work *)call;
    enum incode_status status = triangulate(w);
    if (host_call_cancelled())
        status = INCODE_CANCELLED;
    if (status == INCODE_OK) {
        w->out->vertex = w->tets.v;
        w->out->count = w->tets.count;
    } else {
        uint64_t at = w->out->at;
        host_tetrahedra_free(&w->tets);
        incode_tetrahedra_free(w->out);
        w->out->at = at;
    }
    host_order_free(&w->order);
    return status;
}

static void drop(struct library_call *call) {
    incode_tetrahedra_free(((struct work *)call)->out);
}

/* Of the work, as a part of 1: rough, and never going back. */
static double done(struct library_call *call) {
    struct work *w = (struct work *)call;
    static const double before[] = {0.02, 0.1, 0.9, 0.96, 0.99};
    unsigned phase = w->call.host.phases;
    double part = before[phase < 4 ? phase : 4];
    uint64_t bricks = w->rows / INCODE_BRICK_POINTS + 1;
    if (phase == 1)
        part += 0.8 * fmin(1, (double)w->call.host.bricks / (double)bricks);
    return part;
}

enum incode_status incode_delaunay(const double *xyz, uint64_t points,
                                   const struct incode_options *options,
                                   struct incode_tetrahedra *out) {
    if (out == NULL)
        return INCODE_BAD_ARGUMENT;
    *out = (struct incode_tetrahedra){0};
    if ((xyz == NULL && points > 0) ||
        !library_options(&options,
                         INCODE_NEIGHBORS | INCODE_HULL | INCODE_ANY_ORDER))
        return INCODE_BAD_ARGUMENT;
    if (points >= UINT32_MAX)
        return INCODE_TOO_MANY;
    struct work w = {.call = {.work = work, .done = done, .drop = drop},
                     .xyz = xyz,
                     .rows = points,
                     .flags = options->flags,
                     .out = out};
    return library_call(&w.call, options, 1 + points / THREAD_POINTS);
}

void incode_tetrahedra_free(struct incode_tetrahedra *t) {
    if (t == NULL)
        return;
    host_unmap(t->vertex, t->count * sizeof *t->vertex);
    host_unmap(t->neighbor, t->count * sizeof *t->neighbor);
    host_unmap(t->hull, t->hull_count * sizeof *t->hull);
    host_unmap(t->duplicate, t->duplicate_count * sizeof *t->duplicate);
    *t = (struct incode_tetrahedra){0};
}

const char *incode_status_text(enum incode_status status) {
    static const char *const text[] = {
        [INCODE_OK] = "the points are triangulated",
        [INCODE_NO_MEMORY] = "there is not enough memory, or no thread; free "
                             "some, or raise memory_max",
        [INCODE_BAD_ARGUMENT] = "an argument is NULL, a flag is unknown, what "
                                "is reserved is not NULL, or the tetrahedra "
                                "are not of these points",
        [INCODE_NOT_FINITE] = "a coordinate is NaN or infinite; `at` is its "
                              "row",
        [INCODE_TOO_FEW] = "there are fewer than four distinct points",
        [INCODE_FLAT] = "all points lie on one plane or line",
        [INCODE_TOO_MANY] = "there are more points or tetrahedra than numbers "
                            "of 32 bits allow",
        [INCODE_IO] = "the scratch folder cannot take what is put aside; free "
                      "some of its disk, or give another",
        [INCODE_CANCELLED] = "the caller has cancelled",
        [INCODE_INTERNAL] = "the library has a defect; please report it with "
                            "the points"};
    return (unsigned)status < sizeof text / sizeof *text
               ? text[status]
               : "this is no status of incode";
}

const char *incode_version(void) {
    return NODE_VERSION;
}
