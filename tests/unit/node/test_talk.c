/* A node whose host and neighbour say what they like: drawn at random here,
 * sought by the fuzzer (tests/fuzz/fuzz_node.c). */

#include "node_talk.h"
#include "tests/unit/emulated.h"
#include "tests/unit/test.h"

static uint64_t state = 88172645463325252u;

static uint8_t draw(void) {
    return (uint8_t)(sim_draw(&state) >> 40);
}

/* TALKS for more than a few, TALK_SEED for others than these. */
TEST(random_talks) {
    const char *wanted = getenv("TALKS"), *seed = getenv("TALK_SEED");
    uint8_t bytes[300] = {0};
    state = seed != NULL ? strtoull(seed, NULL, 10) : state;
    for (long talks = wanted != NULL ? atol(wanted)
                      : emulated()   ? 25
                                     : 150;
         talks > 0; talks--) {
        bytes[0] = 0; /* a right setup, */
        bytes[1] = bytes[2] = 0;
        bytes[3] = 20;
        bytes[4] = 1; /* and a right job first, as a rule */
        for (size_t i = talks % 4 == 0 ? 0 : 7; i < sizeof bytes; i++)
            bytes[i] = draw();
        talk_run(bytes, sizeof bytes);
    }
}
