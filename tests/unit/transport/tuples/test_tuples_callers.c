/* Several callers at once: whatever they see, some order of their calls
 * explains it. */
#include "tuples_history.h"

enum { SEEDS = 6000 };

TEST(explained) {
    uint32_t taken = 0, none = 0, waited = 0;
    for (uint64_t seed = 0; seed < SEEDS; seed++) {
        struct history h;
        play(&h, seed);
        if (!is_explained(&h)) {
            fail_msg("seed %u: no order of the calls explains their results",
                     (unsigned)seed);
        }
        for (unsigned i = 0; i < h.callers * h.calls; i++) {
            const struct call *c = &h.call[i / h.calls][i % h.calls];
            bool takes = c->verb == CALL_IN || c->verb == CALL_INP;
            taken += c->ended != NEVER && takes && !c->none;
            none += c->ended != NEVER && c->none;
            waited += c->ended == NEVER && c->began != NEVER;
        }
    }
    assert_true(taken > SEEDS && none > SEEDS / 2 && waited > SEEDS / 10);
}

/* What the explainer must not take. */
TEST(tells_wrong) {
    struct history h;
    memset(&h, 0, sizeof h);
    h.callers = 3;
    h.calls = 1;
    h.call[0][0] = (struct call){.verb = CALL_OUT, .began = 1, .ended = 4};
    h.call[1][0] = (struct call){.verb = CALL_IN, .began = 1, .ended = 6};
    h.call[2][0] =
        (struct call){.verb = CALL_RDP, .none = true, .began = 5, .ended = 8};
    assert_true(is_explained(&h));
    h.call[1][0].began = 9; /* it was there all the time */
    h.call[1][0].ended = 10;
    assert_false(is_explained(&h));
    h.call[2][0] = h.call[1][0]; /* it was taken by two */
    assert_false(is_explained(&h));
    h.call[2][0].ended = NEVER;
    assert_true(is_explained(&h));
    h.stored = 1; /* it is still there */
    assert_false(is_explained(&h));
    h.call[1][0].ended = NEVER; /* they wait for what is there */
    assert_false(is_explained(&h));
}
