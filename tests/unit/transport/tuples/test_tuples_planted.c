/* The same with a fault in it, a tuple that two may take: it is found. */
#define INCODE_PLANT_TAKEN_BY_TWO
#include "transport/tuples/request.c" /* NOLINT(bugprone-suspicious-include) */

#include "tuples_history.h"

enum { SEEDS = 200 };

TEST(found) {
    unsigned wrong = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct history h;
        play(&h, seed);
        wrong += !is_explained(&h);
    }
    print_message("found by %u seeds of %u\n", wrong, (unsigned)SEEDS);
    assert_true(wrong > 0);
}
