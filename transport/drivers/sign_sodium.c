#include "sign_sodium.h"

#include <assert.h>
#include <sodium/crypto_generichash_blake2b.h>
#include <sodium/crypto_sign_ed25519.h>

static_assert(sizeof(crypto_generichash_blake2b_state) <= SIGN_HASH_BYTES,
              "a hash fits");

static void begin(void *hash) {
    (void)crypto_generichash_blake2b_init(hash, NULL, 0, SIGN_DIGEST_BYTES);
}

static void add(void *hash, const void *bytes, size_t size) {
    (void)crypto_generichash_blake2b_update(hash, bytes, size);
}

static void end(void *hash, uint8_t digest[SIGN_DIGEST_BYTES]) {
    (void)crypto_generichash_blake2b_final(hash, digest, SIGN_DIGEST_BYTES);
}

static bool good(const uint8_t signature[SIGN_BYTES], const uint8_t *bytes,
                 size_t size, const uint8_t key[SIGN_PUBLIC_BYTES]) {
    return crypto_sign_ed25519_verify_detached(signature, bytes, size, key) ==
           0;
}

const struct sign_suite sign_sodium = {
    .begin = begin, .add = add, .end = end, .good = good};
