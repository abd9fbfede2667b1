/* What the loader, and who signs for it, ask of a library that is known for its
 * cryptography: BLAKE2b-256 (RFC 7693) of what comes in parts, and Ed25519 (RFC
 * 8032).  They are given, so that node/ stays free of any system, and one image
 * has one digest wherever it is made.
 *
 * Memory: LOADER_HASH_BYTES, the caller's, aligned to 64.  Work: linear in the
 * bytes; `good` is two scalar multiplications.
 *
 *     suite->begin(hash);
 *     suite->add(hash, bytes, sizeof bytes);
 *     suite->end(hash, digest);
 */
#ifndef NODE_LOADER_SUITE_H
#define NODE_LOADER_SUITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    LOADER_HASH_BYTES = 384,
    LOADER_DIGEST_BYTES = 32,
    LOADER_PUBLIC_BYTES = 32,
    LOADER_SIGNATURE_BYTES = 64
};

struct loader_suite {
    void (*begin)(void *hash);
    void (*add)(void *hash, const void *bytes, size_t size);
    void (*end)(void *hash, uint8_t digest[LOADER_DIGEST_BYTES]);
    /* Whether the signature of these bytes was made with the secret half of
     * that key. */
    bool (*good)(const uint8_t signature[LOADER_SIGNATURE_BYTES],
                 const uint8_t *bytes, size_t size,
                 const uint8_t key[LOADER_PUBLIC_BYTES]);
};

#endif
