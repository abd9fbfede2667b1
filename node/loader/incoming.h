/* Takes an image into the slot that is not in use, block by block.  Power may
 * be lost at any moment: a board still starts only good images, and keeps the
 * blocks that it has.
 *
 * First the slot's header is erased.  Then the slot's journal gets the new
 * image's header.  A block is programmed and read back, and its CRC is written
 * to the journal as its mark.  After a loss of power, a block counts as held if
 * its mark is the CRC of its bytes in the flash.  A sector is erased when the
 * first block arrives that needs it.  When the digest is right, the header's
 * page is written, and then the record that the next start is of this slot.
 *
 * Nothing is erased or programmed before the header's signature has been
 * verified.  How often a slot is made ready, and how often a false signature is
 * verified, is limited (slots.h).
 *
 * Work: a step erases a sector, programs a block, checks 4 blocks, hashes a
 * slice, or verifies a signature. */
#ifndef NODE_LOADER_INCOMING_H
#define NODE_LOADER_INCOMING_H

#include <stdalign.h>

#include "slots.h"
#include "image.h"

/* Checks a slot, slice by slice: whether its image may be started. */

struct loader_look {
    alignas(64) uint8_t hash[SIGN_HASH_BYTES];
    unsigned slot;
    uint32_t code, bytes, done; /* of the code: where it is in the flash */
    uint8_t digest[SIGN_DIGEST_BYTES]; /* that it should have */
    bool begun;
};

void loader_look_begin(struct loader_look *look, struct loader_slots *slots,
                       unsigned slot);

/* False: the check is over, and slots->fault of the slot is its result. */
bool loader_look_step(struct loader_look *look, struct loader_slots *slots);

/* The same for an image whose header is not in the slot yet: begins with the
 * header's LOADER_NAMED_BYTES, then goes slice by slice.  False: the check is
 * over, and *good is its result. */
void loader_look_hash(struct loader_look *look,
                      const struct loader_slots *slots,
                      const uint8_t header[LOADER_HEADER_BYTES],
                      const struct loader_image *image, unsigned slot);
bool loader_look_slice(struct loader_look *look,
                       const struct loader_slots *slots, bool *good);

/* Whether a copy of a good slot's code, in the memory where it will run, is
 * what was signed, whatever the flash returns by now.  Otherwise the slot is
 * not good any more. */
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

/* Begins an image of `bytes` bytes in all.  These three functions may be called
 * while it is not busy; `phase` has the result when it is not busy again.  An
 * image that is being taken already continues. */
void loader_incoming_begin(struct loader_incoming *incoming,
                           const uint8_t header[LOADER_HEADER_BYTES],
                           uint32_t bytes);

/* Takes block `number`.  A block of a wrong size or CRC, or one that is held,
 * is ignored. */
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
