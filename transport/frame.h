/* Frames on a pipe of bytes: a header with a check of its own, a payload and a
 * CRC-32C over both, made free of zero bytes (COBS: Cheshire and Baker, 1999)
 * and closed by a zero.  A receiver finds the next frame at the next zero,
 * whatever precedes it, and uses no field before its check.
 *
 * Memory: none but a constant table of 1 KB.  Work: linear in the bytes given;
 * CRC-32C takes most of it where the processor does not compute it. */
#ifndef TRANSPORT_FRAME_H
#define TRANSPORT_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    FRAME_HEADER = 14, /* bytes, its check included */
    FRAME_TRAILER = 4, /* CRC-32C */
    FRAME_SLACK = 8    /* frame_encode may write so far past the frame */
};

/* Bytes on the wire, closing zero included, at most. */
#define FRAME_ENCODED(payload)                                                 \
    ((size_t)(payload) + FRAME_HEADER + FRAME_TRAILER + 2 +                    \
     ((size_t)(payload) + FRAME_HEADER + FRAME_TRAILER) / 254)

enum frame_result {
    FRAME_GOOD,
    FRAME_BAD_CODE,   /* no COBS, or another length than the header's */
    FRAME_BAD_HEADER, /* the header's check is false */
    FRAME_BAD_CRC     /* the CRC-32C is false */
};

struct frame_header {
    uint8_t kind;     /* 0 .. 15 */
    uint8_t flags;    /* 0 .. 15 */
    uint8_t credit;   /* frames beyond `acknowledge` that may be sent */
    uint32_t session; /* of the sender */
    uint16_t sequence, acknowledge;
    uint16_t size; /* bytes of payload */
};

/* A frame being decoded: its encoded bytes that are left. */
struct frame_reader {
    const uint8_t *in, *end;
    unsigned run;      /* bytes left that stand for themselves */
    unsigned zero_due; /* 1: a zero follows the run, if anything does */
    uint32_t crc;
};

/* CRC-32C (Castagnoli, reflected 0x82f63b78). crc: 0 at first, then the result
 * of the bytes before. */
uint32_t frame_crc32c(uint32_t crc, const void *bytes, size_t size);

/* The same by the table, on every machine: the reference of the tests. */
uint32_t frame_crc32c_table(uint32_t crc, const void *bytes, size_t size);

/* CRC-16/DNP (reflected 0xa6bc): detects up to 5 false bits in a header. */
uint16_t frame_crc16(const void *bytes, size_t size);

/* Offset of the first zero, or size. */
size_t frame_find_zero(const uint8_t *bytes, size_t size);

/* Encodes header.size bytes of payload; returns bytes written, closing zero
 * included.  out: FRAME_ENCODED(header.size) + FRAME_SLACK bytes. */
size_t frame_encode(uint8_t *out, const struct frame_header *header,
                    const void *payload);

/* Decodes the header of the `size` bytes between two zeros. */
enum frame_result frame_open(struct frame_reader *reader, const uint8_t *in,
                             size_t size, struct frame_header *header);

/* Decodes header->size bytes of payload and checks the whole.  Unless the
 * result is FRAME_GOOD, the content of payload has no meaning. */
enum frame_result frame_take(struct frame_reader *reader,
                             const struct frame_header *header, void *payload);

/* Decodes the header and payload of one frame, the `size` bytes between two
 * zeros.  True: the frame is good, and its payload has at most `most` bytes. */
bool frame_decode(const uint8_t *in, size_t size, struct frame_header *header,
                  void *payload, size_t most);

#endif
