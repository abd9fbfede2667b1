/* State datagrams between the nodes of a cube, from anywhere: what is taken for
 * a wiring can be merged, settled and routed, and merging it again changes
 * nothing. */
#include <stdlib.h>

#include "transport/gossip.h"
#include "transport/routes.h"

static struct routes_altered table[2048];

static void demand(bool condition) {
    if (!condition)
        abort();
}

static void route(struct cube_wiring *wiring, unsigned dimension) {
    struct routes routes;
    unsigned nodes = 1u << dimension, from = wiring->generation % nodes;
    demand(routes_bytes(dimension) <= sizeof table);
    routes_init(&routes, table, dimension);
    routes_find(&routes, wiring);
    for (unsigned to = 0; to < nodes; to++) {
        unsigned node = from, steps = 0;
        bool there = routes_reach(&routes, from) && routes_reach(&routes, to);
        while (node != to && there) {
            unsigned link = routes_way(&routes, node, to);
            demand(link < dimension && steps++ < 255);
            demand(!routes.tree || !wiring_is_dead(wiring, wiring->settled,
                                                   node, link, dimension));
            node ^= 1u << link;
        }
    }
}

struct bytes {
    const uint8_t *next;
    size_t size;
};

static int receive(void *context, uint8_t *bytes, size_t size) {
    struct bytes *from = context;
    size = size < from->size ? size : from->size;
    for (size_t i = 0; i < size; i++)
        bytes[i] = *from->next++;
    from->size -= size;
    return (int)size;
}

static void learn(const uint8_t *data, size_t size) {
    struct bytes from = {data, size};
    struct link_pipe pipe = {&from, NULL, receive};
    struct learner learner;
    struct learned learned;
    bool ports = size % 2 == 0, known = true;
    uint64_t now_us = 0;
    while (from.size > 0) {
        if (known && ports)
            learner_init_ports(&learner, &pipe, 0, true);
        else if (known)
            learner_init(&learner, &pipe, 1);
        learner_ask(&learner, now_us += LEARN_ASK_US / 3);
        known = learner_poll(&learner, &learned);
        if (known) {
            demand(learned.self < 1u << learned.dimension);
            demand(!ports || learned.dimension == 0);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    struct cube_wiring mine = {0}, theirs;
    uint8_t bytes[WIRING_BYTES_MAX];
    learn(data, size);
    if (size < 2)
        return 0;
    unsigned dimension = data[0] % (CUBE_DIMENSION_MAX + 1);
    data++;
    size--;
    while (size > 1) {
        size_t part = 1 + data[0] % WIRING_BYTES_MAX;
        part = part < size ? part : size - 1;
        data++;
        size--;
        if (wiring_unpack(&theirs, data, part, dimension)) {
            (void)wiring_merge(&mine, &theirs, dimension);
            demand(!wiring_merge(&mine, &theirs, dimension));
            size_t packed = wiring_pack(&mine, bytes);
            demand(packed <= sizeof bytes &&
                   wiring_unpack(&theirs, bytes, packed, dimension) &&
                   wiring_same(&mine, &theirs));
        }
        data += part;
        size -= part;
    }
    wiring_settle(&mine, dimension);
    route(&mine, dimension);
    return 0;
}
