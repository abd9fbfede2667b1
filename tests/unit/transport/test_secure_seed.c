/* Seeds never come twice, with or without random bytes, and where neither these
 * nor a number of the start are there, none is given. */
#include "secure_world.h"
#include "transport/secure.h"

static const uint8_t key[SECURE_KEY_BYTES] = "the cube's key";

static int by_bytes(const void *a, const void *b) {
    return memcmp(a, b, SECURE_NONCE_BYTES);
}

/* Of 10 devices, the first 20 draws of each of 20 starts. */
TEST(no_seed_comes_twice) {
    enum { DEVICES = 10, STARTS = 20, DRAWS = 20 };
    enum { SEEDS = DEVICES * STARTS * DRAWS };
    static uint8_t parts[2 * SEEDS][SECURE_NONCE_BYTES];
    size_t count = 0;
    for (unsigned device = 0; device < DEVICES; device++) {
        for (uint64_t start = 1; start <= STARTS; start++) {
            struct secure_source source = {.boot = start};
            source.device[device % 2 == 0 ? 0 : SECURE_DEVICE_BYTES - 1] =
                (uint8_t)device;
            for (unsigned i = 0; i < DRAWS; i++) {
                struct secure_seed seed;
                assert_true(
                    secure_seed_draw(&source, &secure_sodium, key, &seed));
                memcpy(parts[count++], seed.nonce, sizeof parts[0]);
                memcpy(parts[count++], seed.secret, sizeof parts[0]);
            }
        }
    }
    assert_int_equal(count, 2 * SEEDS);
    qsort(parts, count, sizeof parts[0], by_bytes);
    for (size_t i = 1; i < count; i++)
        assert_memory_not_equal(parts[i - 1], parts[i], sizeof parts[0]);
}

/* Every part of what a seed is made of makes another, to the last byte. */
TEST(every_byte_of_the_source_counts) {
    struct secure_source source = {.boot = 1};
    struct secure_seed first, other;
    uint8_t other_key[SECURE_KEY_BYTES];
    assert_true(secure_seed_draw(&source, &secure_sodium, key, &first));
    for (unsigned i = 0; i < SECURE_DEVICE_BYTES; i++) {
        struct secure_source near = {.boot = 1};
        near.device[i] = 1;
        assert_true(secure_seed_draw(&near, &secure_sodium, key, &other));
        assert_memory_not_equal(&first, &other, sizeof first);
    }
    for (unsigned bit = 1; bit < 64; bit++) {
        struct secure_source late = {.boot = 1 | UINT64_C(1) << bit};
        struct secure_source long_run = {.boot = 1,
                                         .draws = UINT64_C(1) << bit};
        assert_true(secure_seed_draw(&late, &secure_sodium, key, &other));
        assert_memory_not_equal(&first, &other, sizeof first);
        assert_true(secure_seed_draw(&long_run, &secure_sodium, key, &other));
        assert_memory_not_equal(&first, &other, sizeof first);
    }
    memcpy(other_key, key, sizeof key);
    other_key[31] ^= 1;
    source.draws = 0;
    assert_true(secure_seed_draw(&source, &secure_sodium, other_key, &other));
    assert_memory_not_equal(&first, &other, sizeof first);
}

static bool constant_bytes(void *context, uint8_t *bytes, size_t size) {
    memset(bytes, *(const uint8_t *)context, size);
    return *(const uint8_t *)context != 0;
}

TEST(random_bytes_count_and_may_fail) {
    static const struct secure_seed none;
    struct secure_seed first, other;
    uint8_t byte = 1;
    struct secure_source source = {.random = constant_bytes, .context = &byte};
    assert_true(secure_seed_draw(&source, &secure_sodium, key, &first));
    byte = 2;
    source.draws = 0;
    assert_true(secure_seed_draw(&source, &secure_sodium, key, &other));
    assert_memory_not_equal(&first, &other, sizeof first);
    /* A generator that repeats itself is not alone. */
    assert_true(secure_seed_draw(&source, &secure_sodium, key, &first));
    assert_memory_not_equal(&first, &other, sizeof first);
    byte = 0;
    assert_false(secure_seed_draw(&source, &secure_sodium, key, &other));
    assert_memory_equal(&other, &none, sizeof none);
    source.boot = 7;
    assert_true(secure_seed_draw(&source, &secure_sodium, key, &other));
}

/* The vector of PROTOCOL.md. */
TEST(the_vector) {
    struct secure_source source = {.device = "board 17", .boot = 3};
    struct secure_seed seed;
    uint8_t counted[SECURE_KEY_BYTES];
    for (size_t i = 0; i < sizeof counted; i++)
        counted[i] = (uint8_t)i;
    assert_true(secure_seed_draw(&source, &secure_sodium, counted, &seed));
    expect_bytes(seed.nonce,
                 "0de4c590b11f45092d9a9d145be683ca585e75bb31deb2d3");
    expect_bytes(seed.secret, "83e422ca8fb59ec7a3cabad6555ba885"
                              "bf6357611d7cc7e8a16a6f8ca5b45702");
}
