/* A place's tuples: records one behind the other in the order in which they
 * came, so that what is found first is the oldest, and what is free is in one
 * piece.  A record may be held for a request: nobody else gets it until that is
 * decided.
 *
 * Memory: the caller's bytes; a record is named by its offset, until one before
 * it is dropped.  Work: a pass over the records; dropping one moves those
 * behind it.
 *
 *     uint32_t at = tuples_store_add(&store, age, bytes, size);
 *     at = tuples_store_find(&store, wanted);
 *     if (at != TUPLES_NOWHERE) tuples_store_drop(&store, at);
 */
#ifndef TRANSPORT_TUPLES_STORE_H
#define TRANSPORT_TUPLES_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define TUPLES_NOWHERE UINT32_MAX
#define TUPLES_UNHELD UINT32_MAX

struct tuples_record {
    uint32_t age;
    uint32_t holder; /* a request, or TUPLES_UNHELD */
    uint32_t size;   /* of the bytes that follow, and are filled up to 4 */
};

struct tuples_store {
    uint8_t *bytes; /* aligned to 4 */
    uint32_t room, used, count;
};

/* Bytes of a store that such a tuple takes. */
uint32_t tuples_store_needed(size_t size);

/* Adds one for which there is room; its offset. */
uint32_t tuples_store_add(struct tuples_store *store, uint32_t age,
                          const uint8_t *tuple, size_t size);

struct tuples_record *tuples_store_at(const struct tuples_store *store,
                                      uint32_t at);
const uint8_t *tuples_store_tuple(const struct tuples_store *store,
                                  uint32_t at);

/* The first that matches and that nobody holds. */
uint32_t tuples_store_find(const struct tuples_store *store,
                           const uint8_t *pattern);

/* Whether one that matches is held for somebody. */
bool tuples_store_is_held(const struct tuples_store *store,
                          const uint8_t *pattern);

/* That which a request holds. */
uint32_t tuples_store_held_by(const struct tuples_store *store, uint32_t row);

void tuples_store_drop(struct tuples_store *store, uint32_t at);

#endif
