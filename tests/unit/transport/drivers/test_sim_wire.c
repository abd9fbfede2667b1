/* Wires in virtual time: rate, latency, room, what strikes them, and that the
 * same seed is the same wire. */

#include "transport/drivers/sim.h"
#include "tests/unit/test.h"

enum { BYTES = 16384, FRAME = 100, FRAMES = 4000 };

struct lab {
    struct sim_wire wire;
    uint64_t now_us;
    uint8_t bytes[2 * BYTES];
    struct link_pipe pipe[2];
};

static struct lab *new_lab(uint32_t rate, uint32_t latency_us, uint32_t room,
                           uint64_t seed) {
    const struct sim_quality quality = {rate, latency_us, room, BYTES};
    struct lab *lab = calloc(1, sizeof *lab);
    assert_non_null(lab);
    assert_int_equal(sim_wire_bytes(&quality), sizeof lab->bytes);
    sim_wire_init(&lab->wire, lab->bytes, &quality, &lab->now_us, seed);
    lab->pipe[0] = sim_pipe(&lab->wire.end[0]);
    lab->pipe[1] = sim_pipe(&lab->wire.end[1]);
    return lab;
}

static int put(struct lab *lab, const uint8_t *bytes, size_t size) {
    return lab->pipe[0].send(lab->pipe[0].context, bytes, size);
}

static int get(struct lab *lab, uint8_t *bytes, size_t size) {
    return lab->pipe[1].receive(lab->pipe[1].context, bytes, size);
}

/* A frame without a zero but its last, that says its number. */
static void fill(uint8_t *frame, uint32_t number) {
    for (uint32_t i = 0; i < FRAME; i++)
        frame[i] = (uint8_t)(1 + (number * 31 + i * 7) % 255);
    frame[FRAME - 1] = 0;
}

TEST(bytes_take_their_time) {
    uint8_t out[200], in[200];
    struct lab *lab = new_lab(10000, 5000, 150, 1);
    memset(out, 7, sizeof out);
    lab->now_us = 1000;
    assert_true(sim_next_us(&lab->wire.direction[0], 0) == UINT64_MAX);
    assert_int_equal(put(lab, out, 200), 150); /* the driver's room */
    /* A byte takes 100 us, and each is late by 5,000. */
    assert_true(sim_next_us(&lab->wire.direction[0], 0) == 6100);
    assert_true(sim_next_us(&lab->wire.direction[0], 300) == 6400);
    assert_true(sim_room_us(&lab->wire.direction[0]) == 1000 + 7500);
    lab->now_us = 6099;
    assert_int_equal(get(lab, in, 200), 0);
    lab->now_us = 6100;
    assert_int_equal(get(lab, in, 200), 1);
    lab->now_us = 7050;
    assert_int_equal(get(lab, in, 200), 9);
    assert_int_equal(put(lab, out, 50), 50); /* 60 bytes have left */
    assert_true(sim_room_us(&lab->wire.direction[0]) == UINT64_MAX);
    lab->now_us = 100000;
    assert_int_equal(get(lab, in, 200), 190);
    assert_int_equal(get(lab, in, 200), 0);
    assert_int_equal(lab->pipe[0].receive(lab->pipe[0].context, in, 1), 0);
    free(lab);
}

/* What is not read holds up who sends, and nothing is lost by that. */
TEST(a_full_wire_takes_no_more) {
    uint8_t out[1000], in[1000];
    struct lab *lab = new_lab(0, 10, BYTES, 1);
    uint64_t sent = 0, got = 0;
    for (unsigned i = 0; i < 1000; i++) {
        memset(out, 1 + (int)(i % 255), sizeof out);
        sent += (uint64_t)put(lab, out, sizeof out);
        lab->now_us += 3;
    }
    assert_true(sent <= BYTES && lab->wire.direction[0].blocked);
    assert_true(sim_room_us(&lab->wire.direction[0]) == UINT64_MAX);
    lab->now_us += 100;
    for (int n; (n = get(lab, in, sizeof in)) > 0;)
        got += (uint64_t)n;
    assert_true(got == sent);
    assert_int_equal(put(lab, out, sizeof out), sizeof out);
    free(lab);
}

/* Sends FRAMES frames under such faults; a sum of all that arrives. */
static uint64_t shower(const struct sim_faults *faults, uint64_t seed,
                       struct sim_direction *direction, uint64_t *got) {
    uint8_t frame[FRAME], in[BYTES];
    struct lab *lab = new_lab(1000000, 50, BYTES / 2, seed);
    uint64_t sum = 0;
    *got = 0;
    sim_direction_faults(&lab->wire.direction[0], faults);
    for (uint32_t i = 0; i < FRAMES; i++) {
        fill(frame, i);
        assert_int_equal(put(lab, frame, FRAME), FRAME);
        lab->now_us += 2 * FRAME + (faults == NULL ? 0 : faults->stall_us);
        int n = get(lab, in, sizeof in);
        for (int k = 0; k < n; k++)
            sum = sum * 31 + in[k];
        *got += (uint64_t)n;
    }
    *direction = lab->wire.direction[0];
    free(lab);
    return sum;
}

TEST(faults_strike_as_often_as_they_should) {
    const double chance[SIM_CHANCES] = {0.2,  1e-3, 1e-2, 1e-2,
                                        1e-2, 1e-4, 1e-3};
    const double each[SIM_CHANCES] = {
        FRAMES,         8.0 * FRAMES * FRAME, FRAMES * FRAME, FRAMES * FRAME,
        FRAMES * FRAME, FRAMES * FRAME,       FRAMES * FRAME};
    struct sim_direction direction;
    uint64_t got, clean;
    uint64_t right = shower(NULL, 1, &direction, &clean);
    assert_true(clean == FRAMES * FRAME);
    assert_true(shower(NULL, 2, &direction, &clean) == right);
    for (int kind = 0; kind < SIM_CHANCES; kind++) {
        struct sim_faults faults = {.burst_bytes = 50, .stall_us = 100};
        faults.chance[kind] = chance[kind];
        uint64_t sum = shower(&faults, 3, &direction, &got);
        double expected = each[kind] * chance[kind];
        double struck = (double)direction.struck[kind];
        assert_true(struck > 0.5 * expected && struck < 1.5 * expected);
        for (int other = 0; other < SIM_FAULTS; other++)
            assert_true(other == kind || direction.struck[other] == 0);
        assert_true(kind == SIM_STALL ? sum == right : sum != right);
        assert_true((got < clean) == (kind == SIM_LOSS || kind == SIM_DELETE));
        assert_true((got > clean) ==
                    (kind == SIM_INSERT || kind == SIM_REPEAT));
        assert_true(shower(&faults, 3, &direction, &got) == sum);
        assert_true(kind == SIM_STALL ||
                    shower(&faults, 4, &direction, &got) != sum);
    }
}

struct judge {
    enum sim_fate fate;
    uint64_t frame;
};

static enum sim_fate decide(void *context, struct sim_direction *direction) {
    const struct judge *judge = context;
    return direction->frames == judge->frame ? judge->fate : SIM_PASSES;
}

/* The second frame of three, each sent in two pieces. */
TEST(a_frame_meets_its_fate) {
    for (int fate = SIM_PASSES; fate <= SIM_LATE; fate++) {
        uint8_t frame[3][FRAME], in[5 * FRAME];
        struct judge judge = {(enum sim_fate)fate, 2};
        struct lab *lab = new_lab(0, 50, BYTES / 2, 1);
        lab->wire.direction[0].decide = decide;
        lab->wire.direction[0].context = &judge;
        for (uint32_t i = 0; i < 3; i++) {
            fill(frame[i], i);
            assert_int_equal(put(lab, frame[i], 40), 40);
            lab->now_us++;
            assert_int_equal(put(lab, frame[i] + 40, FRAME - 40), FRAME - 40);
        }
        lab->now_us += 100;
        int n = get(lab, in, sizeof in);
        assert_int_equal(n, FRAME * (fate == SIM_DROPPED ? 2
                                     : fate == SIM_TWICE ? 4
                                     : fate == SIM_LATE  ? 1
                                                         : 3));
        assert_memory_equal(in, frame[0], FRAME);
        lab->now_us += 1000000;
        n += get(lab, in + n, sizeof in - (size_t)n);
        assert_memory_equal(in + n - FRAME, frame[2], FRAME);
        if (fate == SIM_TWICE) {
            assert_memory_equal(in + FRAME, frame[1], FRAME);
            assert_memory_equal(in + 2 * FRAME, frame[1], FRAME);
        } else if (fate != SIM_DROPPED) {
            assert_int_equal(n, 3 * FRAME);
            assert_int_equal(memcmp(in + FRAME, frame[1], FRAME) != 0,
                             fate == SIM_SPOILED);
        }
        free(lab);
    }
}

TEST(wires_fail_one_way_and_both) {
    uint8_t frame[FRAME], in[FRAME];
    struct lab *lab = new_lab(0, 0, BYTES / 2, 1);
    fill(frame, 1);
    sim_direction_deaf(&lab->wire.direction[0], true);
    assert_int_equal(put(lab, frame, FRAME), FRAME);
    assert_int_equal(get(lab, in, FRAME), 0);
    assert_int_equal(lab->pipe[1].send(lab->pipe[1].context, frame, FRAME),
                     FRAME);
    assert_int_equal(lab->pipe[0].receive(lab->pipe[0].context, in, FRAME),
                     FRAME);
    sim_direction_deaf(&lab->wire.direction[0], false);
    assert_int_equal(put(lab, frame, FRAME), FRAME);
    sim_wire_cut(&lab->wire, true);
    assert_int_equal(put(lab, frame, FRAME), LINK_PIPE_CLOSED);
    assert_int_equal(get(lab, in, FRAME), LINK_PIPE_CLOSED);
    sim_wire_cut(&lab->wire, false);
    assert_int_equal(get(lab, in, FRAME), 0); /* lost with the wire */
    assert_int_equal(put(lab, frame, FRAME), FRAME);
    assert_int_equal(get(lab, in, FRAME), FRAME);
    assert_memory_equal(in, frame, FRAME);
    assert_int_equal(lab->wire.direction[0].struck[SIM_CUT], 1);
    assert_int_equal(lab->wire.direction[0].struck[SIM_DEAF], 1);
    free(lab);
}
