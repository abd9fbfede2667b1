#include "flash_ram.h"

/* Byte by byte, and not optimized away: it may be no memory of the compiler's
 * kind, and must be written before power is lost. */
void loader_ram_read(void *context, uint32_t at, void *bytes, size_t size) {
    const volatile uint8_t *memory = context;
    uint8_t *out = bytes;
    for (size_t i = 0; i < size; i++) {
        bool there = at + i < LOADER_RAM_SECTORS * LOADER_RAM_SECTOR;
        out[i] = there ? memory[at + i] : 0xff;
    }
}

bool loader_ram_program(void *context, uint32_t at, const void *bytes,
                        size_t size) {
    volatile uint8_t *memory = context;
    const uint8_t *in = bytes;
    bool good = true;
    if (size > LOADER_RAM_PAGE - at % LOADER_RAM_PAGE ||
        at >= LOADER_RAM_SECTORS * LOADER_RAM_SECTOR) {
        return false;
    }
    for (size_t i = 0; i < size; i++) {
        memory[at + i] = (uint8_t)(memory[at + i] & in[i]);
        good = memory[at + i] == in[i] && good;
    }
    return good;
}

bool loader_ram_erase(void *context, uint32_t sector) {
    volatile uint8_t *memory = context;
    if (sector >= LOADER_RAM_SECTORS) {
        return false;
    }
    for (size_t i = 0; i < LOADER_RAM_SECTOR; i++) {
        memory[sector * LOADER_RAM_SECTOR + i] = 0xff;
    }
    return true;
}
