/* A flash on a memory card, or any device of blocks of 512 bytes: in a
 * partition of type DA, which no system takes for files.  The card erases
 * nothing and programs nothing: a block is written as a whole, and may hold
 * anything where power is lost meanwhile, which the flash's torn_bytes says.
 *
 * Memory: the struct, with one block.  Work: a read or a write of the device
 * for each block; an erasure looks at a sector's blocks, and writes those that
 * are not erased.
 *
 *     struct loader_card card = {&device, read_block, write_block, 0, 0, {0}};
 *     const struct loader_flash on_card = LOADER_CARD(&card);
 *     if (!loader_boots_next(&on_card, &boot))
 *         return -1; // no card, or none with such a partition
 */
#ifndef NODE_LOADER_FLASH_CARD_H
#define NODE_LOADER_FLASH_CARD_H

#include "flash.h"

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

/* Finds the first partition that is large enough.  The flash does, where it was
 * not found so far. */
bool loader_card_open(struct loader_card *card);

/* A new card: its table, with that partition alone.  The device has
 * LOADER_CARD_FIRST + LOADER_CARD_BLOCKS blocks at least. */
bool loader_card_format(struct loader_card *card);

/* Of a card without one, all bytes are 0xff and nothing is taken. */
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

#endif
