#include "layout.h"

#include <assert.h>
#include <string.h>

#include "messages.h"
#include "slots.h"

enum {
    LARGE = 64, /* sectors, from which slots begin at */
    LARGE_FIRST = 16,
    SMALL_FIRST = 5,
    SLOT_BYTES_MAX = 1 << 20,
    PIECE = 64 /* bytes that are compared at a time */
};

static_assert(SLOT_BYTES_MAX / LOADER_BLOCK_BYTES < LOADER_BLOCKS_MAX,
              "a slot's blocks fit a map");

uint32_t loader_marks_in(const struct loader_flash *flash) {
    return flash->page_bytes > LOADER_HEADER_BYTES ? flash->page_bytes
                                                   : LOADER_HEADER_BYTES;
}

uint32_t loader_mark_apart(const struct loader_flash *flash) {
    return loader_flash_apart(flash, LOADER_MARK_BYTES);
}

struct loader_layout loader_layout(const struct loader_flash *flash) {
    struct loader_layout layout;
    memset(&layout, 0, sizeof layout);
    layout.first = flash->sectors >= LARGE ? LARGE_FIRST : SMALL_FIRST;
    if (flash->sectors <= layout.first) {
        return layout;
    }
    uint32_t most = SLOT_BYTES_MAX / flash->sector_bytes;
    layout.sectors = (flash->sectors - layout.first) / LOADER_SLOTS;
    layout.sectors = layout.sectors < most ? layout.sectors : most;
    uint32_t blocks = layout.sectors * flash->sector_bytes / LOADER_BLOCK_BYTES;
    uint32_t marks =
        loader_marks_in(flash) + loader_mark_apart(flash) * (blocks + 1);
    layout.journal = (marks + flash->sector_bytes - 1) / flash->sector_bytes;
    if (layout.sectors > layout.journal) {
        layout.bytes = (layout.sectors - layout.journal) * flash->sector_bytes;
    }
    return layout;
}

uint32_t loader_slot_at(const struct loader_layout *layout,
                        const struct loader_flash *flash, unsigned slot) {
    return (layout->first + slot * layout->sectors) * flash->sector_bytes;
}

uint32_t loader_journal_at(const struct loader_layout *layout,
                           const struct loader_flash *flash, unsigned slot) {
    return loader_slot_at(layout, flash, slot) +
           (layout->sectors - layout->journal) * flash->sector_bytes;
}

bool loader_flash_put(const struct loader_flash *flash, uint32_t at,
                      const void *bytes, uint32_t size) {
    const uint8_t *in = bytes;
    bool taken = true;
    for (uint32_t done = 0; done < size;) {
        uint32_t left = flash->page_bytes - (at + done) % flash->page_bytes;
        uint32_t part = left < size - done ? left : size - done;
        taken =
            flash->program(flash->context, at + done, in + done, part) && taken;
        done += part;
    }
    return taken && loader_flash_holds(flash, at, bytes, size);
}

/* bytes NULL: 0xff all; takes: bits that are set in the flash may differ. */
static bool compare(const struct loader_flash *flash, uint32_t at,
                    const uint8_t *bytes, uint32_t size, bool takes) {
    uint8_t piece[PIECE];
    for (uint32_t done = 0; done < size; done += PIECE) {
        uint32_t part = size - done < PIECE ? size - done : PIECE;
        flash->read(flash->context, at + done, piece, part);
        for (uint32_t i = 0; i < part; i++) {
            uint8_t wanted = bytes == NULL ? 0xff : bytes[done + i];
            if ((takes ? piece[i] & wanted : piece[i]) != wanted) {
                return false;
            }
        }
    }
    return true;
}

bool loader_flash_holds(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size) {
    return compare(flash, at, bytes, size, false);
}

bool loader_flash_takes(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size) {
    return compare(flash, at, bytes, size, true);
}

bool loader_flash_blank(const struct loader_flash *flash, uint32_t at,
                        uint32_t size) {
    return compare(flash, at, NULL, size, false);
}

bool loader_flash_clear(const struct loader_flash *flash, uint32_t at) {
    return flash->erase(flash->context, at / flash->sector_bytes);
}
