#include "learn.h"

#include <assert.h>
#include <string.h>

#include "bytes.h"
#include "check.h"
#include "link_internal.h"

/* An acknowledgement of session 0, which is nobody's: whoever hears it greets.
 * The zero before it ends what noise, or the start before, has left. */
static void make_question(struct learner *learner) {
    static_assert(1 + FRAME_ENCODED(0) + FRAME_SLACK <= LEARN_ASK_BYTES,
                  "a question fits");
    struct frame_header header = {.kind = LINK_ACK};
    learner->ask[0] = 0;
    learner->ask_size =
        1 + (unsigned)frame_encode(learner->ask + 1, &header, NULL);
}

void learner_init(struct learner *learner, const struct link_pipe *pipes,
                  unsigned links) {
    LINK_ASSERT(links <= CUBE_LINKS_MAX);
    memset(learner, 0, sizeof *learner);
    memcpy(learner->pipes, pipes, links * sizeof *pipes);
    learner->links = links;
    learner->host_link = CUBE_LINKS_MAX;
    make_question(learner);
}

void learner_init_ports(struct learner *learner, const struct link_pipe *pipes,
                        unsigned ports, bool host) {
    learner_init(learner, pipes, ports + (host ? 1u : 0u));
    learner->ports = true;
    learner->host_link = host ? ports : CUBE_LINKS_MAX;
}

static void push(struct learner *learner, unsigned d) {
    const struct link_pipe *pipe = &learner->pipes[d];
    unsigned left = learner->heard[d].ask_left;
    if (left == 0) {
        return;
    }
    int taken = pipe->send(pipe->context,
                           learner->ask + (learner->ask_size - left), left);
    LINK_ASSERT(taken <= (int)left);
    /* A pipe that broke has lost what it took before. */
    learner->heard[d].ask_left =
        (uint8_t)(taken < 0 ? 0 : left - (unsigned)taken);
}

void learner_ask(struct learner *learner, uint64_t now_us) {
    bool due = learner->asks == 0 || now_us - learner->asked_us >= LEARN_ASK_US;
    if (due) {
        learner->asks++;
        learner->waited += learner->found;
        learner->asked_us = now_us;
    }
    for (unsigned d = 0; d < learner->links; d++) {
        if (due && learner->heard[d].ask_left == 0 &&
            learner->pipes[d].send != NULL) {
            learner->heard[d].ask_left = (uint8_t)learner->ask_size;
        }
        push(learner, d);
    }
}

/* Whether such a wire may be in a cube of that dimension. */
static bool sensible(const struct learned *l, unsigned expected_link) {
    if (l->dimension > CUBE_DIMENSION_MAX || l->self >= 1u << l->dimension) {
        return false;
    }
    if (l->teacher == CUBE_HOST) {
        return expected_link == l->dimension;
    }
    return expected_link < l->dimension &&
           l->teacher == (l->self ^ 1u << expected_link);
}

/* Whether this node has the links of that one: to its neighbours, and to the
 * host from node 0 and perhaps another. */
static bool fits(const struct learner *learner, const struct learned *l) {
    bool host = learner->host_link < CUBE_LINKS_MAX;
    if (learner->ports) {
        return l->dimension <= learner->links - (host ? 1u : 0u) &&
               (l->self != 0 || host);
    }
    return learner->links == l->dimension + 1u ||
           (l->self != 0 && learner->links == l->dimension);
}

/* What another greeting says of who was found already. */
static void hear_more(struct learner *learner, const struct learned *more) {
    struct learned *known = &learner->known;
    if (more->self != known->self || more->dimension != known->dimension) {
        return;
    }
    known->host_port |= more->host_port;
    if (more->epoch > known->epoch) {
        known->epoch = more->epoch;
    }
    learner->settled |= 1u << more->link;
}

static void take_hello(struct learner *learner, unsigned d,
                       const uint8_t *hello) {
    struct learned l;
    unsigned expected = hello[6];
    if (hello[0] != LINK_VERSION || hello[7] == 0) {
        return;
    }
    l.teacher = bytes_get16(hello + 2);
    l.self = bytes_get16(hello + 4);
    l.dimension = (uint8_t)(hello[7] - 1);
    l.link = (uint8_t)d;
    l.host_port = l.teacher == CUBE_HOST && l.self != 0;
    l.epoch = bytes_get32(hello + 12);
    if (!sensible(&l, expected)) {
        return;
    }
    if (learner->ports && l.teacher == CUBE_HOST) {
        expected = learner->host_link;
    }
    if (expected != d) {
        learner->misplaced++;
        learner->misplaced_link = (uint8_t)d;
        learner->misplaced_expected = (uint8_t)expected;
        return;
    }
    if (!fits(learner, &l)) {
        learner->misfits++;
        return;
    }
    if (!learner->found) {
        learner->found = true;
        learner->known = l;
    }
    hear_more(learner, &l);
}

static void take_frame(struct learner *learner, unsigned d,
                       const uint8_t *bytes, size_t size) {
    struct frame_header header;
    uint8_t hello[LINK_HELLO_SIZE];
    if (!frame_decode(bytes, size, &header, hello, sizeof hello)) {
        return;
    }
    if (header.kind == LINK_HELLO && header.size == LINK_HELLO_SIZE) {
        take_hello(learner, d, hello);
    } else if (header.kind == LINK_ACK && header.session == 0) {
        learner->settled |= 1u << d;
    }
}

/* Whether no more is to be waited for. */
static bool is_complete(const struct learner *learner) {
    const struct learned *known = &learner->known;
    bool host = learner->host_link < CUBE_LINKS_MAX;
    uint32_t own = (1u << known->dimension) - 1;
    if (!learner->found || !learner->ports || learner->asks == 0 ||
        learner->waited >= LEARN_ASKS) {
        return learner->found;
    }
    if (host && (known->self == 0 || learner->waited < LEARN_HOST_ASKS)) {
        own |= 1u << learner->host_link;
    }
    return (learner->settled & own) == own;
}

/* Reads what there is room for, and takes the frames that are whole. */
static void hear(struct learner *learner, unsigned d) {
    const struct link_pipe *pipe = &learner->pipes[d];
    uint8_t *bytes = learner->heard[d].bytes;
    unsigned size = learner->heard[d].size, begin = 0;
    int got = pipe->receive(pipe->context, bytes + size, LEARN_BYTES - size);
    if (got <= 0) {
        return;
    }
    LINK_ASSERT((unsigned)got <= LEARN_BYTES - size);
    size += (unsigned)got;
    for (unsigned i = 0; i < size && !is_complete(learner); i++) {
        if (bytes[i] == 0) {
            if (!learner->heard[d].skipping && i > begin) {
                take_frame(learner, d, bytes + begin, i - begin);
            }
            learner->heard[d].skipping = false;
            begin = i + 1;
        }
    }
    size -= begin;
    memmove(bytes, bytes + begin, size);
    if (size == LEARN_BYTES) { /* no greeting is so long */
        size = 0;
        learner->heard[d].skipping = true;
    }
    learner->heard[d].size = (uint8_t)size;
}

bool learner_poll(struct learner *learner, struct learned *learned) {
    for (unsigned d = 0; d < learner->links && !is_complete(learner); d++) {
        hear(learner, d);
    }
    if (is_complete(learner)) {
        *learned = learner->known;
        return true;
    }
    return false;
}
