/* Boards are troubled one after the other, each once, and a stop ends. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "host/nodes/cluster.h"

enum { EVERY_US = 1000 };

static void each_board_once(void **unused) {
    enum host_trouble_kind kind;
    unsigned node, resets = 0;
    struct host_troubled t = {.nodes = 4};
    (void)unused;
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

static void each_stop_ends(void **unused) {
    enum host_trouble_kind kind;
    unsigned node, stops = 0, ends = 0;
    struct host_troubled t = {.nodes = 2};
    (void)unused;
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

static void none_where_none_is_wanted(void **unused) {
    enum host_trouble_kind kind;
    unsigned node;
    struct host_troubled t = {.nodes = 2};
    (void)unused;
    for (uint64_t now = 1; now < 20 * EVERY_US; now += EVERY_US)
        assert_false(host_trouble_due(&t, now, &kind, &node));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_board_once),
        cmocka_unit_test(each_stop_ends),
        cmocka_unit_test(none_where_none_is_wanted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
