/* What was wiped is gone from memory, although nobody reads it again.  A stack
 * of the test's own is looked through when the function that worked on it has
 * returned. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <ucontext.h>

#include <cmocka.h>

/* In this unit, so that the compiler sees all that it could leave out. */
#include "transport/secure_wipe.c"

enum { STACK_BYTES = 1 << 18, SECRET_BYTES = 64 };

static _Alignas(64) uint8_t stack[STACK_BYTES];

static void run_on_stack(void (*work)(void))
{
    static ucontext_t here, there;
    memset(stack, 0, sizeof stack);
    assert_int_equal(getcontext(&there), 0);
    there.uc_stack.ss_sp = stack;
    there.uc_stack.ss_size = sizeof stack;
    there.uc_link = &here;
    makecontext(&there, work, 0);
    assert_int_equal(swapcontext(&here, &there), 0);
}

/* Whether so many bytes of a secret in a row are in the memory. */
static bool holds(const uint8_t *memory, size_t size, const uint8_t *secret)
{
    enum { RUN = 8 };
    for (size_t i = 0; i + RUN <= size; i++) {
        for (size_t k = 0; k < SECRET_BYTES; k += RUN) {
            if (memcmp(memory + i, secret + k, RUN) == 0) {
                return true;
            }
        }
    }
    return false;
}

static uint8_t secret[SECRET_BYTES];

static void use_and_leave(void)
{
    uint8_t copy[SECRET_BYTES];
    memcpy(copy, secret, sizeof copy);
    __asm__ volatile("" : : "r"(copy) : "memory"); /* it is used */
}

static void use_and_wipe(void)
{
    uint8_t copy[SECRET_BYTES];
    memcpy(copy, secret, sizeof copy);
    __asm__ volatile("" : : "r"(copy) : "memory");
    secure_wipe(copy, sizeof copy);
}

static void a_wipe_stays(void **unused)
{
    (void)unused;
    for (unsigned i = 0; i < SECRET_BYTES; i++) {
        secret[i] = (uint8_t)(0x81 + 3 * i);
    }
    run_on_stack(use_and_leave);
    assert_true(holds(stack, sizeof stack, secret));
    run_on_stack(use_and_wipe);
    assert_false(holds(stack, sizeof stack, secret));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_wipe_stays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
