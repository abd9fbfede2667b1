/* Why a board was restarted, as it was known before: kept in memory that a
 * restart leaves alone, and a loss of power does not.  A loader and the images
 * that it starts agree on its layout and place, of whatever version they are.
 *
 * Memory: struct bare_reason, in .noinit.  Work: a CRC over it.
 *
 *     bare_reason_keep(BARE_FAULT, "stack overflow at 0x00001f3c");
 *     board_restart();
 *     struct bare_reason reason = bare_reason_take();   // after it
 */
#ifndef BOARDS_BARE_REASON_H
#define BOARDS_BARE_REASON_H

#include <stdint.h>

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
