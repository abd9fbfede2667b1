#include "wiring.h"

#include <assert.h>
#include <string.h>

#include "bytes.h"
#include "frame.h"

static_assert(WIRING_BYTES_MAX <= (int)LINK_DATAGRAM_MAX,
              "the wiring fits a datagram");

/* --- bytes --------------------------------------------------------------- */

static void put(uint8_t **at, uint32_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; i++) {
        *(*at)++ = (uint8_t)(value >> 8 * i);
    }
}

static uint32_t get(const uint8_t **at, unsigned bytes) {
    uint32_t value = 0;
    for (unsigned i = 0; i < bytes; i++) {
        value |= (uint32_t) * (*at)++ << 8 * i;
    }
    return value;
}

size_t wiring_pack(const struct cube_wiring *wiring, uint8_t *bytes) {
    uint8_t *at = bytes;
    put(&at, wiring->generation, 4);
    put(&at, wiring->host_epoch, 4);
    put(&at, wiring->gateway, 2);
    put(&at, wiring->settled, 1);
    put(&at, wiring->dead_count, 1);
    put(&at, wiring->wrong_count, 1);
    put(&at, wiring->absent_s, 1);
    for (unsigned i = 0; i < wiring->dead_count; i++) {
        put(&at, wiring->dead[i].node, 2);
        put(&at, wiring->dead[i].dimension, 1);
    }
    for (unsigned i = 0; i < wiring->wrong_count; i++) {
        const struct cube_wrong *w = &wiring->wrong[i];
        put(&at, w->node, 2);
        put(&at, w->link, 1);
        put(&at, w->refusal, 1);
        put(&at, w->peer_node, 2);
        put(&at, w->peer_link, 1);
    }
    return (size_t)(at - bytes);
}

/* --- sets ---------------------------------------------------------------- */

/* The order in which entries are kept. */
static uint32_t rank_of_dead(const struct cube_dead *dead) {
    return (uint32_t)dead->node << 8 | dead->dimension;
}

static uint64_t rank_of_wrong(const struct cube_wrong *w) {
    return (uint64_t)w->node << 40 | (uint64_t)w->link << 32 |
           (uint32_t)w->peer_node << 16 | (uint32_t)w->peer_link << 8 |
           w->refusal;
}

bool wiring_same(const struct cube_wiring *a, const struct cube_wiring *b) {
    uint8_t of_a[WIRING_BYTES_MAX], of_b[WIRING_BYTES_MAX];
    size_t size = wiring_pack(a, of_a);
    return wiring_pack(b, of_b) == size && memcmp(of_a, of_b, size) == 0;
}

bool wiring_after(uint32_t b, uint32_t a) {
    const uint32_t half = UINT32_C(1) << 31;
    uint32_t ahead = b - a;
    if (a == 0 || b == 0) {
        return b != 0;
    }
    return ahead == half ? b > a : ahead != 0 && ahead < half;
}

uint32_t wiring_next(uint32_t generation) {
    return generation == UINT32_MAX ? 1 : generation + 1;
}

bool wiring_together(const struct cube_wiring *a, const struct cube_wiring *b) {
    return a->generation == b->generation && a->host_epoch == b->host_epoch;
}

uint16_t wiring_stamp(const struct cube_wiring *wiring) {
    uint8_t bytes[8];
    bytes_put32(bytes, wiring->generation);
    bytes_put32(bytes + 4, wiring->host_epoch);
    return frame_crc16(bytes, sizeof bytes);
}

bool wiring_newer(const struct cube_wiring *b, const struct cube_wiring *a) {
    return wiring_after(b->generation, a->generation) ||
           (b->generation == a->generation && b->host_epoch > a->host_epoch);
}

bool wiring_is_dead(const struct cube_wiring *wiring, unsigned count,
                    unsigned node, unsigned link, unsigned dimension) {
    unsigned other = link < dimension ? node ^ 1u << link : node;
    unsigned lower = node < other ? node : other;
    for (unsigned i = 0; i < count; i++) {
        const struct cube_dead *d = &wiring->dead[i];
        if (d->dimension == CUBE_WHOLE_NODE
                ? d->node == node || d->node == other
                : d->node == lower && d->dimension == link) {
            return true;
        }
    }
    return false;
}

static bool node_is_dead(const struct cube_wiring *wiring, unsigned node) {
    for (unsigned i = 0; i < wiring->dead_count; i++) {
        const struct cube_dead *d = &wiring->dead[i];
        if (d->dimension == CUBE_WHOLE_NODE && d->node == node) {
            return true;
        }
    }
    return false;
}

bool wiring_add_dead(struct cube_wiring *wiring, struct cube_dead dead,
                     unsigned dimension) {
    if (dead.dimension != CUBE_WHOLE_NODE && dead.dimension < dimension) {
        dead.node = (uint16_t)(dead.node & ~(1u << dead.dimension));
    }
    if (dead.dimension == CUBE_WHOLE_NODE
            ? node_is_dead(wiring, dead.node)
            : wiring_is_dead(wiring, wiring->settled, dead.node, dead.dimension,
                             dimension)) {
        return false;
    }
    unsigned at = wiring->settled, count = wiring->dead_count;
    uint32_t rank = rank_of_dead(&dead);
    while (at < count && rank_of_dead(&wiring->dead[at]) < rank) {
        at++;
    }
    if (at == CUBE_DEAD_MAX ||
        (at < count && rank_of_dead(&wiring->dead[at]) == rank)) {
        return false;
    }
    count -= count == CUBE_DEAD_MAX;
    memmove(&wiring->dead[at + 1], &wiring->dead[at],
            (count - at) * sizeof dead);
    wiring->dead[at] = dead;
    wiring->dead_count = (uint16_t)(count + 1);
    return true;
}

bool wiring_add_wrong(struct cube_wiring *wiring, struct cube_wrong wrong) {
    unsigned at = 0, count = wiring->wrong_count;
    uint64_t rank = rank_of_wrong(&wrong);
    while (at < count && rank_of_wrong(&wiring->wrong[at]) < rank) {
        at++;
    }
    if (at == CUBE_WRONG_MAX ||
        (at < count && rank_of_wrong(&wiring->wrong[at]) == rank)) {
        return false;
    }
    count -= count == CUBE_WRONG_MAX;
    memmove(&wiring->wrong[at + 1], &wiring->wrong[at],
            (count - at) * sizeof wrong);
    wiring->wrong[at] = wrong;
    wiring->wrong_count = (uint16_t)(count + 1);
    return true;
}

bool wiring_merge(struct cube_wiring *mine, const struct cube_wiring *theirs,
                  unsigned dimension) {
    bool changed = false;
    if (wiring_newer(mine, theirs)) {
        return false;
    }
    if (wiring_newer(theirs, mine)) {
        *mine = *theirs;
        return true;
    }
    for (unsigned i = 0; i < theirs->dead_count; i++) {
        changed |= wiring_add_dead(mine, theirs->dead[i], dimension);
    }
    for (unsigned i = 0; i < theirs->wrong_count; i++) {
        changed |= wiring_add_wrong(mine, theirs->wrong[i]);
    }
    return changed;
}

/* --- from afar ----------------------------------------------------------- */

static bool sound(const struct cube_wiring *wiring, unsigned dimension) {
    unsigned nodes = 1u << dimension;
    bool right = wiring->gateway < nodes;
    for (unsigned i = 0; i < wiring->dead_count; i++) {
        const struct cube_dead *d = &wiring->dead[i];
        bool link = d->dimension < dimension;
        right &= d->node < nodes &&
                 (link || d->dimension == dimension ||
                  d->dimension == CUBE_WHOLE_NODE) &&
                 (!link || (d->node >> d->dimension & 1) == 0);
    }
    for (unsigned i = 0; i < wiring->wrong_count; i++) {
        const struct cube_wrong *w = &wiring->wrong[i];
        right &= w->node < nodes || w->node == CUBE_HOST;
    }
    return right;
}

/* Whether what was found stands as if it had been added here. */
static bool in_order(const struct cube_wiring *wiring, unsigned dimension) {
    struct cube_wiring again = *wiring;
    again.dead_count = again.settled;
    again.wrong_count = 0;
    for (unsigned i = wiring->settled; i < wiring->dead_count; i++) {
        (void)wiring_add_dead(&again, wiring->dead[i], dimension);
    }
    for (unsigned i = 0; i < wiring->wrong_count; i++) {
        (void)wiring_add_wrong(&again, wiring->wrong[i]);
    }
    return wiring_same(&again, wiring);
}

bool wiring_unpack(struct cube_wiring *wiring, const uint8_t *bytes,
                   size_t size, unsigned dimension) {
    const uint8_t *at = bytes;
    memset(wiring, 0, sizeof *wiring);
    if (size < WIRING_HEAD) {
        return false;
    }
    wiring->generation = get(&at, 4);
    wiring->host_epoch = get(&at, 4);
    wiring->gateway = (uint16_t)get(&at, 2);
    wiring->settled = (uint16_t)get(&at, 1);
    wiring->dead_count = (uint16_t)get(&at, 1);
    wiring->wrong_count = (uint16_t)get(&at, 1);
    wiring->absent_s = (uint8_t)get(&at, 1);
    if (wiring->dead_count > CUBE_DEAD_MAX ||
        wiring->settled > wiring->dead_count ||
        wiring->wrong_count > CUBE_WRONG_MAX ||
        size !=
            WIRING_HEAD + 3u * wiring->dead_count + 7u * wiring->wrong_count) {
        return false;
    }
    for (unsigned i = 0; i < wiring->dead_count; i++) {
        wiring->dead[i].node = (uint16_t)get(&at, 2);
        wiring->dead[i].dimension = (uint8_t)get(&at, 1);
    }
    for (unsigned i = 0; i < wiring->wrong_count; i++) {
        struct cube_wrong *w = &wiring->wrong[i];
        w->node = (uint16_t)get(&at, 2);
        w->link = (uint8_t)get(&at, 1);
        w->refusal = (uint8_t)get(&at, 1);
        w->peer_node = (uint16_t)get(&at, 2);
        w->peer_link = (uint8_t)get(&at, 1);
    }
    return sound(wiring, dimension) && in_order(wiring, dimension);
}

/* --- a new generation ---------------------------------------------------- */

/* The gateway lives while its host's wire does. */
static bool all_links_dead(const struct cube_wiring *wiring, unsigned node,
                           unsigned dimension) {
    bool all = dimension > 0 && node != wiring->gateway;
    for (unsigned d = 0; d < dimension; d++) {
        all &= wiring_is_dead(wiring, wiring->dead_count, node, d, dimension);
    }
    return all;
}

void wiring_settle(struct cube_wiring *wiring, unsigned dimension) {
    struct cube_wiring whole = *wiring, settled = *wiring;
    settled.dead_count = settled.settled = 0;
    for (unsigned i = 0; i < wiring->dead_count; i++) {
        struct cube_dead node = {wiring->dead[i].node, CUBE_WHOLE_NODE};
        unsigned d = wiring->dead[i].dimension;
        for (unsigned end = 0; end < 2; end++) {
            if (d == CUBE_WHOLE_NODE ||
                all_links_dead(&whole, node.node, dimension)) {
                (void)wiring_add_dead(&settled, node, dimension);
            }
            if (d != CUBE_WHOLE_NODE && d < dimension) {
                node.node = (uint16_t)(node.node ^ 1u << d);
            }
        }
    }
    settled.settled = settled.dead_count;
    for (unsigned i = 0; i < wiring->dead_count; i++) {
        if (wiring->dead[i].dimension != CUBE_WHOLE_NODE) {
            (void)wiring_add_dead(&settled, wiring->dead[i], dimension);
        }
    }
    settled.settled = settled.dead_count;
    *wiring = settled;
}
