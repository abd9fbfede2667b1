#include "processor.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef __x86_64__
#include <cpuid.h>
#endif

/* Of the stubs; without them all addresses are NULL, and there is one level. */
#define OF_STUBS __attribute__((weak, visibility("hidden")))
typedef const int32_t *calls; /* how far functions are from their table */
extern calls processor_calls OF_STUBS;
extern const int32_t processor_x86_64[] OF_STUBS;
extern const int32_t processor_x86_64_v2[] OF_STUBS;
extern const int32_t processor_x86_64_v3[] OF_STUBS;
extern const int32_t processor_x86_64_v4[] OF_STUBS;

static const struct level {
    const char *name;
    calls calls;
    const char *allowed; /* where it is the highest */
} levels[] = {
    {"x86-64", processor_x86_64, "give x86-64, or leave it out"},
    {"x86-64-v2", processor_x86_64_v2, "give x86-64 or x86-64-v2"},
    {"x86-64-v3", processor_x86_64_v3, "give x86-64, x86-64-v2 or x86-64-v3"},
    {"x86-64-v4", processor_x86_64_v4,
     "give x86-64, x86-64-v2, x86-64-v3 or x86-64-v4"}};
enum { LEVELS = sizeof levels / sizeof *levels };

static bool has_levels(void) {
    return &processor_calls != NULL;
}

#ifdef __x86_64__
/* Registers of which the system keeps the contents: XCR0. */
static uint32_t kept_registers(void) {
    uint32_t low, high;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

/* psABI for x86-64, table 3.1: what each level needs, bit by bit. */
static unsigned highest(void) {
    enum { SYSTEM_KEEPS = 1 << 27, AVX_KEPT = 0x6, AVX512_KEPT = 0xe6 };
    const uint32_t v2 = 1U << 0 | 1U << 9 | 1U << 13 | 1U << 19 | 1U << 20 |
                        1U << 23;     /* SSE3 to SSE4.2, CMPXCHG16B, POPCNT */
    const uint32_t v2_more = 1U << 0; /* LAHF */
    const uint32_t v3 =
        1U << 12 | 1U << 22 | 1U << 28 | 1U << 29; /* FMA, MOVBE, AVX, F16C */
    const uint32_t v3_more = 1U << 5;              /* LZCNT */
    const uint32_t v3_wide = 1U << 3 | 1U << 5 | 1U << 8; /* BMI, AVX2 */
    const uint32_t v4_wide = 1U << 16 | 1U << 17 | 1U << 28 | 1U << 30 |
                             1U << 31; /* AVX-512 F, DQ, CD, BW, VL */
    uint32_t a, b, c, d, wide = 0, more = 0, kept = 0;
    if (__get_cpuid_count(7, 0, &a, &b, &c, &d) != 0)
        wide = b;
    if (__get_cpuid(0x80000001, &a, &b, &c, &d) != 0)
        more = c;
    if (__get_cpuid(1, &a, &b, &c, &d) == 0)
        c = 0;
    if ((c & SYSTEM_KEEPS) != 0)
        kept = kept_registers();
    if ((c & v2) != v2 || (more & v2_more) != v2_more)
        return 0;
    if ((c & v3) != v3 || (more & v3_more) != v3_more ||
        (wide & v3_wide) != v3_wide || (kept & AVX_KEPT) != AVX_KEPT)
        return 1;
    return (wide & v4_wide) == v4_wide && (kept & AVX512_KEPT) == AVX512_KEPT
               ? 3
               : 2;
}
#else
static unsigned highest(void) {
    return 0;
}
#endif

__attribute__((constructor)) static void choose(void) {
    if (has_levels())
        processor_calls = levels[highest()].calls;
}

const char *processor_force(const char *name) {
    if (name == NULL || name[0] == '\0')
        return NULL;
    if (!has_levels())
        return "this program is built for one processor";
    for (unsigned i = 0; i < LEVELS; i++) {
        if (strcmp(name, levels[i].name) != 0)
            continue;
        if (i > highest())
            return "the processor or the operating system does not have this "
                   "level";
        processor_calls = levels[i].calls;
        return NULL;
    }
    return "x86-64 has no such level";
}

const char *processor_allowed(void) {
    return has_levels() ? levels[highest()].allowed
                        : "leave it out, or build the program with ARCH=any";
}

/* The value stands behind the name and a sign. */
char *processor_variable(void) {
    char *value = getenv(PROCESSOR_VARIABLE);
    return value == NULL ? NULL : value - sizeof PROCESSOR_VARIABLE;
}

const char *processor_level(void) {
    for (unsigned i = 0; i < LEVELS && has_levels(); i++)
        if (processor_calls == levels[i].calls)
            return levels[i].name;
    return "native";
}
