/* The self-test of the machine's arithmetic must pass here, and must name each
 * fault that can be provoked. */
#include <fenv.h>

#include "tests/unit/test.h"

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

#include "incode/predicates/predicates.h"
#include "tests/unit/emulated.h"

/* The same source once more, with products fused into sums. */
#ifdef __FMA__
#ifdef __clang__
#pragma clang fp contract(fast)
#else
#pragma GCC push_options
#pragma GCC optimize("fp-contract=fast")
#endif
#define incode_arithmetic_fault fused_arithmetic_fault
const char *fused_arithmetic_fault(void);
/* NOLINTNEXTLINE(bugprone-suspicious-include) */
#include "incode/predicates/arithmetic.c"
#undef incode_arithmetic_fault
#ifdef __clang__
#pragma clang fp contract(off)
#else
#pragma GCC pop_options
#endif
#endif

/* And once with the 80-bit registers of old x86. */
#if defined(__x86_64__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("fpmath=387")
#define EXTENDED 1
#define incode_arithmetic_fault extended_arithmetic_fault
#define rounds_to_even extended_rounds_to_even
#define fuses extended_fuses
#define keeps_excess extended_keeps_excess
#define flushes extended_flushes
#define little_endian extended_little_endian
const char *extended_arithmetic_fault(void);
/* NOLINTNEXTLINE(bugprone-suspicious-include) */
#include "incode/predicates/arithmetic.c"
#undef incode_arithmetic_fault
#pragma GCC pop_options
#endif

static void need_processor(void) {
    if (emulated()) {
        print_message("valgrind's processor does not know it\n");
        skip();
    }
}

static void names(const char *fault, const char *word) {
    assert_non_null(fault);
    if (strstr(fault, word) == NULL)
        fail_msg("'%s' does not name '%s'", fault, word);
}

TEST(test_sound_here) {
    const char *fault = incode_arithmetic_fault();
    if (fault != NULL)
        fail_msg("%s", fault);
}

TEST(test_fused) {
#if defined(__FMA__) && !defined(INCODE_SANITIZED)
    names(fused_arithmetic_fault(), "fused");
#else
    print_message("this build fuses nothing\n");
    skip();
#endif
}

TEST(test_extended) {
    need_processor();
#ifdef EXTENDED
    names(extended_arithmetic_fault(), "excess");
#else
    print_message("no 80-bit registers here\n");
    skip();
#endif
}

TEST(test_rounding) {
    static const int modes[] = {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    need_processor();
    for (size_t i = 0; i < sizeof modes / sizeof modes[0]; i++) {
        assert_int_equal(fesetround(modes[i]), 0);
        const char *fault = incode_arithmetic_fault();
        assert_int_equal(fesetround(FE_TONEAREST), 0);
        names(fault, "nearest");
    }
    assert_null(incode_arithmetic_fault());
}

TEST(test_flushed) {
    need_processor();
#ifdef __SSE2__
    static const unsigned flags[] = {0x8000 /* FTZ */, 0x0040 /* DAZ */,
                                     0x8040};
    unsigned before = _mm_getcsr();
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; i++) {
        _mm_setcsr(before | flags[i]);
        const char *fault = incode_arithmetic_fault();
        _mm_setcsr(before);
        names(fault, "denormals");
    }
    assert_null(incode_arithmetic_fault());
#else
    print_message("no flags to set on this processor\n");
    skip();
#endif
}
