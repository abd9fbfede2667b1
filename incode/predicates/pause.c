#include "pause.h"

#include <string.h>

#include "check.h"

enum { FILLED = 8192, FILLED_UNITS = 16 }; /* bytes at once, and their work */

void incode_pause_look(struct incode_pause *pause) {
    uint32_t units = INCODE_PAUSE_UNITS_MAX;
    if (pause->look != NULL)
        units = pause->look(pause->context);
    INCODE_ASSERT(units >= 1 && units <= INCODE_PAUSE_UNITS_MAX);
    pause->left = (int32_t)units;
}

void incode_pause_fill(struct incode_pause *pause, void *memory, int byte,
                       size_t bytes) {
    uint8_t *at = memory;
    for (size_t done; bytes > 0; at += done, bytes -= done) {
        done = bytes < FILLED ? bytes : FILLED;
        incode_breathe(pause, FILLED_UNITS);
        memset(at, byte, done);
    }
}
