/* Boards with the real loader and the real node program in virtual time, over
 * serial wires and chips that take the time of serial NOR flash, and the real
 * session that brings them an image.
 *
 * Work: a pass over the boards each 100 us that pass. */
#ifndef TESTS_LOADER_BOARDS_H
#define TESTS_LOADER_BOARDS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/flash/spread.h"
#include "host/sim/sim_cube.h"
#include "node/loader/slots.h"
#include "node/loader/loader.h"
#include "node/node.h"
#include "tests/unit/node/loader/loader_chip.h"
#include "tests/unit/test.h"

enum {
    NODES_MAX = 16,
    BAUD = 921600,
    SMALL_BYTES = 60000,
    IMAGE_BYTES = 130 * LOADER_BLOCK_BYTES + 77,
    SECTORS = 128,    /* of 4 KB, pages of 256 bytes */
    ERASE_US = 45000, /* a sector, and */
    PAGE_US = 400,    /* a page: typical of a W25Q128 */
    STEP_US = 100,    /* a board's step, and the world's */
    START_US = 30000, /* of a board, from its reset on */
    ARENA = 512 * 1024,
    MEMORY = 4 << 20
};

struct board {
    struct chip chip;
    struct loader_budget budget;
    struct loader_rules rules;
    struct loader_slots slots;
    struct node_board as;
    struct loader *loader; /* one of the two */
    struct node *node;
    unsigned slot; /* from which the node was started */
    bool stays, confirmed, off, sleeping;
    uint64_t busy_us; /* does nothing until then */
    uint64_t due_us;  /* looks at its links at the latest */
    uint32_t boot, cuts;
};

static struct board *board;
static struct host_sim_cube wires;
static struct host_machine machine;
static struct host_session session;
static struct host_spread spread;
static struct host_error error;
static uint64_t now_us, chance;
static uint32_t said_baud = BAUD, carried_baud = BAUD; /* of the wires */
static uint32_t room = 512;                            /* ahead of them */
static uint64_t host_busy_us; /* it does nothing until then */
static struct sim_faults faults;
static void (*strike)(void); /* what befalls them, at each moment */
static struct made old, new, third, small;

static uint32_t draw(uint32_t below) {
    return (uint32_t)(sim_draw(&chance) >> 32) % below;
}

/* --- boards --------------------------------------------------------------- */

static uint64_t tell_time(void *unused) {
    (void)unused;
    return now_us;
}

static void board_idle(void *unused, uint64_t wait_us) {
    (void)unused;
    (void)wait_us;
}

static void board_reset(void *unused, int status) {
    (void)unused;
    (void)status;
}

static void board_who(void *context, struct node_who *who) {
    const struct board *b = context;
    strcpy((char *)who->board, "mps2-an385");
    strcpy((char *)who->loader, "0.1.0");
    who->boot = b->boot;
    if (b->node != NULL) {
        who->kind = NODE_KIND_PROGRAM;
        memcpy(who->digest, b->slots.image[b->slot].digest, sizeof who->digest);
        who->number = b->slots.image[b->slot].number;
    }
}

/* Its wires, as they are from this start on. */
static void plug_in(unsigned i) {
    for (unsigned d = 0; d < machine.dimension + (i == 0); d++) {
        struct host_sim_port *port = host_sim_cube_port(&wires, i, d);
        sim_direction_flush(port->end->in);
        board[i].as.pipes[d] = host_sim_cube_pipe(&wires, i, d);
    }
}

/* As a board's start-up does it. */
static void start(unsigned i, bool ended_badly) {
    struct board *b = &board[i];
    const char *why = NULL;
    plug_in(i);
    loader_budget_open(&b->budget);
    assert_true(loader_budget_take(&b->budget, LOADER_STARTS));
    b->loader = NULL;
    b->node = NULL;
    b->confirmed = b->off = false;
    b->slot = loader_slots_start(&b->slots, &b->rules, ended_badly, &b->boot);
    b->as.identity.epoch = b->boot > 0 ? b->boot : b->as.identity.epoch + 1;
    if (b->slot < LOADER_SLOTS && !b->stays && loader_slots_try(&b->slots))
        b->node = node_start(&b->as, &why);
    else
        b->loader = loader_start(&b->as, &b->slots, &why);
    assert_null(why);
    b->stays = false;
}

/* Power is back after that time; what was kept over a reset is gone. */
static void lose_power(unsigned i) {
    struct board *b = &board[i];
    b->off = true;
    b->stays = false;
    memset(&b->budget, 0, sizeof b->budget);
    b->cuts++;
    b->chip.until_loss = -1;
    b->busy_us = now_us + 20000 + draw(300000);
}

static void make_board(unsigned i) {
    struct board *b = &board[i];
    chip_make(&b->chip, 4096, 256, SECTORS);
    b->chip.random = i + 1;
    b->rules = chip_rules;
    b->rules.flash = &b->chip.flash;
    b->rules.budget = &b->budget;
    b->as = (struct node_board){.context = b,
                                .now_us = tell_time,
                                .busy_us = tell_time,
                                .idle = board_idle,
                                .who = board_who,
                                .reset = board_reset,
                                .arena = aligned_alloc(64, ARENA),
                                .arena_bytes = ARENA,
                                .fixed_bytes = MEMORY - ARENA};
    b->as.identity.self = (uint16_t)i;
    b->as.identity.dimension = (uint8_t)machine.dimension;
    b->as.identity.serial_baud = said_baud;
    b->off = true;
    b->busy_us = START_US + draw(50000);
}

static void step_loader(struct board *b) {
    enum node_event event = loader_step(b->loader);
    if (event == NODE_STOPPED) {
        b->stays = loader_reset_why(b->loader) == NODE_RESET_STAY;
        b->off = true;
        b->busy_us = now_us + START_US;
    }
    b->sleeping = event == NODE_IDLE;
    b->due_us = now_us + loader_wait_us(b->loader);
}

static void step_node(struct board *b) {
    enum node_event event = node_step(b->node);
    if (!b->confirmed && node_has_met(b->node)) {
        b->confirmed = chip_confirm(&b->chip, b->slot);
        assert_true(b->confirmed);
    }
    if (event == NODE_STOPPED) {
        b->stays = node_reset_why(b->node) == NODE_RESET_STAY;
        b->off = true;
        b->busy_us = now_us + START_US;
    }
    b->sleeping = event == NODE_IDLE;
    b->due_us = now_us + node_wait_us(b->node);
}

/* Whether its links bring something, or have room. */
static bool is_roused(unsigned i) {
    for (unsigned d = 0; d < machine.dimension + (i == 0); d++) {
        const struct sim_end *end = host_sim_cube_port(&wires, i, d)->end;
        if (sim_next_us(end->in, 0) <= now_us ||
            sim_room_us(end->out) <= now_us)
            return true;
    }
    return false;
}

static void look(unsigned i) {
    struct board *b = &board[i];
    uint32_t erased = b->chip.erased, programs = b->chip.programs;
    if (now_us < b->busy_us ||
        (!b->off && b->sleeping && now_us < b->due_us && !is_roused(i)))
        return;
    if (setjmp(b->chip.lost) != 0) {
        lose_power(i);
        return;
    }
    for (unsigned d = 0; d < machine.dimension + (i == 0); d++)
        host_sim_cube_port(&wires, i, d)->end->out->blocked = false;
    if (b->off)
        start(i, false);
    else if (b->loader != NULL)
        step_loader(b);
    else
        step_node(b);
    uint64_t us = (uint64_t)(b->chip.erased - erased) * ERASE_US +
                  (uint64_t)(b->chip.programs - programs) * PAGE_US;
    b->busy_us = b->busy_us > now_us ? b->busy_us : now_us + us;
}

/* --- the machine ---------------------------------------------------------- */

static void idle(void *unused, uint64_t wait_us) {
    struct sim_end *end = host_sim_cube_port(&wires, machine.nodes, 0)->end;
    uint64_t until_us = now_us + wait_us;
    (void)unused;
    do {
        now_us += STEP_US;
        if (strike != NULL)
            strike();
        for (unsigned i = 0; i < machine.nodes; i++)
            look(i);
    } while (now_us < host_busy_us ||
             (now_us < until_us && sim_next_us(end->in, 0) > now_us &&
              sim_room_us(end->out) > now_us));
    end->out->blocked = false;
}

static int check(void *unused, struct host_error *unused_error) {
    (void)unused;
    (void)unused_error;
    return 0;
}

/* What the next world's carry. */
static void wires_are(uint32_t said, uint32_t carried, uint32_t ahead) {
    said_baud = said;
    carried_baud = carried;
    room = ahead;
}

/* --- the transfer --------------------------------------------------------- */

static void open_world(unsigned dimension, uint64_t seed) {
    const struct host_sim_cube_options options = {
        .dimension = dimension,
        .seed = seed,
        .faults = faults,
        .wire = {.bytes_per_s = carried_baud / 10,
                 .latency_us = 10,
                 .room = room,
                 .bytes = room + SIM_BYTES_MIN}};
    unsigned nodes = 1u << dimension;
    now_us = 1000;
    chance = sim_seed(seed, 7);
    host_busy_us = 0;
    strike = NULL;
    assert_int_equal(host_sim_cube_open(&wires, &options, &now_us, &error), 0);
    machine =
        (struct host_machine){.nodes = nodes,
                              .dimension = dimension,
                              .epoch = 3,
                              .serial_baud = said_baud,
                              .absent_s = 3,
                              .pipe = host_sim_cube_pipe(&wires, nodes, 0),
                              .now_us = tell_time,
                              .idle = idle,
                              .check = check};
    board = calloc(nodes, sizeof *board);
    assert_non_null(board);
    for (unsigned i = 0; i < nodes; i++)
        make_board(i);
    assert_int_equal(host_session_open(&session, &machine, &error), 0);
}

static void close_world(void) {
    host_session_close(&session);
    for (unsigned i = 0; i < machine.nodes; i++)
        free(board[i].as.arena);
    free(board);
    host_sim_cube_close(&wires);
}

static bool all_have_it(void) {
    for (unsigned i = 0; i < machine.nodes; i++)
        if (spread.node[i].phase < HOST_SPREAD_VERIFIED)
            return false;
    return true;
}

/* Seconds until all have it verified. */
static double flash(const struct made *made) {
    struct host_spread_options how = {
        .image = made->all, .bytes = made->bytes, .patience_us = 60000000};
    host_node_set_all(&how.nodes, machine.nodes);
    assert_int_equal(host_spread_open(&spread, &session, &how, &error), 0);
    assert_int_equal(host_spread_look(&spread, &error), 0);
    uint64_t from_us = now_us, whole_us = 0;
    while (!host_spread_over(&spread)) {
        assert_true(now_us - from_us < 300000000);
        assert_int_equal(host_spread_step(&spread, 50000, &error), 0);
        whole_us = whole_us == 0 && all_have_it() ? now_us : whole_us;
    }
    if (host_spread_result(&spread, &error) != 0)
        fail_msg("%s", error.text);
    host_spread_close(&spread);
    return 1e-6 * (double)(whole_us - from_us);
}

/* All run that image, byte for byte. */
static void assert_all_run(const struct made *made) {
    for (unsigned i = 0; i < machine.nodes; i++) {
        const struct board *b = &board[i];
        assert_non_null(b->node);
        assert_memory_equal(b->chip.bytes +
                                loader_slots_code(&b->slots, b->slot),
                            made->all + LOADER_HEADER_BYTES, made->image.bytes);
    }
}

#endif
