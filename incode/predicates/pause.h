/* Long work lets its caller look after something else: loops that may run for
 * long in one call count what they do, and each time that so much is done they
 * have a function called.  It changes nothing that the work depends on, and
 * must not call back.
 *
 * Work is counted in units of about 200 instructions of a Cortex-M7, or 6,000
 * of a processor without doubles: an in_sphere that its filter decides.
 * Between two calls there are INCODE_PAUSE_UNITS, or as many as the last one
 * has asked for, and INCODE_PAUSE_OVER more at the most. */
#ifndef INCODE_PAUSE_H
#define INCODE_PAUSE_H

#include <stddef.h>
#include <stdint.h>

enum {
    INCODE_PAUSE_UNITS = 64,
    INCODE_PAUSE_UNITS_MAX = 1 << 20,
    INCODE_PAUSE_OVER = 64 /* what is counted at a time */
};

struct incode_pause {
    /* Returns how many units may be worked until it is called again, 1 to
     * INCODE_PAUSE_UNITS_MAX: where the processor is fast, more than
     * INCODE_PAUSE_UNITS, so that it costs nothing.  NULL: nobody looks. */
    uint32_t (*look)(void *context);
    void *context;
    int32_t left; /* units; 0 at first */
};

/* Calls `look`, and sets what is left. */
void incode_pause_look(struct incode_pause *pause);

/* Fills memory with a byte, and yields on the way. */
void incode_pause_fill(struct incode_pause *pause, void *memory, int byte,
                       size_t bytes);

/* So many units, at most INCODE_PAUSE_OVER, are about to be worked. */
static inline void incode_breathe(struct incode_pause *pause, uint32_t units) {
    pause->left -= (int32_t)units;
    if (__builtin_expect(pause->left < 0, 0))
        incode_pause_look(pause);
}

#endif
