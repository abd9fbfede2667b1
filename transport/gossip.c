/* How what is known of the wiring spreads: each end of a link tells the other
 * in a state datagram, when the link comes up and when something new was
 * learnt, again and again until the other has said the same. */
#include "check.h"
#include "cube_internal.h"

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
    for (unsigned d = 0; d < cube->count; d++) {
        cube->neighbours[d].together = false;
    }
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
    if (!wiring_after(next->generation, present)) {
        cube->wiring.generation = wiring_next(present);
    }
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
        if (!wiring_after(cube->wiring.generation, theirs->generation)) {
            outdo(cube, theirs);
        }
        return;
    }
    if (wiring_merge(&cube->wiring, theirs, cube->config.dimension)) {
        if (!together) {
            begin_generation(cube);
        }
        spread(cube);
    }
}

void cube_is_together(struct cube *cube, unsigned d, uint16_t sequence) {
    struct cube_neighbour *n = &cube->neighbours[d];
    if (!n->together || (int16_t)(sequence - n->since) > 0) {
        n->since = sequence;
    }
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
    if (wiring_together(&theirs, &cube->wiring)) {
        cube_is_together(cube, d, datagram->sequence);
    }
    cube->neighbours[d].agreed = wiring_same(&theirs, &cube->wiring);
    if (ask && cube->neighbours[d].agreed) {
        tell(cube, d, now_us, false);
    }
}

/* --- what this end finds itself ------------------------------------------ */

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
    if (n->quiet_us < count_us) {
        n->quiet_us += passed_us < most_us ? (uint32_t)passed_us : most_us;
    }
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
    if (passed_us < CUBE_GOSSIP_US) {
        return;
    }
    cube->looked_us = now_us;
    for (unsigned d = 0; d < cube->count; d++) {
        news |= look_for_dead(cube, d, passed_us);
        news |= look_for_wrong(cube, d);
    }
    if (news) {
        spread(cube);
    }
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

/* --- each poll ----------------------------------------------------------- */

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
    for (unsigned d = 0; d < cube->count; d++) {
        if (link_take_datagram(cube->links[d], &datagram, &ask)) {
            take_datagram(cube, d, &datagram, ask, now_us);
        }
    }
    for (unsigned d = 0; d < cube->count; d++) {
        struct cube_neighbour *n = &cube->neighbours[d];
        if (lags(cube, d) && now_us - n->told_us >= CUBE_GOSSIP_US) {
            tell(cube, d, now_us, true);
        }
    }
}

uint64_t cube_gossip_due_us(const struct cube *cube, uint64_t now_us) {
    uint64_t due = UINT64_MAX;
    for (unsigned d = 0; d < cube->count; d++) {
        const struct cube_neighbour *n = &cube->neighbours[d];
        uint64_t passed = now_us - n->told_us;
        uint64_t left = passed < CUBE_GOSSIP_US ? CUBE_GOSSIP_US - passed : 0;
        if (lags(cube, d) && left < due) {
            due = left;
        }
    }
    return due;
}

const struct cube_wiring *cube_wiring(const struct cube *cube) {
    return &cube->wiring;
}
