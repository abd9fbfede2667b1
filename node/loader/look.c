#include "look.h"

#include <string.h>

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
    if (fault == LOADER_GOOD) {
        fault = loader_image_signed(header, rules->suite, rules->key);
    }
    if (fault == LOADER_GOOD) {
        loader_look_hash(look, slots, header, image, look->slot);
    }
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
