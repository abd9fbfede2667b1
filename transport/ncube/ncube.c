#include "ncube.h"

#include <string.h>

#include "transport/bytes.h"
#include "transport/check.h"

/* The head: type (16 bits, low byte first), two bytes of zero. */
enum { HEAD = NCUBE_HEAD };

void ncube_init(struct ncube *n, const struct ncube_config *config) {
    LINK_ASSERT(config->slot_count >= 1);
    memset(n, 0, sizeof *n);
    n->config = *config;
    n->generation = cube_wiring(config->cube)->generation;
}

void whoami(const struct ncube *n, int *node, int *process, int *host,
            int *dimension) {
    *node = n->config.self;
    *process = 0;
    *host = CUBE_HOST;
    *dimension = n->config.dimension;
}

/* --- waiting ------------------------------------------------------------- */

static int failed(struct ncube *n, enum ncube_failure failure) {
    n->failure = failure;
    return -1;
}

/* Whether all that waited here, and all that was agreed on, is of another
 * generation.  The first one is no loss. */
static bool renewed(struct ncube *n) {
    uint32_t before = n->generation;
    n->generation = cube_wiring(n->config.cube)->generation;
    if (n->generation == before) {
        return false;
    }
    if (before == 0) {
        return false;
    }
    n->used = 0;
    return true;
}

/* Lets the cube work, or time pass.  0, or -1. */
static int wait(struct ncube *n, uint64_t start_us) {
    const struct ncube_config *c = &n->config;
    uint64_t now_us = c->now_us(c->context);
    int moved = cube_poll(c->cube, now_us);
    if (renewed(n)) {
        return failed(n, NCUBE_RENEWED);
    }
    if (c->patience_us != 0 && now_us - start_us > c->patience_us) {
        return failed(n, NCUBE_LATE);
    }
    if (moved == 0) {
        uint64_t due_us = cube_next_due_us(c->cube, now_us);
        if (c->patience_us != 0 && due_us > c->patience_us) {
            due_us = c->patience_us;
        }
        c->idle(c->context, due_us);
    }
    return 0;
}

/* --- messages that wait -------------------------------------------------- */

/* A message, wherever it lies. */
struct found {
    int source, type;
    const uint8_t *data;
    size_t size;
};

static bool fits(const struct found *found, int source, int type) {
    bool any = type == NCUBE_ANY && found->type < NCUBE_INNER;
    return (source == NCUBE_ANY || found->source == source) &&
           (any || found->type == type);
}

static struct found in_slot(const struct ncube *n, unsigned i) {
    const struct ncube_slot *slot = &n->config.slots[i];
    return (struct found){slot->source, slot->type, slot->data, slot->size};
}

/* False: it was not written by this library. */
static bool open_message(const struct cube_message *message,
                         struct found *found) {
    if (message->size < HEAD) {
        return false;
    }
    found->source = message->source;
    found->type = bytes_get16(message->data);
    found->data = message->data + HEAD;
    found->size = message->size - (size_t)HEAD;
    return true;
}

static void keep(struct ncube *n, const struct found *found) {
    struct ncube_slot *slot = &n->config.slots[n->used++];
    LINK_ASSERT(n->used <= n->config.slot_count);
    slot->source = (uint16_t)found->source;
    slot->type = (uint16_t)found->type;
    slot->size = (uint16_t)found->size;
    memcpy(slot->data, found->data, found->size);
    n->used_max = n->used > n->used_max ? n->used : n->used_max;
}

static void drop(struct ncube *n, unsigned i) {
    struct ncube_slot *slots = n->config.slots;
    n->used--;
    memmove(&slots[i], &slots[i + 1], (n->used - i) * sizeof slots[0]);
}

/* What link d has brought, up to a message that fits, which is left in hand, or
 * one for which there is no slot; *blocked then. */
static bool look_at_link(struct ncube *n, unsigned d, int source, int type,
                         struct found *found, bool *blocked) {
    struct cube *cube = n->config.cube;
    struct cube_message message;
    while (cube_read_from(cube, d, &message)) {
        if (!open_message(&message, found)) {
            cube_release(cube);
            continue;
        }
        if (fits(found, source, type)) {
            return true;
        }
        if (n->used == n->config.slot_count) {
            cube_put_back(cube);
            *blocked = true;
            return false;
        }
        keep(n, found);
        cube_release(cube);
    }
    return false;
}

/* Where a message that fits was found: a slot, or in hand from a link. */
enum { NOWHERE = -1, IN_HAND = -2, NOBODY = -2 };

static int look(struct ncube *n, int source, int type, struct found *found,
                bool *stuck) {
    unsigned blocked_links = 0, links = cube_links(n->config.cube);
    *stuck = false;
    for (unsigned i = 0; i < n->used; i++) {
        *found = in_slot(n, i);
        if (fits(found, source, type)) {
            return (int)i;
        }
    }
    for (unsigned d = 0; d < links; d++) {
        bool blocked = false;
        if (look_at_link(n, d, source, type, found, &blocked)) {
            return IN_HAND;
        }
        blocked_links += blocked;
    }
    *stuck = blocked_links == links && links > 0;
    return NOWHERE;
}

/* Two that write to each other, and do not read, would wait for ever: what
 * comes meanwhile goes to the slots. */
static void take_in(struct ncube *n) {
    struct found found;
    bool stuck;
    LINK_ASSERT(look(n, NOBODY, NCUBE_ANY, &found, &stuck) == NOWHERE);
}

/* --- sending and receiving ----------------------------------------------- */

static int send_to_self(struct ncube *n, const void *data, size_t size,
                        unsigned type) {
    struct found found = {n->config.self, (int)type, data, size};
    if (n->used == n->config.slot_count) {
        return failed(n, NCUBE_FULL);
    }
    keep(n, &found);
    return 0;
}

int ncube_send(struct ncube *n, const void *data, size_t size, unsigned dest,
               unsigned type) {
    const struct ncube_config *c = &n->config;
    uint64_t start_us = c->now_us(c->context);
    bool node = dest < 1u << c->dimension;
    n->failure = NCUBE_FINE;
    if (size > NCUBE_BYTES_MAX ||
        (!node && dest != CUBE_HOST && dest != CUBE_ALL) ||
        (dest == CUBE_HOST && c->self == CUBE_HOST)) {
        return failed(n, NCUBE_NOT_SOUND);
    }
    if (renewed(n)) {
        return failed(n, NCUBE_RENEWED);
    }
    if (node && dest == c->self) {
        return send_to_self(n, data, size, type);
    }
    bytes_put16(n->out, type);
    n->out[2] = n->out[3] = 0;
    if (size > 0) {
        memmove(n->out + HEAD, data, size);
    }
    for (;;) {
        if (node && !cube_reaches(c->cube, (uint16_t)dest)) {
            return failed(n, NCUBE_NO_WAY);
        }
        if (cube_write(c->cube, (uint16_t)dest, 0, n->out, HEAD + size) == 0) {
            return 0;
        }
        if (wait(n, start_us) != 0) {
            return -1;
        }
        take_in(n);
    }
}

int ncube_receive(struct ncube *n, int *source, int *type,
                  const struct ncube_sink *sink) {
    const struct ncube_config *c = &n->config;
    uint64_t start_us = c->now_us(c->context);
    struct found found;
    bool stuck;
    n->failure = NCUBE_FINE;
    if (renewed(n)) {
        return failed(n, NCUBE_RENEWED);
    }
    int at = look(n, *source, *type, &found, &stuck);
    while (at == NOWHERE) {
        bool node = *source >= 0 && *source < 1 << c->dimension;
        if (node && !cube_reaches(c->cube, (uint16_t)*source)) {
            return failed(n, NCUBE_NO_WAY);
        }
        if (stuck) {
            return failed(n, NCUBE_FULL);
        }
        if (wait(n, start_us) != 0) {
            return -1;
        }
        at = look(n, *source, *type, &found, &stuck);
    }
    sink->take(sink->context, found.data, found.size);
    *source = found.source;
    *type = found.type;
    if (at == IN_HAND) {
        cube_release(c->cube);
    } else {
        drop(n, (unsigned)at);
    }
    return 0;
}

/* --- the vendor's calls -------------------------------------------------- */

int nwrite(struct ncube *n, const void *buffer, int size, int dest, int type,
           int *flag) {
    if (size < 0 || dest < 0 || type < 0 || type > NCUBE_TYPE_MAX) {
        return failed(n, NCUBE_NOT_SOUND);
    }
    if (ncube_send(n, buffer, (size_t)size, (unsigned)dest, (unsigned)type) !=
        0) {
        return -1;
    }
    if (flag != NULL) {
        *flag = 0;
    }
    return size;
}

struct buffer {
    uint8_t *bytes;
    size_t size, room;
};

static void copy(void *context, const uint8_t *data, size_t size) {
    struct buffer *b = context;
    b->size = size < b->room ? size : b->room;
    if (b->size > 0) {
        memcpy(b->bytes, data, b->size);
    }
}

int nread(struct ncube *n, void *buffer, int size, int *source, int *type,
          int *flag) {
    struct buffer b = {buffer, 0, size > 0 ? (size_t)size : 0};
    struct ncube_sink sink = {copy, &b};
    if (size < 0 || *source < NCUBE_ANY || *type < NCUBE_ANY ||
        *type > NCUBE_TYPE_MAX) {
        return failed(n, NCUBE_NOT_SOUND);
    }
    if (ncube_receive(n, source, type, &sink) != 0) {
        return -1;
    }
    if (flag != NULL) {
        *flag = 0;
    }
    return (int)b.size;
}

int ntest(struct ncube *n, int *source, int *type) {
    const struct ncube_config *c = &n->config;
    struct found found;
    bool stuck;
    n->failure = NCUBE_FINE;
    (void)cube_poll(c->cube, c->now_us(c->context));
    if (renewed(n)) {
        return failed(n, NCUBE_RENEWED);
    }
    int at = look(n, *source, *type, &found, &stuck);
    if (at == NOWHERE) {
        return -1;
    }
    *source = found.source;
    *type = found.type;
    if (at == IN_HAND) {
        cube_put_back(c->cube);
    }
    return (int)found.size;
}
