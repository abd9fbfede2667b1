#include "secure.h"

#include <string.h>

#include "check.h"

static const uint8_t magic[8] = {'i', 'n', 'c', 'o', 'd', 'e', 's', 2};

/* The complement tells a changed size at once: bytes that never come are not
 * waited for.  The number, its low 32 bits, tells what is missing before it. */
static void put_head(uint8_t head[SECURE_HEAD_BYTES], size_t size,
                     uint64_t number)
{
    head[0] = (uint8_t)size;
    head[1] = (uint8_t)(size >> 8);
    head[2] = (uint8_t)~head[0];
    head[3] = (uint8_t)~head[1];
    for (unsigned i = 0; i < 4; i++) {
        head[4 + i] = (uint8_t)(number >> 8 * i);
    }
}

/* The size that a head states, or SIZE_MAX: none. */
static size_t head_size(const uint8_t head[SECURE_HEAD_BYTES])
{
    size_t size = (size_t)head[0] | (size_t)head[1] << 8;
    bool sound = (head[0] ^ head[2]) == 0xff && (head[1] ^ head[3]) == 0xff;
    return sound && size <= SECURE_RECORD_MAX ? size : SIZE_MAX;
}

/* How many records are missing before it, if it is one to come. */
static uint32_t head_ahead(const uint8_t head[SECURE_HEAD_BYTES],
                           uint64_t expected)
{
    uint32_t number = (uint32_t)head[4] | (uint32_t)head[5] << 8 |
                      (uint32_t)head[6] << 16 | (uint32_t)head[7] << 24;
    return number - (uint32_t)expected;
}

/* --- proving ------------------------------------------------------------- */

void secure_shake_init(struct secure_shake *shake,
                       const struct secure_suite *suite,
                       const uint8_t key[SECURE_KEY_BYTES], bool caller,
                       const uint8_t nonce[SECURE_NONCE_BYTES])
{
    memset(shake, 0, sizeof *shake);
    shake->suite = suite;
    shake->key = key;
    shake->caller = caller;
    memcpy(shake->out, magic, sizeof magic);
    memcpy(shake->out + sizeof magic, nonce, SECURE_NONCE_BYTES);
    shake->out_end = SECURE_GREETING_BYTES;
}

/* Both greetings, the caller's first, make a root of this connection alone, and
 * that a key for each direction. */
static void derive(struct secure_shake *shake)
{
    uint8_t both[2 * SECURE_GREETING_BYTES], root[SECURE_KEY_BYTES];
    const uint8_t caller = 'c', listener = 'l';
    uint8_t *first = both, *second = both + SECURE_GREETING_BYTES;
    memcpy(shake->caller ? first : second, shake->out, SECURE_GREETING_BYTES);
    memcpy(shake->caller ? second : first, shake->in, SECURE_GREETING_BYTES);
    shake->suite->hash(root, shake->key, both, sizeof both);
    shake->suite->hash(shake->keys.out, root,
                       shake->caller ? &caller : &listener, 1);
    shake->suite->hash(shake->keys.in, root,
                       shake->caller ? &listener : &caller, 1);
    memset(root, 0, sizeof root);
}

/* The peer's nonce is here: ours is the proof, an empty record. */
static bool take_greeting(struct secure_shake *shake)
{
    uint8_t *proof = shake->out + SECURE_GREETING_BYTES;
    if (memcmp(shake->in, magic, sizeof magic) != 0 ||
        memcmp(shake->in, shake->out, SECURE_GREETING_BYTES) == 0) {
        return false;
    }
    derive(shake);
    put_head(proof, 0, shake->keys.out_count);
    shake->suite->seal(proof + SECURE_HEAD_BYTES, proof, 0, proof,
                       shake->keys.out_count++, shake->keys.out);
    shake->out_end = SECURE_OPENING_BYTES;
    shake->greeted = true;
    return true;
}

static bool take_proof(struct secure_shake *shake)
{
    uint8_t *proof = shake->in + SECURE_GREETING_BYTES;
    shake->proven =
        head_size(proof) == 0 && head_ahead(proof, 0) == 0 &&
        shake->suite->open(proof, proof + SECURE_HEAD_BYTES, 0, proof,
                           shake->keys.in_count++, shake->keys.in);
    return shake->proven;
}

static bool send_opening(struct secure_shake *shake,
                         const struct link_pipe *pipe)
{
    if (shake->out_begin == shake->out_end) {
        return true;
    }
    int sent = pipe->send(pipe->context, shake->out + shake->out_begin,
                          shake->out_end - shake->out_begin);
    shake->out_begin += sent > 0 ? (size_t)sent : 0;
    return sent >= 0;
}

static bool receive_opening(struct secure_shake *shake,
                            const struct link_pipe *pipe)
{
    size_t want = shake->greeted ? SECURE_OPENING_BYTES : SECURE_GREETING_BYTES;
    if (shake->proven) {
        return true;
    }
    int got = pipe->receive(pipe->context, shake->in + shake->in_end,
                            want - shake->in_end);
    shake->in_end += got > 0 ? (size_t)got : 0;
    if (got < 0) {
        return false;
    }
    if (shake->in_end < want) {
        return true;
    }
    return shake->greeted ? take_proof(shake) : take_greeting(shake);
}

int secure_shake(struct secure_shake *shake, const struct link_pipe *pipe)
{
    /* Twice: greeting and proof may have come together. */
    for (int i = 0; i < 2 && !shake->failed; i++) {
        shake->failed =
            !send_opening(shake, pipe) || !receive_opening(shake, pipe);
    }
    shake->failed = shake->failed || !send_opening(shake, pipe);
    if (shake->failed) {
        return -1;
    }
    return shake->proven && shake->out_begin == shake->out_end ? 1 : 0;
}

bool secure_shake_other_key(const struct secure_shake *shake)
{
    return shake->in_end == SECURE_OPENING_BYTES && !shake->proven;
}

/* --- records ------------------------------------------------------------- */

void secure_channel_start(struct secure_channel *channel,
                          const struct secure_shake *shake,
                          const struct link_pipe *pipe)
{
    LINK_ASSERT(shake->proven && !shake->failed);
    memset(channel, 0, sizeof *channel);
    channel->suite = shake->suite;
    channel->keys = shake->keys;
    channel->pipe = *pipe;
}

static int fail(struct secure_channel *c)
{
    c->failed = true;
    memset(&c->keys, 0, sizeof c->keys);
    return LINK_PIPE_CLOSED;
}

/* Sends what is sealed; false: the pipe is closed. */
static bool flush(struct secure_channel *c)
{
    if (c->out_begin < c->out_end) {
        int sent = c->pipe.send(c->pipe.context, c->out + c->out_begin,
                                c->out_end - c->out_begin);
        if (sent < 0) {
            return false;
        }
        c->out_begin += (size_t)sent;
    }
    return true;
}

/* All that the pipe has room for: what is not taken, the link holds back until
 * the pipe has room again. */
static int channel_send(void *context, const uint8_t *bytes, size_t size)
{
    struct secure_channel *c = context;
    size_t done = 0;
    if (c->failed || !flush(c)) {
        return fail(c);
    }
    while (done < size && c->out_begin == c->out_end) {
        size_t part =
            size - done < SECURE_RECORD_MAX ? size - done : SECURE_RECORD_MAX;
        put_head(c->out, part, c->keys.out_count);
        c->suite->seal(c->out + SECURE_HEAD_BYTES, bytes + done, part, c->out,
                       c->keys.out_count++, c->keys.out);
        c->records_out++;
        c->out_begin = 0;
        c->out_end = SECURE_HEAD_BYTES + part + SECURE_TAG_BYTES;
        done += part;
        if (!flush(c)) {
            return fail(c);
        }
    }
    return (int)done;
}

/* Where the next record begins in what has come, from `at` on; else where one
 * might whose head is not whole. */
static size_t find_head(const struct secure_channel *c, size_t at)
{
    while (at + SECURE_HEAD_BYTES <= c->in_end &&
           (head_size(c->in + at) == SIZE_MAX ||
            head_ahead(c->in + at, c->keys.in_count) >= SECURE_AHEAD_MAX)) {
        at++;
    }
    return at;
}

/* The first bytes of what has come are taken. */
static void take(struct secure_channel *c, size_t size)
{
    c->in_end -= size;
    c->seen = 0;
    memmove(c->in, c->in + size, c->in_end);
}

/* Leaves out at least so many, and all that begin no record. */
static void skip(struct secure_channel *c, size_t least)
{
    size_t at = find_head(c, least);
    if (at > 0) {
        c->lost += at;
        take(c, at);
    }
}

/* Whether the record that is awaited was cut short, as another begins within
 * it: then that is the first.  By chance one in 2^37 bytes looks like a head.
 */
static bool is_cut(struct secure_channel *c)
{
    size_t at = find_head(c, c->seen > 0 ? c->seen : 1);
    if (c->in_end < SECURE_HEAD_BYTES || at + SECURE_HEAD_BYTES > c->in_end) {
        c->seen = at;
        return false;
    }
    c->lost += at;
    take(c, at);
    return true;
}

/* The record at the front of what has come: true if it is the peer's.  What is
 * missing before it ends the frame that it was in. */
static bool open_record(struct secure_channel *c, size_t size)
{
    uint32_t ahead = head_ahead(c->in, c->keys.in_count);
    if (!c->suite->open(c->plain + 1, c->in + SECURE_HEAD_BYTES, size, c->in,
                        c->keys.in_count + ahead, c->keys.in)) {
        c->refused++;
        c->lost += size;
        skip(c, 1);
        return false;
    }
    c->keys.in_count += (uint64_t)ahead + 1;
    c->records_in++;
    c->lost = 0;
    c->plain[0] = 0;
    c->plain_begin = ahead == 0 ? 1 : 0;
    c->plain_end = 1 + size;
    take(c, SECURE_HEAD_BYTES + size + SECURE_TAG_BYTES);
    return true;
}

/* What to read until a record is whole.  No byte beyond it, as nobody wakes for
 * bytes that are here; but a place that was lost is not looked for byte by
 * byte.
 */
static size_t missing(const struct secure_channel *c)
{
    size_t whole = SECURE_HEAD_BYTES;
    if (c->in_end >= SECURE_HEAD_BYTES) {
        whole += head_size(c->in) + SECURE_TAG_BYTES;
    }
    if (c->in_end < whole && c->lost > 0) {
        whole = sizeof c->in;
    }
    return whole > c->in_end ? whole - c->in_end : 0;
}

/* Takes the next good record, of what is here or can be read: 1, 0 it has not
 * come yet, or LINK_PIPE_CLOSED. */
static int take_record(struct secure_channel *c, bool reads)
{
    bool dry = !reads;
    while (c->lost <= SECURE_LOST_MAX) {
        skip(c, 0);
        size_t want = missing(c);
        if (want == 0) {
            if (open_record(c, head_size(c->in))) {
                return 1;
            }
            continue;
        }
        if (dry && is_cut(c)) {
            continue;
        }
        if (dry) {
            return 0;
        }
        int got = c->pipe.receive(c->pipe.context, c->in + c->in_end, want);
        if (got < 0) {
            return got;
        }
        c->in_end += (size_t)got;
        dry = (size_t)got < want;
    }
    return LINK_PIPE_CLOSED;
}

static int channel_receive(void *context, uint8_t *bytes, size_t size)
{
    struct secure_channel *c = context;
    size_t done = 0, have = 1;
    int status = 1;
    if (c->failed || !flush(c)) {
        return fail(c);
    }
    while (status > 0 && have > 0) {
        if (c->plain_begin == c->plain_end) {
            status = take_record(c, done == 0);
        }
        have = c->plain_end - c->plain_begin;
        have = have < size - done ? have : size - done;
        memcpy(bytes + done, c->plain + c->plain_begin, have);
        c->plain_begin += have;
        done += have;
    }
    return status < 0 ? fail(c) : (int)done;
}

struct link_pipe secure_channel_pipe(struct secure_channel *channel)
{
    return (struct link_pipe){channel, channel_send, channel_receive};
}
