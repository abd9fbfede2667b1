#include "secure_sodium.h"

#include <sodium.h>
#include <string.h>

#include "transport/secure_wipe.h"

/* libsodium leaves parts of keys on the stack: it is wiped where its functions
 * had their frames. */
static __attribute__((noinline)) void burn_stack(void) {
    uint8_t below[2048];
    secure_wipe(below, sizeof below);
}

static void hash(uint8_t out[SECURE_KEY_BYTES],
                 const uint8_t key[SECURE_KEY_BYTES], const uint8_t *in,
                 size_t size) {
    (void)crypto_generichash_blake2b(out, SECURE_KEY_BYTES, in, size, key,
                                     SECURE_KEY_BYTES);
    burn_stack();
}

/* libsodium tells a point of a small order by its status, and may leave `out`
 * as it was. */
static void x25519(uint8_t out[SECURE_KEY_BYTES],
                   const uint8_t secret[SECURE_KEY_BYTES],
                   const uint8_t point[SECURE_KEY_BYTES]) {
    if (crypto_scalarmult_curve25519(out, secret, point) != 0) {
        memset(out, 0, SECURE_KEY_BYTES);
    }
    burn_stack();
}

static void make_nonce(uint8_t nonce[12], uint64_t counter) {
    memset(nonce, 0, 12);
    for (unsigned i = 0; i < 8; i++) {
        nonce[4 + i] = (uint8_t)(counter >> 8 * i);
    }
}

static void seal(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES]) {
    uint8_t nonce[12];
    make_nonce(nonce, counter);
    (void)crypto_aead_chacha20poly1305_ietf_encrypt(
        out, NULL, in, size, ad, SECURE_HEAD_BYTES, NULL, nonce, key);
    burn_stack();
}

static bool open(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES]) {
    uint8_t nonce[12];
    make_nonce(nonce, counter);
    int status = crypto_aead_chacha20poly1305_ietf_decrypt(
        out, NULL, NULL, in, size + SECURE_TAG_BYTES, ad, SECURE_HEAD_BYTES,
        nonce, key);
    burn_stack();
    return status == 0;
}

const struct secure_suite secure_sodium = {
    .hash = hash, .x25519 = x25519, .seal = seal, .open = open};
