/* Whether the processor is valgrind's: 30 times slower, and deaf to rounding
 * modes, flushed denormals and 80-bit registers.  And whether the program has
 * the sanitizers in it: 5 times slower. */
#ifndef TESTS_UNIT_EMULATED_H
#define TESTS_UNIT_EMULATED_H

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#ifdef INCODE_SANITIZED
enum { SANITIZED = 1 };
#else
enum { SANITIZED = 0 };
#endif

/* Valgrind has its own library loaded first into every program. */
static inline bool emulated(void) {
    const char *preload = getenv("LD_PRELOAD");
    return preload != NULL && strstr(preload, "vgpreload") != NULL;
}

#endif
