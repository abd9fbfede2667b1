/* Numbers and sizes as a user may write them, and as not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "host/base/parse.h"

static void test_bytes(void **unused)
{
    (void)unused;
    static const struct {
        const char *text;
        uint64_t bytes;
    } good[] = {{"0", 0},
                {"4194304", 4194304},
                {"512K", 524288},
                {"512k", 524288},
                {"4M", 4194304},
                {"4MiB", 4194304},
                {"1G", UINT64_C(1) << 30}};
    static const char *const bad[] = {"",
                                      "K",
                                      "-1",
                                      "4T",
                                      "4MB",
                                      "4M4",
                                      " 4",
                                      "4 M",
                                      "0x4",
                                      "4Mi",
                                      "99999999999999999999",
                                      "18446744073709551615G"};
    uint64_t bytes;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(host_parse_bytes(good[i].text, &bytes), 0);
        assert_int_equal(bytes, good[i].bytes);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(host_parse_bytes(bad[i], &bytes), -1);
    }
}

static void test_numbers(void **unused)
{
    (void)unused;
    uint64_t n;
    assert_int_equal(host_parse_number("7", 1, 7, &n), 0);
    assert_int_equal(n, 7);
    assert_int_equal(
        host_parse_number("18446744073709551615", 0, UINT64_MAX, &n), 0);
    assert_int_equal(host_parse_number("8", 1, 7, &n), -1);
    assert_int_equal(host_parse_number("0", 1, 7, &n), -1);
    assert_int_equal(host_parse_number("+3", 1, 7, &n), -1);
    assert_int_equal(host_parse_number("3x", 1, 7, &n), -1);
    assert_int_equal(host_parse_number("", 0, 7, &n), -1);
    assert_int_equal(
        host_parse_number("18446744073709551616", 0, UINT64_MAX, &n), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bytes),
                                       cmocka_unit_test(test_numbers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
