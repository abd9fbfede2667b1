/* An image on its way into the slot that is not in use, block by block, so that
 * power may be lost at any moment: what starts is good, and what was held is
 * still held.
 *
 * First the slot loses its header; then its journal gets the header of what is
 * coming.  A block is programmed, read back, and its CRC is put into the
 * journal as its mark: after a loss of power a block is held if its mark is the
 * CRC of what the flash holds.  A sector is erased when the first block comes
 * that needs it.  The header's page follows when the digest is right, and then
 * the record that the next start is of this slot.
 *
 * Nothing is erased or programmed before the header's signature has been
 * verified.  How often a slot is made ready, and how often a false signature is
 * verified, is limited (budget.h).
 *
 * Work: a step erases a sector, programs a block, looks at 4 blocks, hashes a
 * slice, or proves a signature. */
#ifndef NODE_LOADER_INCOMING_H
#define NODE_LOADER_INCOMING_H

#include <stdalign.h>

#include "slots.h"
#include "image.h"

/* A look at a slot, slice by slice: whether its image may be started. */

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

/* What is under way. */
enum loader_work {
    LOADER_NO_WORK,
    LOADER_PROVES,  /* the signature of what is to come, */
    LOADER_CHOOSES, /* a slot for it, */
    LOADER_READIES, /* that slot, */
    LOADER_COUNTS,  /* the blocks that it holds */
    LOADER_WRITES,  /* a block */
    LOADER_CHECKS,  /* the digest, */
    LOADER_SEALS,   /* writes header and state; */
    LOADER_DROPS    /* or what is there, as it is not what was signed */
};

struct loader_incoming {
    struct loader_look look;
    struct loader_slots *slots;
    enum loader_phase phase;
    enum loader_fault fault;
    enum loader_work work;
    uint8_t header[LOADER_HEADER_BYTES];
    struct loader_image image;
    unsigned slot;                    /* that it comes into */
    uint32_t blocks, held, inherited; /* the last: held when it began */
    uint32_t erased, programmed;      /* sectors and pages, since the start */
    uint32_t next;                    /* sector, or block, of the work */
    uint32_t failures;                /* blocks that the flash did not hold */
    uint32_t number, size, crc;       /* of the block that is being written */
    uint8_t block[LOADER_BLOCK_BYTES];
    uint8_t map[LOADER_MAP_BYTES];
};

void loader_incoming_init(struct loader_incoming *incoming,
                          struct loader_slots *slots);

/* What follows is told by `phase`, once it is not busy.  To be called while it
 * is not: bytes: of the image in all.  An image that is being taken already
 * goes on where it is. */
void loader_incoming_begin(struct loader_incoming *incoming,
                           const uint8_t header[LOADER_HEADER_BYTES],
                           uint32_t bytes);

/* Block `number`, if it is wanted: what has another size or CRC, or is held,
 * is passed over. */
void loader_incoming_block(struct loader_incoming *incoming, uint32_t number,
                           const uint8_t *bytes, uint32_t size, uint32_t crc);

/* If all blocks are held: LOADER_VERIFIED, or it is refused. */
void loader_incoming_verify(struct loader_incoming *incoming);

/* Once it is not busy: whether the signature of its image has been verified. */
static inline bool
loader_incoming_proved(const struct loader_incoming *incoming) {
    return incoming->phase >= LOADER_THERE &&
           incoming->phase <= LOADER_VERIFIED;
}

static inline bool
loader_incoming_busy(const struct loader_incoming *incoming) {
    return incoming->work != LOADER_NO_WORK;
}

void loader_incoming_step(struct loader_incoming *incoming);

#endif
