/* How two who know a key prove it to each other: another key, another wire, a
 * changed byte and a point without a secret are found, and the vector of
 * PROTOCOL.md holds. */
#include "secure_world.h"

TEST(another_key_is_refused) {
    for (unsigned bit = 0; bit < 256; bit += 17) {
        int status[2];
        struct world *w = new_world(3, 0);
        w->key[1][bit / 8] ^= (uint8_t)(1u << bit % 8);
        open_shake(w, 1, 4, &wire[1]);
        shake_hands(w, status);
        assert_int_equal(status[0], -1);
        assert_int_equal(status[1], -1);
        assert_int_equal(w->shake[0].fault, SECURE_OTHER_KEY);
        assert_int_equal(w->shake[1].fault, SECURE_OTHER_KEY);
        free(w);
    }
}

/* What else may be at the other end, and how it is told. */
TEST(what_is_no_greeting_is_told) {
    static const uint8_t link[] = {
        3, 1, 8, 1,    1, 1,    3, 0x44, 0x33, 1,    2,    0x18, 6,    2, 0x23,
        1, 2, 5, 2,    1, 7,    2, 4,    0x44, 0x33, 0x22, 0x11, 1,    1, 1,
        2, 8, 5, 0x48, 6, 0x48, 6, 1,    5,    0x6b, 0x2c, 0xbc, 0x9e, 0};
    static const struct {
        const char *said;
        enum secure_fault fault;
    } cases[] = {{NULL, SECURE_NO_KEY},
                 {"GET / HTTP/1.0\r\n", SECURE_NO_GREETING},
                 {"i", SECURE_SOUND},
                 {"incodeS", SECURE_NO_GREETING},
                 {"incodes\x02more", SECURE_OTHER_VERSION},
                 {"incodes\x03", SECURE_SOUND}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct world *w = new_world(3, 0);
        const char *said = cases[i].said;
        (void)lane_send(&w->ends[0],
                        said == NULL ? link : (const uint8_t *)said,
                        said == NULL ? sizeof link : strlen(said));
        int status = secure_shake(&w->shake[1], &w->pipes[1]);
        assert_int_equal(status, cases[i].fault == SECURE_SOUND ? 0 : -1);
        assert_int_equal(w->shake[1].fault, cases[i].fault);
        assert_int_equal(secure_greets(w->lanes[0].bytes, w->lanes[0].end),
                         said != NULL && strncmp(said, "incodes", 7) == 0);
        free(w);
    }
}

/* Each of the two says which wire it takes this for, and the other hears it:
 * one that somebody has joined to another is found. */
TEST(a_wire_that_leads_elsewhere_is_told) {
    static const struct {
        struct secure_ends caller;
        bool misled;
    } cases[] = {{{{5, 2}, {1, 2}}, false},
                 {{{5, 2}, {3, 2}}, true},
                 {{{7, 2}, {1, 2}}, true},
                 {{{5, 1}, {1, 2}}, true},
                 {{{5, 2}, {1, 1}}, true},
                 {{{SECURE_NODE_UNKNOWN, 2}, {SECURE_NODE_UNKNOWN, 2}}, false},
                 {{{SECURE_NODE_UNKNOWN, 2}, {SECURE_NODE_UNKNOWN, 1}}, true},
                 {{{5, SECURE_PORT_UNKNOWN}, {1, SECURE_PORT_UNKNOWN}}, false},
                 {{{6, SECURE_PORT_UNKNOWN}, {1, SECURE_PORT_UNKNOWN}}, true},
                 {{{SECURE_NODE_UNKNOWN, SECURE_PORT_UNKNOWN},
                   {SECURE_NODE_UNKNOWN, SECURE_PORT_UNKNOWN}},
                  false}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct world *w = new_world(3, 0);
        int status[2] = {0, 0};
        open_shake(w, 0, 3, &cases[i].caller);
        for (unsigned k = 0; k < 6; k++)
            status[k % 2] = secure_shake(&w->shake[k % 2], &w->pipes[k % 2]);
        assert_int_equal(status[0] + status[1], 2);
        struct secure_ends heard = secure_shake_peer(&w->shake[1]);
        assert_int_equal(heard.self.node, cases[i].caller.self.node);
        assert_int_equal(heard.self.port, cases[i].caller.self.port);
        assert_int_equal(heard.peer.node, cases[i].caller.peer.node);
        assert_int_equal(heard.peer.port, cases[i].caller.peer.port);
        assert_true(secure_shake_misled(&w->shake[0]) == cases[i].misled);
        assert_true(secure_shake_misled(&w->shake[1]) == cases[i].misled);
        free(w);
    }
}

static unsigned multiplied;

static void counted_x25519(uint8_t out[SECURE_KEY_BYTES],
                           const uint8_t secret[SECURE_KEY_BYTES],
                           const uint8_t point[SECURE_KEY_BYTES]) {
    multiplied++;
    secure_sodium.x25519(out, secret, point);
}

/* Points of a small order, which leave no secret, said by one who has the key;
 * and a listener multiplies for no stranger. */
TEST(a_point_without_a_secret_is_refused) {
    static const uint8_t points[][SECURE_KEY_BYTES] = {
        {0}, {1}, {0xe0, 0xeb, 0x7a, 0x7c, 0x3b, 0x41, 0xb8, 0xae,
                   0x16, 0x56, 0xe3, 0xfa, 0xf1, 0x9f, 0xc4, 0x6a,
                   0xda, 0x09, 0x8d, 0xeb, 0x9c, 0x32, 0xb1, 0xfd,
                   0x86, 0x62, 0x05, 0x16, 0x5f, 0x49, 0xb8, 0x00}};
    enum { TAG = 40, POINT = SECURE_GREETING_BYTES };
    struct secure_suite suite = secure_sodium;
    suite.x25519 = counted_x25519;
    for (unsigned tagged = 0; tagged < 2; tagged++) {
        for (size_t i = 0; i < 3; i++) {
            uint8_t tag[SECURE_KEY_BYTES];
            struct world *w = new_world(3, 0);
            uint8_t *said = w->lanes[0].bytes;
            w->shake[1].self.suite = &suite;
            assert_int_equal(secure_shake(&w->shake[0], &w->pipes[0]), 0);
            assert_int_equal(w->lanes[0].end, SECURE_POINT_END);
            memcpy(said + POINT, points[i], SECURE_KEY_BYTES);
            secure_sodium.hash(tag, w->key[0], said, TAG);
            assert_memory_equal(said + TAG, tag, SECURE_TAG_BYTES);
            said[TAG] ^= tagged == 0;
            multiplied = 0;
            assert_int_equal(secure_shake(&w->shake[1], &w->pipes[1]), -1);
            assert_int_equal(w->shake[1].fault, SECURE_OTHER_KEY);
            assert_int_equal(multiplied, 2 * tagged);
            assert_int_equal(w->lanes[1].end, SECURE_GREETING_BYTES);
            free(w);
        }
    }
}

/* Whose key is known later: the records' keys need the exchange as well; and
 * who can undo that needs the key. */
TEST(keys_need_the_key_and_the_exchange) {
    static const uint8_t zero[SECURE_KEY_BYTES];
    struct secure_keys keys[3];
    for (unsigned how = 0; how < 3; how++) {
        int status[2] = {0, 0};
        struct world *w = new_world(3, 0);
        if (how == 1) {
            w->key[0][0] = w->key[1][0] = 99;
            open_shake(w, 0, 3, &wire[0]);
            open_shake(w, 1, 4, &wire[1]);
        } else if (how == 2) {
            struct secure_self self = w->shake[0].self;
            struct secure_seed seed = {{0}, {1}};
            memset(seed.nonce, 3, sizeof seed.nonce);
            secure_shake_init(&w->shake[0], &self, &seed);
        }
        for (unsigned k = 0; k < 6; k++)
            status[k % 2] = secure_shake(&w->shake[k % 2], &w->pipes[k % 2]);
        assert_int_equal(status[0] + status[1], 2);
        keys[how] = w->shake[0].keys;
        assert_memory_equal(keys[how].out, w->shake[1].keys.in, 32);
        assert_memory_equal(keys[how].in, w->shake[1].keys.out, 32);
        assert_memory_not_equal(keys[how].in, keys[how].out, 32);
        assert_memory_equal(w->shake[0].secret, zero, 32);
        for (unsigned other = 0; other < how; other++)
            assert_memory_not_equal(keys[how].out, keys[other].out, 32);
        free(w);
    }
}

/* Each byte of it in turn. */
TEST(a_changed_opening_is_refused) {
    for (size_t at = 0; at < SECURE_OPENING_BYTES; at++) {
        int status[2] = {0, 0};
        struct world *w = new_world(5, 0);
        while (w->lanes[0].end < SECURE_OPENING_BYTES && status[1] >= 0) {
            size_t had = w->lanes[0].end;
            (void)secure_shake(&w->shake[0], &w->pipes[0]);
            if (had <= at && at < w->lanes[0].end)
                w->lanes[0].bytes[at] ^= 0x10;
            status[1] = secure_shake(&w->shake[1], &w->pipes[1]);
        }
        for (unsigned i = 0; i < 10 && status[1] == 0; i++) {
            status[0] = secure_shake(&w->shake[0], &w->pipes[0]);
            status[1] = secure_shake(&w->shake[1], &w->pipes[1]);
        }
        assert_int_equal(status[1], -1);
        free(w);
    }
}

/* The vector of PROTOCOL.md. */
TEST(the_vector) {
    struct world *w = connected(0xa0, 0);
    struct link_pipe p = secure_records_pipe(&w->records[0]);
    assert_int_equal(p.send(p.context, (const uint8_t *)"page", 4), 4);
    expect_bytes(w->lanes[0].bytes, "696e636f64657303"
                                    "6302050001000200"
                                    "a0a0a0a0a0a0a0a0a0a0a0a0"
                                    "a0a0a0a0a0a0a0a0a0a0a0a0"
                                    "2e27da54d1cd2b644ba00231c8f25b28"
                                    "80e1a53d3eee82b62b3048578cf38c98"
                                    "0ddd1131243a1047fe48482942d6b648"
                                    "0000ffff00000000"
                                    "d245035ac15b8caa9abad68d64148420"
                                    "0400fbff01000000"
                                    "ee590f49"
                                    "10ca7f48d4c3fbfb0d8e568adc5dc6ee");
    expect_bytes(w->lanes[1].bytes, "696e636f64657303"
                                    "6c02010005000200"
                                    "a1a1a1a1a1a1a1a1a1a1a1a1"
                                    "a1a1a1a1a1a1a1a1a1a1a1a1"
                                    "5a2850fd4b3c4d6f2bb3e0a73fc444a7"
                                    "d3337e4d4ee503a66976feb1fadf5bd2"
                                    "1ba96fc2b1571b3e980d87cf49797510"
                                    "0000ffff00000000"
                                    "6850b6b08c283255c750f88866bcced9");
    free(w);
}
