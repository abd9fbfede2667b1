/* Authenticated, fresh and secret bytes over a pipe that strangers can reach,
 * beneath a link: both ends prove that they know the cube's key, and every
 * record carries a number of its direction under keys of this connection alone.
 * PROTOCOL.md has the bytes.  A record that is not of the peer's making, or is
 * older than the last one, is as good as lost: the next one is found behind it,
 * and the link beneath hears of a gap by a zero byte, which ends a frame.  Many
 * in a row fail the connection; the link goes on over the next.
 *
 * The primitives are given: keyed BLAKE2b-256 and ChaCha20-Poly1305 (RFC 7693,
 * RFC 8439), from a library that is known for them.
 *
 * Memory: struct secure_shake while a connection is not proven, struct
 * secure_records then.  Work: a shake hashes at most three short inputs and
 * opens one empty record; all functions are linear in the bytes given
 * and taken, and between two good records no more than SECURE_LOST_MAX bytes
 * are opened or skipped in vain.
 *
 *     secure_shake_init(&shake, &suite, key, true, nonce);
 *     while ((status = secure_shake(&shake, &pipe)) == 0)
 *         wait();
 *     if (status > 0)
 *         secure_records_start(&records, &shake, &pipe);
 *     config.pipe = secure_records_pipe(&records);
 */
#ifndef TRANSPORT_SECURE_H
#define TRANSPORT_SECURE_H

#include "link.h"
#include "secure_suite.h"

enum {
    SECURE_RECORD_MAX = 2048, /* bytes of the link in a record */
    SECURE_GREETING_BYTES = 32,
    SECURE_PROOF_BYTES = SECURE_HEAD_BYTES + SECURE_TAG_BYTES,
    SECURE_OPENING_BYTES = SECURE_GREETING_BYTES + SECURE_PROOF_BYTES,
    SECURE_WIRE_MAX = SECURE_HEAD_BYTES + SECURE_RECORD_MAX + SECURE_TAG_BYTES,
    SECURE_AHEAD_MAX = 65536, /* records that may be lost in a row */
    SECURE_LOST_MAX = 262144
};

struct secure_keys {
    uint8_t out[SECURE_KEY_BYTES], in[SECURE_KEY_BYTES];
    uint64_t out_count, in_count;
};

struct secure_shake {
    const struct secure_suite *suite;
    const uint8_t *key; /* of the cube; stays the caller's */
    bool caller, greeted, proven, failed;
    struct secure_keys keys;
    uint8_t out[SECURE_OPENING_BYTES], in[SECURE_OPENING_BYTES];
    size_t out_begin, out_end, in_end;
};

/* caller: the end that made the connection.  nonce: never used before with this
 * key by anyone; it need not be secret.  Random bytes will do. */
void secure_shake_init(struct secure_shake *shake,
                       const struct secure_suite *suite,
                       const uint8_t key[SECURE_KEY_BYTES], bool caller,
                       const uint8_t nonce[SECURE_NONCE_BYTES]);

/* Moves bytes: 1 when the peer has proven itself and has what proves us, 0 not
 * yet, -1 it does not know the key, or is gone. */
int secure_shake(struct secure_shake *shake, const struct link_pipe *pipe);

/* Whether it failed because the peer has another key, or what it sent was
 * damaged on the way. */
bool secure_shake_other_key(const struct secure_shake *shake);

struct secure_records {
    const struct secure_suite *suite;
    struct link_pipe pipe; /* beneath */
    struct secure_keys keys;
    bool failed;
    uint64_t records_in, records_out;
    uint64_t refused;          /* opened in vain */
    size_t lost;               /* bytes in vain since the last good record */
    size_t out_begin, out_end; /* sealed, not sent */
    size_t in_end;             /* come, and not opened */
    size_t seen;               /* of those, where no other record begins */
    size_t plain_begin, plain_end;
    uint8_t out[SECURE_WIRE_MAX], in[SECURE_WIRE_MAX];
    uint8_t plain[1 + SECURE_RECORD_MAX]; /* behind a zero, for a gap */
};

/* Takes the keys of a shake that returned 1. */
void secure_records_start(struct secure_records *records,
                          const struct secure_shake *shake,
                          const struct link_pipe *pipe);

/* LINK_PIPE_CLOSED from either function: this connection is over. */
struct link_pipe secure_records_pipe(struct secure_records *records);

#endif
