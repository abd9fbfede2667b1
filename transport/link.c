#include "link.h"

#include <string.h>

#include "check.h"
#include "link_internal.h"

/* --- memory --------------------------------------------------------------- */

enum { TIMEOUT_FIRST_US = 200000 };

static size_t up8(size_t bytes) {
    return (bytes + 7) / 8 * 8;
}

/* A greeting, then `staging` frames; on the way in, one frame more that is
 * not whole yet. */
static size_t buffer_bytes(const struct link_config *c) {
    return up8(c->staging * link_frame_bytes(c) + FRAME_SLACK +
               FRAME_ENCODED(LINK_HELLO_SIZE) + 2);
}

static size_t receive_bytes(const struct link_config *c) {
    return (size_t)c->frame_payload *
           (c->window + link_fragments(c, c->message_max) - 1u);
}

size_t link_bytes(const struct link_config *config) {
    struct link_config c = link_complete(config);
    if (link_config_fault(config) != NULL)
        return 0;
    return up8(sizeof(struct link)) +
           up8(c.window * sizeof(struct link_send_slot)) +
           up8(c.window * sizeof(struct link_receive_slot)) +
           (size_t)c.window * c.frame_payload + receive_bytes(&c) +
           2 * buffer_bytes(&c);
}

static void *carve(uint8_t **memory, size_t bytes) {
    void *part = *memory;
    *memory += up8(bytes);
    return part;
}

struct link *link_init(void *memory, size_t bytes,
                       const struct link_config *config) {
    struct link_config c = link_complete(config);
    size_t needed = link_bytes(config);
    if (needed == 0 || bytes < needed || (uintptr_t)memory % 8 != 0)
        return NULL;
    uint8_t *rest = memory;
    struct link *link = carve(&rest, sizeof *link);
    memset(link, 0, sizeof *link);
    link->config = c;
    link->buffer_bytes = buffer_bytes(&c);
    link->send.slots = carve(&rest, c.window * sizeof *link->send.slots);
    link->receive.slots = carve(&rest, c.window * sizeof *link->receive.slots);
    link->send.payload = carve(&rest, (size_t)c.window * c.frame_payload);
    link->receive.payload = carve(&rest, receive_bytes(&c));
    link->in.bytes = carve(&rest, link->buffer_bytes);
    link->out.bytes = carve(&rest, link->buffer_bytes);
    LINK_ASSERT((size_t)(rest - (uint8_t *)memory) == needed);
    memset(link->send.slots, 0, c.window * sizeof *link->send.slots);
    memset(link->receive.slots, 0, c.window * sizeof *link->receive.slots);
    link->fragments_max = (uint16_t)link_fragments(&c, c.message_max);
    link->send.first = link->send.next = link->send.end = (uint16_t)c.epoch;
    link->send.limit = link->send.first;
    link->statistics.timeout_us = TIMEOUT_FIRST_US < c.timeout_min_us
                                      ? c.timeout_min_us
                                      : TIMEOUT_FIRST_US;
    link->hello_now = true;
    return link;
}

/* --- messages ------------------------------------------------------------- */

static unsigned frames_free(const struct link *link) {
    return link->closing || link->closed
               ? 0
               : link->config.window - link_used(link);
}

unsigned link_room(const struct link *link, size_t size) {
    return frames_free(link) / link_fragments(&link->config, size);
}

unsigned link_room_behind(const struct link *link, size_t first, size_t size) {
    unsigned left = frames_free(link), taken;
    taken = link_fragments(&link->config, first);
    LINK_ASSERT(taken <= left);
    return (left - taken) / link_fragments(&link->config, size);
}

/* A message in two parts, from which fragments are cut. */
struct parts {
    const uint8_t *head, *data;
    size_t head_left, data_left;
};

static void cut(struct parts *parts, uint8_t *out, size_t size) {
    size_t n = size < parts->head_left ? size : parts->head_left;
    if (n > 0) {
        memcpy(out, parts->head, n);
        parts->head += n;
        parts->head_left -= n;
    }
    if (size > n) {
        memcpy(out + n, parts->data, size - n);
        parts->data += size - n;
        parts->data_left -= size - n;
    }
}

int link_write(struct link *link, const void *head, size_t head_size,
               const void *data, size_t size) {
    struct parts parts = {head, data, head_size, size};
    struct link_sender *s = &link->send;
    size_t left = head_size + size;
    LINK_ASSERT(left <= link->config.message_max);
    if (link_room(link, left) == 0)
        return LINK_AGAIN;
    link->statistics.messages_sent++;
    link->statistics.payload_sent += left;
    bool more = true;
    while (more) {
        unsigned at = link_sent_slot(link, link_used(link));
        struct link_send_slot *slot = &s->slots[at];
        size_t part = left < link->config.frame_payload
                          ? left
                          : link->config.frame_payload;
        more = part < left;
        cut(&parts, s->payload + (size_t)at * link->config.frame_payload, part);
        left -= part;
        slot->size = (uint16_t)part;
        slot->flags = more ? LINK_MORE : 0;
        slot->state = LINK_WAITING;
        s->end++;
    }
    if (link_used(link) > link->statistics.send_high_water)
        link->statistics.send_high_water = link_used(link);
    return 0;
}

bool link_read(struct link *link, struct link_message *message) {
    struct link_receiver *r = &link->receive;
    size_t stride = link->config.frame_payload;
    unsigned window = link->config.window, at = r->head, count = 1;
    if (r->complete == 0)
        return false;
    message->size = r->slots[at].size;
    message->sequence = (uint16_t)(r->next - r->ready);
    while (r->slots[at].more) {
        at = link_wrapped(link, at + 1);
        message->size += r->slots[at].size;
        count++;
    }
    LINK_ASSERT(count <= r->complete && count <= link->fragments_max);
    if (r->head + count > window) {
        /* The part that wrapped goes behind the last slot. */
        memcpy(r->payload + window * stride, r->payload,
               (r->head + count - window) * stride);
    }
    message->data = r->payload + r->head * stride;
    r->held = (uint16_t)count;
    return true;
}

void link_release(struct link *link) {
    struct link_receiver *r = &link->receive;
    LINK_ASSERT(r->held > 0 && r->held <= r->complete);
    if (r->unreported == 0 &&
        r->reported == (uint16_t)(r->next + link_credit(link)))
        r->unreported_us = link->now_us;
    link->statistics.messages_received++;
    for (; r->held > 0; r->held--) {
        struct link_receive_slot *slot = &r->slots[r->head];
        link->statistics.payload_received += slot->size;
        slot->full = false;
        r->head = (uint16_t)link_wrapped(link, r->head + 1u);
        r->complete--;
        r->ready--;
    }
}

unsigned link_forget_unsent(struct link *link) {
    struct link_sender *s = &link->send;
    unsigned offset = (uint16_t)(s->next - s->first), count = 0;
    bool inside = s->inside;
    /* What is begun must end. */
    while (inside) {
        LINK_ASSERT(offset < link_used(link));
        unsigned at = link_sent_slot(link, offset++);
        inside = (s->slots[at].flags & LINK_MORE) != 0;
    }
    for (unsigned i = offset; i < link_used(link); i++) {
        unsigned at = link_sent_slot(link, i);
        count += (s->slots[at].flags & LINK_MORE) == 0;
    }
    s->end = (uint16_t)(s->first + offset);
    link->statistics.messages_dropped += count;
    return count;
}

void link_put_datagram(struct link *link, const void *bytes, size_t size,
                       bool ask) {
    LINK_ASSERT(size >= 1 && size <= LINK_DATAGRAM_MAX);
    link->datagrams.out = bytes;
    link->datagrams.out_size = (uint16_t)size;
    link->datagrams.asks = ask;
    link->datagrams.due = true;
}

bool link_take_datagram(struct link *link, struct link_message *datagram,
                        bool *ask) {
    struct link_datagrams *n = &link->datagrams;
    if (!n->heard)
        return false;
    n->heard = false;
    datagram->data = n->in;
    datagram->size = n->in_size;
    datagram->sequence = n->in_sequence;
    *ask = n->asked;
    return true;
}

/* --- joining session, sender and receiver --------------------------------- */

/* What a frame's session means for the two windows. */
static void enter(struct link *link, enum link_session session) {
    if (session == LINK_FOREIGN || session == LINK_PRESENT)
        return;
    if (session == LINK_RESUMED) {
        link_send_resume(link);
    } else {
        uint8_t credit = link->candidate.credit;
        if (session == LINK_RESTARTED)
            link_send_reset(link, credit);
        else
            link->send.limit = (uint16_t)(link->send.first + credit);
        link_receive_reset(link, (uint16_t)link->peer_epoch);
    }
    link->receive.ack_now = true;
    link->send.timer_us = link->now_us;
    link->send.backoff = 0;
}

static void on_frame(struct link *link, struct link_frame *frame) {
    const struct frame_header *header = &frame->header;
    if (link->tending && header->kind == LINK_BYE)
        return;
    if (header->kind != LINK_HELLO) {
        enum link_session session = link_accept_session(link, header->session);
        if (session == LINK_FOREIGN) {
            link->statistics.stale++;
            link_greet(link);
            return;
        }
        enter(link, session);
        link->heard_us = link->kept_us = link->now_us;
    }
    enum link_event event = link_take_frame(link, frame);
    if (event == LINK_GREETED) {
        enum link_session session = link_on_hello(link, header, frame->payload);
        link->receive.ack_now |= session != LINK_FOREIGN;
        enter(link, session);
    } else if (event != LINK_NOTHING) {
        if (event == LINK_TOO_LONG)
            link_refuse_sizes(link);
        else if (event == LINK_FAREWELL)
            link_on_bye(link, header);
        link_on_acknowledge(link, header, frame->sack);
    }
}

/* Bytes that were under way are lost; the session may go on. */
static void pipe_lost(struct link *link) {
    link->statistics.pipe_closed += link->pipe_up;
    link->pipe_up = false;
    link->up = link->bye_due = false;
    link_forget_bytes(link);
    link_forget_staged(link);
}

static void pipe_works(struct link *link) {
    if (!link->pipe_up) {
        link->pipe_up = true;
        link->hello_now = true;
    }
}

/* Takes the whole frames among the bytes at hand, at most `most`. */
static int take_frames(struct link *link, int most) {
    struct link_frame frame;
    int count = 0;
    while (count < most) {
        enum link_search found = link_find_frame(link, &frame);
        if (found == LINK_NO_FRAME)
            break;
        if (found == LINK_FOUND)
            on_frame(link, &frame);
        count++;
    }
    return count;
}

int link_poll_receive(struct link *link, uint64_t now_us) {
    int most = link->config.window + 2;
    link->now_us = now_us;
    if (link->closing && link->closed)
        return 0;
    int count = take_frames(link, most);
    for (int calls = 0; calls < link->config.window && count < most; calls++) {
        enum link_fill fill = link_fill(link);
        if (fill == LINK_FILL_CLOSED) {
            pipe_lost(link);
            break;
        }
        pipe_works(link);
        count += take_frames(link, most - count);
        if (fill == LINK_FILL_SOME)
            break;
    }
    return count;
}

int link_tend_receive(struct link *link, uint64_t now_us) {
    link->tending = true;
    int count = link_poll_receive(link, now_us);
    link->tending = false;
    return count;
}

/* One frame more, the most urgent; false: nothing to say. */
static bool stage_one(struct link *link) {
    uint8_t hello[LINK_HELLO_SIZE];
    if (!link_hello_due(link))
        return link_stage_frame(link);
    link_make_hello(link, hello);
    link_stage_hello(link, hello);
    return true;
}

/* Gives the pipe what is staged; false: it does not take all. */
static bool flush(struct link *link) {
    enum link_flush status = link_flush(link);
    if (status == LINK_FLUSH_CLOSED)
        pipe_lost(link);
    return status == LINK_FLUSH_DONE;
}

int link_poll_send(struct link *link, uint64_t now_us) {
    int count = 0, most = link->config.window + 2;
    link->now_us = now_us;
    if (link->closing && now_us >= link->deadline_us) {
        link->closed = true;
        link->up = link->bye_due = false;
        link_forget_staged(link);
    }
    if (!link->pipe_up || (link->closing && link_has_parted(link)) ||
        !flush(link))
        return 0;
    link_run_timer(link);
    while (count < most) {
        int before = count;
        while (count < most && link_staging_room(link) && stage_one(link))
            count++;
        if (!flush(link) || count == before)
            break;
    }
    return count;
}

int link_poll(struct link *link, uint64_t now_us) {
    int count = link_poll_receive(link, now_us);
    return count + link_poll_send(link, now_us);
}

/* --- state ---------------------------------------------------------------- */

void link_close(struct link *link, uint64_t deadline_us) {
    link->closing = true;
    link->deadline_us = deadline_us;
    link->bye_us = link->now_us - link->config.hello_us;
}

bool link_idle(const struct link *link) {
    return link_used(link) == 0;
}

enum link_state link_state(const struct link *link) {
    if (link->closed)
        return link_has_parted(link) ? LINK_CLOSED : LINK_CLOSING;
    if (link_refuses(link))
        return LINK_REFUSED;
    if (link->closing)
        return LINK_CLOSING;
    if (!link->pipe_up)
        return LINK_DOWN;
    if (!link->up)
        return LINK_OPENING;
    return link->now_us - link->heard_us > link->config.silence_us ? LINK_SILENT
                                                                   : LINK_UP;
}

const struct link_statistics *link_statistics(const struct link *link) {
    return &link->statistics;
}

const struct link_peer *link_peer(const struct link *link) {
    return &link->peer;
}

static uint64_t until(uint64_t start_us, uint64_t span_us, uint64_t now_us) {
    uint64_t passed = now_us - start_us;
    return passed < span_us ? span_us - passed : 0;
}

static uint64_t least(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

uint64_t link_next_due_us(const struct link *link, uint64_t now_us) {
    const struct link_config *c = &link->config;
    const struct link_receiver *r = &link->receive;
    uint64_t due = c->keep_alive_us;
    if (link->in.pending)
        return 0;
    if (link->stalled || (link->closed && !link->bye_due))
        return due;
    if (!link->pipe_up || !link->up) {
        return link->pipe_up ? until(link->hello_us, c->hello_us, now_us)
                             : c->hello_us;
    }
    if (link_may_send(link) || link_ack_due(link) || link_hello_due(link) ||
        link->datagrams.due)
        return 0;
    due = until(link->sent_us, c->keep_alive_us, now_us);
    if (link->send.first != link->send.end) {
        due = least(due,
                    until(link->send.timer_us, link_timeout_us(link), now_us));
    }
    if (r->unreported > 0 ||
        r->reported != (uint16_t)(r->next + link_credit(link)))
        due = least(due, until(r->unreported_us, c->ack_delay_us, now_us));
    if (link->candidate.epoch != 0)
        due = least(due, until(link->hello_us, c->hello_us, now_us));
    if (link->closing) {
        uint64_t left =
            link->deadline_us > now_us ? link->deadline_us - now_us : 0;
        due = least(least(due, c->hello_us), left);
    }
    return due;
}
