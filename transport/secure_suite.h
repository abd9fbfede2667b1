/* What the secure layer asks of a library that is known for its cryptography:
 * keyed BLAKE2b-256 (RFC 7693), X25519 (RFC 7748) and ChaCha20-Poly1305
 * (RFC 8439).  They are given, so that transport/ stays free of any system;
 * drivers/secure_sodium.h has those of libsodium.
 *
 * Memory: none.  Work: linear in the bytes given; x25519 is one scalar
 * multiplication.
 *
 *     uint8_t tag[SECURE_KEY_BYTES];
 *     suite.hash(tag, key, bytes, size);
 */
#ifndef TRANSPORT_SECURE_SUITE_H
#define TRANSPORT_SECURE_SUITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

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

#endif
