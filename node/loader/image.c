#include "image.h"

#include <assert.h>
#include <string.h>

#include "transport/bytes.h"
#include "transport/frame.h"
#include "incoming.h"
#include "slots.h"

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
    for (unsigned i = AT_ZEROS; i < AT_CRC; i++)
        all |= bytes[i];
    return all == 0;
}

enum loader_fault
loader_image_unpack(struct loader_image *image,
                    const uint8_t bytes[LOADER_HEADER_BYTES]) {
    if (memcmp(bytes, magic, sizeof magic) != 0 ||
        bytes_get32(bytes + AT_CRC) != frame_crc32c(0, bytes, AT_CRC) ||
        !is_unsaid(bytes) || bytes_get32(bytes + AT_BYTES) == 0)
        return LOADER_NO_IMAGE;
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
    for (size_t i = 0; i < size && text[i] != '\0'; i++)
        at[i] = (uint8_t)text[i];
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
    if (memcmp(bytes + AT_KEY, nobody, sizeof nobody) == 0)
        return LOADER_UNSIGNED;
    if (memcmp(bytes + AT_KEY, key, SIGN_PUBLIC_BYTES) != 0)
        return LOADER_WRONG_KEY;
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

/* --- look ----------------------------------------------------------------- */

void loader_look_begin(struct loader_look *look, struct loader_slots *slots,
                       unsigned slot) {
    look->slot = slot;
    look->begun = false;
    slots->known[slot] = false;
}

void loader_look_hash(struct loader_look *look,
                      const struct loader_slots *slots,
                      const uint8_t header[LOADER_HEADER_BYTES],
                      const struct loader_image *image, unsigned slot) {
    const struct sign_suite *suite = slots->rules->suite;
    look->code = loader_slots_code(slots, slot);
    look->bytes = image->bytes;
    look->done = 0;
    memcpy(look->digest, image->digest, sizeof look->digest);
    suite->begin(look->hash);
    suite->add(look->hash, header, LOADER_NAMED_BYTES);
}

static bool ends_well(struct loader_look *look,
                      const struct loader_slots *slots) {
    uint8_t digest[SIGN_DIGEST_BYTES];
    slots->rules->suite->end(look->hash, digest);
    return memcmp(digest, look->digest, sizeof digest) == 0;
}

static void read_header(const struct loader_slots *slots, unsigned slot,
                        uint8_t header[LOADER_HEADER_BYTES]) {
    const struct loader_flash *flash = slots->rules->flash;
    flash->read(flash->context,
                loader_slots_code(slots, slot) - LOADER_HEADER_BYTES, header,
                LOADER_HEADER_BYTES);
}

bool loader_look_slice(struct loader_look *look,
                       const struct loader_slots *slots, bool *good) {
    const struct sign_suite *suite = slots->rules->suite;
    const struct loader_flash *flash = slots->rules->flash;
    uint32_t left = look->bytes - look->done;
    uint8_t slice[LOADER_SLICE_BYTES];
    if (left > 0) {
        uint32_t size = left < sizeof slice ? left : sizeof slice;
        flash->read(flash->context, look->code + look->done, slice, size);
        suite->add(look->hash, slice, size);
        look->done += size;
        return true;
    }
    *good = ends_well(look, slots);
    return false;
}

bool loader_look_copy(struct loader_look *look, struct loader_slots *slots,
                      unsigned slot, const uint8_t *copy) {
    const struct sign_suite *suite = slots->rules->suite;
    uint8_t header[LOADER_HEADER_BYTES];
    read_header(slots, slot, header);
    loader_look_hash(look, slots, header, &slots->image[slot], slot);
    while (look->done < look->bytes) {
        uint32_t left = look->bytes - look->done;
        uint32_t size = left < LOADER_SLICE_BYTES ? left : LOADER_SLICE_BYTES;
        suite->add(look->hash, copy + look->done, size);
        look->done += size;
        loader_slots_alive(slots);
    }
    bool good = ends_well(look, slots);
    slots->fault[slot] = good ? LOADER_GOOD : LOADER_WRONG_DIGEST;
    return good;
}

/* The header, the rules and the signature. */
static enum loader_fault begin(struct loader_look *look,
                               struct loader_slots *slots) {
    const struct loader_rules *rules = slots->rules;
    struct loader_image *image = &slots->image[look->slot];
    uint8_t header[LOADER_HEADER_BYTES];
    read_header(slots, look->slot, header);
    enum loader_fault fault = loader_slots_suits(slots, header, image);
    if (fault == LOADER_GOOD)
        fault = loader_image_signed(header, rules->suite, rules->key);
    if (fault == LOADER_GOOD)
        loader_look_hash(look, slots, header, image, look->slot);
    return fault;
}

bool loader_look_step(struct loader_look *look, struct loader_slots *slots) {
    enum loader_fault fault = LOADER_GOOD;
    bool good = false;
    if (!look->begun) {
        fault = begin(look, slots);
        look->begun = true;
    } else if (!loader_look_slice(look, slots, &good)) {
        fault = good ? LOADER_GOOD : LOADER_WRONG_DIGEST;
        slots->known[look->slot] = true;
    }
    slots->known[look->slot] = slots->known[look->slot] || fault != LOADER_GOOD;
    slots->fault[look->slot] = fault;
    return !slots->known[look->slot];
}

/* --- layout --------------------------------------------------------------- */

enum {
    LARGE = 64, /* sectors, from which slots begin at */
    LARGE_FIRST = 16,
    SMALL_FIRST = 5,
    SLOT_BYTES_MAX = 1 << 20,
    PIECE = 64 /* bytes that are compared at a time */
};

static_assert(SLOT_BYTES_MAX / LOADER_BLOCK_BYTES < LOADER_BLOCKS_MAX,
              "a slot's blocks fit a map");

uint32_t loader_marks_in(const struct loader_flash *flash) {
    return flash->page_bytes > LOADER_HEADER_BYTES ? flash->page_bytes
                                                   : LOADER_HEADER_BYTES;
}

uint32_t loader_mark_apart(const struct loader_flash *flash) {
    return loader_flash_apart(flash, LOADER_MARK_BYTES);
}

struct loader_layout loader_layout(const struct loader_flash *flash) {
    struct loader_layout layout;
    memset(&layout, 0, sizeof layout);
    layout.first = flash->sectors >= LARGE ? LARGE_FIRST : SMALL_FIRST;
    if (flash->sectors <= layout.first)
        return layout;
    uint32_t most = SLOT_BYTES_MAX / flash->sector_bytes;
    layout.sectors = (flash->sectors - layout.first) / LOADER_SLOTS;
    layout.sectors = layout.sectors < most ? layout.sectors : most;
    uint32_t blocks = layout.sectors * flash->sector_bytes / LOADER_BLOCK_BYTES;
    uint32_t marks =
        loader_marks_in(flash) + loader_mark_apart(flash) * (blocks + 1);
    layout.journal = (marks + flash->sector_bytes - 1) / flash->sector_bytes;
    if (layout.sectors > layout.journal)
        layout.bytes = (layout.sectors - layout.journal) * flash->sector_bytes;
    return layout;
}

uint32_t loader_slot_at(const struct loader_layout *layout,
                        const struct loader_flash *flash, unsigned slot) {
    return (layout->first + slot * layout->sectors) * flash->sector_bytes;
}

uint32_t loader_journal_at(const struct loader_layout *layout,
                           const struct loader_flash *flash, unsigned slot) {
    return loader_slot_at(layout, flash, slot) +
           (layout->sectors - layout->journal) * flash->sector_bytes;
}

bool loader_flash_put(const struct loader_flash *flash, uint32_t at,
                      const void *bytes, uint32_t size) {
    const uint8_t *in = bytes;
    bool taken = true;
    for (uint32_t done = 0; done < size;) {
        uint32_t left = flash->page_bytes - (at + done) % flash->page_bytes;
        uint32_t part = left < size - done ? left : size - done;
        taken =
            flash->program(flash->context, at + done, in + done, part) && taken;
        done += part;
    }
    return taken && loader_flash_holds(flash, at, bytes, size);
}

/* bytes NULL: 0xff all; takes: bits that are set in the flash may differ. */
static bool compare(const struct loader_flash *flash, uint32_t at,
                    const uint8_t *bytes, uint32_t size, bool takes) {
    uint8_t piece[PIECE];
    for (uint32_t done = 0; done < size; done += PIECE) {
        uint32_t part = size - done < PIECE ? size - done : PIECE;
        flash->read(flash->context, at + done, piece, part);
        for (uint32_t i = 0; i < part; i++) {
            uint8_t wanted = bytes == NULL ? 0xff : bytes[done + i];
            if ((takes ? piece[i] & wanted : piece[i]) != wanted)
                return false;
        }
    }
    return true;
}

bool loader_flash_holds(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size) {
    return compare(flash, at, bytes, size, false);
}

bool loader_flash_takes(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size) {
    return compare(flash, at, bytes, size, true);
}

bool loader_flash_blank(const struct loader_flash *flash, uint32_t at,
                        uint32_t size) {
    return compare(flash, at, NULL, size, false);
}

bool loader_flash_clear(const struct loader_flash *flash, uint32_t at) {
    return flash->erase(flash->context, at / flash->sector_bytes);
}
