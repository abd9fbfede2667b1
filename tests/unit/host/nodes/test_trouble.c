/* Boards are troubled one after the other, each once, and a stop ends. */

#include "host/nodes/cluster.h"
#include "tests/unit/test.h"

enum { EVERY_US = 1000 };

TEST(each_board_once) {
    enum host_trouble_kind kind;
    unsigned node, resets = 0;
    struct host_troubled t = {.nodes = 4};
    t.trouble.every_us[HOST_TROUBLE_RESET] = EVERY_US;
    for (uint64_t now = 1; now < 20 * EVERY_US; now += EVERY_US / 10) {
        if (host_trouble_due(&t, now, &kind, &node)) {
            assert_int_equal(kind, HOST_TROUBLE_RESET);
            assert_int_equal(node, resets);
            resets++;
            assert_true(now >= resets * EVERY_US);
        }
    }
    assert_int_equal(resets, 4);
}

TEST(each_stop_ends) {
    enum host_trouble_kind kind;
    unsigned node, stops = 0, ends = 0;
    struct host_troubled t = {.nodes = 2};
    t.trouble.every_us[HOST_TROUBLE_STOP] = EVERY_US;
    for (uint64_t now = 1; now < 20 * EVERY_US; now += EVERY_US / 10) {
        if (host_trouble_due(&t, now, &kind, &node)) {
            assert_int_equal(node, ends);
            assert_int_equal(kind, stops == ends ? HOST_TROUBLE_STOP
                                                 : HOST_TROUBLE_CONT);
            *(stops == ends ? &stops : &ends) += 1;
        }
    }
    assert_int_equal(stops, 2);
    assert_int_equal(ends, 2);
}

TEST(none_where_none_is_wanted) {
    enum host_trouble_kind kind;
    unsigned node;
    struct host_troubled t = {.nodes = 2};
    for (uint64_t now = 1; now < 20 * EVERY_US; now += EVERY_US)
        assert_false(host_trouble_due(&t, now, &kind, &node));
}
