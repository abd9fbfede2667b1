/* The primitives that a signer, and a verifier of signatures, need from a
 * cryptographic library: BLAKE2b-256 (RFC 7693) of data in parts, and Ed25519
 * (RFC 8032).  The caller gives them, so that their users depend on no system;
 * drivers/sign_sodium.h has those of libsodium.
 *
 * Memory: SIGN_HASH_BYTES, the caller's, aligned to 64. */
#ifndef TRANSPORT_SIGN_SUITE_H
#define TRANSPORT_SIGN_SUITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    SIGN_HASH_BYTES = 384,
    SIGN_DIGEST_BYTES = 32,
    SIGN_PUBLIC_BYTES = 32,
    SIGN_BYTES = 64
};

struct sign_suite {
    void (*begin)(void *hash);
    void (*add)(void *hash, const void *bytes, size_t size);
    void (*end)(void *hash, uint8_t digest[SIGN_DIGEST_BYTES]);
    /* Whether the signature of these bytes was made with the secret half of
     * that key. */
    bool (*good)(const uint8_t signature[SIGN_BYTES], const uint8_t *bytes,
                 size_t size, const uint8_t key[SIGN_PUBLIC_BYTES]);
};

#endif
