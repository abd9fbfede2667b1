#include <string.h>

#include "link_internal.h"
#include "check.h"
#include "bytes.h"

void link_receive_reset(struct link *link, uint16_t first) {
    struct link_receiver *r = &link->receive;
    r->ready = r->complete;
    r->early = 0;
    for (unsigned i = 0; i < link_credit(link); i++)
        r->slots[link_slot_of(link, i)].full = false;
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
        (slot->more && before + 1u >= link->fragments_max))
        return false;
    r->next++;
    r->ready++;
    if (!slot->more)
        r->complete = r->ready;
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
    if (r->ready + r->early > link->statistics.receive_high_water)
        link->statistics.receive_high_water = (uint32_t)(r->ready + r->early);
    return fits;
}

/* False: as above. */
static bool stored(struct link *link, unsigned offset) {
    struct link_receiver *r = &link->receive;
    if (r->unreported++ == 0)
        r->unreported_us = link->now_us;
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
    if (header->size > payload_max || (more && header->size != payload_max))
        return FRAME_BAD_CODE;
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
    if (!size_fits(header->kind, header->size))
        return FRAME_BAD_CODE;
    enum frame_result result =
        frame_take(&frame->reader, header, frame->payload);
    if (result != FRAME_GOOD)
        return result;
    link->statistics.frames_received++;
    *event = header->kind == LINK_HELLO ? LINK_GREETED : LINK_ACKNOWLEDGED;
    if (header->kind == LINK_STATE) {
        on_datagram(link, frame);
    } else if (header->kind != LINK_HELLO) {
        for (unsigned i = 0; i < header->size; i++)
            frame->sack |= (uint64_t)frame->payload[i] << 8 * i;
        link->receive.ack_now |= (header->flags & LINK_ASK) != 0;
    }
    if (header->kind == LINK_BYE)
        *event = LINK_FAREWELL;
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
    if (frame->header.kind != LINK_DATA)
        count_result(link, take_control(link, frame, &event));
    else if (link->up)
        count_result(link, take_data(link, frame, &event));
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
    if (in->pending)
        return;
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
    if (got < 0)
        return LINK_FILL_CLOSED;
    LINK_ASSERT((size_t)got <= room);
    link->statistics.bytes_received += (unsigned)got;
    in->end += (size_t)got;
    return (size_t)got < room ? LINK_FILL_SOME : LINK_FILL_MORE;
}

/* --- link session --------------------------------------------------------- */

static void pack_hello(const struct link *link, uint8_t *hello) {
    const struct link_config *c = &link->config;
    bool candidate = link->candidate.epoch != 0;
    hello[0] = LINK_VERSION;
    hello[1] = c->port;
    bytes_put16(hello + 2, c->node);
    bytes_put16(hello + 4, c->peer_node);
    hello[6] = c->peer_port;
    hello[7] = c->greeting;
    bytes_put32(hello + 8, c->epoch);
    bytes_put32(hello + 12, link->intruder != 0 ? link->intruder
                            : candidate         ? link->candidate.epoch
                                                : link->peer_epoch);
    bytes_put16(hello + 16, c->window);
    bytes_put16(hello + 18, c->frame_payload);
    bytes_put16(hello + 20, c->message_max);
    hello[22] = link->intruder != 0;
    hello[23] = 0;
}

static bool is_greeting(const uint8_t *bytes, size_t size) {
    struct frame_header header;
    uint8_t hello[LINK_HELLO_SIZE];
    return frame_decode(bytes, size, &header, hello, sizeof hello) &&
           header.kind == LINK_HELLO && header.size == sizeof hello;
}

bool link_greets(const uint8_t *bytes, size_t size) {
    size_t begin = 0, zero = 0;
    bool found = false;
    while (!found && begin < size) {
        zero = begin + frame_find_zero(bytes + begin, size - begin);
        found = zero < size && is_greeting(bytes + begin, zero - begin);
        begin = zero + 1;
    }
    return found;
}

/* The name of frames that go from one start of a node to one of another. */
static uint32_t session(uint32_t from_epoch, unsigned from, uint32_t to_epoch,
                        unsigned to) {
    uint8_t bytes[12];
    bytes_put32(bytes, from_epoch);
    bytes_put32(bytes + 4, to_epoch);
    bytes_put16(bytes + 8, from);
    bytes_put16(bytes + 10, to);
    return frame_crc32c(0, bytes, sizeof bytes);
}

static uint32_t session_from(const struct link *link, uint32_t peer_epoch) {
    const struct link_config *c = &link->config;
    return session(peer_epoch, c->peer_node, c->epoch, c->node);
}

static uint32_t session_to(const struct link *link, uint32_t peer_epoch) {
    const struct link_config *c = &link->config;
    return session(c->epoch, c->node, peer_epoch, c->peer_node);
}

static enum link_refusal fits(const struct link *link, const uint8_t *hello) {
    const struct link_config *c = &link->config;
    unsigned window = bytes_get16(hello + 16);
    if (hello[0] != LINK_VERSION)
        return LINK_WRONG_VERSION;
    if (bytes_get16(hello + 2) != c->peer_node || hello[1] != c->peer_port ||
        bytes_get16(hello + 4) != c->node || hello[6] != c->port)
        return LINK_WRONG_WIRE;
    if (hello[7] != 0 && c->greeting != 0 && hello[7] != c->greeting)
        return LINK_WRONG_GREETING;
    if (bytes_get16(hello + 18) != c->frame_payload ||
        bytes_get16(hello + 20) != c->message_max ||
        window < link->fragments_max || window > LINK_WINDOW_MAX)
        return LINK_WRONG_SIZES;
    return LINK_FITS;
}

/* Whether a greeting leaves the link in use: it was, and its end does not speak
 * of this one's epoch.  Another start of that end cannot know of whom the one
 * before kept to: he has time to come back. */
static bool still_in_use(const struct link *link, uint32_t epoch, bool to_us) {
    bool reborn = epoch != link->told_by &&
                  link->now_us - link->told_us <= link->config.silence_us;
    return link->peer.refusal == LINK_IN_USE && (!to_us || reborn);
}

static void describe_peer(struct link *link, const uint8_t *hello) {
    struct link_peer *peer = &link->peer;
    bool to_us = bytes_get32(hello + 12) == link->config.epoch;
    bool told = to_us && hello[22] != 0;
    bool in_use = told || still_in_use(link, bytes_get32(hello + 8), to_us);
    peer->version = hello[0];
    peer->port = hello[1];
    peer->greeting = hello[7];
    peer->node = bytes_get16(hello + 2);
    peer->epoch = bytes_get32(hello + 8);
    peer->window = bytes_get16(hello + 16);
    peer->frame_payload = bytes_get16(hello + 18);
    peer->message_max = bytes_get16(hello + 20);
    peer->in_use += told;
    if (told) {
        link->told_by = peer->epoch;
        link->told_us = link->now_us;
    }
    peer->refusal = fits(link, hello);
    if (peer->refusal == LINK_FITS && in_use)
        peer->refusal = LINK_IN_USE;
}

/* Whether another epoch greets while the present peer is alive. */
static bool intrudes(const struct link *link, uint32_t epoch) {
    return link->config.keeps_peer && link->peer_epoch != 0 &&
           epoch != link->peer_epoch && !link->closed &&
           link->now_us - link->kept_us <= link->config.silence_us;
}

/* The peer is another start than before, if there was one. */
static enum link_session start_session(struct link *link) {
    struct link_candidate *c = &link->candidate;
    bool first = link->peer_epoch == 0;
    link->peer_epoch = c->epoch;
    link->peer_window = c->window;
    link->session_in = c->session_in;
    link->session_out = session_to(link, c->epoch);
    link->statistics.sessions++;
    c->epoch = 0;
    link->kept_us = link->now_us;
    link->closed = false;
    link->bye_due = false;
    link->up = true;
    return first ? LINK_BEGUN : LINK_RESTARTED;
}

enum link_session link_accept_session(struct link *link, uint32_t session) {
    if (link_refuses(link))
        return LINK_FOREIGN;
    if (link->peer_epoch != 0 && session == link->session_in) {
        if (link->up || link->closed)
            return LINK_PRESENT;
        link->statistics.resumed++;
        link->up = true;
        return LINK_RESUMED;
    }
    if (link->candidate.epoch != 0 && session == link->candidate.session_in)
        return start_session(link);
    return LINK_FOREIGN;
}

enum link_session link_on_hello(struct link *link,
                                const struct frame_header *header,
                                const uint8_t hello[LINK_HELLO_SIZE]) {
    uint32_t epoch = bytes_get32(hello + 8), mine = bytes_get32(hello + 12);
    if (epoch == 0 || link->closing)
        return LINK_FOREIGN;
    if (intrudes(link, epoch)) {
        link->intruder = epoch;
        link->hello_now = true;
        return LINK_FOREIGN;
    }
    link->heard_us = link->now_us;
    if (epoch == link->peer_epoch)
        link->kept_us = link->now_us;
    describe_peer(link, hello);
    if (link_refuses(link)) {
        link->up = false;
        return LINK_FOREIGN;
    }
    if (epoch != link->peer_epoch) {
        struct link_candidate *c = &link->candidate;
        c->epoch = epoch;
        c->session_in = session_from(link, epoch);
        c->window = bytes_get16(hello + 16);
        c->credit = header->credit <= c->window ? header->credit : 0;
        c->hellos_left = LINK_CANDIDATE_HELLOS;
    }
    if (mine != link->config.epoch) {
        link->hello_now = true;
        return LINK_FOREIGN;
    }
    return link_accept_session(link, session_from(link, epoch));
}

void link_greet(struct link *link) {
    if (link->now_us - link->hello_us >= link->config.hello_us)
        link->hello_now = true;
}

bool link_hello_due(const struct link *link) {
    bool waiting =
        !link->up || link->candidate.epoch != 0 || link_refuses(link);
    return link->hello_now ||
           (waiting && !link->closed &&
            link->now_us - link->hello_us >= link->config.hello_us);
}

void link_make_hello(struct link *link, uint8_t hello[LINK_HELLO_SIZE]) {
    struct link_candidate *c = &link->candidate;
    pack_hello(link, hello);
    link->hello_us = link->now_us;
    link->hello_now = false;
    link->intruder = 0;
    if (c->epoch != 0 && c->hellos_left-- == 0)
        c->epoch = 0;
}

void link_refuse_sizes(struct link *link) {
    link->peer.refusal = LINK_WRONG_SIZES;
    link->up = false;
}

void link_on_bye(struct link *link, const struct frame_header *header) {
    link->bye_due = (header->flags & LINK_ASK) != 0;
    link->closed = true;
    link->up = false;
}
