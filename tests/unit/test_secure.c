/* Records between two who know a key: what they say arrives, and what anybody
 * changes, repeats, leaves out or invents ends the connection. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "../../transport/drivers/secure_sodium.h"

enum { ROOM = 1 << 16 };

/* A pipe in memory, of which everything sent is kept. */
struct lane {
    uint8_t bytes[ROOM];
    size_t begin, end, most; /* most: bytes a call; 0: all */
};
struct ends {
    struct lane *in, *out;
};

static int lane_send(void *context, const uint8_t *bytes, size_t size)
{
    struct lane *lane = ((struct ends *)context)->out;
    if (lane->most != 0 && size > lane->most) {
        size = lane->most;
    }
    assert_true(lane->end + size <= ROOM);
    memcpy(lane->bytes + lane->end, bytes, size);
    lane->end += size;
    return (int)size;
}

static int lane_receive(void *context, uint8_t *bytes, size_t size)
{
    struct lane *lane = ((struct ends *)context)->in;
    size_t have = lane->end - lane->begin;
    size = size < have ? size : have;
    size = lane->most != 0 && size > lane->most ? lane->most : size;
    memcpy(bytes, lane->bytes + lane->begin, size);
    lane->begin += size;
    return (int)size;
}

struct world {
    uint8_t key[2][SECURE_KEY_BYTES];
    struct lane lanes[2];
    struct ends ends[2];
    struct link_pipe pipes[2];
    struct secure_shake shake[2];
    struct secure_channel channel[2];
};

/* End 0 calls.  `salt` makes the nonces. */
static struct world *new_world(uint8_t salt, size_t most)
{
    struct world *w = calloc(1, sizeof *w);
    assert_non_null(w);
    for (unsigned who = 0; who < 2; who++) {
        uint8_t nonce[SECURE_NONCE_BYTES];
        for (unsigned i = 0; i < SECURE_KEY_BYTES; i++) {
            w->key[who][i] = (uint8_t)i;
        }
        memset(nonce, (int)(salt + who), sizeof nonce);
        w->lanes[who].most = most;
        w->ends[who] = (struct ends){&w->lanes[1 - who], &w->lanes[who]};
        w->pipes[who] =
            (struct link_pipe){&w->ends[who], lane_send, lane_receive};
        secure_shake_init(&w->shake[who], &secure_sodium, w->key[who], who == 0,
                          nonce);
    }
    return w;
}

static void shake_hands(struct world *w, int want[2])
{
    want[0] = want[1] = 0;
    for (unsigned i = 0; i < 1000; i++) {
        for (unsigned who = 0; who < 2; who++) {
            if (want[who] == 0) {
                want[who] = secure_shake(&w->shake[who], &w->pipes[who]);
            }
        }
    }
    for (unsigned who = 0; who < 2; who++) {
        if (want[who] > 0) {
            secure_channel_start(&w->channel[who], &w->shake[who],
                                 &w->pipes[who]);
        }
    }
}

static struct world *connected(uint8_t salt, size_t most)
{
    int status[2];
    struct world *w = new_world(salt, most);
    shake_hands(w, status);
    assert_int_equal(status[0], 1);
    assert_int_equal(status[1], 1);
    return w;
}

static int send_all(struct world *w, unsigned who, const uint8_t *bytes,
                    size_t size)
{
    struct link_pipe p = secure_channel_pipe(&w->channel[who]);
    size_t done = 0;
    for (unsigned i = 0; i < 100000 && done < size; i++) {
        int n = p.send(p.context, bytes + done, size - done);
        if (n < 0) {
            return n;
        }
        done += (size_t)n;
    }
    for (unsigned i = 0; i < 4000; i++) { /* what is sealed */
        if (p.send(p.context, bytes, 0) < 0) {
            return LINK_PIPE_CLOSED;
        }
    }
    return (int)done;
}

/* Bytes until none come, or LINK_PIPE_CLOSED. */
static int receive_all(struct world *w, unsigned who, uint8_t *bytes,
                       size_t size)
{
    struct link_pipe p = secure_channel_pipe(&w->channel[who]);
    size_t done = 0;
    for (unsigned idle = 0; idle < 4000;) {
        int n = p.receive(p.context, bytes + done, size - done);
        if (n < 0) {
            return n;
        }
        idle = n == 0 ? idle + 1 : 0;
        done += (size_t)n;
    }
    return (int)done;
}

static void what_is_said_arrives(void **unused)
{
    static uint8_t said[20000], heard[20001];
    static const size_t mosts[] = {0, 1, 7, 100};
    (void)unused;
    for (size_t i = 0; i < sizeof said; i++) {
        said[i] = (uint8_t)(i * 31 >> 3);
    }
    for (size_t k = 0; k < 4; k++) {
        struct world *w = connected(9, mosts[k]);
        for (unsigned who = 0; who < 2; who++) {
            assert_int_equal(send_all(w, who, said, sizeof said), sizeof said);
            assert_int_equal(receive_all(w, 1 - who, heard, sizeof heard),
                             sizeof said);
            assert_memory_equal(said, heard, sizeof said);
        }
        /* Nothing of it is legible on the way. */
        for (size_t i = 0; i + 16 <= w->lanes[0].end; i++) {
            assert_memory_not_equal(w->lanes[0].bytes + i, said + 1000, 16);
        }
        free(w);
    }
}

static void another_key_is_refused(void **unused)
{
    (void)unused;
    for (unsigned bit = 0; bit < 256; bit += 17) {
        int status[2];
        struct world *w = new_world(3, 0);
        w->key[1][bit / 8] ^= (uint8_t)(1u << bit % 8);
        shake_hands(w, status);
        assert_int_equal(status[0], -1);
        assert_int_equal(status[1], -1);
        free(w);
    }
}

/* Each byte of the opening in turn, and each of a record. */
static void a_changed_byte_ends_it(void **unused)
{
    uint8_t said[40] = "forty bytes that nobody may change", heard[64];
    (void)unused;
    for (size_t at = 0; at < SECURE_OPENING_BYTES; at++) {
        int status[2] = {0, 0};
        struct world *w = new_world(5, 0);
        while (w->lanes[0].end < SECURE_OPENING_BYTES && status[1] >= 0) {
            size_t had = w->lanes[0].end;
            (void)secure_shake(&w->shake[0], &w->pipes[0]);
            if (had <= at && at < w->lanes[0].end) {
                w->lanes[0].bytes[at] ^= 0x10;
            }
            status[1] = secure_shake(&w->shake[1], &w->pipes[1]);
        }
        for (unsigned i = 0; i < 10 && status[1] == 0; i++) {
            status[0] = secure_shake(&w->shake[0], &w->pipes[0]);
            status[1] = secure_shake(&w->shake[1], &w->pipes[1]);
        }
        assert_int_equal(status[1], -1);
        free(w);
    }
    for (size_t at = 0; at < SECURE_HEAD_BYTES + sizeof said + 16; at++) {
        struct world *w = connected(5, 0);
        size_t begin = w->lanes[0].end;
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        assert_int_equal(w->lanes[0].end - begin,
                         SECURE_HEAD_BYTES + sizeof said + 16);
        w->lanes[0].bytes[begin + at] ^= 1;
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        assert_int_equal(receive_all(w, 1, heard, sizeof heard),
                         LINK_PIPE_CLOSED);
        assert_int_equal(w->channel[1].records_in, 0);
        assert_int_equal(send_all(w, 1, said, 1), LINK_PIPE_CLOSED);
        free(w);
    }
}

/* The record again, the next one first, one's own back, an earlier connection's
 * whole side. */
static void a_repeated_record_ends_it(void **unused)
{
    static uint8_t kept[ROOM];
    uint8_t said[16] = "once", heard[64];
    (void)unused;
    for (unsigned how = 0; how < 3; how++) {
        struct world *w = connected(7, 0);
        struct lane *lane = &w->lanes[0];
        size_t begin = lane->end, size = SECURE_HEAD_BYTES + sizeof said + 16;
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        assert_int_equal(send_all(w, 0, said, sizeof said), sizeof said);
        if (how == 0) {
            memcpy(lane->bytes + begin + size, lane->bytes + begin, size);
        } else if (how == 1) {
            lane->begin += size;
        } else {
            memcpy(w->lanes[1].bytes + w->lanes[1].end, lane->bytes + begin,
                   size);
            w->lanes[1].end += size;
        }
        assert_int_equal(receive_all(w, how == 2 ? 0 : 1, heard, sizeof heard),
                         LINK_PIPE_CLOSED);
        free(w);
    }
    struct world *old = connected(7, 0);
    assert_int_equal(send_all(old, 0, said, sizeof said), sizeof said);
    size_t size = old->lanes[0].end;
    memcpy(kept, old->lanes[0].bytes, size);
    free(old);
    int status = 0;
    struct world *w = new_world(60, 0);
    memcpy(w->lanes[0].bytes, kept, size);
    w->lanes[0].end = size;
    for (unsigned i = 0; i < 10 && status == 0; i++) {
        status = secure_shake(&w->shake[1], &w->pipes[1]);
    }
    assert_int_equal(status, -1);
    free(w);
    /* An echo of what the end itself says. */
    w = new_world(61, 0);
    w->ends[1].in = w->ends[1].out;
    for (unsigned i = 0; i < 10 && status == 0; i++) {
        status = secure_shake(&w->shake[1], &w->pipes[1]);
    }
    assert_int_equal(status, -1);
    free(w);
}

static void noise_ends_it(void **unused)
{
    uint32_t random = 1;
    uint8_t heard[64];
    (void)unused;
    for (unsigned round = 0; round < 300; round++) {
        int status = 0;
        struct world *w = round % 2 == 0 ? new_world(8, 0) : connected(8, 0);
        for (unsigned i = 0; i < 4000; i++) {
            random = random * 1664525u + 1013904223u;
            w->lanes[0].bytes[w->lanes[0].end++] = (uint8_t)(random >> 24);
        }
        for (unsigned i = 0; i < 10 && status == 0 && round % 2 == 0; i++) {
            status = secure_shake(&w->shake[1], &w->pipes[1]);
        }
        if (round % 2 != 0) {
            status = receive_all(w, 1, heard, sizeof heard);
        }
        assert_int_equal(status, -1);
        free(w);
    }
}

static void expect_bytes(const uint8_t *bytes, const char *hex)
{
    for (size_t i = 0; hex[2 * i] != '\0'; i++) {
        unsigned byte = 0;
        assert_int_equal(sscanf(hex + 2 * i, "%2x", &byte), 1);
        assert_int_equal(bytes[i], byte);
    }
}

/* The vector of PROTOCOL.md. */
static void the_vector(void **unused)
{
    struct world *w = connected(0xa0, 0);
    (void)unused;
    assert_int_equal(send_all(w, 0, (const uint8_t *)"page", 4), 4);
    expect_bytes(w->lanes[0].bytes, "696e636f64657301"
                                    "a0a0a0a0a0a0a0a0a0a0a0a0"
                                    "a0a0a0a0a0a0a0a0a0a0a0a0"
                                    "0000ffffc778acaee7ff17b4530a7372915513970"
                                    "400fbffaefa0e7fce919452f53b7e714e314dd63"
                                    "8088ce4");
    expect_bytes(w->lanes[1].bytes, "696e636f64657301"
                                    "a1a1a1a1a1a1a1a1a1a1a1a1"
                                    "a1a1a1a1a1a1a1a1a1a1a1a1"
                                    "0000ffff76b21c61fda7e89f09b6a185a7b7b475");
    free(w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_said_arrives),
        cmocka_unit_test(another_key_is_refused),
        cmocka_unit_test(a_changed_byte_ends_it),
        cmocka_unit_test(a_repeated_record_ends_it),
        cmocka_unit_test(noise_ends_it),
        cmocka_unit_test(the_vector),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
