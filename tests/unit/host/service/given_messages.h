/* A service in the midst of its run, with a job at each of four nodes and no
 * cube behind it: tests give it messages one by one. */
#ifndef TESTS_UNIT_GIVEN_MESSAGES_H
#define TESTS_UNIT_GIVEN_MESSAGES_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/service/parts.h"
#include "host/service/strategies/strategies.h"
#include "node/result.h"
#include "transport/drivers/sim.h"
#include "small_order.h"
#include "tests/unit/test.h"

enum { NODES = 4 };

static struct host_service service;
static struct host_machine machine;
static struct host_order order;
static struct host_tetrahedra tets;

/* The host's end of a cube, which nobody polls: the link of a node is named
 * all the same. */
static struct sim_end nowhere;

static void *open_cube(void) {
    struct cube_config config = {
        .self = CUBE_HOST, .dimension = 2, .window = 1, .epoch = 1};
    config.pipes[0] = sim_pipe(&nowhere);
    void *arena = malloc(cube_arena_bytes(&config));
    assert_non_null(arena);
    service.cube = cube_init(arena, cube_arena_bytes(&config), &config);
    assert_non_null(service.cube);
    return arena;
}

static void *cube_arena;
static char said[400]; /* the last line to the user */

static void keep_told(void *context, const char *line) {
    (void)context;
    snprintf(said, sizeof said, "%s", line);
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

/* A service in the midst of its run, a job at each node. */
static void begin(void) {
    struct host_error error = {0};
    memset(&service, 0, sizeof service);
    memset(&tets, 0, sizeof tets);
    cube_arena = open_cube();
    machine.nodes = NODES;
    machine.dimension = 2;
    machine.told = keep_told;
    said[0] = '\0';
    service.machine = &machine;
    service.order = &order;
    service.tets = &tets;
    service.strategy = &host_spatial;
    service.work.ledger = &service.ledger;
    service.work.lost = calloc(NODES, sizeof *service.work.lost);
    assert_non_null(service.work.lost);
    service.started = true;
    service.node = calloc(NODES, sizeof *service.node);
    service.report = calloc(NODES, sizeof *service.report);
    assert_non_null(service.node);
    assert_non_null(service.report);
    assert_int_equal(
        host_ledger_init(&service.ledger, order.bricks, NODES, &error), 0);
    assert_int_equal(host_spill_init(&service.spill, 0, &error), 0);
    for (uint32_t i = 0; i < NODES; i++) {
        (void)host_ledger_open(&service.ledger, i, order.region[i].first,
                               order.region[i].last);
    }
}

static void end(void) {
    free(cube_arena);
    free(service.node);
    free(service.report);
    free(service.work.lost);
    host_ledger_free(&service.ledger);
    host_spill_free(&service.spill);
    host_tetrahedra_free(&tets);
}

static bool gap; /* messages do not say how many went before them */

static inline int send(uint16_t source, uint8_t type, const void *data,
                       size_t size, struct host_error *error) {
    /* A copy of the right size, so that a sanitizer sees reads past it. */
    uint8_t *copy = malloc(size + 1);
    assert_non_null(copy);
    if (size > 0)
        memcpy(copy, data, size);
    if (type == NODE_RESULT && size >= 8 && source < NODES && !gap)
        memcpy(copy + 4, &service.node[source].received, 4);
    if (type == NODE_UNSPILL_REQUEST && size >= 20 && source < NODES && !gap)
        memcpy(copy + 16, &service.node[source].received, 4);
    if (type == NODE_FINISHED && size >= 16 && source < NODES && !gap)
        memcpy(copy + 8, &service.node[source].received, 4);
    struct cube_message message = {source, (uint16_t)size, type, copy};
    int status = host_handle(&service, &message, error);
    free(copy);
    return status;
}

/* The second that `begin` gives out. */
enum { JOB_OF_NODE_1 = 2 };

/* A batch of one tetrahedron of node 1, and the commit of a brick of its job.
 */
static inline size_t batch_of(uint8_t *data, const uint32_t v[4],
                              uint32_t brick) {
    struct node_result_writer writer;
    struct node_result_header header = {JOB_OF_NODE_1, 0};
    const uint32_t apexes[1][3] = {{v[1], v[2], v[3]}};
    memcpy(data, &header, sizeof header);
    node_result_begin(&writer, data + sizeof header, 100, 1);
    assert_int_equal(node_result_star(&writer, v[0], apexes, 1), 1);
    assert_int_equal(node_result_commit(&writer, brick), 1);
    return sizeof header + writer.size;
}

#endif
