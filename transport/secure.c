#include "secure.h"

#include <string.h>

#include "check.h"
#include "secure_wipe.h"

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
    secure_wipe(root, sizeof root);
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

void secure_records_start(struct secure_records *records,
                          const struct secure_shake *shake,
                          const struct link_pipe *pipe)
{
    LINK_ASSERT(shake->proven && !shake->failed);
    memset(records, 0, sizeof *records);
    records->suite = shake->suite;
    records->keys = shake->keys;
    records->pipe = *pipe;
}

static int fail(struct secure_records *r)
{
    r->failed = true;
    secure_wipe(&r->keys, sizeof r->keys);
    return LINK_PIPE_CLOSED;
}

/* Sends what is sealed; false: the pipe is closed. */
static bool flush(struct secure_records *r)
{
    if (r->out_begin < r->out_end) {
        int sent = r->pipe.send(r->pipe.context, r->out + r->out_begin,
                                r->out_end - r->out_begin);
        if (sent < 0) {
            return false;
        }
        r->out_begin += (size_t)sent;
    }
    return true;
}

/* All that the pipe has room for: what is not taken, the link holds back until
 * the pipe has room again. */
static int records_send(void *context, const uint8_t *bytes, size_t size)
{
    struct secure_records *r = context;
    size_t done = 0;
    if (r->failed || !flush(r)) {
        return fail(r);
    }
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
        if (!flush(r)) {
            return fail(r);
        }
    }
    return (int)done;
}

/* Where the next record begins in what has come, from `at` on; else where one
 * might whose head is not whole. */
static size_t find_head(const struct secure_records *r, size_t at)
{
    while (at + SECURE_HEAD_BYTES <= r->in_end &&
           (head_size(r->in + at) == SIZE_MAX ||
            head_ahead(r->in + at, r->keys.in_count) >= SECURE_AHEAD_MAX)) {
        at++;
    }
    return at;
}

/* The first bytes of what has come are taken. */
static void take(struct secure_records *r, size_t size)
{
    r->in_end -= size;
    r->seen = 0;
    memmove(r->in, r->in + size, r->in_end);
}

/* Leaves out at least so many, and all that begin no record. */
static void skip(struct secure_records *r, size_t least)
{
    size_t at = find_head(r, least);
    if (at > 0) {
        r->lost += at;
        take(r, at);
    }
}

/* Whether the record that is awaited was cut short, as another begins within
 * it: then that is the first.  By chance one in 2^37 bytes looks like a head.
 */
static bool is_cut(struct secure_records *r)
{
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
static bool open_record(struct secure_records *r, size_t size)
{
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
static size_t missing(const struct secure_records *r)
{
    size_t whole = SECURE_HEAD_BYTES;
    if (r->in_end >= SECURE_HEAD_BYTES) {
        whole += head_size(r->in) + SECURE_TAG_BYTES;
    }
    if (r->in_end < whole && r->lost > 0) {
        whole = sizeof r->in;
    }
    return whole > r->in_end ? whole - r->in_end : 0;
}

/* Takes the next good record, of what is here or can be read: 1, 0 it has not
 * come yet, or LINK_PIPE_CLOSED. */
static int take_record(struct secure_records *r, bool reads)
{
    bool dry = !reads;
    while (r->lost <= SECURE_LOST_MAX) {
        skip(r, 0);
        size_t want = missing(r);
        if (want == 0) {
            if (open_record(r, head_size(r->in))) {
                return 1;
            }
            continue;
        }
        if (dry && is_cut(r)) {
            continue;
        }
        if (dry) {
            return 0;
        }
        int got = r->pipe.receive(r->pipe.context, r->in + r->in_end, want);
        if (got < 0) {
            return got;
        }
        r->in_end += (size_t)got;
        dry = (size_t)got < want;
    }
    return LINK_PIPE_CLOSED;
}

static int records_receive(void *context, uint8_t *bytes, size_t size)
{
    struct secure_records *r = context;
    size_t done = 0, have = 1;
    int status = 1;
    if (r->failed || !flush(r)) {
        return fail(r);
    }
    while (status > 0 && have > 0) {
        if (r->plain_begin == r->plain_end) {
            status = take_record(r, done == 0);
        }
        have = r->plain_end - r->plain_begin;
        have = have < size - done ? have : size - done;
        memcpy(bytes + done, r->plain + r->plain_begin, have);
        r->plain_begin += have;
        done += have;
    }
    return status < 0 ? fail(r) : (int)done;
}

struct link_pipe secure_records_pipe(struct secure_records *records)
{
    return (struct link_pipe){records, records_send, records_receive};
}
