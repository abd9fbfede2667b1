/* The same with a fault in it, a tuple that two may take: it is found. */
#define INCODE_PLANT_TAKEN_BY_TWO
#include "transport/tuples/request.c" /* NOLINT(bugprone-suspicious-include) */

#include "tuples_history.h"

enum { SEEDS = 200 };

static void found(void **state) {
    unsigned wrong = 0;
    (void)state;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct history h;
        play(&h, seed);
        wrong += !is_explained(&h);
    }
    print_message("found by %u seeds of %u\n", wrong, (unsigned)SEEDS);
    assert_true(wrong > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(found)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
