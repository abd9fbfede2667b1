#include "secure.h"

#include <string.h>

#include "bytes.h"
#include "check.h"
#include "secure_wipe.h"

/* What is hashed: label, device, number of the start, number of the draw,
 * random bytes or zeros, and what it is for. */
enum {
    DEVICE = 8,
    BOOT = DEVICE + SECURE_DEVICE_BYTES,
    DRAW = BOOT + 8,
    RANDOM = DRAW + 8,
    PURPOSE = RANDOM + SECURE_KEY_BYTES,
    DRAWN_BYTES = PURPOSE + 1
};

static const uint8_t label[DEVICE] = {'i', 'n', 'c', 'o', 'd', 'e', 'd', 1};

static void put64(uint8_t *bytes, uint64_t value) {
    bytes_put32(bytes, (uint32_t)value);
    bytes_put32(bytes + 4, (uint32_t)(value >> 32));
}

bool secure_seed_draw(struct secure_source *source,
                      const struct secure_suite *suite,
                      const uint8_t key[SECURE_KEY_BYTES],
                      struct secure_seed *seed) {
    uint8_t drawn[DRAWN_BYTES] = {0}, made[SECURE_KEY_BYTES];
    bool random =
        source->random != NULL &&
        source->random(source->context, drawn + RANDOM, SECURE_KEY_BYTES);
    memset(seed, 0, sizeof *seed);
    if (!random && source->boot == 0)
        return false;
    LINK_ASSERT(source->draws < UINT64_MAX);
    memcpy(drawn, label, sizeof label);
    memcpy(drawn + DEVICE, source->device, SECURE_DEVICE_BYTES);
    put64(drawn + BOOT, source->boot);
    put64(drawn + DRAW, source->draws++);
    drawn[PURPOSE] = 'n';
    suite->hash(made, key, drawn, sizeof drawn);
    memcpy(seed->nonce, made, sizeof seed->nonce);
    drawn[PURPOSE] = 's';
    suite->hash(seed->secret, key, drawn, sizeof drawn);
    secure_wipe(drawn, sizeof drawn);
    secure_wipe(made, sizeof made);
    return true;
}

/* --- secure --------------------------------------------------------------- */

/* The last byte is the version. */
static const uint8_t mark[SECURE_MARK_BYTES] = {'i', 'n', 'c', 'o',
                                                'd', 'e', 's', 3};

/* Where the fields of a greeting begin. */
enum {
    ROLE = SECURE_MARK_BYTES, /* 'c': the caller, 'l': the listener */
    PORT,
    NODE,
    PEER_NODE = NODE + 2,
    PEER_PORT = PEER_NODE + 2,
    NONCE = PEER_PORT + 2,
    TAG = NONCE + SECURE_NONCE_BYTES
};

/* The complement tells a changed size at once: bytes that never come are not
 * waited for.  The number, its low 32 bits, tells what is missing before it. */
static void put_head(uint8_t head[SECURE_HEAD_BYTES], size_t size,
                     uint64_t number) {
    bytes_put16(head, (unsigned)size);
    bytes_put16(head + 2, ~(unsigned)size);
    bytes_put32(head + 4, (uint32_t)number);
}

/* The size that a head states, or SIZE_MAX: none. */
static size_t head_size(const uint8_t head[SECURE_HEAD_BYTES]) {
    size_t size = bytes_get16(head);
    bool sound = (size ^ bytes_get16(head + 2)) == 0xffff;
    return sound && size <= SECURE_RECORD_MAX ? size : SIZE_MAX;
}

/* How many records are missing before it, if it is one to come. */
static uint32_t head_ahead(const uint8_t head[SECURE_HEAD_BYTES],
                           uint64_t expected) {
    return bytes_get32(head + 4) - (uint32_t)expected;
}

/* --- proving -------------------------------------------------------------- */

static void put_ends(uint8_t *greeting, const struct secure_ends *ends) {
    greeting[PORT] = ends->self.port;
    bytes_put16(greeting + NODE, ends->self.node);
    bytes_put16(greeting + PEER_NODE, ends->peer.node);
    greeting[PEER_PORT] = ends->peer.port;
}

/* That who sent a greeting knows the key, or repeats one who did. */
static void make_tag(uint8_t tag[SECURE_TAG_BYTES],
                     const struct secure_self *self, const uint8_t *greeting) {
    uint8_t whole[SECURE_KEY_BYTES];
    self->suite->hash(whole, self->key, greeting, TAG);
    memcpy(tag, whole, SECURE_TAG_BYTES);
}

/* In a time that says nothing of the bytes. */
static bool is_same(const uint8_t *a, const uint8_t *b, size_t size) {
    unsigned bits = 0;
    for (size_t i = 0; i < size; i++)
        bits |= a[i] ^ b[i];
    return bits == 0;
}

static void put_point(struct secure_shake *shake) {
    static const uint8_t base[SECURE_KEY_BYTES] = {9};
    shake->self.suite->x25519(shake->out + SECURE_GREETING_BYTES, shake->secret,
                              base);
    shake->out_end = SECURE_POINT_END;
}

/* A listener keeps its point to itself until the caller has greeted well: so a
 * stranger costs it hashes, and no multiplication. */
void secure_shake_init(struct secure_shake *shake,
                       const struct secure_self *self,
                       const struct secure_seed *seed) {
    uint8_t *greeting = shake->out;
    memset(shake, 0, sizeof *shake);
    shake->self = *self;
    memcpy(shake->secret, seed->secret, sizeof shake->secret);
    memcpy(greeting, mark, sizeof mark);
    greeting[ROLE] = self->caller ? 'c' : 'l';
    put_ends(greeting, &self->ends);
    memcpy(greeting + NONCE, seed->nonce, SECURE_NONCE_BYTES);
    make_tag(greeting + TAG, self, greeting);
    shake->out_end = SECURE_GREETING_BYTES;
    if (self->caller)
        put_point(shake);
}

/* What is wrong with what has come of a greeting. */
static enum secure_fault hear_greeting(struct secure_shake *shake) {
    enum { VERSION = SECURE_MARK_BYTES - 1 };
    size_t have =
        shake->in_end < SECURE_MARK_BYTES ? shake->in_end : SECURE_MARK_BYTES;
    uint8_t tag[SECURE_TAG_BYTES];
    if (memcmp(shake->in, mark, have < VERSION ? have : VERSION) != 0) {
        return link_greets(shake->in, shake->in_end) ? SECURE_NO_KEY
                                                     : SECURE_NO_GREETING;
    }
    if (memcmp(shake->in, mark, have) != 0)
        return SECURE_OTHER_VERSION;
    if (shake->in_end < SECURE_GREETING_BYTES)
        return SECURE_SOUND;
    make_tag(tag, &shake->self, shake->in);
    shake->greeted = is_same(tag, shake->in + TAG, sizeof tag) &&
                     shake->in[ROLE] == (shake->self.caller ? 'l' : 'c');
    return shake->greeted ? SECURE_SOUND : SECURE_OTHER_KEY;
}

/* Both greetings and points, the caller's first, and what the exchange gives
 * make a root of this connection alone, and that a key for each direction.
 * False: the peer's point leaves nothing secret. */
static bool derive(struct secure_shake *shake) {
    enum { BOTH = 2 * SECURE_POINT_END };
    static const uint8_t nothing[SECURE_KEY_BYTES];
    static const uint8_t caller = 'c', listener = 'l';
    const struct secure_suite *suite = shake->self.suite;
    bool calls = shake->self.caller;
    uint8_t all[BOTH + SECURE_KEY_BYTES], root[SECURE_KEY_BYTES];
    memcpy(all + (calls ? 0 : BOTH / 2), shake->out, BOTH / 2);
    memcpy(all + (calls ? BOTH / 2 : 0), shake->in, BOTH / 2);
    suite->x25519(all + BOTH, shake->secret, shake->in + SECURE_GREETING_BYTES);
    secure_wipe(shake->secret, sizeof shake->secret);
    bool sound = !is_same(all + BOTH, nothing, sizeof nothing);
    suite->hash(root, shake->self.key, all, sizeof all);
    suite->hash(shake->keys.out, root, calls ? &caller : &listener, 1);
    suite->hash(shake->keys.in, root, calls ? &listener : &caller, 1);
    secure_wipe(all, sizeof all);
    secure_wipe(root, sizeof root);
    return sound;
}

/* The peer's point is here: ours, if it is not sent yet, and the proof, an
 * empty record. */
static enum secure_fault take_point(struct secure_shake *shake) {
    uint8_t *proof = shake->out + SECURE_POINT_END;
    if (!shake->self.caller)
        put_point(shake);
    if (!derive(shake))
        return SECURE_OTHER_KEY;
    put_head(proof, 0, shake->keys.out_count);
    shake->self.suite->seal(proof + SECURE_HEAD_BYTES, proof, 0, proof,
                            shake->keys.out_count++, shake->keys.out);
    shake->out_end = SECURE_OPENING_BYTES;
    shake->derived = true;
    return SECURE_SOUND;
}

static enum secure_fault take_proof(struct secure_shake *shake) {
    uint8_t *proof = shake->in + SECURE_POINT_END;
    shake->proven =
        head_size(proof) == 0 && head_ahead(proof, 0) == 0 &&
        shake->self.suite->open(proof, proof + SECURE_HEAD_BYTES, 0, proof,
                                shake->keys.in_count++, shake->keys.in);
    return shake->proven ? SECURE_SOUND : SECURE_OTHER_KEY;
}

static enum secure_fault send_opening(struct secure_shake *shake,
                                      const struct link_pipe *pipe) {
    if (shake->out_begin == shake->out_end)
        return SECURE_SOUND;
    int sent = pipe->send(pipe->context, shake->out + shake->out_begin,
                          shake->out_end - shake->out_begin);
    shake->out_begin += sent > 0 ? (size_t)sent : 0;
    return sent < 0 ? SECURE_GONE : SECURE_SOUND;
}

static enum secure_fault receive_opening(struct secure_shake *shake,
                                         const struct link_pipe *pipe) {
    size_t want = shake->derived   ? SECURE_OPENING_BYTES
                  : shake->greeted ? SECURE_POINT_END
                                   : SECURE_GREETING_BYTES;
    if (shake->proven)
        return SECURE_SOUND;
    int got = pipe->receive(pipe->context, shake->in + shake->in_end,
                            want - shake->in_end);
    shake->in_end += got > 0 ? (size_t)got : 0;
    if (got <= 0)
        return got < 0 ? SECURE_GONE : SECURE_SOUND;
    if (!shake->greeted)
        return hear_greeting(shake);
    if (shake->in_end < want)
        return SECURE_SOUND;
    return shake->derived ? take_proof(shake) : take_point(shake);
}

static enum secure_fault exchange(struct secure_shake *shake,
                                  const struct link_pipe *pipe) {
    /* Greeting, point and proof may have come together. */
    for (int i = 0; i < 3; i++) {
        enum secure_fault fault = send_opening(shake, pipe);
        if (fault == SECURE_SOUND)
            fault = receive_opening(shake, pipe);
        if (fault != SECURE_SOUND)
            return fault;
    }
    return send_opening(shake, pipe);
}

int secure_shake(struct secure_shake *shake, const struct link_pipe *pipe) {
    if (shake->fault == SECURE_SOUND)
        shake->fault = exchange(shake, pipe);
    if (shake->fault != SECURE_SOUND) {
        secure_shake_end(shake);
        return -1;
    }
    return shake->proven && shake->out_begin == shake->out_end ? 1 : 0;
}

struct secure_ends secure_shake_peer(const struct secure_shake *shake) {
    const uint8_t *greeting = shake->in;
    LINK_ASSERT(shake->proven);
    return (struct secure_ends){
        .self = {bytes_get16(greeting + NODE), greeting[PORT]},
        .peer = {bytes_get16(greeting + PEER_NODE), greeting[PEER_PORT]}};
}

static bool fits(struct link_end a, struct link_end b) {
    bool node = a.node == b.node || a.node == SECURE_NODE_UNKNOWN ||
                b.node == SECURE_NODE_UNKNOWN;
    bool port = a.port == b.port || a.port == SECURE_PORT_UNKNOWN ||
                b.port == SECURE_PORT_UNKNOWN;
    return node && port;
}

bool secure_shake_misled(const struct secure_shake *shake) {
    const struct secure_ends *ours = &shake->self.ends;
    struct secure_ends theirs = secure_shake_peer(shake);
    return !fits(ours->self, theirs.peer) || !fits(ours->peer, theirs.self);
}

void secure_shake_end(struct secure_shake *shake) {
    enum secure_fault fault = shake->fault;
    secure_wipe(shake, sizeof *shake);
    shake->fault = fault == SECURE_SOUND ? SECURE_GONE : fault;
}

bool secure_greets(const uint8_t *bytes, size_t size) {
    return size >= sizeof mark && memcmp(bytes, mark, sizeof mark - 1) == 0;
}

/* --- records -------------------------------------------------------------- */

void secure_records_start(struct secure_records *records,
                          struct secure_shake *shake,
                          const struct link_pipe *pipe) {
    LINK_ASSERT(shake->proven && shake->fault == SECURE_SOUND);
    memset(records, 0, sizeof *records);
    records->suite = shake->self.suite;
    records->keys = shake->keys;
    records->pipe = *pipe;
    secure_shake_end(shake);
}

void secure_records_end(struct secure_records *records) {
    secure_wipe(&records->keys, sizeof records->keys);
    secure_wipe(records->plain, sizeof records->plain);
    records->plain_begin = records->plain_end = 0;
    records->failed = true;
}

static int fail(struct secure_records *r) {
    secure_records_end(r);
    return LINK_PIPE_CLOSED;
}

/* Sends what is sealed; false: the pipe is closed. */
static bool flush(struct secure_records *r) {
    if (r->out_begin < r->out_end) {
        int sent = r->pipe.send(r->pipe.context, r->out + r->out_begin,
                                r->out_end - r->out_begin);
        if (sent < 0)
            return false;
        r->out_begin += (size_t)sent;
    }
    return true;
}

/* All that the pipe has room for: what is not taken, the link holds back until
 * the pipe has room again. */
static int records_send(void *context, const uint8_t *bytes, size_t size) {
    struct secure_records *r = context;
    size_t done = 0;
    if (r->failed || !flush(r))
        return fail(r);
    while (done < size && r->out_begin == r->out_end) {
        size_t part =
            size - done < SECURE_RECORD_MAX ? size - done : SECURE_RECORD_MAX;
        put_head(r->out, part, r->keys.out_count);
        r->suite->seal(r->out + SECURE_HEAD_BYTES, bytes + done, part, r->out,
                       r->keys.out_count++, r->keys.out);
        r->records_out++;
        r->out_begin = 0;
        r->out_end = SECURE_HEAD_BYTES + part + SECURE_TAG_BYTES;
        done += part;
        if (!flush(r))
            return fail(r);
    }
    return (int)done;
}

/* Where the next record begins in what has come, from `at` on; else where one
 * might whose head is not whole. */
static size_t find_head(const struct secure_records *r, size_t at) {
    while (at + SECURE_HEAD_BYTES <= r->in_end &&
           (head_size(r->in + at) == SIZE_MAX ||
            head_ahead(r->in + at, r->keys.in_count) >= SECURE_AHEAD_MAX))
        at++;
    return at;
}

/* The first bytes of what has come are taken. */
static void take(struct secure_records *r, size_t size) {
    r->in_end -= size;
    r->seen = 0;
    memmove(r->in, r->in + size, r->in_end);
}

/* Leaves out at least so many, and all that begin no record. */
static void skip(struct secure_records *r, size_t least) {
    size_t at = find_head(r, least);
    if (at > 0) {
        r->lost += at;
        take(r, at);
    }
}

/* Whether the record that is awaited was cut short, as another begins within
 * it: then that is the first.  By chance one in 2^37 bytes looks like a head.
 */
static bool is_cut(struct secure_records *r) {
    size_t at = find_head(r, r->seen > 0 ? r->seen : 1);
    if (r->in_end < SECURE_HEAD_BYTES || at + SECURE_HEAD_BYTES > r->in_end) {
        r->seen = at;
        return false;
    }
    r->lost += at;
    take(r, at);
    return true;
}

/* The record at the front of what has come: true if it is the peer's.  What is
 * missing before it ends the frame that it was in. */
static bool open_record(struct secure_records *r, size_t size) {
    uint32_t ahead = head_ahead(r->in, r->keys.in_count);
    if (!r->suite->open(r->plain + 1, r->in + SECURE_HEAD_BYTES, size, r->in,
                        r->keys.in_count + ahead, r->keys.in)) {
        r->refused++;
        r->lost += size;
        skip(r, 1);
        return false;
    }
    r->keys.in_count += (uint64_t)ahead + 1;
    r->records_in++;
    r->lost = 0;
    r->plain[0] = 0;
    r->plain_begin = ahead == 0 ? 1 : 0;
    r->plain_end = 1 + size;
    take(r, SECURE_HEAD_BYTES + size + SECURE_TAG_BYTES);
    return true;
}

/* What to read until a record is whole.  No byte beyond it, as nobody wakes for
 * bytes that are here; but a place that was lost is not looked for byte by
 * byte.
 */
static size_t missing(const struct secure_records *r) {
    size_t whole = SECURE_HEAD_BYTES;
    if (r->in_end >= SECURE_HEAD_BYTES)
        whole += head_size(r->in) + SECURE_TAG_BYTES;
    if (r->in_end < whole && r->lost > 0)
        whole = sizeof r->in;
    return whole > r->in_end ? whole - r->in_end : 0;
}

/* Takes the next good record, of what is here or can be read: 1, 0 it has not
 * come yet, or LINK_PIPE_CLOSED. */
static int take_record(struct secure_records *r, bool reads) {
    bool dry = !reads;
    while (r->lost <= SECURE_LOST_MAX) {
        skip(r, 0);
        size_t want = missing(r);
        if (want == 0) {
            if (open_record(r, head_size(r->in)))
                return 1;
            continue;
        }
        if (dry && is_cut(r))
            continue;
        if (dry)
            return 0;
        int got = r->pipe.receive(r->pipe.context, r->in + r->in_end, want);
        if (got < 0)
            return got;
        r->in_end += (size_t)got;
        dry = (size_t)got < want;
    }
    return LINK_PIPE_CLOSED;
}

static int records_receive(void *context, uint8_t *bytes, size_t size) {
    struct secure_records *r = context;
    size_t done = 0, have = 1;
    int status = 1;
    if (r->failed || !flush(r))
        return fail(r);
    while (status > 0 && have > 0) {
        if (r->plain_begin == r->plain_end)
            status = take_record(r, done == 0);
        have = r->plain_end - r->plain_begin;
        have = have < size - done ? have : size - done;
        memcpy(bytes + done, r->plain + r->plain_begin, have);
        r->plain_begin += have;
        done += have;
    }
    return status < 0 ? fail(r) : (int)done;
}

struct link_pipe secure_records_pipe(struct secure_records *records) {
    return (struct link_pipe){records, records_send, records_receive};
}
