/* Links over wires of every kind of badness, in virtual time: what is written
 * is read, once and in order, or the peer is another; and no more is ever
 * received than there is room for. */
#include "link_pair.h"
#include "tests/unit/emulated.h"

/* --- clean wires ---------------------------------------------------------- */

TEST(messages_of_every_size) {
    unsigned messages = emulated() ? 400 : 2000;
    for (unsigned window = 1; window <= LINK_WINDOW_MAX; window *= 2) {
        struct link_config c = {.window = (uint16_t)window};
        struct pair *p = new_pair(&c, &perfect, window);
        p->ends[0].size_max = p->ends[1].size_max = 1616;
        run(p, messages, 60, 10000000);
        const struct link_statistics *s = link_statistics(p->ends[0].link);
        assert_int_equal(s->retransmitted, 0);
        assert_int_equal(s->bad_crc + s->bad_header + s->bad_code, 0);
        assert_int_equal(s->messages_sent, messages);
        assert_int_equal(s->messages_received, messages);
        assert_int_equal(s->payload_received, p->ends[0].payload);
        assert_true(s->send_high_water <= window);
        assert_true(s->receive_high_water <= window);
        assert_int_equal(s->sessions, 1);
        assert_true(link_state(p->ends[0].link) == LINK_UP);
        free_pair(p);
    }
}

TEST(messages_of_many_frames) {
    for (unsigned payload = 32; payload <= 1608; payload += 8) {
        struct link_config c = {.window = (uint16_t)(1607 / payload + 1),
                                .frame_payload = (uint16_t)payload,
                                .message_max = 1608};
        c.window = (uint16_t)(c.window + payload / 8 % 3);
        if (c.window > LINK_WINDOW_MAX)
            continue;
        struct pair *p = new_pair(&c, &perfect, payload);
        p->ends[0].size_max = 1608;
        p->ends[1].size_max = 200;
        run(p, 60, 60, 10000000);
        free_pair(p);
    }
}

/* More than twice around all sequence numbers. */
TEST(sequence_numbers_wrap) {
    struct link_config c = {
        .window = 64, .frame_payload = 32, .message_max = 32};
    struct pair *p = new_pair(&c, &perfect, 3);
    p->ends[0].size_max = p->ends[1].size_max = 8;
    run(p, 140000, 60, UINT64_MAX / 2);
    assert_int_equal(link_statistics(p->ends[0].link)->retransmitted, 0);
    free_pair(p);
    /* And once with losses. */
    struct host_sim_cube_options lossy = perfect;
    lossy.faults.chance[SIM_DELETE] = 0.002;
    p = new_pair(&c, &lossy, 4);
    p->ends[0].size_max = p->ends[1].size_max = 8;
    run(p, 70000, 60, UINT64_MAX / 2);
    assert_true(link_statistics(p->ends[0].link)->retransmitted > 1000);
    free_pair(p);
}

TEST(a_reader_that_does_not_read_holds_the_writer) {
    struct pair *p = new_pair(&small, &perfect, 5);
    p->ends[1].lazy = true;
    p->ends[1].most = 0;
    for (unsigned i = 0; i < 50000; i++)
        step(p, 200);
    const struct link_statistics *s = link_statistics(p->ends[0].link);
    assert_true(s->frames_sent < 100);
    assert_true(s->probes_sent > 3); /* asks, but ever more rarely */
    assert_int_equal(s->retransmitted, 0);
    assert_true(link_state(p->ends[0].link) == LINK_UP);
    p->ends[1].lazy = false;
    for (unsigned i = 0; i < 1000; i++)
        step(p, 200);
    assert_true(p->ends[1].read > 50);
    free_pair(p);
}

/* The last window of credits gets lost: the sender asks for it. */
TEST(lost_credits_are_asked_for) {
    struct link_config c = {.window = 1};
    struct pair *p = new_pair(&c, &perfect, 6);
    p->ends[1].lazy = true;
    for (unsigned i = 0; i < 100; i++)
        step(p, 200);
    p->ends[1].lazy = false;
    sim_direction_deaf(host_sim_cube_direction(&p->cube, 0, 1), true);
    step(p, 200);
    step(p, 200);
    sim_direction_deaf(host_sim_cube_direction(&p->cube, 0, 1), false);
    uint32_t before = p->ends[1].read;
    for (unsigned i = 0; i < 10000 && p->ends[1].read == before; i++)
        step(p, 200);
    assert_true(p->ends[1].read > before);
    free_pair(p);
}

/* --- bad wires ------------------------------------------------------------ */

/* Everything at once, each seed another mix. */
TEST(every_kind_of_damage) {
    const double chances[] = {0, 1e-5, 1e-4, 1e-3};
    uint64_t damaged = 0, again = 0, duplicates = 0;
    for (uint64_t seed = 0; seed < 60; seed++) {
        struct host_sim_cube_options q = {
            .wire = {.bytes_per_s = seed % 3 ? 300000 : 0,
                     .latency_us = (uint32_t)(seed % 5) * 400,
                     .room = seed % 2 ? 64 : 4096,
                     .bytes = PAIR_BYTES},
            .faults = {.chance = {[SIM_FLIP] = chances[seed % 4] / 4,
                                  [SIM_DELETE] = chances[seed / 4 % 4],
                                  [SIM_INSERT] = chances[seed / 5 % 4],
                                  [SIM_REPEAT] = chances[seed / 6 % 4],
                                  [SIM_STALL] = chances[seed / 7 % 3]},
                       .stall_us = 30000}};
        struct link_config c = {.window = (uint16_t)(10 + seed % 23),
                                .frame_payload = 168,
                                .message_max = 1608,
                                .staging = (uint16_t)(1 + seed % 3)};
        struct pair *p = new_pair(&c, &q, seed);
        p->ends[0].size_max = 1608;
        p->ends[1].size_max = 700;
        run(p, 150, 100 + 50 * (uint32_t)(seed % 9), 600000000);
        for (int k = 0; k < SIM_CHANCES; k++)
            damaged += host_sim_cube_struck(&p->cube, (enum sim_fault)k);
        again += link_statistics(p->ends[0].link)->retransmitted;
        duplicates += link_statistics(p->ends[1].link)->duplicates;
        free_pair(p);
    }
    assert_true(damaged > 5000 && again > 1500 && duplicates > 20);
}

TEST(garbage_between_frames) {
    struct pair *p = new_pair(&small, &perfect, 9);
    uint64_t random = 99;
    p->ends[0].size_max = p->ends[1].size_max = 1608;
    p->ends[0].most = p->ends[1].most = 300;
    for (unsigned i = 0; i < 40000 && !finished(p); i++) {
        if (i % 7 == 0) {
            for (unsigned k = 0; k < 1 + i % 700; k++) {
                uint8_t byte = (uint8_t)(sim_draw(&random) >> 40);
                put_noise(p, i % 2, &byte, 1);
            }
        }
        if (i % 61 == 0) {
            uint8_t run_on[3000]; /* without a zero */
            memset(run_on, 0x55, sizeof run_on);
            put_noise(p, i % 2, run_on, sizeof run_on);
        }
        step(p, 100);
    }
    assert_true(finished(p));
    const struct link_statistics *s = link_statistics(p->ends[0].link);
    assert_true(s->resynchronised > 0);
    assert_true(s->bad_header + s->bad_code > 10);
    free_pair(p);
}

/* --- time ----------------------------------------------------------------- */

/* An end that sleeps until its next due time, or a byte, misses nothing. */
TEST(sleeping_until_due_is_enough) {
    struct host_sim_cube_options bad = perfect;
    bad.faults.chance[SIM_DELETE] = 3e-4;
    for (uint64_t seed = 0; seed < 10; seed++) {
        struct pair *p = new_pair(&small, &bad, seed);
        p->ends[0].size_max = p->ends[1].size_max = 1608;
        p->ends[0].most = p->ends[1].most = 100;
        unsigned polls = 0;
        while (!finished(p)) {
            uint64_t due = UINT64_MAX;
            for (unsigned who = 0; who < 2; who++) {
                uint64_t at = sim_next_us(
                    host_sim_cube_port(&p->cube, who, 0)->end->in, 0);
                uint64_t byte = at > p->now_us ? at - p->now_us : 0;
                uint64_t mine = link_next_due_us(p->ends[who].link, p->now_us);
                mine = byte < mine ? byte : mine;
                due = mine < due ? mine : due;
            }
            step(p, (uint32_t)due);
            assert_true(++polls < 40000);
        }
        free_pair(p);
    }
}

/* Share of the wire's rate, both directions at once, in 64 KB transfers. */
static double share(double baud, double bit_error, uint32_t step_us,
                    size_t *bytes) {
    struct host_sim_cube_options q = {
        .wire = {(uint32_t)(baud / 10), 1000, 512, PAIR_BYTES},
        .faults = {.chance = {[SIM_FLIP] = bit_error}}};
    struct link_config c = {.window = 14, .message_max = 1608};
    link_for_serial(&c, (uint32_t)baud);
    struct pair *p = new_pair(&c, &q, 1);
    uint32_t messages = (65536 * 8 + 1607) / 1608;
    run(p, messages, step_us, UINT64_MAX / 2);
    double ideal = messages * 1608.0 / (baud / 10) * 1e6;
    double took = (double)(p->now_us - 1000);
    *bytes = p->ends[0].bytes;
    free_pair(p);
    return ideal / took;
}

TEST(throughput_on_serial_wires) {
    const double bauds[] = {115200, 921600, 3000000};
    for (unsigned i = 0; i < 3; i++) {
        size_t bytes;
        uint32_t step_us = (uint32_t)(3e8 / bauds[i]);
        double clean = share(bauds[i], 0, step_us, &bytes);
        double noisy = share(bauds[i], 1e-5, step_us, &bytes);
        print_message("%7.0f baud: %.1f %% of the wire, at 1e-5 bit errors "
                      "%.1f %%; %zu bytes a link\n",
                      bauds[i], 100 * clean, 100 * noisy, bytes);
        assert_true(bytes <= 16384);
        assert_true(clean >= 0.90);
        assert_true(noisy >= 0.70);
    }
}

/* --- limits --------------------------------------------------------------- */

static bool starts(const struct link_config *config) {
    size_t bytes = link_bytes(config), room = 1 << 20;
    void *memory = aligned_alloc(64, room);
    assert_non_null(memory);
    struct link *link = link_init(memory, room, config);
    assert_true(bytes <= room && (link != NULL) == (bytes > 0));
    if (link != NULL) {
        assert_null(link_init(memory, bytes - 1, config));
        assert_null(link_init((uint8_t *)memory + 4, room - 4, config));
    }
    free(memory);
    return link != NULL;
}

/* That a field may have the one value, and may not have the other. */
#define limit(config, field, good, bad)                                        \
    do {                                                                       \
        struct link_config c_ = config;                                        \
        c_.field = good;                                                       \
        assert_true(starts(&c_));                                              \
        c_.field = bad;                                                        \
        assert_false(starts(&c_));                                             \
    } while (0)

TEST(limits_of_a_config) {
    struct sim_end nowhere = {NULL, NULL, NULL};
    struct link_config c = {
        .pipe = sim_pipe(&nowhere), .epoch = 1, .window = 4};
    limit(c, pipe.send, c.pipe.send, NULL);
    limit(c, pipe.receive, c.pipe.receive, NULL);
    limit(c, epoch, UINT32_MAX, 0);
    limit(c, window, 1, 0);
    limit(c, window, LINK_WINDOW_MAX, LINK_WINDOW_MAX + 1);
    c.frame_payload = 408;
    limit(c, window, 4, 3); /* a message of 1,616, 4 frames */
    limit(c, message_max, LINK_MESSAGE_MAX, LINK_MESSAGE_MAX + 1);
    c.message_max = 32;
    limit(c, frame_payload, LINK_FRAME_PAYLOAD_MIN, LINK_FRAME_PAYLOAD_MIN - 8);
    limit(c, frame_payload, LINK_FRAME_PAYLOAD_MAX, LINK_FRAME_PAYLOAD_MAX + 8);
    limit(c, frame_payload, 40, 44);
    limit(c, staging, LINK_WINDOW_MAX, LINK_WINDOW_MAX + 1);
    limit(c, timeout_min_us, 1000000, 1000001);
    limit(c, timeout_max_us, 100000, 99999);
}
