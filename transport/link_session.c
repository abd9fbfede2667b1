#include "link_session.h"

#include "bytes.h"

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
    if (hello[0] != LINK_VERSION) {
        return LINK_WRONG_VERSION;
    }
    if (bytes_get16(hello + 2) != c->peer_node || hello[1] != c->peer_port ||
        bytes_get16(hello + 4) != c->node || hello[6] != c->port) {
        return LINK_WRONG_WIRE;
    }
    if (hello[7] != 0 && c->greeting != 0 && hello[7] != c->greeting) {
        return LINK_WRONG_GREETING;
    }
    if (bytes_get16(hello + 18) != c->frame_payload ||
        bytes_get16(hello + 20) != c->message_max ||
        window < link->fragments_max || window > LINK_WINDOW_MAX) {
        return LINK_WRONG_SIZES;
    }
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
    if (peer->refusal == LINK_FITS && in_use) {
        peer->refusal = LINK_IN_USE;
    }
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
    if (link_refuses(link)) {
        return LINK_FOREIGN;
    }
    if (link->peer_epoch != 0 && session == link->session_in) {
        if (link->up || link->closed) {
            return LINK_PRESENT;
        }
        link->statistics.resumed++;
        link->up = true;
        return LINK_RESUMED;
    }
    if (link->candidate.epoch != 0 && session == link->candidate.session_in) {
        return start_session(link);
    }
    return LINK_FOREIGN;
}

enum link_session link_on_hello(struct link *link,
                                const struct frame_header *header,
                                const uint8_t hello[LINK_HELLO_SIZE]) {
    uint32_t epoch = bytes_get32(hello + 8), mine = bytes_get32(hello + 12);
    if (epoch == 0 || link->closing) {
        return LINK_FOREIGN;
    }
    if (intrudes(link, epoch)) {
        link->intruder = epoch;
        link->hello_now = true;
        return LINK_FOREIGN;
    }
    link->heard_us = link->now_us;
    if (epoch == link->peer_epoch) {
        link->kept_us = link->now_us;
    }
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
    if (link->now_us - link->hello_us >= link->config.hello_us) {
        link->hello_now = true;
    }
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
    if (c->epoch != 0 && c->hellos_left-- == 0) {
        c->epoch = 0;
    }
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
