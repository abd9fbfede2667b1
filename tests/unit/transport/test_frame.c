/* Frames: the checks against their published values, COBS at its edges, and
 * no bytes at all that make the reader believe what was not sent. */
#include <stdbool.h>

#include "transport/frame.h"
#include "tests/unit/test.h"

enum { PAYLOAD_MAX = 1616 };

static uint64_t state = 88172645463325252u;

static uint32_t draw(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32);
}

/* With many zeros among its bytes. */
static uint32_t draw_sparse(void) {
    uint32_t mask = draw();
    return mask & draw();
}

/* --- checks, bit by bit --------------------------------------------------- */

static uint32_t slow_crc(const uint8_t *p, size_t size, uint32_t polynomial,
                         uint32_t start) {
    uint32_t crc = start;
    for (size_t i = 0; i < size; i++) {
        crc ^= p[i];
        for (int bit = 0; bit < 8; bit++)
            crc = (crc & 1) != 0 ? crc >> 1 ^ polynomial : crc >> 1;
    }
    return crc;
}

TEST(checks_have_their_published_values) {
    uint8_t bytes[32];
    /* CRC catalogue, "123456789". */
    assert_int_equal(frame_crc32c(0, "123456789", 9), 0xe3069283);
    assert_int_equal(frame_crc32c_table(0, "123456789", 9), 0xe3069283);
    assert_int_equal(frame_crc16("123456789", 9), 0xea82);
    /* RFC 3720, B.4. */
    memset(bytes, 0, 32);
    assert_int_equal(frame_crc32c(0, bytes, 32), 0x8a9136aa);
    memset(bytes, 0xff, 32);
    assert_int_equal(frame_crc32c(0, bytes, 32), 0x62a8ab43);
    for (unsigned i = 0; i < 32; i++)
        bytes[i] = (uint8_t)i;
    assert_int_equal(frame_crc32c(0, bytes, 32), 0x46dd794e);
    assert_int_equal(frame_crc32c_table(0, bytes, 32), 0x46dd794e);
}

TEST(checks_follow_their_definition) {
    uint8_t bytes[300];
    for (unsigned round = 0; round < 2000; round++) {
        size_t from = draw() % 9, size = draw() % 280, part = draw() % 280;
        for (size_t i = 0; i < sizeof bytes; i++)
            bytes[i] = (uint8_t)draw();
        part = part < size ? part : size;
        uint32_t want = ~slow_crc(bytes + from, size, 0x82f63b78, 0xffffffff);
        uint32_t whole = frame_crc32c(0, bytes + from, size);
        uint32_t halves = frame_crc32c(frame_crc32c(0, bytes + from, part),
                                       bytes + from + part, size - part);
        assert_int_equal(whole, want);
        assert_int_equal(halves, want);
        assert_int_equal(frame_crc32c_table(0, bytes + from, size), want);
        uint32_t want16 = slow_crc(bytes + from, size, 0xa6bc, 0) ^ 0xffff;
        assert_int_equal(frame_crc16(bytes + from, size), want16);
    }
}

TEST(zeros_are_found) {
    uint8_t bytes[80];
    for (size_t from = 0; from < 9; from++) {
        for (size_t at = from; at < sizeof bytes; at++) {
            memset(bytes, 1, sizeof bytes);
            bytes[at] = 0;
            bytes[from > 0 ? from - 1 : at] = 0;
            for (size_t size = 0; from + size <= sizeof bytes; size++) {
                size_t want = at - from < size ? at - from : size;
                assert_int_equal(frame_find_zero(bytes + from, size), want);
            }
        }
        memset(bytes, 0x80, sizeof bytes);
        assert_int_equal(frame_find_zero(bytes + from, 70), 70);
    }
}

/* --- encoding ------------------------------------------------------------- */

/* COBS as its authors define it, a byte at a time. */
static size_t slow_cobs(uint8_t *out, const uint8_t *in, size_t size) {
    size_t at = 1, code_at = 0;
    unsigned code = 1;
    for (size_t i = 0; i < size; i++) {
        if (in[i] != 0) {
            out[at++] = in[i];
            code++;
        }
        if (in[i] == 0 || code == 255) {
            out[code_at] = (uint8_t)code;
            code_at = at++;
            code = 1;
        }
    }
    out[code_at] = (uint8_t)code;
    out[at++] = 0;
    return at;
}

struct sample {
    struct frame_header header;
    uint8_t payload[PAYLOAD_MAX];
    uint8_t encoded[FRAME_ENCODED(PAYLOAD_MAX) + FRAME_SLACK];
    size_t size;
};

static void encode(struct sample *s, size_t size) {
    s->header = (struct frame_header){.kind = draw() & 15,
                                      .flags = draw() & 15,
                                      .credit = (uint8_t)draw(),
                                      .session = draw_sparse(),
                                      .sequence = (uint16_t)draw(),
                                      .acknowledge = (uint16_t)draw(),
                                      .size = (uint16_t)size};
    memset(s->encoded, 0xaa, sizeof s->encoded);
    s->size = frame_encode(s->encoded, &s->header, s->payload);
}

/* The bytes as PROTOCOL.md gives them, put together anew. */
static void expect_bytes(const struct sample *s) {
    uint8_t plain[PAYLOAD_MAX + FRAME_HEADER + FRAME_TRAILER];
    uint8_t want[FRAME_ENCODED(PAYLOAD_MAX)];
    const struct frame_header *h = &s->header;
    size_t size = h->size;
    plain[0] = (uint8_t)(h->kind | h->flags << 4);
    plain[1] = h->credit;
    for (int i = 0; i < 4; i++)
        plain[2 + i] = (uint8_t)(h->session >> 8 * i);
    for (int i = 0; i < 2; i++) {
        plain[6 + i] = (uint8_t)(h->sequence >> 8 * i);
        plain[8 + i] = (uint8_t)(h->acknowledge >> 8 * i);
        plain[10 + i] = (uint8_t)(h->size >> 8 * i);
    }
    uint32_t check = slow_crc(plain, 12, 0xa6bc, 0) ^ 0xffff;
    plain[12] = (uint8_t)check;
    plain[13] = (uint8_t)(check >> 8);
    memcpy(plain + 14, s->payload, size);
    uint32_t crc = ~slow_crc(plain, 14 + size, 0x82f63b78, 0xffffffff);
    for (int i = 0; i < 4; i++)
        plain[14 + size + (size_t)i] = (uint8_t)(crc >> 8 * i);
    size_t length = slow_cobs(want, plain, 18 + size);
    assert_int_equal(s->size, length);
    assert_memory_equal(s->encoded, want, length);
    assert_true(s->size <= FRAME_ENCODED(size));
    assert_int_equal(frame_find_zero(s->encoded, s->size), s->size - 1);
}

/* Into a buffer of the payload's size, so that a sanitizer sees one byte too
 * many, and from a copy without slack. */
static enum frame_result decode(const uint8_t *encoded, size_t size,
                                struct frame_header *header,
                                const struct sample *want) {
    struct frame_reader reader;
    uint8_t *copy = malloc(size + 1);
    assert_non_null(copy);
    memcpy(copy, encoded, size);
    enum frame_result result = frame_open(&reader, copy, size, header);
    if (result == FRAME_GOOD && header->size > PAYLOAD_MAX) {
        result = FRAME_BAD_CRC; /* a header that was right by chance */
    } else if (result == FRAME_GOOD) {
        uint8_t *payload = malloc(header->size + 1u);
        assert_non_null(payload);
        result = frame_take(&reader, header, payload);
        if (result == FRAME_GOOD && want != NULL) {
            assert_int_equal(header->size, want->header.size);
            assert_memory_equal(payload, want->payload, header->size);
        }
        assert_true(frame_decode(copy, size, header, payload, header->size) ==
                    (result == FRAME_GOOD));
        assert_false(
            header->size > 0 &&
            frame_decode(copy, size, header, payload, header->size - 1u));
        free(payload);
    }
    free(copy);
    return result;
}

static void round_trip(struct sample *s, size_t size) {
    struct frame_header header;
    encode(s, size);
    expect_bytes(s);
    assert_int_equal(decode(s->encoded, s->size - 1, &header, s), FRAME_GOOD);
    assert_int_equal(header.kind, s->header.kind);
    assert_int_equal(header.flags, s->header.flags);
    assert_int_equal(header.credit, s->header.credit);
    assert_int_equal(header.session, s->header.session);
    assert_int_equal(header.sequence, s->header.sequence);
    assert_int_equal(header.acknowledge, s->header.acknowledge);
}

TEST(every_size_and_density_of_zeros) {
    static struct sample s;
    const unsigned one_in[] = {1, 2, 3, 8, 40, 254, 0};
    for (unsigned k = 0; k < sizeof one_in / sizeof one_in[0]; k++) {
        for (size_t size = 0; size <= PAYLOAD_MAX;
             size += size < 600 ? 1 : 13) {
            for (size_t i = 0; i < size; i++) {
                bool zero = one_in[k] != 0 && draw() % one_in[k] == 0;
                s.payload[i] = zero ? 0 : (uint8_t)(1 + draw() % 255);
            }
            round_trip(&s, size);
        }
    }
}

/* A single zero at each place around the length of a full run. */
TEST(runs_of_253_to_256) {
    static struct sample s;
    for (size_t size = 225; size < 275; size++) {
        for (size_t at = 225; at < size; at++) {
            memset(s.payload, 7, sizeof s.payload);
            s.payload[at] = 0;
            round_trip(&s, size);
        }
        memset(s.payload, 7, sizeof s.payload);
        round_trip(&s, size);
    }
    for (size_t size = 480; size < 540; size++) {
        memset(s.payload, 255, sizeof s.payload);
        round_trip(&s, size);
    }
}

/* Whether the last run but an empty one is full. */
static bool ends_full(const struct sample *s) {
    size_t at = 0, last = 0;
    while (at + s->encoded[at] < s->size - 1) {
        last = at;
        at += s->encoded[at];
    }
    return s->encoded[at] == 1 && at == s->size - 2 && s->encoded[last] == 255;
}

/* A frame that ends with a full run may be closed with the code 1 or without:
 * encoders differ. */
TEST(both_ends_of_a_full_run) {
    static struct sample s;
    struct frame_header header;
    unsigned seen = 0;
    memset(s.payload, 9, sizeof s.payload);
    for (size_t round = 0; round < 1000 && seen < 20; round++) {
        /* The zero above the size is the last: 2 + 248 + 4 bytes follow. */
        encode(&s, 248);
        if (ends_full(&s)) {
            assert_int_equal(decode(s.encoded, s.size - 1, &header, &s),
                             FRAME_GOOD);
            assert_int_equal(decode(s.encoded, s.size - 2, &header, &s),
                             FRAME_GOOD);
            seen++;
        }
    }
    assert_int_equal(seen, 20);
}

/* --- damage --------------------------------------------------------------- */

TEST(each_wrong_bit_is_found) {
    static struct sample s;
    const size_t sizes[] = {0, 1, 24, 240, 500};
    for (unsigned k = 0; k < 5; k++) {
        for (size_t i = 0; i < sizes[k]; i++)
            s.payload[i] = (uint8_t)(draw_sparse());
        encode(&s, sizes[k]);
        for (size_t bit = 0; bit < 8 * (s.size - 1); bit++) {
            struct frame_header header;
            s.encoded[bit / 8] ^= (uint8_t)(1 << bit % 8);
            /* A byte that becomes 0 would cut the frame in two. */
            size_t cut = frame_find_zero(s.encoded, s.size - 1);
            assert_int_not_equal(decode(s.encoded, cut, &header, NULL),
                                 FRAME_GOOD);
            s.encoded[bit / 8] ^= (uint8_t)(1 << bit % 8);
        }
    }
}

TEST(lost_and_inserted_bytes_are_found) {
    static struct sample s;
    uint8_t damaged[FRAME_ENCODED(PAYLOAD_MAX) + 1];
    struct frame_header header;
    for (size_t i = 0; i < 300; i++)
        s.payload[i] = (uint8_t)draw();
    encode(&s, 300);
    size_t size = s.size - 1;
    for (size_t at = 0; at < size; at++) {
        memcpy(damaged, s.encoded, at);
        memcpy(damaged + at, s.encoded + at + 1, size - at - 1);
        assert_int_not_equal(decode(damaged, size - 1, &header, NULL),
                             FRAME_GOOD);
        assert_int_not_equal(decode(s.encoded, at, &header, NULL), FRAME_GOOD);
        for (unsigned value = 1; value < 256; value += 51) {
            memcpy(damaged, s.encoded, at);
            damaged[at] = (uint8_t)value;
            memcpy(damaged + at + 1, s.encoded + at, size - at);
            assert_int_not_equal(decode(damaged, size + 1, &header, NULL),
                                 FRAME_GOOD);
        }
    }
}

TEST(garbage_is_no_frame) {
    uint8_t garbage[700] = {0};
    struct frame_header header;
    unsigned opened = 0;
    for (unsigned round = 0; round < 300000; round++) {
        size_t size = draw() % (round % 16 == 0 ? sizeof garbage : 64);
        for (size_t i = 0; i < size; i++)
            garbage[i] = (uint8_t)(1 + draw() % (round % 2 ? 255 : 20));
        enum frame_result result = decode(garbage, size, &header, NULL);
        assert_int_not_equal(result, FRAME_GOOD);
        opened += result == FRAME_BAD_CRC;
    }
    /* The header's check lets one in 65,536 pass. */
    assert_true(opened < 30);
}
