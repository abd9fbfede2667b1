#include "cavity.h"
#include "complex.h"

enum { FIRST = INCODE_COMPLEX_CELLS_FIRST };

/* The neighbours of a cell that stays, and its vertices' cells. */
static void settle(struct incode_complex *x, uint32_t i) {
    struct incode_cell *c = incode_complex_cell(x, i);
    for (unsigned k = 0; k < 4; k++) {
        const struct incode_cell *n = incode_complex_cell(x, c->n[k].cell);
        x->point[c->v[k]].cell = i;
        if (incode_cell_proved(n) != 0)
            incode_cell_join(c, k,
                             incode_cell_is_infinite(n)
                                 ? INCODE_COMPLEX_GONE_INFINITE
                                 : INCODE_COMPLEX_GONE);
    }
}

/* Those of [first, end) that stay are settled, then the others are freed. */
static void settle_some(struct incode_complex *x, uint32_t first,
                        uint32_t end) {
    for (uint32_t i = first; i < end; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (!incode_cell_is_free(c) && incode_cell_proved(c) == 0)
            settle(x, i);
    }
}

static void free_some(struct incode_complex *x, uint32_t first, uint32_t end) {
    for (uint32_t i = first; i < end; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (!incode_cell_is_free(c) && incode_cell_proved(c) != 0)
            incode_complex_free_cell(x, i);
    }
}

enum { AT_ONCE = 128, UNITS = 64 /* points or cells in a breath */ };

void incode_complex_release(struct incode_complex *x,
                            struct incode_pause *pause) {
    for (uint32_t v = 0; v < x->points; v++) {
        if (v % AT_ONCE == 0)
            incode_breathe(pause, UNITS / 8);
        x->point[v].cell = INCODE_NONE;
    }
    for (uint32_t i = FIRST; i < x->cells; i += AT_ONCE) {
        incode_breathe(pause, UNITS);
        settle_some(x, i, x->cells - i < AT_ONCE ? x->cells : i + AT_ONCE);
    }
    for (uint32_t i = FIRST; i < x->cells; i += AT_ONCE) {
        incode_breathe(pause, UNITS / 4);
        free_some(x, i, x->cells - i < AT_ONCE ? x->cells : i + AT_ONCE);
    }
    x->free_point = 0;
    for (uint32_t v = x->points - 1; v > 0; v--) {
        if (v % AT_ONCE == 0)
            incode_breathe(pause, UNITS / 8);
        if (x->point[v].cell != INCODE_NONE)
            continue;
        x->point[v].id = x->free_point;
        x->free_point = v;
    }
}
