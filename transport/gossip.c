/* How what is known of the wiring spreads: each end of a link tells the other
 * in a state datagram, when the link comes up and when something new was
 * learnt, again and again until the other has said the same. */
#include "gossip.h"

#include <assert.h>
#include <string.h>

#include "check.h"
#include "cube_internal.h"
#include "bytes.h"
#include "link_internal.h"

/* Time without a first sign of the peer, as far as it is counted, and at most
 * between two looks. */
enum { ABSENT_US_MAX = 255000000, ABSENT_STEP_US = 500000 };

static bool is_host(const struct cube *cube) {
    return cube->config.self == CUBE_HOST;
}

static void tell(struct cube *cube, unsigned d, uint64_t now_us, bool ask) {
    link_put_datagram(cube->links[d], cube->datagram, cube->datagram_size, ask);
    cube->neighbours[d].told_us = now_us;
}

/* After a change: nobody has heard of it yet. */
static void spread(struct cube *cube) {
    cube->datagram_size = wiring_pack(&cube->wiring, cube->datagram);
    for (unsigned d = 0; d < cube->count; d++) {
        cube->neighbours[d].agreed = false;
        tell(cube, d, cube->now_us, true);
    }
}

static void begin_generation(struct cube *cube) {
    cube->stamp = wiring_stamp(&cube->wiring);
    for (unsigned d = 0; d < cube->count; d++)
        cube->neighbours[d].together = false;
    routes_find(&cube->routes, &cube->wiring);
    cube_drop_all(cube);
}

void cube_gossip_start(struct cube *cube) {
    if (is_host(cube)) {
        cube->wiring.generation = 1;
        cube->wiring.host_epoch = cube->config.epoch;
        cube->wiring.gateway = cube->config.gateway;
    }
    cube->stamp = wiring_stamp(&cube->wiring);
    routes_find(&cube->routes, &cube->wiring);
    spread(cube);
}

void cube_renew(struct cube *cube, const struct cube_wiring *next) {
    uint32_t present = cube->wiring.generation;
    LINK_ASSERT(
        is_host(cube) && next->dead_count <= CUBE_DEAD_MAX &&
        (next->gateway == 0 || next->gateway == cube->config.spare_node));
    cube->wiring = *next;
    if (!wiring_after(next->generation, present))
        cube->wiring.generation = wiring_next(present);
    cube->wiring.host_epoch = cube->config.epoch;
    cube->wiring.wrong_count = 0;
    wiring_settle(&cube->wiring, cube->config.dimension);
    begin_generation(cube);
    spread(cube);
}

/* The nodes still have the wiring of another host, or of an earlier start of
 * this one: ours must be the newer. */
static void outdo(struct cube *cube, const struct cube_wiring *theirs) {
    struct cube_wiring next = cube->wiring;
    next.generation = wiring_next(theirs->generation);
    next.dead_count = next.settled;
    cube->statistics.outdone++;
    cube_renew(cube, &next);
}

static void hear(struct cube *cube, const struct cube_wiring *theirs) {
    bool together = wiring_together(&cube->wiring, theirs);
    if (is_host(cube) && !together) {
        if (!wiring_after(cube->wiring.generation, theirs->generation))
            outdo(cube, theirs);
        return;
    }
    if (wiring_merge(&cube->wiring, theirs, cube->config.dimension)) {
        if (!together)
            begin_generation(cube);
        spread(cube);
    }
}

void cube_is_together(struct cube *cube, unsigned d, uint16_t sequence) {
    struct cube_neighbour *n = &cube->neighbours[d];
    if (!n->together || (int16_t)(sequence - n->since) > 0)
        n->since = sequence;
    n->together = true;
}

static void take_datagram(struct cube *cube, unsigned d,
                          const struct link_message *datagram, bool ask,
                          uint64_t now_us) {
    struct cube_wiring theirs;
    if (!wiring_unpack(&theirs, datagram->data, datagram->size,
                       cube->config.dimension)) {
        cube->statistics.misrouted++;
        return;
    }
    hear(cube, &theirs);
    if (wiring_together(&theirs, &cube->wiring))
        cube_is_together(cube, d, datagram->sequence);
    cube->neighbours[d].agreed = wiring_same(&theirs, &cube->wiring);
    if (ask && cube->neighbours[d].agreed)
        tell(cube, d, now_us, false);
}

/* --- what this end finds itself ------------------------------------------- */

/* Link d of this end as others know it. */
static struct cube_dead name_of(const struct cube *cube, unsigned d) {
    const struct cube_config *c = &cube->config;
    struct cube_dead name = {c->self, (uint8_t)d};
    if (is_host(cube)) {
        name.node = c->host_ports > 1 || d == 0 ? (uint16_t)d : c->spare_node;
        name.dimension = c->dimension;
    }
    return name;
}

/* A peer that was up once and is not heard of any more; or, where the host asks
 * for those too, one that never was.  Time in which this end itself stood still
 * counts little: others are not dead because it slept. */
static bool look_for_dead(struct cube *cube, unsigned d, uint64_t passed_us) {
    struct cube_neighbour *n = &cube->neighbours[d];
    enum link_state state = link_state(cube->links[d]);
    uint64_t frames = link_statistics(cube->links[d])->frames_received;
    bool spoke = frames != n->frames && state == LINK_SILENT;
    bool absent = n->comings == 0;
    uint32_t limit_us =
        absent ? cube->wiring.absent_s * 1000000u : cube->config.dead_us;
    uint32_t count_us = absent ? ABSENT_US_MAX : limit_us;
    uint32_t most_us = absent ? ABSENT_STEP_US : limit_us / 4;
    n->frames = frames;
    if (spoke || state == LINK_UP || state == LINK_CLOSING ||
        state == LINK_CLOSED) {
        n->quiet_us = 0;
        return false;
    }
    if (n->quiet_us < count_us)
        n->quiet_us += passed_us < most_us ? (uint32_t)passed_us : most_us;
    return limit_us != 0 && n->quiet_us >= limit_us &&
           wiring_add_dead(&cube->wiring, name_of(cube, d),
                           cube->config.dimension);
}

static bool look_for_wrong(struct cube *cube, unsigned d) {
    const struct link_peer *peer = link_peer(cube->links[d]);
    struct cube_wrong wrong = {cube->config.self, peer->node, (uint8_t)d,
                               peer->port, (uint8_t)peer->refusal};
    return peer->refusal != LINK_FITS && peer->refusal != LINK_IN_USE &&
           wiring_add_wrong(&cube->wiring, wrong);
}

static void look(struct cube *cube, uint64_t now_us) {
    uint64_t passed_us = now_us - cube->looked_us;
    bool news = false;
    if (passed_us < CUBE_GOSSIP_US)
        return;
    cube->looked_us = now_us;
    for (unsigned d = 0; d < cube->count; d++) {
        news |= look_for_dead(cube, d, passed_us);
        news |= look_for_wrong(cube, d);
    }
    if (news)
        spread(cube);
}

bool cube_link_is_dead(const struct cube *cube, unsigned d) {
    struct cube_dead name = name_of(cube, d);
    const struct cube_wiring *w = &cube->wiring;
    return wiring_is_dead(w, w->dead_count, name.node, name.dimension,
                          cube->config.dimension);
}

bool cube_reaches(const struct cube *cube, uint16_t node) {
    return routes_reach(&cube->routes, node);
}

/* --- each poll ------------------------------------------------------------ */

/* Whether a neighbour who listens has not said the same yet. */
static bool lags(const struct cube *cube, unsigned d) {
    return !cube->neighbours[d].agreed && link_state(cube->links[d]) == LINK_UP;
}

void cube_note_comings(struct cube *cube, uint64_t now_us) {
    for (unsigned d = 0; d < cube->count; d++) {
        const struct link_statistics *s = link_statistics(cube->links[d]);
        struct cube_neighbour *n = &cube->neighbours[d];
        if (n->comings != s->sessions + s->resumed) {
            n->comings = s->sessions + s->resumed;
            n->agreed = n->together = false;
            n->told_us = now_us - CUBE_GOSSIP_US;
        }
    }
}

void cube_gossip(struct cube *cube, uint64_t now_us) {
    struct link_message datagram;
    bool ask;
    cube->now_us = now_us;
    look(cube, now_us);
    cube_note_comings(cube, now_us);
    for (unsigned d = 0; d < cube->count; d++)
        if (link_take_datagram(cube->links[d], &datagram, &ask))
            take_datagram(cube, d, &datagram, ask, now_us);
    for (unsigned d = 0; d < cube->count; d++) {
        struct cube_neighbour *n = &cube->neighbours[d];
        if (lags(cube, d) && now_us - n->told_us >= CUBE_GOSSIP_US)
            tell(cube, d, now_us, true);
    }
}

uint64_t cube_gossip_due_us(const struct cube *cube, uint64_t now_us) {
    uint64_t due = UINT64_MAX;
    for (unsigned d = 0; d < cube->count; d++) {
        const struct cube_neighbour *n = &cube->neighbours[d];
        uint64_t passed = now_us - n->told_us;
        uint64_t left = passed < CUBE_GOSSIP_US ? CUBE_GOSSIP_US - passed : 0;
        if (lags(cube, d) && left < due)
            due = left;
    }
    return due;
}

const struct cube_wiring *cube_wiring(const struct cube *cube) {
    return &cube->wiring;
}

/* --- learn ---------------------------------------------------------------- */

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
    if (left == 0)
        return;
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
            learner->pipes[d].send != NULL)
            learner->heard[d].ask_left = (uint8_t)learner->ask_size;
        push(learner, d);
    }
}

/* Whether such a wire may be in a cube of that dimension. */
static bool sensible(const struct learned *l, unsigned expected_link) {
    if (l->dimension > CUBE_DIMENSION_MAX || l->self >= 1u << l->dimension)
        return false;
    if (l->teacher == CUBE_HOST)
        return expected_link == l->dimension;
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
    if (more->self != known->self || more->dimension != known->dimension)
        return;
    known->host_port |= more->host_port;
    if (more->epoch > known->epoch)
        known->epoch = more->epoch;
    learner->settled |= 1u << more->link;
}

static void take_hello(struct learner *learner, unsigned d,
                       const uint8_t *hello) {
    struct learned l;
    unsigned expected = hello[6];
    if (hello[0] != LINK_VERSION || hello[7] == 0)
        return;
    l.teacher = bytes_get16(hello + 2);
    l.self = bytes_get16(hello + 4);
    l.dimension = (uint8_t)(hello[7] - 1);
    l.link = (uint8_t)d;
    l.host_port = l.teacher == CUBE_HOST && l.self != 0;
    l.epoch = bytes_get32(hello + 12);
    if (!sensible(&l, expected))
        return;
    if (learner->ports && l.teacher == CUBE_HOST)
        expected = learner->host_link;
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
    if (!frame_decode(bytes, size, &header, hello, sizeof hello))
        return;
    if (header.kind == LINK_HELLO && header.size == LINK_HELLO_SIZE)
        take_hello(learner, d, hello);
    else if (header.kind == LINK_ACK && header.session == 0)
        learner->settled |= 1u << d;
}

/* Whether no more is to be waited for. */
static bool is_complete(const struct learner *learner) {
    const struct learned *known = &learner->known;
    bool host = learner->host_link < CUBE_LINKS_MAX;
    uint32_t own = (1u << known->dimension) - 1;
    if (!learner->found || !learner->ports || learner->asks == 0 ||
        learner->waited >= LEARN_ASKS)
        return learner->found;
    if (host && (known->self == 0 || learner->waited < LEARN_HOST_ASKS))
        own |= 1u << learner->host_link;
    return (learner->settled & own) == own;
}

/* Reads what there is room for, and takes the frames that are whole. */
static void learn_hear(struct learner *learner, unsigned d) {
    const struct link_pipe *pipe = &learner->pipes[d];
    uint8_t *bytes = learner->heard[d].bytes;
    unsigned size = learner->heard[d].size, begin = 0;
    int got = pipe->receive(pipe->context, bytes + size, LEARN_BYTES - size);
    if (got <= 0)
        return;
    LINK_ASSERT((unsigned)got <= LEARN_BYTES - size);
    size += (unsigned)got;
    for (unsigned i = 0; i < size && !is_complete(learner); i++) {
        if (bytes[i] == 0) {
            if (!learner->heard[d].skipping && i > begin)
                take_frame(learner, d, bytes + begin, i - begin);
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
    for (unsigned d = 0; d < learner->links && !is_complete(learner); d++)
        learn_hear(learner, d);
    if (is_complete(learner)) {
        *learned = learner->known;
        return true;
    }
    return false;
}
