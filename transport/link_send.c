#include "link_internal.h"

#include <string.h>

#include "check.h"

enum {
    BACKOFF_MAX = 5,
    MEASURED_MAX = 8 /* times timeout_max_us, of round trips that take longer */
};

static unsigned in_flight(const struct link *link) {
    return (uint16_t)(link->send.next - link->send.first);
}

uint32_t link_timeout_us(const struct link *link) {
    const struct link_config *c = &link->config;
    uint32_t measured = link->statistics.timeout_us;
    uint64_t us = (uint64_t)measured << link->send.backoff;
    uint32_t most = measured > c->timeout_max_us ? measured : c->timeout_max_us;
    return us < most ? (uint32_t)us : most;
}

/* --- what acknowledgements say -------------------------------------------- */

/* Smoothed round trip and its variation (Jacobson, 1988; RFC 6298). */
static void measure(struct link *link, uint32_t rtt) {
    struct link_statistics *s = &link->statistics;
    uint32_t *variation = &link->send.variation_us;
    if (s->rtt_us == 0) {
        s->rtt_us = rtt;
        *variation = rtt / 2;
        s->rtt_min_us = s->rtt_max_us = rtt;
    }
    uint32_t difference = rtt > s->rtt_us ? rtt - s->rtt_us : s->rtt_us - rtt;
    *variation = *variation - *variation / 4 + difference / 4;
    s->rtt_us = s->rtt_us - s->rtt_us / 8 + rtt / 8;
    s->rtt_min_us = rtt < s->rtt_min_us ? rtt : s->rtt_min_us;
    s->rtt_max_us = rtt > s->rtt_max_us ? rtt : s->rtt_max_us;
    uint64_t timeout = (uint64_t)s->rtt_us + 4 * (uint64_t)*variation +
                       link->config.ack_delay_us;
    if (timeout < link->config.timeout_min_us)
        timeout = link->config.timeout_min_us;
    uint64_t most = (uint64_t)MEASURED_MAX * link->config.timeout_max_us;
    most = most < UINT32_MAX ? most : UINT32_MAX;
    s->timeout_us = (uint32_t)(timeout < most ? timeout : most);
}

/* What one acknowledgement told of the frames on their way. */
struct news {
    bool any, ordered, sampled;
    uint32_t order; /* highest that has arrived */
    uint32_t rtt_us;
};

static void slot_arrived(struct link *link, struct link_send_slot *slot,
                         struct news *news) {
    uint32_t elapsed = (uint32_t)link->now_us - slot->sent_us;
    link->send.lost = (uint16_t)(link->send.lost - (slot->state == LINK_LOST));
    slot->state = LINK_ARRIVED;
    news->any = true;
    if (!slot->again) {
        if (!news->sampled || elapsed < news->rtt_us)
            news->rtt_us = elapsed;
        news->sampled = true;
    } else if (elapsed < link->statistics.rtt_min_us) {
        return; /* that was an earlier transmission of it */
    }
    if (!news->ordered || (int32_t)(slot->order - news->order) > 0)
        news->order = slot->order;
    news->ordered = true;
}

/* A pipe keeps its bytes in order: what was sent before a frame that arrived,
 * and is not here, is lost. */
static void mark_lost(struct link *link, uint32_t order) {
    struct link_sender *s = &link->send;
    unsigned count = in_flight(link);
    for (unsigned i = 0; i < count; i++) {
        struct link_send_slot *slot = &s->slots[link_sent_slot(link, i)];
        if (slot->state == LINK_SENT && (int32_t)(slot->order - order) < 0) {
            slot->state = LINK_LOST;
            s->lost++;
        }
    }
}

static void free_first(struct link *link, struct news *news) {
    struct link_sender *s = &link->send;
    struct link_send_slot *slot = &s->slots[s->head];
    if (slot->state == LINK_ARRIVED)
        s->arrived--;
    else
        slot_arrived(link, slot, news);
    s->head = (uint16_t)link_sent_slot(link, 1);
    s->first++;
}

static void mark_acknowledged(struct link *link, uint16_t ack, uint64_t sack,
                              struct news *news) {
    struct link_sender *s = &link->send;
    LINK_ASSERT(ack == s->first);
    for (unsigned i = 1; sack != 0 && i < in_flight(link); i++, sack >>= 1) {
        struct link_send_slot *slot = &s->slots[link_sent_slot(link, i)];
        if ((sack & 1) != 0 && slot->state != LINK_ARRIVED) {
            slot_arrived(link, slot, news);
            s->arrived++;
        }
    }
}

void link_on_acknowledge(struct link *link, const struct frame_header *header,
                         uint64_t sack) {
    struct link_sender *s = &link->send;
    unsigned freed = (uint16_t)(header->acknowledge - s->first);
    uint16_t limit = (uint16_t)(header->acknowledge + header->credit);
    struct news news = {false, false, false, 0, 0};
    if (freed > in_flight(link) || header->credit > LINK_WINDOW_MAX)
        return; /* repeated by the pipe, or not for us */
    bool again = false;
    for (unsigned i = 0; i < freed; i++) {
        again |= s->slots[s->head].again;
        free_first(link, &news);
    }
    mark_acknowledged(link, header->acknowledge, sack, &news);
    if (news.ordered && (sack != 0 || again || s->arrived > 0))
        mark_lost(link, news.order);
    if (news.sampled)
        measure(link, news.rtt_us);
    if ((int16_t)(limit - s->limit) > 0) {
        s->limit = limit;
        news.any = true;
    }
    if (news.any) {
        s->backoff = 0;
        s->timer_us = link->now_us;
    }
}

void link_send_reset(struct link *link, uint8_t credit) {
    struct link_sender *s = &link->send;
    unsigned queued = link_used(link);
    for (unsigned i = 0; i < queued; i++) {
        bool more = (s->slots[link_sent_slot(link, i)].flags & LINK_MORE) != 0;
        link->statistics.messages_dropped += !more;
    }
    s->first = s->next = s->end = (uint16_t)link->config.epoch;
    s->limit = (uint16_t)(s->first + credit);
    s->lost = s->arrived = 0;
    s->head = 0;
    s->inside = false;
}

void link_send_resume(struct link *link) {
    mark_lost(link, link->send.order);
}

/* --- frames --------------------------------------------------------------- */

static bool may_send_next(const struct link *link) {
    const struct link_sender *s = &link->send;
    return s->next != s->end && (int16_t)(s->limit - s->next) > 0;
}

bool link_may_send(const struct link *link) {
    return link->up && (link->send.lost > 0 || may_send_next(link));
}

/* Acknowledgements ride on data; alone they go when half a window can be
 * used again, or when they are old. */
bool link_ack_due(const struct link *link) {
    const struct link_receiver *r = &link->receive;
    unsigned window = link->config.window < link->peer_window
                          ? link->config.window
                          : link->peer_window;
    unsigned half = window > 1 ? window / 2 : 1;
    uint16_t limit = (uint16_t)(r->next + link_credit(link));
    unsigned gained = (uint16_t)(limit - r->reported);
    if (!link->up)
        return false;
    return r->ack_now || gained >= half ||
           (r->unreported >= half && window < link->config.window) ||
           ((r->unreported > 0 || gained > 0) &&
            link->now_us - r->unreported_us >= link->config.ack_delay_us);
}

static void stage(struct link *link, unsigned kind, unsigned flags,
                  uint16_t sequence, const void *payload, size_t size) {
    struct link_receiver *r = &link->receive;
    struct link_bytes_out *out = &link->out;
    struct frame_header header = {
        .kind = (uint8_t)kind,
        .flags = (uint8_t)flags,
        .credit = (uint8_t)link_credit(link),
        .session = kind == LINK_HELLO ? 0 : link->session_out,
        .sequence = sequence,
        .acknowledge = r->next,
        .size = (uint16_t)size,
    };
    if (kind == LINK_HELLO) {
        /* What a new session would have. */
        header.credit = (uint8_t)(link->config.window - r->complete);
    } else {
        r->reported = (uint16_t)(r->next + link_credit(link));
        r->unreported = 0;
        r->ack_now &= r->early > 0; /* what came early must be listed */
    }
    if (out->end == 0) {
        /* Noise on a wire at rest must not take the next frame with it. */
        out->bytes[out->end++] = 0;
    }
    LINK_ASSERT(link->buffer_bytes - out->end >=
                FRAME_ENCODED(size) + FRAME_SLACK);
    out->end += frame_encode(out->bytes + out->end, &header, payload);
    link->sent_us = link->now_us;
    link->statistics.frames_sent++;
}

/* Of what came: bit i: frame next + 1 + i is here. */
static uint64_t sack_of(const struct link *link) {
    uint64_t bits = 0;
    unsigned credit = link_credit(link);
    if (link->receive.early == 0)
        return 0;
    for (unsigned i = 1; i < credit; i++)
        if (link->receive.slots[link_slot_of(link, i)].full)
            bits |= (uint64_t)1 << (i - 1);
    return bits;
}

static void stage_ack(struct link *link, unsigned flags) {
    uint8_t bytes[LINK_SACK_SIZE];
    uint64_t sack = sack_of(link);
    for (unsigned i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)(sack >> 8 * i);
    stage(link, LINK_ACK, flags, link->send.next, bytes,
          sack != 0 ? sizeof bytes : 0);
    link->receive.ack_now = false;
    link->statistics.acks_sent++;
}

static void stage_slot(struct link *link, unsigned offset) {
    struct link_sender *s = &link->send;
    unsigned at = link_sent_slot(link, offset);
    struct link_send_slot *slot = &s->slots[at];
    slot->sent_us = (uint32_t)link->now_us;
    slot->order = s->order++;
    slot->state = LINK_SENT;
    stage(link, LINK_DATA, slot->flags, (uint16_t)(s->first + offset),
          s->payload + (size_t)at * link->config.frame_payload, slot->size);
}

static void stage_again(struct link *link) {
    struct link_sender *s = &link->send;
    unsigned offset = 0;
    while (s->slots[link_sent_slot(link, offset)].state != LINK_LOST) {
        offset++;
        LINK_ASSERT(offset < in_flight(link));
    }
    s->slots[link_sent_slot(link, offset)].again = true;
    s->lost--;
    link->statistics.retransmitted++;
    stage_slot(link, offset);
}

static void stage_next(struct link *link) {
    struct link_sender *s = &link->send;
    unsigned offset = in_flight(link);
    if (offset == 0)
        s->timer_us = link->now_us;
    s->slots[link_sent_slot(link, offset)].again = false;
    s->inside = (s->slots[link_sent_slot(link, offset)].flags & LINK_MORE) != 0;
    stage_slot(link, offset);
    s->next++;
}

void link_stage_hello(struct link *link, const uint8_t hello[LINK_HELLO_SIZE]) {
    stage(link, LINK_HELLO, 0, link->send.first, hello, LINK_HELLO_SIZE);
    link->statistics.hellos_sent++;
}

static void stage_datagram(struct link *link) {
    struct link_datagrams *n = &link->datagrams;
    stage(link, LINK_STATE, n->asks ? LINK_ASK : 0, link->send.next, n->out,
          n->out_size);
    n->due = false;
    link->statistics.datagrams_sent++;
}

static void stage_bye(struct link *link, unsigned flags) {
    stage(link, LINK_BYE, flags, link->send.next, NULL, 0);
    link->bye_us = link->now_us;
}

/* --- timers --------------------------------------------------------------- */

static void timeout(struct link *link) {
    struct link_sender *s = &link->send;
    unsigned count = in_flight(link);
    link->statistics.timeouts++;
    for (unsigned i = 0; i < count; i++) {
        struct link_send_slot *slot = &s->slots[link_sent_slot(link, i)];
        if (slot->state == LINK_SENT) {
            slot->state = LINK_LOST;
            s->lost++;
            break; /* its acknowledgement tells of the others */
        }
    }
}

void link_run_timer(struct link *link) {
    struct link_sender *s = &link->send;
    bool waits = in_flight(link) > 0;
    bool starves = !waits && s->next != s->end && !may_send_next(link);
    link->statistics.starved += s->next != s->end && !may_send_next(link);
    if (!link->up || (!waits && !starves) || s->lost > 0)
        return;
    if (link->out.end > link->out.begin) {
        s->timer_us = link->now_us; /* it has not left yet */
        return;
    }
    if (link->now_us - s->timer_us < link_timeout_us(link))
        return;
    if (waits) {
        timeout(link);
    } else {
        stage_ack(link, LINK_ASK);
        link->statistics.probes_sent++;
    }
    s->timer_us = link->now_us;
    if (s->backoff < BACKOFF_MAX)
        s->backoff++;
}

/* --- bytes ---------------------------------------------------------------- */

void link_forget_staged(struct link *link) {
    link->stalled = false;
    link->out.begin = link->out.end = 0;
}

enum link_flush link_flush(struct link *link) {
    struct link_bytes_out *out = &link->out;
    const struct link_pipe *pipe = &link->config.pipe;
    link->stalled = false;
    while (out->begin < out->end) {
        size_t left = out->end - out->begin;
        int taken = pipe->send(pipe->context, out->bytes + out->begin, left);
        if (taken < 0)
            return LINK_FLUSH_CLOSED;
        LINK_ASSERT((size_t)taken <= left);
        out->begin += (size_t)taken;
        link->statistics.bytes_sent += (unsigned)taken;
        if ((size_t)taken < left) {
            link->stalled = true;
            link->statistics.stalled++;
            return LINK_FLUSH_STALLED;
        }
    }
    out->begin = out->end = 0;
    return LINK_FLUSH_DONE;
}

bool link_staging_room(const struct link *link) {
    return link->buffer_bytes - link->out.end >=
           link_frame_bytes(&link->config) + FRAME_SLACK + 1;
}

/* Something to say without data. */
static bool stage_control(struct link *link) {
    uint64_t rest_us = link->now_us - link->sent_us;
    uint64_t bye_us = link->now_us - link->bye_us;
    if (link_ack_due(link) || rest_us >= link->config.keep_alive_us) {
        stage_ack(link, 0);
        return true;
    }
    if (link->closing && link_used(link) == 0 &&
        bye_us >= link->config.hello_us) {
        stage_bye(link, LINK_ASK);
        return true;
    }
    return false;
}

bool link_stage_frame(struct link *link) {
    if (link->bye_due) {
        stage_bye(link, 0);
        link->bye_due = false;
        return true;
    }
    if (!link->up)
        return false;
    if (link->datagrams.due)
        stage_datagram(link);
    else if (link->receive.ack_now && link->receive.early > 0)
        stage_ack(link, 0);
    else if (link->send.lost > 0)
        stage_again(link);
    else if (may_send_next(link))
        stage_next(link);
    else
        return stage_control(link);
    return true;
}
