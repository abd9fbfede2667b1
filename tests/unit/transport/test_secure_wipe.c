/* What was wiped is gone from memory, although nobody reads it again.  A stack
 * of the test's own is looked through when the function that worked on it has
 * returned. */
#include "own_stack.h"
#include "secure_world.h"

/* In this unit, so that the compiler sees all that it could leave out.
 * NOLINTNEXTLINE(bugprone-suspicious-include) */
#include "transport/secure_wipe.c"

enum { SECRET_BYTES = 64 };

static uint8_t secret[SECRET_BYTES];

static void use_and_leave(void) {
    uint8_t copy[SECRET_BYTES];
    memcpy(copy, secret, sizeof copy);
    __asm__ volatile("" : : "r"(copy) : "memory"); /* it is used */
}

static void use_and_wipe(void) {
    uint8_t copy[SECRET_BYTES];
    memcpy(copy, secret, sizeof copy);
    __asm__ volatile("" : : "r"(copy) : "memory");
    secure_wipe(copy, sizeof copy);
}

TEST(a_wipe_stays) {
    for (unsigned i = 0; i < SECRET_BYTES; i++)
        secret[i] = (uint8_t)(0x81 + 3 * i);
    run_on_stack(use_and_leave);
    assert_true(holds(stack, sizeof stack, secret, sizeof secret));
    run_on_stack(use_and_wipe);
    assert_false(holds(stack, sizeof stack, secret, sizeof secret));
}

/* --- a connection --------------------------------------------------------- */

enum { FOUND_MAX = 32 };

static struct world *world;
static unsigned turns;
static uint8_t found[FOUND_MAX][SECURE_KEY_BYTES]; /* secrets that were made */
static unsigned found_count;

static void keep(const uint8_t made[SECURE_KEY_BYTES]) {
    assert_true(found_count < FOUND_MAX);
    memcpy(found[found_count++], made, SECURE_KEY_BYTES);
}

/* A suite that leaves nothing on the stack: what is there is the layer's. */
static void toy_hash(uint8_t out[SECURE_KEY_BYTES],
                     const uint8_t key[SECURE_KEY_BYTES], const uint8_t *in,
                     size_t size) {
    for (size_t i = 0; i < SECURE_KEY_BYTES; i++)
        out[i] = (uint8_t)(key[i] * 7u + in[i % size] * 11u + 5 * i + size);
    if (size != SECURE_GREETING_BYTES - SECURE_TAG_BYTES) /* no tag */
        keep(out);
}

static void toy_x25519(uint8_t out[SECURE_KEY_BYTES],
                       const uint8_t mine[SECURE_KEY_BYTES],
                       const uint8_t point[SECURE_KEY_BYTES]) {
    for (size_t i = 0; i < SECURE_KEY_BYTES; i++)
        out[i] = (uint8_t)(mine[i] + point[i] + i);
    if (point[0] != 9)
        keep(out);
}

static void toy_seal(uint8_t *out, const uint8_t *in, size_t size,
                     const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                     const uint8_t key[SECURE_KEY_BYTES]) {
    (void)in, (void)ad, (void)key;
    memset(out, (int)(counter + 1), size + SECURE_TAG_BYTES);
}

static bool toy_open(uint8_t *out, const uint8_t *in, size_t size,
                     const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                     const uint8_t key[SECURE_KEY_BYTES]) {
    (void)ad, (void)key;
    memmove(out, in, size);
    return in[size] == counter + 1;
}

static const struct secure_suite toy = {toy_hash, toy_x25519, toy_seal,
                                        toy_open};

static void take_turn(void) {
    unsigned who = turns % 2;
    int status = secure_shake(&world->shake[who], &world->pipes[who]);
    assert_int_equal(status, turns / 2);
    turns++;
}

/* Turns of both until both are proven; none of them leaves a secret behind. */
static void shake_on_stack(const struct secure_suite *suite, bool looks) {
    for (turns = 0; turns < 4;) {
        world->shake[turns % 2].self.suite = suite;
        run_on_stack(take_turn);
        for (unsigned i = 0; looks && i < found_count; i++)
            assert_false(holds(stack, sizeof stack, found[i], 32));
    }
}

static struct world *same_world(const struct secure_suite *suite) {
    static const uint8_t seed[2] = {0x30, 0x31};
    struct world *w = new_world(seed[0], 0);
    for (unsigned who = 0; who < 2; who++) {
        struct secure_self self = w->shake[who].self;
        struct secure_seed drawn;
        memset(drawn.nonce, seed[who], sizeof drawn.nonce);
        memset(drawn.secret, 0x41 + (int)who, sizeof drawn.secret);
        self.suite = suite;
        secure_shake_init(&w->shake[who], &self, &drawn);
    }
    return w;
}

/* All that a connection's keys are made of, and they. */
TEST(no_turn_leaves_a_secret) {
    /* Once before, as a library's function that is called for the first time
     * is looked for, and all registers are saved on the stack. */
    world = same_world(&toy);
    shake_on_stack(&toy, false);
    free(world);
    found_count = 0;
    world = same_world(&toy);
    keep(world->shake[0].secret);
    keep(world->shake[1].secret);
    keep(world->key[0]);
    shake_on_stack(&toy, true);
    assert_int_equal(found_count, 3 + 2 * 4);
    free(world);
    /* Of libsodium, where it is known beforehand what to look for. */
    world = same_world(&secure_sodium);
    found_count = 0;
    shake_on_stack(&secure_sodium, false);
    keep(world->shake[0].keys.in);
    keep(world->shake[0].keys.out);
    keep(world->key[0]);
    free(world);
    world = same_world(&secure_sodium);
    keep(world->shake[0].secret);
    keep(world->shake[1].secret);
    shake_on_stack(&secure_sodium, true);
    free(world);
}

/* In the structs, as soon as they are not needed. */
TEST(a_connection_that_ends_leaves_no_keys) {
    uint8_t said[40] = "what is secret while it is not said";
    struct world *w = same_world(&secure_sodium);
    int status[2];
    found_count = 0;
    keep(w->shake[0].secret);
    keep(w->shake[1].secret);
    for (unsigned i = 0; i < 4; i++)
        (void)secure_shake(&w->shake[i % 2], &w->pipes[i % 2]);
    keep(w->shake[0].keys.in);
    keep(w->shake[0].keys.out);
    shake_hands(w, status); /* and start records */
    for (unsigned i = 0; i < found_count; i++)
        assert_false(holds(w->shake, sizeof w->shake, found[i], 32));
    for (unsigned who = 0; who < 2; who++) {
        struct link_pipe p = secure_records_pipe(&w->records[1 - who]);
        assert_int_equal(p.send(p.context, said, sizeof said), sizeof said);
        p = secure_records_pipe(&w->records[who]);
        assert_int_equal(p.receive(p.context, said, sizeof said), sizeof said);
    }
    for (unsigned who = 0; who < 2; who++) {
        struct secure_records *r = &w->records[who];
        struct link_pipe p = secure_records_pipe(r);
        assert_true(holds(r, sizeof *r, found[2], 32));
        assert_true(holds(r, sizeof *r, said, sizeof said));
        secure_records_end(r);
        assert_false(holds(r, sizeof *r, found[2], 32));
        assert_false(holds(r, sizeof *r, found[3], 32));
        assert_false(holds(r, sizeof *r, said, sizeof said));
        assert_int_equal(p.receive(p.context, said, 1), LINK_PIPE_CLOSED);
    }
    free(w);
}

/* One that fails, and one that is given up, too. */
TEST(a_shake_that_ends_leaves_none) {
    static const uint8_t noise[SECURE_GREETING_BYTES] = "noise";
    for (unsigned given_up = 0; given_up < 2; given_up++) {
        uint8_t ephemeral[SECURE_KEY_BYTES];
        memset(ephemeral, 0x41, sizeof ephemeral);
        world = new_world(0x30, 0);
        struct secure_shake *shake = &world->shake[1];
        if (given_up)
            secure_shake_end(shake);
        else
            lane_send(&world->ends[0], noise, sizeof noise);
        assert_int_equal(secure_shake(shake, &world->pipes[1]), -1);
        assert_false(holds(shake, sizeof *shake, ephemeral, 32));
        free(world);
    }
}
