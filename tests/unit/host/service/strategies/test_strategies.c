/* Each strategy's functions by themselves: roles, first jobs, next jobs,
 * commits, and what a loss leaves; and what holds for every row of the table.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"

enum { NODES = 4 };

static struct host_points points;
static struct host_order order;
static struct host_ledger ledger;
static struct host_tetrahedra tets;
static bool lost[NODES];
static struct host_work work;

static int set_up(void **unused)
{
    (void)unused;
    struct host_error error = {0};
    return host_gen("uniform", 3000, 1, &points, &error);
}

static int tear_down(void **unused)
{
    (void)unused;
    host_points_free(&points);
    return 0;
}

/* A run of this strategy at its beginning: all nodes have their setup. */
static void begin(const struct host_strategy *strategy)
{
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

static void end(void)
{
    free(work.state);
    host_order_free(&order);
    host_ledger_free(&ledger);
    host_tetrahedra_free(&tets);
}

/* The roles of the nodes, one character each. */
static const char *roles(const struct host_strategy *strategy)
{
    static char text[NODES + 1];
    for (unsigned i = 0; i < NODES; i++) {
        struct node_setup_message setup = {0};
        strategy->set_up(&work, i, &setup);
        text[i] = setup.role == NODE_WORKER   ? 'w'
                  : setup.role == NODE_HOLDER ? 'h'
                                              : '?';
        for (unsigned k = 1; k < NODES; k++) {
            struct node_setup_message other = {0};
            strategy->set_up(&work, k, &other);
            assert_int_equal(other.holders, setup.holders);
        }
    }
    return text;
}

static void lose(const struct host_strategy *strategy, unsigned node)
{
    lost[node] = true;
    work.living--;
    strategy->lose(&work);
}

static uint32_t give(unsigned node, const struct incode_job *job)
{
    return host_ledger_open(&ledger, node, job->first, job->last);
}

/* The box is that of the job's points, or of their region. */
static void check_box(const struct incode_job *job)
{
    for (uint32_t v = job->first * INCODE_BRICK_POINTS;
         v < job->last * INCODE_BRICK_POINTS; v++) {
        double p[3];
        host_vertex(&order, v, p);
        for (int k = 0; k < 3; k++) {
            assert_true(job->lo[k] <= p[k] && p[k] <= job->hi[k]);
        }
    }
}

static void commit_all(const struct host_strategy *strategy, unsigned node,
                       const struct incode_job *job)
{
    for (uint32_t b = job->first; b < job->last; b++) {
        assert_int_equal(strategy->commit(&work, node, b), 0);
    }
    assert_int_equal(host_ledger_finish(&ledger, node), 0);
}

static void test_sequential(void **unused)
{
    (void)unused;
    const struct host_strategy *s = &host_sequential;
    struct incode_job job, none;
    assert_int_equal(s->regions(1), 1);
    begin(s);
    assert_int_equal(order.regions, 1);
    assert_string_equal(roles(s), "whhh");
    assert_true(s->first(&work, 0, &job));
    assert_int_equal(job.first, 0);
    assert_int_equal(job.last, order.bricks);
    check_box(&job);
    (void)give(0, &job);
    for (unsigned i = 1; i < NODES; i++) {
        assert_false(s->first(&work, i, &none));
    }
    for (unsigned i = 0; i < NODES; i++) {
        assert_false(s->next(&work, i, &none));
    }
    /* Bricks 0 to 4 are done when node 0 is lost: the rest is node 1's, whole,
     * and no node holds pages any more. */
    for (uint32_t b = 0; b < 5; b++) {
        assert_int_equal(s->commit(&work, 0, b), 0);
    }
    lose(s, 0);
    assert_string_equal(roles(s), "wwww");
    for (unsigned i = 1; i < NODES; i++) {
        assert_false(s->first(&work, i, &none));
    }
    assert_false(s->next(&work, 2, &none));
    assert_false(s->next(&work, 3, &none));
    assert_true(s->next(&work, 1, &job));
    assert_int_equal(job.first, 5);
    assert_int_equal(job.last, order.bricks);
    check_box(&job);
    (void)give(1, &job);
    assert_false(s->next(&work, 1, &none));
    commit_all(s, 1, &job);
    assert_int_equal(ledger.committed, order.bricks);
    end();
}

static void test_spatial_first(void **unused)
{
    (void)unused;
    const struct host_strategy *s = &host_spatial;
    struct incode_job job, none;
    begin(s);
    assert_int_equal(order.regions, NODES);
    assert_string_equal(roles(s), "wwww");
    for (unsigned i = 0; i < NODES; i++) {
        const struct host_region *region = &order.region[i];
        assert_true(s->first(&work, i, &job));
        assert_int_equal(job.first, region->first);
        assert_int_equal(job.last, region->last);
        assert_memory_equal(job.lo, region->lo, sizeof job.lo);
        assert_memory_equal(job.hi, region->hi, sizeof job.hi);
        check_box(&job);
        (void)give(i, &job);
    }
    for (unsigned i = 0; i < NODES; i++) {
        assert_false(s->next(&work, i, &none));
    }
    /* A brick is for its own node to commit, once. */
    assert_int_equal(s->commit(&work, 1, 0), -1);
    assert_int_equal(s->commit(&work, 0, 0), 0);
    assert_int_equal(s->commit(&work, 0, 0), -1);
    end();
}

/* After a loss everybody takes of what is left, and all of it is done; two
 * ranges a node, or one where it is alone. */
static void test_spatial_loss(void **unused)
{
    (void)unused;
    const struct host_strategy *s = &host_spatial;
    for (unsigned gone = 1; gone < NODES; gone++) {
        struct incode_job job;
        unsigned given = 0;
        begin(s);
        for (unsigned i = 0; i < NODES; i++) {
            assert_true(s->first(&work, i, &job));
            (void)give(i, &job);
        }
        assert_int_equal(s->commit(&work, 2, order.region[2].first), 0);
        for (unsigned i = 0; i < gone; i++) {
            lose(s, i);
        }
        assert_string_equal(roles(s), "wwww");
        assert_false(s->first(&work, NODES - 1, &job));
        unsigned turn = gone;
        uint32_t most = 0;
        while (s->next(&work, turn, &job)) {
            check_box(&job);
            most = job.last - job.first > most ? job.last - job.first : most;
            (void)give(turn, &job);
            commit_all(s, turn, &job);
            turn = turn + 1 < NODES ? turn + 1 : gone;
            given++;
        }
        assert_int_equal(ledger.committed, order.bricks);
        assert_true(given >= NODES);
        unsigned living = NODES - gone;
        assert_true(living == 1 ||
                    most <= (order.bricks - 1) / (2 * living) + 1);
        end();
    }
}

/* Nothing is done, and nodes only start again: each has its region again. */
static void test_spatial_restart(void **unused)
{
    (void)unused;
    const struct host_strategy *s = &host_spatial;
    struct incode_job job;
    begin(s);
    assert_true(s->first(&work, 0, &job));
    uint32_t before = give(0, &job);
    s->lose(&work);
    assert_false(host_ledger_current(&ledger, 0, before));
    for (unsigned i = 0; i < NODES; i++) {
        assert_true(s->first(&work, i, &job));
        assert_int_equal(job.first, order.region[i].first);
        assert_int_equal(job.last, order.region[i].last);
    }
    end();
}

/* The first node that is given bricks at the beginning, and its job; NODES: a
 * strategy that gives none. */
static unsigned first_with_bricks(const struct host_strategy *s,
                                  struct incode_job *job)
{
    unsigned node = 0;
    while (node < NODES &&
           !(s->first(&work, node, job) && job->first + 2 <= job->last)) {
        node++;
    }
    return node;
}

/* What comes of a brick that is not committed goes with a loss. */
static void test_lost_tetrahedra(void **unused)
{
    (void)unused;
    unsigned tried = 0;
    for (unsigned r = 0; host_strategy_row(r) != NULL; r++) {
        const struct host_strategy *s = host_strategy_row(r);
        struct host_error error = {0};
        struct incode_job job;
        begin(s);
        unsigned node = first_with_bricks(s, &job);
        if (node == NODES) {
            end();
            continue;
        }
        tried++;
        (void)give(node, &job);
        uint32_t v = job.first * INCODE_BRICK_POINTS; /* of its first brick */
        uint32_t(*row)[4] = host_tetrahedra_room(&tets, 2, &error);
        assert_non_null(row);
        for (uint32_t i = 0; i < 4; i++) {
            row[0][i] = v + i;
            row[1][i] = v + INCODE_BRICK_POINTS + i;
        }
        host_tetrahedra_keep(&tets, 2);
        assert_int_equal(s->commit(&work, node, job.first + 1), 0);
        s->lose(&work);
        assert_int_equal(tets.count, 1);
        assert_int_equal(tets.v[0][0], v + INCODE_BRICK_POINTS);
        end();
    }
    assert_true(tried > 0);
}

/* Every row can be run and named, and only by its own name. */
static void test_table(void **unused)
{
    (void)unused;
    const struct host_task task = {1000, 4u << 20, NODES};
    unsigned rows = 0;
    for (; host_strategy_row(rows) != NULL; rows++) {
        const struct host_strategy *s = host_strategy_row(rows);
        char wanted[64];
        assert_string_equal(host_strategy_name(rows), s->name);
        assert_string_equal(host_strategy_help(rows), s->help);
        assert_ptr_equal(host_strategy_named(s->name), s);
        assert_true(s->title[0] != '\0' && s->help[0] != '\0');
        assert_true(s->cost(&task) > 0.0);
        snprintf(wanted, sizeof wanted, ",%s,", s->name);
        assert_null(strstr(host_strategies_elsewhere, wanted));
        for (unsigned nodes = 1; nodes <= 1024; nodes *= 2) {
            unsigned regions = s->regions(nodes);
            assert_true(regions > 0 && (regions & (regions - 1)) == 0);
        }
    }
    assert_true(rows >= 2);
    assert_string_equal(host_strategy_name(rows), "auto");
    assert_non_null(host_strategy_help(rows));
    assert_null(host_strategy_name(rows + 1));
    assert_null(host_strategy_help(rows + 1));
    assert_null(host_strategy_named("auto"));
    assert_null(host_strategy_row(UINT32_MAX));
}

/* The memory that is asked for does for every role that a strategy gives, and
 * is no more than one of them needs. */
static void test_arena(void **unused)
{
    (void)unused;
    const struct node_identity identity = {.dimension = 2, .epoch = 1};
    const struct node_setup_message given = {.setup = {.bricks = 100}};
    for (unsigned r = 0; host_strategy_row(r) != NULL; r++) {
        const struct host_strategy *s = host_strategy_row(r);
        size_t bytes =
            host_strategy_arena(s, NODES, &identity, 1u << 20, &given);
        bool needed = false;
        begin(s);
        for (unsigned i = 0; i < NODES; i++) {
            struct node_setup_message setup = given;
            s->set_up(&work, i, &setup);
            size_t one = node_arena_needed(&identity, 1u << 20, &setup);
            assert_true(one <= bytes);
            needed = needed || one == bytes;
        }
        assert_true(needed);
        end();
    }
}

static void test_auto(void **unused)
{
    (void)unused;
    for (unsigned nodes = 1; nodes <= 64; nodes *= 2) {
        const struct host_task task = {20000, 4u << 20, nodes};
        const struct host_strategy *best = host_strategy_auto(&task);
        assert_ptr_equal(best, nodes == 1 ? &host_sequential : &host_spatial);
        for (unsigned r = 0; host_strategy_row(r) != NULL; r++) {
            assert_true(best->cost(&task) <= host_strategy_row(r)->cost(&task));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sequential),
        cmocka_unit_test(test_spatial_first),
        cmocka_unit_test(test_spatial_loss),
        cmocka_unit_test(test_spatial_restart),
        cmocka_unit_test(test_lost_tetrahedra),
        cmocka_unit_test(test_table),
        cmocka_unit_test(test_arena),
        cmocka_unit_test(test_auto),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
