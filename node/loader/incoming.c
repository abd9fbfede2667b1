#include "incoming.h"

#include <string.h>

#include "incode/predicates/check.h"
#include "slots.h"
#include "transport/bytes.h"
#include "transport/frame.h"

enum {
    COUNT = 4,        /* blocks that are looked at in a step */
    FAILURES_MAX = 3, /* blocks that the flash may not hold at first */
    ERASED_MARK = -1
};

static const struct loader_flash *flash_of(const struct loader_incoming *in) {
    return in->slots->rules->flash;
}

static struct loader_layout layout_of(const struct loader_incoming *in) {
    return loader_layout(flash_of(in));
}

static uint32_t slot_at(const struct loader_incoming *in) {
    const struct loader_layout layout = layout_of(in);
    return loader_slot_at(&layout, flash_of(in), in->slot);
}

static uint32_t journal_at(const struct loader_incoming *in, unsigned slot) {
    const struct loader_layout layout = layout_of(in);
    return loader_journal_at(&layout, flash_of(in), slot);
}

static uint32_t mark_at(const struct loader_incoming *in, uint32_t block) {
    return journal_at(in, in->slot) + loader_marks_in(flash_of(in)) +
           loader_mark_apart(flash_of(in)) * block;
}

static uint32_t bytes_of(const struct loader_incoming *in) {
    return LOADER_HEADER_BYTES + in->image.bytes;
}

static uint32_t size_of(const struct loader_incoming *in, uint32_t block) {
    uint32_t left = bytes_of(in) - block * LOADER_BLOCK_BYTES;
    return left < LOADER_BLOCK_BYTES ? left : LOADER_BLOCK_BYTES;
}

static bool holds(const struct loader_incoming *in, uint32_t block) {
    return (in->map[block / 8] >> block % 8 & 1) != 0;
}

static void set_held(struct loader_incoming *in, uint32_t block, bool held) {
    if (holds(in, block) != held) {
        in->map[block / 8] ^= (uint8_t)(1u << block % 8);
        in->held += held ? 1u : UINT32_MAX;
    }
}

static void refuse(struct loader_incoming *in, enum loader_fault fault) {
    in->phase = LOADER_REFUSES;
    in->fault = fault;
    in->work = LOADER_NO_WORK;
}

/* False: too many of them of late; the transfer ends. */
static bool affords(struct loader_incoming *in, bool affordable) {
    if (!affordable)
        refuse(in, LOADER_TOO_OFTEN);
    return affordable;
}

static void go_on(struct loader_incoming *in, enum loader_work work) {
    in->work = work;
    in->next = 0;
}

/* False: the flash does not erase it, which ends the transfer. */
static bool clear(struct loader_incoming *in, uint32_t at) {
    in->erased++;
    if (!loader_flash_clear(flash_of(in), at)) {
        refuse(in, LOADER_WORN);
        return false;
    }
    return true;
}

static bool put(struct loader_incoming *in, uint32_t at, const void *bytes,
                uint32_t size) {
    uint32_t page = flash_of(in)->page_bytes;
    in->programmed += (size + page - 1) / page;
    return loader_flash_put(flash_of(in), at, bytes, size);
}

void loader_incoming_init(struct loader_incoming *incoming,
                          struct loader_slots *slots) {
    memset(incoming, 0, sizeof *incoming);
    incoming->slots = slots;
    incoming->phase = LOADER_WAITS;
}

/* --- it begins ------------------------------------------------------------ */

void loader_incoming_begin(struct loader_incoming *incoming,
                           const uint8_t header[LOADER_HEADER_BYTES],
                           uint32_t bytes) {
    struct loader_incoming *in = incoming;
    bool same = memcmp(in->header, header, LOADER_HEADER_BYTES) == 0;
    INCODE_ASSERT(in->work == LOADER_NO_WORK);
    if (same && (in->phase == LOADER_TAKES || in->phase == LOADER_WHOLE))
        return;
    memcpy(in->header, header, LOADER_HEADER_BYTES);
    memset(in->map, 0, sizeof in->map);
    in->blocks = in->held = in->failures = in->inherited = 0;
    in->fault = in->slots->worn
                    ? LOADER_WORN
                    : loader_slots_suits(in->slots, header, &in->image);
    if (in->fault == LOADER_GOOD && bytes != bytes_of(in))
        in->fault = LOADER_NO_IMAGE;
    if (in->fault != LOADER_GOOD) {
        refuse(in, in->fault);
        return;
    }
    in->blocks = (bytes + LOADER_BLOCK_BYTES - 1) / LOADER_BLOCK_BYTES;
    in->phase = LOADER_TAKES;
    go_on(in, LOADER_PROVES);
}

static void prove(struct loader_incoming *in) {
    const struct loader_rules *rules = in->slots->rules;
    struct loader_budget *budget = rules->budget;
    if (!affords(in, budget == NULL || loader_budget_has(budget, LOADER_FALSE)))
        return;
    enum loader_fault fault =
        loader_image_signed(in->header, rules->suite, rules->key);
    if (fault == LOADER_WRONG_SIGNATURE && budget != NULL)
        (void)loader_budget_take(budget, LOADER_FALSE);
    if (fault != LOADER_GOOD)
        refuse(in, fault);
    else
        go_on(in, LOADER_CHOOSES);
}

/* What is the image in use already, or has it been brought by now. */
static bool in_use(const struct loader_incoming *in) {
    const struct loader_slots *slots = in->slots;
    unsigned slot = slots->state.slot;
    return slot < LOADER_SLOTS && slots->known[slot] &&
           slots->fault[slot] == LOADER_GOOD &&
           memcmp(slots->image[slot].digest, in->image.digest,
                  sizeof in->image.digest) == 0;
}

static bool begins_with_header(const struct loader_incoming *in, uint32_t at) {
    return loader_flash_holds(flash_of(in), at, in->header,
                              LOADER_HEADER_BYTES);
}

/* Where no slot is in use: the one in which it has begun to be. */
static unsigned begun_slot(const struct loader_incoming *in) {
    unsigned slot = LOADER_SLOTS;
    while (slot-- > 0) {
        const struct loader_layout layout = layout_of(in);
        if (begins_with_header(in,
                               loader_slot_at(&layout, flash_of(in), slot)) ||
            begins_with_header(in, journal_at(in, slot)))
            return slot;
    }
    return 0;
}

/* Erasures begin here.  Each time that a slot is made ready, a sector is erased
 * at most three times: for the first block, again if what was brought is false,
 * and once more if parts of it had been there before. */
static void make_ready(struct loader_incoming *in, unsigned slot) {
    struct loader_budget *budget = in->slots->rules->budget;
    in->slot = slot;
    if (affords(in,
                budget == NULL || loader_budget_take(budget, LOADER_TRANSFERS)))
        go_on(in, LOADER_READIES);
}

/* The slot that is not in use; of two good ones, of which one is on trial, that
 * one.  The other is looked at first: it is in use from then on. */
static void choose(struct loader_incoming *in) {
    struct loader_slots *slots = in->slots;
    const struct loader_state *state = &slots->state;
    unsigned other = 1u - state->slot % LOADER_SLOTS;
    if (in_use(in)) {
        in->phase = LOADER_THERE;
        in->work = LOADER_NO_WORK;
        return;
    }
    if (state->slot >= LOADER_SLOTS) {
        make_ready(in, begun_slot(in));
        return;
    }
    if (state->trial && !slots->known[other]) {
        if (in->next++ == 0)
            loader_look_begin(&in->look, slots, other);
        (void)loader_look_step(&in->look, slots);
        return;
    }
    if (state->trial && slots->fault[other] == LOADER_GOOD) {
        if (!loader_slots_use(slots, other, false))
            refuse(in, LOADER_WORN);
        return; /* that may be the one which is to come */
    }
    make_ready(in, other);
}

/* One sector a step: the header's, unless it has this header already, and where
 * the journal is of something else its own. */
static void ready(struct loader_incoming *in) {
    const struct loader_flash *flash = flash_of(in);
    const struct loader_layout layout = layout_of(in);
    uint32_t at = journal_at(in, in->slot);
    in->slots->known[in->slot] = false;
    if (in->next == 0) {
        in->next = 1;
        if (begins_with_header(in, slot_at(in))) { /* and is whole */
            memset(in->map, 0xff, sizeof in->map);
            in->held = in->blocks;
            go_on(in, LOADER_COUNTS);
            in->next = in->blocks;
        } else if (!loader_flash_blank(flash, slot_at(in),
                                       LOADER_HEADER_BYTES)) {
            (void)clear(in, slot_at(in));
        }
    } else if (in->next <= layout.journal &&
               (in->next > 1 || !begins_with_header(in, at))) {
        at += (in->next++ - 1) * flash->sector_bytes;
        if (!loader_flash_blank(flash, at, flash->sector_bytes))
            (void)clear(in, at);
    } else if (begins_with_header(in, at) ||
               put(in, at, in->header, LOADER_HEADER_BYTES)) {
        go_on(in, LOADER_COUNTS);
    } else {
        refuse(in, LOADER_WORN);
    }
}

/* The mark of a block is right. */
static bool is_marked(struct loader_incoming *in, uint32_t block) {
    const struct loader_flash *flash = flash_of(in);
    uint8_t mark[LOADER_MARK_BYTES];
    flash->read(flash->context, mark_at(in, block), mark, sizeof mark);
    if (bytes_get32(mark) == (uint32_t)ERASED_MARK)
        return false;
    flash->read(flash->context, slot_at(in) + block * LOADER_BLOCK_BYTES,
                in->block, size_of(in, block));
    if (block == 0)
        memcpy(in->block, in->header, LOADER_HEADER_BYTES);
    return bytes_get32(mark) == frame_crc32c(0, in->block, size_of(in, block));
}

static void count(struct loader_incoming *in) {
    for (unsigned i = 0; i < COUNT && in->next < in->blocks; i++) {
        set_held(in, in->next, is_marked(in, in->next));
        in->next++;
    }
    if (in->next >= in->blocks) {
        in->inherited = in->held;
        in->phase = in->held == in->blocks ? LOADER_WHOLE : LOADER_TAKES;
        in->work = LOADER_NO_WORK;
    }
}

/* --- blocks --------------------------------------------------------------- */

void loader_incoming_block(struct loader_incoming *incoming, uint32_t number,
                           const uint8_t *bytes, uint32_t size, uint32_t crc) {
    struct loader_incoming *in = incoming;
    INCODE_ASSERT(in->work == LOADER_NO_WORK);
    if (in->phase != LOADER_TAKES || number >= in->blocks ||
        size != size_of(in, number) || holds(in, number) ||
        frame_crc32c(0, bytes, size) != crc ||
        (number == 0 && memcmp(bytes, in->header, LOADER_HEADER_BYTES) != 0))
        return;
    memcpy(in->block, bytes, size);
    in->number = number;
    in->size = size;
    in->crc = crc;
    go_on(in, LOADER_WRITES);
}

/* Blocks of a sector, [*first, *last). */
static void blocks_of(const struct loader_incoming *in, uint32_t sector,
                      uint32_t *first, uint32_t *last) {
    uint32_t bytes = flash_of(in)->sector_bytes, begin = sector * bytes;
    *first = begin / LOADER_BLOCK_BYTES;
    *last = (begin + bytes + LOADER_BLOCK_BYTES - 1) / LOADER_BLOCK_BYTES;
    *last = *last < in->blocks ? *last : in->blocks;
}

/* Whether the block's part of a sector can be programmed as it is.  Where no
 * block is held, what is there is of another image. */
static bool is_ready(const struct loader_incoming *in, uint32_t sector) {
    const struct loader_flash *flash = flash_of(in);
    uint32_t first, last, size = flash->sector_bytes;
    uint32_t at = sector * size;
    blocks_of(in, sector, &first, &last);
    bool begun = false;
    for (uint32_t b = first; b < last; b++)
        begun = begun || holds(in, b);
    if (!begun)
        return loader_flash_blank(flash, slot_at(in) + at, size);
    uint32_t begin = in->number * LOADER_BLOCK_BYTES, end = begin + in->size;
    uint32_t own = in->number == 0 ? LOADER_HEADER_BYTES : begin;
    own = own > at ? own : at;
    end = end < at + size ? end : at + size;
    return own >= end || loader_flash_takes(flash, slot_at(in) + own,
                                            in->block + own - begin, end - own);
}

/* What it held goes with it. */
static void erase(struct loader_incoming *in, uint32_t sector) {
    uint32_t first, last;
    blocks_of(in, sector, &first, &last);
    for (uint32_t b = first; b < last; b++)
        set_held(in, b, false);
    in->phase = LOADER_TAKES;
    (void)clear(in, slot_at(in) + sector * flash_of(in)->sector_bytes);
}

/* A mark that cannot be written, as a lost erasure left it, is none: the block
 * is held all the same, and comes again if power is lost. */
static void program(struct loader_incoming *in) {
    uint32_t skip = in->number == 0 ? LOADER_HEADER_BYTES : 0;
    uint8_t mark[LOADER_MARK_BYTES];
    in->work = LOADER_NO_WORK;
    if (!put(in, slot_at(in) + in->number * LOADER_BLOCK_BYTES + skip,
             in->block + skip, in->size - skip)) {
        if (++in->failures > FAILURES_MAX)
            refuse(in, LOADER_WORN);
        return;
    }
    bytes_put32(mark, in->crc);
    (void)put(in, mark_at(in, in->number), mark, sizeof mark);
    set_held(in, in->number, true);
    if (in->held == in->blocks)
        in->phase = LOADER_WHOLE;
}

/* A sector a step is erased, at most; then the block is programmed. */
static void write(struct loader_incoming *in) {
    uint32_t bytes = flash_of(in)->sector_bytes;
    uint32_t begin = in->number * LOADER_BLOCK_BYTES;
    uint32_t first = begin / bytes;
    uint32_t last = (begin + in->size - 1) / bytes;
    while (first + in->next <= last) {
        uint32_t sector = first + in->next++;
        if (!is_ready(in, sector)) {
            erase(in, sector);
            return;
        }
    }
    program(in);
}

/* --- the end -------------------------------------------------------------- */

void loader_incoming_verify(struct loader_incoming *incoming) {
    struct loader_incoming *in = incoming;
    INCODE_ASSERT(in->work == LOADER_NO_WORK);
    if (in->phase == LOADER_WHOLE) {
        loader_look_hash(&in->look, in->slots, in->header, &in->image,
                         in->slot);
        go_on(in, LOADER_CHECKS);
    }
}

static void check(struct loader_incoming *in) {
    bool good = false;
    if (!loader_look_slice(&in->look, in->slots, &good))
        go_on(in, good ? LOADER_SEALS : LOADER_DROPS);
}

/* Programmed once more where it is there already: it may have been torn. */
static void seal(struct loader_incoming *in) {
    struct loader_slots *slots = in->slots;
    if (!put(in, slot_at(in), in->header, LOADER_HEADER_BYTES) ||
        !loader_slots_use(slots, in->slot, true)) {
        refuse(in, LOADER_WORN);
        return;
    }
    slots->known[in->slot] = true;
    slots->fault[in->slot] = LOADER_GOOD;
    slots->image[in->slot] = in->image;
    in->phase = LOADER_VERIFIED;
    in->work = LOADER_NO_WORK;
}

/* Header and journal: nothing of it is held any more.  Where parts of it were
 * there before, it is taken anew. */
static void drop(struct loader_incoming *in) {
    uint32_t at = in->next++ == 0 ? slot_at(in) : journal_at(in, in->slot);
    if (!clear(in, at) || in->next < 2)
        return;
    memset(in->map, 0, sizeof in->map);
    in->held = 0;
    if (in->inherited > 0) {
        in->phase = LOADER_TAKES;
        go_on(in, LOADER_READIES);
    } else {
        refuse(in, LOADER_WRONG_DIGEST);
    }
}

void loader_incoming_step(struct loader_incoming *incoming) {
    static void (*const works[])(struct loader_incoming * in) = {
        [LOADER_PROVES] = prove,  [LOADER_CHOOSES] = choose,
        [LOADER_READIES] = ready, [LOADER_COUNTS] = count,
        [LOADER_WRITES] = write,  [LOADER_CHECKS] = check,
        [LOADER_SEALS] = seal,    [LOADER_DROPS] = drop};
    if (incoming->work != LOADER_NO_WORK)
        works[incoming->work](incoming);
}
