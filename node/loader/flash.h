/* A flash chip and its rules: a sector is erased to 0xFF as a whole, a page is
 * programmed by clearing bits, and what is cleared stays so until the sector is
 * erased.  Bytes are counted from the flash's beginning. */
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
    /* A power of two, at most a page.  If power is lost while bytes are
     * programmed, all bytes between two multiples of this may be lost with
     * them.  0: only those bytes. */
    uint32_t torn_bytes;
    const char *worn; /* why it may take nothing any more, for its user */
};

/* The distance between items of so many bytes, so that a loss of power destroys
 * only one. */
static inline uint32_t loader_flash_apart(const struct loader_flash *flash,
                                          uint32_t bytes) {
    return bytes > flash->torn_bytes ? bytes : flash->torn_bytes;
}

/* A flash on a memory card, or any device of blocks of 512 bytes: in a
 * partition of type DA, which no system takes for files.  A card writes a block
 * as a whole.  If power is lost meanwhile, the block may hold anything; so the
 * flash's torn_bytes is a block. */

enum {
    LOADER_CARD_BLOCK = 512,
    LOADER_CARD_SECTOR = 4096,
    LOADER_CARD_SECTORS = 1024,
    LOADER_CARD_TYPE = 0xDA,
    /* Where loader_card_format puts the partition, and its size, in blocks. */
    LOADER_CARD_FIRST = 2048,
    LOADER_CARD_BLOCKS =
        LOADER_CARD_SECTORS * (LOADER_CARD_SECTOR / LOADER_CARD_BLOCK)
};

struct loader_card {
    void *device;
    /* False: the device does not do it. */
    bool (*read)(void *device, uint32_t block, uint8_t *bytes);
    bool (*write)(void *device, uint32_t block, const uint8_t *bytes);
    uint32_t first; /* block of the partition; 0: not found so far */
    uint32_t held;  /* that `bytes` has, one of the partition; 0: none */
    uint8_t bytes[LOADER_CARD_BLOCK];
};

/* Finds the first partition that is large enough.  The flash's functions call
 * this if none has been found so far. */
bool loader_card_open(struct loader_card *card);

/* A new card: its table, with that partition alone.  The device has
 * LOADER_CARD_FIRST + LOADER_CARD_BLOCKS blocks at least. */
bool loader_card_format(struct loader_card *card);

/* The flash's functions.  On a card without a partition all bytes are 0xff, and
 * programming fails. */
void loader_card_read(void *context, uint32_t at, void *bytes, size_t size);
bool loader_card_program(void *context, uint32_t at, const void *bytes,
                         size_t size);
bool loader_card_erase(void *context, uint32_t sector);

/* A card in memory, as the host has a file of one. */
bool loader_card_fetch(void *memory, uint32_t block, uint8_t *bytes);
bool loader_card_store(void *memory, uint32_t block, const uint8_t *bytes);

#define LOADER_CARD_IN(memory)                                                 \
    {                                                                          \
        .device = (memory), .read = loader_card_fetch,                         \
        .write = loader_card_store                                             \
    }

#define LOADER_CARD(card)                                                      \
    {                                                                          \
        .context = (card), .sector_bytes = LOADER_CARD_SECTOR,                 \
        .page_bytes = LOADER_CARD_BLOCK, .sectors = LOADER_CARD_SECTORS,       \
        .read = loader_card_read, .program = loader_card_program,              \
        .erase = loader_card_erase, .torn_bytes = LOADER_CARD_BLOCK,           \
        .worn = "there is no card, or it has no partition of type DA with "    \
                "4 MB, or it is worn"                                          \
    }

/* A flash in memory that keeps its bytes without power, or stands for such
 * memory.  It enforces a flash's rules, so code that works with it works with a
 * chip.
 *
 * Memory: the caller's, LOADER_RAM_SECTORS sectors. */

enum {
    LOADER_RAM_SECTOR = 4096,
    LOADER_RAM_PAGE = 256,
    LOADER_RAM_SECTORS = 1024
};

void loader_ram_read(void *context, uint32_t at, void *bytes, size_t size);
bool loader_ram_program(void *context, uint32_t at, const void *bytes,
                        size_t size);
bool loader_ram_erase(void *context, uint32_t sector);

#define LOADER_RAM(memory)                                                     \
    {                                                                          \
        .context = (memory), .sector_bytes = LOADER_RAM_SECTOR,                \
        .page_bytes = LOADER_RAM_PAGE, .sectors = LOADER_RAM_SECTORS,          \
        .read = loader_ram_read, .program = loader_ram_program,                \
        .erase = loader_ram_erase,                                             \
        .worn = "it is worn: replace it, or the board"                         \
    }

#endif
