/* Two ends of a keyed wire and the pipes between them, for tests of the secure
 * layer. */
#ifndef TESTS_UNIT_SECURE_WORLD_H
#define TESTS_UNIT_SECURE_WORLD_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "transport/drivers/secure_sodium.h"
#include "tests/unit/test.h"

enum { ROOM = 1 << 16 };

/* A pipe in memory, of which everything sent is kept. */
struct lane {
    uint8_t bytes[ROOM];
    size_t begin, end, most; /* most: bytes a call; 0: all */
};
struct ends {
    struct lane *in, *out;
};

static inline int lane_send(void *context, const uint8_t *bytes, size_t size) {
    struct lane *lane = ((struct ends *)context)->out;
    if (lane->most != 0 && size > lane->most)
        size = lane->most;
    assert_true(lane->end + size <= ROOM);
    memcpy(lane->bytes + lane->end, bytes, size);
    lane->end += size;
    return (int)size;
}

static inline int lane_receive(void *context, uint8_t *bytes, size_t size) {
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
    struct secure_records records[2];
};

/* The wire between port 2 of node 5, which calls, and that of node 1. */
static const struct secure_ends wire[2] = {{{5, 2}, {1, 2}}, {{1, 2}, {5, 2}}};

/* With `salt` as their nonces, and 0x10 more as their secrets. */
static inline void open_shake(struct world *w, unsigned who, uint8_t salt,
                              const struct secure_ends *ends) {
    struct secure_self self = {&secure_sodium, w->key[who], who == 0, *ends};
    struct secure_seed seed;
    memset(seed.nonce, salt, sizeof seed.nonce);
    memset(seed.secret, salt + 0x10, sizeof seed.secret);
    secure_shake_init(&w->shake[who], &self, &seed);
}

/* End 0 calls.  `salt` makes the seeds. */
static inline struct world *new_world(uint8_t salt, size_t most) {
    struct world *w = calloc(1, sizeof *w);
    assert_non_null(w);
    for (unsigned who = 0; who < 2; who++) {
        for (unsigned i = 0; i < SECURE_KEY_BYTES; i++)
            w->key[who][i] = (uint8_t)i;
        w->lanes[who].most = most;
        w->ends[who] = (struct ends){&w->lanes[1 - who], &w->lanes[who]};
        w->pipes[who] =
            (struct link_pipe){&w->ends[who], lane_send, lane_receive};
        open_shake(w, who, (uint8_t)(salt + who), &wire[who]);
    }
    return w;
}

static inline void shake_hands(struct world *w, int want[2]) {
    want[0] = want[1] = 0;
    for (unsigned i = 0; i < 1000; i++) {
        for (unsigned who = 0; who < 2; who++)
            if (want[who] == 0)
                want[who] = secure_shake(&w->shake[who], &w->pipes[who]);
    }
    for (unsigned who = 0; who < 2; who++) {
        if (want[who] > 0) {
            secure_records_start(&w->records[who], &w->shake[who],
                                 &w->pipes[who]);
        }
    }
}

static inline struct world *connected(uint8_t salt, size_t most) {
    int status[2];
    struct world *w = new_world(salt, most);
    shake_hands(w, status);
    assert_int_equal(status[0], 1);
    assert_int_equal(status[1], 1);
    return w;
}

/* That these are the bytes, in hexadecimal. */
static inline void expect_bytes(const uint8_t *bytes, const char *hex) {
    for (size_t i = 0; hex[2 * i] != '\0'; i++) {
        unsigned byte = 0;
        assert_int_equal(sscanf(hex + 2 * i, "%2x", &byte), 1);
        assert_int_equal(bytes[i], byte);
    }
}

#endif
