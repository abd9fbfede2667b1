#include "lending.h"

#include <string.h>

#include "incode/pages/bricks.h"
#include "incode/predicates/check.h"
#include "node/common.h"

enum { OTHERS_MAX = 3 /* owners of the other vertices of a tetrahedron */ };

static size_t table_bytes(uint32_t nodes) {
    return node_aligned(((size_t)nodes + 1) * sizeof(uint32_t));
}

size_t node_shares_bytes(uint32_t nodes) {
    return table_bytes(nodes) +
           node_aligned(NODE_SHARE_BATCHES * sizeof(struct node_share_batch));
}

void node_shares_init(struct node_shares *shares, void *memory,
                      const struct node_setup_message *setup,
                      struct node_counted *counted) {
    memset(shares, 0, sizeof *shares);
    shares->counted = counted;
    shares->nodes = setup->nodes;
    shares->first = memory;
    shares->batch =
        (struct node_share_batch *)(void *)((uint8_t *)memory +
                                            table_bytes(setup->nodes));
    for (uint32_t i = 0; i < NODE_SHARE_BATCHES; i++)
        shares->batch[i].count = 0;
}

/* ---- regions ---- */

bool node_shares_regions(struct node_shares *shares, const uint8_t *data,
                         size_t size) {
    struct node_regions_message regions;
    if (size < sizeof regions)
        return false;
    memcpy(&regions, data, sizeof regions);
    size -= sizeof regions;
    if (regions.first != shares->known ||
        regions.count > shares->nodes + 1 - shares->known ||
        size != regions.count * sizeof *shares->first)
        return false;
    memcpy(shares->first + shares->known, data + sizeof regions, size);
    for (uint32_t i = 0; i < regions.count; i++, shares->known++) {
        uint32_t before =
            shares->known == 0 ? 0 : shares->first[shares->known - 1];
        if (shares->first[shares->known] < before)
            return false;
    }
    return true;
}

bool node_shares_ready(const struct node_shares *shares) {
    return shares->known == shares->nodes + 1;
}

/* The last region that begins at the brick or before, as those that are empty
 * begin where the next one does. */
uint16_t node_shares_owner(const struct node_shares *shares, uint32_t brick) {
    uint32_t low = 0, high = shares->nodes;
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (shares->first[middle] <= brick)
            low = middle;
        else
            high = middle;
    }
    return (uint16_t)low;
}

/* ---- batches ---- */

/* n tetrahedra of up to three others each begin 3 n batches at most; and, as
 * a batch is begun when the one before it to the same node is full, no more
 * than 3 n / 32, rounded up for each node. */
static size_t shares_room(void *context) {
    enum { EACH = NODE_SHARES_A_BATCH };
    const struct node_shares *s = context;
    size_t free = NODE_SHARE_BATCHES - s->used, others = s->nodes - 1;
    size_t told = others < OTHERS_MAX ? others : (size_t)OTHERS_MAX;
    if (told == 0)
        return (size_t)NODE_SHARE_BATCHES * EACH;
    size_t room = free / told;
    if (free > others) {
        size_t whole = (free * EACH - others * (EACH - 1)) / told;
        room = whole > room ? whole : room;
    }
    return room;
}

static void tell(struct node_shares *s, uint16_t to, const uint32_t v[4]) {
    struct node_share_batch *batch = NULL;
    for (uint32_t i = 0; i < NODE_SHARE_BATCHES; i++) {
        struct node_share_batch *b = &s->batch[i];
        if (b->count > 0 && b->count < NODE_SHARES_A_BATCH && b->to == to) {
            batch = b;
            break;
        }
        if (b->count == 0 && batch == NULL)
            batch = b;
    }
    INCODE_ASSERT(batch != NULL); /* it was asked for room */
    if (batch->count == 0) {
        batch->to = to;
        s->used++;
    }
    memcpy(batch->share[batch->count++].v, v, sizeof batch->share[0].v);
    s->sent++;
}

static void shares_share(void *context, const uint32_t v[4]) {
    struct node_shares *s = context;
    uint16_t to[4];
    unsigned told = 0;
    for (unsigned i = 0; i < 4 && v[i] != INCODE_NONE; i++) {
        uint16_t owner = node_shares_owner(s, v[i] / INCODE_BRICK_POINTS);
        bool again = owner == s->counted->self;
        for (unsigned k = 0; k < told; k++)
            again = again || to[k] == owner;
        if (!again) {
            to[told++] = owner;
            tell(s, owner, v);
        }
    }
}

struct incode_front_peers node_shares_peers(struct node_shares *shares) {
    return (struct incode_front_peers){shares, shares_room, shares_share};
}

unsigned node_shares_send(struct node_shares *shares) {
    unsigned sent = 0;
    for (uint32_t i = 0; i < NODE_SHARE_BATCHES && shares->used > 0; i++) {
        struct node_share_batch *b =
            &shares->batch[(shares->turn + i) % NODE_SHARE_BATCHES];
        size_t size = b->count * sizeof b->share[0];
        if (b->count == 0 ||
            node_counted_write(shares->counted, b->to, NODE_SHARE, b->share,
                               size) != 0)
            continue;
        shares->bytes_out += size;
        b->count = 0;
        shares->used--;
        sent++;
    }
    shares->turn = (shares->turn + 1) % NODE_SHARE_BATCHES;
    return sent;
}
