#include "horizon.h"
#include "incode/predicates/simd.h"

/* The points of a horizon's bricks, copied in its units. */

void incode_horizon_copy(struct incode_horizon *h, uint32_t index,
                         const struct incode_frame *frame) {
    const struct incode_brick *b = &frame->page.brick;
    const double *const axis[3] = {b->x, b->y, b->z};
    uint32_t copy = h->next;
    incode_vd scale = incode_vd_all(h->scale);
    for (int d = 0; d < 3; d++) {
        /* Scaled first: a difference of large numbers could overflow. */
        incode_vd origin = incode_vd_all(h->origin[d] * h->scale);
        for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VD_LANES)
            incode_vd_store_float(h->point[copy][d] + i,
                                  incode_vd_load(axis[d] + i) * scale - origin);
    }
    uint8_t *old = &h->copy[h->owner[copy]];
    if (*old == copy)
        *old = INCODE_NO_COPY;
    h->owner[copy] = (uint16_t)index;
    h->copy[index] = (uint8_t)copy;
    h->next = (copy + 1) % h->room;
}

static uint64_t points_beyond(const float (*point)[INCODE_BRICK_POINTS],
                              const struct incode_horizon_cap *cap, float far) {
    incode_vf most = incode_vf_all(cap->level + far * cap->slack);
    uint64_t out = 0;
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VF_LANES) {
        incode_vf value = incode_vf_all(0);
        for (int k = 0; k < 3; k++)
            value = incode_vf_fma(
                incode_vf_all(cap->g[k]),
                incode_vf_load(point[k] + i) - incode_vf_all(cap->v[k]), value);
        out |= (uint64_t)incode_vm_bits(incode_vf_less(most, value)) << i;
    }
    return out;
}

uint64_t incode_horizon_points(const struct incode_horizon *h, uint32_t index,
                               const struct incode_horizon_cap *cap) {
    const float(*point)[INCODE_BRICK_POINTS] = h->point[h->copy[index]];
    float far = h->far[index] + cap->near;
    /* A half-space says nothing of points that are beyond all bounds. */
    if (cap->d == 0 && far >= INCODE_ANYWHERE)
        return UINT64_MAX;
    incode_vf d = incode_vf_all(cap->d);
    incode_vf most =
        incode_vf_all((cap->d * far + cap->m_sum) * far * INCODE_HORIZON_DOUBT);
    uint64_t out = 0;
    for (uint32_t i = 0; i < INCODE_BRICK_POINTS; i += INCODE_VF_LANES) {
        incode_vf value = incode_vf_all(0);
        for (int k = 0; k < 3; k++) {
            incode_vf y =
                incode_vf_load(point[k] + i) - incode_vf_all(cap->v[k]);
            value = incode_vf_fma(
                incode_vf_fma(d, y, -incode_vf_all(cap->m[k])), y, value);
        }
        out |= (uint64_t)incode_vm_bits(incode_vf_less(most, value)) << i;
    }
    return ~out & ~(cap->bounded ? points_beyond(point, cap, far) : 0);
}
