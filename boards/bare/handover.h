/* What a loader tells the image that it starts: in memory that neither clears,
 * at a place and in a layout on which they agree, of whatever version they are.
 *
 * Memory: struct bare_handover, in .noinit.  Work: a CRC over it.
 *
 *     bare_handover_give(&handover); // the loader,
 *     board_launch(board_facts.image_at);
 *     if (bare_handover_take(&handover)) // and the image
 *         boot = handover.boot;
 */
#ifndef BOARDS_BARE_HANDOVER_H
#define BOARDS_BARE_HANDOVER_H

#include <stdbool.h>
#include <stdint.h>

#include "node/questions.h"

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

#endif
