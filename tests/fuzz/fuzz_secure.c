/* A keyed wire in the hands of somebody who may do as he likes with it: what is
 * said on it is flipped, cut, repeated, taken from the other direction or from
 * an earlier connection under the same key, and mixed with bytes of his own.
 *
 * Who has not the key is never taken for one who has, whatever he repeats; nor
 * is anybody whose opening was changed by a byte; an end multiplies on the
 * curve for no stranger that calls; what is heard is said records, whole and in
 * order, a zero for those that are missing; what is opened in vain is bounded;
 * and once the wire is left alone, records are heard again, or the connection
 * is over. */
#include <stdlib.h>
#include <string.h>

#include "transport/drivers/secure_sodium.h"

enum {
    LANE = 1 << 14,
    RECORD_MAX = 700,
    LAST_RECORDS = 22, /* of 100 bytes and more: the longest record and more */
    TURNS_MAX = 400    /* for openings of a byte a call as well */
};

struct script {
    const uint8_t *bytes;
    size_t size;
};

struct lane {
    uint8_t bytes[LANE];
    size_t count;
};

struct end {
    struct secure_shake shake;
    struct secure_records records;
    int status; /* of the shake */
    bool over;  /* the connection */
    bool misled;
    uint8_t opening[SECURE_OPENING_BYTES]; /* what it said first */
    size_t opened;
    struct lane said, hears;
    size_t most; /* bytes a call of the pipe; 0: all */
    unsigned sent, heard;
    size_t at; /* in the record that is heard */
    bool gap;
    unsigned multiplied;
    size_t vain; /* opened since the last good record */
};

static struct end ends[2];
static struct end *working; /* whose call it is */

static uint8_t next(struct script *script) {
    if (script->size == 0)
        return 0;
    script->size--;
    return *script->bytes++;
}

static void expect(bool so) {
    if (!so)
        abort();
}

/* --- the suite, counted --------------------------------------------------- */

static void x25519(uint8_t out[SECURE_KEY_BYTES],
                   const uint8_t secret[SECURE_KEY_BYTES],
                   const uint8_t point[SECURE_KEY_BYTES]) {
    working->multiplied++;
    secure_sodium.x25519(out, secret, point);
}

static bool open(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES]) {
    bool good = secure_sodium.open(out, in, size, ad, counter, key);
    working->vain = good ? 0 : working->vain + size + 1;
    expect(working->vain <= SECURE_LOST_MAX + SECURE_RECORD_MAX + 1);
    return good;
}

/* --- pipes ---------------------------------------------------------------- */

static void put(struct lane *lane, const uint8_t *bytes, size_t size) {
    size = size < LANE - lane->count ? size : LANE - lane->count;
    memmove(lane->bytes + lane->count, bytes, size);
    lane->count += size;
}

static void take(struct lane *lane, size_t size) {
    lane->count -= size;
    memmove(lane->bytes, lane->bytes + size, lane->count);
}

static size_t limit(const struct end *end, size_t size, size_t have) {
    size = size < have ? size : have;
    return end->most != 0 && size > end->most ? end->most : size;
}

static int pipe_send(void *context, const uint8_t *bytes, size_t size) {
    struct end *end = context;
    size = limit(end, size, LANE - end->said.count);
    put(&end->said, bytes, size);
    for (size_t i = 0; i < size && end->opened < sizeof end->opening; i++)
        end->opening[end->opened++] = bytes[i];
    return (int)size;
}

static int pipe_receive(void *context, uint8_t *bytes, size_t size) {
    struct end *end = context;
    size = limit(end, size, end->hears.count);
    memcpy(bytes, end->hears.bytes, size);
    take(&end->hears, size);
    return (int)size;
}

/* --- ends ----------------------------------------------------------------- */

static void open_end(unsigned who, uint8_t salt, uint8_t key_salt,
                     const struct secure_ends *wire) {
    static struct secure_suite suite;
    static uint8_t keys[2][SECURE_KEY_BYTES];
    struct secure_self self = {&suite, keys[who], who == 0, *wire};
    struct secure_seed seed;
    suite = secure_sodium;
    suite.x25519 = x25519;
    suite.open = open;
    memset(keys[who], key_salt, sizeof keys[who]);
    memset(seed.nonce, salt, sizeof seed.nonce);
    memset(seed.secret, salt + 1, sizeof seed.secret);
    memset(&ends[who], 0, sizeof ends[who]);
    working = &ends[who];
    secure_shake_init(&ends[who].shake, &self, &seed);
}

/* It is proven by what the other end has said, to the last byte. */
static void shake(struct end *end) {
    const struct end *peer = &ends[end == ends];
    struct link_pipe pipe = {end, pipe_send, pipe_receive};
    if (end->status != 0)
        return;
    working = end;
    end->status = secure_shake(&end->shake, &pipe);
    end->over = end->status < 0;
    expect(end->multiplied <= 2);
    if (end->status > 0) {
        expect(peer->opened == sizeof peer->opening);
        expect(memcmp(end->shake.in, peer->opening, peer->opened) == 0);
        end->misled = secure_shake_misled(&end->shake);
        secure_records_start(&end->records, &end->shake, &pipe);
    }
}

/* Its length, and byte i: none is zero, and the first two say the number. */
static size_t record_size(unsigned number) {
    return 100 + number * 37 % (RECORD_MAX - 100);
}

static uint8_t record_byte(unsigned number, size_t i) {
    size_t value = i == 0   ? number % 255
                   : i == 1 ? number / 255
                            : (number * 7 + i) % 255;
    return (uint8_t)(1 + value);
}

static void say(struct end *end, unsigned number) {
    struct link_pipe pipe = secure_records_pipe(&end->records);
    uint8_t bytes[RECORD_MAX];
    size_t size = record_size(number);
    for (size_t i = 0; i < size; i++)
        bytes[i] = record_byte(number, i);
    working = end;
    int sent = pipe.send(pipe.context, bytes, size);
    expect(sent == 0 || (size_t)sent == size || sent == LINK_PIPE_CLOSED);
    end->over = end->over || sent < 0;
    end->sent += sent > 0;
}

/* One byte more of what the peer has said. */
static void check(struct end *end, const struct end *peer, uint8_t byte) {
    if (end->at == 0 && byte == 0) {
        expect(!end->gap);
        end->gap = true;
        return;
    }
    if (end->at == 0 && end->gap) { /* which one, the second byte says */
        unsigned number = end->heard + 1;
        while (number < peer->sent && record_byte(number, 0) != byte)
            number++;
        end->heard = number;
        end->gap = false;
    }
    if (end->at == 1)
        while (end->heard < peer->sent && record_byte(end->heard, 1) != byte)
            end->heard += 255;
    expect(end->heard < peer->sent);
    expect(byte == record_byte(end->heard, end->at));
    end->at++;
    if (end->at == record_size(end->heard)) {
        end->at = 0;
        end->heard++;
    }
}

/* Whether something was heard. */
static bool hear(struct end *end, const struct end *peer, size_t size) {
    struct link_pipe pipe = secure_records_pipe(&end->records);
    uint8_t bytes[256];
    working = end;
    int got = pipe.receive(pipe.context, bytes, size < 256 ? size : 256);
    end->over = end->over || got < 0;
    for (int i = 0; i < got; i++)
        check(end, peer, bytes[i]);
    return got > 0;
}

/* --- the wire ------------------------------------------------------------- */

/* What both have said in an earlier connection, under the same key. */
static struct lane earlier[2];

static void pass_on(unsigned who, size_t size) {
    struct lane *said = &ends[who].said;
    size = size < said->count ? size : said->count;
    size = size < LANE - ends[1 - who].hears.count
               ? size
               : LANE - ends[1 - who].hears.count;
    put(&ends[1 - who].hears, said->bytes, size);
    take(said, size);
}

static void remember(void) {
    static const struct secure_ends wire = {{0, 0}, {0, 0}};
    open_end(0, 200, 1, &wire);
    open_end(1, 201, 1, &wire);
    for (unsigned turn = 0; turn < 10; turn++) {
        struct end *end = &ends[turn % 2];
        shake(end);
        if (end->status > 0)
            say(end, end->sent);
        put(&earlier[turn % 2], end->said.bytes, end->said.count);
        pass_on(turn % 2, LANE);
    }
    expect(ends[0].status == 1 && ends[1].status == 1);
}

/* To what `who` hears next.  The peer's bytes that it changes come first. */
static void spoil(unsigned who, struct script *script) {
    struct lane *hears = &ends[who].hears;
    uint8_t how = next(script), noise[16];
    size_t size = 1 + (size_t)next(script) * 3, begin = next(script) * 8u;
    struct lane *from = (how & 8) != 0    ? &earlier[how >> 4 & 1]
                        : (how & 16) != 0 ? &ends[who].said
                                          : &ends[1 - who].said;
    switch (how % 5) {
    case 0: /* a bit of what is under way */
        if (hears->count > 0)
            hears->bytes[begin % hears->count] ^= (uint8_t)(1u << how / 5 % 8);
        break;
    case 1: /* cut */
        take(hears, size < hears->count ? size : hears->count);
        break;
    case 2: /* lost */
        from = &ends[1 - who].said;
        take(from, size < from->count ? size : from->count);
        break;
    case 3: /* said before, or elsewhere, or not yet */
        begin = begin < from->count ? begin : 0;
        size = size < from->count - begin ? size : from->count - begin;
        put(hears, from->bytes + begin, size);
        break;
    default:
        for (size_t i = 0; i < sizeof noise; i++)
            noise[i] = next(script);
        put(hears, noise, 1 + size % sizeof noise);
        break;
    }
}

static void step(struct script *script, bool spoils_openings) {
    uint8_t what = next(script);
    unsigned who = what & 1;
    struct end *end = &ends[who], *peer = &ends[1 - who];
    bool open = ends[0].status > 0 && ends[1].status > 0;
    switch (what >> 1 & 3) {
    case 0:
        pass_on(1 - who, (size_t)next(script) * 4 + 1);
        break;
    case 1:
        if (open || spoils_openings)
            spoil(who, script);
        break;
    case 2:
        if (end->status > 0 && !end->over)
            say(end, end->sent);
        break;
    default:
        shake(end);
        if (end->status > 0 && !end->over)
            (void)hear(end, peer, 1 + (what >> 3) * 8u);
        break;
    }
}

/* Without anybody between them. */
static void leave_alone(void) {
    unsigned said[2] = {0, 0};
    for (unsigned turn = 0;
         turn < TURNS_MAX && said[0] + said[1] < 2 * LAST_RECORDS; turn++) {
        unsigned who = turn % 2;
        struct end *end = &ends[who], *peer = &ends[1 - who];
        end->most = 0;
        shake(end);
        pass_on(who, LANE);
        if (end->status <= 0 || peer->status <= 0)
            continue;
        if (!end->over && said[who] < LAST_RECORDS) {
            unsigned sent = end->sent;
            say(end, end->sent);
            said[who] += end->sent - sent;
            pass_on(who, LANE);
        }
        while (!peer->over && hear(peer, end, 256)) {
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct script script = {data, size};
    uint8_t how = next(&script);
    /* 0: both have the key, and the opening passes; 1: and it is spoilt;
     * 2: another key; 3: nobody is there but who is between them */
    unsigned mode = how % 4;
    struct secure_ends wire[2] = {{{0, 0}, {0, 0}}, {{0, 0}, {0, 0}}};
    if (earlier[0].count == 0)
        remember();
    for (unsigned who = 0; who < 2; who++) {
        wire[who].self.node = next(&script);
        wire[who].peer.port = next(&script);
        open_end(who, (uint8_t)(2 * who), mode == 2 && who == 1 ? 2 : 1,
                 &wire[who]);
        ends[who].most = next(&script);
    }
    unsigned alone = how >> 2 & 1;
    if (mode == 3) {
        ends[1 - alone].status = -1;
        ends[1 - alone].said.count = 0;
    }
    while (script.size > 0)
        step(&script, mode != 0);
    leave_alone();
    if (mode >= 2) {
        expect(ends[0].status <= 0 && ends[1].status <= 0);
        expect(mode == 3 || ends[1].multiplied == 0);
    } else if (mode == 0) {
        expect(ends[0].status > 0 && ends[1].status > 0);
        expect(ends[0].misled == ends[1].misled);
        for (unsigned who = 0; who < 2; who++) {
            expect(ends[who].over || ends[1 - who].over ||
                   ends[who].heard + LAST_RECORDS > ends[1 - who].sent);
        }
    }
    return 0;
}
