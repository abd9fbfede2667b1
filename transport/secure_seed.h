/* What makes a connection's opening unlike every other under a cube's key: a
 * nonce, and the secret of its exchange.  They are drawn from a board's random
 * bytes, or, where it has none, from what never comes again: the device, the
 * number of its start, the number of the draw.  All of these are hashed under
 * the key, so that a draw is new if any of them is.  PROTOCOL.md has the bytes.
 *
 * Without random bytes whoever knows the cube's key and the device can draw the
 * same: a wire has forward secrecy if one of its ends at least has random
 * bytes, or a device that nobody else knows.
 *
 * Memory: struct secure_source.  Work: two short hashes, and the board's.
 *
 *     struct secure_source source = {.device = "board 17", .boot = boot};
 *     if (!secure_seed_draw(&source, &suite, key, &seed))
 *         return -1;
 */
#ifndef TRANSPORT_SECURE_SEED_H
#define TRANSPORT_SECURE_SEED_H

#include "secure_suite.h"

enum { SECURE_DEVICE_BYTES = 32 };

/* As a board fills it in: random, or device and boot, or all. */
struct secure_source {
    /* Fills in bytes that nobody can guess; false: it cannot.  NULL: the board
     * has no generator. */
    bool (*random)(void *context, uint8_t *bytes, size_t size);
    void *context;
    /* Unlike those of all other devices that ever have the cube's key: an
     * address, a serial number; better a secret of its own. */
    uint8_t device[SECURE_DEVICE_BYTES];
    /* Number of this start of the device, kept where a reset and a loss of
     * power leave it; raised before it is used; not 0, which says that there is
     * none. */
    uint64_t boot;
    uint64_t draws; /* since that start: 0 at first, counted here */
};

struct secure_seed {
    uint8_t nonce[SECURE_NONCE_BYTES]; /* all may know it */
    uint8_t secret[SECURE_KEY_BYTES];
};

/* False: the source has neither random bytes at present nor a number of its
 * start; *seed is all zero then, and not to be used. */
bool secure_seed_draw(struct secure_source *source,
                      const struct secure_suite *suite,
                      const uint8_t key[SECURE_KEY_BYTES],
                      struct secure_seed *seed);

#endif
