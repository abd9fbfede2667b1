/* Two links through everything at once, drawn from a seed: damage of each kind,
 * cuts, one-way failures, pauses, readers that do not read, and restarts of
 * either end.  Within a session nothing is missing, nothing comes twice; once
 * the faults stop, messages flow again. */

#include "transport/drivers/sim.h"
#include "tests/unit/test.h"

enum {
    WIRE_BYTES = 1 << 15,
    MESSAGE_MAX = 600,
    HEAD = 8,
    KINDS = 8,
    QUIET_US = 20000000
};

struct end {
    struct link *link;
    void *memory;
    struct link_config config;
    uint32_t life, number;           /* of the next message written */
    uint32_t life_read, number_read; /* of the last message read */
    bool has_read, lazy;
    uint64_t count;
};

struct world {
    uint64_t now_us, random, seed;
    struct sim_wire wire;
    uint8_t bytes[2 * WIRE_BYTES]; /* on the wire */
    struct end ends[2];
    uint32_t struck[KINDS];
};

static uint32_t draw(struct world *w) {
    return (uint32_t)(sim_draw(&w->random) >> 32);
}

/* A start of the end: another life, another epoch. */
static void start(struct world *w, unsigned who) {
    struct end *end = &w->ends[who];
    end->life++;
    end->number = 0;
    end->has_read = false;
    end->config.epoch = draw(w) | 1;
    end->config.pipe = sim_pipe(&w->wire.end[who]);
    free(end->memory);
    size_t bytes = link_bytes(&end->config);
    end->memory = bytes > 0 ? malloc(bytes) : NULL;
    assert_non_null(end->memory);
    end->link = link_init(end->memory, bytes, &end->config);
    assert_non_null(end->link);
}

static void begin(struct world *w, uint64_t seed) {
    memset(w, 0, sizeof *w);
    w->seed = seed;
    w->random = seed * 7919 + 1;
    draw(w);
    struct sim_quality quality = {.latency_us = draw(w) % 3000,
                                  .room = 64 + draw(w) % 4000,
                                  .bytes = WIRE_BYTES};
    quality.bytes_per_s = draw(w) % 2 ? 300000 : 0;
    sim_wire_init(&w->wire, w->bytes, &quality, &w->now_us, seed);
    unsigned payload = draw(w) % 3 ? 8 * (4 + draw(w) % 60) : MESSAGE_MAX;
    unsigned least = (MESSAGE_MAX + payload - 1) / payload;
    for (unsigned who = 0; who < 2; who++) {
        struct link_config *c = &w->ends[who].config;
        unsigned more = draw(w) % 3 ? draw(w) % (65 - least) : 0;
        c->node = (uint16_t)who;
        c->peer_node = (uint16_t)(1 - who);
        c->message_max = MESSAGE_MAX;
        c->frame_payload = (uint16_t)payload;
        c->window = (uint16_t)(least + more);
        c->staging = (uint16_t)(1 + draw(w) % 4);
        c->timeout_min_us = draw(w) % 2 ? 20000 : 0;
        start(w, who);
    }
}

static void expect(const struct world *w, bool right, const char *what) {
    if (!right) {
        fail_msg("seed %llu, %llu us: %s", (unsigned long long)w->seed,
                 (unsigned long long)w->now_us, what);
    }
}

/* Life and number, then bytes that follow from them. */
static size_t content(uint8_t *bytes, uint32_t life, uint32_t number) {
    size_t size = HEAD + (number * 2654435761u >> 8) % (MESSAGE_MAX - HEAD + 1);
    memcpy(bytes, &life, 4);
    memcpy(bytes + 4, &number, 4);
    for (size_t i = HEAD; i < size; i++)
        bytes[i] = (uint8_t)(number * 7 + i * life);
    return size;
}

static void take(struct world *w, struct end *end,
                 const struct link_message *message) {
    uint8_t want[MESSAGE_MAX];
    uint32_t life, number;
    expect(w, message->size >= HEAD, "a message of the right size");
    memcpy(&life, message->data, 4);
    memcpy(&number, message->data + 4, 4);
    size_t size = content(want, life, number);
    expect(w, message->size == size, "a message of its own size");
    expect(w, memcmp(message->data, want, size) == 0, "its own bytes");
    if (end->has_read && life == end->life_read) {
        expect(w, number == end->number_read + 1, "none lost, none twice");
    } else if (end->has_read) {
        expect(w, life > end->life_read, "no message of an earlier life");
        expect(w, number == 0, "a new life is heard from its start");
    }
    end->has_read = true;
    end->life_read = life;
    end->number_read = number;
    end->count++;
}

static void step(struct world *w, uint32_t us, bool writing) {
    uint8_t bytes[MESSAGE_MAX];
    struct link_message message;
    w->now_us += us;
    for (unsigned who = 0; who < 2; who++) {
        struct end *end = &w->ends[who];
        link_poll_receive(end->link, w->now_us);
        while (!end->lazy && link_read(end->link, &message)) {
            take(w, end, &message);
            link_release(end->link);
        }
        while (writing) {
            size_t size = content(bytes, end->life, end->number);
            if (link_write(end->link, bytes, HEAD, bytes + HEAD, size - HEAD) !=
                0)
                break;
            end->number++;
        }
        link_poll_send(end->link, w->now_us);
        expect(w, link_statistics(end->link)->overruns == 0,
               "no frame without credit");
    }
}

/* NULL: no more faults of chance. */
static void befall(struct world *w, const struct sim_faults *faults) {
    for (unsigned i = 0; i < 2; i++) {
        sim_direction_faults(&w->wire.direction[i], faults);
        sim_direction_deaf(&w->wire.direction[i], false);
    }
}

static void spoil(struct world *w) {
    const double chances[] = {0, 1e-5, 1e-4, 1e-3, 1e-2};
    struct sim_faults bad = {.stall_us = 0};
    bad.chance[SIM_FLIP] = chances[draw(w) % 5] / 8;
    bad.chance[SIM_DELETE] = chances[draw(w) % 5];
    bad.chance[SIM_INSERT] = chances[draw(w) % 5];
    bad.chance[SIM_REPEAT] = chances[draw(w) % 5];
    befall(w, &bad);
}

static void strike(struct world *w) {
    unsigned kind = draw(w) % 400;
    struct sim_direction *direction = &w->wire.direction[draw(w) % 2];
    if (kind < KINDS)
        w->struck[kind]++;
    switch (kind) {
    case 0:
        start(w, draw(w) % 2);
        break;
    case 1:
        sim_wire_cut(&w->wire, true);
        break;
    case 2:
        spoil(w);
        break;
    case 3:
        befall(w, NULL);
        break;
    case 4:
        w->ends[draw(w) % 2].lazy ^= true;
        break;
    case 5: /* one way is dead */
        sim_direction_deaf(direction, true);
        break;
    case 6:
        w->now_us += draw(w) % 5000000;
        break;
    case 7:
        sim_direction_deaf(&w->wire.direction[0], true);
        sim_direction_deaf(&w->wire.direction[1], true);
        break;
    default:
        if (kind < 20)
            sim_wire_cut(&w->wire, false);
    }
}

/* The faults are over: both directions must carry messages again. */
static void recover(struct world *w, uint32_t step_us) {
    struct end *a = &w->ends[0], *b = &w->ends[1];
    befall(w, NULL);
    sim_wire_cut(&w->wire, false);
    a->lazy = b->lazy = false;
    uint64_t want_a = a->count + 60, want_b = b->count + 60;
    uint64_t deadline = w->now_us + QUIET_US;
    while (a->count < want_a || b->count < want_b) {
        step(w, step_us, true);
        expect(w, w->now_us < deadline, "messages flow again");
    }
    while (!link_idle(a->link) || !link_idle(b->link)) {
        step(w, step_us, false);
        expect(w, w->now_us < deadline, "all is acknowledged");
    }
}

TEST(everything_at_once_then_quiet) {
    static struct world w;
    uint32_t struck[KINDS] = {0};
    for (uint64_t seed = 0; seed < 400; seed++) {
        begin(&w, seed);
        uint32_t step_us = 50 + draw(&w) % 1000;
        for (unsigned i = 0; i < 1500; i++) {
            strike(&w);
            step(&w, step_us, true);
        }
        recover(&w, step_us);
        for (unsigned k = 0; k < KINDS; k++)
            struck[k] += w.struck[k];
        free(w.ends[0].memory);
        free(w.ends[1].memory);
    }
    for (unsigned k = 0; k < KINDS; k++)
        assert_true(struck[k] > 1000);
}
