/* Commits count once, for the node that has the job, under its epoch; a loss
 * takes the uncommitted tetrahedra with it, and no others, and their bricks are
 * given out again. */

#include "host/service/ledger.h"
#include "tests/unit/test.h"

TEST(test_commits) {
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

/* 512 points along x in two regions, so that vertex order is lexicographic
 * order: the brick that owns a tetrahedron is that of its lowest number. */
static struct incode_brick bricks[8];
static struct host_region regions[4] = {{.first = 0, .last = 3},
                                        {.first = 3, .last = 3},
                                        {.first = 3, .last = 8},
                                        {.first = 8, .last = 8}};

static struct host_order make_order(void) {
    struct host_order order = {0};
    for (uint32_t v = 0; v < 512; v++) {
        bricks[v / 64].x[v % 64] = v;
        bricks[v / 64].y[v % 64] = v % 7;
        bricks[v / 64].z[v % 64] = v % 5;
    }
    order.brick = bricks;
    order.bricks = 8;
    order.region = regions;
    order.regions = 4;
    return order;
}

/* A tetrahedron for each of the vertices [0, 509), its vertices in any order
 * but the lowest that one. */
static void fill(struct host_tetrahedra *tets) {
    struct host_error error = {0};
    for (uint32_t v = 0; v + 3 < 512; v++) {
        uint32_t(*row)[4] = host_tetrahedra_room(tets, 1, &error);
        assert_non_null(row);
        for (uint32_t k = 0; k < 4; k++)
            (*row)[k] = v + (k + v) % 4;
        host_tetrahedra_keep(tets, 1);
    }
}

TEST(test_abandon) {
    struct host_order order = make_order();
    struct host_ledger ledger;
    struct host_tetrahedra tets = {0};
    struct host_error error = {0};
    assert_int_equal(host_ledger_init(&ledger, 8, 2, &error), 0);
    uint32_t stays = host_ledger_open(&ledger, 0, 0, 3);
    uint32_t lost = host_ledger_open(&ledger, 1, 3, 8);
    fill(&tets);
    /* Found by turns: 100 by node 0, 100 by node 1, and so on. */
    for (uint64_t i = 0; i < tets.count; i += 100) {
        uint64_t left = tets.count - i;
        assert_int_equal(host_ledger_found(&ledger, i / 100 % 2,
                                           left < 100 ? left : 100, &error),
                         0);
        assert_int_equal(host_ledger_found(&ledger, 7, 0, &error), 0);
    }
    assert_int_equal(ledger.runs, 6);
    for (uint64_t i = 0; i < tets.count; i++)
        assert_int_equal(host_ledger_finder(&ledger, i), i / 100 % 2);
    assert_int_equal(host_ledger_commit(&ledger, 0, 1), 0);
    assert_int_equal(host_ledger_commit(&ledger, 1, 6), 0);
    assert_int_equal(host_ledger_abandon(&ledger, 4, &order, &tets), 509 - 128);
    /* Every job is closed, the other nodes' too. */
    assert_false(host_ledger_current(&ledger, 0, stays));
    assert_false(host_ledger_current(&ledger, 1, lost));
    assert_int_equal(host_ledger_commit(&ledger, 0, 2), -1);
    assert_int_equal(host_ledger_finish(&ledger, 0), -1);
    assert_int_equal(tets.count, 128);
    for (uint64_t i = 0; i < tets.count; i++) {
        uint32_t v = (uint32_t)(i < 64 ? 64 + i : 384 - 64 + i);
        assert_int_equal(tets.v[i][0], v + v % 4);
        assert_int_equal(host_ledger_finder(&ledger, i), v / 100 % 2);
    }
    /* What is to be done again goes with the next loss, alone. */
    assert_int_equal(ledger.by[1], 0);
    assert_int_equal(ledger.by[6], 1);
    ledger.alone = true;
    host_ledger_reopen(&ledger, 6);
    assert_int_equal(host_ledger_abandon(&ledger, 1, &order, &tets), 64);
    assert_int_equal(tets.count, 64);
    assert_int_equal(host_ledger_open(&ledger, 1, 6, 7), lost + 1);
    assert_int_equal(host_ledger_commit(&ledger, 1, 6), 0);
    assert_int_equal(ledger.by[6], 1 | HOST_LEDGER_ALONE);
    host_tetrahedra_free(&tets);
    host_ledger_free(&ledger);
}

/* What is left is given out again, once, in ranges that are in order, within a
 * region, and no larger than they should be. */
TEST(test_ranges) {
    struct host_order order = make_order();
    struct host_tetrahedra none = {0};
    static const struct {
        uint32_t pieces;
        const char *committed, *ranges;
    } cases[] = {
        {1, "", "0-3 3-8 "},
        {1, "1", "0-1 2-3 3-8 "},
        {1, "0127", "3-7 "},
        {4, "0127", "3-5 5-7 "},
        {16, "34", "0-1 1-2 2-3 5-6 6-7 7-8 "},
        {1, "01234567", ""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct host_ledger ledger;
        struct host_error error = {0};
        uint32_t first, last, before = 0;
        char ranges[64] = "";
        assert_int_equal(host_ledger_init(&ledger, 8, 1, &error), 0);
        uint32_t epoch = host_ledger_open(&ledger, 0, 0, 8);
        for (const char *c = cases[i].committed; *c != '\0'; c++) {
            assert_int_equal(
                host_ledger_commit(&ledger, 0, (uint32_t)(*c - '0')), 0);
        }
        (void)host_ledger_abandon(&ledger, cases[i].pieces, &order, &none);
        while (host_ledger_next(&ledger, &order, &first, &last)) {
            char range[16];
            assert_true(first >= before && first < last);
            before = last;
            snprintf(range, sizeof range, "%u-%u ", first, last);
            strcat(ranges, range);
            uint32_t again = host_ledger_open(&ledger, 0, first, last);
            assert_true(again > epoch);
            epoch = again;
            while (first < last)
                assert_int_equal(host_ledger_commit(&ledger, 0, first++), 0);
            assert_int_equal(host_ledger_finish(&ledger, 0), 0);
        }
        assert_string_equal(ranges, cases[i].ranges);
        assert_int_equal(ledger.committed, 8);
        host_ledger_free(&ledger);
    }
}
