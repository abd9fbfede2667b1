/* Two links over pipes that a script of bytes spoils: bits flip, bytes vanish,
 * appear and repeat, pipes close, frames are forged.  Once the spoiling stops,
 * every message has arrived, once and in order; with forged frames only
 * memory is at stake, and the sizes of what is read.
 *
 * Messages of one end are numbered: the first byte is the number, the others
 * follow from it. */
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "transport/frame.h"
#include "transport/link.h"

enum {
    PIPE = 4096,
    WINDOW = 4,
    PAYLOAD = 64,
    MESSAGE = 150,
    MEMORY = 16384,
    PATIENCE = 20000 /* polls until all must have arrived */
};

struct pipe {
    uint8_t bytes[PIPE];
    size_t count;
    bool closed;
};

struct end {
    struct link *link;
    struct pipe *out, *in;
    uint8_t sent, received;
    _Alignas(64) uint8_t memory[MEMORY];
};

struct script {
    const uint8_t *bytes;
    size_t size;
};

static uint8_t next(struct script *script) {
    if (script->size == 0)
        return 0;
    script->size--;
    return *script->bytes++;
}

static int pipe_send(void *context, const uint8_t *bytes, size_t size) {
    struct pipe *pipe = ((struct end *)context)->out;
    size_t room = PIPE - pipe->count;
    if (pipe->closed)
        return LINK_PIPE_CLOSED;
    size = size < room ? size : room;
    memcpy(pipe->bytes + pipe->count, bytes, size);
    pipe->count += size;
    return (int)size;
}

static int pipe_receive(void *context, uint8_t *bytes, size_t size) {
    struct pipe *pipe = ((struct end *)context)->in;
    if (pipe->closed)
        return LINK_PIPE_CLOSED;
    size = size < pipe->count ? size : pipe->count;
    memcpy(bytes, pipe->bytes, size);
    memmove(pipe->bytes, pipe->bytes + size, pipe->count - size);
    pipe->count -= size;
    return (int)size;
}

static size_t message_size(uint8_t number) {
    return 1 + number * 37u % MESSAGE;
}

static void write_message(struct end *end) {
    uint8_t data[MESSAGE];
    size_t size = message_size(end->sent);
    for (size_t i = 0; i < size; i++)
        data[i] = (uint8_t)(end->sent + i * 7u);
    size_t head = size / 3;
    if (end->sent < 250 &&
        link_write(end->link, data, head, data + head, size - head) == 0)
        end->sent++;
}

static void read_messages(struct end *end, bool trusted) {
    struct link_message message;
    while (link_read(end->link, &message)) {
        if (message.size > MESSAGE)
            abort();
        bool right = message.size == message_size(end->received);
        for (size_t i = 0; trusted && i < message.size; i++)
            right &= message.data[i] == (uint8_t)(end->received + i * 7u);
        if (trusted && !right)
            abort();
        end->received++;
        link_release(end->link);
    }
}

static const uint8_t news[] = "what is so";

static void tell(struct end *end, bool ask) {
    link_put_datagram(end->link, news, 1 + end->sent % sizeof news, ask);
}

static void read_datagram(struct end *end, bool trusted) {
    struct link_message datagram;
    bool ask;
    if (!link_take_datagram(end->link, &datagram, &ask))
        return;
    if (datagram.size < 1 || datagram.size > LINK_DATAGRAM_MAX ||
        (trusted && (datagram.size > sizeof news ||
                     memcmp(datagram.data, news, datagram.size) != 0)))
        abort();
}

static void insert(struct pipe *pipe, size_t at, const uint8_t *bytes,
                   size_t size) {
    if (pipe->count + size > PIPE)
        return;
    memmove(pipe->bytes + at + size, pipe->bytes + at, pipe->count - at);
    memcpy(pipe->bytes + at, bytes, size);
    pipe->count += size;
}

/* A sound frame with fields from the script. */
static void forge(struct pipe *pipe, struct script *script) {
    uint8_t payload[PAYLOAD], frame[FRAME_ENCODED(PAYLOAD) + FRAME_SLACK];
    struct frame_header header = {0};
    header.kind = next(script) % 6;
    header.flags = next(script) % 16;
    header.credit = next(script);
    header.session = next(script);
    header.sequence = (uint16_t)(next(script) * 257u);
    header.acknowledge = (uint16_t)(next(script) * 257u);
    header.size = next(script) % (PAYLOAD + 1);
    for (size_t i = 0; i < header.size; i++)
        payload[i] = next(script);
    insert(pipe, pipe->count, frame, frame_encode(frame, &header, payload));
}

static void spoil(struct pipe *pipe, struct script *script) {
    uint8_t bytes[8] = {0};
    size_t at = pipe->count == 0 ? 0 : next(script) * 16u % pipe->count;
    size_t size = 1 + next(script) % 8u;
    size = size < pipe->count - at ? size : pipe->count - at;
    switch (next(script) % 5) {
    case 0:
        if (pipe->count > 0)
            pipe->bytes[at] ^= (uint8_t)(1u << next(script) % 8);
        break;
    case 1:
        memmove(pipe->bytes + at, pipe->bytes + at + size,
                pipe->count - at - size);
        pipe->count -= size;
        break;
    case 2:
        memcpy(bytes, pipe->bytes + at, size);
        insert(pipe, at, bytes, size);
        break;
    case 3:
        for (size_t i = 0; i < sizeof bytes; i++)
            bytes[i] = next(script);
        insert(pipe, at, bytes, sizeof bytes);
        break;
    default:
        pipe->closed = !pipe->closed;
        break;
    }
}

static void open_end(struct end *end, struct pipe *out, struct pipe *in,
                     uint16_t node) {
    struct link_config config = {0};
    config.pipe.context = end;
    config.pipe.send = pipe_send;
    config.pipe.receive = pipe_receive;
    config.epoch = 5u + node;
    config.node = node;
    config.peer_node = 1 - node;
    config.window = WINDOW;
    config.frame_payload = PAYLOAD;
    config.message_max = MESSAGE;
    end->out = out;
    end->in = in;
    end->sent = end->received = 0;
    end->link = link_init(end->memory, MEMORY, &config);
    if (end->link == NULL)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static struct end a, b;
    static struct pipe pipes[2];
    struct script script = {data, size};
    bool hostile = next(&script) % 4 == 0;
    uint64_t now = 1000000;
    memset(pipes, 0, sizeof pipes);
    open_end(&a, &pipes[0], &pipes[1], 0);
    open_end(&b, &pipes[1], &pipes[0], 1);
    while (script.size > 0) {
        uint8_t step = next(&script);
        struct pipe *pipe = &pipes[step >> 7];
        switch (step % 8) {
        case 0:
            write_message(step >> 7 ? &a : &b);
            break;
        case 1:
            spoil(pipe, &script);
            break;
        case 2:
            if (hostile)
                forge(pipe, &script);
            break;
        case 3:
            tell(step >> 7 ? &a : &b, (step & 8) != 0);
            break;
        default:
            now += 1u << (step >> 3) % 18;
            (void)link_poll(step >> 7 ? a.link : b.link, now);
            read_messages(step >> 7 ? &a : &b, !hostile);
            read_datagram(step >> 7 ? &a : &b, !hostile);
            break;
        }
    }
    pipes[0].closed = pipes[1].closed = false;
    for (int i = 0; !hostile && i < PATIENCE; i++) {
        now += 5000;
        (void)link_poll(a.link, now);
        (void)link_poll(b.link, now);
        read_messages(&a, true);
        read_messages(&b, true);
        if (a.received == b.sent && b.received == a.sent)
            return 0;
    }
    if (!hostile)
        abort();
    return 0;
}
