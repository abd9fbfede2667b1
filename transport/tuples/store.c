#include "store.h"

#include <string.h>

#include "transport/check.h"
#include "tuple.h"

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
    for (uint32_t at = 0; at < store->used; at = behind(store, at)) {
        if (tuples_store_at(store, at)->holder == TUPLES_UNHELD &&
            tuple_matches(pattern, tuples_store_tuple(store, at))) {
            return at;
        }
    }
    return TUPLES_NOWHERE;
}

bool tuples_store_is_held(const struct tuples_store *store,
                          const uint8_t *pattern) {
    for (uint32_t at = 0; at < store->used; at = behind(store, at)) {
        if (tuples_store_at(store, at)->holder != TUPLES_UNHELD &&
            tuple_matches(pattern, tuples_store_tuple(store, at))) {
            return true;
        }
    }
    return false;
}

uint32_t tuples_store_held_by(const struct tuples_store *store, uint32_t row) {
    for (uint32_t at = 0; at < store->used; at = behind(store, at)) {
        if (tuples_store_at(store, at)->holder == row) {
            return at;
        }
    }
    return TUPLES_NOWHERE;
}

void tuples_store_drop(struct tuples_store *store, uint32_t at) {
    uint32_t next = behind(store, at);
    memmove(store->bytes + at, store->bytes + next, store->used - next);
    store->used -= next - at;
    store->count--;
}
