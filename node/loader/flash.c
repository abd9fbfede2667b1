#include "flash.h"

#include <string.h>

#include "transport/bytes.h"

enum {
    BLOCK = LOADER_CARD_BLOCK,
    SECTOR_BLOCKS = LOADER_CARD_SECTOR / BLOCK,
    BYTES = LOADER_CARD_SECTORS * LOADER_CARD_SECTOR
};

/* --- the table: the card's first block ------------------------------------ */

enum {
    PARTITIONS = 4,
    AT_PARTITION = 446,
    PARTITION_BYTES = 16,
    /* of a partition, */
    AT_TYPE = 4,
    AT_FIRST = 8,
    AT_BLOCKS = 12,
    /* and of the table */
    AT_MARK = 510
};
static const uint8_t mark[] = {0x55, 0xaa};

bool loader_card_open(struct loader_card *card) {
    card->first = card->held = 0;
    if (!card->read(card->device, 0, card->bytes) ||
        memcmp(card->bytes + AT_MARK, mark, sizeof mark) != 0)
        return false;
    for (unsigned i = 0; i < PARTITIONS && card->first == 0; i++) {
        const uint8_t *entry =
            card->bytes + AT_PARTITION + (size_t)i * PARTITION_BYTES;
        uint32_t first = bytes_get32(entry + AT_FIRST);
        if (entry[AT_TYPE] == LOADER_CARD_TYPE &&
            bytes_get32(entry + AT_BLOCKS) >= LOADER_CARD_BLOCKS &&
            first <= UINT32_MAX - LOADER_CARD_BLOCKS)
            card->first = first;
    }
    return card->first != 0;
}

bool loader_card_format(struct loader_card *card) {
    uint8_t *entry = card->bytes + AT_PARTITION;
    memset(card->bytes, 0, BLOCK);
    entry[AT_TYPE] = LOADER_CARD_TYPE;
    bytes_put32(entry + AT_FIRST, LOADER_CARD_FIRST);
    bytes_put32(entry + AT_BLOCKS, LOADER_CARD_BLOCKS);
    memcpy(card->bytes + AT_MARK, mark, sizeof mark);
    return card->write(card->device, 0, card->bytes) && loader_card_open(card);
}

/* --- blocks of the partition ---------------------------------------------- */

/* Into card->bytes. */
static bool fetch(struct loader_card *card, uint32_t number) {
    if (card->first == 0 && !loader_card_open(card))
        return false;
    uint32_t block = card->first + number;
    if (card->held != block) {
        card->held = 0;
        if (!card->read(card->device, block, card->bytes))
            return false;
        card->held = block;
    }
    return true;
}

/* And back.  What the card has taken is read again, from the card. */
static bool store(struct loader_card *card, uint32_t number) {
    card->held = 0;
    return card->write(card->device, card->first + number, card->bytes);
}

void loader_card_read(void *context, uint32_t at, void *bytes, size_t size) {
    struct loader_card *card = context;
    uint8_t *out = bytes;
    for (size_t done = 0; done < size;) {
        uint32_t within = (at + (uint32_t)done) % BLOCK;
        size_t part =
            size - done < BLOCK - within ? size - done : BLOCK - within;
        if (at + done < BYTES && fetch(card, (at + (uint32_t)done) / BLOCK))
            memcpy(out + done, card->bytes + within, part);
        else
            memset(out + done, 0xff, part);
        done += part;
    }
}

/* Bits that are cleared stay so: what would need them set is refused, although
 * the card could. */
bool loader_card_program(void *context, uint32_t at, const void *bytes,
                         size_t size) {
    struct loader_card *card = context;
    const uint8_t *in = bytes;
    uint32_t within = at % BLOCK;
    if (at >= BYTES || size > BLOCK - within || !fetch(card, at / BLOCK))
        return false;
    for (size_t i = 0; i < size; i++)
        if ((card->bytes[within + i] & in[i]) != in[i])
            return false;
    memcpy(card->bytes + within, in, size);
    return store(card, at / BLOCK);
}

static bool erased(const uint8_t *bytes) {
    for (unsigned i = 0; i < BLOCK; i++)
        if (bytes[i] != 0xff)
            return false;
    return true;
}

/* A block that cannot be read may be one that was being written as power was
 * lost. */
bool loader_card_erase(void *context, uint32_t sector) {
    struct loader_card *card = context;
    if (sector >= LOADER_CARD_SECTORS ||
        (card->first == 0 && !loader_card_open(card)))
        return false;
    for (uint32_t i = 0; i < SECTOR_BLOCKS; i++) {
        uint32_t number = sector * SECTOR_BLOCKS + i;
        if (fetch(card, number) && erased(card->bytes))
            continue;
        memset(card->bytes, 0xff, BLOCK);
        if (!store(card, number))
            return false;
    }
    return true;
}

/* --- in memory ------------------------------------------------------------ */

bool loader_card_fetch(void *memory, uint32_t block, uint8_t *bytes) {
    memcpy(bytes, (const uint8_t *)memory + (size_t)block * BLOCK, BLOCK);
    return true;
}

bool loader_card_store(void *memory, uint32_t block, const uint8_t *bytes) {
    memcpy((uint8_t *)memory + (size_t)block * BLOCK, bytes, BLOCK);
    return true;
}

/* --- flash ram ------------------------------------------------------------ */

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
        at >= LOADER_RAM_SECTORS * LOADER_RAM_SECTOR)
        return false;
    for (size_t i = 0; i < size; i++) {
        memory[at + i] = (uint8_t)(memory[at + i] & in[i]);
        good = memory[at + i] == in[i] && good;
    }
    return good;
}

bool loader_ram_erase(void *context, uint32_t sector) {
    volatile uint8_t *memory = context;
    if (sector >= LOADER_RAM_SECTORS)
        return false;
    for (size_t i = 0; i < LOADER_RAM_SECTOR; i++)
        memory[sector * LOADER_RAM_SECTOR + i] = 0xff;
    return true;
}
