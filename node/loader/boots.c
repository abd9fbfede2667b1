#include "boots.h"

#include "records.h"

enum { MARK = 0x31544f42 /* "BOT1" */ };

bool loader_boots_next(const struct loader_flash *flash, uint32_t *boot) {
    static const uint8_t body[LOADER_BOOT_BYTES - LOADER_RECORD_OWN];
    const struct loader_records records = {flash, 0, MARK, LOADER_BOOT_BYTES};
    return loader_records_append(&records, body, boot);
}
