/* What every unit test includes: cmocka with the headers that it asks for, and
 * tests that list themselves, in the order in which they stand.
 *
 *   TEST(test_sum) { assert_int_equal(sum(1, 2), 3); }
 *   TEST_WITH(test_file, open_file, close_file) { use(*fixture); }
 */
#ifndef TESTS_UNIT_TEST_H
#define TESTS_UNIT_TEST_H

#include <assert.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct CMUnitTest test_list[64];
static size_t test_count;

static inline void test_add(struct CMUnitTest test) {
    if (test_count == sizeof test_list / sizeof test_list[0])
        abort();
    test_list[test_count++] = test;
}

#define TEST_ADD(name, set_up, tear_down)                                      \
    static void name(void **);                                                 \
    static __attribute__((constructor)) void name##_is_a_test(void) {          \
        test_add((struct CMUnitTest)cmocka_unit_test_setup_teardown(           \
            name, set_up, tear_down));                                         \
    }

#define TEST(name)                                                             \
    TEST_ADD(name, NULL, NULL)                                                 \
    static void name(__attribute__((unused)) void **unused)
/* Either function may be NULL. */
#define TEST_WITH(name, set_up, tear_down)                                     \
    TEST_ADD(name, set_up, tear_down)                                          \
    static void name(__attribute__((unused)) void **fixture)

static CMFixtureFunction test_set_up, test_tear_down;

/* What is done before the first test and after the last; NULL: nothing. */
#define TEST_GROUP(set_up, tear_down)                                          \
    static __attribute__((constructor)) void test_group(void) {                \
        test_set_up = set_up;                                                  \
        test_tear_down = tear_down;                                            \
    }

static inline int test_run(void) {
    return _cmocka_run_group_tests("tests", test_list, test_count, test_set_up,
                                   test_tear_down);
}

/* A program with a main of its own defines this before it includes any. */
#ifndef TEST_OWN_MAIN
int main(void) {
    return test_run();
}
#endif

#endif
