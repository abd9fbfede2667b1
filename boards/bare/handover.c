#include "handover.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "bare.h"
#include "transport/frame.h"

enum { GIVEN = 0x48414e44, TAKEN = 0x54414b45 };

static struct bare_handover kept __attribute__((section(".noinit.handover")));

static_assert(sizeof kept == BARE_HANDOVER_BYTES, "as start.ld has it");

/* But for the magic number. */
static uint32_t sum(void) {
    return frame_crc32c(0, &kept.boot,
                        offsetof(struct bare_handover, crc) -
                            offsetof(struct bare_handover, boot));
}

void bare_handover_give(const struct bare_handover *handover) {
    kept = *handover;
    kept.magic = GIVEN;
    kept.crc = sum();
}

bool bare_handover_take(struct bare_handover *handover) {
    if (kept.magic != GIVEN || kept.crc != sum()) {
        return false;
    }
    kept.magic = TAKEN;
    *handover = kept;
    handover->loader[sizeof handover->loader - 1] = '\0';
    return true;
}

bool bare_handover_drop(void) {
    bool given =
        (kept.magic == GIVEN || kept.magic == TAKEN) && kept.crc == sum();
    memset(&kept, 0, sizeof kept);
    return given;
}
