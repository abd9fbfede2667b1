#include "handover.h"

#include <string.h>

enum {
    CELLS = 256, /* a step */
    AT_ONCE = 16 /* points or cells, in a breath */
};

/* A vertex's `cell`, which is not needed any more. */
enum { NOT_REACHED = 0, REACHED = 1 };

static void breathe_at(const struct incode_handover *h, uint32_t i) {
    if (i % AT_ONCE == 0)
        incode_maker_breathe(h->n->maker, AT_ONCE / 4);
}

void incode_handover_begin(struct incode_handover *h,
                           struct incode_insertion *n) {
    struct incode_complex *x = &n->complex;
    memset(h, 0, sizeof *h);
    h->n = n;
    h->cell = INCODE_COMPLEX_CELLS_FIRST;
    h->vertex = 1;
    h->brick = n->own_first;
    for (uint32_t v = 0; v < x->points; v++) {
        breathe_at(h, v);
        if (incode_complex_is_vertex(x, v))
            x->point[v].cell = NOT_REACHED;
    }
}

/* Sends what waits; false: there is no room for it. */
static bool send(struct incode_handover *h) {
    const struct incode_front_outside *outside = &h->n->outside;
    if (h->count > 0 && !outside->spill(outside->context, h->faces, h->count))
        return false;
    h->count = 0;
    return true;
}

/* The open face opposite vertex k of a cell, seen so that the cell is on its
 * unknown side. */
static void open_face(struct incode_handover *h, struct incode_front *front,
                      const struct incode_cell *c, unsigned k) {
    static const uint8_t BEFORE[4][3] = {
        {3, 2, 1}, {2, 3, 0}, {1, 0, 3}, {0, 1, 2}};
    struct incode_complex_point *point = h->n->complex.point;
    uint32_t f[3];
    const double *p[3];
    unsigned turn;
    for (unsigned i = 0; i < 3; i++) {
        uint16_t v = c->v[BEFORE[k][i]];
        point[v].cell = REACHED;
        f[i] = point[v].id;
        p[i] = point[v].p;
    }
    if (!incode_front_key(front, f, p, &turn))
        return;
    h->faces[h->count++] =
        (struct incode_face){{f[turn], f[(turn + 1) % 3], f[(turn + 2) % 3]}};
}

static enum incode_insertion_step send_faces(struct incode_handover *h,
                                             struct incode_front *front) {
    const struct incode_complex *x = &h->n->complex;
    for (unsigned i = 0; i < CELLS && h->cell < x->cells; i++, h->cell++) {
        const struct incode_cell *c = incode_complex_cell(x, h->cell);
        breathe_at(h, h->cell);
        if (incode_cell_is_free(c))
            continue;
        if (h->count + 4 > INCODE_BRICK_POINTS && !send(h))
            return INCODE_INSERTION_WAITING;
        for (unsigned k = 0; k < 4; k++)
            if (c->n[k].cell == INCODE_COMPLEX_GONE)
                open_face(h, front, c, k);
    }
    return INCODE_INSERTION_WORKED;
}

/* The points of own bricks to come that a released tetrahedron has. */
static enum incode_insertion_step send_ahead(struct incode_handover *h) {
    const struct incode_complex *x = &h->n->complex;
    for (unsigned i = 0; i < CELLS && h->vertex < x->points; i++, h->vertex++) {
        const struct incode_complex_point *v = &x->point[h->vertex];
        uint32_t brick = v->id / INCODE_BRICK_POINTS;
        if (v->cell != REACHED || brick < h->n->from || brick >= h->n->own_last)
            continue;
        if (h->count == INCODE_BRICK_POINTS && !send(h))
            return INCODE_INSERTION_WAITING;
        h->faces[h->count++] =
            (struct incode_face){{v->id, INCODE_NONE, INCODE_NONE}};
    }
    return INCODE_INSERTION_WORKED;
}

/* The points of a brick that a released tetrahedron has: those that have no
 * cell any more, or an open face. */
static enum incode_insertion_step send_reached(struct incode_handover *h) {
    const struct incode_complex *x = &h->n->complex;
    uint32_t brick = h->brick;
    uint32_t points = incode_maker_count(h->n->maker, brick);
    if (points == 0)
        return INCODE_INSERTION_WAITING;
    if (!send(h))
        return INCODE_INSERTION_WAITING;
    uint64_t reached = ~UINT64_C(0) >> (INCODE_BRICK_POINTS - points);
    for (uint32_t v = 1; v < x->points; v++) {
        breathe_at(h, v);
        if (x->point[v].cell == NOT_REACHED &&
            x->point[v].id / INCODE_BRICK_POINTS == brick)
            reached &= ~(UINT64_C(1) << x->point[v].id % INCODE_BRICK_POINTS);
    }
    for (; reached != 0; reached &= reached - 1)
        h->faces[h->count++] = (struct incode_face){
            {brick * INCODE_BRICK_POINTS + (uint32_t)__builtin_ctzll(reached),
             INCODE_NONE, INCODE_NONE}};
    h->brick++;
    return INCODE_INSERTION_WORKED;
}

enum incode_insertion_step incode_handover_step(struct incode_handover *h,
                                                struct incode_front *front) {
    const struct incode_insertion *n = h->n;
    if (h->cell < n->complex.cells)
        return send_faces(h, front);
    if (h->vertex < n->complex.points)
        return send_ahead(h);
    while (h->brick < n->from && incode_insertion_has_committed(n, h->brick))
        h->brick++;
    if (h->brick < n->from)
        return send_reached(h);
    return send(h) ? INCODE_INSERTION_FINISHED : INCODE_INSERTION_WAITING;
}
