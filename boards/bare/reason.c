#include "reason.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "bare.h"
#include "transport/frame.h"
#include "transport/text.h"

enum { MAGIC = 0x42415245 };

static struct bare_reason kept __attribute__((section(".noinit")));

static_assert(sizeof kept <= BARE_NOINIT_BYTES, "more than start.ld has");

static uint32_t sum(void)
{
    return frame_crc32c(0, &kept, offsetof(struct bare_reason, crc));
}

struct bare_reason bare_reason_take(void)
{
    if (kept.magic != MAGIC || kept.crc != sum() || kept.kind > BARE_HUNG) {
        memset(&kept, 0, sizeof kept);
        kept.magic = MAGIC;
        kept.kind = BARE_POWER_ON;
    }
    kept.starts++;
    struct bare_reason reason = kept;
    bare_reason_keep(BARE_OUTSIDE, NULL);
    return reason;
}

void bare_reason_keep(enum bare_reason_kind kind, const char *text)
{
    kept.kind = kind;
    if (text != NULL) {
        struct cube_text words = cube_text_in(kept.text, sizeof kept.text);
        cube_text_put(&words, text);
        kept.faults++;
    }
    kept.crc = sum();
}

const char *bare_reason_name(enum bare_reason_kind kind)
{
    static const char *const names[] = {[BARE_POWER_ON] = "power on",
                                        [BARE_OUTSIDE] = "reset from outside",
                                        [BARE_RUN_OVER] = "the run is over",
                                        [BARE_FAULT] = "a fault",
                                        [BARE_HUNG] = "the program hung"};
    return names[kind];
}
