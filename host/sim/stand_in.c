#include "stand_in.h"

#include <string.h>

#include "node/arena.h"
#include "node/counted.h"
#include "transport/cube_internal.h"
#include "transport/wiring.h"

enum { WINDOW = 2, AGAIN_US = 50000, IDLE_US_MAX = 1000000, STOP_US = 500000 };

struct host_stand_in {
    const struct node_board *board;
    bool ready;
    uint64_t now_us;
    /* The idler. */
    struct node_counted counted; /* `cube` NULL: it is a teller */
    uint32_t generation;
    struct node_pong_message pong;
    bool owes_pong, owes_ready;
    uint32_t role;
    uint64_t stop_us; /* 0: goes on */
    /* The teller. */
    struct link *link[CUBE_LINKS_MAX];
    unsigned links, told;
    uint64_t told_us[CUBE_LINKS_MAX];
    bool heard[CUBE_LINKS_MAX];
    uint8_t datagram[WIRING_BYTES_MAX];
    size_t datagram_size;
};

static uint64_t now_of(const struct host_stand_in *one) {
    return one->board->now_us(one->board->context);
}

/* The cube as a node has it. */
static struct cube_config configure(const struct node_board *board) {
    const struct node_identity *who = &board->identity;
    struct cube_config config;
    memset(&config, 0, sizeof config);
    config.self = who->self;
    config.dimension = who->dimension;
    config.window = who->window != 0 ? who->window : WINDOW;
    config.epoch = who->epoch;
    config.host_port = who->host_port;
    config.dead_us = who->dead_us;
    cube_for_serial(&config, who->serial_baud);
    memcpy(config.pipes, board->pipes, sizeof config.pipes);
    return config;
}

/* --- an idler ------------------------------------------------------------- */

static bool start_idler(struct host_stand_in *one, uint8_t *memory,
                        size_t bytes) {
    struct cube_config config = configure(one->board);
    one->counted.cube = cube_init(memory, bytes, &config);
    return one->counted.cube != NULL;
}

static void take(struct host_stand_in *one,
                 const struct cube_message *message) {
    struct node_ping_message ping;
    struct node_setup_message setup;
    if (message->type == NODE_PING && message->size == sizeof ping) {
        memcpy(&ping, message->data, sizeof ping);
        one->pong.pinged = ping.sent;
        one->pong.received = one->counted.received;
        one->owes_pong = true;
    } else if (message->type == NODE_SETUP && message->size == sizeof setup) {
        memcpy(&setup, message->data, sizeof setup);
        one->role = setup.role;
        one->owes_ready = one->ready;
    } else if (message->type == NODE_STOP) {
        one->stop_us = one->now_us + STOP_US;
    }
    one->counted.received +=
        message->source == CUBE_HOST && message->type != NODE_STOP;
}

static bool send_pong(struct host_stand_in *one) {
    const struct cube *cube = one->counted.cube;
    one->pong.start = one->board->identity.epoch;
    one->pong.sent = one->counted.sent;
    one->pong.links = 0;
    one->pong.awaited = INCODE_NONE;
    one->pong.owing = CUBE_HOST;
    for (unsigned d = 0; d < cube_links(cube); d++) {
        bool up = cube_link_statistics(cube, d)->sessions > 0;
        one->pong.links |= (uint32_t)up << d;
    }
    return node_counted_write(&one->counted, CUBE_HOST, NODE_PONG, &one->pong,
                              sizeof one->pong) == 0;
}

static bool send_ready(struct host_stand_in *one) {
    struct node_ready_message ready;
    memset(&ready, 0, sizeof ready);
    ready.protocol = NODE_PROTOCOL;
    ready.role = one->role;
    return node_counted_write(&one->counted, CUBE_HOST, NODE_READY, &ready,
                              sizeof ready) == 0;
}

static void follow_wiring(struct host_stand_in *one) {
    uint32_t generation = cube_wiring(one->counted.cube)->generation;
    if (generation != one->generation) {
        one->generation = generation;
        one->owes_pong = one->owes_ready = false;
        one->counted.received = one->counted.sent = 0;
    }
}

static enum node_event idle(struct host_stand_in *one) {
    struct cube *cube = one->counted.cube;
    struct cube_message message;
    unsigned moved = (unsigned)cube_poll(cube, one->now_us);
    follow_wiring(one);
    while (cube_read(cube, &message)) {
        take(one, &message);
        cube_release(cube);
        moved++;
    }
    if (one->owes_pong) {
        one->owes_pong = !send_pong(one);
    } else if (one->owes_ready) {
        one->owes_ready = !send_ready(one);
    }
    if (one->stop_us != 0 && cube_idle(cube)) {
        cube_close(cube, one->stop_us);
    }
    return one->stop_us != 0 && one->now_us >= one->stop_us ? NODE_STOPPED
           : moved > 0                                      ? NODE_BUSY
                                                            : NODE_IDLE;
}

/* --- a teller ------------------------------------------------------------- */

/* The links of a cube, which carry no message. */
static bool start_teller(struct host_stand_in *one, uint8_t *memory,
                         size_t bytes, const struct cube_wiring *wiring) {
    struct cube_config config = configure(one->board);
    one->datagram_size = wiring_pack(wiring, one->datagram);
    one->links = cube_links_of(&config);
    for (unsigned d = 0; d < one->links; d++) {
        struct link_config c = cube_link_config(&config, d);
        size_t needed = node_aligned(link_bytes(&c));
        one->link[d] = needed <= bytes ? link_init(memory, bytes, &c) : NULL;
        if (one->link[d] == NULL) {
            return false;
        }
        memory += needed;
        bytes -= needed;
    }
    return true;
}

/* Each neighbour is told until it has said something itself. */
static enum node_event tell(struct host_stand_in *one) {
    unsigned moved = 0;
    for (unsigned d = 0; d < one->links; d++) {
        struct link *link = one->link[d];
        struct link_message message;
        bool ask;
        moved += (unsigned)link_poll(link, one->now_us);
        while (link_read(link, &message)) {
            link_release(link);
        }
        if (link_take_datagram(link, &message, &ask) && !one->heard[d] &&
            one->told_us[d] > 0) {
            one->heard[d] = true;
            one->told++;
        }
        if (link_state(link) == LINK_UP && !one->heard[d] &&
            (one->told_us[d] == 0 ||
             one->now_us - one->told_us[d] >= AGAIN_US)) {
            link_put_datagram(link, one->datagram, one->datagram_size, true);
            one->told_us[d] = one->now_us;
            moved++;
        }
    }
    return moved > 0 ? NODE_BUSY : NODE_IDLE;
}

/* --- either --------------------------------------------------------------- */

struct host_stand_in *
host_stand_in_start(const struct node_board *board,
                    const struct host_stand_in_orders *orders) {
    size_t own = node_aligned(sizeof(struct host_stand_in));
    if (board->arena_bytes < own) {
        return NULL;
    }
    struct host_stand_in *one = board->arena;
    uint8_t *rest = (uint8_t *)board->arena + own;
    size_t bytes = board->arena_bytes - own;
    memset(one, 0, sizeof *one);
    one->board = board;
    one->ready = orders->ready;
    bool started = orders->kind == HOST_IDLER
                       ? start_idler(one, rest, bytes)
                       : start_teller(one, rest, bytes, &orders->wiring);
    return started ? one : NULL;
}

enum node_event host_stand_in_step(struct host_stand_in *one) {
    one->now_us = now_of(one);
    return one->counted.cube != NULL ? idle(one) : tell(one);
}

uint64_t host_stand_in_wait_us(const struct host_stand_in *one) {
    uint64_t due = IDLE_US_MAX;
    if (one->counted.cube != NULL) {
        uint64_t cube = cube_next_due_us(one->counted.cube, one->now_us);
        due = cube < due ? cube : due;
        return one->stop_us != 0 && due > STOP_US ? STOP_US : due;
    }
    for (unsigned d = 0; d < one->links; d++) {
        uint64_t link = link_next_due_us(one->link[d], one->now_us);
        due = link < due ? link : due;
    }
    return due < AGAIN_US ? due : AGAIN_US;
}

unsigned host_stand_in_told(const struct host_stand_in *one) {
    return one->told;
}
