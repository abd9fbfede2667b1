#include "boots.h"

#include <string.h>

#include "transport/bytes.h"
#include "transport/frame.h"

enum {
    SECTORS = 2,
    MARK = 0x31544f42, /* "BOT1" */
    TRIES = 4          /* records, where some cannot be written */
};

/* What a sector holds. */
struct sector {
    uint32_t largest; /* 0: no record */
    uint32_t torn;    /* records behind that one which are none */
    uint32_t end;     /* bytes up to the first that was never written */
};

static void make(uint8_t record[BARE_BOOT_BYTES], uint32_t boot)
{
    bytes_put32(record, MARK);
    bytes_put32(record + 4, boot);
    bytes_put32(record + 8, ~boot);
    bytes_put32(record + 12, frame_crc32c(0, record, 12));
}

/* 0: it is none. */
static uint32_t boot_of(const uint8_t record[BARE_BOOT_BYTES])
{
    uint8_t whole[BARE_BOOT_BYTES];
    make(whole, bytes_get32(record + 4));
    return memcmp(record, whole, sizeof whole) == 0 ? bytes_get32(record + 4)
                                                    : 0;
}

static bool erased(const uint8_t record[BARE_BOOT_BYTES])
{
    for (unsigned i = 0; i < BARE_BOOT_BYTES; i++) {
        if (record[i] != 0xff) {
            return false;
        }
    }
    return true;
}

static struct sector look(const struct bare_flash *flash, uint32_t sector)
{
    struct sector found = {0, 0, 0};
    uint8_t record[BARE_BOOT_BYTES];
    for (uint32_t at = 0; at < flash->sector_bytes; at += BARE_BOOT_BYTES) {
        flash->read(flash->context, sector * flash->sector_bytes + at, record,
                    sizeof record);
        uint32_t boot = boot_of(record);
        if (erased(record)) {
            continue;
        }
        found.end = at + BARE_BOOT_BYTES;
        found.torn++;
        if (boot > found.largest) {
            found.largest = boot;
            found.torn = 0;
        }
    }
    return found;
}

/* Whether the flash holds it afterwards. */
static bool append(const struct bare_flash *flash, uint32_t at, uint32_t boot)
{
    uint8_t record[BARE_BOOT_BYTES], read[BARE_BOOT_BYTES];
    make(record, boot);
    bool taken = flash->program(flash->context, at, record, sizeof record);
    flash->read(flash->context, at, read, sizeof read);
    return taken && memcmp(record, read, sizeof record) == 0;
}

/* A record that was torn may be read as whole one day: its number is never
 * used.  The sector that was not the last to be written is erased before it
 * is, so that what an interrupted erasure has left there does not matter. */
bool bare_boots_next(const struct bare_flash *flash, uint32_t *boot)
{
    struct sector found[SECTORS] = {look(flash, 0), look(flash, 1)};
    unsigned last = found[1].largest > found[0].largest;
    uint32_t next = found[last].largest + found[last].torn;
    uint32_t end = found[last].end;
    if (found[last].largest == 0) { /* the first start of all */
        last = 1;
        next = 0;
        end = flash->sector_bytes;
    }
    for (unsigned i = 0; i < TRIES; i++) {
        if (end == flash->sector_bytes) {
            last = 1 - last;
            end = 0;
            if (!flash->erase(flash->context, last)) {
                return false;
            }
        }
        next++;
        if (append(flash, last * flash->sector_bytes + end, next)) {
            *boot = next;
            return true;
        }
        end += BARE_BOOT_BYTES;
    }
    return false;
}
