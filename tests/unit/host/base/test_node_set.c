/* Sets of nodes as a person writes them, and as they are told. */

#include "host/base/node_set.h"
#include "tests/unit/test.h"

TEST(test_written) {
    static const struct {
        const char *text, *printed;
        unsigned nodes, count;
    } good[] = {{"0", "0", 1, 1},
                {"all", "0", 1, 1},
                {"all", "0-7", 8, 8},
                {"0-3,7", "0-3,7", 8, 5},
                {"7,0,2,1,3", "0-3,7", 8, 5},
                {"3,3-3,2-4", "2-4", 8, 3},
                {"0,2,4", "0,2,4", 8, 3},
                {"5-7", "5-7", 8, 3},
                {"00001", "1", 2, 1},
                {"0-1023", "0-1023", 1024, 1024},
                {"1023", "1023", 1024, 1}};
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        struct host_error error = {0};
        struct host_node_set set;
        char text[64];
        assert_int_equal(
            host_node_set_parse(&set, good[i].text, good[i].nodes, &error), 0);
        assert_int_equal(error.code, 0);
        assert_int_equal(host_node_set_count(&set), good[i].count);
        host_node_set_print(&set, text, sizeof text);
        assert_string_equal(text, good[i].printed);
    }
}

TEST(test_refused) {
    static const char *const bad[] = {"",
                                      ",",
                                      "0,",
                                      ",0",
                                      "0,,1",
                                      "8",
                                      "0-8",
                                      "3-1",
                                      "-1",
                                      "1-",
                                      "0-3-",
                                      "0 1",
                                      " 0",
                                      "0-",
                                      "none",
                                      "0-3,x",
                                      "1k",
                                      "1e0",
                                      "0x1",
                                      "+1",
                                      "0;1",
                                      "1-2-3",
                                      "00000000000000000001"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct host_error error = {0};
        struct host_node_set set;
        memset(&set, 0xff, sizeof set);
        assert_int_equal(host_node_set_parse(&set, bad[i], 8, &error),
                         HOST_USAGE);
        assert_int_equal(host_node_set_count(&set), 0);
        assert_non_null(strstr(error.text, "; give numbers from 0 to 7"));
    }
}

/* Whatever room there is: a whole part, or two dots in place of the rest. */
TEST(test_cut) {
    struct host_error error = {0};
    struct host_node_set set;
    static const char whole[] = "0-3,7,100-1000";
    assert_int_equal(host_node_set_parse(&set, whole, 1024, &error), 0);
    for (size_t size = 3; size < sizeof whole + 4; size++) {
        char text[sizeof whole + 4];
        memset(text, 'x', sizeof text);
        host_node_set_print(&set, text, size);
        assert_string_equal(text, size >= sizeof whole ? whole
                                  : size >= 8          ? "0-3,7.."
                                  : size >= 6          ? "0-3.."
                                                       : "..");
    }
    memset(&set, 0, sizeof set);
    char text[3] = "xx";
    host_node_set_print(&set, text, sizeof text);
    assert_string_equal(text, "");
}

TEST(test_named) {
    struct host_node_set set = {{0}};
    char text[24];
    host_node_set_add(&set, 3);
    host_node_set_name(&set, text, sizeof text);
    assert_string_equal(text, "node 3");
    host_node_set_add(&set, 4);
    host_node_set_name(&set, text, sizeof text);
    assert_string_equal(text, "nodes 3-4");
}
