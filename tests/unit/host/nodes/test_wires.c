/* The wires of a cube on this machine: which ends there are, and that each
 * leads to its other end. */
#include <unistd.h>

#include "host/nodes/cluster.h"
#include "tests/unit/test.h"

static void assert_joined(int a, int b, char mark) {
    char got = 0;
    assert_true(a >= 0 && b >= 0);
    assert_int_equal(write(a, &mark, 1), 1);
    assert_int_equal(read(b, &got, 1), 1);
    assert_int_equal(got, mark);
}

static void check(unsigned host_ports) {
    enum { NODES = 8, DIMENSION = 3 };
    struct host_wires wires;
    struct host_error error;
    const struct host_link *link = host_link_named("tcp");
    assert_int_equal(
        host_wires_make(&wires, link, NODES, DIMENSION, host_ports, &error), 0);
    for (unsigned i = 0; i < NODES; i++) {
        for (unsigned d = 0; d < DIMENSION; d++) {
            assert_joined(wires.end[i][d], wires.end[i ^ 1u << d][d],
                          (char)(8 * d + i + 1));
        }
        if (i < host_ports) {
            assert_joined(wires.host[i], wires.end[i][DIMENSION],
                          (char)(100 + i));
        } else {
            assert_int_equal(wires.host[i], -1);
            assert_int_equal(wires.end[i][DIMENSION], -1);
        }
    }
    host_wires_close(&wires);
    for (unsigned i = 0; i < NODES; i++) {
        assert_int_equal(wires.host[i], -1);
        assert_int_equal(wires.end[i][0], -1);
        assert_int_equal(wires.end[i][DIMENSION], -1);
    }
}

TEST(test_one) {
    check(1);
}

TEST(test_many) {
    check(4);
    check(8);
}
