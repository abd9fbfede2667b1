/* What the host sends first where more is due than the wire takes. */

#include "host/service/parts.h"
#include "host/service/strategies/strategies.h"
#include "transport/drivers/sim.h"
#include "small_order.h"
#include "tests/unit/test.h"

enum { NODE = 1, NODES = 2, WINDOW = 16, NODE_OWN = 100 };

static unsigned sent; /* by the strategy */

static bool send_always(struct host_work *work, unsigned node) {
    bool went = work->write(work->context, node, NODE_OWN, NULL, 0);
    sent += went;
    return went;
}

static struct host_order order;
static struct host_service service;
static struct host_machine machine;
static struct host_node nodes[NODES];
static struct host_node_report reports[NODES];
static bool lost[NODES];
static struct sim_end nowhere; /* the wire: nobody is at its end */
static void *arena;

static void begin(const struct host_strategy *strategy) {
    struct cube_config config = {
        .self = CUBE_HOST, .dimension = 1, .window = WINDOW, .epoch = 1};
    memset(&service, 0, sizeof service);
    memset(nodes, 0, sizeof nodes);
    memset(reports, 0, sizeof reports);
    config.pipes[0] = sim_pipe(&nowhere);
    arena = aligned_alloc(64, (cube_arena_bytes(&config) + 63) / 64 * 64);
    assert_non_null(arena);
    machine.nodes = NODES;
    machine.dimension = 1;
    service.cube = cube_init(arena, cube_arena_bytes(&config), &config);
    assert_non_null(service.cube);
    service.machine = &machine;
    service.order = &order;
    service.strategy = strategy;
    service.setup.credits = nodes[NODE].credit = 8;
    service.started = true;
    service.node = nodes;
    service.report = reports;
    service.report[NODE].up = true;
    service.work.lost = lost;
    service.work.write = host_sending_write;
    service.work.context = &service;
}

static void end(void) {
    free(arena);
    arena = NULL;
}

/* A strategy that always has something to send has every other message, until
 * what the node has asked for is sent. */
TEST(test_turns) {
    struct host_strategy strategy = *host_strategy_named("spatial");
    struct host_error error = {0};
    strategy.send = send_always;
    begin(&strategy);
    nodes[NODE].pages_count = 3;
    sent = 0;
    unsigned all = host_sending_serve(&service, &error);
    assert_int_equal(error.code, 0);
    assert_true(all >= 6);
    assert_int_equal(reports[NODE].pages, 3);
    assert_int_equal(sent, all - 3);
    /* With room for a few, half of them are pages. */
    end();
    begin(&strategy);
    nodes[NODE].pages_count = HOST_PAGES_QUEUED_MAX;
    sent = 0;
    all = host_sending_serve(&service, &error);
    assert_int_equal(reports[NODE].pages, all / 2);
    assert_int_equal(sent, all - all / 2);
    end();
}

/* What a node has to know first comes first. */
TEST(test_order) {
    struct host_strategy strategy = *host_strategy_named("spatial");
    struct host_error error = {0};
    strategy.send = send_always;
    begin(&strategy);
    nodes[NODE].pages_count = HOST_PAGES_QUEUED_MAX;
    nodes[NODE].setup_due = nodes[NODE].report_due = true;
    nodes[0].report_due = true; /* it has not answered yet */
    (void)host_sending_serve(&service, &error);
    assert_false(nodes[NODE].setup_due);
    assert_false(nodes[NODE].report_due);
    assert_true(nodes[0].report_due);
    assert_int_equal(nodes[0].sent, 0);
    assert_true(host_sending_pages_wait(&service));
    end();
}

static int set_up(void **unused) {
    (void)unused;
    order = small_order(NODES);
    return 0;
}

static int tear_down(void **unused) {
    (void)unused;
    host_order_free(&order);
    return 0;
}

TEST_GROUP(set_up, tear_down)
