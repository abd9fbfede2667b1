/* What a loader tells the image that it starts: in memory that neither clears,
 * at a place and in a layout on which they agree, of whatever version they are.
 */
#ifndef BOARDS_BARE_HANDOVER_H
#define BOARDS_BARE_HANDOVER_H

#include <stdbool.h>
#include <stdint.h>

#include "node/message.h"

struct bare_handover {
    uint32_t magic;
    uint32_t boot;   /* number of this start, */
    uint32_t reason; /* and why it is, enum bare_reason_kind */
    uint32_t slot;   /* of the image, in which it confirms that it works */
    uint32_t number; /* of the image, as its signer counts */
    uint8_t digest[NODE_DIGEST_BYTES];
    uint8_t serial[NODE_SERIAL_BYTES];
    uint8_t loader[NODE_VERSION_BYTES]; /* its version */
    uint8_t reserved[168];              /* 0 */
    uint32_t crc;
};

void bare_handover_give(const struct bare_handover *handover);

/* False: no loader has started this program.  Once a start. */
bool bare_handover_take(struct bare_handover *handover);

/* At the loader's start: whether the last one was of an image; it is forgotten.
 */
bool bare_handover_drop(void);

/* Why a board was restarted, as it was known before: kept in memory that a
 * restart leaves alone, and a loss of power does not.  A loader and the images
 * that it starts agree on its layout and place, of whatever version they are.
 */

enum bare_reason_kind {
    BARE_POWER_ON,
    BARE_OUTSIDE, /* somebody else has reset it: a button, a debugger */
    BARE_RUN_OVER,
    BARE_FAULT,
    BARE_HUNG,  /* the guard has */
    BARE_ASKED, /* the host has asked for it, */
    BARE_STAY,  /* and that the loader start no image */
    BARE_BOOT   /* the loader has: it starts an image */
};

enum { BARE_REASON_TEXT = 192 };

struct bare_reason {
    uint32_t magic;
    uint32_t kind;               /* enum bare_reason_kind */
    uint32_t starts;             /* since power on, this one included */
    uint32_t faults;             /* since power on, and times it hung */
    char text[BARE_REASON_TEXT]; /* of the last of those; empty: none */
    uint32_t crc;
};

/* For a start: the reason of this one.  From now on it would be BARE_OUTSIDE.
 */
struct bare_reason bare_reason_take(void);

/* For a program that a loader has started, which has taken it; a kind that only
 * a later loader knows is BARE_OUTSIDE. */
struct bare_reason bare_reason_taken(enum bare_reason_kind kind);

/* Before a restart; text: of a fault, or NULL. */
void bare_reason_keep(enum bare_reason_kind kind, const char *text);

const char *bare_reason_name(enum bare_reason_kind kind);

#endif
