/* Traffic on the simulator's cube in memory: a transport at each place and
 * nothing above it.  Every place writes numbered messages to all others, and
 * what it reads must be those, whole and in order. */
#ifndef TESTS_UNIT_CUBE_MACHINE_H
#define TESTS_UNIT_CUBE_MACHINE_H

#include <stdlib.h>
#include <string.h>

#include "host/sim/sim_cube.h"
#include "transport/cube.h"
#include "transport/routes.h"
#include "tests/unit/test.h"

enum { NODES_MAX = 32, ENDS_MAX = NODES_MAX + 1, TYPES = 4 };

static const struct host_sim_cube_options perfect = {
    .wire = {.latency_us = 30, .room = 4000, .bytes = SIM_BYTES_MIN}};

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
    bool gone; /* does nothing any more, and nothing is expected of it */
};

struct machine {
    uint64_t now_us, random;
    unsigned dimension, nodes, count;
    struct place places[ENDS_MAX];
    struct host_sim_cube cube; /* its wires */
    uint32_t each;             /* messages a pair */
    uint32_t broadcasts;
    unsigned size_max;
};

static inline uint32_t draw(struct machine *m) {
    return (uint32_t)(sim_draw(&m->random) >> 32);
}

static inline unsigned place_of(const struct machine *m, uint16_t name) {
    return name == CUBE_HOST ? m->nodes : name;
}

static inline unsigned wire_of(const struct machine *m, unsigned i,
                               unsigned link) {
    return host_sim_cube_wire(&m->cube, i, link);
}

static inline void cut_wire(struct machine *m, unsigned i, unsigned link) {
    host_sim_cube_cut(&m->cube, wire_of(m, i, link), true);
}

static inline void open_place(struct machine *m, unsigned i) {
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

static inline struct machine *build(unsigned dimension,
                                    const struct cube_config *config,
                                    const struct host_sim_cube_options *wires,
                                    uint64_t seed) {
    struct machine *m = calloc(1, sizeof *m);
    assert_non_null(m);
    m->random = seed * 77 + 12345;
    m->dimension = dimension;
    m->nodes = 1u << dimension;
    m->count = m->nodes + 1;
    m->size_max = CUBE_PAYLOAD_MAX;
    struct host_sim_cube_options options = *wires;
    struct host_error error = {0};
    options.dimension = dimension;
    options.seed = seed;
    options.host_ports = config->host_ports;
    options.spare_node = config->spare_node;
    assert_int_equal(host_sim_cube_open(&m->cube, &options, &m->now_us, &error),
                     0);
    for (unsigned i = 0; i < m->count; i++) {
        struct place *p = &m->places[i];
        p->self = i == m->nodes ? CUBE_HOST : (uint16_t)i;
        p->config = *config;
        p->config.self = p->self;
        p->config.dimension = (uint8_t)dimension;
        p->config.epoch = draw(m) | 1;
        p->next = i;
        p->config.host_port = i > 0 && i == config->spare_node;
        for (unsigned d = 0; d < host_sim_cube_links(&m->cube, i); d++)
            p->config.pipes[d] = host_sim_cube_pipe(&m->cube, i, d);
    }
    for (unsigned i = 0; i < m->count; i++)
        open_place(m, i);
    return m;
}

static inline void destroy(struct machine *m) {
    for (unsigned i = 0; i < m->count; i++)
        free(m->places[i].arena);
    host_sim_cube_close(&m->cube);
    free(m);
}

/* --- traffic -------------------------------------------------------------- */

static inline unsigned content(const struct machine *m, uint8_t *bytes,
                               unsigned from, uint32_t number, bool broadcast) {
    uint32_t h = (number + 1) * 2654435761u ^ from * 40503u;
    unsigned size = h >> 8 & 1 ? m->size_max : 5 + h % (m->size_max - 4);
    for (unsigned i = 0; i < size && i < 25; i++)
        bytes[i] = (uint8_t)(h >> i);
    for (unsigned i = 25; i < size; i += 25)
        memcpy(bytes + i, bytes, size - i < 25 ? size - i : 25);
    for (unsigned i = 0; i < 4; i++)
        bytes[i] = (uint8_t)(number >> 8 * i);
    bytes[4] = broadcast;
    return size;
}

static inline void take(struct machine *m, unsigned i,
                        const struct cube_message *message) {
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
static inline unsigned give(struct machine *m, unsigned i) {
    uint8_t bytes[CUBE_PAYLOAD_MAX];
    struct place *p = &m->places[i];
    unsigned written = 0;
    while (p->broadcasts_sent < m->broadcasts) {
        unsigned size = content(m, bytes, i, p->broadcasts_sent, true);
        if (cube_write(p->cube, CUBE_ALL, p->broadcasts_sent % TYPES, bytes,
                       size) != 0)
            break;
        p->broadcasts_sent++;
        written++;
    }
    for (unsigned tried = 0; tried < m->count; tried++) {
        unsigned to = p->next = (p->next + 1) % m->count;
        if (to == i || p->sent[to] == m->each || m->places[to].gone)
            continue;
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

static inline void step(struct machine *m, unsigned i) {
    struct place *p = &m->places[i];
    struct cube_message message;
    if (m->now_us < p->stopped_until_us || p->gone)
        return;
    cube_poll(p->cube, m->now_us);
    while (m->now_us >= p->deaf_until_us && cube_read(p->cube, &message)) {
        take(m, i, &message);
        cube_release(p->cube);
    }
    give(m, i);
}

static inline bool finished(const struct machine *m) {
    for (unsigned i = 0; i < m->count; i++) {
        const struct place *p = &m->places[i];
        for (unsigned j = 0; j < m->count; j++) {
            bool reached = j != i && i != m->nodes;
            if (p->gone || m->places[j].gone)
                continue;
            if ((i != j && p->read[j] != m->each) ||
                p->broadcasts_read[j] != (reached ? m->broadcasts : 0))
                return false;
        }
        if (!p->gone && !cube_idle(p->cube))
            return false;
    }
    return true;
}

/* Forgets what was counted: as many messages again are expected. */
static inline void count_anew(struct machine *m) {
    for (unsigned i = 0; i < m->count; i++) {
        struct place *p = &m->places[i];
        p->broadcasts_sent = 0;
        memset(p->sent, 0, sizeof p->sent);
        memset(p->read, 0, sizeof p->read);
        memset(p->broadcasts_read, 0, sizeof p->broadcasts_read);
    }
}

static inline void check_statistics(const struct machine *m, bool clean) {
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
static inline void run(struct machine *m, uint32_t each, uint64_t most_us) {
    uint64_t deadline = m->now_us + most_us;
    m->each = each;
    while (!finished(m)) {
        m->now_us += 20 + draw(m) % 80;
        for (unsigned k = 0; k < m->count; k++)
            step(m, draw(m) % m->count);
        if (m->now_us > deadline)
            fail_msg("dimension %u: not all arrived", m->dimension);
    }
}

/* --- generations ---------------------------------------------------------- */

enum { WRITTEN = 0, READ = 1 };

static inline const struct cube_wiring *wiring_of(const struct machine *m,
                                                  unsigned i) {
    return cube_wiring(m->places[i].cube);
}

static inline bool all_in(const struct machine *m, uint32_t generation) {
    for (unsigned i = 0; i < m->count; i++)
        if (!m->places[i].gone && wiring_of(m, i)->generation != generation)
            return false;
    return true;
}

static inline void poll_all(struct machine *m, uint32_t us) {
    m->now_us += us;
    for (unsigned i = 0; i < m->count; i++)
        if (!m->places[i].gone)
            cube_poll(m->places[i].cube, m->now_us);
}

static inline void settle(struct machine *m, uint32_t generation) {
    for (unsigned i = 0; !all_in(m, generation); i++) {
        assert_true(i < 20000);
        poll_all(m, 100);
    }
}

/* The host begins that generation, from which more than half the circle may be
 * left, and all follow. */
static inline void renew_to(struct machine *m, uint32_t generation) {
    struct cube *host = m->places[m->nodes].cube;
    struct cube_wiring next = *cube_wiring(host);
    if (!wiring_after(generation, next.generation)) {
        next.generation += INT32_MAX;
        cube_renew(host, &next);
        settle(m, next.generation);
    }
    next.generation = generation;
    cube_renew(host, &next);
    settle(m, generation);
}

/* A new arena and epoch, as after a reset. */
static inline void reboot(struct machine *m, unsigned i) {
    free(m->places[i].arena);
    m->places[i].config.epoch = draw(m) | 1;
    open_place(m, i);
}

/* Writes to all, the generation again and again; reads and checks that. */
static inline void chatter(struct machine *m, unsigned i, bool reads,
                           uint64_t counts[2]) {
    enum { WORDS = CUBE_PAYLOAD_MAX / 4 };
    struct cube *cube = m->places[i].cube;
    struct cube_message message;
    uint32_t generation = cube_wiring(cube)->generation, words[WORDS];
    unsigned to = draw(m) % m->count, count = 1 + draw(m) % WORDS;
    for (unsigned k = 0; k < count; k++)
        words[k] = generation;
    if (to != i &&
        cube_write(cube, m->places[to].self, 1, words, 4u * count) == 0) {
        assert_true(generation > 0);
        counts[WRITTEN]++;
    }
    while (reads && cube_read(cube, &message)) {
        memcpy(words, message.data, message.size);
        for (unsigned k = 0; k < message.size / 4u; k++)
            assert_int_equal(words[k], generation);
        cube_release(cube);
        counts[READ]++;
    }
}

#endif
