/* The windows that suit a node's memory and its wires. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "node/answers.h"

static void test_windows(void **unused) {
    (void)unused;
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_windows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
