/* A board's program as a file, and byte for byte as a slot of its flash holds
 * it: a header of a flash's page, which says what it is and who has signed it,
 * and the code behind it.
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
 * | 252 | 4 | CRC-32C of bytes 0 .. 251 |
 *
 * Memory: the struct.  Work: a pass over the header.
 *
 *     struct loader_image image;
 *     if (loader_image_unpack(&image, bytes) != LOADER_GOOD)
 *         return -1; // no header of an image
 */
#ifndef NODE_LOADER_IMAGE_H
#define NODE_LOADER_IMAGE_H

#include "transport/sign_suite.h"

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
    LOADER_WRONG_KEY, /* signed by somebody else */
    LOADER_WRONG_SIGNATURE,
    LOADER_WRONG_DIGEST, /* the code is not what was signed */
    LOADER_WORN,         /* the flash does not hold what it was given */
    LOADER_TOO_OFTEN,    /* too many transfers, or false ones: budget.h */
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

/* LOADER_NO_IMAGE: these are not the header of one that has code. */
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

#endif
