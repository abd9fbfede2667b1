/* Long work yields to its caller: loops that may run for long in one call count
 * their work, and after each portion of it they call a function, which may poll
 * the links.  That function changes nothing that the work depends on, and does
 * not call back.
 *
 * Work is counted in units of about 200 instructions of a Cortex-M7, or 6,000
 * of a processor without doubles: an in_sphere that its filter decides.
 * Between two calls there are INCODE_YIELD_UNITS units, or as many as the last
 * call returned, and at most INCODE_YIELD_OVER more. */
#ifndef INCODE_YIELD_H
#define INCODE_YIELD_H

#include <stddef.h>
#include <stdint.h>

/* The outcome of a part of the work, in all rooms of incode. */
enum incode_step {
    INCODE_WORKED,   /* not yet done: call again */
    INCODE_WAITING,  /* for a page, an answer, or room outside */
    INCODE_FINISHED, /* done: the result is there */
    INCODE_AGAIN,    /* not done: begin again at the vertex, without waiting */
    INCODE_FULL,     /* it does not fit the memory that is given */
    INCODE_BROKEN    /* an invariant failed: see the module's `fault` */
};

enum {
    INCODE_YIELD_UNITS = 64,
    INCODE_YIELD_UNITS_MAX = 1 << 20,
    INCODE_YIELD_OVER = 64 /* what is counted at a time */
};

struct incode_yield {
    /* Returns the number of units until it is called again, 1 to
     * INCODE_YIELD_UNITS_MAX: on a fast processor more than INCODE_YIELD_UNITS,
     * so that the calls cost nothing.  NULL: there is nothing to poll. */
    uint32_t (*poll)(void *context);
    void *context;
    int32_t left; /* units; 0 at first */
};

/* Calls `poll`, and sets what is left. */
void incode_yield_poll(struct incode_yield *yield);

/* Fills memory with a byte, and yields on the way. */
void incode_yield_fill(struct incode_yield *yield, void *memory, int byte,
                       size_t bytes);

/* Called before `units` units of work, at most INCODE_YIELD_OVER. */
static inline void incode_yield_after(struct incode_yield *yield,
                                      uint32_t units) {
    yield->left -= (int32_t)units;
    if (__builtin_expect(yield->left < 0, 0))
        incode_yield_poll(yield);
}

#endif
