/* A run of a strategy at its beginning, on four nodes, with no service behind
 * it: tests call the strategy's functions. */
#ifndef TESTS_UNIT_BEGUN_STRATEGY_H
#define TESTS_UNIT_BEGUN_STRATEGY_H

#include <stdlib.h>
#include <string.h>

#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "tests/unit/test.h"

enum { NODES = 4 };

static struct host_points points;
static struct host_order order;
static struct host_ledger ledger;
static struct host_tetrahedra tets;
static bool lost[NODES];
static struct host_work work;

static int set_up(void **unused) {
    (void)unused;
    struct host_error error = {0};
    return host_gen("uniform", 3000, 1, &points, &error);
}

static int tear_down(void **unused) {
    (void)unused;
    host_points_free(&points);
    return 0;
}

/* A run of this strategy at its beginning: all nodes have their setup. */
static void begin(const struct host_strategy *strategy) {
    struct host_error error = {0};
    assert_int_equal(host_order_make(&order, "test", points.xyz, points.count,
                                     HOST_ADAPTIVE, strategy->regions(NODES),
                                     false, &error),
                     0);
    assert_int_equal(host_ledger_init(&ledger, order.bricks, NODES, &error), 0);
    memset(&tets, 0, sizeof tets);
    memset(lost, 0, sizeof lost);
    work = (struct host_work){.nodes = NODES,
                              .living = NODES,
                              .lost = lost,
                              .order = &order,
                              .ledger = &ledger,
                              .tets = &tets};
    work.state = calloc(1, strategy->state_bytes + 1);
    assert_non_null(work.state);
}

static void end(void) {
    free(work.state);
    host_order_free(&order);
    host_ledger_free(&ledger);
    host_tetrahedra_free(&tets);
}

/* The roles of the nodes, one character each. */
static const char *roles(const struct host_strategy *strategy) {
    static char text[NODES + 1];
    for (unsigned i = 0; i < NODES; i++) {
        struct node_setup_message setup = {0};
        strategy->set_up(&work, i, &setup);
        text[i] = setup.role == NODE_WORKER     ? 'w'
                  : setup.role == NODE_HOLDER   ? 'h'
                  : setup.role == NODE_MANAGER  ? 'm'
                  : setup.role == NODE_BUILDER  ? 'b'
                  : setup.role == NODE_EXCHANGE ? 'e'
                                                : '?';
        for (unsigned k = 1; k < NODES; k++) {
            struct node_setup_message other = {0};
            strategy->set_up(&work, k, &other);
            assert_int_equal(other.holders, setup.holders);
        }
    }
    return text;
}

static void lose(const struct host_strategy *strategy, unsigned node) {
    lost[node] = true;
    work.living--;
    strategy->lose(&work);
}

static uint32_t give(unsigned node, const struct incode_job *job) {
    return host_ledger_open(&ledger, node, job->first, job->last);
}

#endif
