#include "hits.h"

#include "incode/predicates/simd.h"

void incode_hits_draw_in(struct incode_query *q,
                         const struct incode_pencil *pencil, double t) {
    double square = 0.25 * t * t;
    for (int d = 0; d < 3; d++) {
        q->centre[d] = pencil->c0[d] + 0.5 * t * pencil->n[d];
        square += pencil->c0[d] * pencil->c0[d];
    }
    q->t = t;
    q->square = square * (1 + 4e-6);
    double far = 2 * pencil->size + __builtin_fabs(t); /* above the radius */
    q->plane_slack = INCODE_SPHERE_TINY + INCODE_SPHERE_EPS * 6 *
                                              incode_max_norm(q->sphere.pn) *
                                              far;
    q->round = true;
}

INCODE_INLINE incode_vd dot(const double a[3], const incode_vd b[3]) {
    return incode_vd_all(a[0]) * b[0] + incode_vd_all(a[1]) * b[1] +
           incode_vd_all(a[2]) * b[2];
}

/* incode_pencil_place for a vector of points at x, y and z; infinite where it
 * is false. */
INCODE_INLINE incode_vd places(const struct incode_query *q,
                               const struct incode_pencil *pencil,
                               const double *const xyz[3], uint32_t i) {
    incode_vd r[3], square = incode_vd_all(0);
    incode_vd far = incode_vd_all(INCODE_PENCIL_LEAST);
    for (int d = 0; d < 3; d++) {
        /* Scaled first: a difference of large numbers could overflow. */
        r[d] = incode_vd_load(xyz[d] + i) * incode_vd_all(q->scale) -
               incode_vd_all(q->pv[d] * q->scale);
        far = incode_vd_max(incode_vd_abs(r[d]), far);
        square += r[d] * r[d];
    }
    incode_vd beyond = dot(pencil->n, r);
    incode_vd t = (square - incode_vd_all(2) * dot(pencil->c0, r)) / beyond;
    return incode_vd_select(beyond > incode_vd_all(2e-3) * far, t,
                            incode_vd_all(__builtin_inf()));
}

void incode_hits_place(struct incode_query *q,
                       const struct incode_pencil *pencil,
                       struct incode_hits *hits) {
    if (hits->placed == hits->count)
        return;
    const double *const xyz[3] = {hits->p[0], hits->p[1], hits->p[2]};
    incode_vd infinite = incode_vd_all(__builtin_inf()), least = infinite;
    incode_vd end = incode_vd_all(hits->count), lane = incode_vd_count();
    for (uint32_t i = hits->placed / INCODE_VD_LANES * INCODE_VD_LANES;
         i < hits->count; i += INCODE_VD_LANES) {
        incode_vd t = places(q, pencil, xyz, i);
        t = incode_vd_select(incode_vd_all(i) + lane < end, t, infinite);
        *(incode_vd *)(hits->t + i) = t;
        least = incode_vd_min(t, least);
    }
    hits->placed = hits->count;
    double first = incode_vd_least_of(least);
    if (first < q->t)
        incode_hits_draw_in(q, pencil, first);
}

bool incode_hits_contends(const struct incode_query *q,
                          const struct incode_hits *hits, uint32_t i,
                          double last) {
    double square = 0;
    if (hits->t[i] < __builtin_inf())
        return hits->t[i] <= last;
    for (int d = 0; d < 3; d++) {
        double r = hits->p[d][i] * q->scale - q->pv[d] * q->scale;
        square += (r - q->centre[d]) * (r - q->centre[d]);
    }
    return !(square > q->square);
}

/* Drops what has fallen out of the ball. */
static void thin_out(const struct incode_query *q,
                     const struct incode_pencil *pencil,
                     struct incode_hits *hits) {
    double last = incode_pencil_later(pencil, q->t);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < hits->count; i++) {
        if (!incode_hits_contends(q, hits, i, last))
            continue;
        for (int d = 0; d < 3; d++)
            hits->p[d][kept] = hits->p[d][i];
        hits->id[kept] = hits->id[i];
        hits->t[kept++] = hits->t[i];
    }
    hits->count = hits->placed = kept;
}

bool incode_hits_add(const struct incode_pencil *pencil, struct incode_query *q,
                     const struct incode_frame *frame, uint64_t in,
                     struct incode_hits *hits) {
    const struct incode_brick *b = &frame->page.brick;
    for (; in != 0; in &= in - 1) {
        uint32_t slot = (uint32_t)__builtin_ctzll(in);
        if (hits->count == INCODE_HITS) {
            incode_hits_place(q, pencil, hits);
            thin_out(q, pencil, hits);
            if (hits->count == INCODE_HITS)
                return false;
        }
        uint32_t i = hits->count++;
        hits->p[0][i] = b->x[slot];
        hits->p[1][i] = b->y[slot];
        hits->p[2][i] = b->z[slot];
        hits->id[i] = frame->number * INCODE_BRICK_POINTS + slot;
    }
    return true;
}
