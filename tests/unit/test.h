/* What every unit test includes: cmocka with the headers that it asks for, and
 * short forms of a test and of a program of tests.
 *
 *     TEST(test_sum) { assert_int_equal(sum(1, 2), 3); }
 *     TEST_MAIN(cmocka_unit_test(test_sum))
 */
#ifndef TESTS_UNIT_TEST_H
#define TESTS_UNIT_TEST_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* A test without a state of its own. */
#define TEST(name) static void name(__attribute__((unused)) void **unused_state)

#define TEST_MAIN(...)                                                         \
    int main(void) {                                                           \
        const struct CMUnitTest tests[] = {__VA_ARGS__};                       \
        return cmocka_run_group_tests(tests, NULL, NULL);                      \
    }

#endif
