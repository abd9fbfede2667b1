/* Commits count once, for the node that has the job, under its epoch; and a
 * lost job takes its uncommitted tetrahedra with it, and no others. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "../../host/ledger.h"

static void test_commits(void **unused)
{
    (void)unused;
    struct host_ledger ledger;
    struct host_error error = {0};
    assert_int_equal(host_ledger_init(&ledger, 100, 2, &error), 0);
    uint32_t a = host_ledger_open(&ledger, 0, 0, 64);
    uint32_t b = host_ledger_open(&ledger, 1, 64, 100);
    assert_int_not_equal(a, 0);
    assert_int_not_equal(a, b);
    assert_true(host_ledger_current(&ledger, 0, a));
    assert_false(host_ledger_current(&ledger, 0, b));
    assert_false(host_ledger_current(&ledger, 1, 0));
    assert_false(host_ledger_current(&ledger, 2, a));
    assert_int_equal(host_ledger_commit(&ledger, 0, 64), -1);
    assert_int_equal(host_ledger_commit(&ledger, 1, 63), -1);
    for (uint32_t brick = 0; brick < 100; brick++) {
        assert_false(host_ledger_committed(&ledger, brick));
        assert_int_equal(host_ledger_finish(&ledger, brick < 64 ? 0 : 1), -1);
        assert_int_equal(host_ledger_commit(&ledger, brick < 64 ? 0 : 1, brick),
                         0);
        assert_int_equal(host_ledger_commit(&ledger, brick < 64 ? 0 : 1, brick),
                         -1);
        assert_true(host_ledger_committed(&ledger, brick));
    }
    assert_int_equal(ledger.committed, 100);
    assert_int_equal(host_ledger_finish(&ledger, 0), 0);
    assert_false(host_ledger_current(&ledger, 0, a));
    assert_int_equal(host_ledger_finish(&ledger, 1), 0);
    host_ledger_free(&ledger);
}

/* 256 points along x, so that vertex order is lexicographic order: the brick
 * that owns a tetrahedron is that of its lowest number. */
static void test_abandon(void **unused)
{
    (void)unused;
    static struct incode_brick bricks[4];
    struct host_order order = {0};
    struct host_ledger ledger;
    struct host_tetrahedra tets = {0};
    struct host_error error = {0};
    for (uint32_t v = 0; v < 256; v++) {
        bricks[v / 64].x[v % 64] = v;
        bricks[v / 64].y[v % 64] = v % 7;
        bricks[v / 64].z[v % 64] = v % 5;
    }
    order.brick = bricks;
    order.bricks = 4;
    assert_int_equal(host_ledger_init(&ledger, 4, 2, &error), 0);
    (void)host_ledger_open(&ledger, 0, 0, 2);
    uint32_t lost = host_ledger_open(&ledger, 1, 2, 4);
    for (uint32_t v = 0; v + 3 < 256; v++) {
        uint32_t(*row)[4] = host_tetrahedra_room(&tets, 1, &error);
        assert_non_null(row);
        for (uint32_t k = 0; k < 4; k++) {
            (*row)[k] = v + (k + v) % 4;
        }
        host_tetrahedra_keep(&tets, 1);
    }
    assert_int_equal(host_ledger_commit(&ledger, 1, 3), 0);
    assert_int_equal(host_ledger_abandon(&ledger, 1, &order, &tets), 64);
    assert_false(host_ledger_current(&ledger, 1, lost));
    assert_int_equal(tets.count, 253 - 64);
    for (uint64_t i = 0; i < tets.count; i++) {
        uint32_t v = (uint32_t)(i < 128 ? i : i + 64);
        assert_int_equal(tets.v[i][0], v + v % 4);
    }
    /* The same bricks again, to another node, under a new epoch. */
    uint32_t again = host_ledger_open(&ledger, 1, 2, 3);
    assert_true(again > lost);
    assert_int_equal(host_ledger_commit(&ledger, 1, 2), 0);
    assert_int_equal(host_ledger_commit(&ledger, 1, 3), -1);
    host_tetrahedra_free(&tets);
    host_ledger_free(&ledger);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_commits),
        cmocka_unit_test(test_abandon),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
