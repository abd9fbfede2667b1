#include "stand_in.h"

#include <string.h>

#include "node/common.h"
#include "transport/cube_internal.h"
#include "transport/routes.h"
#include "sim_stand_ins.h"
#include "sim_draw.h"

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
    if (one->owes_pong)
        one->owes_pong = !send_pong(one);
    else if (one->owes_ready)
        one->owes_ready = !send_ready(one);
    if (one->stop_us != 0 && cube_idle(cube))
        cube_close(cube, one->stop_us);
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
        if (one->link[d] == NULL)
            return false;
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
        while (link_read(link, &message))
            link_release(link);
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
    if (board->arena_bytes < own)
        return NULL;
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

/* Links whose other end was told of the wiring. */
static unsigned host_stand_in_told(const struct host_stand_in *one) {
    return one->told;
}

/* --- sim stand ins -------------------------------------------------------- */

enum { REPLACE_US = 3000, FOREIGN_DEAD_MAX = 2 };

/* --- how they are drawn --------------------------------------------------- */

/* A node that answers and never works has no part in the work any more; its
 * links go on.  Node 0 must keep to its host for a second one to be sent away:
 * nothing takes its place then. */
void host_sim_draw_idler(struct host_sim_plan *plan) {
    struct host_sim_plan *p = plan;
    uint64_t state = sim_seed(p->seed, 82);
    unsigned first = p->wanted[HOST_SIM_SECOND_HOST];
    bool node = p->wanted[HOST_SIM_DEAD_NODE];
    /* A dead node and a dead wire may cut off another two of four. */
    unsigned needed = node && p->wanted[HOST_SIM_DEAD_WIRE] ? 8 : 2 + node;
    if (p->nodes < needed || p->nodes > 64 || host_sim_draw(&state, 1, 6) > 1)
        return;
    p->wanted[HOST_SIM_IDLER] = true;
    if (p->patience_us == 0)
        p->patience_us = host_sim_draw(&state, 10000000, 30000000);
    p->idler.node = (unsigned)host_sim_draw(&state, first, p->nodes - 1);
    p->idler.us = host_sim_draw(&state, 1, 3) == 1
                      ? 0
                      : host_sim_draw_log(&state, 1000, 300000);
    p->idler_ready = host_sim_draw(&state, 1, 4) > 1;
}

/* Where the counting of generations may go wrong: at the ends of their 16 and
 * 32 bits, and in jumps of half the smaller. */
static void draw_generation(struct host_sim_plan *p, uint64_t *state) {
    static const uint32_t ends[] = {0x7fff,  0x8000,     0xffff,
                                    0x10000, 0xffff8000, UINT32_MAX};
    static const uint32_t jumps[] = {0x7fff,  0x8000,     0x8001,    0xffff,
                                     0x10000, 0x7fff8000, 0x80008000};
    enum { ENDS = sizeof ends / sizeof ends[0] };
    enum { JUMPS = sizeof jumps / sizeof jumps[0] };
    p->foreign_jumps = host_sim_draw(state, 1, 2) == 1;
    p->foreign = p->foreign_jumps ? jumps[host_sim_draw(state, 0, JUMPS - 1)]
                                  : ends[host_sim_draw(state, 0, ENDS - 1)] -
                                        (uint32_t)host_sim_draw(state, 0, 2);
    if (host_sim_draw(state, 1, 8) == 1)
        p->foreign = (uint32_t)(sim_draw(state) >> 32);
}

/* The wiring of a host that was there before. */
void host_sim_draw_teller(struct host_sim_plan *plan) {
    struct host_sim_plan *p = plan;
    uint64_t state = sim_seed(p->seed, 83);
    unsigned first = p->wanted[HOST_SIM_SECOND_HOST];
    if (p->nodes > 64 || first >= p->nodes || host_sim_draw(&state, 1, 6) > 1)
        return;
    p->wanted[HOST_SIM_FOREIGN] = true;
    p->teller.node = (unsigned)host_sim_draw(&state, first, p->nodes - 1);
    p->teller.us = host_sim_draw(&state, 1, 2) == 1
                       ? 0
                       : host_sim_draw_log(&state, 1000, 300000);
    p->teller.lasts_us = host_sim_draw_log(&state, 10000, 1000000);
    draw_generation(p, &state);
}

/* --- when they come and go ------------------------------------------------ */

static void idler_comes(struct host_sim_run *r) {
    struct host_stand_in_orders orders = {.kind = HOST_IDLER,
                                          .ready = r->plan->idler_ready};
    host_world_replace(&r->world, r->plan->idler.node, REPLACE_US, &orders);
    r->idler_us = UINT64_MAX;
    r->happened[HOST_SIM_IDLER]++;
}

static void teller_comes(struct host_sim_run *r) {
    const struct host_sim_plan *p = r->plan;
    unsigned dimension = r->world.cube.options.dimension;
    uint64_t state = sim_seed(p->seed, 84);
    struct host_stand_in_orders orders = {.kind = HOST_TELLER};
    struct cube_wiring *w = &orders.wiring;
    w->generation = p->foreign;
    if (p->foreign_jumps)
        w->generation += r->open ? cube_wiring(r->service.cube)->generation : 1;
    w->generation += w->generation == 0;
    w->host_epoch = (uint32_t)(sim_draw(&state) >> 32);
    for (uint64_t i = host_sim_draw(&state, 0, FOREIGN_DEAD_MAX);
         i > 0 && dimension > 0; i--) {
        struct cube_dead dead = {
            (uint16_t)host_sim_draw(&state, 0, p->nodes - 1),
            (uint8_t)host_sim_draw(&state, 0, dimension - 1)};
        (void)wiring_add_dead(w, dead, dimension);
    }
    wiring_settle(w, dimension);
    host_world_replace(&r->world, p->teller.node, REPLACE_US, &orders);
    r->teller_us = r->world.now_us + p->teller.lasts_us;
    r->telling = true;
}

static void teller_goes(struct host_sim_run *r) {
    unsigned node = r->plan->teller.node;
    const struct host_world_node *n = &r->world.node[node];
    if (n->state == HOST_WORLD_UP && n->stand_in != NULL)
        r->happened[HOST_SIM_FOREIGN] += host_stand_in_told(n->stand_in);
    host_world_replace(&r->world, node, REPLACE_US, NULL);
    r->teller_us = UINT64_MAX;
    r->telling = false;
}

void host_sim_stand_ins_prepare(struct host_sim_run *run) {
    const struct host_sim_plan *p = run->plan;
    run->idler_us = run->teller_us = UINT64_MAX;
    if (p->wanted[HOST_SIM_IDLER] && p->idler.us == 0)
        idler_comes(run);
    if (p->wanted[HOST_SIM_FOREIGN] && p->teller.us == 0)
        teller_comes(run);
}

void host_sim_stand_ins_begin(struct host_sim_run *run) {
    const struct host_sim_plan *p = run->plan;
    if (p->wanted[HOST_SIM_IDLER] && p->idler.us > 0)
        run->idler_us = run->world.now_us + p->idler.us;
    if (p->wanted[HOST_SIM_FOREIGN] && p->teller.us > 0)
        run->teller_us = run->world.now_us + p->teller.us;
}

void host_sim_stand_ins_finish(struct host_sim_run *run) {
    run->idler_us = UINT64_MAX;
    run->teller_us = run->telling ? run->teller_us : UINT64_MAX;
}

uint64_t host_sim_stand_ins_us(const struct host_sim_run *run) {
    return run->idler_us < run->teller_us ? run->idler_us : run->teller_us;
}

void host_sim_stand_ins_strike(struct host_sim_run *run) {
    if (run->world.now_us >= run->idler_us)
        idler_comes(run);
    if (run->world.now_us >= run->teller_us) {
        if (run->telling)
            teller_goes(run);
        else
            teller_comes(run);
    }
}
