/* Two slots for images in a board's flash, one of them in use, and the choice
 * of the slot for the next start.  A new image is on trial.  After a start of
 * it that ends in a fault, or the third start in a row that neither confirms it
 * nor lasts, the board falls back to the other slot.  A confirmed image stays
 * in use as long as it is good.
 *
 * Sectors 0 and 1 of the flash count starts, 2 and 3 hold this state, and 4 the
 * board's serial number.  Slots begin at sector 16 if the flash has 64 sectors,
 * otherwise at sector 5.  Each takes half of the rest, at most 1 MB.  A slot is
 * the image byte for byte, its header's page written last; the last sectors of
 * a slot are the journal of what is coming (incoming.h).
 *
 * Memory: struct loader_slots; a hash of SIGN_HASH_BYTES on the stack. */
#ifndef NODE_LOADER_SLOTS_H
#define NODE_LOADER_SLOTS_H

#include <stdbool.h>
#include <stdint.h>

#include "flash.h"
#include "image.h"

/* Limits on actions that messages can request and that wear a board's flash or
 * keep its loader busy: a number of times at once, then one in each period,
 * whatever requests them.  The counts are in memory that outlasts a restart.
 * Only a loss of power resets them, and no message can cause that.
 *
 * |            | at once | then one in | what it bounds |
 * |------------|---------|-------------|----------------|
 * | starts     |   1,000 | 60 s        | records in the first two sectors |
 * | transfers  |     100 | 4 h         | erasures of a slot: 3 of each sector a
 * |            |         |             | transfer |
 * | false      |       6 | 10 s        | proofs of signatures that were false |
 *
 * So a flash that bears 100,000 erasures of a sector lasts for 96 years of
 * starts at the limit, as a sector of 4 KB holds 256 records, and for 15 years
 * of transfers at the limit. */

enum loader_expense {
    LOADER_STARTS,
    LOADER_TRANSFERS, /* for which a slot is made ready */
    LOADER_FALSE,     /* headers whose signature was false */
    LOADER_EXPENSES
};

struct loader_budget {
    uint32_t magic;
    uint32_t debt_s[LOADER_EXPENSES]; /* until the full number is free again */
    uint32_t passed_s; /* since this start, already subtracted from the debts */
    uint32_t crc;
};

/* At a start of any program: goes on with the counts of the start before.
 * Memory without valid counts begins with none. */
void loader_budget_open(struct loader_budget *budget);

/* now_us: since the start.  To be called at least once a second: time that is
 * not counted frees nothing. */
void loader_budget_pass(struct loader_budget *budget, uint64_t now_us);

/* Whether `what` may be done now; _take also counts it as done. */
bool loader_budget_has(const struct loader_budget *budget,
                       enum loader_expense what);
bool loader_budget_take(struct loader_budget *budget, enum loader_expense what);

/* Records of one size in two sectors of a flash.  They are written one after
 * the other, alternating between the sectors, each with a number larger than
 * all before.  The newest record is valid.  A record that was torn by a loss of
 * power is skipped, and so is its number, because the record may be read as
 * whole later. */

enum {
    LOADER_RECORD_OWN = 12, /* bytes of a record that are not its body */
    LOADER_RECORD_MAX = 32
};

struct loader_records {
    const struct loader_flash *flash;
    uint32_t first; /* of its two sectors */
    uint32_t mark;  /* with which a record of this kind begins */
    uint32_t bytes; /* of a record, at most LOADER_RECORD_MAX; it divides a
                       page */
};

/* The layout of a board's flash, for any size of sectors and pages: see the
 * top. */

enum {
    LOADER_STATE_SECTOR = 2, /* and the next */
    LOADER_SERIAL_SECTOR = 4,
    LOADER_MARK_BYTES = 4 /* of a block, in a journal */
};

struct loader_layout {
    uint32_t first;   /* sector of slot 0 */
    uint32_t sectors; /* of a slot, its journal included */
    uint32_t journal; /* sectors of that */
    uint32_t bytes;   /* of an image at most, its header included; 0: the flash
                         is too small for two slots */
};

struct loader_layout loader_layout(const struct loader_flash *flash);

/* Bytes from the flash's beginning to a slot, and to its journal. */
uint32_t loader_slot_at(const struct loader_layout *layout,
                        const struct loader_flash *flash, unsigned slot);
uint32_t loader_journal_at(const struct loader_layout *layout,
                           const struct loader_flash *flash, unsigned slot);

/* From the journal's beginning to the first mark, and from one to the next. */
uint32_t loader_marks_in(const struct loader_flash *flash);
uint32_t loader_mark_apart(const struct loader_flash *flash);

/* Programs bytes page by page.  False: the flash does not hold them then. */
bool loader_flash_put(const struct loader_flash *flash, uint32_t at,
                      const void *bytes, uint32_t size);

/* Whether the flash holds these bytes; whether it would hold them without an
 * erasure; and whether it holds 0xff alone. */
bool loader_flash_holds(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size);
bool loader_flash_takes(const struct loader_flash *flash, uint32_t at,
                        const void *bytes, uint32_t size);
bool loader_flash_blank(const struct loader_flash *flash, uint32_t at,
                        uint32_t size);

/* The sector in which these bytes begin. */
bool loader_flash_clear(const struct loader_flash *flash, uint32_t at);

enum {
    LOADER_SLOTS = 2, /* and for none */
    LOADER_TRIES = 3, /* starts of an image on trial, each shorter than */
    LOADER_LIVED_US = 10000000, /* that: power that comes and goes */
    LOADER_SERIAL_BYTES = 8,
    LOADER_SLICE_BYTES = 1024 /* that are hashed at a time */
};

/* Which images the board accepts. */
struct loader_rules {
    const struct loader_flash *flash;
    const struct sign_suite *suite;
    const uint8_t *key; /* SIGN_PUBLIC_BYTES */
    const char *board;  /* as --board names it */
    uint32_t address;   /* that images are linked for, */
    uint32_t room;      /* and bytes of code that fit there */
    /* Called while loader_slots_choose, or loader_look_copy, has long work, so
     * that a watchdog waits.  NULL: nobody does. */
    void (*alive)(void);
    struct loader_budget *budget; /* limits transfers; NULL: no limit */
};

/* What a record in the flash says; all zeros: there was none. */
struct loader_state {
    uint32_t floor; /* the lowest number that is taken */
    uint8_t slot;   /* in use; LOADER_SLOTS: none is */
    uint8_t trial;  /* it has confirmed nothing so far, */
    uint8_t tries;  /* and was started so many times */
};

struct loader_slots {
    const struct loader_rules *rules;
    struct loader_state state;
    bool worn; /* the flash takes no record of a start: no image is started, and
                  none taken */
    /* Of each slot, once it was looked at: what keeps it from being started,
     * and its header. */
    bool known[LOADER_SLOTS];
    enum loader_fault fault[LOADER_SLOTS];
    struct loader_image image[LOADER_SLOTS];
};

void loader_slots_open(struct loader_slots *slots,
                       const struct loader_rules *rules);

static inline void loader_slots_alive(const struct loader_slots *slots) {
    if (slots->rules->alive != NULL)
        slots->rules->alive();
}

/* The first call at a board's start: counts the start (loader_boots_next),
 * opens the slots, and chooses one.  If the flash takes no record of the start,
 * it returns LOADER_SLOTS, and *boot is 0.  Then the board waits in its loader,
 * which reports why: without a number of its own it could only restart. */
unsigned loader_slots_start(struct loader_slots *slots,
                            const struct loader_rules *rules, bool ended_badly,
                            uint32_t *boot);

/* The slot of the next start; LOADER_SLOTS: none is good.  ended_badly: the
 * last start was of an image, and ended in a fault or by the watchdog; it falls
 * back then, if it is on trial.  Once a start. */
unsigned loader_slots_choose(struct loader_slots *slots, bool ended_badly);

/* Why a loader with these rules refuses a header, the signature apart. *image
 * is the header, except with LOADER_NO_IMAGE. */
enum loader_fault loader_slots_suits(const struct loader_slots *slots,
                                     const uint8_t header[LOADER_HEADER_BYTES],
                                     struct loader_image *image);

/* Sets the slot of the next start, or none.  False: the flash does not take the
 * record. */
bool loader_slots_use(struct loader_slots *slots, unsigned slot, bool trial);

/* Counts a start of the slot in use, if it is on trial, right before the jump.
 * False: the flash does not take the record; it must not be started. */
bool loader_slots_try(struct loader_slots *slots);

/* For the running image from this slot, before it uses its links, because it
 * reads two sectors: whether it must confirm that it has come up, and the state
 * for that.  The image needs nothing else of the loader. */
bool loader_slots_unconfirmed(const struct loader_flash *flash, unsigned slot,
                              struct loader_state *up);

/* The running image has come up.  False: the flash does not take the record. */
bool loader_slots_confirm(const struct loader_flash *flash,
                          const struct loader_state *up);

/* Where its code is in the flash. */
uint32_t loader_slots_code(const struct loader_slots *slots, unsigned slot);

/* For the running image, when it has run for LOADER_LIVED_US: earlier starts do
 * not count as failures any more, because a person may turn an unwired board
 * off and on.  The image is still on trial, and a start that ends in a fault
 * falls back.  False: the flash does not take the record. */
bool loader_slots_lived(const struct loader_flash *flash, unsigned slot);

/* Puts an image, checked by the caller, into slot 0 of a flash that no board is
 * using, and makes it the one in use: for the host, which makes chips of
 * emulated boards.  False: it does not fit. */
bool loader_slots_install(const struct loader_flash *flash,
                          const uint8_t *image, uint32_t bytes);

/* _serial: the board's serial number; false: it has none, and serial is zeros.
 * _name: gives the number once; later calls change nothing.  False: the flash
 * does not take it. */
bool loader_slots_serial(const struct loader_flash *flash,
                         uint8_t serial[LOADER_SERIAL_BYTES]);
bool loader_slots_name(const struct loader_flash *flash,
                       const uint8_t serial[LOADER_SERIAL_BYTES]);

/* The number of a board's start, which is never used again: records, as above,
 * in the first two sectors of its flash. */

enum { LOADER_BOOT_BYTES = 16 /* of a record: it divides a page */ };

/* 1 at the first start, and larger at each later one.  It is recorded before it
 * is returned.  False: it could not be recorded. */
bool loader_boots_next(const struct loader_flash *flash, uint32_t *boot);

#endif
