/* Authenticated, fresh and secret bytes over a pipe that strangers can reach,
 * beneath a link: both ends prove that they know the cube's key, and every
 * record carries a number of its direction under keys of this connection alone,
 * derived from the cube's key and an exchange (X25519).  An attacker who learns
 * the key later cannot read recorded bytes.  Both ends name their node and
 * port, as far as they know them.  PROTOCOL.md has the bytes.  A record that
 * the peer has not made, or that is older than the last one, counts as lost:
 * the next record is found after it, and a zero byte, which ends a frame, marks
 * the gap for the link above.  Many such records in a row end the connection;
 * the link continues over the next one.
 *
 * Work: a shake hashes five short inputs, opens one empty record, and
 * multiplies twice on the curve; a listener multiplies only for a caller that
 * knows the key.  Everything else is linear in the bytes.  Between two good
 * records at most SECURE_LOST_MAX bytes are skipped, or opened without success.
 */
#ifndef TRANSPORT_SECURE_H
#define TRANSPORT_SECURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "link.h"

/* The primitives that the secure layer needs from a cryptographic library:
 * keyed BLAKE2b-256 (RFC 7693), X25519 (RFC 7748) and ChaCha20-Poly1305 (RFC
 * 8439).  The caller gives them, so that transport/ depends on no system;
 * drivers/secure_sodium.h has those of libsodium. */

enum {
    SECURE_KEY_BYTES = 32, /* of a key, a point and a secret of X25519 */
    SECURE_NONCE_BYTES = 24,
    SECURE_TAG_BYTES = 16,
    SECURE_HEAD_BYTES = 8 /* of a record: size, its complement, number */
};

/* seal, open: `size` bytes in, size + SECURE_TAG_BYTES out, or the other way
 * round; in and out may be the same.  The nonce is 4 zero bytes and the
 * counter, little-endian; ad: the record's head. */
struct secure_suite {
    void (*hash)(uint8_t out[SECURE_KEY_BYTES],
                 const uint8_t key[SECURE_KEY_BYTES], const uint8_t *in,
                 size_t size);
    /* All zero where the point is of a small order. */
    void (*x25519)(uint8_t out[SECURE_KEY_BYTES],
                   const uint8_t secret[SECURE_KEY_BYTES],
                   const uint8_t point[SECURE_KEY_BYTES]);
    void (*seal)(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES]);
    bool (*open)(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES]);
};

/* What makes a connection's opening unlike every other under a cube's key: a
 * nonce, and the secret of its exchange.  They are drawn from a board's random
 * bytes, or, where it has none, from what never comes again: the device, the
 * number of its start, the number of the draw.  All of these are hashed under
 * the key, so that a draw is new if any of them is.  PROTOCOL.md has the bytes.
 *
 * Without random bytes, an attacker who knows the cube's key and the device can
 * draw the same values.  A wire has forward secrecy if at least one of its ends
 * has random bytes, or a secret device. */

enum { SECURE_DEVICE_BYTES = 32 };

/* As a board fills it in: random, or device and boot, or all. */
struct secure_source {
    /* Fills in bytes that cannot be guessed; false: it cannot.  NULL: the board
     * has no generator. */
    bool (*random)(void *context, uint8_t *bytes, size_t size);
    void *context;
    /* Unlike those of all other devices that ever have the cube's key: an
     * address, a serial number; better a secret of its own. */
    uint8_t device[SECURE_DEVICE_BYTES];
    /* Number of this start of the device, kept where a reset and a loss of
     * power leave it; raised before it is used; not 0, which says that there is
     * none. */
    uint64_t boot;
    uint64_t draws; /* since that start: 0 at first, counted here */
};

struct secure_seed {
    uint8_t nonce[SECURE_NONCE_BYTES]; /* all may know it */
    uint8_t secret[SECURE_KEY_BYTES];
};

/* False: the source has neither random bytes at present nor a number of its
 * start; *seed is all zero then, and not to be used. */
bool secure_seed_draw(struct secure_source *source,
                      const struct secure_suite *suite,
                      const uint8_t key[SECURE_KEY_BYTES],
                      struct secure_seed *seed);

enum {
    SECURE_RECORD_MAX = 2048, /* bytes of the link in a record */
    SECURE_MARK_BYTES = 8,    /* that a greeting begins with */
    SECURE_GREETING_BYTES = 16 + SECURE_NONCE_BYTES + SECURE_TAG_BYTES,
    SECURE_POINT_END = SECURE_GREETING_BYTES + SECURE_KEY_BYTES,
    SECURE_PROOF_BYTES = SECURE_HEAD_BYTES + SECURE_TAG_BYTES,
    SECURE_OPENING_BYTES = SECURE_POINT_END + SECURE_PROOF_BYTES,
    SECURE_WIRE_MAX = SECURE_HEAD_BYTES + SECURE_RECORD_MAX + SECURE_TAG_BYTES,
    SECURE_AHEAD_MAX = 65536, /* records that may be lost in a row */
    SECURE_LOST_MAX = 262144
};

enum { SECURE_NODE_UNKNOWN = 0xffff, SECURE_PORT_UNKNOWN = 0xff };

/* A wire as one end of it sees it; of what it does not know yet, with the
 * numbers above. */
struct secure_ends {
    struct link_end self, peer;
};

/* An end of a connection; what it points to stays the caller's, and in use
 * while the shake lasts. */
struct secure_self {
    const struct secure_suite *suite;
    const uint8_t *key; /* of the cube, SECURE_KEY_BYTES */
    bool caller;        /* the end that made the connection */
    struct secure_ends ends;
};

/* Why a shake failed. */
enum secure_fault {
    SECURE_SOUND,
    SECURE_GONE,          /* the pipe was closed */
    SECURE_NO_KEY,        /* it greets as a link does that has no key */
    SECURE_NO_GREETING,   /* it says something else */
    SECURE_OTHER_VERSION, /* of this layer */
    SECURE_OTHER_KEY      /* or what it sent was damaged on the way */
};

struct secure_keys {
    uint8_t out[SECURE_KEY_BYTES], in[SECURE_KEY_BYTES];
    uint64_t out_count, in_count;
};

struct secure_shake {
    struct secure_self self;
    bool greeted; /* the peer has, with the key */
    bool derived, proven;
    enum secure_fault fault;
    uint8_t secret[SECURE_KEY_BYTES]; /* of the exchange */
    struct secure_keys keys;
    uint8_t out[SECURE_OPENING_BYTES], in[SECURE_OPENING_BYTES];
    size_t out_begin, out_end, in_end;
};

/* seed: drawn for this connection alone (secure_seed_draw); the caller wipes
 * it. */
void secure_shake_init(struct secure_shake *shake,
                       const struct secure_self *self,
                       const struct secure_seed *seed);

/* Moves bytes.  1: the peer has proven itself, and this end's proof is sent.
 * 0: not yet. -1: the shake failed for the reason in shake->fault, and its
 * secrets are wiped. */
int secure_shake(struct secure_shake *shake, const struct link_pipe *pipe);

/* The wire as the peer sees it, once it has proven itself. */
struct secure_ends secure_shake_peer(const struct secure_shake *shake);

/* Whether the two ends disagree about the wire, because it is miswired or was
 * diverted.  A property that an end does not know fits every value.  Valid once
 * the peer has proven itself. */
bool secure_shake_misled(const struct secure_shake *shake);

/* Wipes its secrets; it has failed, if it had not before. */
void secure_shake_end(struct secure_shake *shake);

/* Whether these bytes begin as an end with a key begins. */
bool secure_greets(const uint8_t *bytes, size_t size);

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

/* Takes the keys of a shake that returned 1, and ends it. */
void secure_records_start(struct secure_records *records,
                          struct secure_shake *shake,
                          const struct link_pipe *pipe);

/* Wipes the keys and what was opened with them; the pipe is closed. */
void secure_records_end(struct secure_records *records);

/* LINK_PIPE_CLOSED from either function: this connection is over. */
struct link_pipe secure_records_pipe(struct secure_records *records);

#endif
