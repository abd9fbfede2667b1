/* Links over wires of every kind of badness, in virtual time: what is written
 * is read, once and in order, or the peer is another; and no more is ever
 * received than there is room for. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "line.h"

static const struct line_quality perfect = {.latency_us = 50, .room = 1 << 16};

/* One end: what it sends is a stream of numbered messages, and what it reads
 * must be the other's. */
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
    struct line_wire wire;
    struct end ends[2];
};

static uint32_t mix(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

static size_t size_of(const struct end *end, unsigned who, uint32_t number)
{
    uint32_t m = mix(number * 2 + who);
    if (end->size_max == 0) {
        return end->config.message_max;
    }
    size_t most = end->size_max;
    return m % 7 == 0 ? most : m % 5 == 0 ? m / 64 % 9 : m / 64 % (most + 1);
}

static void fill(uint8_t *bytes, size_t size, unsigned who, uint32_t number)
{
    uint32_t m = mix(number * 2 + who);
    for (size_t i = 0; i < size; i++) {
        uint8_t byte = (uint8_t)((m >> i % 24) + i * (m & 7));
        bytes[i] = m % 3 == 0 && i % (1 + m % 9) == 0 ? 0 : byte;
    }
    for (size_t i = 0; i < 4 && i < size; i++) {
        bytes[i] = (uint8_t)(number >> 8 * i);
    }
}

static void start(struct pair *p, unsigned who, uint32_t epoch)
{
    struct end *end = &p->ends[who];
    end->config.pipe = line_pipe(&p->wire.ends[who]);
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

static struct pair *new_pair(const struct link_config *config,
                             const struct line_quality *quality, uint64_t seed)
{
    struct pair *p = calloc(1, sizeof *p);
    assert_non_null(p);
    p->now_us = 1000 * (seed % 7);
    line_wire(&p->wire, &p->now_us, quality, seed);
    for (unsigned who = 0; who < 2; who++) {
        p->ends[who].config = *config;
        start(p, who, 0xffe0u + 40 * (uint32_t)seed + who);
        p->ends[who].most = UINT32_MAX;
    }
    return p;
}

static void free_pair(struct pair *p)
{
    free(p->ends[0].memory);
    free(p->ends[1].memory);
    free(p);
}

static void write_some(struct end *end, unsigned who)
{
    uint8_t bytes[LINK_MESSAGE_MAX];
    while (end->written < end->most) {
        size_t size = size_of(end, who, end->written), head = size % 9;
        fill(bytes, size, who, end->written);
        unsigned room = link_room(end->link, size);
        int status =
            link_write(end->link, bytes, head, bytes + head, size - head);
        assert_int_equal(status, room > 0 ? 0 : LINK_AGAIN);
        if (status != 0) {
            return;
        }
        end->written++;
    }
}

static void read_some(struct end *end, const struct end *from, unsigned who)
{
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

static void step(struct pair *p, uint32_t us)
{
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

static bool finished(const struct pair *p)
{
    return p->ends[0].read == p->ends[1].most &&
           p->ends[1].read == p->ends[0].most && link_idle(p->ends[0].link) &&
           link_idle(p->ends[1].link);
}

static void run(struct pair *p, uint32_t messages, uint32_t step_us,
                uint64_t most_us)
{
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

/* --- clean wires -----------------------------------------------------------
 */

static const struct link_config small = {
    .window = 12, .frame_payload = 160, .message_max = 1608, .staging = 2};

static void messages_of_every_size(void **unused)
{
    (void)unused;
    for (unsigned window = 1; window <= LINK_WINDOW_MAX; window *= 2) {
        struct link_config c = {.window = (uint16_t)window};
        struct pair *p = new_pair(&c, &perfect, window);
        p->ends[0].size_max = p->ends[1].size_max = 1616;
        run(p, 2000, 60, 10000000);
        const struct link_statistics *s = link_statistics(p->ends[0].link);
        assert_int_equal(s->retransmitted, 0);
        assert_int_equal(s->bad_crc + s->bad_header + s->bad_code, 0);
        assert_int_equal(s->messages_sent, 2000);
        assert_int_equal(s->messages_received, 2000);
        assert_int_equal(s->payload_received, p->ends[0].payload);
        assert_true(s->send_high_water <= window);
        assert_true(s->receive_high_water <= window);
        assert_int_equal(s->sessions, 1);
        assert_true(link_state(p->ends[0].link) == LINK_UP);
        free_pair(p);
    }
}

static void messages_of_many_frames(void **unused)
{
    (void)unused;
    for (unsigned payload = 32; payload <= 1608; payload += 8) {
        struct link_config c = {.window = (uint16_t)(1607 / payload + 1),
                                .frame_payload = (uint16_t)payload,
                                .message_max = 1608};
        c.window = (uint16_t)(c.window + payload / 8 % 3);
        if (c.window > LINK_WINDOW_MAX) {
            continue;
        }
        struct pair *p = new_pair(&c, &perfect, payload);
        p->ends[0].size_max = 1608;
        p->ends[1].size_max = 200;
        run(p, 60, 60, 10000000);
        free_pair(p);
    }
}

/* More than twice around all sequence numbers. */
static void sequence_numbers_wrap(void **unused)
{
    struct link_config c = {
        .window = 64, .frame_payload = 32, .message_max = 32};
    (void)unused;
    struct pair *p = new_pair(&c, &perfect, 3);
    p->ends[0].size_max = p->ends[1].size_max = 8;
    run(p, 140000, 60, UINT64_MAX / 2);
    assert_int_equal(link_statistics(p->ends[0].link)->retransmitted, 0);
    free_pair(p);
    /* And once with losses. */
    struct line_quality lossy = perfect;
    lossy.drop = 0.002;
    p = new_pair(&c, &lossy, 4);
    p->ends[0].size_max = p->ends[1].size_max = 8;
    run(p, 70000, 60, UINT64_MAX / 2);
    assert_true(link_statistics(p->ends[0].link)->retransmitted > 1000);
    free_pair(p);
}

static void a_reader_that_does_not_read_holds_the_writer(void **unused)
{
    (void)unused;
    struct pair *p = new_pair(&small, &perfect, 5);
    p->ends[1].lazy = true;
    p->ends[1].most = 0;
    for (unsigned i = 0; i < 50000; i++) {
        step(p, 200);
    }
    const struct link_statistics *s = link_statistics(p->ends[0].link);
    assert_true(s->frames_sent < 100);
    assert_true(s->probes_sent > 3); /* asks, but ever more rarely */
    assert_int_equal(s->retransmitted, 0);
    assert_true(link_state(p->ends[0].link) == LINK_UP);
    p->ends[1].lazy = false;
    for (unsigned i = 0; i < 1000; i++) {
        step(p, 200);
    }
    assert_true(p->ends[1].read > 50);
    free_pair(p);
}

/* The last window of credits gets lost: the sender asks for it. */
static void lost_credits_are_asked_for(void **unused)
{
    struct link_config c = {.window = 1};
    (void)unused;
    struct pair *p = new_pair(&c, &perfect, 6);
    p->ends[1].lazy = true;
    for (unsigned i = 0; i < 100; i++) {
        step(p, 200);
    }
    p->ends[1].lazy = false;
    p->wire.lines[1].quality.drop = 1;
    p->wire.lines[1].next_drop = 0;
    step(p, 200);
    step(p, 200);
    p->wire.lines[1].quality.drop = 0;
    p->wire.lines[1].next_drop = 1e300;
    uint32_t before = p->ends[1].read;
    for (unsigned i = 0; i < 10000 && p->ends[1].read == before; i++) {
        step(p, 200);
    }
    assert_true(p->ends[1].read > before);
    free_pair(p);
}

/* --- bad wires -------------------------------------------------------------
 */

/* Everything at once, each seed another mix. */
static void every_kind_of_damage(void **unused)
{
    const double chances[] = {0, 1e-5, 1e-4, 1e-3};
    uint64_t damaged = 0, again = 0, duplicates = 0;
    (void)unused;
    for (uint64_t seed = 0; seed < 60; seed++) {
        struct line_quality q = {.bytes_per_s = seed % 3 ? 300000 : 0,
                                 .latency_us = (uint32_t)(seed % 5) * 400,
                                 .room = seed % 2 ? 64 : 4096,
                                 .bit_error = chances[seed % 4] / 4,
                                 .drop = chances[seed / 4 % 4],
                                 .insert = chances[seed / 5 % 4],
                                 .repeat = chances[seed / 6 % 4],
                                 .stall = chances[seed / 7 % 3],
                                 .stall_us = 30000};
        struct link_config c = {.window = (uint16_t)(10 + seed % 23),
                                .frame_payload = 168,
                                .message_max = 1608,
                                .staging = (uint16_t)(1 + seed % 3)};
        struct pair *p = new_pair(&c, &q, seed);
        p->ends[0].size_max = 1608;
        p->ends[1].size_max = 700;
        run(p, 150, 100 + 50 * (uint32_t)(seed % 9), 600000000);
        damaged += p->wire.lines[0].damaged + p->wire.lines[1].damaged;
        again += link_statistics(p->ends[0].link)->retransmitted;
        duplicates += link_statistics(p->ends[1].link)->duplicates;
        free_pair(p);
    }
    assert_true(damaged > 5000 && again > 1500 && duplicates > 20);
}

static void garbage_between_frames(void **unused)
{
    (void)unused;
    struct pair *p = new_pair(&small, &perfect, 9);
    uint64_t random = 99;
    p->ends[0].size_max = p->ends[1].size_max = 1608;
    p->ends[0].most = p->ends[1].most = 300;
    for (unsigned i = 0; i < 40000 && !finished(p); i++) {
        if (i % 7 == 0) {
            for (unsigned k = 0; k < 1 + i % 700; k++) {
                line_put(&p->wire.lines[i % 2],
                         (uint8_t)(line_draw(&random) >> 40));
            }
        }
        if (i % 61 == 0) {
            for (unsigned k = 0; k < 3000; k++) {
                line_put(&p->wire.lines[i % 2], 0x55); /* without a zero */
            }
        }
        step(p, 100);
    }
    assert_true(finished(p));
    const struct link_statistics *s = link_statistics(p->ends[0].link);
    assert_true(s->resynchronised > 0);
    assert_true(s->bad_header + s->bad_code > 10);
    free_pair(p);
}

/* --- peers that come, go and come again ------------------------------------
 */

static void a_cut_wire_goes_on_where_it_was(void **unused)
{
    (void)unused;
    for (uint64_t seed = 0; seed < 20; seed++) {
        struct pair *p = new_pair(&small, &perfect, seed);
        p->ends[0].size_max = p->ends[1].size_max = 1608;
        p->ends[0].most = p->ends[1].most = 400;
        for (unsigned i = 0; i < 20000 && !finished(p); i++) {
            uint64_t phase = (i + seed) % 90;
            if (phase == 60) {
                line_cut(&p->wire, true);
            } else if (phase == 61 + seed) {
                line_cut(&p->wire, false);
            }
            step(p, 150);
            if (phase > 61 && phase < 61 + seed) {
                assert_true(link_state(p->ends[0].link) == LINK_DOWN);
            }
        }
        assert_true(finished(p));
        const struct link_statistics *s = link_statistics(p->ends[0].link);
        assert_int_equal(s->sessions, 1);
        if (seed > 1) {
            assert_true(s->resumed >= 1 && s->pipe_closed >= 1);
        }
        free_pair(p);
    }
}

static void a_peer_that_stops_for_long_is_called_silent(void **unused)
{
    (void)unused;
    struct pair *p = new_pair(&small, &perfect, 2);
    for (unsigned i = 0; i < 200; i++) {
        step(p, 100);
    }
    for (unsigned i = 0; i < 1000; i++) { /* ten seconds */
        p->now_us += 10000;
        link_poll(p->ends[0].link, p->now_us);
    }
    assert_true(link_state(p->ends[0].link) == LINK_SILENT);
    assert_true(link_statistics(p->ends[0].link)->retransmitted < 40);
    run(p, p->ends[0].written + 50, 100, 5000000);
    assert_true(link_state(p->ends[0].link) == LINK_UP);
    assert_int_equal(link_statistics(p->ends[0].link)->sessions, 1);
    free_pair(p);
}

/* End 1 starts again; the other must notice and begin a session without
 * anything of the old one. */
static void restart(struct pair *p, uint32_t epoch, struct link_statistics *sum)
{
    struct end *peer = &p->ends[0], *reborn = &p->ends[1];
    uint64_t sessions = link_statistics(peer->link)->sessions;
    start(p, 1, epoch);
    reborn->written = reborn->read = 0;
    reborn->most = 0;
    unsigned i;
    for (i = 0; link_statistics(peer->link)->sessions == sessions; i++) {
        assert_true(i < 100000);
        p->now_us += 100;
        link_poll_receive(peer->link, p->now_us);
        struct link_message message;
        while (link_read(peer->link, &message)) {
            /* What was whole when the old session ended is still read. */
            size_t size = size_of(reborn, 1, peer->read);
            assert_int_equal(message.size, size);
            link_release(peer->link);
            peer->read++;
        }
        if (link_statistics(peer->link)->sessions == sessions) {
            write_some(peer, 0);
        }
        link_poll_send(peer->link, p->now_us);
        assert_false(link_read(reborn->link, &message));
        link_poll(reborn->link, p->now_us);
    }
    sum->messages_dropped = link_statistics(peer->link)->messages_dropped;
    /* Both begin anew: 0's queue is empty by now. */
    peer->written = peer->read = 0;
    reborn->most = UINT32_MAX;
}

static void a_restarted_peer_is_noticed(void **unused)
{
    struct line_quality bad = perfect;
    (void)unused;
    bad.latency_us = 3000;
    bad.drop = 2e-4;
    for (uint64_t seed = 0; seed < 20; seed++) {
        struct pair *p = new_pair(&small, seed % 2 ? &bad : &perfect, seed);
        struct link_statistics sum = {0};
        p->ends[0].size_max = p->ends[1].size_max = 1608;
        for (unsigned life = 1; life < 6; life++) {
            while (p->ends[0].written < 40 + 9 * seed) {
                step(p, 100);
            }
            restart(p, 77777 * life + (uint32_t)seed, &sum);
        }
        run(p, p->ends[0].written + 50, 100, 60000000);
        assert_true(sum.messages_dropped > 0);
        assert_int_equal(link_statistics(p->ends[0].link)->sessions, 6);
        free_pair(p);
    }
}

static void greet_only(struct pair *p)
{
    for (unsigned i = 0; i < 50; i++) {
        p->now_us += 10000;
        for (unsigned who = 0; who < 2; who++) {
            link_poll(p->ends[who].link, p->now_us);
        }
    }
}

static void a_wrong_wire_is_named(void **unused)
{
    (void)unused;
    struct pair *p = new_pair(&small, &perfect, 1);
    p->ends[1].config.node = 99;
    /* start() sets who it is: another node, by hand. */
    struct link_config c = p->ends[1].config;
    c.node = 99;
    p->ends[1].link = link_init(p->ends[1].memory, p->ends[1].bytes, &c);
    greet_only(p);
    const struct link_peer *peer = link_peer(p->ends[0].link);
    assert_true(link_state(p->ends[0].link) == LINK_REFUSED);
    assert_true(peer->refusal == LINK_WRONG_WIRE);
    assert_int_equal(peer->node, 99);
    assert_int_equal(peer->port, 2);
    assert_true(link_state(p->ends[1].link) == LINK_REFUSED);
    /* Wired right at last: no restart of this end is needed. */
    start(p, 1, 4242);
    run(p, 20, 100, 5000000);
    assert_true(link_state(p->ends[0].link) == LINK_UP);
    free_pair(p);
}

static void sizes_that_do_not_fit_are_refused(void **unused)
{
    (void)unused;
    struct pair *p = new_pair(&small, &perfect, 1);
    p->ends[1].config.frame_payload = 168;
    start(p, 1, 4242);
    greet_only(p);
    assert_true(link_state(p->ends[0].link) == LINK_REFUSED);
    assert_true(link_peer(p->ends[0].link)->refusal == LINK_WRONG_SIZES);
    free_pair(p);
}

/* Its own bytes come back: the plug is in both sockets of one port. */
static void a_wire_to_itself_is_refused(void **unused)
{
    (void)unused;
    struct pair *p = new_pair(&small, &perfect, 1);
    p->wire.ends[0].in = p->wire.ends[0].out;
    greet_only(p);
    assert_true(link_state(p->ends[0].link) == LINK_REFUSED);
    assert_int_equal(link_peer(p->ends[0].link)->node, 10);
    free_pair(p);
}

static void farewell(void **unused)
{
    (void)unused;
    for (uint64_t seed = 0; seed < 20; seed++) {
        struct line_quality bad = perfect;
        bad.drop = seed % 2 ? 0.002 : 0;
        struct pair *p = new_pair(&small, &bad, seed);
        p->ends[0].size_max = p->ends[1].size_max = 300;
        p->ends[0].most = 40;
        p->ends[1].most = 0;
        for (unsigned i = 0; i < 3; i++) {
            step(p, 100);
        }
        p->ends[0].most = p->ends[0].written;
        link_close(p->ends[0].link, p->now_us + 10000000);
        for (unsigned i = 0; i < 90000; i++) {
            step(p, 100);
            if (link_state(p->ends[0].link) == LINK_CLOSED) {
                break;
            }
        }
        assert_true(link_state(p->ends[1].link) == LINK_CLOSED);
        assert_int_equal(p->ends[1].read, p->ends[0].most);
        /* Another start of the closed end is welcome. */
        start(p, 0, 31 + (uint32_t)seed);
        p->ends[0].written = p->ends[1].read = 0;
        run(p, 10, 100, 60000000);
        free_pair(p);
    }
}

static void farewell_to_the_dead_ends_in_time(void **unused)
{
    (void)unused;
    for (unsigned cut = 0; cut < 2; cut++) {
        struct pair *p = new_pair(&small, &perfect, 1);
        for (unsigned i = 0; i < 50; i++) {
            step(p, 100);
        }
        if (cut) {
            line_cut(&p->wire, true);
        }
        uint64_t deadline = p->now_us + 300000;
        link_close(p->ends[0].link, deadline);
        while (link_state(p->ends[0].link) != LINK_CLOSED) {
            uint64_t due = link_next_due_us(p->ends[0].link, p->now_us);
            assert_true(p->now_us <= deadline && due <= 300000);
            p->now_us += due > 0 ? due : 1;
            link_poll(p->ends[0].link, p->now_us);
        }
        free_pair(p);
    }
}

/* --- time ------------------------------------------------------------------
 */

/* An end that sleeps until its next due time, or a byte, misses nothing. */
static void sleeping_until_due_is_enough(void **unused)
{
    struct line_quality bad = perfect;
    (void)unused;
    bad.drop = 3e-4;
    for (uint64_t seed = 0; seed < 10; seed++) {
        struct pair *p = new_pair(&small, &bad, seed);
        p->ends[0].size_max = p->ends[1].size_max = 1608;
        p->ends[0].most = p->ends[1].most = 100;
        unsigned polls = 0;
        while (!finished(p)) {
            uint64_t due = UINT64_MAX;
            for (unsigned who = 0; who < 2; who++) {
                const struct line *in = p->wire.ends[who].in;
                uint64_t mine = link_next_due_us(p->ends[who].link, p->now_us);
                if (in->begin < in->end) {
                    uint64_t at = in->arrival_us[in->begin % LINE_BYTES];
                    uint64_t byte = at > p->now_us ? at - p->now_us : 0;
                    mine = byte < mine ? byte : mine;
                }
                due = mine < due ? mine : due;
            }
            step(p, (uint32_t)due);
            assert_true(++polls < 40000);
        }
        free_pair(p);
    }
}

/* Share of the line rate, both directions at once, in 64 KB transfers. */
static double share(double baud, double bit_error, uint32_t step_us,
                    size_t *bytes)
{
    struct line_quality q = {.bytes_per_s = baud / 10,
                             .latency_us = 1000,
                             .room = 512,
                             .bit_error = bit_error};
    struct link_config c = {
        .window = 14, .frame_payload = 408, .message_max = 1608, .staging = 2};
    struct pair *p = new_pair(&c, &q, 1);
    uint32_t messages = (65536 * 8 + 1607) / 1608;
    run(p, messages, step_us, UINT64_MAX / 2);
    double ideal = messages * 1608.0 / (baud / 10) * 1e6;
    double took = (double)(p->now_us - 1000);
    *bytes = p->ends[0].bytes;
    free_pair(p);
    return ideal / took;
}

static void throughput_on_serial_lines(void **unused)
{
    const double bauds[] = {115200, 921600, 3000000};
    (void)unused;
    for (unsigned i = 0; i < 3; i++) {
        size_t bytes;
        uint32_t step_us = (uint32_t)(3e8 / bauds[i]);
        double clean = share(bauds[i], 0, step_us, &bytes);
        double noisy = share(bauds[i], 1e-5, step_us, &bytes);
        print_message("%7.0f baud: %.1f %% of the line, at 1e-5 bit errors "
                      "%.1f %%; %zu bytes a link\n",
                      bauds[i], 100 * clean, 100 * noisy, bytes);
        assert_true(bytes <= 16384);
        assert_true(clean >= 0.90);
        assert_true(noisy >= 0.70);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(messages_of_every_size),
        cmocka_unit_test(messages_of_many_frames),
        cmocka_unit_test(sequence_numbers_wrap),
        cmocka_unit_test(a_reader_that_does_not_read_holds_the_writer),
        cmocka_unit_test(lost_credits_are_asked_for),
        cmocka_unit_test(every_kind_of_damage),
        cmocka_unit_test(garbage_between_frames),
        cmocka_unit_test(a_cut_wire_goes_on_where_it_was),
        cmocka_unit_test(a_peer_that_stops_for_long_is_called_silent),
        cmocka_unit_test(a_restarted_peer_is_noticed),
        cmocka_unit_test(a_wrong_wire_is_named),
        cmocka_unit_test(sizes_that_do_not_fit_are_refused),
        cmocka_unit_test(a_wire_to_itself_is_refused),
        cmocka_unit_test(farewell),
        cmocka_unit_test(farewell_to_the_dead_ends_in_time),
        cmocka_unit_test(sleeping_until_due_is_enough),
        cmocka_unit_test(throughput_on_serial_lines),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
