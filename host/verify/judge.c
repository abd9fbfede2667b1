#include "judge.h"

#include <math.h>
#include <string.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "incode/predicates/predicates.h"

enum { GROUP = INCODE_BRICK_POINTS }; /* bricks a group, points a brick */

/* The error of every bound below is at most 64 roundings of its terms' sizes,
 * and `least` for all underflows together. */
static const double rounding = 64 * 0x1p-53, least = 1e-290;

/* --- Boxes ---------------------------------------------------------------- */

static void cover(const struct host_judge *j, uint64_t box, const double lo[3],
                  const double hi[3]) {
    for (int d = 0; d < 3; d++) {
        j->side[d][box] = fmin(j->side[d][box], lo[d]);
        j->side[3 + d][box] = fmax(j->side[3 + d][box], hi[d]);
    }
}

static void make_boxes(const struct host_judge *j) {
    for (uint64_t i = 0; i < j->bricks + j->groups; i++) {
        host_call_trim(6 * sizeof(double));
        for (int d = 0; d < 3; d++) {
            j->side[d][i] = INFINITY;
            j->side[3 + d][i] = -INFINITY;
        }
    }
    for (uint64_t v = 0; v < j->sites.count; v++) {
        double p[3];
        host_call_trim(2 * sizeof p);
        if (host_site_is_vertex(&j->sites, (uint32_t)v)) {
            host_site(&j->sites, (uint32_t)v, p);
            cover(j, v / GROUP, p, p);
            cover(j, j->bricks + v / GROUP / GROUP, p, p);
        }
    }
}

int host_judge_make(struct host_judge *judge, const struct host_sites *sites,
                    struct host_error *error) {
    *judge = (struct host_judge){.sites = *sites};
    judge->bricks = (sites->count + GROUP - 1) / GROUP;
    judge->groups = (judge->bricks + GROUP - 1) / GROUP;
    size_t boxes = (size_t)(judge->bricks + judge->groups);
    double *all = host_map(6 * boxes * sizeof *all);
    if (all == NULL)
        return host_fail_memory(error, "the boxes of the bricks");
    for (size_t d = 0; d < 6; d++)
        judge->side[d] = all + d * boxes;
    make_boxes(judge);
    return 0;
}

void host_judge_free(struct host_judge *judge) {
    host_unmap(judge->side[0], 6 * (size_t)(judge->bricks + judge->groups) *
                                   sizeof *judge->side[0]);
    *judge = (struct host_judge){0};
}

/* --- The query ------------------------------------------------------------ */

/* A half-space n . X > 0, and a ball volume |X|^2 < g . X inside it, where X =
 * x - a; each coefficient with the sum of the sizes of its terms. */
struct query {
    const struct host_judge *judge;
    uint32_t t[4]; /* a facet and the best apex so far, or INCODE_NONE */
    double at[4][3];
    double n[3], n_size[3];
    double g[3], g_size[3], volume, volume_size;
    bool ball;  /* points in the ball are wanted, and it is known */
    bool half;  /* points beyond the facet are wanted */
    bool any;   /* the first hit ends the search */
    bool found; /* a point inside the ball or half-space */
    struct incode_tally tally;
};

/* u x v, and the sizes. */
static void cross(const double u[3], const double v[3], double n[3],
                  double size[3]) {
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        double p = u[i] * v[j], q = u[j] * v[i];
        n[k] = p - q;
        size[k] = fabs(p) + fabs(q);
    }
}

static void set_half(struct query *q) {
    double u[3], v[3];
    for (int d = 0; d < 3; d++) {
        u[d] = q->at[1][d] - q->at[0][d];
        v[d] = q->at[2][d] - q->at[0][d];
    }
    cross(u, v, q->n, q->n_size);
}

static void set_ball(struct query *q) {
    double e[3][3];
    memset(q->g, 0, sizeof q->g);
    memset(q->g_size, 0, sizeof q->g_size);
    q->volume = q->volume_size = 0;
    for (int k = 0; k < 3; k++)
        for (int d = 0; d < 3; d++)
            e[k][d] = q->at[k + 1][d] - q->at[0][d];
    for (int k = 0; k < 3; k++) {
        double n[3], size[3], square = 0;
        cross(e[(k + 1) % 3], e[(k + 2) % 3], n, size);
        for (int d = 0; d < 3; d++)
            square += e[k][d] * e[k][d];
        for (int d = 0; d < 3; d++) {
            q->g[d] += square * n[d];
            q->g_size[d] += square * size[d];
            if (k == 0) {
                q->volume += e[0][d] * n[d];
                q->volume_size += fabs(e[0][d]) * size[d];
            }
        }
    }
    q->ball = true;
}

/* The least of volume x^2 - g x on [lo, hi]. */
static inline double lowest_of(double volume, double g, double lo, double hi) {
    double x = 0.5 * g / volume;
    x = x > lo ? x : lo; /* also where it is not a number */
    x = x < hi ? x : hi;
    double low = (volume * lo - g) * lo, high = (volume * hi - g) * hi;
    double mid = (volume * x - g) * x;
    low = low < high ? low : high;
    return low < mid ? low : mid;
}

/* Which of n <= GROUP boxes from `first` on may hold a point that is wanted; a
 * box whose bound leaves the range of doubles may. */
static void mark_boxes(const struct query *q, uint64_t first, uint64_t n,
                       uint8_t *may) {
    double *const *side = q->judge->side;
    for (uint64_t i = 0; i < n; i++) {
        double above = 0, below = 0, above_size = least, below_size = least;
        for (int d = 0; d < 3; d++) {
            double lo = side[d][first + i] - q->at[0][d];
            double hi = side[3 + d][first + i] - q->at[0][d];
            double most = fabs(lo) > fabs(hi) ? fabs(lo) : fabs(hi);
            double p = q->n[d] * lo, r = q->n[d] * hi;
            above += p > r ? p : r;
            above_size += rounding * (q->n_size[d] * most);
            below += lowest_of(q->volume, q->g[d], lo, hi);
            below_size += rounding * ((q->volume_size * most) * most +
                                      q->g_size[d] * most);
        }
        bool out = q->half & (above < -above_size);
        out |= q->ball & (below > below_size);
        may[i] = !out;
    }
}

/* Whether vertex v is inside; then it is the better apex. */
static void try_vertex(struct query *q, uint32_t v) {
    double p[3];
    if (!host_site_is_vertex(&q->judge->sites, v))
        return;
    for (int k = 0; k < 4; k++)
        if (q->t[k] == v)
            return;
    host_site(&q->judge->sites, v, p);
    if (q->half &&
        incode_orient3d(&q->tally, q->at[0], q->at[1], q->at[2], p) <= 0)
        return;
    if (q->ball && incode_in_sphere(&q->tally, q->at[0], q->at[1], q->at[2],
                                    q->at[3], p) < 0)
        return;
    q->found = true;
    if (!q->any) {
        q->t[3] = v;
        memcpy(q->at[3], p, sizeof p);
        set_ball(q);
    }
}

static void try_brick(struct query *q, uint64_t brick) {
    uint64_t first = brick * GROUP, left = q->judge->sites.count - first;
    host_call_trim(HOST_CALL_AROUND);
    for (uint64_t i = 0; i < GROUP && i < left; i++) {
        try_vertex(q, (uint32_t)(first + i));
        if (q->found && q->any)
            return;
    }
}

static void try_group(struct query *q, uint64_t group) {
    uint8_t may[GROUP];
    uint64_t first = group * GROUP, left = q->judge->bricks - first;
    uint64_t n = left < GROUP ? left : GROUP;
    host_call_trim((size_t)6 * HOST_CALL_AROUND); /* the sides of boxes */
    mark_boxes(q, first, n, may);
    for (uint64_t i = 0; i < n && !(q->found && q->any); i++) {
        uint8_t still = may[i];
        if (still && q->found) /* the ball has shrunk */
            mark_boxes(q, first + i, 1, &still);
        if (still)
            try_brick(q, first + i);
    }
}

/* The bricks of the query's own vertices come first: their points make the ball
 * small. */
static void search(struct query *q) {
    uint64_t groups = q->judge->groups;
    uint32_t own[4];
    memcpy(own, q->t, sizeof own);
    for (int k = 0; k < 4 && !(q->found && q->any); k++)
        if (own[k] != INCODE_NONE)
            try_brick(q, own[k] / GROUP);
    for (uint64_t i = 0; i < groups && !(q->found && q->any); i += GROUP) {
        uint8_t may[GROUP];
        uint64_t n = groups - i < GROUP ? groups - i : GROUP;
        mark_boxes(q, q->judge->bricks + i, n, may);
        for (uint64_t k = 0; k < n && !(q->found && q->any); k++)
            if (may[k])
                try_group(q, i + k);
    }
}

static struct query query_of(const struct host_judge *judge, const uint32_t *v,
                             int count) {
    struct query q = {.judge = judge, .t = {0, 0, 0, INCODE_NONE}};
    for (int k = 0; k < count; k++) {
        q.t[k] = v[k];
        host_site(&judge->sites, v[k], q.at[k]);
    }
    set_half(&q);
    return q;
}

bool host_judge_tetrahedron(const struct host_judge *judge,
                            const uint32_t t[4]) {
    struct query q = query_of(judge, t, 4);
    if (incode_orient3d(&q.tally, q.at[0], q.at[1], q.at[2], q.at[3]) <= 0)
        return false;
    q.any = true;
    set_ball(&q);
    search(&q);
    return !q.found;
}

uint32_t host_judge_apex(const struct host_judge *judge, const uint32_t f[3]) {
    struct query q = query_of(judge, f, 3);
    q.half = true;
    search(&q);
    return q.t[3];
}

bool host_judge_beyond(const struct host_judge *judge, const uint32_t f[3]) {
    struct query q = query_of(judge, f, 3);
    q.half = q.any = true;
    search(&q);
    return q.found;
}
