#include "handover.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "bare.h"
#include "transport/frame.h"
#include "transport/text.h"

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
    if (kept.magic != GIVEN || kept.crc != sum())
        return false;
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

/* --- reason --------------------------------------------------------------- */

enum { MAGIC = 0x42415245 };

static struct bare_reason reason_kept
    __attribute__((section(".noinit.reason")));

static_assert(sizeof reason_kept <= BARE_REASON_BYTES,
              "more than start.ld has");

static uint32_t reason_sum(void) {
    return frame_crc32c(0, &reason_kept, offsetof(struct bare_reason, crc));
}

struct bare_reason bare_reason_take(void) {
    if (reason_kept.magic != MAGIC || reason_kept.crc != reason_sum() ||
        reason_kept.kind > BARE_BOOT) {
        memset(&reason_kept, 0, sizeof reason_kept);
        reason_kept.magic = MAGIC;
        reason_kept.kind = BARE_POWER_ON;
    }
    reason_kept.starts++;
    struct bare_reason reason = reason_kept;
    bare_reason_keep(BARE_OUTSIDE, NULL);
    return reason;
}

struct bare_reason bare_reason_taken(enum bare_reason_kind kind) {
    struct bare_reason reason = reason_kept;
    reason.kind = kind <= BARE_BOOT ? kind : BARE_OUTSIDE;
    return reason;
}

void bare_reason_keep(enum bare_reason_kind kind, const char *text) {
    reason_kept.kind = kind;
    if (text != NULL) {
        struct cube_text words =
            cube_text_in(reason_kept.text, sizeof reason_kept.text);
        cube_text_put(&words, text);
        reason_kept.faults++;
    }
    reason_kept.crc = reason_sum();
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
