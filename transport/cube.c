#include <string.h>

#include "bytes.h"
#include "check.h"
#include "cube_internal.h"

/* A message's own header: dest, source (16 bits, low byte first), type, hops,
 * stamp (of the generation). */
enum { HEAD = CUBE_HEAD, STAMP = 6 };

enum { HOPS_MAX = 255 };         /* off the e-cube paths */
enum { LOCAL = CUBE_LINKS_MAX }; /* bit of this node among the ways */

/* --- which way ------------------------------------------------------------ */

static bool is_host(const struct cube *cube) {
    return cube->config.self == CUBE_HOST;
}

static unsigned nodes(const struct cube *cube) {
    return 1u << cube->config.dimension;
}

/* Whether each of the host's wires is used: not on a tree, which has its root
 * at the gateway. */
static bool many_host_ports(const struct cube *cube) {
    return cube->config.host_ports > 1 && !cube->routes.tree;
}

/* The node by whose host port a node and the host reach each other.  Between
 * the two e-cube's dimensions are above those in which these nodes differ. */
static unsigned host_port_of(const struct cube *cube, unsigned node) {
    return many_host_ports(cube) ? node & (cube->config.host_ports - 1u)
                                 : cube->wiring.gateway;
}

/* The host's link to the host port of a node. */
static unsigned link_of_host_port(const struct cube *cube, unsigned node) {
    if (cube->config.host_ports > 1)
        return node;
    return cube->count > 1 && node == cube->config.spare_node ? 1 : 0;
}

/* A host port is a node's last; 0: there is no way. */
static uint32_t way_to(const struct cube *cube, unsigned dest) {
    unsigned self = cube->config.self;
    if (is_host(cube))
        return (uint32_t)1 << link_of_host_port(cube, host_port_of(cube, dest));
    if (dest == CUBE_HOST) {
        dest = host_port_of(cube, self);
        if (self == dest) {
            return cube->count > cube->config.dimension
                       ? (uint32_t)1 << cube->config.dimension
                       : 0;
        }
    }
    if (dest == self)
        return (uint32_t)1 << LOCAL;
    unsigned link = routes_way(&cube->routes, self, dest);
    return link == ROUTES_NONE ? 0 : (uint32_t)1 << link;
}

static uint32_t ways_to_all(const struct cube *cube, unsigned source) {
    unsigned self = cube->config.self;
    unsigned root = source == CUBE_HOST ? host_port_of(cube, self) : source;
    uint32_t between = many_host_ports(cube) ? cube->config.host_ports - 1u : 0;
    if (is_host(cube)) {
        return between != 0
                   ? ((uint32_t)1 << cube->count) - 1
                   : (uint32_t)1
                         << link_of_host_port(cube, host_port_of(cube, 0));
    }
    uint32_t ways = routes_to_all(&cube->routes, self, root);
    if (source == CUBE_HOST)
        ways &= ~between; /* what differs in these has a host port of its own */
    return self == source ? ways : ways | (uint32_t)1 << LOCAL;
}

/* The one link on which messages of that source arrive here.  A message of that
 * source on any other link is dropped. */
static unsigned way_from(const struct cube *cube, unsigned source) {
    unsigned self = cube->config.self;
    if (is_host(cube))
        return link_of_host_port(cube, host_port_of(cube, source));
    if (source == CUBE_HOST) {
        source = host_port_of(cube, self);
        if (source == self)
            return cube->config.dimension;
    }
    return routes_way_from(&cube->routes, self, source);
}

/* For a message that arrived on link d; 0: it has lost its way, or its source
 * is not behind that link. */
static uint32_t ways_of(const struct cube *cube, unsigned d, unsigned source,
                        unsigned dest) {
    bool source_known = source < nodes(cube) || source == CUBE_HOST;
    bool dest_known =
        dest < nodes(cube) || dest == CUBE_HOST || dest == CUBE_ALL;
    if (!source_known || !dest_known || source == cube->config.self ||
        way_from(cube, source) != d)
        return 0;
    if (is_host(cube))
        return dest == CUBE_HOST ? (uint32_t)1 << LOCAL : 0;
    return dest == CUBE_ALL ? ways_to_all(cube, source) : way_to(cube, dest);
}

/* --- memory --------------------------------------------------------------- */

static size_t up64(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

size_t cube_arena_bytes(const struct cube_config *config) {
    if (cube_config_fault(config) != NULL)
        return 0;
    size_t bytes =
        up64(sizeof(struct cube)) + up64(routes_bytes(config->dimension));
    for (unsigned d = 0; d < cube_links_of(config); d++) {
        struct link_config c = cube_link_config(config, d);
        bytes += up64(link_bytes(&c));
    }
    return bytes;
}

struct cube *cube_init(void *arena, size_t bytes,
                       const struct cube_config *config) {
    size_t needed = cube_arena_bytes(config);
    if (needed == 0 || bytes < needed)
        return NULL;
    struct cube *cube = arena;
    uint8_t *rest = (uint8_t *)arena + up64(sizeof *cube);
    memset(cube, 0, sizeof *cube);
    cube->config = *config;
    cube->count = cube_links_of(config);
    cube->held = CUBE_LINKS_MAX;
    routes_init(&cube->routes, rest, config->dimension);
    rest += up64(routes_bytes(config->dimension));
    for (unsigned d = 0; d < cube->count; d++) {
        struct link_config c = cube_link_config(config, d);
        cube->links[d] = link_init(rest, link_bytes(&c), &c);
        if (cube->links[d] == NULL)
            return NULL;
        rest += up64(link_bytes(&c));
    }
    cube_gossip_start(cube);
    return cube;
}

/* --- passing on ----------------------------------------------------------- */

/* Whether a message of another generation is to be dropped: the neighbour sent
 * it, and was in our generation afterwards.  If not, it is of a generation that
 * he has told us in a state datagram, or has left for ours, which he tells us:
 * that comes.  Numbers are not compared, as generations may lie far apart. */
static bool outdated(const struct cube *cube, unsigned d, uint16_t sequence) {
    const struct cube_neighbour *n = &cube->neighbours[d];
    return n->together && (int16_t)(sequence - n->since) < 0;
}

/* The oldest message of link d, and where it must still go. */
static bool look_at(struct cube *cube, unsigned d) {
    struct cube_arrival *a = &cube->arrivals[d];
    while (!a->there && link_read(cube->links[d], &a->message)) {
        const uint8_t *head = a->message.data;
        unsigned stamp =
            a->message.size >= HEAD ? bytes_get16(head + STAMP) : cube->stamp;
        if (cube->wiring.generation == 0)
            return false;
        if (stamp != cube->stamp) {
            if (!outdated(cube, d, a->message.sequence))
                return false;
            cube->statistics.outdated++;
            link_release(cube->links[d]);
            continue;
        }
        cube_is_together(cube, d, a->message.sequence);
        bool whole = a->message.size >= HEAD;
        unsigned hops_max =
            cube->routes.tree ? HOPS_MAX : cube->config.dimension + 2u;
        a->ways =
            whole && head[5] < hops_max
                ? ways_of(cube, d, bytes_get16(head + 2), bytes_get16(head))
                : 0;
        a->ways &= ~((uint32_t)1 << d); /* never back */
        if (a->ways == 0) {
            cube->statistics.misrouted++;
            link_release(cube->links[d]);
        } else {
            a->there = true;
        }
    }
    return a->there;
}

static void done_with(struct cube *cube, unsigned d) {
    cube->arrivals[d].there = false;
    link_release(cube->links[d]);
}

/* A message that is being read here stays until it was. */
void cube_drop_all(struct cube *cube) {
    const uint32_t local = (uint32_t)1 << LOCAL;
    for (unsigned d = 0; d < cube->count; d++) {
        struct cube_arrival *a = &cube->arrivals[d];
        unsigned unsent = link_forget_unsent(cube->links[d]);
        cube->statistics.outdated += unsent;
        if (a->there && cube->held == d) {
            a->ways = local;
        } else if (a->there) {
            cube->statistics.outdated++;
            done_with(cube, d);
        }
    }
    cube->kept_back = 0;
    cube->again = false;
}

/* A link's last room for a message of any size goes to messages of others and
 * of this node in turn, so that neither starves: small ones, of a frame each,
 * would leave a large one none for ever. */
static bool may_pass_on(struct cube *cube, unsigned out, size_t size) {
    const struct link *link = cube->links[out];
    uint32_t bit = (uint32_t)1 << out;
    if (cube->tending)
        return link_room(link, CUBE_MESSAGE_MAX) > 1;
    if (link_room(link, size) == 0)
        return false;
    bool last = link_room_behind(link, size, CUBE_MESSAGE_MAX) == 0;
    if (last && (cube->kept_back & bit) != 0) {
        /* Its turn comes with the next poll, or with an acknowledgement. */
        cube->again |= link_room(link, CUBE_MESSAGE_MAX) > 0;
        return false;
    }
    if (last)
        cube->kept_back |= bit;
    return true;
}

static void pass_on(struct cube *cube, struct cube_arrival *a, unsigned out) {
    uint8_t head[HEAD];
    const struct link_message *m = &a->message;
    memcpy(head, m->data, HEAD);
    head[5]++;
    int status = link_write(cube->links[out], head, HEAD, m->data + HEAD,
                            m->size - HEAD);
    LINK_ASSERT(status == 0);
    cube->statistics.passed_on++;
}

/* Passes on what link d has brought, up to a message that must wait: for room
 * ahead, or for this node to read it. */
static int pass_on_from(struct cube *cube, unsigned d) {
    struct cube_arrival *a = &cube->arrivals[d];
    int passed = 0;
    unsigned most = LINK_WINDOW_MAX;
    while (most-- > 0 && look_at(cube, d)) {
        for (unsigned out = 0; out < cube->count; out++) {
            uint32_t bit = (uint32_t)1 << out;
            if ((a->ways & bit) != 0 &&
                may_pass_on(cube, out, a->message.size)) {
                pass_on(cube, a, out);
                a->ways &= ~bit;
                passed++;
            }
        }
        if (a->ways != 0) {
            cube->statistics.blocked += a->ways != (uint32_t)1 << LOCAL;
            break;
        }
        done_with(cube, d);
    }
    return passed;
}

static int pass_on_all(struct cube *cube) {
    int count = 0;
    cube->turn = cube->turn + 1 >= cube->count ? 0 : cube->turn + 1;
    for (unsigned i = 0; i < cube->count; i++) {
        unsigned d = cube->turn + i;
        count += pass_on_from(cube, d < cube->count ? d : d - cube->count);
    }
    return count;
}

int cube_poll(struct cube *cube, uint64_t now_us) {
    int count = 0;
    cube->again = false;
    for (unsigned d = 0; d < cube->count; d++)
        count += link_poll_receive(cube->links[d], now_us);
    cube_gossip(cube, now_us);
    uint32_t kept_before = cube->kept_back;
    count += pass_on_all(cube);
    for (unsigned d = 0; d < cube->count; d++) {
        /* Kept back for one poll with room, no longer. */
        if (link_room(cube->links[d], CUBE_MESSAGE_MAX) > 0)
            cube->kept_back &= ~(kept_before & (uint32_t)1 << d);
        count += link_poll_send(cube->links[d], now_us);
    }
    return count;
}

int cube_tend(struct cube *cube, uint64_t now_us) {
    int count = 0;
    for (unsigned d = 0; d < cube->count; d++)
        count += link_tend_receive(cube->links[d], now_us);
    cube_note_comings(cube, now_us);
    cube->tending = true;
    count += pass_on_all(cube);
    cube->tending = false;
    for (unsigned d = 0; d < cube->count; d++)
        count += link_poll_send(cube->links[d], now_us);
    return count;
}

/* --- messages of this node ------------------------------------------------ */

static uint32_t ways_out(const struct cube *cube, uint16_t dest) {
    LINK_ASSERT(dest != cube->config.self);
    LINK_ASSERT(dest == CUBE_ALL || dest == CUBE_HOST || dest < nodes(cube));
    return dest == CUBE_ALL ? ways_to_all(cube, cube->config.self)
                            : way_to(cube, dest);
}

static unsigned room_on(const struct cube *cube, uint32_t ways, size_t size) {
    unsigned room = cube->wiring.generation != 0 ? LINK_WINDOW_MAX : 0;
    for (unsigned d = 0; d < cube->count; d++) {
        unsigned here = link_room(cube->links[d], size);
        if ((ways & (uint32_t)1 << d) != 0 && here < room)
            room = here;
    }
    return room;
}

int cube_write(struct cube *cube, uint16_t dest, uint8_t type, const void *data,
               size_t size) {
    uint16_t self = cube->config.self;
    uint32_t ways = ways_out(cube, dest);
    uint8_t head[HEAD] = {(uint8_t)dest,
                          (uint8_t)(dest >> 8),
                          (uint8_t)self,
                          (uint8_t)(self >> 8),
                          type,
                          0,
                          (uint8_t)cube->stamp,
                          (uint8_t)(cube->stamp >> 8)};
    LINK_ASSERT(size <= CUBE_PAYLOAD_MAX);
    cube->statistics.unreachable += ways == 0 && dest != CUBE_ALL;
    if (room_on(cube, ways, HEAD + size) == 0)
        return CUBE_AGAIN;
    for (unsigned d = 0; d < cube->count; d++) {
        if ((ways & (uint32_t)1 << d) != 0) {
            int status = link_write(cube->links[d], head, HEAD, data, size);
            LINK_ASSERT(status == 0);
        }
    }
    cube->kept_back &= ~ways;
    cube->statistics.written++;
    return 0;
}

unsigned cube_room(const struct cube *cube, uint16_t dest) {
    return room_on(cube, ways_out(cube, dest), CUBE_MESSAGE_MAX);
}

bool cube_read_from(struct cube *cube, unsigned d,
                    struct cube_message *message) {
    LINK_ASSERT(cube->held == CUBE_LINKS_MAX && d < cube->count);
    pass_on_from(cube, d);
    const struct cube_arrival *a = &cube->arrivals[d];
    if (!a->there || (a->ways & (uint32_t)1 << LOCAL) == 0)
        return false;
    const uint8_t *head = a->message.data;
    message->source = bytes_get16(head + 2);
    message->type = head[4];
    message->size = (uint16_t)(a->message.size - HEAD);
    message->data = head + HEAD;
    cube->held = d;
    return true;
}

bool cube_read(struct cube *cube, struct cube_message *message) {
    for (unsigned i = 0; i < cube->count; i++) {
        unsigned d = cube->turn + i;
        if (cube_read_from(cube, d < cube->count ? d : d - cube->count,
                           message))
            return true;
    }
    return false;
}

void cube_put_back(struct cube *cube) {
    LINK_ASSERT(cube->held < cube->count);
    cube->held = CUBE_LINKS_MAX;
}

void cube_release(struct cube *cube) {
    unsigned d = cube->held;
    LINK_ASSERT(d < cube->count);
    struct cube_arrival *a = &cube->arrivals[d];
    cube->held = CUBE_LINKS_MAX;
    cube->statistics.read++;
    a->ways &= ~((uint32_t)1 << LOCAL);
    if (a->ways == 0)
        done_with(cube, d);
}

/* --- state ---------------------------------------------------------------- */

unsigned cube_links(const struct cube *cube) {
    return cube->count;
}

const struct link_statistics *cube_link_statistics(const struct cube *cube,
                                                   unsigned d) {
    LINK_ASSERT(d < cube->count);
    return link_statistics(cube->links[d]);
}

enum link_state cube_link_state(const struct cube *cube, unsigned d) {
    LINK_ASSERT(d < cube->count);
    return link_state(cube->links[d]);
}

const struct link_peer *cube_link_peer(const struct cube *cube, unsigned d) {
    LINK_ASSERT(d < cube->count);
    return link_peer(cube->links[d]);
}

const struct cube_statistics *cube_statistics(const struct cube *cube) {
    return &cube->statistics;
}

bool cube_idle(const struct cube *cube) {
    for (unsigned d = 0; d < cube->count; d++) {
        const struct cube_arrival *a = &cube->arrivals[d];
        bool under_way = a->there && (a->ways & ~((uint32_t)1 << LOCAL)) != 0;
        bool idle = link_idle(cube->links[d]) || cube_link_is_dead(cube, d);
        if (under_way || !idle)
            return false;
    }
    return true;
}

void cube_close(struct cube *cube, uint64_t deadline_us) {
    for (unsigned d = 0; d < cube->count; d++)
        link_close(cube->links[d], deadline_us);
}

uint64_t cube_next_due_us(const struct cube *cube, uint64_t now_us) {
    uint64_t due = cube->again ? 0 : UINT64_MAX;
    for (unsigned d = 0; d < cube->count; d++) {
        uint64_t link = link_next_due_us(cube->links[d], now_us);
        due = link < due ? link : due;
    }
    uint64_t gossip = cube_gossip_due_us(cube, now_us);
    return gossip < due ? gossip : due;
}
