#include "routes.h"

#include <string.h>

#include "check.h"

/* --- the table of altered parents ---------------------------------------- */

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
        if (routes->altered[middle].node < node) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

static unsigned usual_parent(const struct routes *routes, unsigned node) {
    unsigned relative = node ^ routes->wiring.gateway;
    return relative == 0 ? ROUTES_NONE : node ^ (relative & -relative);
}

static unsigned parent_of(const struct routes *routes, unsigned node) {
    unsigned place = place_of(routes, node);
    if (place < routes->altered_count && routes->altered[place].node == node) {
        return routes->altered[place].parent;
    }
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

/* --- what is dead -------------------------------------------------------- */

static bool link_is_dead(const struct routes *routes, unsigned node,
                         unsigned link) {
    const struct cube_wiring *w = &routes->wiring;
    return wiring_is_dead(w, w->dead_count, node, link, routes->dimension);
}

static bool node_is_dead(const struct routes *routes, unsigned node) {
    const struct cube_wiring *w = &routes->wiring;
    for (unsigned i = 0; i < w->dead_count; i++) {
        if (w->dead[i].dimension == CUBE_WHOLE_NODE &&
            w->dead[i].node == node) {
            return true;
        }
    }
    return false;
}

/* The lower end of the tree's link between two neighbours hangs free. */
static void set_free(struct routes *routes, unsigned node, unsigned link) {
    unsigned other = node ^ 1u << link;
    if (usual_parent(routes, node) == other) {
        set_parent(routes, node, ROUTES_NONE);
    } else if (usual_parent(routes, other) == node) {
        set_parent(routes, other, ROUTES_NONE);
    }
}

/* --- the tree ------------------------------------------------------------ */

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
    if (node_is_dead(routes, root)) {
        return false;
    }
    for (unsigned i = 0; i < nodes; i++) {
        unsigned node = root ^ i;
        if (root_of(routes, node) != root) {
            continue;
        }
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
            if (a->parent == ROUTES_NONE && node != routes->wiring.gateway) {
                more |= try_to_tie(routes, node);
            }
            place = place_of(routes, node + 1);
        }
    }
}

void routes_find(struct routes *routes, const struct cube_wiring *wiring) {
    struct cube_wiring *w = &routes->wiring;
    *w = *wiring;
    w->dead_count = 0;
    routes->altered_count = 0;
    for (unsigned i = 0; i < wiring->settled; i++) {
        if (wiring->dead[i].dimension != routes->dimension) {
            w->dead[w->dead_count++] = wiring->dead[i];
        }
    }
    routes->tree = w->dead_count > 0;
    for (unsigned i = 0; i < w->dead_count; i++) {
        unsigned node = w->dead[i].node, link = w->dead[i].dimension;
        if (link != CUBE_WHOLE_NODE) {
            set_free(routes, node, link);
            continue;
        }
        if (node != w->gateway) {
            set_parent(routes, node, ROUTES_NONE);
        }
        for (unsigned d = 0; d < routes->dimension; d++) {
            set_free(routes, node, d);
        }
    }
    tie_all(routes);
}

/* --- ways ---------------------------------------------------------------- */

bool routes_reach(const struct routes *routes, unsigned node) {
    return !routes->tree || root_of(routes, node) == routes->wiring.gateway;
}

unsigned routes_way(const struct routes *routes, unsigned self, unsigned dest) {
    LINK_ASSERT(self != dest);
    if (!routes->tree) {
        return lowest_bit(self ^ dest);
    }
    if (!routes_reach(routes, dest) || !routes_reach(routes, self)) {
        return ROUTES_NONE;
    }
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
    if (!routes->tree) {
        return binomial(routes, self ^ root);
    }
    for (unsigned d = 0; d < routes->dimension && routes_reach(routes, self);
         d++) {
        unsigned other = self ^ 1u << d;
        if (parent_of(routes, self) == other ||
            (parent_of(routes, other) == self)) {
            ways |= (uint32_t)1 << d;
        }
    }
    return ways;
}
