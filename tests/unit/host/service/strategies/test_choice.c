/* The table of strategies, and the choice among them. */

#include "host/service/strategies/strategies.h"
#include "tests/unit/test.h"

enum { NODES = 4 };

/* Every row can be run and named, and only by its own name. */
TEST(test_table) {
    const struct host_task task = {.points = 1000,
                                   .memory = 4u << 20,
                                   .nodes = NODES,
                                   .processors = NODES};
    unsigned rows = 0;
    for (; host_strategy_row(rows) != NULL; rows++) {
        const struct host_strategy *s = host_strategy_row(rows);
        assert_string_equal(host_strategy_name(rows), s->name);
        assert_string_equal(host_strategy_help(rows), s->help);
        assert_ptr_equal(host_strategy_named(s->name), s);
        assert_true(s->title[0] != '\0' && s->help[0] != '\0');
        assert_true(s->cost(&task).busiest > 0.0 &&
                    s->cost(&task).total >= s->cost(&task).busiest);
        for (unsigned nodes = 1; nodes <= 1024; nodes *= 2) {
            unsigned regions = s->regions(nodes);
            assert_true(regions > 0 && (regions & (regions - 1)) == 0);
        }
    }
    assert_true(rows >= 2);
    assert_string_equal(host_strategy_name(rows), "auto");
    assert_non_null(host_strategy_help(rows));
    assert_null(host_strategy_name(rows + 1));
    assert_null(host_strategy_help(rows + 1));
    assert_null(host_strategy_named("auto"));
    assert_null(host_strategy_row(UINT32_MAX));
}

static const struct host_strategy *best_of(const struct host_task *task) {
    const struct host_strategy *best = host_strategy_auto(task);
    char why[HOST_WHY_BYTES];
    for (unsigned r = 0; host_strategy_row(r) != NULL; r++) {
        assert_true(host_strategy_time(best, task) <=
                    host_strategy_time(host_strategy_row(r), task));
    }
    host_strategy_why(task, why);
    assert_ptr_equal(strstr(why, best->name), why);
    assert_non_null(strstr(why, "spatial"));
    return best;
}

/* Alone, alone; with few regions, regions; with many, where borders are most of
 * them, an exchange; and where points are inserted faster than faces found, or
 * the wire is what takes the time, alone again. */
TEST(test_auto) {
    struct host_task task = {
        .points = 20000, .memory = 4u << 20, .nodes = 1, .processors = 1};
    assert_ptr_equal(best_of(&task), &host_sequential);
    task.nodes = task.processors = 2;
    assert_ptr_equal(best_of(&task), &host_spatial);
    task.nodes = task.processors = 64;
    assert_ptr_equal(best_of(&task), &host_exchange);
    task.wire_bytes_s = 11520;
    assert_ptr_equal(best_of(&task), &host_sequential);
    task.wire_bytes_s = 0;
    task.processors = 1;
    assert_ptr_equal(best_of(&task), &host_sequential);
    task.nodes = task.processors = 2;
    task.by_points = task.uneven = true;
    assert_ptr_equal(best_of(&task), &host_sequential);
    task.nodes = task.processors = 16;
    assert_ptr_not_equal(best_of(&task), &host_sequential);
    /* Face by face one alone has no advantage, and a surface is mostly border.
     */
    task.nodes = task.processors = 2;
    task.by_points = false;
    assert_ptr_equal(best_of(&task), &host_exchange);
    task.uneven = false;
    assert_ptr_equal(best_of(&task), &host_spatial);
    /* Of points that one node inserts, two processors and their host leave
     * little to share. */
    task.by_points = task.with_host = true;
    assert_ptr_equal(best_of(&task), &host_sequential);
    task.with_host = false;
    assert_ptr_equal(best_of(&task), &host_spatial);
}
