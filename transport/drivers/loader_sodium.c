#include "loader_sodium.h"

#include <assert.h>
#include <sodium/crypto_generichash_blake2b.h>
#include <sodium/crypto_sign_ed25519.h>

static_assert(sizeof(crypto_generichash_blake2b_state) <= LOADER_HASH_BYTES,
              "a hash fits");

static void begin(void *hash)
{
    (void)crypto_generichash_blake2b_init(hash, NULL, 0, LOADER_DIGEST_BYTES);
}

static void add(void *hash, const void *bytes, size_t size)
{
    (void)crypto_generichash_blake2b_update(hash, bytes, size);
}

static void end(void *hash, uint8_t digest[LOADER_DIGEST_BYTES])
{
    (void)crypto_generichash_blake2b_final(hash, digest, LOADER_DIGEST_BYTES);
}

static bool good(const uint8_t signature[LOADER_SIGNATURE_BYTES],
                 const uint8_t *bytes, size_t size,
                 const uint8_t key[LOADER_PUBLIC_BYTES])
{
    return crypto_sign_ed25519_verify_detached(signature, bytes, size, key) ==
           0;
}

const struct loader_suite loader_sodium = {
    .begin = begin, .add = add, .end = end, .good = good};
