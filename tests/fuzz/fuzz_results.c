/* Any bytes as the results of a node that has a job: what the host takes of
 * them it can map to rows, sort, digest and write in every format. */
#include <stdlib.h>
#include <string.h>

#include "host/formats/formats.h"
#include "host/mesh/gen.h"
#include "host/service/parts.h"
#include "host/service/strategies/strategies.h"
#include "transport/drivers/sim.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { POINTS = 200, BYTES_MAX = CUBE_PAYLOAD_MAX };

static struct host_points points;
static struct host_order order;
static struct host_machine machine;
static struct host_service service;
static struct host_tetrahedra tets;
static struct sim_end nowhere;

static void demand(bool holds) {
    if (!holds)
        abort();
}

static void told(void *context, const char *line) {
    (void)context;
    demand(strncmp(line, "node 0 link 0: ", 15) == 0);
}

/* Points and their order, once; a service of one node. */
static void begin(void) {
    struct host_error error = {0};
    struct cube_config config = {.self = CUBE_HOST, .window = 1, .epoch = 1};
    config.pipes[0] = sim_pipe(&nowhere);
    if (points.count == 0) {
        demand(host_gen("uniform", POINTS, 1, &points, &error) == 0);
        demand(host_order_make(&order, "points", points.xyz, points.count,
                               HOST_ADAPTIVE, 1, false, &error) == 0);
    }
    memset(&service, 0, sizeof service);
    machine.nodes = 1;
    machine.told = told;
    service.machine = &machine;
    service.order = &order;
    service.tets = &tets;
    service.strategy = &host_spatial;
    service.work.ledger = &service.ledger;
    service.work.lost = calloc(1, sizeof *service.work.lost);
    service.node = calloc(1, sizeof *service.node);
    service.report = calloc(1, sizeof *service.report);
    service.cube_memory = malloc(cube_arena_bytes(&config));
    demand(service.work.lost != NULL && service.node != NULL &&
           service.report != NULL && service.cube_memory != NULL);
    service.cube =
        cube_init(service.cube_memory, cube_arena_bytes(&config), &config);
    service.started = true;
    demand(host_ledger_init(&service.ledger, order.bricks, 1, &error) == 0);
    (void)host_ledger_open(&service.ledger, 0, 0, order.bricks);
}

static void end(void) {
    host_ledger_free(&service.ledger);
    free(service.cube_memory);
    free(service.node);
    free(service.report);
    free(service.work.lost);
    host_tetrahedra_free(&tets);
}

/* Hands the bytes over as messages, their lengths among them. */
static void take(const uint8_t *data, size_t size) {
    uint8_t body[BYTES_MAX];
    while (size > 0) {
        size_t length = (size_t)1 + data[0], head = 8;
        struct node_result_header header = {service.ledger.job[0].epoch,
                                            service.node[0].received};
        struct host_error error = {0};
        data++, size--;
        length = length < size ? length : size;
        memcpy(body, &header, head);
        memcpy(body + head, data, length);
        struct cube_message message = {0, (uint16_t)(head + length),
                                       NODE_RESULT, body};
        int status = host_handle(&service, &message, &error);
        demand(status == error.code && (status == 0 || status == HOST_CUBE ||
                                        status == HOST_UNVERIFIED));
        data += length, size -= length;
    }
}

/* The first byte chooses the format of the output. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct host_digest digest;
    struct host_error error = {0};
    if (size == 0)
        return 0;
    begin();
    take(data + 1, size - 1);
    host_tetrahedra_map(&tets, order.row);
    for (uint64_t i = 0; i < 4 * tets.count; i++)
        demand(tets.v[i / 4][i % 4] < points.count);
    host_tetrahedra_sort(&tets);
    host_digest(&tets, &digest);
    unsigned formats = 0;
    while (host_format_row(formats) != NULL)
        formats++;
    demand(formats > 0);
    const struct host_format *format = host_format_row(data[0] % formats);
    if (tets.count > 0 && format->write_tetrahedra != NULL && !format->apart) {
        struct host_output out;
        demand(host_output_open(&out, "/dev/null", &error) == 0);
        (void)format->write_tetrahedra(&out, NULL, &points, &tets, &error);
        (void)host_output_close(&out, 1, &error);
    }
    end();
    return 0;
}
