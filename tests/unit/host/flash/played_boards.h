/* A session that is played: boards with a loader, in a time of their own, that
 * are off, restart, lose messages, refuse and fall back. */
#ifndef TESTS_PLAYED_BOARDS_H
#define TESTS_PLAYED_BOARDS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/flash/spread.h"
#include "transport/frame.h"
#include "tests/unit/test.h"

enum {
    NODES = 4,
    BLOCKS = 20,
    BYTES = BLOCKS * LOADER_BLOCK_BYTES - 100,
    QUEUE = 6, /* messages that there is room for */
    A_MESSAGE_US = 17000,
    RESTART_US = 700000,
    HEARD_US = 2000000,
    OLD = 0xaa, /* digests, each byte of them */
    NEW = 0xbb
};

/* --- boards --------------------------------------------------------------- */

struct board {
    bool on;
    bool mute; /* its loader answers nothing, */
    bool deaf; /* or just no order */
    bool restless;
    uint32_t kind;
    const char *name;
    bool no_loader;
    uint8_t digest;
    uint64_t back_us; /* when it will be there again; 0: it is */
    uint64_t down_us;
    bool stay; /* its loader waits, the next time */
    /* The loader's. */
    uint32_t transfer, phase, fault;
    bool verified;
    uint8_t map[LOADER_MAP_BYTES], serial[NODE_SERIAL_BYTES];
    enum loader_fault refuses;
    enum { COMES_UP, FALLS_BACK, STAYS } end; /* of the image */
    /* What it has been told. */
    unsigned restarts, boots, begins, blocks;
};

static struct board board[NODES];
static struct host_session session;
static struct host_session_node seen[NODES];
static struct host_machine machine;
static uint64_t now_us, off_until_us[NODES];
static unsigned loss;          /* of 100 blocks */
static unsigned asks_lost;     /* by node 1, and a generation with each */
static uint32_t lose_power_at; /* blocks of node 1; 0: never */
static uint32_t random_state;
static bool lost;
static char said[2000];

static struct {
    uint16_t dest;
    uint8_t type;
    size_t size;
    uint8_t data[CUBE_PAYLOAD_MAX];
} queue[QUEUE];
static unsigned queued;

static uint32_t draw(uint32_t below) {
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) % below;
}

static void fill(uint8_t *bytes, uint8_t value, size_t size) {
    memset(bytes, value, size);
}

/* As a start is: what the host is told of it. */
static void come_up(unsigned i) {
    struct board *b = &board[i];
    struct node_who *who = &seen[i].who;
    bool image = b->kind == NODE_KIND_LOADER && !b->stay &&
                 (b->digest != 0 || b->verified);
    if (image && b->verified && b->end == COMES_UP)
        b->digest = NEW;
    bool waits = b->verified && b->end == STAYS;
    b->verified = false;
    if (image && !waits)
        b->kind = NODE_KIND_PROGRAM;
    b->stay = false;
    b->transfer = 0;
    b->phase = LOADER_WAITS;
    b->back_us = 0;
    *who = (struct node_who){.protocol = NODE_PROTOCOL, .kind = b->kind};
    memcpy(who->board, b->name, strlen(b->name));
    memcpy(who->serial, b->serial, sizeof who->serial);
    if (!b->no_loader)
        memcpy(who->loader, "0.1.0", 5);
    fill(who->digest, b->digest, sizeof who->digest);
    seen[i].there = seen[i].heard = true;
    seen[i].starts++;
}

static void go_down(unsigned i, uint64_t for_us) {
    struct board *b = &board[i];
    b->back_us = now_us + for_us;
    b->down_us = now_us;
    if (b->kind == NODE_KIND_PROGRAM && !b->no_loader)
        b->kind = NODE_KIND_LOADER;
}

static uint32_t held(const struct board *b) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < BLOCKS; i++)
        count += b->map[i / 8] >> i % 8 & 1;
    return count;
}

static void answer(unsigned i) {
    struct board *b = &board[i];
    struct loader_state_message state = {.transfer = b->transfer,
                                         .phase = b->phase,
                                         .fault = b->fault,
                                         .blocks = BLOCKS,
                                         .held = held(b)};
    memcpy(state.map, b->map, sizeof state.map);
    const struct cube_message message = {.source = (uint16_t)i,
                                         .size = sizeof state,
                                         .type = NODE_IMAGE_STATE,
                                         .data = (const uint8_t *)&state};
    session.take(session.context, &message);
}

static void begin(struct board *b, unsigned i, const uint8_t *data) {
    struct loader_begin_message message;
    memcpy(&message, data, sizeof message);
    b->begins++;
    if ((message.nodes[i / 8] >> i % 8 & 1) == 0)
        return;
    assert_int_equal(message.bytes, BYTES);
    b->transfer = message.transfer;
    b->fault = b->refuses;
    b->phase = b->refuses != LOADER_GOOD ? LOADER_REFUSES
               : b->digest == NEW        ? LOADER_THERE
               : held(b) == BLOCKS       ? LOADER_WHOLE
                                         : LOADER_TAKES;
}

static void block(struct board *b, unsigned i, const uint8_t *data,
                  size_t size) {
    struct loader_block_message head;
    memcpy(&head, data, sizeof head);
    if (b->transfer != head.transfer || b->phase != LOADER_TAKES)
        return;
    b->blocks++;
    assert_true(head.block < BLOCKS);
    assert_int_equal(size - sizeof head, head.block == BLOCKS - 1
                                             ? LOADER_BLOCK_BYTES - 100
                                             : LOADER_BLOCK_BYTES);
    assert_int_equal(head.crc,
                     frame_crc32c(0, data + sizeof head, size - sizeof head));
    if (draw(100) >= loss)
        b->map[head.block / 8] |= (uint8_t)(1u << head.block % 8);
    b->phase = held(b) == BLOCKS ? LOADER_WHOLE : LOADER_TAKES;
    if (b->restless) {
        b->map[0] = 0;
        go_down(i, RESTART_US);
    }
    if (i == 1 && b->blocks == lose_power_at)
        go_down(1, RESTART_US);
}

static void obey(struct board *b, unsigned i, const uint8_t *data) {
    struct loader_do_message message;
    memcpy(&message, data, sizeof message);
    if (message.what == LOADER_VERIFY && b->phase == LOADER_WHOLE) {
        b->phase = LOADER_VERIFIED;
        b->verified = true;
    } else if (message.what == LOADER_NAME && message.transfer == b->transfer &&
               b->phase >= LOADER_THERE && b->phase <= LOADER_VERIFIED) {
        memcpy(b->serial, message.serial, sizeof b->serial);
    } else if (message.what == LOADER_BOOT) {
        b->boots++;
        go_down(i, RESTART_US);
    }
}

static void deliver(unsigned i, uint8_t type, const uint8_t *data,
                    size_t size) {
    struct board *b = &board[i];
    if (!b->on || b->back_us != 0 || b->kind != NODE_KIND_LOADER || b->mute ||
        b->deaf)
        return;
    if (type == NODE_IMAGE_BEGIN) {
        begin(b, i, data);
    } else if (type == NODE_IMAGE_BLOCK) {
        block(b, i, data, size);
    } else if (type == NODE_IMAGE_DO) {
        obey(b, i, data);
    } else if (type == NODE_IMAGE_ASK && i == 1 && asks_lost > 0) {
        asks_lost--;
        session.generation++;
    } else if (type == NODE_IMAGE_ASK) {
        answer(i);
    }
}

/* --- the session ---------------------------------------------------------- */

static uint64_t tell_time(void *unused) {
    (void)unused;
    return now_us;
}

bool host_session_send(struct host_session *unused, uint16_t dest, uint8_t type,
                       const void *data, size_t size) {
    (void)unused;
    assert_true(size <= CUBE_PAYLOAD_MAX);
    if (queued == QUEUE)
        return false;
    queue[queued].dest = dest;
    queue[queued].type = type;
    queue[queued].size = size;
    memcpy(queue[queued].data, data, size);
    queued++;
    return true;
}

int host_session_round(struct host_session *unused, uint64_t wait_us,
                       struct host_error *error) {
    (void)unused;
    now_us += queued > 0 ? A_MESSAGE_US : wait_us;
    if (lost)
        return host_fail(error, HOST_CUBE, "host: no wire; plug it in");
    for (unsigned i = 0; i < NODES; i++) {
        struct board *b = &board[i];
        if (!b->on && off_until_us[i] != 0 && now_us >= off_until_us[i]) {
            b->on = true;
            come_up(i);
        } else if (b->on && b->back_us != 0 && now_us >= b->back_us) {
            come_up(i);
        }
        seen[i].heard = b->on && !b->mute &&
                        (b->back_us == 0 || now_us - b->down_us < HEARD_US);
    }
    if (queued == 0)
        return 0;
    for (unsigned i = 0; i < NODES; i++)
        if (queue[0].dest == CUBE_ALL || queue[0].dest == i)
            deliver(i, queue[0].type, queue[0].data, queue[0].size);
    queued--;
    memmove(queue, queue + 1, queued * sizeof queue[0]);
    return 0;
}

int host_session_restart(struct host_session *unused,
                         const struct host_node_set *set,
                         enum node_restart what, struct host_error *error) {
    (void)unused;
    (void)error;
    assert_int_equal(what, NODE_RESTART_STAY);
    for (unsigned i = 0; i < NODES; i++) {
        struct board *b = &board[i];
        if (host_node_set_has(set, i)) {
            b->restarts++;
            b->stay = true;
            go_down(i, RESTART_US);
        }
    }
    return 0;
}

int host_session_ask(struct host_session *unused,
                     const struct host_node_set *set, enum node_question what,
                     unsigned target, uint64_t wait_us,
                     struct host_error *error) {
    static char log[] = "started 3 times\nlast fault: watchdog\n";
    (void)unused;
    (void)target;
    (void)wait_us;
    (void)error;
    assert_int_equal(what, NODE_LOG);
    for (unsigned i = 0; i < NODES; i++) {
        if (host_node_set_has(set, i)) {
            seen[i].answered = true;
            seen[i].size = sizeof log - 1;
            seen[i].answer = (uint8_t *)log;
        }
    }
    return 0;
}

const char *host_session_reason(const struct host_session *unused,
                                unsigned node, char *text, size_t size) {
    (void)unused;
    (void)node;
    snprintf(text, size, "is not heard; turn it on");
    return text;
}

#endif
