#include "link_internal.h"

#include <string.h>

#include "check.h"

unsigned link_credit(const struct link *link)
{
    LINK_ASSERT(link->receive.ready <= link->config.window);
    return (unsigned)link->config.window - link->receive.ready;
}

static unsigned slot_of(const struct link *link, unsigned offset)
{
    unsigned slot = (unsigned)link->receive.head + link->receive.ready + offset;
    while (slot >= link->config.window) {
        slot -= link->config.window;
    }
    return slot;
}

/* Bit i: frame next + 1 + i is here. */
uint64_t link_sack(const struct link *link)
{
    uint64_t bits = 0;
    unsigned credit = link_credit(link);
    if (link->receive.early == 0) {
        return 0;
    }
    for (unsigned i = 1; i < credit; i++) {
        if (link->receive.slots[slot_of(link, i)].full) {
            bits |= (uint64_t)1 << (i - 1);
        }
    }
    return bits;
}

/* Whole messages of the old session stay to be read; the rest goes. */
void link_receive_reset(struct link *link, uint16_t first)
{
    struct link_receiver *r = &link->receive;
    r->ready = r->complete;
    r->early = 0;
    for (unsigned i = 0; i < link_credit(link); i++) {
        r->slots[slot_of(link, i)].full = false;
    }
    r->next = first;
    r->reported = (uint16_t)(first + link_credit(link));
    r->unreported = 0;
}

/* The frame in slot_of(0) joins those that are ready.  A message longer than
 * agreed can never be read: such a peer is refused. */
static void accept_next(struct link *link)
{
    struct link_receiver *r = &link->receive;
    struct link_receive_slot *slot = &r->slots[slot_of(link, 0)];
    unsigned before = (unsigned)r->ready - r->complete;
    size_t size = (size_t)before * link->config.frame_payload + slot->size;
    if (size > link->config.message_max ||
        (slot->more && before + 1u >= link->fragments_max)) {
        link->peer.refusal = LINK_WRONG_SIZES;
        link->up = false;
        return;
    }
    r->next++;
    r->ready++;
    if (!slot->more) {
        r->complete = r->ready;
    }
}

static void advance(struct link *link)
{
    struct link_receiver *r = &link->receive;
    accept_next(link);
    while (r->early > 0 && link_credit(link) > 0 && link->up &&
           r->slots[slot_of(link, 0)].full) {
        r->early--;
        accept_next(link);
    }
    if (r->ready + r->early > link->statistics.receive_high_water) {
        link->statistics.receive_high_water = (uint32_t)(r->ready + r->early);
    }
}

static void stored(struct link *link, unsigned offset)
{
    struct link_receiver *r = &link->receive;
    if (r->unreported++ == 0) {
        r->unreported_us = link->now_us;
    }
    if (offset > 0) {
        r->early++;
        r->ack_now = true;
        return;
    }
    r->ack_now |= r->early > 0;
    advance(link);
}

/* A frame's place is known before its payload is decoded, so it is decoded
 * where it stays. */
static enum frame_result take_data(struct link *link,
                                   struct frame_reader *reader,
                                   const struct frame_header *header)
{
    struct link_receiver *r = &link->receive;
    struct link_statistics *s = &link->statistics;
    unsigned offset = (uint16_t)(header->sequence - r->next);
    bool more = (header->flags & LINK_MORE) != 0;
    unsigned payload_max = link->config.frame_payload;
    if (offset >= link_credit(link)) {
        *(offset < 0x8000 ? &s->overruns : &s->duplicates) += 1;
        r->ack_now = true;
        return FRAME_GOOD;
    }
    if (header->size > payload_max || (more && header->size != payload_max)) {
        return FRAME_BAD_CODE;
    }
    unsigned at = slot_of(link, offset);
    struct link_receive_slot *slot = &r->slots[at];
    if (slot->full && offset > 0) {
        s->duplicates++;
        r->ack_now = true;
        return FRAME_GOOD;
    }
    enum frame_result result =
        frame_take(reader, header, r->payload + (size_t)at * payload_max);
    if (result == FRAME_GOOD) {
        s->frames_received++;
        slot->size = header->size;
        slot->more = more;
        slot->full = true;
        stored(link, offset);
        link_on_acknowledge(link, header, 0);
    }
    return result;
}

static void on_bye(struct link *link, const struct frame_header *header)
{
    link->bye_due = (header->flags & LINK_ASK) != 0;
    link->closed = true;
    link->up = false;
}

static void on_datagram(struct link *link, const struct frame_header *header,
                        const uint8_t *bytes)
{
    struct link_datagrams *n = &link->datagrams;
    memcpy(n->in, bytes, header->size);
    n->in_size = header->size;
    n->asked = (header->flags & LINK_ASK) != 0;
    n->heard = link->up;
}

/* Frames without data: a few bytes of payload at most. */
static enum frame_result take_control(struct link *link,
                                      struct frame_reader *reader,
                                      const struct frame_header *header)
{
    uint8_t bytes[LINK_DATAGRAM_MAX];
    uint64_t sack = 0;
    unsigned size = header->size;
    bool fits = header->kind == LINK_HELLO ? size == LINK_HELLO_SIZE
                : header->kind == LINK_ACK ? size == 0 || size == LINK_SACK_SIZE
                : header->kind == LINK_STATE
                    ? size >= 1 && size <= LINK_DATAGRAM_MAX
                    : size == 0;
    if (!fits) {
        return FRAME_BAD_CODE;
    }
    enum frame_result result = frame_take(reader, header, bytes);
    if (result != FRAME_GOOD) {
        return result;
    }
    link->statistics.frames_received++;
    if (header->kind == LINK_HELLO) {
        link_on_hello(link, header, bytes);
        return FRAME_GOOD;
    }
    if (header->kind == LINK_STATE) {
        link_on_acknowledge(link, header, 0);
        on_datagram(link, header, bytes);
        return FRAME_GOOD;
    }
    for (unsigned i = 0; i < size; i++) {
        sack |= (uint64_t)bytes[i] << 8 * i;
    }
    link_on_acknowledge(link, header, sack);
    link->receive.ack_now |= (header->flags & LINK_ASK) != 0;
    if (header->kind == LINK_BYE) {
        on_bye(link, header);
    }
    return FRAME_GOOD;
}

static enum frame_result take_frame(struct link *link, const uint8_t *in,
                                    size_t size)
{
    struct frame_reader reader;
    struct frame_header header;
    enum frame_result result = frame_open(&reader, in, size, &header);
    if (result != FRAME_GOOD) {
        return result;
    }
    if (header.kind == LINK_HELLO) {
        return take_control(link, &reader, &header);
    }
    if (!link_accept_session(link, header.session)) {
        link->statistics.stale++;
        link_greet(link);
        return FRAME_GOOD;
    }
    link->heard_us = link->kept_us = link->now_us;
    if (header.kind == LINK_DATA) {
        return link->up ? take_data(link, &reader, &header) : FRAME_GOOD;
    }
    if (header.kind == LINK_ACK || header.kind == LINK_BYE ||
        header.kind == LINK_STATE) {
        return take_control(link, &reader, &header);
    }
    return FRAME_BAD_CODE;
}

static void count_result(struct link *link, enum frame_result result)
{
    struct link_statistics *s = &link->statistics;
    s->bad_code += result == FRAME_BAD_CODE;
    s->bad_header += result == FRAME_BAD_HEADER;
    s->bad_crc += result == FRAME_BAD_CRC;
}

/* Takes the whole frames among the bytes at hand, at most `most`. */
static int take_frames(struct link *link, int most)
{
    struct link_bytes_in *in = &link->in;
    int count = 0;
    while (count < most) {
        size_t zero = in->scanned + frame_find_zero(in->bytes + in->scanned,
                                                    in->end - in->scanned);
        if (zero == in->end) {
            in->scanned = zero;
            in->pending = false;
            return count;
        }
        size_t begin = in->begin;
        in->begin = in->scanned = zero + 1;
        if (in->skipping) {
            in->skipping = false;
        } else if (zero > begin) {
            count_result(link,
                         take_frame(link, in->bytes + begin, zero - begin));
            count++;
        }
    }
    in->pending = true;
    return count;
}

/* Makes room at the end of the buffer; what is too long for a frame, or being
 * skipped already, goes. */
static void make_room(struct link *link)
{
    struct link_bytes_in *in = &link->in;
    size_t frame_max = link_frame_bytes(&link->config);
    size_t left = in->end - in->begin;
    if (in->pending) {
        return;
    }
    if (in->skipping || left > frame_max) {
        link->statistics.resynchronised += !in->skipping;
        in->skipping = true;
        left = 0;
    }
    if (left == 0) {
        in->begin = in->end = 0;
    } else if (link->buffer_bytes - in->begin < frame_max + 1) {
        memmove(in->bytes, in->bytes + in->begin, left);
        in->begin = 0;
        in->end = left;
    }
    in->scanned = in->end;
}

int link_poll_receive(struct link *link, uint64_t now_us)
{
    struct link_bytes_in *in = &link->in;
    const struct link_pipe *pipe = &link->config.pipe;
    int most = link->config.window + 2, count = 0;
    link->now_us = now_us;
    if (link->closing && link->closed) {
        return 0;
    }
    count += take_frames(link, most);
    for (int calls = 0; calls < link->config.window && count < most; calls++) {
        make_room(link);
        size_t room = link->buffer_bytes - in->end;
        int got = pipe->receive(pipe->context, in->bytes + in->end, room);
        if (got < 0) {
            link_pipe_lost(link);
            return count;
        }
        LINK_ASSERT((size_t)got <= room);
        if (!link->pipe_up) {
            link->pipe_up = true;
            link->hello_now = true;
        }
        link->statistics.bytes_received += (unsigned)got;
        in->end += (size_t)got;
        count += take_frames(link, most - count);
        if ((size_t)got < room) {
            break;
        }
    }
    return count;
}
