#include "records.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "transport/bytes.h"
#include "transport/frame.h"

enum {
    SECTORS = 2,
    AT_BODY = 8,
    TRIES = 4 /* records, where some cannot be written */
};

/* What a sector holds. */
struct sector {
    uint32_t largest; /* 0: no record */
    uint32_t at;      /* bytes to that one */
    uint32_t torn;    /* records behind that one which are none */
    uint32_t end;     /* bytes up to the first that was never written */
};

/* Of a record whose body is there. */
static void seal(const struct loader_records *records, uint8_t *record,
                 uint32_t number) {
    uint32_t size = records->bytes - 4;
    bytes_put32(record, records->mark);
    bytes_put32(record + 4, number);
    bytes_put32(record + size, frame_crc32c(0, record, size));
}

/* 0: it is none. */
static uint32_t number_of(const struct loader_records *records,
                          const uint8_t *record) {
    uint8_t whole[LOADER_RECORD_MAX];
    memcpy(whole, record, records->bytes);
    seal(records, whole, bytes_get32(record + 4));
    return memcmp(record, whole, records->bytes) == 0 ? bytes_get32(record + 4)
                                                      : 0;
}

static bool erased(const uint8_t *record, uint32_t bytes) {
    for (uint32_t i = 0; i < bytes; i++) {
        if (record[i] != 0xff) {
            return false;
        }
    }
    return true;
}

static uint32_t begin_of(const struct loader_records *records,
                         unsigned sector) {
    return (records->first + sector) * records->flash->sector_bytes;
}

static struct sector look(const struct loader_records *records,
                          unsigned sector) {
    const struct loader_flash *flash = records->flash;
    struct sector found = {0, 0, 0, 0};
    uint8_t record[LOADER_RECORD_MAX];
    uint32_t apart = loader_flash_apart(flash, records->bytes);
    for (uint32_t at = 0; at < flash->sector_bytes; at += apart) {
        flash->read(flash->context, begin_of(records, sector) + at, record,
                    records->bytes);
        if (erased(record, records->bytes)) {
            continue;
        }
        uint32_t number = number_of(records, record);
        found.end = at + apart;
        found.torn++;
        if (number > found.largest) {
            found.largest = number;
            found.at = at;
            found.torn = 0;
        }
    }
    return found;
}

uint32_t loader_records_newest(const struct loader_records *records,
                               void *body) {
    struct sector found[SECTORS] = {look(records, 0), look(records, 1)};
    const struct loader_flash *flash = records->flash;
    unsigned last = found[1].largest > found[0].largest;
    if (found[last].largest > 0) {
        flash->read(flash->context,
                    begin_of(records, last) + found[last].at + AT_BODY, body,
                    records->bytes - LOADER_RECORD_OWN);
    }
    return found[last].largest;
}

/* Whether the flash holds it afterwards. */
static bool put(const struct loader_records *records, uint32_t at,
                const void *body, uint32_t number) {
    const struct loader_flash *flash = records->flash;
    uint8_t record[LOADER_RECORD_MAX], read[LOADER_RECORD_MAX];
    memcpy(record + AT_BODY, body, records->bytes - LOADER_RECORD_OWN);
    seal(records, record, number);
    bool taken = flash->program(flash->context, at, record, records->bytes);
    flash->read(flash->context, at, read, records->bytes);
    return taken && memcmp(record, read, records->bytes) == 0;
}

/* The sector that was not the last to be written is erased before it is, so
 * that what an interrupted erasure has left there does not matter. */
bool loader_records_append(const struct loader_records *records,
                           const void *body, uint32_t *number) {
    const struct loader_flash *flash = records->flash;
    INCODE_ASSERT(records->bytes <= LOADER_RECORD_MAX &&
                  flash->page_bytes % records->bytes == 0);
    struct sector found[SECTORS] = {look(records, 0), look(records, 1)};
    unsigned last = found[1].largest > found[0].largest;
    uint32_t next = found[last].largest + found[last].torn;
    uint32_t end = found[last].end;
    if (found[last].largest == 0) { /* the first of all */
        last = 1;
        next = 0;
        end = flash->sector_bytes;
    }
    for (unsigned i = 0; i < TRIES; i++) {
        if (end == flash->sector_bytes) {
            last = 1 - last;
            end = 0;
            if (!flash->erase(flash->context, records->first + last)) {
                return false;
            }
        }
        next++;
        if (put(records, begin_of(records, last) + end, body, next)) {
            *number = next;
            return true;
        }
        end += loader_flash_apart(flash, records->bytes);
    }
    return false;
}
