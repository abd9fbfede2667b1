#include "secure_sodium.h"

#include <sodium.h>
#include <string.h>
#include <sys/random.h>

static void hash(uint8_t out[SECURE_KEY_BYTES],
                 const uint8_t key[SECURE_KEY_BYTES], const uint8_t *in,
                 size_t size)
{
    (void)crypto_generichash_blake2b(out, SECURE_KEY_BYTES, in, size, key,
                                     SECURE_KEY_BYTES);
}

/* libsodium tells a point of a small order by its status, and may leave `out`
 * as it was. */
static void x25519(uint8_t out[SECURE_KEY_BYTES],
                   const uint8_t secret[SECURE_KEY_BYTES],
                   const uint8_t point[SECURE_KEY_BYTES])
{
    if (crypto_scalarmult_curve25519(out, secret, point) != 0) {
        memset(out, 0, SECURE_KEY_BYTES);
    }
}

static void make_nonce(uint8_t nonce[12], uint64_t counter)
{
    memset(nonce, 0, 12);
    for (unsigned i = 0; i < 8; i++) {
        nonce[4 + i] = (uint8_t)(counter >> 8 * i);
    }
}

static void seal(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES])
{
    uint8_t nonce[12];
    make_nonce(nonce, counter);
    (void)crypto_aead_chacha20poly1305_ietf_encrypt(
        out, NULL, in, size, ad, SECURE_HEAD_BYTES, NULL, nonce, key);
}

static bool open(uint8_t *out, const uint8_t *in, size_t size,
                 const uint8_t ad[SECURE_HEAD_BYTES], uint64_t counter,
                 const uint8_t key[SECURE_KEY_BYTES])
{
    uint8_t nonce[12];
    make_nonce(nonce, counter);
    return crypto_aead_chacha20poly1305_ietf_decrypt(
               out, NULL, NULL, in, size + SECURE_TAG_BYTES, ad,
               SECURE_HEAD_BYTES, nonce, key) == 0;
}

const struct secure_suite secure_sodium = {
    .hash = hash, .x25519 = x25519, .seal = seal, .open = open};

bool secure_system_random(void *context, uint8_t *bytes, size_t size)
{
    (void)context;
    return getrandom(bytes, size, 0) == (ssize_t)size;
}
