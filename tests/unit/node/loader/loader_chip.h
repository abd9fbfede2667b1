/* A flash chip of any geometry that keeps a flash's rules and loses power at a
 * given operation, images for it, and a suite that is quick: for tests of what
 * the loader leaves behind.
 *
 * Memory: CHIP_BYTES a chip. */
#ifndef TESTS_LOADER_CHIP_H
#define TESTS_LOADER_CHIP_H

#include <stdlib.h>
#include <string.h>

#include "node/loader/incoming.h"
#include "node/loader/slots.h"
#include "transport/frame.h"
#include "tests/unit/test.h"

enum { CHIP_BYTES = 512 * 1024, CHIP_IMAGE_MAX = 256 * 1024 };

/* --- a chip --------------------------------------------------------------- */

struct chip {
    struct loader_flash flash; /* its context is the chip */
    uint8_t bytes[CHIP_BYTES];
    long until_loss;   /* operations; below 0: never */
    long done;         /* operations, */
    uint32_t erased;   /* of them sectors, */
    uint32_t programs; /* and pages or parts of one */
    uint32_t random;
    uint32_t worn;         /* the sector that takes nothing; 0: none */
    bool worn_out;         /* no sector takes anything */
    uint32_t sacred;       /* bytes from here on, */
    uint32_t sacred_bytes; /* so many, must not change */
    jmp_buf lost;
};

static struct chip chip;

static uint32_t chip_draw(struct chip *c) {
    c->random = c->random * 1664525u + 1013904223u;
    return c->random >> 8;
}

static uint32_t chip_size(const struct chip *c) {
    return c->flash.sectors * c->flash.sector_bytes;
}

static void chip_read(void *context, uint32_t at, void *bytes, size_t size) {
    const struct chip *c = context;
    assert_true(at + size <= chip_size(c));
    memcpy(bytes, c->bytes + at, size);
}

/* Where a program rewrites all of a block: it may hold anything then, or what
 * was there, or what was to be. */
static void chip_tear_block(struct chip *c, uint32_t at, const uint8_t *to,
                            uint32_t size) {
    uint32_t begin = at / c->flash.torn_bytes * c->flash.torn_bytes;
    uint32_t kind = chip_draw(c) % 4;
    if (kind != 0)
        memcpy(c->bytes + at, to, size);
    for (uint32_t i = 0; kind > 1 && i < c->flash.torn_bytes; i++)
        c->bytes[begin + i] = kind == 2 ? 0 : (uint8_t)chip_draw(c);
    longjmp(c->lost, 1);
}

/* So many blocks of a sector are erased, the next may hold anything. */
static void chip_tear_sector(struct chip *c, uint32_t at) {
    uint32_t block = c->flash.torn_bytes;
    uint32_t whole = chip_draw(c) % (c->flash.sector_bytes / block);
    memset(c->bytes + at, 0xff, (size_t)whole * block);
    for (uint32_t i = 0; i < block; i++)
        c->bytes[at + whole * block + i] = (uint8_t)chip_draw(c);
    longjmp(c->lost, 1);
}

/* So many bytes have changed, the word behind them is torn. */
static void chip_tear(struct chip *c, uint32_t at, const uint8_t *to,
                      uint32_t size) {
    uint32_t whole = chip_draw(c) % (size + 1);
    memcpy(c->bytes + at, to, whole);
    for (uint32_t i = whole; i < size && i < whole + 4; i++) {
        uint8_t *byte = &c->bytes[at + i];
        *byte = (uint8_t)(*byte ^ ((*byte ^ to[i]) & chip_draw(c)));
    }
    longjmp(c->lost, 1);
}

/* Whether power is lost in the midst of this operation. */
static bool chip_loses(struct chip *c) {
    c->done++;
    return c->until_loss >= 0 && c->until_loss-- == 0;
}

static void chip_spare(const struct chip *c, uint32_t at, uint32_t size) {
    assert_true(at + size <= c->sacred || at >= c->sacred + c->sacred_bytes);
}

static bool chip_program(void *context, uint32_t at, const void *bytes,
                         size_t size) {
    struct chip *c = context;
    uint8_t to[4096];
    const uint8_t *in = bytes;
    assert_true(size > 0 && size <= sizeof to);
    assert_true(size <= c->flash.page_bytes - at % c->flash.page_bytes);
    assert_true(at + size <= chip_size(c));
    chip_spare(c, at, (uint32_t)size);
    c->programs++;
    for (size_t i = 0; i < size; i++) {
        to[i] = c->bytes[at + i] & in[i];
        if (c->worn_out ||
            (c->worn != 0 && at / c->flash.sector_bytes == c->worn))
            to[i] = c->bytes[at + i] & (uint8_t)~1u;
    }
    if (chip_loses(c)) {
        if (c->flash.torn_bytes != 0)
            chip_tear_block(c, at, to, (uint32_t)size);
        chip_tear(c, at, to, (uint32_t)size);
    }
    memcpy(c->bytes + at, to, size);
    return true;
}

/* Of a torn erasure each byte may be old, new, or in between. */
static bool chip_erase(void *context, uint32_t sector) {
    struct chip *c = context;
    uint32_t size = c->flash.sector_bytes, at = sector * size;
    assert_true(sector < c->flash.sectors);
    chip_spare(c, at, size);
    c->erased++;
    bool loses = chip_loses(c);
    if (loses && c->flash.torn_bytes != 0)
        chip_tear_sector(c, at);
    uint32_t kind = chip_draw(c) % 4;
    for (uint32_t i = 0; i < size; i++) {
        uint8_t set = !loses || kind == 0             ? 0xff
                      : kind == 1                     ? (uint8_t)chip_draw(c)
                      : (i < size / 2) == (kind == 2) ? 0xff
                                                      : 0;
        c->bytes[at + i] |= set;
    }
    if (loses)
        longjmp(c->lost, 1);
    return true;
}

static void chip_make(struct chip *c, uint32_t sector, uint32_t page,
                      uint32_t sectors) {
    assert_true(sector * sectors <= CHIP_BYTES);
    memset(c, 0, offsetof(struct chip, lost));
    c->flash = (struct loader_flash){.context = c,
                                     .sector_bytes = sector,
                                     .page_bytes = page,
                                     .sectors = sectors,
                                     .read = chip_read,
                                     .program = chip_program,
                                     .erase = chip_erase,
                                     .worn = "it is worn"};
    memset(c->bytes, 0xff, chip_size(c));
    c->until_loss = -1;
    c->random = 1;
}

/* --- a suite -------------------------------------------------------------- */

struct quick_hash {
    uint32_t lane[SIGN_DIGEST_BYTES / 4], count;
};

static void quick_begin(void *hash) {
    memset(hash, 0, sizeof(struct quick_hash));
}

static void quick_add(void *hash, const void *bytes, size_t size) {
    struct quick_hash *h = hash;
    for (size_t i = 0; i < size; i++, h->count++) {
        uint32_t *lane = &h->lane[h->count % (SIGN_DIGEST_BYTES / 4)];
        *lane =
            (*lane ^ ((const uint8_t *)bytes)[i] ^ h->count << 8) * 16777619u;
    }
}

static void quick_end(void *hash, uint8_t digest[SIGN_DIGEST_BYTES]) {
    memcpy(digest, ((struct quick_hash *)hash)->lane, SIGN_DIGEST_BYTES);
}

static void quick_sign(uint8_t signature[SIGN_BYTES], const uint8_t *bytes,
                       size_t size, const uint8_t *key) {
    struct quick_hash hash;
    quick_begin(&hash);
    quick_add(&hash, key, SIGN_PUBLIC_BYTES);
    quick_add(&hash, bytes, size);
    quick_end(&hash, signature);
    memset(signature + SIGN_DIGEST_BYTES, 7, SIGN_DIGEST_BYTES);
}

static bool quick_good(const uint8_t signature[SIGN_BYTES],
                       const uint8_t *bytes, size_t size,
                       const uint8_t key[SIGN_PUBLIC_BYTES]) {
    uint8_t right[SIGN_BYTES];
    quick_sign(right, bytes, size, key);
    return memcmp(signature, right, sizeof right) == 0;
}

static const struct sign_suite quick = {quick_begin, quick_add, quick_end,
                                        quick_good};
static const uint8_t quick_key[SIGN_PUBLIC_BYTES] = {1, 2, 3};

static const struct loader_rules chip_rules = {
    &chip.flash, &quick,         quick_key, "mps2-an385",
    0x10000,     CHIP_IMAGE_MAX, NULL,      NULL};

/* --- images --------------------------------------------------------------- */

struct made {
    uint32_t bytes; /* header included */
    struct loader_image image;
    uint8_t all[CHIP_IMAGE_MAX];
};

static inline void made_seal(struct made *made) {
    struct quick_hash hash;
    loader_image_pack(&made->image, made->all);
    quick_begin(&hash);
    quick_add(&hash, made->all, LOADER_NAMED_BYTES);
    quick_add(&hash, made->all + LOADER_HEADER_BYTES, made->image.bytes);
    quick_end(&hash, made->image.digest);
    loader_image_pack(&made->image, made->all);
    quick_sign(made->image.signature, made->all, LOADER_SIGNED_BYTES,
               made->image.key);
    loader_image_pack(&made->image, made->all);
}

static inline void made_make(struct made *made, uint32_t bytes,
                             uint32_t number) {
    uint32_t random = number;
    memset(made, 0, sizeof *made);
    made->bytes = bytes;
    made->image.bytes = bytes - LOADER_HEADER_BYTES;
    made->image.address = chip_rules.address;
    made->image.number = number;
    strcpy(made->image.board, chip_rules.board);
    strcpy(made->image.version, "0.1.0");
    memcpy(made->image.key, quick_key, sizeof quick_key);
    for (uint32_t i = LOADER_HEADER_BYTES; i < bytes; i++) {
        random = random * 1664525u + 1013904223u;
        made->all[i] = (uint8_t)(random >> 24);
    }
    made_seal(made);
}

/* As an image does that comes up, from its start to its first neighbour. */
static inline bool chip_confirm(const struct chip *c, unsigned slot) {
    struct loader_state up;
    return !loader_slots_unconfirmed(&c->flash, slot, &up) ||
           loader_slots_confirm(&c->flash, &up);
}

/* --- a transfer ----------------------------------------------------------- */

static inline void chip_work(struct loader_incoming *in) {
    for (int i = 0; loader_incoming_busy(in); i++) {
        assert_true(i < 100000);
        loader_incoming_step(in);
    }
}

static inline void chip_begin(struct loader_incoming *in,
                              const struct made *made) {
    loader_incoming_begin(in, made->all, made->bytes);
    chip_work(in);
}

static inline void chip_block(struct loader_incoming *in,
                              const struct made *made, uint32_t block) {
    uint32_t at = block * LOADER_BLOCK_BYTES;
    uint32_t size = made->bytes - at < LOADER_BLOCK_BYTES ? made->bytes - at
                                                          : LOADER_BLOCK_BYTES;
    loader_incoming_block(in, block, made->all + at, size,
                          frame_crc32c(0, made->all + at, size));
    chip_work(in);
}

/* Every block that is not held, as often as it takes. */
static inline void chip_bring(struct loader_incoming *in,
                              const struct made *made) {
    for (int pass = 0; pass < 8 && in->phase == LOADER_TAKES; pass++) {
        for (uint32_t b = 0; b < in->blocks; b++)
            if ((in->map[b / 8] >> b % 8 & 1) == 0)
                chip_block(in, made, b);
    }
}

static inline void chip_verify(struct loader_incoming *in) {
    loader_incoming_verify(in);
    chip_work(in);
}

#endif
