#include "slots.h"

#include <stddef.h>
#include <string.h>

#include "incoming.h"
#include "transport/bytes.h"
#include "transport/frame.h"
#include "incode/predicates/check.h"

enum {
    STATE_MARK = 0x31415453,  /* "STA1" */
    SERIAL_MARK = 0x31524553, /* "SER1" */
    STATE_BYTES = 32,
    SERIAL_BYTES = 32
};

/* --- the state ------------------------------------------------------------ */

static struct loader_records state_records(const struct loader_flash *flash) {
    return (struct loader_records){flash, LOADER_STATE_SECTOR, STATE_MARK,
                                   STATE_BYTES};
}

static uint32_t loader_records_newest(const struct loader_records *records,
                                      void *body);

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

static bool loader_records_append(const struct loader_records *records,
                                  const void *body, uint32_t *number);

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
    if (!write_state(slots->rules->flash, &next))
        return false;
    slots->state = next;
    return true;
}

/* --- images --------------------------------------------------------------- */

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
    if (loader_image_unpack(image, header) != LOADER_GOOD)
        return LOADER_NO_IMAGE;
    if (layout.bytes < LOADER_HEADER_BYTES ||
        image->bytes > layout.bytes - LOADER_HEADER_BYTES ||
        image->bytes > rules->room)
        return LOADER_TOO_LARGE;
    if (!same_name(image->board, rules->board))
        return LOADER_WRONG_BOARD;
    if (image->address != rules->address)
        return LOADER_WRONG_ADDRESS;
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
    while (loader_look_step(&look, slots))
        loader_slots_alive(slots);
    return slots->fault[slot] == LOADER_GOOD;
}

/* --- which is started ----------------------------------------------------- */

/* To the one before, or to none.  The old one has come up once. */
static void fall_back(struct loader_slots *slots) {
    unsigned other = 1u - slots->state.slot;
    (void)loader_slots_use(slots, is_good(slots, other) ? other : LOADER_SLOTS,
                           false);
}

unsigned loader_slots_choose(struct loader_slots *slots, bool ended_badly) {
    const struct loader_state *state = &slots->state;
    if (state->slot < LOADER_SLOTS && state->trial &&
        (state->tries >= LOADER_TRIES || (ended_badly && state->tries > 0)))
        fall_back(slots);
    if (state->slot >= LOADER_SLOTS)
        return LOADER_SLOTS;
    if (slots->known[state->slot] || is_good(slots, state->slot)) {
        return slots->fault[state->slot] == LOADER_GOOD ? state->slot
                                                        : LOADER_SLOTS;
    }
    unsigned other = 1u - state->slot;
    if (is_good(slots, other) && loader_slots_use(slots, other, true))
        return other;
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
    if (slot >= LOADER_SLOTS || before.slot != slot)
        return false; /* of an image that was not started from there */
    flash->read(flash->context, loader_slot_at(&layout, flash, slot), header,
                sizeof header);
    up->trial = up->tries = 0;
    if (loader_image_unpack(&image, header) == LOADER_GOOD &&
        (image.flags & LOADER_NO_WAY_BACK) != 0 && image.number > up->floor)
        up->floor = image.number;
    return up->trial != before.trial || up->floor != before.floor;
}

bool loader_slots_confirm(const struct loader_flash *flash,
                          const struct loader_state *up) {
    return write_state(flash, up);
}

bool loader_slots_lived(const struct loader_flash *flash, unsigned slot) {
    struct loader_state state = read_state(flash);
    if (slot >= LOADER_SLOTS || state.slot != slot || !state.trial ||
        state.tries <= 1)
        return true;
    state.tries = 1; /* this start: it may still end badly */
    return write_state(flash, &state);
}

bool loader_slots_install(const struct loader_flash *flash,
                          const uint8_t *image, uint32_t bytes) {
    const struct loader_layout layout = loader_layout(flash);
    const struct loader_state state = {.slot = 0};
    if (bytes > layout.bytes)
        return false;
    for (uint32_t s = 0; s < layout.sectors; s++)
        if (!flash->erase(flash->context, layout.first + s))
            return false;
    return loader_flash_put(flash, loader_slot_at(&layout, flash, 0), image,
                            bytes) &&
           write_state(flash, &state);
}

/* --- the serial number ---------------------------------------------------- */

static bool blank(const uint8_t *bytes, uint32_t size) {
    for (uint32_t i = 0; i < size; i++)
        if (bytes[i] != 0xff)
            return false;
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
                frame_crc32c(0, record, 4 + LOADER_SERIAL_BYTES))
            return true;
        if (!blank(record, SERIAL_BYTES))
            *at = i + SERIAL_BYTES;
    }
    return false;
}

bool loader_slots_serial(const struct loader_flash *flash,
                         uint8_t serial[LOADER_SERIAL_BYTES]) {
    uint8_t record[SERIAL_BYTES];
    uint32_t at;
    bool found = find_serial(flash, &at, record);
    memset(serial, 0, LOADER_SERIAL_BYTES);
    if (found)
        memcpy(serial, record + 4, LOADER_SERIAL_BYTES);
    return found;
}

bool loader_slots_name(const struct loader_flash *flash,
                       const uint8_t serial[LOADER_SERIAL_BYTES]) {
    uint8_t record[SERIAL_BYTES];
    uint32_t at, end = (LOADER_SERIAL_SECTOR + 1) * flash->sector_bytes;
    if (find_serial(flash, &at, record))
        return true;
    if (at == end) { /* torn ones alone, or what was there before */
        at = end - flash->sector_bytes;
        if (!loader_flash_clear(flash, at))
            return false;
    }
    memset(record, 0xff, sizeof record);
    bytes_put32(record, SERIAL_MARK);
    memcpy(record + 4, serial, LOADER_SERIAL_BYTES);
    bytes_put32(record + 4 + LOADER_SERIAL_BYTES,
                frame_crc32c(0, record, 4 + LOADER_SERIAL_BYTES));
    return loader_flash_put(flash, at, record, sizeof record);
}

/* --- budget --------------------------------------------------------------- */

enum { MAGIC = 0x31474442 /* "BDG1" */ };

static const struct {
    uint32_t at_once, period_s;
} limits[LOADER_EXPENSES] = {[LOADER_STARTS] = {1000, 60},
                             [LOADER_TRANSFERS] = {100, 4 * 3600},
                             [LOADER_FALSE] = {6, 10}};

static uint32_t sum(const struct loader_budget *budget) {
    return frame_crc32c(0, budget, offsetof(struct loader_budget, crc));
}

void loader_budget_open(struct loader_budget *budget) {
    if (budget->magic != MAGIC || budget->crc != sum(budget))
        *budget = (struct loader_budget){.magic = MAGIC};
    budget->passed_s = 0;
    budget->crc = sum(budget);
}

void loader_budget_pass(struct loader_budget *budget, uint64_t now_us) {
    uint32_t now_s = (uint32_t)(now_us / 1000000);
    uint32_t passed_s = now_s - budget->passed_s;
    if (passed_s == 0)
        return;
    budget->passed_s = now_s;
    for (unsigned i = 0; i < LOADER_EXPENSES; i++) {
        uint32_t *debt_s = &budget->debt_s[i];
        *debt_s -= passed_s < *debt_s ? passed_s : *debt_s;
    }
    budget->crc = sum(budget);
}

bool loader_budget_has(const struct loader_budget *budget,
                       enum loader_expense what) {
    return budget->debt_s[what] <=
           (limits[what].at_once - 1) * limits[what].period_s;
}

bool loader_budget_take(struct loader_budget *budget,
                        enum loader_expense what) {
    if (!loader_budget_has(budget, what))
        return false;
    budget->debt_s[what] += limits[what].period_s;
    budget->crc = sum(budget);
    return true;
}

/* --- records -------------------------------------------------------------- */

enum {
    SECTORS = 2,
    AT_BODY = 8,
    TRIES = 4 /* records, where some cannot be written */
};

/* What a sector holds. */
struct sector {
    uint32_t largest; /* 0: no record */
    uint32_t at;      /* bytes to that one */
    uint32_t torn;    /* records behind that one which are none */
    uint32_t end;     /* bytes up to the first that was never written */
};

/* Of a record whose body is there. */
static void seal(const struct loader_records *records, uint8_t *record,
                 uint32_t number) {
    uint32_t size = records->bytes - 4;
    bytes_put32(record, records->mark);
    bytes_put32(record + 4, number);
    bytes_put32(record + size, frame_crc32c(0, record, size));
}

/* 0: it is none. */
static uint32_t number_of(const struct loader_records *records,
                          const uint8_t *record) {
    uint8_t whole[LOADER_RECORD_MAX];
    memcpy(whole, record, records->bytes);
    seal(records, whole, bytes_get32(record + 4));
    return memcmp(record, whole, records->bytes) == 0 ? bytes_get32(record + 4)
                                                      : 0;
}

static bool erased(const uint8_t *record, uint32_t bytes) {
    for (uint32_t i = 0; i < bytes; i++)
        if (record[i] != 0xff)
            return false;
    return true;
}

static uint32_t begin_of(const struct loader_records *records,
                         unsigned sector) {
    return (records->first + sector) * records->flash->sector_bytes;
}

static struct sector look(const struct loader_records *records,
                          unsigned sector) {
    const struct loader_flash *flash = records->flash;
    struct sector found = {0, 0, 0, 0};
    uint8_t record[LOADER_RECORD_MAX];
    uint32_t apart = loader_flash_apart(flash, records->bytes);
    for (uint32_t at = 0; at < flash->sector_bytes; at += apart) {
        flash->read(flash->context, begin_of(records, sector) + at, record,
                    records->bytes);
        if (erased(record, records->bytes))
            continue;
        uint32_t number = number_of(records, record);
        found.end = at + apart;
        found.torn++;
        if (number > found.largest) {
            found.largest = number;
            found.at = at;
            found.torn = 0;
        }
    }
    return found;
}

/* The body of the newest, and its number; 0: there is none. */
static uint32_t loader_records_newest(const struct loader_records *records,
                                      void *body) {
    struct sector found[SECTORS] = {look(records, 0), look(records, 1)};
    const struct loader_flash *flash = records->flash;
    unsigned last = found[1].largest > found[0].largest;
    if (found[last].largest > 0) {
        flash->read(flash->context,
                    begin_of(records, last) + found[last].at + AT_BODY, body,
                    records->bytes - LOADER_RECORD_OWN);
    }
    return found[last].largest;
}

/* Whether the flash holds it afterwards. */
static bool put(const struct loader_records *records, uint32_t at,
                const void *body, uint32_t number) {
    const struct loader_flash *flash = records->flash;
    uint8_t record[LOADER_RECORD_MAX], read[LOADER_RECORD_MAX];
    memcpy(record + AT_BODY, body, records->bytes - LOADER_RECORD_OWN);
    seal(records, record, number);
    bool taken = flash->program(flash->context, at, record, records->bytes);
    flash->read(flash->context, at, read, records->bytes);
    return taken && memcmp(record, read, records->bytes) == 0;
}

/* The sector that was not the last to be written is erased before it is, so
 * that what an interrupted erasure has left there does not matter. */
static bool loader_records_append(const struct loader_records *records,
                                  const void *body, uint32_t *number) {
    const struct loader_flash *flash = records->flash;
    INCODE_ASSERT(records->bytes <= LOADER_RECORD_MAX &&
                  flash->page_bytes % records->bytes == 0);
    struct sector found[SECTORS] = {look(records, 0), look(records, 1)};
    unsigned last = found[1].largest > found[0].largest;
    uint32_t next = found[last].largest + found[last].torn;
    uint32_t end = found[last].end;
    if (found[last].largest == 0) { /* the first of all */
        last = 1;
        next = 0;
        end = flash->sector_bytes;
    }
    for (unsigned i = 0; i < TRIES; i++) {
        if (end == flash->sector_bytes) {
            last = 1 - last;
            end = 0;
            if (!flash->erase(flash->context, records->first + last))
                return false;
        }
        next++;
        if (put(records, begin_of(records, last) + end, body, next)) {
            *number = next;
            return true;
        }
        end += loader_flash_apart(flash, records->bytes);
    }
    return false;
}

/* --- boots ---------------------------------------------------------------- */

enum { MARK = 0x31544f42 /* "BOT1" */ };

bool loader_boots_next(const struct loader_flash *flash, uint32_t *boot) {
    static const uint8_t body[LOADER_BOOT_BYTES - LOADER_RECORD_OWN];
    const struct loader_records records = {flash, 0, MARK, LOADER_BOOT_BYTES};
    return loader_records_append(&records, body, boot);
}
