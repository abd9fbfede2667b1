/* The arena, and the way of messages in and out. */
#include "space.h"

#include <assert.h>
#include <string.h>

#include "transport/check.h"
#include "tuples.h"
#include "transport/bytes.h"
#include "transport/cube.h"

uint32_t tuples_store_needed(size_t size) {
    return (uint32_t)(sizeof(struct tuples_record) + (size + 3) / 4 * 4);
}

struct tuples_record *tuples_store_at(const struct tuples_store *store,
                                      uint32_t at) {
    LINK_ASSERT(at < store->used && at % 4 == 0);
    return (struct tuples_record *)(void *)(store->bytes + at);
}

const uint8_t *tuples_store_tuple(const struct tuples_store *store,
                                  uint32_t at) {
    return store->bytes + at + sizeof(struct tuples_record);
}

static uint32_t behind(const struct tuples_store *store, uint32_t at) {
    return at + tuples_store_needed(tuples_store_at(store, at)->size);
}

uint32_t tuples_store_add(struct tuples_store *store, uint32_t age,
                          const uint8_t *tuple, size_t size) {
    uint32_t at = store->used, needed = tuples_store_needed(size);
    LINK_ASSERT(size > 0 && needed <= store->room - store->used);
    store->used += needed;
    store->count++;
    struct tuples_record *record = tuples_store_at(store, at);
    record->age = age;
    record->holder = TUPLES_UNHELD;
    record->size = (uint32_t)size;
    memcpy(store->bytes + at + sizeof *record, tuple, size);
    return at;
}

uint32_t tuples_store_find(const struct tuples_store *store,
                           const uint8_t *pattern) {
    for (uint32_t at = 0; at < store->used; at = behind(store, at))
        if (tuples_store_at(store, at)->holder == TUPLES_UNHELD &&
            tuple_matches(pattern, tuples_store_tuple(store, at)))
            return at;
    return TUPLES_NOWHERE;
}

bool tuples_store_is_held(const struct tuples_store *store,
                          const uint8_t *pattern) {
    for (uint32_t at = 0; at < store->used; at = behind(store, at))
        if (tuples_store_at(store, at)->holder != TUPLES_UNHELD &&
            tuple_matches(pattern, tuples_store_tuple(store, at)))
            return true;
    return false;
}

uint32_t tuples_store_held_by(const struct tuples_store *store, uint32_t row) {
    for (uint32_t at = 0; at < store->used; at = behind(store, at))
        if (tuples_store_at(store, at)->holder == row)
            return at;
    return TUPLES_NOWHERE;
}

void tuples_store_drop(struct tuples_store *store, uint32_t at) {
    uint32_t next = behind(store, at);
    memmove(store->bytes + at, store->bytes + next, store->used - next);
    store->used -= next - at;
    store->count--;
}

/* The arena, and the way of messages in and out. */

enum { ALIGNMENT = 8 };

static size_t aligned(size_t bytes) {
    return (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

static bool is_sound(const struct tuples_config *c) {
    return c->places > 0 && c->places <= TUPLES_PLACES_MAX &&
           c->self < c->places && c->operations > 0 &&
           c->operations + c->processes <= TUPLES_OPERATIONS_MAX &&
           c->tuple_bytes >= TUPLES_PATTERN_MAX &&
           c->tuple_bytes <= TUPLES_TUPLE_MAX && c->store_bytes % 4 == 0 &&
           c->store_bytes >= tuples_store_needed(c->tuple_bytes) &&
           c->store_bytes < UINT32_MAX / 2;
}

static_assert(TUPLES_HEADER_BYTES + TUPLES_TUPLE_MAX <= CUBE_PAYLOAD_MAX,
              "a tuple fits a message");

/* --- the arena ------------------------------------------------------------ */

/* Cuts the arena, or measures it where it is NULL. */
struct cut {
    uint8_t *memory;
    size_t bytes;
};

static void *piece(struct cut *cut, size_t bytes) {
    void *at = cut->memory == NULL ? NULL : cut->memory + cut->bytes;
    cut->bytes += aligned(bytes);
    return at;
}

static void lay(struct tuples *space, struct cut *cut) {
    const struct tuples_config *c = &space->config;
    unsigned each = space->each;
    space->operations = piece(cut, each * sizeof *space->operations);
    space->processes = piece(cut, c->processes * sizeof *space->processes);
    space->requests = piece(cut, space->rows * sizeof *space->requests);
    space->accounts = piece(cut, c->places * sizeof *space->accounts);
    space->replies = piece(cut, space->rows * sizeof *space->replies);
    space->store.bytes = piece(cut, c->store_bytes);
    space->store.room = c->store_bytes;
    for (unsigned i = 0; i < each; i++) {
        uint8_t *ties = piece(cut, c->places);
        uint8_t *tuple = piece(cut, c->tuple_bytes);
        if (cut->memory != NULL) {
            memset(&space->operations[i], 0, sizeof space->operations[i]);
            memset(ties, TUPLES_UNTIED, c->places);
            space->operations[i].ties = ties;
            space->operations[i].tuple = tuple;
        }
    }
    for (unsigned i = 0; i < c->processes; i++) {
        uint8_t *bytes = piece(cut, c->tuple_bytes);
        if (cut->memory != NULL)
            space->processes[i].bytes = bytes;
    }
}

static void set_config(struct tuples *space,
                       const struct tuples_config *config) {
    memset(space, 0, sizeof *space);
    space->config = *config;
    space->each = (uint32_t)config->operations + config->processes;
    space->rows = space->each * config->places;
}

size_t tuples_arena_bytes(const struct tuples_config *config) {
    struct tuples space;
    struct cut cut = {NULL, aligned(sizeof space)};
    if (!is_sound(config))
        return 0;
    set_config(&space, config);
    lay(&space, &cut);
    return cut.bytes;
}

/* Nothing is stored, asked for or run. */
static void empty(struct tuples *space, uint32_t generation) {
    space->generation = generation;
    space->clock = space->evals = 0;
    space->store.used = space->store.count = 0;
    memset(space->accounts, 0, space->config.places * sizeof *space->accounts);
    memset(space->requests, 0, space->rows * sizeof *space->requests);
    for (unsigned i = 0; i < space->config.processes; i++)
        space->processes[i].state = TUPLES_IDLE;
    space->first = space->last = TUPLES_NOBODY;
    space->waiting = space->asking_last = 0;
    space->reply_first = space->reply_count = 0;
    space->promised_bytes = space->promised_processes = 0;
}

struct tuples *tuples_init(void *arena, size_t bytes,
                           const struct tuples_config *config,
                           uint32_t generation) {
    size_t needed = tuples_arena_bytes(config);
    struct tuples *space = arena;
    struct cut cut = {arena, aligned(sizeof *space)};
    if (needed == 0 || bytes < needed)
        return NULL;
    LINK_ASSERT((uintptr_t)arena % ALIGNMENT == 0);
    set_config(space, config);
    lay(space, &cut);
    empty(space, generation);
    return space;
}

void tuples_renew(struct tuples *space, uint32_t generation) {
    tuples_operations_end(space);
    empty(space, generation);
}

/* --- messages ------------------------------------------------------------- */

static void put_header(uint8_t *p, const struct tuples_header *header) {
    p[0] = header->kind;
    p[1] = header->flags;
    bytes_put16(p + 2, header->operation);
    bytes_put32(p + 4, header->serial);
    bytes_put32(p + 8, header->generation);
    bytes_put32(p + 12, header->clock);
    bytes_put32(p + 16, header->number);
}

static void get_header(const uint8_t *p, struct tuples_header *header) {
    header->kind = p[0];
    header->flags = p[1];
    header->operation = bytes_get16(p + 2);
    header->serial = bytes_get32(p + 4);
    header->generation = bytes_get32(p + 8);
    header->clock = bytes_get32(p + 12);
    header->number = bytes_get32(p + 16);
}

static bool deliver(struct tuples *space, uint16_t source,
                    const struct tuples_header *header, const uint8_t *data,
                    size_t size) {
    return header->kind < TUPLES_OFFER
               ? tuples_request_take(space, source, header, data, size)
               : tuples_operation_take(space, source, header, data, size);
}

bool tuples_send(struct tuples *space, uint16_t place,
                 const struct tuples_header *header, const uint8_t *data,
                 size_t size) {
    const struct tuples_config *config = &space->config;
    struct tuples_header whole = *header;
    if (place == config->self) {
        LINK_ASSERT(deliver(space, place, header, data, size));
        return true;
    }
    whole.generation = space->generation;
    whole.clock = space->clock;
    put_header(space->message, &whole);
    if (size > 0)
        memcpy(space->message + TUPLES_HEADER_BYTES, data, size);
    if (config->write(config->context, place, space->message,
                      TUPLES_HEADER_BYTES + size) != 0)
        return false;
    space->statistics.messages++;
    return true;
}

bool tuples_take(struct tuples *space, uint16_t source, const uint8_t *data,
                 size_t size) {
    struct tuples_header header;
    if (size < TUPLES_HEADER_BYTES || source >= space->config.places ||
        source == space->config.self)
        return false;
    get_header(data, &header);
    if (header.generation != space->generation) {
        space->statistics.outdated++;
        return true;
    }
    if (header.kind == 0 || header.kind > TUPLES_KIND_LAST ||
        header.operation >= space->each)
        return false;
    if (header.clock > space->clock)
        space->clock = header.clock;
    return deliver(space, source, &header, data + TUPLES_HEADER_BYTES,
                   size - TUPLES_HEADER_BYTES);
}

unsigned tuples_step(struct tuples *space) {
    unsigned tries = TUPLES_STEP_MESSAGES / 2;
    unsigned moved = tuples_processes_run(space);
    moved += tuples_request_send(space, tries);
    for (unsigned i = 0; i < space->each && tries > 0; i++) {
        space->cursor = (space->cursor + 1) % space->each;
        moved += tuples_operation_send(space, &space->operations[space->cursor],
                                       &tries);
    }
    return moved;
}

uint32_t tuples_held(const struct tuples *space) {
    uint32_t held = space->store.count + space->promised_bytes +
                    space->promised_processes + space->config.processes -
                    tuples_processes_free(space);
    for (unsigned i = 0; i < space->each; i++)
        held += space->operations[i].phase != TUPLES_FREE;
    for (uint32_t row = 0; row < space->rows; row++)
        held += space->requests[row].wish != TUPLES_NO_WISH;
    return held;
}

struct tuples_account tuples_account(const struct tuples *space,
                                     uint16_t place) {
    LINK_ASSERT(place < space->config.places);
    return space->accounts[place];
}

const struct tuples_statistics *tuples_statistics(const struct tuples *space) {
    return &space->statistics;
}
