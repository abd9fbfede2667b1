/* Numbers and sizes as a user may write them, and as not. */

#include "host/base/text.h"
#include "tests/unit/test.h"

TEST(test_bytes) {
    static const struct {
        const char *text;
        uint64_t bytes;
    } good[] = {{"0", 0},
                {"4194304", 4194304},
                {"512K", 524288},
                {"512k", 524288},
                {"4M", 4194304},
                {"4MiB", 4194304},
                {"4MB", 4194304},
                {"4mb", 4194304},
                {"4m", 4194304},
                {"4 MiB", 4194304},
                {"4 M", 4194304},
                {"4096K", 4194304},
                {"1G", UINT64_C(1) << 30}};
    static const char *const bad[] = {"",
                                      "K",
                                      "-1",
                                      "4T",
                                      "4MBB",
                                      "4B",
                                      "4 ",
                                      "4M4",
                                      " 4",
                                      "4  M",
                                      "0x4",
                                      "4Mi",
                                      "99999999999999999999",
                                      "18446744073709551615G"};
    uint64_t bytes;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(host_parse_bytes(good[i].text, &bytes), 0);
        assert_int_equal(bytes, good[i].bytes);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(host_parse_bytes(bad[i], &bytes), -1);
}

TEST(test_numbers) {
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

/* Whole numbers in exponent form, and no others. */
TEST(test_exponents) {
    static const struct {
        const char *text;
        uint64_t number;
    } good[] = {{"10k", 10000},   {"7K", 7000},
                {"2M", 2000000},  {"1e6", 1000000},
                {"1E6", 1000000}, {"1e+6", 1000000},
                {"2.5e3", 2500},  {"2.50e1", 25},
                {"1e0", 1},       {"0e99999", 0},
                {"0.0001e4", 1},  {"1.8446744073709551615e19", UINT64_MAX}};
    static const char *const bad[] = {"1e",
                                      "e6",
                                      "1e-1",
                                      "1.5",
                                      "2.55e1",
                                      "1.e3",
                                      "k",
                                      "1kk",
                                      "1.5k",
                                      "99999999999999999999k",
                                      "18446744073709551615k",
                                      ".5e1",
                                      "1e20",
                                      "1e6x",
                                      "1e 6",
                                      "1e++6",
                                      "1e99999999999999999999",
                                      "0x1e6",
                                      "1e6.0"};
    uint64_t n;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        assert_int_equal(host_parse_number(good[i].text, 0, UINT64_MAX, &n), 0);
        assert_true(n == good[i].number);
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(host_parse_number(bad[i], 0, UINT64_MAX, &n), -1);
}

/* What is wrong with a number of nodes, and which ones there are. */
TEST(test_nodes) {
    static const struct {
        const char *text, *said;
    } wrong[] = {{"3", "--nodes 3: not a power of two"},
                 {"0", "not a power of two"},
                 {"128", "more nodes than there can be here; allowed: 1, 2, 4, "
                         "8, 16, 32, 64, or fewer"},
                 {"-1", "not a number; allowed: 1, 2, 4, 8, 16, 32, 64"},
                 {"4294967298", "more nodes"}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct host_error error = {0};
        unsigned nodes = 7;
        assert_int_equal(host_parse_nodes("--nodes", wrong[i].text, 64,
                                          ", or fewer", &nodes, &error),
                         HOST_USAGE);
        assert_non_null(strstr(error.text, wrong[i].said));
        assert_int_equal(nodes, 7);
        error.code = 0;
        assert_int_equal(
            host_parse_nodes("--nodes", "64", 64, "", &nodes, &error), 0);
        assert_int_equal(nodes, 64);
    }
}
