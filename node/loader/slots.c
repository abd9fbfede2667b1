#include "slots.h"

#include <string.h>

#include "boots.h"
#include "layout.h"
#include "look.h"
#include "records.h"
#include "transport/bytes.h"
#include "transport/frame.h"

enum {
    STATE_MARK = 0x31415453,  /* "STA1" */
    SERIAL_MARK = 0x31524553, /* "SER1" */
    STATE_BYTES = 32,
    SERIAL_BYTES = 32
};

/* --- the state -------------------------------------------------------------
 */

static struct loader_records state_records(const struct loader_flash *flash) {
    return (struct loader_records){flash, LOADER_STATE_SECTOR, STATE_MARK,
                                   STATE_BYTES};
}

static struct loader_state read_state(const struct loader_flash *flash) {
    const struct loader_records records = state_records(flash);
    struct loader_state state = {.slot = LOADER_SLOTS};
    uint8_t body[STATE_BYTES - LOADER_RECORD_OWN];
    if (loader_records_newest(&records, body) > 0) {
        state.floor = bytes_get32(body);
        state.slot = body[4] < LOADER_SLOTS ? body[4] : LOADER_SLOTS;
        state.trial = body[5];
        state.tries = body[6];
    }
    return state;
}

static bool write_state(const struct loader_flash *flash,
                        const struct loader_state *state) {
    const struct loader_records records = state_records(flash);
    uint8_t body[STATE_BYTES - LOADER_RECORD_OWN];
    uint32_t number;
    memset(body, 0, sizeof body);
    bytes_put32(body, state->floor);
    body[4] = state->slot;
    body[5] = state->trial;
    body[6] = state->tries;
    return loader_records_append(&records, body, &number);
}

void loader_slots_open(struct loader_slots *slots,
                       const struct loader_rules *rules) {
    memset(slots, 0, sizeof *slots);
    slots->rules = rules;
    slots->state = read_state(rules->flash);
}

bool loader_slots_use(struct loader_slots *slots, unsigned slot, bool trial) {
    struct loader_state next = slots->state;
    next.slot = (uint8_t)slot;
    next.trial = trial;
    next.tries = 0;
    if (!write_state(slots->rules->flash, &next)) {
        return false;
    }
    slots->state = next;
    return true;
}

/* --- images ----------------------------------------------------------------
 */

/* A board has no C library. */
static bool same_name(const char *a, const char *b) {
    while (*a != '\0' && *a == *b) {
        a++;
        b++;
    }
    return *a == *b;
}

enum loader_fault loader_slots_suits(const struct loader_slots *slots,
                                     const uint8_t header[LOADER_HEADER_BYTES],
                                     struct loader_image *image) {
    const struct loader_rules *rules = slots->rules;
    const struct loader_layout layout = loader_layout(rules->flash);
    if (loader_image_unpack(image, header) != LOADER_GOOD) {
        return LOADER_NO_IMAGE;
    }
    if (layout.bytes < LOADER_HEADER_BYTES ||
        image->bytes > layout.bytes - LOADER_HEADER_BYTES ||
        image->bytes > rules->room) {
        return LOADER_TOO_LARGE;
    }
    if (!same_name(image->board, rules->board)) {
        return LOADER_WRONG_BOARD;
    }
    if (image->address != rules->address) {
        return LOADER_WRONG_ADDRESS;
    }
    return image->number < slots->state.floor ? LOADER_TOO_OLD : LOADER_GOOD;
}

uint32_t loader_slots_code(const struct loader_slots *slots, unsigned slot) {
    const struct loader_layout layout = loader_layout(slots->rules->flash);
    return loader_slot_at(&layout, slots->rules->flash, slot) +
           LOADER_HEADER_BYTES;
}

static bool is_good(struct loader_slots *slots, unsigned slot) {
    struct loader_look look;
    loader_look_begin(&look, slots, slot);
    while (loader_look_step(&look, slots)) {
        loader_slots_alive(slots);
    }
    return slots->fault[slot] == LOADER_GOOD;
}

/* --- which is started ------------------------------------------------------
 */

/* To the one before, or to none.  The old one has come up once. */
static void fall_back(struct loader_slots *slots) {
    unsigned other = 1u - slots->state.slot;
    (void)loader_slots_use(slots, is_good(slots, other) ? other : LOADER_SLOTS,
                           false);
}

unsigned loader_slots_choose(struct loader_slots *slots, bool ended_badly) {
    const struct loader_state *state = &slots->state;
    if (state->slot < LOADER_SLOTS && state->trial &&
        (state->tries >= LOADER_TRIES || (ended_badly && state->tries > 0))) {
        fall_back(slots);
    }
    if (state->slot >= LOADER_SLOTS) {
        return LOADER_SLOTS;
    }
    if (slots->known[state->slot] || is_good(slots, state->slot)) {
        return slots->fault[state->slot] == LOADER_GOOD ? state->slot
                                                        : LOADER_SLOTS;
    }
    unsigned other = 1u - state->slot;
    if (is_good(slots, other) && loader_slots_use(slots, other, true)) {
        return other;
    }
    return LOADER_SLOTS;
}

unsigned loader_slots_start(struct loader_slots *slots,
                            const struct loader_rules *rules, bool ended_badly,
                            uint32_t *boot) {
    loader_slots_open(slots, rules);
    slots->worn = !loader_boots_next(rules->flash, boot);
    if (slots->worn) {
        *boot = 0;
        return LOADER_SLOTS;
    }
    return loader_slots_choose(slots, ended_badly);
}

bool loader_slots_try(struct loader_slots *slots) {
    struct loader_state next = slots->state;
    next.tries++;
    if (next.trial && !write_state(slots->rules->flash, &next)) {
        slots->worn = true;
        return false;
    }
    slots->state.tries += slots->state.trial;
    return true;
}

bool loader_slots_unconfirmed(const struct loader_flash *flash, unsigned slot,
                              struct loader_state *up) {
    const struct loader_layout layout = loader_layout(flash);
    const struct loader_state before = read_state(flash);
    uint8_t header[LOADER_HEADER_BYTES];
    struct loader_image image;
    *up = before;
    if (slot >= LOADER_SLOTS || before.slot != slot) {
        return false; /* of an image that was not started from there */
    }
    flash->read(flash->context, loader_slot_at(&layout, flash, slot), header,
                sizeof header);
    up->trial = up->tries = 0;
    if (loader_image_unpack(&image, header) == LOADER_GOOD &&
        (image.flags & LOADER_NO_WAY_BACK) != 0 && image.number > up->floor) {
        up->floor = image.number;
    }
    return up->trial != before.trial || up->floor != before.floor;
}

bool loader_slots_confirm(const struct loader_flash *flash,
                          const struct loader_state *up) {
    return write_state(flash, up);
}

bool loader_slots_lived(const struct loader_flash *flash, unsigned slot) {
    struct loader_state state = read_state(flash);
    if (slot >= LOADER_SLOTS || state.slot != slot || !state.trial ||
        state.tries <= 1) {
        return true;
    }
    state.tries = 1; /* this start: it may still end badly */
    return write_state(flash, &state);
}

bool loader_slots_install(const struct loader_flash *flash,
                          const uint8_t *image, uint32_t bytes) {
    const struct loader_layout layout = loader_layout(flash);
    const struct loader_state state = {.slot = 0};
    if (bytes > layout.bytes) {
        return false;
    }
    for (uint32_t s = 0; s < layout.sectors; s++) {
        if (!flash->erase(flash->context, layout.first + s)) {
            return false;
        }
    }
    return loader_flash_put(flash, loader_slot_at(&layout, flash, 0), image,
                            bytes) &&
           write_state(flash, &state);
}

/* --- the serial number -----------------------------------------------------
 */

static bool blank(const uint8_t *bytes, uint32_t size) {
    for (uint32_t i = 0; i < size; i++) {
        if (bytes[i] != 0xff) {
            return false;
        }
    }
    return true;
}

/* The first record that is whole; else where the next may be written, or the
 * sector's end. */
static bool find_serial(const struct loader_flash *flash, uint32_t *at,
                        uint8_t record[SERIAL_BYTES]) {
    uint32_t begin = LOADER_SERIAL_SECTOR * flash->sector_bytes;
    uint32_t end = begin + flash->sector_bytes;
    *at = begin;
    for (uint32_t i = begin; i < end; i += SERIAL_BYTES) {
        flash->read(flash->context, i, record, SERIAL_BYTES);
        if (bytes_get32(record) == SERIAL_MARK &&
            bytes_get32(record + 4 + LOADER_SERIAL_BYTES) ==
                frame_crc32c(0, record, 4 + LOADER_SERIAL_BYTES)) {
            return true;
        }
        if (!blank(record, SERIAL_BYTES)) {
            *at = i + SERIAL_BYTES;
        }
    }
    return false;
}

bool loader_slots_serial(const struct loader_flash *flash,
                         uint8_t serial[LOADER_SERIAL_BYTES]) {
    uint8_t record[SERIAL_BYTES];
    uint32_t at;
    bool found = find_serial(flash, &at, record);
    memset(serial, 0, LOADER_SERIAL_BYTES);
    if (found) {
        memcpy(serial, record + 4, LOADER_SERIAL_BYTES);
    }
    return found;
}

bool loader_slots_name(const struct loader_flash *flash,
                       const uint8_t serial[LOADER_SERIAL_BYTES]) {
    uint8_t record[SERIAL_BYTES];
    uint32_t at, end = (LOADER_SERIAL_SECTOR + 1) * flash->sector_bytes;
    if (find_serial(flash, &at, record)) {
        return true;
    }
    if (at == end) { /* torn ones alone, or what was there before */
        at = end - flash->sector_bytes;
        if (!loader_flash_clear(flash, at)) {
            return false;
        }
    }
    memset(record, 0xff, sizeof record);
    bytes_put32(record, SERIAL_MARK);
    memcpy(record + 4, serial, LOADER_SERIAL_BYTES);
    bytes_put32(record + 4 + LOADER_SERIAL_BYTES,
                frame_crc32c(0, record, 4 + LOADER_SERIAL_BYTES));
    return loader_flash_put(flash, at, record, sizeof record);
}
