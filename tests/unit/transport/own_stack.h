/* A stack of a test's own, to be looked through for what a function has left on
 * it.
 *
 * Memory: STACK_BYTES. */
#ifndef TESTS_UNIT_OWN_STACK_H
#define TESTS_UNIT_OWN_STACK_H

#include <stdbool.h>
#include <string.h>
#include <ucontext.h>

#include "tests/unit/test.h"

enum { STACK_BYTES = 1 << 18 };

static _Alignas(64) uint8_t stack[STACK_BYTES];

static inline void run_on_stack(void (*work)(void)) {
    static ucontext_t here, there;
    memset(stack, 0, sizeof stack);
    assert_int_equal(getcontext(&there), 0);
    there.uc_stack.ss_sp = stack;
    there.uc_stack.ss_size = sizeof stack;
    there.uc_link = &here;
    makecontext(&there, work, 0);
    assert_int_equal(swapcontext(&here, &there), 0);
}

/* Whether a part of a secret is in the memory. */
static inline bool holds(const void *memory, size_t size, const uint8_t *secret,
                         size_t secret_bytes) {
    enum { RUN = 8 };
    const uint8_t *bytes = memory;
    for (size_t i = 0; i + RUN <= size; i++) {
        for (size_t k = 0; k + RUN <= secret_bytes; k += RUN)
            if (memcmp(bytes + i, secret + k, RUN) == 0)
                return true;
    }
    return false;
}

#endif
