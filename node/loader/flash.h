/* A flash chip behind its rules: a sector is erased to 0xFF as a whole, a page
 * is programmed by clearing bits, and what is cleared stays so until the sector
 * is erased.  Bytes are counted from the flash's beginning.
 *
 * Memory: the struct.  Work: the chip's; an erasure takes up to seconds.
 *
 *     if (!flash->erase(flash->context, 0) ||
 *         !flash->program(flash->context, 0, bytes, sizeof bytes))
 *         return -1; // it is worn, or not there
 */
#ifndef NODE_LOADER_FLASH_H
#define NODE_LOADER_FLASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct loader_flash {
    void *context;
    uint32_t sector_bytes, page_bytes,
        sectors; /* powers of two, the first two */
    void (*read)(void *context, uint32_t at, void *bytes, size_t size);
    /* Within a page.  False: the flash does not hold these bytes now. */
    bool (*program)(void *context, uint32_t at, const void *bytes, size_t size);
    bool (*erase)(void *context, uint32_t sector);
    /* A power of two, a page at most: a program that loses power may take with
     * it all between two multiples of this.  0: nothing but its own bytes. */
    uint32_t torn_bytes;
    const char *worn; /* why it may take nothing any more, for its user */
};

/* How far apart things of so many bytes are, of which one must not take others
 * with it. */
static inline uint32_t loader_flash_apart(const struct loader_flash *flash,
                                          uint32_t bytes) {
    return bytes > flash->torn_bytes ? bytes : flash->torn_bytes;
}

#endif
