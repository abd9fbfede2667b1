/* A flash in memory that keeps its bytes over a loss of power, or stands for
 * one that does: with a flash's rules, so that what is written for it is right
 * on a chip.
 *
 * Memory: the caller's, FLASH_RAM_SECTORS sectors.  Work: a byte's a byte.
 *
 *     const struct bare_flash flash = FLASH_RAM((void *)0x21000000);
 */
#ifndef BOARDS_BARE_FLASH_RAM_H
#define BOARDS_BARE_FLASH_RAM_H

#include "flash.h"

enum { FLASH_RAM_SECTOR = 4096, FLASH_RAM_PAGE = 256, FLASH_RAM_SECTORS = 4 };

void flash_ram_read(void *context, uint32_t at, void *bytes, size_t size);
bool flash_ram_program(void *context, uint32_t at, const void *bytes,
                       size_t size);
bool flash_ram_erase(void *context, uint32_t sector);

#define FLASH_RAM(memory)                                                      \
    {                                                                          \
        memory, FLASH_RAM_SECTOR, FLASH_RAM_PAGE, FLASH_RAM_SECTORS,           \
            flash_ram_read, flash_ram_program, flash_ram_erase                 \
    }

#endif
