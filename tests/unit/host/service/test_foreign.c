/* A host whose node tells of generations that the host did not begin: it
 * answers them, and does not do so for ever. */

#include "host/run/run.h"
#include "host/service/service.h"
#include "host/service/strategies/strategies.h"
#include "host/sim/sim_cube.h"
#include "transport/routes.h"
#include "tests/unit/test.h"

enum { HOST = 1, SECONDS = 20 };

/* Node 0, by hand: a link that tells what a test says. */
static struct {
    uint64_t now_us;
    struct host_sim_cube cube;
    struct link *link;
    uint32_t told;    /* the generation, */
    uint32_t beyond;  /* or that far from what the host has told */
    bool insists;     /* whatever is answered */
    uint64_t next_us; /* when it tells again */
    uint32_t heard;   /* the host's */
} node;

static uint64_t now_us(void *context) {
    (void)context;
    return node.now_us;
}

static void tell(void) {
    static uint8_t bytes[WIRING_BYTES_MAX];
    struct cube_wiring theirs = {.host_epoch = 77};
    theirs.generation = node.beyond != 0 ? node.heard + node.beyond : node.told;
    if (node.insists || node.heard == 0 ||
        wiring_after(theirs.generation, node.heard)) {
        size_t size = wiring_pack(&theirs, bytes);
        link_put_datagram(node.link, bytes, size, true);
    }
}

static void idle(void *context, uint64_t wait_us) {
    struct link_message datagram;
    struct cube_wiring wiring;
    bool ask;
    (void)context;
    node.now_us += wait_us < 1000 ? wait_us + 1 : 1000;
    link_poll(node.link, node.now_us);
    if (link_take_datagram(node.link, &datagram, &ask) &&
        wiring_unpack(&wiring, datagram.data, datagram.size, 0))
        node.heard = wiring.generation;
    if (node.now_us >= node.next_us) {
        node.next_us = node.now_us + 50000;
        tell();
    }
}

static int check(void *context, struct host_error *error) {
    (void)context;
    return node.now_us < SECONDS * 1000000u
               ? 0
               : host_fail(error, HOST_BROKEN, "nothing ends it");
}

static void stop(void *context) {
    (void)context;
}

static bool ended(void *context) {
    (void)context;
    return true;
}

/* How a host fares that waits for the node to answer. */
static struct host_error meet(void) {
    static const struct host_sim_cube_options wires = {
        .wire = {.latency_us = 50, .room = 1 << 16, .bytes = 1 << 17}};
    struct host_error error = {0};
    struct host_service service;
    struct host_machine machine = {.nodes = 1,
                                   .epoch = 5,
                                   .now_us = now_us,
                                   .idle = idle,
                                   .check = check,
                                   .ended = ended,
                                   .stop = stop};
    memset(&service, 0, sizeof service);
    assert_int_equal(
        host_sim_cube_open(&node.cube, &wires, &node.now_us, &error), 0);
    struct link_config c = {.pipe = host_sim_cube_pipe(&node.cube, 0, 0),
                            .epoch = 9,
                            .peer_node = CUBE_HOST,
                            .window = 8,
                            .message_max = 8 + CUBE_PAYLOAD_MAX};
    void *memory = malloc(link_bytes(&c));
    node.link = link_init(memory, link_bytes(&c), &c);
    assert_non_null(node.link);
    machine.pipe = host_sim_cube_pipe(&node.cube, HOST, 0);
    service.machine = &machine;
    service.strategy = host_strategy_named("sequential");
    service.patience_us = 8000000;
    (void)host_service_start(&service, &error);
    host_service_end(&service);
    host_sim_cube_close(&node.cube);
    free(memory);
    return error;
}

static void begin(void) {
    memset(&node, 0, sizeof node);
}

/* It is answered once, and takes the answer: what the host waits for then is
 * the node's answer to its ping. */
TEST(one_is_answered) {
    static const uint32_t told[] = {1, 2, 0x7fffffff, 0xfffffffe, 0xffffffff};
    for (unsigned i = 0; i < sizeof told / sizeof told[0]; i++) {
        begin();
        node.told = told[i];
        struct host_error error = meet();
        assert_int_equal(error.code, HOST_CUBE);
        assert_null(strstr(error.text, "restart the nodes"));
        assert_true(wiring_after(node.heard, told[i]));
    }
}

static void ends_soon(void) {
    struct host_error error = meet();
    assert_int_equal(error.code, HOST_CUBE);
    assert_non_null(strstr(error.text, "node 0 link 0: "));
    if (strstr(error.text, "; restart the nodes") == NULL)
        fail_msg("%s", error.text);
    assert_true(node.now_us < 2000000);
}

TEST(one_that_comes_again_ends_the_run) {
    static const uint32_t beyond[] = {1, 0x7fff, 0x8000, 0x70000000};
    for (unsigned i = 0; i < sizeof beyond / sizeof beyond[0]; i++) {
        begin();
        node.told = 1;
        node.beyond = beyond[i];
        node.insists = true;
        ends_soon();
    }
}
