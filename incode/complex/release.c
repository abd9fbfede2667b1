#include "cavity.h"
#include "complex.h"

enum { FIRST = INCODE_COMPLEX_CELLS_FIRST };

/* The neighbours of a cell that stays, and its vertices' cells. */
static void settle(struct incode_complex *x, uint32_t i)
{
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

void incode_complex_release(struct incode_complex *x)
{
    for (uint32_t v = 0; v < x->points; v++)
        x->point[v].cell = INCODE_NONE;
    for (uint32_t i = FIRST; i < x->cells; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (!incode_cell_is_free(c) && incode_cell_proved(c) == 0)
            settle(x, i);
    }
    for (uint32_t i = FIRST; i < x->cells; i++) {
        const struct incode_cell *c = incode_complex_cell(x, i);
        if (!incode_cell_is_free(c) && incode_cell_proved(c) != 0)
            incode_complex_free_cell(x, i);
    }
    x->free_point = 0;
    for (uint32_t v = x->points - 1; v > 0; v--) {
        if (x->point[v].cell != INCODE_NONE)
            continue;
        x->point[v].id = x->free_point;
        x->free_point = v;
    }
}
