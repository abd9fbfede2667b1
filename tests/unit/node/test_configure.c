/* The windows that suit a node's memory and its wires. */

#include "node/answers.h"
#include "tests/unit/test.h"

TEST(test_windows) {
    struct node_identity id = {.epoch = 1};
    struct cube_config config = node_configure(&id, 4u << 20);
    assert_int_equal(config.window, 8);
    assert_int_equal(config.host_window, 16);
    assert_int_equal(node_configure(&id, 2u << 20).host_window, 0);
    id.serial_baud = 921600;
    assert_int_equal(node_configure(&id, 4u << 20).host_window, 0);
    id.serial_baud = 0;
    id.window = 3;
    config = node_configure(&id, 4u << 20);
    assert_int_equal(config.window, 3);
    assert_int_equal(config.host_window, 0);
}
