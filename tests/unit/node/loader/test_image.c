/* The header of an image: what it says comes back, any damage is found, and who
 * has signed it is told apart. */

#include "node/loader/image.h"
#include "transport/bytes.h"
#include "transport/frame.h"
#include "tests/unit/test.h"

static struct loader_image sample(void) {
    struct loader_image image = {.bytes = 1234567,
                                 .address = 0x10000,
                                 .number = 0x01020304,
                                 .flags = LOADER_NO_WAY_BACK,
                                 .board = "mps2-an500",
                                 .version = "0.1.0"};
    memset(image.digest, 0xd1, sizeof image.digest);
    memset(image.key, 0x4e, sizeof image.key);
    memset(image.signature, 0x51, sizeof image.signature);
    return image;
}

TEST(what_is_packed_comes_back) {
    struct loader_image image = sample(), back;
    uint8_t bytes[LOADER_HEADER_BYTES], again[LOADER_HEADER_BYTES];
    loader_image_pack(&image, bytes);
    assert_memory_equal(bytes, "incodeI1", 8);
    assert_int_equal(bytes[16], 4); /* the low byte first */
    assert_int_equal(loader_image_unpack(&back, bytes), LOADER_GOOD);
    assert_int_equal(back.bytes, image.bytes);
    assert_int_equal(back.address, image.address);
    assert_int_equal(back.number, image.number);
    assert_int_equal(back.flags, image.flags);
    assert_string_equal(back.board, "mps2-an500");
    assert_string_equal(back.version, "0.1.0");
    assert_memory_equal(back.digest, image.digest, sizeof back.digest);
    assert_memory_equal(back.key, image.key, sizeof back.key);
    assert_memory_equal(back.signature, image.signature, sizeof back.signature);
    loader_image_pack(&back, again);
    assert_memory_equal(bytes, again, sizeof bytes);
}

/* The longest texts have no zero at their end. */
TEST(texts_fill_their_fields) {
    struct loader_image image = sample(), back;
    uint8_t bytes[LOADER_HEADER_BYTES];
    memset(image.board, 'b', LOADER_BOARD_BYTES);
    memset(image.version, 'v', LOADER_VERSION_BYTES);
    loader_image_pack(&image, bytes);
    assert_int_equal(loader_image_unpack(&back, bytes), LOADER_GOOD);
    assert_int_equal(strlen(back.board), LOADER_BOARD_BYTES);
    assert_int_equal(strlen(back.version), LOADER_VERSION_BYTES);
}

TEST(every_false_bit_is_found) {
    struct loader_image image = sample();
    uint8_t bytes[LOADER_HEADER_BYTES];
    loader_image_pack(&image, bytes);
    for (unsigned bit = 0; bit < 8 * sizeof bytes; bit++) {
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        assert_int_equal(loader_image_unpack(&image, bytes), LOADER_NO_IMAGE);
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    memset(bytes, 0xff, sizeof bytes); /* an erased page */
    assert_int_equal(loader_image_unpack(&image, bytes), LOADER_NO_IMAGE);
    memset(bytes, 0, sizeof bytes);
    assert_int_equal(loader_image_unpack(&image, bytes), LOADER_NO_IMAGE);
}

/* Nothing can be hidden where no signature covers it. */
TEST(what_says_nothing_is_zero) {
    struct loader_image image = sample();
    uint8_t bytes[LOADER_HEADER_BYTES];
    loader_image_pack(&image, bytes);
    for (unsigned bit = 8 * 192; bit < 8 * 252; bit++) {
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        bytes_put32(bytes + 252, frame_crc32c(0, bytes, 252));
        assert_int_equal(loader_image_unpack(&image, bytes), LOADER_NO_IMAGE);
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
}

/* Stands for Ed25519: what it is asked, and its word. */
static struct {
    unsigned asked;
    size_t size;
    bool word;
} judge;

static bool good(const uint8_t signature[SIGN_BYTES], const uint8_t *bytes,
                 size_t size, const uint8_t key[SIGN_PUBLIC_BYTES]) {
    judge.asked++;
    judge.size = size;
    assert_int_equal(signature[0], 0x51);
    assert_int_equal(bytes[0], 'i');
    assert_int_equal(key[0], 0x4e);
    return judge.word;
}

TEST(a_signer_is_known_by_key_and_signature) {
    static const struct sign_suite suite = {.good = good};
    struct loader_image image = sample();
    uint8_t bytes[LOADER_HEADER_BYTES], key[SIGN_PUBLIC_BYTES];
    memcpy(key, image.key, sizeof key);
    loader_image_pack(&image, bytes);
    judge.word = true;
    assert_int_equal(loader_image_signed(bytes, &suite, key), LOADER_GOOD);
    assert_int_equal(judge.size, LOADER_SIGNED_BYTES);
    judge.word = false;
    assert_int_equal(loader_image_signed(bytes, &suite, key),
                     LOADER_WRONG_SIGNATURE);
    key[SIGN_PUBLIC_BYTES - 1] ^= 1;
    assert_int_equal(loader_image_signed(bytes, &suite, key), LOADER_WRONG_KEY);
    memset(image.key, 0, sizeof image.key);
    loader_image_pack(&image, bytes);
    assert_int_equal(loader_image_signed(bytes, &suite, key), LOADER_UNSIGNED);
    memset(key, 0, sizeof key); /* nobody's key is nobody's signature */
    assert_int_equal(loader_image_signed(bytes, &suite, key), LOADER_UNSIGNED);
    assert_int_equal(judge.asked, 2);
}

TEST(every_fault_has_its_text) {
    assert_null(loader_fault_text(LOADER_GOOD));
    for (unsigned i = LOADER_GOOD + 1; i <= LOADER_FAULTS; i++)
        assert_non_null(loader_fault_text((enum loader_fault)i));
}
