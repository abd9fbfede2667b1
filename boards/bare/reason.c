#include "reason.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "bare.h"
#include "transport/frame.h"
#include "transport/text.h"

enum { MAGIC = 0x42415245 };

static struct bare_reason kept __attribute__((section(".noinit.reason")));

static_assert(sizeof kept <= BARE_REASON_BYTES, "more than start.ld has");

static uint32_t sum(void) {
    return frame_crc32c(0, &kept, offsetof(struct bare_reason, crc));
}

struct bare_reason bare_reason_take(void) {
    if (kept.magic != MAGIC || kept.crc != sum() || kept.kind > BARE_BOOT) {
        memset(&kept, 0, sizeof kept);
        kept.magic = MAGIC;
        kept.kind = BARE_POWER_ON;
    }
    kept.starts++;
    struct bare_reason reason = kept;
    bare_reason_keep(BARE_OUTSIDE, NULL);
    return reason;
}

struct bare_reason bare_reason_taken(enum bare_reason_kind kind) {
    struct bare_reason reason = kept;
    reason.kind = kind <= BARE_BOOT ? kind : BARE_OUTSIDE;
    return reason;
}

void bare_reason_keep(enum bare_reason_kind kind, const char *text) {
    kept.kind = kind;
    if (text != NULL) {
        struct cube_text words = cube_text_in(kept.text, sizeof kept.text);
        cube_text_put(&words, text);
        kept.faults++;
    }
    kept.crc = sum();
}

const char *bare_reason_name(enum bare_reason_kind kind) {
    static const char *const names[] = {[BARE_POWER_ON] = "power on",
                                        [BARE_OUTSIDE] = "reset from outside",
                                        [BARE_RUN_OVER] = "the run is over",
                                        [BARE_FAULT] = "a fault",
                                        [BARE_HUNG] = "the program hung",
                                        [BARE_ASKED] = "the host's order",
                                        [BARE_STAY] = "the host's order to "
                                                      "stay in the loader",
                                        [BARE_BOOT] = "the loader's start of "
                                                      "an image"};
    return names[kind];
}
