#include "frame.h"

#include <string.h>

#include "bytes.h"
#include "check.h"

/* The machine's word, with the first byte in memory lowest. */
#if UINTPTR_MAX > 0xffffffffu
typedef uint64_t word;
#define FIRST_ZERO(marks) ((unsigned)__builtin_ctzll(marks) / 8)
#define SWAP(w) __builtin_bswap64(w)
#else
typedef uint32_t word;
#define FIRST_ZERO(marks) ((unsigned)__builtin_ctz(marks) / 8)
#define SWAP(w) __builtin_bswap32(w)
#endif

enum { WORD = sizeof(word), RUN_MAX = 254 };

#define EACH_BYTE(value) ((word)-1 / 255 * (value))

static inline word load_word(const uint8_t *p) {
    word w;
    memcpy(&w, p, sizeof w);
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    w = SWAP(w);
#endif
    return w;
}

/* 0x80 in each byte that is zero in w, and 0 elsewhere: no carry crosses. */
static inline word zero_marks(word w) {
    word low = EACH_BYTE(0x7f);
    return ~(((w & low) + low) | w | low);
}

/* --- checks --------------------------------------------------------------- */

/* remainders[c][k][n]: what check c makes of four bits n that 4 k zero bits
 * follow.  A check is linear, so a row holds the sums of what its four bits
 * make, each of which is the next higher one a step of the polynomial on: the
 * numbers here are those of the highest bits.  The tests compute the checks
 * anew, bit by bit. */
#define STEP(poly, bit) ((bit) >> 1 ^ (((bit)&1) != 0 ? (poly) : 0))
#define SUMS(a, b, c, d)                                                       \
    {                                                                          \
        0, d, c, (c) ^ (d), b, (b) ^ (d), (b) ^ (c), (b) ^ (c) ^ (d), a,       \
            (a) ^ (d), (a) ^ (c), (a) ^ (c) ^ (d), (a) ^ (b), (a) ^ (b) ^ (d), \
            (a) ^ (b) ^ (c), (a) ^ (b) ^ (c) ^ (d)                             \
    }
#define ROW(poly, bit)                                                         \
    SUMS(bit, STEP(poly, bit), STEP(poly, STEP(poly, bit)),                    \
         STEP(poly, STEP(poly, STEP(poly, bit))))

enum { CRC32C, CRC16, CHECKS, ROWS = 8 };

#define CASTAGNOLI 0x82f63b78u
#define DNP 0xa6bcu

static const uint32_t remainders[CHECKS][ROWS][16] = {
    {
        ROW(CASTAGNOLI, 0x82f63b78u),
        ROW(CASTAGNOLI, 0x8ad958cfu),
        ROW(CASTAGNOLI, 0xfbc3faf9u),
        ROW(CASTAGNOLI, 0x9d14c3b8u),
        ROW(CASTAGNOLI, 0x8b277743u),
        ROW(CASTAGNOLI, 0x38513ec5u),
        ROW(CASTAGNOLI, 0x52a0c93fu),
        ROW(CASTAGNOLI, 0xf64463e6u),
    },
    {
        ROW(DNP, 0xa6bcu),
        ROW(DNP, 0xff89u),
        ROW(DNP, 0x1b2fu),
        ROW(DNP, 0x6f94u),
        ROW(DNP, 0x55a7u),
        ROW(DNP, 0xcdc0u),
        ROW(DNP, 0x0cdcu),
        ROW(DNP, 0xf52fu),
    },
};

/* A check, four bytes on: crc is the last result, exclusive-or them. */
static inline uint32_t after_word(unsigned check, uint32_t crc) {
    const uint32_t(*t)[16] = remainders[check];
    return t[7][crc & 15] ^ t[6][crc >> 4 & 15] ^ t[5][crc >> 8 & 15] ^
           t[4][crc >> 12 & 15] ^ t[3][crc >> 16 & 15] ^ t[2][crc >> 20 & 15] ^
           t[1][crc >> 24 & 15] ^ t[0][crc >> 28];
}

static inline uint32_t after_byte(unsigned check, uint32_t crc) {
    const uint32_t(*t)[16] = remainders[check];
    return t[1][crc & 15] ^ t[0][crc >> 4 & 15] ^ crc >> 8;
}

static inline uint32_t by_table(unsigned check, uint32_t crc,
                                const uint8_t *bytes, size_t size) {
    const uint8_t *p = bytes;
    for (; size >= 4; size -= 4, p += 4)
        crc = after_word(check, crc ^ bytes_get32(p));
    for (; size > 0; size--)
        crc = after_byte(check, crc ^ *p++);
    return crc;
}

uint32_t frame_crc32c_table(uint32_t crc, const void *bytes, size_t size) {
    return ~by_table(CRC32C, ~crc, bytes, size);
}

#if defined(__SSE4_2__) && defined(__x86_64__)
/* The processor's own: eight bytes an instruction. */
uint32_t frame_crc32c(uint32_t crc, const void *bytes, size_t size) {
    const uint8_t *p = bytes;
    uint64_t c = ~crc;
    for (; size >= 8; size -= 8, p += 8) {
        uint64_t w;
        memcpy(&w, p, sizeof w);
        c = __builtin_ia32_crc32di(c, w);
    }
    for (; size > 0; size--)
        c = __builtin_ia32_crc32qi((uint32_t)c, *p++);
    return ~(uint32_t)c;
}
#else
uint32_t frame_crc32c(uint32_t crc, const void *bytes, size_t size) {
    return frame_crc32c_table(crc, bytes, size);
}
#endif

uint16_t frame_crc16(const void *bytes, size_t size) {
    return (uint16_t)~by_table(CRC16, 0, bytes, size);
}

size_t frame_find_zero(const uint8_t *bytes, size_t size) {
    size_t i = 0;
    for (; size - i >= WORD; i += WORD) {
        word marks = zero_marks(load_word(bytes + i));
        if (marks != 0)
            return i + FIRST_ZERO(marks);
    }
    while (i < size && bytes[i] != 0)
        i++;
    return i;
}

/* --- encoding ------------------------------------------------------------- */

/* out == code + 1 + run: the code of the open run is written when it ends. */
struct writer {
    uint8_t *out, *code;
    unsigned run;
};

static inline void end_run(struct writer *w, unsigned code) {
    *w->code = (uint8_t)code;
    w->code = w->out++;
    w->run = 0;
}

static void put_bytes(struct writer *w, const uint8_t *in, size_t size) {
    while (size > 0) {
        size--;
        if (*in != 0) {
            *w->out++ = *in++;
            if (++w->run == RUN_MAX)
                end_run(w, RUN_MAX + 1);
        } else {
            in++;
            end_run(w, w->run + 1);
        }
    }
}

/* A zero keeps its place and becomes the code of the run after it, so words
 * are copied whole and their zeros overwritten.  Writes up to FRAME_SLACK bytes
 * past the end. */
static void put_words(struct writer *w, const uint8_t *in, size_t size) {
    uint8_t *out = w->out, *code = w->code;
    unsigned run = w->run;
    while (size >= WORD) {
        word bytes = load_word(in), marks = zero_marks(bytes);
        unsigned step = RUN_MAX - run < WORD ? RUN_MAX - run : WORD;
        memcpy(out, in, WORD);
        if (step < WORD)
            marks &= ((word)1 << 8 * step) - 1;
        if (marks == 0) {
            run += step;
        } else {
            unsigned at = FIRST_ZERO(marks);
            *code = (uint8_t)(run + at + 1);
            code = out + at;
            marks &= marks - 1;
            while (marks != 0) {
                unsigned next = FIRST_ZERO(marks);
                *code = (uint8_t)(next - at);
                code = out + next;
                at = next;
                marks &= marks - 1;
            }
            run = step - 1 - at;
        }
        in += step;
        out += step;
        size -= step;
        if (run == RUN_MAX) {
            *code = RUN_MAX + 1;
            code = out++;
            run = 0;
        }
    }
    w->out = out;
    w->code = code;
    w->run = run;
    put_bytes(w, in, size);
}

/* By words, as the checks read them. */
static void pack_header(uint8_t *bytes, const struct frame_header *h) {
    bytes_put32(bytes, h->kind | (uint32_t)h->flags << 4 |
                           (uint32_t)h->credit << 8 | h->session << 16);
    bytes_put32(bytes + 4, h->session >> 16 | (uint32_t)h->sequence << 16);
    bytes_put32(bytes + 8, h->acknowledge | (uint32_t)h->size << 16);
    uint16_t check = frame_crc16(bytes, FRAME_HEADER - 2);
    bytes_put16(bytes + 12, check);
}

static void unpack_header(struct frame_header *h, const uint8_t *bytes) {
    h->kind = bytes[0] & 15;
    h->flags = bytes[0] >> 4;
    h->credit = bytes[1];
    h->session = bytes_get32(bytes + 2);
    h->sequence = bytes_get16(bytes + 6);
    h->acknowledge = bytes_get16(bytes + 8);
    h->size = bytes_get16(bytes + 10);
}

size_t frame_encode(uint8_t *out, const struct frame_header *header,
                    const void *payload) {
    uint8_t head[FRAME_HEADER], tail[FRAME_TRAILER];
    struct writer w = {out + 1, out, 0};
    LINK_ASSERT(header->kind < 16 && header->flags < 16);
    pack_header(head, header);
    uint32_t crc = frame_crc32c(0, head, sizeof head);
    if (header->size > 0)
        crc = frame_crc32c(crc, payload, header->size);
    bytes_put32(tail, crc);
    put_words(&w, head, sizeof head);
    if (header->size > 0)
        put_words(&w, payload, header->size);
    put_bytes(&w, tail, sizeof tail);
    /* A run of 254 that ends the frame leaves an empty run behind it: its code
     * of 1 is right (no zero follows the last run) and keeps one rule. */
    *w.code = (uint8_t)(w.run + 1);
    *w.out++ = 0;
    return (size_t)(w.out - out);
}

/* --- decoding ------------------------------------------------------------- */

enum { BLOCK = 16 };

/* memcpy in blocks, cheaper than a call for runs of at most 254 bytes; `spare`
 * bytes, at least `run`, may be read and written. */
static inline void copy_run(uint8_t *out, const uint8_t *in, size_t run,
                            size_t spare) {
    size_t i = 0;
    for (; i < run && spare - i >= BLOCK; i += BLOCK)
        memcpy(out + i, in + i, BLOCK);
    for (; i < run; i++)
        out[i] = in[i];
}

/* Decodes exactly `size` bytes; 0, or -1 where the frame ends before. */
static int take_bytes(struct frame_reader *r, uint8_t *out, size_t size) {
    while (size > 0) {
        if (r->run == 0) {
            if (r->in == r->end)
                return -1;
            unsigned code = *r->in++, due = r->zero_due;
            r->run = code - 1;
            r->zero_due = code <= RUN_MAX;
            if (due) {
                *out++ = 0;
                size--;
                continue;
            }
        }
        size_t left = (size_t)(r->end - r->in);
        size_t run = r->run < size ? r->run : size;
        if (run > left)
            return -1;
        copy_run(out, r->in, run, size < left ? size : left);
        r->in += run;
        r->run -= (unsigned)run;
        out += run;
        size -= run;
    }
    return 0;
}

enum frame_result frame_open(struct frame_reader *reader, const uint8_t *in,
                             size_t size, struct frame_header *header) {
    uint8_t head[FRAME_HEADER];
    *reader = (struct frame_reader){in, in + size, 0, 0, 0};
    if (take_bytes(reader, head, sizeof head) != 0)
        return FRAME_BAD_CODE;
    unsigned check = bytes_get16(head + 12);
    if (frame_crc16(head, FRAME_HEADER - 2) != check)
        return FRAME_BAD_HEADER;
    unpack_header(header, head);
    reader->crc = frame_crc32c(0, head, sizeof head);
    return FRAME_GOOD;
}

enum frame_result frame_take(struct frame_reader *reader,
                             const struct frame_header *header, void *payload) {
    uint8_t tail[FRAME_TRAILER];
    if (take_bytes(reader, payload, header->size) != 0 ||
        take_bytes(reader, tail, sizeof tail) != 0)
        return FRAME_BAD_CODE;
    /* What is left may only be the empty run after one of 254. */
    if (reader->run == 0 && !reader->zero_due &&
        reader->end - reader->in == 1 && *reader->in == 1)
        reader->in++;
    if (reader->run != 0 || reader->in != reader->end)
        return FRAME_BAD_CODE;
    uint32_t crc = frame_crc32c(reader->crc, payload, header->size);
    return crc == bytes_get32(tail) ? FRAME_GOOD : FRAME_BAD_CRC;
}

bool frame_decode(const uint8_t *in, size_t size, struct frame_header *header,
                  void *payload, size_t most) {
    struct frame_reader reader;
    return frame_open(&reader, in, size, header) == FRAME_GOOD &&
           header->size <= most &&
           frame_take(&reader, header, payload) == FRAME_GOOD;
}
