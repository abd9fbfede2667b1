/* Two links on one wire, that of the simulator's smallest cube: each end sends
 * a stream of numbered messages, and what it reads must be the other's. */
#ifndef TESTS_UNIT_LINK_PAIR_H
#define TESTS_UNIT_LINK_PAIR_H

#include <stdlib.h>
#include <string.h>

#include "host/sim/sim_cube.h"
#include "tests/unit/test.h"

enum { PAIR_BYTES = 1 << 17 }; /* on the wire, each way */

static const struct host_sim_cube_options perfect = {
    .wire = {.latency_us = 50, .room = 1 << 16, .bytes = PAIR_BYTES}};

struct end {
    struct link *link;
    void *memory;
    size_t bytes;
    struct link_config config;
    uint32_t written, read;
    uint64_t payload;  /* bytes read */
    uint32_t most;     /* messages to be written */
    uint32_t size_max; /* of a message; 0: the link's */
    bool lazy;         /* does not read */
};

struct pair {
    uint64_t now_us;
    struct host_sim_cube cube; /* node 0 is end 0, the host end 1 */
    struct end ends[2];
};

static inline uint32_t mix(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

static inline size_t size_of(const struct end *end, unsigned who,
                             uint32_t number) {
    uint32_t m = mix(number * 2 + who);
    if (end->size_max == 0)
        return end->config.message_max;
    size_t most = end->size_max;
    return m % 7 == 0 ? most : m % 5 == 0 ? m / 64 % 9 : m / 64 % (most + 1);
}

static inline void fill(uint8_t *bytes, size_t size, unsigned who,
                        uint32_t number) {
    uint32_t m = mix(number * 2 + who);
    for (size_t i = 0, shift = 0; i < size; i++) {
        bytes[i] = (uint8_t)((m >> shift) + i * (m & 7));
        shift = shift < 23 ? shift + 1 : 0;
    }
    for (size_t i = 0; m % 3 == 0 && i < size; i += 1 + m % 9)
        bytes[i] = 0;
    for (size_t i = 0; i < 4 && i < size; i++)
        bytes[i] = (uint8_t)(number >> 8 * i);
}

static inline void start(struct pair *p, unsigned who, uint32_t epoch) {
    struct end *end = &p->ends[who];
    end->config.pipe = host_sim_cube_pipe(&p->cube, who, 0);
    end->config.epoch = epoch;
    end->config.node = (uint16_t)(10 + who);
    end->config.peer_node = (uint16_t)(11 - who);
    end->config.port = end->config.peer_port = 2;
    free(end->memory);
    end->bytes = link_bytes(&end->config);
    end->memory = end->bytes > 0 ? malloc(end->bytes) : NULL;
    assert_non_null(end->memory);
    end->link = link_init(end->memory, end->bytes, &end->config);
    assert_non_null(end->link);
}

static inline struct pair *new_pair(const struct link_config *config,
                                    const struct host_sim_cube_options *wire,
                                    uint64_t seed) {
    struct pair *p = calloc(1, sizeof *p);
    struct host_sim_cube_options options = *wire;
    struct host_error error = {0};
    assert_non_null(p);
    options.seed = seed;
    p->now_us = 1000 * (seed % 7);
    assert_int_equal(host_sim_cube_open(&p->cube, &options, &p->now_us, &error),
                     0);
    for (unsigned who = 0; who < 2; who++) {
        p->ends[who].config = *config;
        start(p, who, 0xffe0u + 40 * (uint32_t)seed + who);
        p->ends[who].most = UINT32_MAX;
    }
    return p;
}

static inline void free_pair(struct pair *p) {
    free(p->ends[0].memory);
    free(p->ends[1].memory);
    host_sim_cube_close(&p->cube);
    free(p);
}

static inline void cut_pair(struct pair *p, bool cut) {
    host_sim_cube_cut(&p->cube, 0, cut);
}

/* Bytes that nobody sent, on the way from that end. */
static inline void put_noise(struct pair *p, unsigned who, const uint8_t *bytes,
                             size_t size) {
    struct link_pipe pipe = host_sim_cube_pipe(&p->cube, who, 0);
    (void)pipe.send(pipe.context, bytes, size);
}

static inline void write_some(struct end *end, unsigned who) {
    uint8_t bytes[LINK_MESSAGE_MAX] = {0};
    while (end->written < end->most) {
        size_t size = size_of(end, who, end->written), head = size % 9;
        unsigned room = link_room(end->link, size);
        if (room > 0)
            fill(bytes, size, who, end->written);
        int status =
            link_write(end->link, bytes, head, bytes + head, size - head);
        assert_int_equal(status, room > 0 ? 0 : LINK_AGAIN);
        if (status != 0)
            return;
        end->written++;
    }
}

static inline void read_some(struct end *end, const struct end *from,
                             unsigned who) {
    uint8_t want[LINK_MESSAGE_MAX];
    struct link_message message;
    while (!end->lazy && link_read(end->link, &message)) {
        size_t size = size_of(from, who, end->read);
        fill(want, size, who, end->read);
        assert_int_equal(message.size, size);
        assert_memory_equal(message.data, want, size);
        assert_int_equal((uintptr_t)message.data % 8, 0);
        link_release(end->link);
        end->read++;
        end->payload += size;
    }
}

static inline void step(struct pair *p, uint32_t us) {
    p->now_us += us;
    for (unsigned who = 0; who < 2; who++) {
        struct end *end = &p->ends[who];
        link_poll_receive(end->link, p->now_us);
        read_some(end, &p->ends[1 - who], 1 - who);
        write_some(end, who);
        link_poll_send(end->link, p->now_us);
        assert_int_equal(link_statistics(end->link)->overruns, 0);
    }
}

static inline bool finished(const struct pair *p) {
    return p->ends[0].read == p->ends[1].most &&
           p->ends[1].read == p->ends[0].most && link_idle(p->ends[0].link) &&
           link_idle(p->ends[1].link);
}

static inline void run(struct pair *p, uint32_t messages, uint32_t step_us,
                       uint64_t most_us) {
    uint64_t deadline = p->now_us + most_us;
    p->ends[0].most = p->ends[1].most = messages;
    while (!finished(p)) {
        step(p, step_us);
        if (p->now_us > deadline) {
            fail_msg("%u and %u of %u messages after %llu us", p->ends[0].read,
                     p->ends[1].read, messages, (unsigned long long)most_us);
        }
    }
}

static const struct link_config small = {
    .window = 12, .frame_payload = 160, .message_max = 1608, .staging = 2};

#endif
