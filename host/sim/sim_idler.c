#include "sim_idler.h"

#include <assert.h>
#include <string.h>

#include "node/arena.h"
#include "node/counted.h"
#include "node/message.h"

enum { WINDOW = 4 };

struct host_idler {
    const struct node_board *board;
    struct node_counted counted;
    uint32_t generation;
    struct node_pong_message pong;
    bool owes_pong, owes_ready;
    uint8_t role;
    uint64_t now_us;
};

struct host_idler *host_idler_start(const struct node_board *board)
{
    struct host_idler *n = board->arena;
    size_t own = node_aligned(sizeof *n);
    struct cube_config config;
    memset(n, 0, sizeof *n);
    memset(&config, 0, sizeof config);
    config.self = board->identity.self;
    config.dimension = board->identity.dimension;
    config.window = WINDOW;
    config.epoch = board->identity.epoch;
    config.host_port = board->identity.host_port;
    config.host_ports = board->identity.host_ports;
    config.dead_us = board->identity.dead_us;
    memcpy(config.pipes, board->pipes, sizeof config.pipes);
    n->board = board;
    n->counted.cube = cube_init((uint8_t *)board->arena + own,
                                board->arena_bytes - own, &config);
    assert(n->counted.cube != NULL);
    return n;
}

static void take(struct host_idler *n, const struct cube_message *message)
{
    if (message->type == NODE_PING) {
        struct node_ping_message ping;
        memcpy(&ping, message->data, sizeof ping);
        n->pong.pinged = ping.sent;
        n->pong.received = n->counted.received;
        n->owes_pong = true;
    } else if (message->type == NODE_SETUP) {
        struct node_setup_message setup;
        memcpy(&setup, message->data, sizeof setup);
        n->role = setup.role;
        n->owes_ready = true;
    }
    n->counted.received +=
        message->source == CUBE_HOST && message->type != NODE_STOP;
}

static void answer(struct host_idler *n)
{
    if (n->owes_pong) {
        n->pong.start = n->board->identity.epoch;
        n->pong.sent = n->counted.sent;
        n->pong.awaited = INCODE_NONE;
        n->owes_pong = node_counted_write(&n->counted, CUBE_HOST, NODE_PONG,
                                          &n->pong, sizeof n->pong) != 0;
    }
    if (n->owes_ready) {
        struct node_ready_message ready;
        memset(&ready, 0, sizeof ready);
        ready.protocol = NODE_PROTOCOL;
        ready.role = n->role;
        n->owes_ready = node_counted_write(&n->counted, CUBE_HOST, NODE_READY,
                                           &ready, sizeof ready) != 0;
    }
}

bool host_idler_step(struct host_idler *idler)
{
    struct host_idler *n = idler;
    struct cube *cube = n->counted.cube;
    struct cube_message message;
    n->now_us = n->board->now_us(n->board->context);
    bool moved = cube_poll(cube, n->now_us) > 0;
    if (cube_wiring(cube)->generation != n->generation) {
        n->generation = cube_wiring(cube)->generation;
        n->counted.received = n->counted.sent = 0;
        n->owes_pong = n->owes_ready = false;
    }
    while (cube_read(cube, &message)) {
        take(n, &message);
        cube_release(cube);
        moved = true;
    }
    answer(n);
    return moved;
}

uint64_t host_idler_wait_us(const struct host_idler *idler)
{
    return cube_next_due_us(idler->counted.cube, idler->now_us);
}
