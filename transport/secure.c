#include "secure.h"

#include <string.h>

#include "check.h"

static const uint8_t magic[8] = {'i', 'n', 'c', 'o', 'd', 'e', 's', 1};

/* The complement tells a changed size at once: bytes that never come are not
 * waited for. */
static void put_head(uint8_t head[SECURE_HEAD_BYTES], size_t size)
{
    head[0] = (uint8_t)size;
    head[1] = (uint8_t)(size >> 8);
    head[2] = (uint8_t)~head[0];
    head[3] = (uint8_t)~head[1];
}

/* The size that a head states, or SIZE_MAX: none. */
static size_t head_size(const uint8_t head[SECURE_HEAD_BYTES])
{
    size_t size = (size_t)head[0] | (size_t)head[1] << 8;
    bool sound = (head[0] ^ head[2]) == 0xff && (head[1] ^ head[3]) == 0xff;
    return sound && size <= SECURE_RECORD_MAX ? size : SIZE_MAX;
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
    put_head(proof, 0);
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
        head_size(proof) == 0 &&
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

static int channel_send(void *context, const uint8_t *bytes, size_t size)
{
    struct secure_channel *c = context;
    if (c->failed || !flush(c)) {
        return fail(c);
    }
    if (c->out_begin < c->out_end || size == 0) {
        return 0;
    }
    size = size < SECURE_RECORD_MAX ? size : SECURE_RECORD_MAX;
    put_head(c->out, size);
    c->suite->seal(c->out + SECURE_HEAD_BYTES, bytes, size, c->out,
                   c->keys.out_count++, c->keys.out);
    c->records_out++;
    c->out_begin = 0;
    c->out_end = SECURE_HEAD_BYTES + size + SECURE_TAG_BYTES;
    return flush(c) ? (int)size : fail(c);
}

/* Reads towards a whole record: false when the pipe is closed or the size is
 * none.  No byte beyond the record is taken. */
static bool receive_record(struct secure_channel *c)
{
    for (int i = 0; i < 2; i++) {
        size_t want = SECURE_HEAD_BYTES;
        if (c->in_end >= SECURE_HEAD_BYTES) {
            if (head_size(c->in) == SIZE_MAX) {
                c->refused++;
                return false;
            }
            want += head_size(c->in) + SECURE_TAG_BYTES;
        }
        int got = c->pipe.receive(c->pipe.context, c->in + c->in_end,
                                  want - c->in_end);
        if (got <= 0) {
            return got == 0;
        }
        c->in_end += (size_t)got;
    }
    return true;
}

static bool open_record(struct secure_channel *c)
{
    size_t size = head_size(c->in);
    if (!c->suite->open(c->in + SECURE_HEAD_BYTES, c->in + SECURE_HEAD_BYTES,
                        size, c->in, c->keys.in_count++, c->keys.in)) {
        c->refused++;
        return false;
    }
    c->records_in++;
    c->plain_begin = SECURE_HEAD_BYTES;
    c->plain_end = SECURE_HEAD_BYTES + size;
    c->in_end = 0;
    return true;
}

static int channel_receive(void *context, uint8_t *bytes, size_t size)
{
    struct secure_channel *c = context;
    if (c->failed || !flush(c)) {
        return fail(c);
    }
    if (c->plain_begin == c->plain_end) {
        if (!receive_record(c)) {
            return fail(c);
        }
        bool whole = c->in_end >= SECURE_HEAD_BYTES &&
                     c->in_end - SECURE_HEAD_BYTES ==
                         head_size(c->in) + SECURE_TAG_BYTES;
        if (whole && !open_record(c)) {
            return fail(c);
        }
    }
    size_t have = c->plain_end - c->plain_begin;
    have = have < size ? have : size;
    memcpy(bytes, c->in + c->plain_begin, have);
    c->plain_begin += have;
    return (int)have;
}

struct link_pipe secure_channel_pipe(struct secure_channel *channel)
{
    return (struct link_pipe){channel, channel_send, channel_receive};
}
