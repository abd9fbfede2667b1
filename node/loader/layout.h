/* Where things are in a board's flash, whatever its sectors and pages: see
 * slots.h.
 *
 * Memory: the struct.  Work: constant; the helpers' is the flash's.
 *
 *     struct loader_layout layout = loader_layout(flash);
 *     uint32_t at = loader_slot_at(&layout, flash, 1);
 *     if (!loader_flash_put(flash, at, bytes, sizeof bytes))
 *         return -1; // the flash does not hold it
 */
#ifndef NODE_LOADER_LAYOUT_H
#define NODE_LOADER_LAYOUT_H

#include "flash.h"

enum {
    LOADER_STATE_SECTOR = 2, /* and the next */
    LOADER_SERIAL_SECTOR = 4,
    LOADER_MARK_BYTES = 4 /* of a block, in a journal */
};

struct loader_layout {
    uint32_t first;   /* sector of slot 0 */
    uint32_t sectors; /* of a slot, its journal included */
    uint32_t journal; /* sectors of that */
    uint32_t bytes;   /* of an image at most, its header included; 0: the flash
                         is too small for two slots */
};

struct loader_layout loader_layout(const struct loader_flash *flash);

/* Bytes from the flash's beginning to a slot, and to its journal. */
uint32_t loader_slot_at(const struct loader_layout *layout,
                        const struct loader_flash *flash, unsigned slot);
uint32_t loader_journal_at(const struct loader_layout *layout,
                           const struct loader_flash *flash, unsigned slot);

/* From the journal's beginning to the first mark, and from one to the next. */
uint32_t loader_marks_in(const struct loader_flash *flash);
uint32_t loader_mark_apart(const struct loader_flash *flash);

/* Programs bytes page by page.  False: the flash does not hold them then. */
bool loader_flash_put(const struct loader_flash *flash, uint32_t at,
                      const void *bytes, uint32_t size);

/* Whether the flash holds these bytes; whether it would hold them without an
 * erasure; and whether it holds 0xff alone. */
bool loader_flash_holds(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size);
bool loader_flash_takes(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size);
bool loader_flash_blank(const struct loader_flash *flash, uint32_t at,
                        uint32_t size);

/* The sector in which these bytes begin. */
bool loader_flash_clear(const struct loader_flash *flash, uint32_t at);

#endif
