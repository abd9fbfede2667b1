/* A flash in memory that keeps its bytes over a loss of power, or stands for
 * one that does: with a flash's rules, so that what is written for it is right
 * on a chip.
 *
 * Memory: the caller's, LOADER_RAM_SECTORS sectors.  Work: a byte's a byte.
 *
 *     const struct loader_flash flash = LOADER_RAM((void *)0x21000000);
 */
#ifndef NODE_LOADER_FLASH_RAM_H
#define NODE_LOADER_FLASH_RAM_H

#include "flash.h"

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
