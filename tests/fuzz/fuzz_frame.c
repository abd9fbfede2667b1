/* Any bytes at all into a link's receiving end, some of them wrapped into
 * frames whose checks are right, so that the fuzzer gets past them: whatever
 * comes, the link keeps within its memory and its bounds. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "transport/check.h"
#include "transport/frame.h"
#include "transport/link.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* What is yet to be received; what the link sent last. */
struct stream {
    uint8_t bytes[4096];
    size_t begin, end;
    uint8_t sent[4096];
    size_t sent_size;
};

static int take(void *context, uint8_t *bytes, size_t size) {
    struct stream *s = context;
    size_t left = s->end - s->begin;
    size = size < left ? size : left;
    memcpy(bytes, s->bytes + s->begin, size);
    s->begin += size;
    return (int)size;
}

static int give(void *context, const uint8_t *bytes, size_t size) {
    struct stream *s = context;
    s->sent_size = size < sizeof s->sent ? size : sizeof s->sent;
    memcpy(s->sent, bytes, s->sent_size);
    return (int)size;
}

/* The session that the link put into its last frame tells nothing of the one
 * that it expects: that is computed as PROTOCOL.md says. */
static uint32_t session(uint32_t epoch, uint32_t to_epoch) {
    uint8_t bytes[12] = {(uint8_t)epoch,
                         (uint8_t)(epoch >> 8),
                         (uint8_t)(epoch >> 16),
                         (uint8_t)(epoch >> 24),
                         (uint8_t)to_epoch,
                         (uint8_t)(to_epoch >> 8),
                         0,
                         0,
                         2,
                         0,
                         1,
                         0};
    return frame_crc32c(0, bytes, sizeof bytes);
}

struct input {
    const uint8_t *data;
    size_t size;
};

static unsigned next_byte(struct input *in) {
    if (in->size == 0)
        return 0;
    in->size--;
    return *in->data++;
}

/* A frame with sound checks around bytes of the fuzzer's choice. */
static void put_frame(struct stream *s, struct input *in, uint32_t epoch) {
    uint8_t payload[256] = {0};
    struct frame_header h = {.kind = next_byte(in) & 15,
                             .flags = next_byte(in) & 15,
                             .credit = (uint8_t)next_byte(in)};
    h.sequence = (uint16_t)(epoch + next_byte(in));
    h.acknowledge = (uint16_t)(0x123 + next_byte(in));
    h.size = (uint16_t)next_byte(in);
    h.session = session(epoch, 0x123);
    for (unsigned i = 0; i < h.size; i++)
        payload[i] = (uint8_t)next_byte(in);
    if (h.kind == 1 && h.size == 0) {
        /* A greeting that fits, but for its sixth byte on. */
        const uint8_t hello[24] = {1,
                                   0,
                                   2,
                                   0,
                                   1,
                                   0,
                                   0,
                                   0,
                                   (uint8_t)epoch,
                                   (uint8_t)(epoch >> 8),
                                   0,
                                   0,
                                   0x23,
                                   1,
                                   0,
                                   0,
                                   4,
                                   0,
                                   64,
                                   0,
                                   200,
                                   0,
                                   0,
                                   0};
        memcpy(payload, hello, sizeof hello);
        h.size = sizeof hello;
    }
    s->end += frame_encode(s->bytes + s->end, &h, payload);
}

static void check_message(const struct link_message *message) {
    volatile uint8_t sum = 0;
    LINK_ASSERT(message->size <= 200);
    for (size_t i = 0; i < message->size; i++)
        sum = (uint8_t)(sum + message->data[i]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct stream stream = {.end = 0};
    struct input in = {data, size};
    struct link_config c = {.pipe = {&stream, give, take},
                            .epoch = 0x123,
                            .node = 1,
                            .peer_node = 2,
                            .window = 4,
                            .frame_payload = 64,
                            .message_max = 200};
    size_t bytes = link_bytes(&c);
    void *memory = malloc(bytes);
    struct link *link = memory == NULL ? NULL : link_init(memory, bytes, &c);
    LINK_ASSERT(link != NULL);
    uint64_t now_us = 0;
    while (in.size > 0) {
        unsigned what = next_byte(&in), count = next_byte(&in) % 64;
        struct link_message message;
        if (stream.begin == stream.end)
            stream.begin = stream.end = 0;
        if (stream.end + 700 > sizeof stream.bytes)
            stream.begin = stream.end = 0;
        if (what % 4 == 0)
            for (unsigned i = 0; i < count; i++)
                stream.bytes[stream.end++] = (uint8_t)next_byte(&in);
        else if (what % 4 < 3)
            put_frame(&stream, &in, 0xfff0u + what / 4 % 4);
        else
            link_write(link, "head", 4, memory, count);
        now_us += 1000 * (uint64_t)count;
        link_poll(link, now_us);
        if (what < 200 && link_read(link, &message)) {
            check_message(&message);
            link_release(link);
        }
        LINK_ASSERT(link_next_due_us(link, now_us) < 3000000);
    }
    free(memory);
    return 0;
}
