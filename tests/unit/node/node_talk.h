/* A node in an arena, and two who talk to it: its host and a neighbour, both
 * with the key and with nothing to be trusted.  Bytes say what they say: right
 * messages, changed in places, in any order.  Whatever it was, the node is
 * there afterwards, and given a right setup and job it gives the right result.
 *
 * Memory: static, some 2 MB. */
#ifndef TESTS_NODE_TALK_H
#define TESTS_NODE_TALK_H

#include <stdlib.h>
#include <string.h>

#include "host/sim/sim_cube.h"
#include "node/node.h"
#include "node/page_check.h"
#include "node/result.h"

enum {
    TALK_SELF = 1, /* the node; node 0 and the host talk to it */
    TALK_SIDE = 5, /* points along a side of the grid */
    TALK_POINTS = TALK_SIDE * TALK_SIDE * TALK_SIDE,
    TALK_BRICKS = 2,
    TALK_MEMORY = 1 << 19,
    TALK_FIXED = 1 << 16,
    TALK_STEPS = 30,    /* after a message */
    TALK_MESSAGES = 64, /* a talk */
    TALK_LONG = 200000, /* steps, for the right result */
    TALK_KEY = 0x5eed
};

struct talk_end {
    struct cube *cube;
    uint8_t *memory;
};

static struct {
    uint64_t now_us;
    struct host_sim_cube wires;
    struct node_board board;
    struct node *node;
    struct talk_end end[2];            /* node 0, the host */
    uint32_t wanted[64], wanted_count; /* pages that the node has asked for */
    uint32_t unspill;                  /* the brick that it wants back */
    uint64_t hash, expected;           /* of its tetrahedra, in any order */
    uint32_t committed;
    bool finished, ready, faulted;
} talk;

static const uint8_t *talk_next, *talk_end_of;

static inline uint8_t talk_byte(void) {
    return talk_next < talk_end_of ? *talk_next++ : 0;
}

static inline void talk_demand(bool condition) {
    if (!condition)
        abort();
}

static inline uint64_t talk_now_us(void *context) {
    (void)context;
    return talk.now_us;
}

/* ---- the points ---- */

static inline double talk_coordinate(uint32_t vertex, unsigned d) {
    unsigned at[3] = {vertex % TALK_SIDE, vertex / TALK_SIDE % TALK_SIDE,
                      vertex / (TALK_SIDE * TALK_SIDE)};
    return at[d] + 0.01 * ((vertex * 7919u + d * 104729u) % 89u) / 89;
}

static inline uint32_t talk_points_of(uint32_t brick) {
    uint32_t first = brick * INCODE_BRICK_POINTS;
    return TALK_POINTS - first < INCODE_BRICK_POINTS ? TALK_POINTS - first
                                                     : INCODE_BRICK_POINTS;
}

/* Of vertices [first, last). */
static inline void talk_box(double lo[3], double hi[3], uint32_t first,
                            uint32_t last) {
    for (unsigned d = 0; d < 3; d++) {
        lo[d] = __builtin_inf();
        hi[d] = -lo[d];
        for (uint32_t v = first; v < last; v++) {
            double a = talk_coordinate(v, d);
            lo[d] = a < lo[d] ? a : lo[d];
            hi[d] = a > hi[d] ? a : hi[d];
        }
    }
}

/* Bytes of the page: two bricks, and their boxes. */
static inline size_t talk_page(uint32_t page, uint8_t *bytes) {
    struct incode_boxes boxes;
    if (page < TALK_BRICKS) {
        uint32_t count = talk_points_of(page);
        for (uint32_t i = 0; i < 3 * count; i++) {
            double a = talk_coordinate(page * INCODE_BRICK_POINTS + i % count,
                                       i / count);
            memcpy(bytes + i * sizeof a, &a, sizeof a);
        }
        return 3 * count * sizeof(double);
    }
    double lo[3], hi[3];
    talk_box(lo, hi, 0, TALK_POINTS);
    incode_boxes_init(&boxes, lo, hi);
    for (uint32_t c = 0; c < TALK_BRICKS; c++) {
        uint32_t first = c * INCODE_BRICK_POINTS;
        talk_box(lo, hi, first, first + talk_points_of(c));
        incode_boxes_set(&boxes, c, lo, hi);
    }
    memcpy(bytes, &boxes, sizeof boxes);
    return sizeof boxes;
}

/* ---- who talks ---- */

static inline struct talk_end talk_open(uint16_t self, unsigned place) {
    struct cube_config config;
    struct talk_end end;
    memset(&config, 0, sizeof config);
    config.self = self;
    config.dimension = 1;
    config.window = 8;
    config.epoch = 50 + place;
    config.pipes[0] = host_sim_cube_pipe(&talk.wires, place, 0);
    if (self == 0)
        config.pipes[1] = host_sim_cube_pipe(&talk.wires, 0, 1);
    size_t bytes = (cube_arena_bytes(&config) + 63) / 64 * 64;
    end.memory = aligned_alloc(64, bytes);
    talk_demand(end.memory != NULL);
    end.cube = cube_init(end.memory, bytes, &config);
    talk_demand(end.cube != NULL);
    return end;
}

static inline void talk_begin(void) {
    const struct host_sim_cube_options options = {
        .dimension = 1,
        .wire = {.latency_us = 10, .room = 60000, .bytes = 1 << 17}};
    struct host_error error = {0};
    const char *why = NULL;
    memset(&talk, 0, sizeof talk);
    talk_demand(
        host_sim_cube_open(&talk.wires, &options, &talk.now_us, &error) == 0);
    talk.end[0] = talk_open(0, 0);
    talk.end[1] = talk_open(CUBE_HOST, 2);
    struct node_board *board = &talk.board;
    board->identity.self = TALK_SELF;
    board->identity.dimension = 1;
    board->identity.epoch = 7;
    board->identity.window = 8;
    board->pipes[0] = host_sim_cube_pipe(&talk.wires, TALK_SELF, 0);
    board->now_us = board->busy_us = talk_now_us;
    board->arena_bytes = TALK_MEMORY - TALK_FIXED;
    board->fixed_bytes = TALK_FIXED;
    board->arena = aligned_alloc(64, board->arena_bytes);
    talk_demand(board->arena != NULL);
    talk.node = node_start(board, &why);
    talk_demand(talk.node != NULL);
}

static inline void talk_end_all(void) {
    free(talk.board.arena);
    free(talk.end[0].memory);
    free(talk.end[1].memory);
    host_sim_cube_close(&talk.wires);
}

/* ---- what the node says ---- */

static inline void talk_take_result(const struct cube_message *m) {
    struct node_result_reader reader;
    enum node_result_event event;
    uint32_t rows[64][4];
    size_t count;
    talk_demand(m->size >= sizeof(struct node_result_header));
    node_result_open(&reader, m->data + sizeof(struct node_result_header),
                     m->size - sizeof(struct node_result_header),
                     TALK_BRICKS * INCODE_BRICK_POINTS, TALK_SELF, 2);
    do {
        event = node_result_read(&reader, rows, 64, &count);
        for (size_t i = 0; i < count; i++) {
            /* Whichever vertex is first: a sum, and a sum of squares. */
            uint64_t h = 0, p = 1;
            for (unsigned k = 0; k < 4; k++) {
                h += rows[i][k] * UINT64_C(0x9e3779b97f4a7c15);
                p *= 2 * (uint64_t)rows[i][k] + 3;
            }
            h = (h ^ p) * UINT64_C(0xbf58476d1ce4e5b9);
            talk.hash += h ^ h >> 29;
        }
        talk.committed += event == NODE_RESULT_COMMIT;
    } while (event == NODE_RESULT_ROWS || event == NODE_RESULT_COMMIT);
}

static inline void talk_hear(const struct cube_message *m) {
    struct node_spill_header header;
    switch (m->type) {
    case NODE_PAGE_REQUEST:
        for (uint32_t at = 0; at + 4 <= m->size && talk.wanted_count < 64;
             at += 4)
            memcpy(&talk.wanted[talk.wanted_count++], m->data + at, 4);
        break;
    case NODE_RESULT:
        talk_take_result(m);
        break;
    case NODE_UNSPILL_REQUEST:
        memcpy(&header, m->data, sizeof header);
        talk.unspill = header.brick;
        break;
    default:
        talk.ready |= m->type == NODE_READY;
        talk.faulted |= m->type == NODE_FAULT;
        talk.finished |= m->type == NODE_FINISHED;
    }
}

/* False: the node has stopped, as it was told. */
static inline bool talk_step(void) {
    struct cube_message message;
    talk.now_us += 40;
    bool goes_on = node_step(talk.node) != NODE_STOPPED;
    for (unsigned i = 0; i < 2; i++) {
        (void)cube_poll(talk.end[i].cube, talk.now_us);
        while (cube_read(talk.end[i].cube, &message)) {
            talk_hear(&message);
            cube_release(talk.end[i].cube);
        }
    }
    return goes_on;
}

static inline bool talk_say(unsigned who, uint8_t type, const void *data,
                            size_t size) {
    for (unsigned i = 0; i < 20000; i++) {
        if (cube_write(talk.end[who].cube, TALK_SELF, type, data, size) == 0)
            return true;
        if (!talk_step())
            return false;
    }
    abort(); /* it no longer reads */
}

/* ---- right messages ---- */

static inline struct node_setup_message talk_setup(uint8_t role) {
    struct node_setup_message setup;
    memset(&setup, 0, sizeof setup);
    setup.protocol = NODE_PROTOCOL;
    setup.nodes = 2;
    setup.holders = role == NODE_HOLDER;
    setup.credits = 1000;
    setup.role = role;
    setup.page_key = TALK_KEY;
    setup.setup.bricks = TALK_BRICKS;
    setup.setup.index = INCODE_KD;
    talk_box(setup.setup.lo, setup.setup.hi, 0, TALK_POINTS);
    return setup;
}

static inline struct node_job_message talk_job(void) {
    struct node_job_message job;
    memset(&job, 0, sizeof job);
    job.epoch = 1;
    job.job.last = TALK_BRICKS;
    talk_box(job.job.lo, job.job.hi, 0, TALK_POINTS);
    return job;
}

/* The tag of a page of so many bytes, as the host makes it. */
static inline void talk_seal(uint8_t *data, size_t size) {
    struct node_page_message page;
    memcpy(&page, data, size);
    (void)node_page_seal(&page, TALK_KEY, size - sizeof page.head);
    memcpy(data, &page.head, sizeof page.head);
}

static inline size_t talk_compose_page(uint32_t page, uint8_t *data) {
    const struct node_page_head head = {.page = page};
    memcpy(data, &head, sizeof head);
    size_t size = sizeof head + talk_page(page, data + sizeof head);
    talk_seal(data, size);
    return size;
}

/* A message of that type as it may rightly be; its bytes. */
static inline size_t talk_compose(uint8_t type, uint8_t *data) {
    struct node_setup_message setup = talk_setup(NODE_WORKER);
    struct node_job_message job = talk_job();
    struct node_spill_header header = {1, talk.unspill, 2, 1, 0};
    uint32_t page = talk.wanted_count > 0 ? talk.wanted[--talk.wanted_count]
                                          : talk_byte() % 4u;
    uint32_t number = talk_byte();
    struct incode_face faces[2] = {{{3, 4, 70}},
                                   {{5, INCODE_NONE, INCODE_NONE}}};
    const uint32_t kind = 1 + number % 3, count = 1 + number / 3 % 3;
    const uint32_t list[] = {kind, count, 3, 4,   70, 5, 9,
                             66,   1,     2, 130, 8,  7, 6};
    switch (type) {
    case NODE_SETUP:
        setup.setup.index = (uint8_t)(number % 3);
        setup.setup.face_rule = number >> 2 & 1;
        setup.setup.build = (uint8_t)(number / 3 % 3);
        setup.role = number >> 3 & 1 ? (uint8_t)(NODE_HOLDER + talk_byte() % 3)
                                     : NODE_WORKER;
        setup.builders[0] =
            setup.role == NODE_MANAGER ? 3 & ~(1 << TALK_SELF) : 0;
        setup.manager = !TALK_SELF;
        setup.faces_per_job = 1 + talk_byte() % 96;
        setup.jobs_per_worker = 1 + talk_byte() % 16;
        setup.holders =
            number >> 4 == 0 ? talk_byte() % 4 : setup.role == NODE_HOLDER;
        setup.setup.bricks = number >> 5 == 1 ? talk_byte() : TALK_BRICKS;
        for (int d = 0; d < 3; d++)
            setup.setup.cells[d] = number % 3 == INCODE_GRID ? 3 : 0;
        memcpy(data, &setup, sizeof setup);
        return sizeof setup;
    case NODE_JOB:
        job.epoch = 1 + number;
        memcpy(data, &job, sizeof job);
        return sizeof job;
    case NODE_PAGE:
        return talk_compose_page(page, data);
    case NODE_UNSPILL:
        memcpy(data, &header, sizeof header);
        memcpy(data + sizeof header, faces, sizeof faces);
        return sizeof header + sizeof faces;
    case NODE_CREDIT:
        number += 1000;
        memcpy(data, &number, sizeof number);
        return sizeof number;
    case NODE_PAGE_REQUEST:
        memcpy(data, &page, sizeof page);
        return sizeof page;
    case NODE_LIST:
    case NODE_ANSWERS:
        memcpy(data, list, sizeof list);
        return type == NODE_LIST ? incode_list_bytes(count)
                                 : incode_answers_bytes(count);
    case NODE_PING:
        memcpy(data, &number, sizeof number);
        return sizeof number;
    default:
        return 0;
    }
}

/* Other values in places, or another size. */
static inline size_t talk_mutate(uint8_t *data, size_t size) {
    static const double odd[] = {
        0,    -0.0,  1e308, -1e308,          5e-324,
        -1.0, 1e300, 2.5,   __builtin_inf(), __builtin_nan("")};
    for (unsigned count = talk_byte() % 4u; count > 0 && size >= 8; count--) {
        size_t at = (size_t)(talk_byte() | talk_byte() << 8) % size;
        uint8_t how = talk_byte(), value = talk_byte();
        double number = odd[value % 10];
        if (how % 4 == 0)
            data[at] = value;
        else if (how % 4 == 1 && at / 8 * 8 + 8 <= size)
            memcpy(data + at / 8 * 8, &number, 8);
        else if (how % 4 == 2 && at / 8 * 8 + 12 <= size)
            memcpy(data + at / 8 * 8 + 4, &number, 8);
        else if (how % 4 == 3)
            size = at;
    }
    return size;
}

/* ---- a talk ---- */

/* Nothing but the right result counts from now on: page for page. */
static inline void talk_expect_right(void) {
    struct node_setup_message setup = talk_setup(NODE_WORKER);
    struct node_job_message job = talk_job();
    struct cube_wiring next = *cube_wiring(talk.end[1].cube);
    uint8_t data[CUBE_PAYLOAD_MAX];
    /* A new generation, as a host begins after a fault. */
    cube_renew(talk.end[1].cube, &next);
    for (unsigned i = 0; i < 3 * TALK_STEPS; i++)
        talk_demand(talk_step());
    talk.wanted_count = talk.committed = 0;
    talk.hash = 0;
    talk.finished = talk.ready = talk.faulted = false;
    talk_demand(talk_say(1, NODE_SETUP, &setup, sizeof setup));
    talk_demand(talk_say(1, NODE_JOB, &job, sizeof job));
    for (unsigned i = 0; !talk.finished; i++) {
        talk_demand(i < TALK_LONG && !talk.faulted && talk_step());
        while (talk.wanted_count > 0) {
            uint32_t page = talk.wanted[--talk.wanted_count];
            size_t size = talk_compose_page(page, data);
            talk_demand(talk_say(1, NODE_PAGE, data, size));
        }
    }
    talk_demand(talk.ready && talk.committed == TALK_BRICKS);
}

/* The node without any talk. */
static inline void talk_learn_expected(void) {
    static uint64_t expected;
    if (expected == 0) {
        talk_begin();
        talk_expect_right();
        expected = talk.hash;
        talk_end_all();
        talk_demand(expected != 0);
    }
    talk.expected = expected;
}

/* Until the node has taken what was said, and answered, if it does. */
static inline void talk_listen(void) {
    for (unsigned k = 0; k < TALK_STEPS; k++)
        talk_demand(talk_step());
}

static inline void talk_run(const uint8_t *bytes, size_t size) {
    static const uint8_t types[] = {
        NODE_SETUP,   NODE_JOB,     NODE_PAGE,         NODE_PAGE,  NODE_CREDIT,
        NODE_UNSPILL, NODE_REPORT,  NODE_PAGE_REQUEST, NODE_PING,  NODE_READY,
        NODE_RESULT,  NODE_PAGE,    NODE_JOB,          NODE_SETUP, NODE_FAULT,
        NODE_LIST,    NODE_ANSWERS, NODE_LIST};
    uint8_t data[CUBE_PAYLOAD_MAX];
    talk_learn_expected();
    uint64_t expected = talk.expected;
    talk_begin();
    talk_next = bytes;
    talk_end_of = bytes + size;
    for (unsigned i = 0; i < TALK_MESSAGES && talk_next < talk_end_of; i++) {
        uint8_t what = talk_byte(), type = types[(what & 63) % sizeof types];
        if (talk.faulted) { /* what follows would be passed over */
            struct node_setup_message setup = talk_setup(NODE_WORKER);
            struct node_job_message job = talk_job();
            talk.faulted = false;
            talk.wanted_count = 0;
            talk_demand(talk_say(1, NODE_SETUP, &setup, sizeof setup));
            talk_demand(talk_say(1, NODE_JOB, &job, sizeof job));
            talk_listen();
        }
        memset(data, 0, sizeof data);
        size_t length = talk_compose(type, data);
        if (what >= 0xc0)
            length = talk_mutate(data, length);
        /* What a page says, and not only that it was altered. */
        if (type == NODE_PAGE && length >= sizeof(struct node_page_head) &&
            talk_byte() % 2 == 0)
            talk_seal(data, length);
        /* The neighbour brings pages and asks for them, and tries the rest. */
        bool by_neighbour = type == NODE_PAGE || type == NODE_PAGE_REQUEST ||
                                    type == NODE_LIST || type == NODE_ANSWERS
                                ? talk_byte() % 2 == 0
                                : talk_byte() % 32 == 0;
        talk_demand(talk_say(by_neighbour ? 0 : 1, type, data, length));
        talk_listen();
    }
    talk_expect_right();
    talk_demand(talk.hash == expected);
    talk_end_all();
}

#endif
