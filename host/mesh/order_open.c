#include <math.h>
#include <stdlib.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "incode/complex/complex.h"
#include "incode/predicates/predicates.h"
#include "order.h"

enum { SAMPLE = 2000, STEP = 4, CELLS_A_POINT = 14, ROUNDS = 5 };

/* Adds `count` of the points, evenly spread over the order, numbered from 0. */
static void add_some(struct incode_complex *x, const struct host_order *order,
                     uint32_t count) {
    uint64_t rank = 0, points = order->points;
    uint32_t added = 0;
    for (uint32_t b = 0; b < order->bricks && added < count; b++) {
        const struct incode_brick *brick = &order->brick[b];
        host_call_trim(2 * sizeof *brick);
        for (; added < count; added++) {
            uint64_t slot = added * points / count - rank;
            if (slot >= order->fill[b])
                break;
            const double p[3] = {brick->x[slot], brick->y[slot],
                                 brick->z[slot]};
            (void)incode_complex_add(x, p, added);
        }
        rank += order->fill[b];
    }
}

/* Begins with four that span space, far apart; false: there are none. */
static bool begin(struct incode_complex *x, struct incode_tally *tally,
                  uint32_t count) {
    const struct incode_complex_point *p = x->point;
    uint32_t four[4] = {1, 1 + count / 2, 0, 0};
    for (uint32_t i = 1; i <= count && four[3] == 0; i++) {
        const double *a = p[four[0]].p, *b = p[four[1]].p;
        if (four[2] == 0 && !incode_collinear(a, b, p[i].p))
            four[2] = i;
        if (four[2] != 0 &&
            incode_orient3d(tally, a, b, p[four[2]].p, p[i].p) != 0)
            four[3] = i;
    }
    return four[3] != 0 && incode_complex_begin(x, tally, four);
}

/* A half of the points in the last round, a half of the rest in that before. */
static unsigned round_of(uint32_t v) {
    uint32_t h = v * UINT32_C(0x9e3779b1);
    h ^= h >> 15;
    unsigned zeros = h == 0 ? ROUNDS : (unsigned)__builtin_ctz(h);
    return zeros < ROUNDS ? ROUNDS - zeros : 0;
}

static bool insert_all(struct incode_complex *x, struct incode_tally *tally,
                       uint32_t count) {
    uint32_t near = 1;
    for (unsigned round = 0; round <= ROUNDS; round++) {
        for (uint32_t v = 1; v <= count; v++) {
            if (round_of(v) == round && !incode_complex_is_vertex(x, v) &&
                !incode_complex_insert(x, tally, v, near))
                return false;
            near = incode_complex_is_vertex(x, v) ? v : near;
        }
    }
    return true;
}

/* The most tetrahedra that have points on both sides of a place in the order.
 * change: [count + 1], 0. */
static uint32_t widest(const struct incode_complex *x, int32_t *change,
                       uint32_t count) {
    int32_t open = 0, most = 0;
    for (uint32_t i = INCODE_COMPLEX_CELLS_FIRST; i < x->cells; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        uint32_t first = count, last = 0;
        if (incode_cell_is_free(c) || incode_cell_is_infinite(c))
            continue;
        for (unsigned k = 0; k < 4; k++) {
            uint32_t id = x->point[c->v[k]].id;
            first = id < first ? id : first;
            last = id > last ? id : last;
        }
        change[first]++;
        change[last]--;
    }
    for (uint32_t i = 0; i < count; i++) {
        open += change[i];
        most = open > most ? open : most;
    }
    return (uint32_t)most;
}

/* Of a sample of so many; as many as there is room for where they do not fit,
 * as those of two lines askew; 0: there are none. */
static uint32_t open_of(const struct host_order *order, uint32_t count) {
    struct incode_tally tally = {0};
    struct incode_complex x;
    size_t bytes = (count + 1) * (sizeof(struct incode_complex_point) +
                                  CELLS_A_POINT * sizeof(struct incode_cell));
    void *memory = host_map(bytes);
    int32_t *change = calloc(count + 1, sizeof *change);
    uint32_t open = 0;
    if (memory != NULL && change != NULL) {
        incode_complex_init(&x, memory, bytes);
        add_some(&x, order, count);
        if (begin(&x, &tally, count)) {
            open = insert_all(&x, &tally, count) ? widest(&x, change, count)
                                                 : x.cells;
        }
    }
    host_unmap(memory, bytes);
    free(change);
    return open;
}

uint64_t host_order_open(const struct host_order *order) {
    uint32_t count = order->points < SAMPLE ? order->points : SAMPLE;
    double all = open_of(order, count), part = open_of(order, count / STEP);
    if (all < 1 || part < 1)
        return 0;
    double power = log(all / part) / log(STEP);
    power = power < 0.5 ? 0.5 : power > 1.0 ? 1.0 : power;
    return (uint64_t)(all * pow((double)order->points / count, power));
}
