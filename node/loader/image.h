/* A board's program as a file, and byte for byte in a slot of its flash: a
 * header of one page, which describes and signs the image, and the code after
 * it.
 *
 * | offset | bytes | field |
 * |---|---|---|
 * | 0 | 8 | "incodeI1" |
 * | 8 | 4 | bytes of code behind the header |
 * | 12 | 4 | address that it is linked for, and copied to |
 * | 16 | 4 | number, as its signer counts; a later one is larger |
 * | 20 | 4 | flags: 1, a board that has run it takes none with a lower number |
 * | 24 | 16 | board, padded with zeros |
 * | 40 | 24 | version, for people, padded with zeros |
 * | 64 | 32 | digest: BLAKE2b-256 of bytes 0 .. 63 and the code |
 * | 96 | 32 | public key of its signer; zeros: it is not signed |
 * | 128 | 64 | Ed25519 signature of bytes 0 .. 127 |
 * | 192 | 60 | zeros, or it is no header: no signature covers them |
 * | 252 | 4 | CRC-32C of bytes 0 .. 251 | */
#ifndef NODE_LOADER_IMAGE_H
#define NODE_LOADER_IMAGE_H

#include "transport/sign_suite.h"
#include "node/message.h"

enum {
    LOADER_HEADER_BYTES = 256,
    LOADER_NAMED_BYTES = 64,   /* of the header, that the digest covers */
    LOADER_SIGNED_BYTES = 128, /* and the signature */
    LOADER_BOARD_BYTES = 16,
    LOADER_VERSION_BYTES = 24,
    LOADER_NO_WAY_BACK = 1 /* the flag */
};

/* Why an image is not taken, or not started. */
enum loader_fault {
    LOADER_GOOD,
    LOADER_NO_IMAGE,  /* no header, or a damaged one */
    LOADER_TOO_LARGE, /* for a slot, or for where it is to run */
    LOADER_WRONG_BOARD,
    LOADER_WRONG_ADDRESS,
    LOADER_TOO_OLD, /* its number, where there is no way back */
    LOADER_UNSIGNED,
    LOADER_WRONG_KEY, /* signed with another key */
    LOADER_WRONG_SIGNATURE,
    LOADER_WRONG_DIGEST, /* the code is not what was signed */
    LOADER_WORN,         /* the flash does not hold what it was given */
    LOADER_TOO_OFTEN,    /* too many transfers, or false ones: slots.h */
    LOADER_FAULTS
};

struct loader_image {
    uint32_t bytes, address, number, flags;
    char board[LOADER_BOARD_BYTES + 1];
    char version[LOADER_VERSION_BYTES + 1];
    uint8_t digest[SIGN_DIGEST_BYTES];
    uint8_t key[SIGN_PUBLIC_BYTES];
    uint8_t signature[SIGN_BYTES];
};

/* LOADER_NO_IMAGE: the bytes are not the header of an image with code. */
enum loader_fault loader_image_unpack(struct loader_image *image,
                                      const uint8_t bytes[LOADER_HEADER_BYTES]);
void loader_image_pack(const struct loader_image *image,
                       uint8_t bytes[LOADER_HEADER_BYTES]);

/* LOADER_UNSIGNED, LOADER_WRONG_KEY, LOADER_WRONG_SIGNATURE, or LOADER_GOOD. */
enum loader_fault loader_image_signed(const uint8_t bytes[LOADER_HEADER_BYTES],
                                      const struct sign_suite *suite,
                                      const uint8_t key[SIGN_PUBLIC_BYTES]);

/* "it is signed with another key", for a message; NULL: LOADER_GOOD. */
const char *loader_fault_text(enum loader_fault fault);

/* The messages by which the host brings an image to all boards at once.  BEGIN
 * and the BLOCKs go to all nodes along the cube's tree; a node that does not
 * need them ignores them.  A loader that is busy with its flash leaves messages
 * unread, which holds back the links behind it, and so the host.  Then the host
 * asks each loader which blocks it lacks, and sends these again.  A repeated
 * message changes nothing. */

enum {
    LOADER_BLOCK_BYTES = 1536, /* of an image, the last may have fewer; a whole
                                  number of a flash's pages */
    LOADER_BLOCKS_MAX = 2048,  /* of an image */
    LOADER_IMAGE_MAX = LOADER_BLOCKS_MAX * LOADER_BLOCK_BYTES, /* its bytes */
    LOADER_MAP_BYTES = LOADER_BLOCKS_MAX / 8
};

/* To all: announces an image.  It has the header with which block 0 begins.  A
 * board that the image is for, and that does not have it, prepares a slot, or
 * continues with a slot that has parts of the same image. */
struct loader_begin_message {
    uint32_t transfer; /* of this session of the host: any number but 0 */
    uint32_t bytes;    /* of the image, its header included */
    uint8_t nodes[CUBE_NODES_MAX / 8]; /* addressed nodes: node i in bit i % 8
                                          of byte i / 8 */
    uint8_t header[LOADER_HEADER_BYTES];
};

/* To all, or to one.  The bytes follow. */
struct loader_block_message {
    uint32_t transfer;
    uint32_t block; /* its number, from 0 */
    uint32_t crc;   /* CRC-32C of its bytes */
};

/* To all, or to one: requests NODE_IMAGE_STATE.  A loader also sends it without
 * a request when all blocks have arrived or are verified, or when it refuses
 * the image. */
struct loader_ask_message {
    uint32_t transfer;
};

enum loader_order {
    LOADER_VERIFY = 1, /* what has come whole: digest and signature */
    LOADER_BOOT,       /* restart, and start the newest good image */
    LOADER_NAME        /* takes `serial` for its number, if it has none; only
                          within a transfer whose signature was verified */
};

/* To one board, or to all boards in that transfer. */
struct loader_do_message {
    uint32_t transfer; /* 0: whatever it is in */
    uint32_t what;     /* enum loader_order */
    uint8_t serial[NODE_SERIAL_BYTES];
};

enum loader_phase {
    LOADER_WAITS = 1, /* in no transfer */
    LOADER_THERE,     /* the image is the one that it has already */
    LOADER_TAKES,     /* blocks */
    LOADER_WHOLE,     /* all blocks are in the flash */
    LOADER_VERIFIED,  /* the next start will be of this image */
    LOADER_REFUSES    /* `fault` says why */
};

struct loader_state_message {
    uint32_t transfer;
    uint32_t phase;                /* enum loader_phase */
    uint32_t fault;                /* enum loader_fault */
    uint32_t blocks, held;         /* of the image, and that it has */
    uint32_t erased, programmed;   /* sectors and pages, since its start */
    uint32_t reserved;             /* 0 */
    uint8_t map[LOADER_MAP_BYTES]; /* block i: bit i % 8 of byte i / 8 */
};

/* The bytes of it that are sent: only the used part of the map, because the
 * answers of many boards go over one wire. */
static inline uint32_t
loader_state_bytes(const struct loader_state_message *state) {
    uint32_t map = state->phase == LOADER_TAKES ? (state->blocks + 7) / 8 : 0;
    return (uint32_t)sizeof *state - LOADER_MAP_BYTES + map;
}

static_assert(sizeof(struct loader_begin_message) ==
                  8 + CUBE_NODES_MAX / 8 + LOADER_HEADER_BYTES,
              "begin layout");
static_assert(sizeof(struct loader_block_message) + LOADER_BLOCK_BYTES <=
                  CUBE_PAYLOAD_MAX,
              "a block fits a message");
static_assert(sizeof(struct loader_state_message) == 32 + LOADER_MAP_BYTES,
              "state layout");

#endif
