#include "link_receive.h"

#include <string.h>

#include "check.h"

void link_receive_reset(struct link *link, uint16_t first) {
    struct link_receiver *r = &link->receive;
    r->ready = r->complete;
    r->early = 0;
    for (unsigned i = 0; i < link_credit(link); i++) {
        r->slots[link_slot_of(link, i)].full = false;
    }
    r->next = first;
    r->reported = (uint16_t)(first + link_credit(link));
    r->unreported = 0;
    link->datagrams.heard = false; /* its sequence was another session's */
}

void link_forget_bytes(struct link *link) {
    struct link_bytes_in *in = &link->in;
    in->begin = in->scanned = in->end = 0;
    in->skipping = false;
    in->pending = false;
}

/* The frame in link_slot_of(0) joins those that are ready.  False: a message
 * longer than agreed, which can never be read. */
static bool accept_next(struct link *link) {
    struct link_receiver *r = &link->receive;
    struct link_receive_slot *slot = &r->slots[link_slot_of(link, 0)];
    unsigned before = (unsigned)r->ready - r->complete;
    size_t size = (size_t)before * link->config.frame_payload + slot->size;
    if (size > link->config.message_max ||
        (slot->more && before + 1u >= link->fragments_max)) {
        return false;
    }
    r->next++;
    r->ready++;
    if (!slot->more) {
        r->complete = r->ready;
    }
    return true;
}

/* False: as above. */
static bool advance(struct link *link) {
    struct link_receiver *r = &link->receive;
    bool fits = accept_next(link);
    while (fits && r->early > 0 && link_credit(link) > 0 &&
           r->slots[link_slot_of(link, 0)].full) {
        r->early--;
        fits = accept_next(link);
    }
    if (r->ready + r->early > link->statistics.receive_high_water) {
        link->statistics.receive_high_water = (uint32_t)(r->ready + r->early);
    }
    return fits;
}

/* False: as above. */
static bool stored(struct link *link, unsigned offset) {
    struct link_receiver *r = &link->receive;
    if (r->unreported++ == 0) {
        r->unreported_us = link->now_us;
    }
    if (offset > 0) {
        r->early++;
        r->ack_now = true;
        return true;
    }
    r->ack_now |= r->early > 0;
    return advance(link);
}

/* A frame's place is known before its payload is decoded, so it is decoded
 * where it stays. */
static enum frame_result take_data(struct link *link, struct link_frame *frame,
                                   enum link_event *event) {
    const struct frame_header *header = &frame->header;
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
    unsigned at = link_slot_of(link, offset);
    struct link_receive_slot *slot = &r->slots[at];
    if (slot->full && offset > 0) {
        s->duplicates++;
        r->ack_now = true;
        return FRAME_GOOD;
    }
    enum frame_result result = frame_take(
        &frame->reader, header, r->payload + (size_t)at * payload_max);
    if (result == FRAME_GOOD) {
        s->frames_received++;
        slot->size = header->size;
        slot->more = more;
        slot->full = true;
        *event = stored(link, offset) ? LINK_ACKNOWLEDGED : LINK_TOO_LONG;
    }
    return result;
}

static void on_datagram(struct link *link, const struct link_frame *frame) {
    struct link_datagrams *n = &link->datagrams;
    memcpy(n->in, frame->payload, frame->header.size);
    n->in_size = frame->header.size;
    n->in_sequence = frame->header.sequence;
    n->asked = (frame->header.flags & LINK_ASK) != 0;
    n->heard = link->up;
}

static bool size_fits(unsigned kind, unsigned size) {
    switch (kind) {
    case LINK_HELLO:
        return size == LINK_HELLO_SIZE;
    case LINK_ACK:
        return size == 0 || size == LINK_SACK_SIZE;
    case LINK_STATE:
        return size >= 1 && size <= LINK_DATAGRAM_MAX;
    default:
        return kind == LINK_BYE && size == 0;
    }
}

/* Frames without data: a few bytes of payload at most. */
static enum frame_result take_control(struct link *link,
                                      struct link_frame *frame,
                                      enum link_event *event) {
    const struct frame_header *header = &frame->header;
    if (!size_fits(header->kind, header->size)) {
        return FRAME_BAD_CODE;
    }
    enum frame_result result =
        frame_take(&frame->reader, header, frame->payload);
    if (result != FRAME_GOOD) {
        return result;
    }
    link->statistics.frames_received++;
    *event = header->kind == LINK_HELLO ? LINK_GREETED : LINK_ACKNOWLEDGED;
    if (header->kind == LINK_STATE) {
        on_datagram(link, frame);
    } else if (header->kind != LINK_HELLO) {
        for (unsigned i = 0; i < header->size; i++) {
            frame->sack |= (uint64_t)frame->payload[i] << 8 * i;
        }
        link->receive.ack_now |= (header->flags & LINK_ASK) != 0;
    }
    if (header->kind == LINK_BYE) {
        *event = LINK_FAREWELL;
    }
    return FRAME_GOOD;
}

static void count_result(struct link *link, enum frame_result result) {
    struct link_statistics *s = &link->statistics;
    s->bad_code += result == FRAME_BAD_CODE;
    s->bad_header += result == FRAME_BAD_HEADER;
    s->bad_crc += result == FRAME_BAD_CRC;
}

enum link_event link_take_frame(struct link *link, struct link_frame *frame) {
    enum link_event event = LINK_NOTHING;
    frame->sack = 0;
    if (frame->header.kind != LINK_DATA) {
        count_result(link, take_control(link, frame, &event));
    } else if (link->up) {
        count_result(link, take_data(link, frame, &event));
    }
    return event;
}

enum link_search link_find_frame(struct link *link, struct link_frame *frame) {
    struct link_bytes_in *in = &link->in;
    size_t begin = 0, zero = 0;
    bool found = false;
    while (!found) {
        zero = in->scanned +
               frame_find_zero(in->bytes + in->scanned, in->end - in->scanned);
        if (zero == in->end) {
            in->scanned = zero;
            in->pending = false;
            return LINK_NO_FRAME;
        }
        begin = in->begin;
        in->begin = in->scanned = zero + 1;
        found = !in->skipping && zero > begin;
        in->skipping = false;
    }
    in->pending = true;
    enum frame_result result = frame_open(&frame->reader, in->bytes + begin,
                                          zero - begin, &frame->header);
    count_result(link, result);
    return result == FRAME_GOOD ? LINK_FOUND : LINK_BAD_FRAME;
}

/* Makes room at the end of the buffer; what is too long for a frame, or being
 * skipped already, goes. */
static void make_room(struct link *link) {
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

enum link_fill link_fill(struct link *link) {
    struct link_bytes_in *in = &link->in;
    const struct link_pipe *pipe = &link->config.pipe;
    make_room(link);
    size_t room = link->buffer_bytes - in->end;
    int got = pipe->receive(pipe->context, in->bytes + in->end, room);
    if (got < 0) {
        return LINK_FILL_CLOSED;
    }
    LINK_ASSERT((size_t)got <= room);
    link->statistics.bytes_received += (unsigned)got;
    in->end += (size_t)got;
    return (size_t)got < room ? LINK_FILL_SOME : LINK_FILL_MORE;
}
