#include "routes.h"

#include <assert.h>
#include <string.h>

#include "bytes.h"
#include "frame.h"
#include "check.h"

static_assert(WIRING_BYTES_MAX <= (int)LINK_DATAGRAM_MAX,
              "the wiring fits a datagram");

/* --- bytes ---------------------------------------------------------------- */

static void put(uint8_t **at, uint32_t value, unsigned bytes) {
    for (unsigned i = 0; i < bytes; i++)
        *(*at)++ = (uint8_t)(value >> 8 * i);
}

static uint32_t get(const uint8_t **at, unsigned bytes) {
    uint32_t value = 0;
    for (unsigned i = 0; i < bytes; i++)
        value |= (uint32_t) * (*at)++ << 8 * i;
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

/* --- sets ----------------------------------------------------------------- */

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
    if (a == 0 || b == 0)
        return b != 0;
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
                : d->node == lower && d->dimension == link)
            return true;
    }
    return false;
}

static bool node_is_dead(const struct cube_wiring *wiring, unsigned node) {
    for (unsigned i = 0; i < wiring->dead_count; i++) {
        const struct cube_dead *d = &wiring->dead[i];
        if (d->dimension == CUBE_WHOLE_NODE && d->node == node)
            return true;
    }
    return false;
}

bool wiring_add_dead(struct cube_wiring *wiring, struct cube_dead dead,
                     unsigned dimension) {
    if (dead.dimension != CUBE_WHOLE_NODE && dead.dimension < dimension)
        dead.node = (uint16_t)(dead.node & ~(1u << dead.dimension));
    if (dead.dimension == CUBE_WHOLE_NODE
            ? node_is_dead(wiring, dead.node)
            : wiring_is_dead(wiring, wiring->settled, dead.node, dead.dimension,
                             dimension))
        return false;
    unsigned at = wiring->settled, count = wiring->dead_count;
    uint32_t rank = rank_of_dead(&dead);
    while (at < count && rank_of_dead(&wiring->dead[at]) < rank)
        at++;
    if (at == CUBE_DEAD_MAX ||
        (at < count && rank_of_dead(&wiring->dead[at]) == rank))
        return false;
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
    while (at < count && rank_of_wrong(&wiring->wrong[at]) < rank)
        at++;
    if (at == CUBE_WRONG_MAX ||
        (at < count && rank_of_wrong(&wiring->wrong[at]) == rank))
        return false;
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
    if (wiring_newer(mine, theirs))
        return false;
    if (wiring_newer(theirs, mine)) {
        *mine = *theirs;
        return true;
    }
    for (unsigned i = 0; i < theirs->dead_count; i++)
        changed |= wiring_add_dead(mine, theirs->dead[i], dimension);
    for (unsigned i = 0; i < theirs->wrong_count; i++)
        changed |= wiring_add_wrong(mine, theirs->wrong[i]);
    return changed;
}

/* --- from afar ------------------------------------------------------------ */

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
    for (unsigned i = wiring->settled; i < wiring->dead_count; i++)
        (void)wiring_add_dead(&again, wiring->dead[i], dimension);
    for (unsigned i = 0; i < wiring->wrong_count; i++)
        (void)wiring_add_wrong(&again, wiring->wrong[i]);
    return wiring_same(&again, wiring);
}

bool wiring_unpack(struct cube_wiring *wiring, const uint8_t *bytes,
                   size_t size, unsigned dimension) {
    const uint8_t *at = bytes;
    memset(wiring, 0, sizeof *wiring);
    if (size < WIRING_HEAD)
        return false;
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
            WIRING_HEAD + 3u * wiring->dead_count + 7u * wiring->wrong_count)
        return false;
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

/* --- a new generation ----------------------------------------------------- */

/* The gateway lives while its host's wire does. */
static bool all_links_dead(const struct cube_wiring *wiring, unsigned node,
                           unsigned dimension) {
    bool all = dimension > 0 && node != wiring->gateway;
    for (unsigned d = 0; d < dimension; d++)
        all &= wiring_is_dead(wiring, wiring->dead_count, node, d, dimension);
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
                all_links_dead(&whole, node.node, dimension))
                (void)wiring_add_dead(&settled, node, dimension);
            if (d != CUBE_WHOLE_NODE && d < dimension)
                node.node = (uint16_t)(node.node ^ 1u << d);
        }
    }
    settled.settled = settled.dead_count;
    for (unsigned i = 0; i < wiring->dead_count; i++)
        if (wiring->dead[i].dimension != CUBE_WHOLE_NODE)
            (void)wiring_add_dead(&settled, wiring->dead[i], dimension);
    settled.settled = settled.dead_count;
    *wiring = settled;
}

/* --- routes --------------------------------------------------------------- */

/* --- the table of altered parents ----------------------------------------- */

static unsigned lowest_bit(unsigned bits) {
    return (unsigned)__builtin_ctz(bits);
}

/* Tying a subtree whose root has j links below it turns round j + 1 parents at
 * most; a dead node sets free the subtrees of its children, of 0 .. j - 1
 * links. The nodes with the most are one with dimension - 1, two with one less,
 * .. */
static unsigned altered_max(unsigned dimension) {
    unsigned nodes = 1u << dimension, left = CUBE_DEAD_MAX, sum = 1;
    for (unsigned i = 1; i <= dimension && left > 0; i++) {
        unsigned j = dimension - i;
        unsigned here = left < 1u << (i - 1) ? left : 1u << (i - 1);
        sum += here * (1 + j * (j + 1) / 2);
        left -= here;
    }
    return sum < nodes ? sum : nodes;
}

size_t routes_bytes(unsigned dimension) {
    return altered_max(dimension) * sizeof(struct routes_altered);
}

void routes_init(struct routes *routes, void *memory, unsigned dimension) {
    memset(routes, 0, sizeof *routes);
    routes->altered = memory;
    routes->altered_max = altered_max(dimension);
    routes->dimension = dimension;
}

/* The place of a node among the altered, or where it would be. */
static unsigned place_of(const struct routes *routes, unsigned node) {
    unsigned low = 0, high = routes->altered_count;
    while (low < high) {
        unsigned middle = (low + high) / 2;
        if (routes->altered[middle].node < node)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static unsigned usual_parent(const struct routes *routes, unsigned node) {
    unsigned relative = node ^ routes->wiring.gateway;
    return relative == 0 ? ROUTES_NONE : node ^ (relative & -relative);
}

static unsigned parent_of(const struct routes *routes, unsigned node) {
    unsigned place = place_of(routes, node);
    if (place < routes->altered_count && routes->altered[place].node == node)
        return routes->altered[place].parent;
    return usual_parent(routes, node);
}

static void set_parent(struct routes *routes, unsigned node, unsigned parent) {
    unsigned place = place_of(routes, node);
    struct routes_altered *at = &routes->altered[place];
    if (place == routes->altered_count || at->node != node) {
        LINK_ASSERT(routes->altered_count < routes->altered_max);
        memmove(at + 1, at, (routes->altered_count - place) * sizeof *at);
        routes->altered_count++;
    }
    at->node = (uint16_t)node;
    at->parent = (uint16_t)parent;
}

/* The end of the way up: the gateway, or a node that hangs free. */
static unsigned root_of(const struct routes *routes, unsigned node) {
    unsigned parent = parent_of(routes, node);
    while (parent != ROUTES_NONE) {
        node = parent;
        parent = parent_of(routes, node);
    }
    return node;
}

/* --- what is dead --------------------------------------------------------- */

static bool link_is_dead(const struct routes *routes, unsigned node,
                         unsigned link) {
    const struct cube_wiring *w = &routes->wiring;
    return wiring_is_dead(w, w->dead_count, node, link, routes->dimension);
}

static bool routes_node_is_dead(const struct routes *routes, unsigned node) {
    const struct cube_wiring *w = &routes->wiring;
    for (unsigned i = 0; i < w->dead_count; i++)
        if (w->dead[i].dimension == CUBE_WHOLE_NODE && w->dead[i].node == node)
            return true;
    return false;
}

/* The lower end of the tree's link between two neighbours hangs free. */
static void set_free(struct routes *routes, unsigned node, unsigned link) {
    unsigned other = node ^ 1u << link;
    if (usual_parent(routes, node) == other)
        set_parent(routes, node, ROUTES_NONE);
    else if (usual_parent(routes, other) == node)
        set_parent(routes, other, ROUTES_NONE);
}

/* --- the tree ------------------------------------------------------------- */

/* Ties the subtree of a node to `parent` by that node. */
static void tie(struct routes *routes, unsigned node, unsigned parent) {
    while (node != ROUTES_NONE) {
        unsigned next = parent_of(routes, node);
        set_parent(routes, node, parent);
        parent = node;
        node = next;
    }
}

/* Ties the subtree that hangs free at `root`, where that is possible. */
static bool try_to_tie(struct routes *routes, unsigned root) {
    unsigned gateway = routes->wiring.gateway;
    unsigned nodes = 1u << lowest_bit(root ^ gateway);
    if (routes_node_is_dead(routes, root))
        return false;
    for (unsigned i = 0; i < nodes; i++) {
        unsigned node = root ^ i;
        if (root_of(routes, node) != root)
            continue;
        for (unsigned d = 0; d < routes->dimension; d++) {
            unsigned other = node ^ 1u << d;
            if (!link_is_dead(routes, node, d) &&
                root_of(routes, other) == gateway) {
                tie(routes, node, other);
                return true;
            }
        }
    }
    return false;
}

/* In ascending order, again and again until nothing more can be tied. */
static void tie_all(struct routes *routes) {
    bool more = true;
    while (more) {
        more = false;
        unsigned place = 0;
        while (place < routes->altered_count) {
            const struct routes_altered *a = &routes->altered[place];
            unsigned node = a->node;
            if (a->parent == ROUTES_NONE && node != routes->wiring.gateway)
                more |= try_to_tie(routes, node);
            place = place_of(routes, node + 1);
        }
    }
}

void routes_find(struct routes *routes, const struct cube_wiring *wiring) {
    struct cube_wiring *w = &routes->wiring;
    *w = *wiring;
    w->dead_count = 0;
    routes->altered_count = 0;
    for (unsigned i = 0; i < wiring->settled; i++)
        if (wiring->dead[i].dimension != routes->dimension)
            w->dead[w->dead_count++] = wiring->dead[i];
    routes->tree = w->dead_count > 0;
    for (unsigned i = 0; i < w->dead_count; i++) {
        unsigned node = w->dead[i].node, link = w->dead[i].dimension;
        if (link != CUBE_WHOLE_NODE) {
            set_free(routes, node, link);
            continue;
        }
        if (node != w->gateway)
            set_parent(routes, node, ROUTES_NONE);
        for (unsigned d = 0; d < routes->dimension; d++)
            set_free(routes, node, d);
    }
    tie_all(routes);
}

/* --- ways ----------------------------------------------------------------- */

bool routes_reach(const struct routes *routes, unsigned node) {
    return !routes->tree || root_of(routes, node) == routes->wiring.gateway;
}

unsigned routes_way(const struct routes *routes, unsigned self, unsigned dest) {
    LINK_ASSERT(self != dest);
    if (!routes->tree)
        return lowest_bit(self ^ dest);
    if (!routes_reach(routes, dest) || !routes_reach(routes, self))
        return ROUTES_NONE;
    unsigned node = dest, parent = parent_of(routes, node);
    while (parent != ROUTES_NONE && parent != self) {
        node = parent;
        parent = parent_of(routes, node);
    }
    unsigned next = parent == self ? node : parent_of(routes, self);
    return lowest_bit(self ^ next);
}

static unsigned highest_bit(unsigned bits) {
    return 31u - (unsigned)__builtin_clz(bits);
}

/* E-cube and binomial trees change the bits of an address in ascending order,
 * so the bit changed last is the highest bit in which the two numbers differ.
 * Off the e-cube path, the link from a node is the tree's link to that node. */
unsigned routes_way_from(const struct routes *routes, unsigned self,
                         unsigned source) {
    LINK_ASSERT(self != source);
    return routes->tree ? routes_way(routes, self, source)
                        : highest_bit(self ^ source);
}

/* The binomial tree rooted at root: from a node whose relative address ends
 * at bit h, on along the dimensions above h.  Its paths are those of e-cube. */
static uint32_t binomial(const struct routes *routes, unsigned relative) {
    unsigned above = relative == 0 ? 0 : highest_bit(relative) + 1;
    return ((1u << routes->dimension) - 1) >> above << above;
}

uint32_t routes_to_all(const struct routes *routes, unsigned self,
                       unsigned root) {
    uint32_t ways = 0;
    if (!routes->tree)
        return binomial(routes, self ^ root);
    for (unsigned d = 0; d < routes->dimension && routes_reach(routes, self);
         d++) {
        unsigned other = self ^ 1u << d;
        if (parent_of(routes, self) == other ||
            (parent_of(routes, other) == self))
            ways |= (uint32_t)1 << d;
    }
    return ways;
}
