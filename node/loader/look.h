/* A look at a slot, slice by slice: whether its image may be started.
 *
 * Memory: the struct, aligned to 64.  Work: a step hashes LOADER_SLICE_BYTES of
 * the code; the first also proves the signature.
 *
 *     loader_look_begin(&look, &slots, 1);
 *     while (loader_look_step(&look, &slots))
 *         (void)0; // links are looked at
 */
#ifndef NODE_LOADER_LOOK_H
#define NODE_LOADER_LOOK_H

#include <stdalign.h>

#include "slots.h"

struct loader_look {
    alignas(64) uint8_t hash[SIGN_HASH_BYTES];
    unsigned slot;
    uint32_t code, bytes, done; /* of the code: where it is in the flash */
    uint8_t digest[SIGN_DIGEST_BYTES]; /* that it should have */
    bool begun;
};

void loader_look_begin(struct loader_look *look, struct loader_slots *slots,
                       unsigned slot);

/* False: it is over, and slots->fault of the slot says how. */
bool loader_look_step(struct loader_look *look, struct loader_slots *slots);

/* The parts of it, for an image whose header is not in the slot yet: of the
 * header's LOADER_NAMED_BYTES, then slice by slice; false: *good tells. */
void loader_look_hash(struct loader_look *look,
                      const struct loader_slots *slots,
                      const uint8_t header[LOADER_HEADER_BYTES],
                      const struct loader_image *image, unsigned slot);
bool loader_look_slice(struct loader_look *look,
                       const struct loader_slots *slots, bool *good);

/* Whether a copy of a good slot's code, in memory where it is to run, is what
 * was signed, whatever the flash gives by now; else the slot is good no more.
 */
bool loader_look_copy(struct loader_look *look, struct loader_slots *slots,
                      unsigned slot, const uint8_t *copy);

#endif
