/* Cubes in virtual time: every pair at once with the smallest windows, in
 * order and whole; broadcasts; hosts that are slow; wires that are wrong. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define LINE_BYTES (1u << 13)
#include "line.h"

#include "../../transport/cube.h"

enum { NODES_MAX = 32, ENDS_MAX = NODES_MAX + 1, TYPES = 4 };

static const struct line_quality perfect = {.latency_us = 30, .room = 4000};

/* Place `count - 1` is the host's. */
struct place {
    struct cube *cube;
    struct cube_config config;
    void *arena;
    uint16_t self;
    uint32_t sent[ENDS_MAX]; /* messages to each place */
    uint32_t read[ENDS_MAX]; /* from each */
    uint32_t broadcasts_sent, broadcasts_read[ENDS_MAX];
    uint32_t next; /* place that is written to next */
    uint64_t deaf_until_us, stopped_until_us;
};

struct machine {
    uint64_t now_us, random;
    unsigned dimension, nodes, count;
    struct place places[ENDS_MAX];
    struct line_wire *wires;
    unsigned wires_count;
    uint32_t each; /* messages a pair */
    uint32_t broadcasts;
    unsigned size_max;
};

static uint32_t draw(struct machine *m)
{
    return (uint32_t)(line_draw(&m->random) >> 32);
}

static unsigned place_of(const struct machine *m, uint16_t name)
{
    return name == CUBE_HOST ? m->nodes : name;
}

static void connect_wire(struct machine *m, struct link_pipe *a,
                         struct link_pipe *b,
                         const struct line_quality *quality)
{
    struct line_wire *wire = &m->wires[m->wires_count++];
    line_wire(wire, &m->now_us, quality, m->random + m->wires_count);
    *a = line_pipe(&wire->ends[0]);
    *b = line_pipe(&wire->ends[1]);
}

static void open_place(struct machine *m, unsigned i)
{
    struct place *p = &m->places[i];
    size_t bytes = cube_arena_bytes(&p->config);
    p->arena = bytes > 0 ? malloc(bytes) : NULL;
    if (p->arena == NULL) {
        fail();
        return;
    }
    memset(p->arena, 0xa5, bytes);
    assert_null(cube_init(p->arena, bytes - 1, &p->config));
    p->cube = cube_init(p->arena, bytes, &p->config);
    assert_non_null(p->cube);
}

static struct machine *build(unsigned dimension,
                             const struct cube_config *config,
                             const struct line_quality *quality, uint64_t seed)
{
    struct machine *m = calloc(1, sizeof *m);
    assert_non_null(m);
    m->random = seed * 77 + 12345;
    m->dimension = dimension;
    m->nodes = 1u << dimension;
    m->count = m->nodes + 1;
    m->size_max = CUBE_PAYLOAD_MAX;
    m->wires = calloc(m->nodes * dimension / 2 + 1, sizeof *m->wires);
    assert_non_null(m->wires);
    for (unsigned i = 0; i < m->count; i++) {
        struct place *p = &m->places[i];
        p->self = i == m->nodes ? CUBE_HOST : (uint16_t)i;
        p->config = *config;
        p->config.self = p->self;
        p->config.dimension = (uint8_t)dimension;
        p->config.epoch = draw(m) | 1;
        p->next = i;
    }
    for (unsigned i = 0; i < m->nodes; i++) {
        for (unsigned d = 0; d < dimension; d++) {
            unsigned other = i ^ 1u << d;
            if (other > i) {
                connect_wire(m, &m->places[i].config.pipes[d],
                             &m->places[other].config.pipes[d], quality);
            }
        }
    }
    connect_wire(m, &m->places[0].config.pipes[dimension],
                 &m->places[m->nodes].config.pipes[0], quality);
    for (unsigned i = 0; i < m->count; i++) {
        open_place(m, i);
    }
    return m;
}

static void destroy(struct machine *m)
{
    for (unsigned i = 0; i < m->count; i++) {
        free(m->places[i].arena);
    }
    free(m->wires);
    free(m);
}

/* --- traffic ------------------------------------------------------------- */

static unsigned content(const struct machine *m, uint8_t *bytes, unsigned from,
                        uint32_t number, bool broadcast)
{
    uint32_t h = (number + 1) * 2654435761u ^ from * 40503u;
    unsigned size = h >> 8 & 1 ? m->size_max : 5 + h % (m->size_max - 4);
    for (unsigned i = 0; i < size; i++) {
        bytes[i] = (uint8_t)(h >> i % 25);
    }
    for (unsigned i = 0; i < 4; i++) {
        bytes[i] = (uint8_t)(number >> 8 * i);
    }
    bytes[4] = broadcast;
    return size;
}

static void take(struct machine *m, unsigned i,
                 const struct cube_message *message)
{
    uint8_t want[CUBE_PAYLOAD_MAX];
    struct place *p = &m->places[i];
    unsigned from = place_of(m, message->source);
    assert_true(from < m->count && from != i && message->size >= 5);
    bool broadcast = message->data[4];
    uint32_t *count = broadcast ? &p->broadcasts_read[from] : &p->read[from];
    unsigned size = content(m, want, from, *count, broadcast);
    assert_int_equal(message->size, size);
    assert_int_equal(message->type, *count % TYPES);
    assert_memory_equal(message->data, want, size);
    assert_int_equal((uintptr_t)message->data % 8, 0);
    ++*count;
}

/* Writes what the links take, to all others in turn. */
static unsigned give(struct machine *m, unsigned i)
{
    uint8_t bytes[CUBE_PAYLOAD_MAX];
    struct place *p = &m->places[i];
    unsigned written = 0;
    while (p->broadcasts_sent < m->broadcasts) {
        unsigned size = content(m, bytes, i, p->broadcasts_sent, true);
        if (cube_write(p->cube, CUBE_ALL, p->broadcasts_sent % TYPES, bytes,
                       size) != 0) {
            break;
        }
        p->broadcasts_sent++;
        written++;
    }
    for (unsigned tried = 0; tried < m->count; tried++) {
        unsigned to = p->next = (p->next + 1) % m->count;
        if (to == i || p->sent[to] == m->each) {
            continue;
        }
        unsigned size = content(m, bytes, i, p->sent[to], false);
        unsigned room = cube_room(p->cube, m->places[to].self);
        int status = cube_write(p->cube, m->places[to].self,
                                p->sent[to] % TYPES, bytes, size);
        assert_true(room == 0 || status == 0);
        if (status == 0) {
            p->sent[to]++;
            written++;
        }
    }
    return written;
}

static void step(struct machine *m, unsigned i)
{
    struct place *p = &m->places[i];
    struct cube_message message;
    if (m->now_us < p->stopped_until_us) {
        return;
    }
    cube_poll(p->cube, m->now_us);
    while (m->now_us >= p->deaf_until_us && cube_read(p->cube, &message)) {
        take(m, i, &message);
        cube_release(p->cube);
    }
    give(m, i);
}

static bool finished(const struct machine *m)
{
    for (unsigned i = 0; i < m->count; i++) {
        const struct place *p = &m->places[i];
        for (unsigned j = 0; j < m->count; j++) {
            bool reached = j != i && i != m->nodes;
            if ((i != j && p->read[j] != m->each) ||
                p->broadcasts_read[j] != (reached ? m->broadcasts : 0)) {
                return false;
            }
        }
        if (!cube_idle(p->cube)) {
            return false;
        }
    }
    return true;
}

static void check_statistics(const struct machine *m, bool clean)
{
    for (unsigned i = 0; i < m->count; i++) {
        const struct place *p = &m->places[i];
        assert_int_equal(cube_statistics(p->cube)->misrouted, 0);
        for (unsigned d = 0; d < cube_links(p->cube); d++) {
            const struct link_statistics *s = cube_link_statistics(p->cube, d);
            assert_int_equal(s->overruns, 0);
            assert_true(s->send_high_water <= p->config.window);
            assert_true(s->receive_high_water <= p->config.window);
            assert_int_equal(s->sessions, 1);
            assert_true(!clean || s->retransmitted == 0);
            assert_true(cube_link_state(p->cube, d) == LINK_UP);
        }
    }
}

/* Places in an order drawn anew each round. */
static void run(struct machine *m, uint32_t each, uint64_t most_us)
{
    uint64_t deadline = m->now_us + most_us;
    m->each = each;
    while (!finished(m)) {
        m->now_us += 20 + draw(m) % 80;
        for (unsigned k = 0; k < m->count; k++) {
            step(m, draw(m) % m->count);
        }
        if (m->now_us > deadline) {
            fail_msg("dimension %u: not all arrived", m->dimension);
        }
    }
}

/* --- tests --------------------------------------------------------------- */

static void every_pair_at_once_with_windows_of_one(void **unused)
{
    (void)unused;
    for (unsigned d = 0; d <= 5; d++) {
        struct cube_config c = {.window = 1};
        struct machine *m = build(d, &c, &perfect, d);
        run(m, d < 4 ? 40 : 8, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

static void every_pair_at_once_with_wider_windows(void **unused)
{
    (void)unused;
    for (unsigned d = 0; d <= 4; d++) {
        struct cube_config c = {.window = (uint16_t)(2 + 3 * d)};
        struct machine *m = build(d, &c, &perfect, d);
        run(m, 30, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

/* A message in four frames, windows of one message. */
static void every_pair_at_once_in_small_frames(void **unused)
{
    (void)unused;
    for (unsigned d = 1; d <= 4; d++) {
        struct cube_config c = {
            .window = 4, .frame_payload = 408, .staging = 1};
        struct machine *m = build(d, &c, &perfect, d);
        run(m, 10, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

static void every_pair_at_once_on_bad_wires(void **unused)
{
    struct line_quality bad = perfect;
    (void)unused;
    bad.bit_error = 1e-5;
    bad.drop = bad.insert = bad.repeat = 2e-5;
    for (unsigned d = 0; d <= 3; d++) {
        struct cube_config c = {
            .window = 5, .frame_payload = 408, .staging = 2};
        struct machine *m = build(d, &c, &bad, d);
        m->broadcasts = 5;
        run(m, 20, 4000000000);
        check_statistics(m, false);
        destroy(m);
    }
}

static void broadcasts_from_everywhere(void **unused)
{
    (void)unused;
    for (unsigned d = 0; d <= 5; d++) {
        struct cube_config c = {.window = 1 + d % 2};
        struct machine *m = build(d, &c, &perfect, d);
        m->broadcasts = 20;
        run(m, 3, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

/* Each place stops, or does not read, at random times. */
static void places_that_stall(void **unused)
{
    (void)unused;
    for (uint64_t seed = 0; seed < 4; seed++) {
        struct cube_config c = {.window = 1};
        struct machine *m = build(3 + (unsigned)seed % 3, &c, &perfect, seed);
        m->each = 6;
        m->broadcasts = 2;
        while (!finished(m)) {
            m->now_us += 50;
            assert_true(m->now_us < 4000000000);
            unsigned who = draw(m) % m->count;
            if (draw(m) % 50 == 0) {
                m->places[m->nodes].deaf_until_us = m->now_us + draw(m) % 30000;
            }
            if (draw(m) % 1500 == 0) {
                m->places[who].stopped_until_us = m->now_us + draw(m) % 100000;
            }
            for (unsigned i = 0; i < m->count; i++) {
                step(m, i);
            }
        }
        check_statistics(m, false);
        destroy(m);
    }
}

/* The host reads a message now and then: all wait, none is lost. */
static void a_host_that_is_slow(void **unused)
{
    struct cube_config c = {.window = 2};
    struct cube_message message;
    (void)unused;
    struct machine *m = build(3, &c, &perfect, 1);
    struct place *host = &m->places[m->nodes];
    m->each = 10;
    for (uint64_t i = 0; !finished(m); i++) {
        assert_true(i < 2000000);
        m->now_us += 100;
        for (unsigned k = 0; k < m->nodes; k++) {
            step(m, k);
        }
        cube_poll(host->cube, m->now_us);
        if (i % 1000 == 0 && cube_read(host->cube, &message)) {
            take(m, m->nodes, &message);
            cube_release(host->cube);
        }
        give(m, m->nodes);
    }
    check_statistics(m, false);
    destroy(m);
}

/* Node 1 does not read what node 0 sent it; messages from 3 to 0 pass through
 * it all the same. */
static void an_unread_message_holds_its_own_link_alone(void **unused)
{
    struct cube_config c = {.window = 1};
    struct cube_message message;
    unsigned passed = 0;
    (void)unused;
    struct machine *m = build(2, &c, &perfect, 1);
    for (unsigned i = 0; i < 1000; i++) {
        m->now_us += 100;
        for (unsigned k = 0; k < m->nodes; k++) {
            cube_poll(m->places[k].cube, m->now_us);
        }
        cube_write(m->places[0].cube, 1, 1, "unread", 6);
        cube_write(m->places[2].cube, 1, 2, "by another way", 14);
        if (cube_read(m->places[2].cube, &message)) {
            fail();
        }
        while (cube_read(m->places[0].cube, &message)) {
            assert_int_equal(message.source, 3);
            cube_release(m->places[0].cube);
            passed++;
        }
        cube_write(m->places[3].cube, 0, 3, "passing", 7);
    }
    /* 3 differs from 0 in both dimensions: lowest first is by way of 2. */
    assert_true(passed > 100);
    assert_int_equal(cube_statistics(m->places[2].cube)->passed_on > 100, 1);
    assert_true(cube_read(m->places[1].cube, &message));
    assert_int_equal(message.size, message.source == 0 ? 6 : 14);
    destroy(m);
}

/* Node 0 is flooded with messages for the host; its own get through. */
static void a_flood_does_not_starve_the_node_it_passes(void **unused)
{
    struct cube_config c = {.window = 1};
    struct cube_message message;
    unsigned own = 0, others = 0;
    (void)unused;
    struct machine *m = build(2, &c, &perfect, 1);
    for (unsigned i = 0; i < 20000; i++) {
        m->now_us += 40;
        for (unsigned k = 0; k < m->nodes; k++) {
            cube_poll(m->places[k].cube, m->now_us);
            cube_write(m->places[k].cube, CUBE_HOST, 1, "flood", 5);
        }
        struct cube *host = m->places[m->nodes].cube;
        cube_poll(host, m->now_us);
        while (cube_read(host, &message)) {
            *(message.source == 0 ? &own : &others) += 1;
            cube_release(host);
        }
    }
    assert_true(own > 1000 && others > 1000);
    destroy(m);
}

static void a_wrong_wire_is_named(void **unused)
{
    struct cube_config c = {.window = 2};
    (void)unused;
    struct machine *m = build(3, &c, &perfect, 1);
    /* Ends of the wires 5-1 and 3-7 in dimension 2 are exchanged. */
    struct place *five = &m->places[5], *seven = &m->places[7];
    struct link_pipe pipe = five->config.pipes[2];
    five->config.pipes[2] = seven->config.pipes[2];
    seven->config.pipes[2] = pipe;
    free(five->arena);
    free(seven->arena);
    open_place(m, 5);
    open_place(m, 7);
    for (unsigned i = 0; i < 1000; i++) {
        m->now_us += 100;
        for (unsigned k = 0; k < m->count; k++) {
            cube_poll(m->places[k].cube, m->now_us);
        }
    }
    assert_true(cube_link_state(five->cube, 2) == LINK_REFUSED);
    const struct link_peer *peer = cube_link_peer(five->cube, 2);
    assert_true(peer->refusal == LINK_WRONG_WIRE);
    assert_int_equal(peer->node, 3);
    assert_int_equal(peer->port, 2);
    assert_true(cube_link_state(five->cube, 1) == LINK_UP);
    destroy(m);
}

static void configs_that_make_no_sense(void **unused)
{
    struct link_pipe pipe = {&pipe, line_send, line_receive};
    struct cube_config good = {.self = 3, .dimension = 2, .window = 1};
    struct cube_config c;
    (void)unused;
    good.epoch = 1;
    for (unsigned d = 0; d < CUBE_LINKS_MAX; d++) {
        good.pipes[d] = pipe;
    }
    assert_true(cube_arena_bytes(&good) > 0);
    c = good;
    c.self = 4;
    assert_int_equal(cube_arena_bytes(&c), 0);
    c = good;
    c.window = 0;
    assert_int_equal(cube_arena_bytes(&c), 0);
    c.window = LINK_WINDOW_MAX + 1;
    assert_int_equal(cube_arena_bytes(&c), 0);
    c = good;
    c.epoch = 0;
    assert_int_equal(cube_arena_bytes(&c), 0);
    c = good;
    c.frame_payload = 408; /* a message would not fit a window of one */
    assert_int_equal(cube_arena_bytes(&c), 0);
    c = good;
    c.dimension = CUBE_DIMENSION_MAX + 1;
    assert_int_equal(cube_arena_bytes(&c), 0);
}

static void all_say_farewell(void **unused)
{
    struct cube_config c = {.window = 2};
    (void)unused;
    struct machine *m = build(3, &c, &perfect, 1);
    run(m, 3, 100000000);
    uint64_t deadline = m->now_us + 1000000;
    for (unsigned i = 0; i < m->count; i++) {
        cube_close(m->places[i].cube, deadline);
    }
    for (unsigned i = 0; i < 100; i++) {
        m->now_us += 1000;
        for (unsigned k = 0; k < m->count; k++) {
            cube_poll(m->places[k].cube, m->now_us);
        }
    }
    for (unsigned i = 0; i < m->count; i++) {
        for (unsigned d = 0; d < cube_links(m->places[i].cube); d++) {
            assert_true(cube_link_state(m->places[i].cube, d) == LINK_CLOSED);
        }
    }
    destroy(m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pair_at_once_with_windows_of_one),
        cmocka_unit_test(every_pair_at_once_with_wider_windows),
        cmocka_unit_test(every_pair_at_once_in_small_frames),
        cmocka_unit_test(every_pair_at_once_on_bad_wires),
        cmocka_unit_test(broadcasts_from_everywhere),
        cmocka_unit_test(places_that_stall),
        cmocka_unit_test(a_host_that_is_slow),
        cmocka_unit_test(an_unread_message_holds_its_own_link_alone),
        cmocka_unit_test(a_flood_does_not_starve_the_node_it_passes),
        cmocka_unit_test(a_wrong_wire_is_named),
        cmocka_unit_test(configs_that_make_no_sense),
        cmocka_unit_test(all_say_farewell),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
