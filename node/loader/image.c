#include "image.h"

#include <assert.h>
#include <string.h>

#include "transport/bytes.h"
#include "transport/frame.h"

enum {
    AT_BYTES = 8,
    AT_ADDRESS = 12,
    AT_NUMBER = 16,
    AT_FLAGS = 20,
    AT_BOARD = 24,
    AT_VERSION = AT_BOARD + LOADER_BOARD_BYTES,
    AT_DIGEST = LOADER_NAMED_BYTES,
    AT_KEY = AT_DIGEST + SIGN_DIGEST_BYTES,
    AT_SIGNATURE = LOADER_SIGNED_BYTES,
    AT_ZEROS = AT_SIGNATURE + SIGN_BYTES,
    AT_CRC = LOADER_HEADER_BYTES - 4
};

static_assert(AT_VERSION + LOADER_VERSION_BYTES == LOADER_NAMED_BYTES &&
                  AT_KEY + SIGN_PUBLIC_BYTES == LOADER_SIGNED_BYTES,
              "header layout");

static const uint8_t magic[AT_BYTES] = {'i', 'n', 'c', 'o', 'd', 'e', 'I', '1'};

/* The signature covers what is before it; what is behind it says nothing. */
static bool is_unsaid(const uint8_t bytes[LOADER_HEADER_BYTES]) {
    uint8_t all = 0;
    for (unsigned i = AT_ZEROS; i < AT_CRC; i++) {
        all |= bytes[i];
    }
    return all == 0;
}

enum loader_fault
loader_image_unpack(struct loader_image *image,
                    const uint8_t bytes[LOADER_HEADER_BYTES]) {
    if (memcmp(bytes, magic, sizeof magic) != 0 ||
        bytes_get32(bytes + AT_CRC) != frame_crc32c(0, bytes, AT_CRC) ||
        !is_unsaid(bytes) || bytes_get32(bytes + AT_BYTES) == 0) {
        return LOADER_NO_IMAGE;
    }
    *image = (struct loader_image){.bytes = bytes_get32(bytes + AT_BYTES),
                                   .address = bytes_get32(bytes + AT_ADDRESS),
                                   .number = bytes_get32(bytes + AT_NUMBER),
                                   .flags = bytes_get32(bytes + AT_FLAGS)};
    memcpy(image->board, bytes + AT_BOARD, LOADER_BOARD_BYTES);
    memcpy(image->version, bytes + AT_VERSION, LOADER_VERSION_BYTES);
    memcpy(image->digest, bytes + AT_DIGEST, sizeof image->digest);
    memcpy(image->key, bytes + AT_KEY, sizeof image->key);
    memcpy(image->signature, bytes + AT_SIGNATURE, sizeof image->signature);
    return LOADER_GOOD;
}

/* Up to the text's end: what is behind it is of no meaning. */
static void put_text(uint8_t *at, const char *text, size_t size) {
    for (size_t i = 0; i < size && text[i] != '\0'; i++) {
        at[i] = (uint8_t)text[i];
    }
}

void loader_image_pack(const struct loader_image *image,
                       uint8_t bytes[LOADER_HEADER_BYTES]) {
    memset(bytes, 0, LOADER_HEADER_BYTES);
    memcpy(bytes, magic, sizeof magic);
    bytes_put32(bytes + AT_BYTES, image->bytes);
    bytes_put32(bytes + AT_ADDRESS, image->address);
    bytes_put32(bytes + AT_NUMBER, image->number);
    bytes_put32(bytes + AT_FLAGS, image->flags);
    put_text(bytes + AT_BOARD, image->board, LOADER_BOARD_BYTES);
    put_text(bytes + AT_VERSION, image->version, LOADER_VERSION_BYTES);
    memcpy(bytes + AT_DIGEST, image->digest, sizeof image->digest);
    memcpy(bytes + AT_KEY, image->key, sizeof image->key);
    memcpy(bytes + AT_SIGNATURE, image->signature, sizeof image->signature);
    bytes_put32(bytes + AT_CRC, frame_crc32c(0, bytes, AT_CRC));
}

enum loader_fault loader_image_signed(const uint8_t bytes[LOADER_HEADER_BYTES],
                                      const struct sign_suite *suite,
                                      const uint8_t key[SIGN_PUBLIC_BYTES]) {
    static const uint8_t nobody[SIGN_PUBLIC_BYTES];
    if (memcmp(bytes + AT_KEY, nobody, sizeof nobody) == 0) {
        return LOADER_UNSIGNED;
    }
    if (memcmp(bytes + AT_KEY, key, SIGN_PUBLIC_BYTES) != 0) {
        return LOADER_WRONG_KEY;
    }
    return suite->good(bytes + AT_SIGNATURE, bytes, LOADER_SIGNED_BYTES, key)
               ? LOADER_GOOD
               : LOADER_WRONG_SIGNATURE;
}

const char *loader_fault_text(enum loader_fault fault) {
    static const char *const texts[LOADER_FAULTS] = {
        [LOADER_NO_IMAGE] = "it is no image, or a damaged one",
        [LOADER_TOO_LARGE] = "it is too large for the board",
        [LOADER_WRONG_BOARD] = "it is for another board",
        [LOADER_WRONG_ADDRESS] = "it is linked for another address",
        [LOADER_TOO_OLD] = "it is older than what the board goes back to",
        [LOADER_UNSIGNED] = "it is not signed",
        [LOADER_WRONG_KEY] = "it is signed with another key",
        [LOADER_WRONG_SIGNATURE] = "its signature is false",
        [LOADER_WRONG_DIGEST] = "its code is not what was signed",
        [LOADER_WORN] = "the board's flash does not hold it",
        [LOADER_TOO_OFTEN] = "too many transfers, or false ones, have begun"};
    return (unsigned)fault < LOADER_FAULTS ? texts[fault] : "it is refused";
}
