#include "vertex.h"

#include <string.h>

#include "check.h"

/* The head: type (16 bits, low byte first), two bytes of zero. */
enum { HEAD = VERTEX_HEAD };

void vertex_init(struct vertex *v, const struct vertex_config *config)
{
    LINK_ASSERT(config->slot_count >= 1);
    memset(v, 0, sizeof *v);
    v->config = *config;
    v->generation = cube_wiring(config->cube)->generation;
}

void whoami(const struct vertex *v, int *node, int *process, int *host,
            int *dimension)
{
    *node = v->config.self;
    *process = 0;
    *host = CUBE_HOST;
    *dimension = v->config.dimension;
}

/* --- waiting ------------------------------------------------------------- */

static int failed(struct vertex *v, enum vertex_failure failure)
{
    v->failure = failure;
    return -1;
}

/* Whether all that waited here, and all that was agreed on, is of another
 * generation.  The first one is no loss. */
static bool renewed(struct vertex *v)
{
    uint32_t before = v->generation;
    v->generation = cube_wiring(v->config.cube)->generation;
    if (v->generation == before) {
        return false;
    }
    if (before == 0) {
        return false;
    }
    v->used = 0;
    return true;
}

/* Lets the cube work, or time pass.  0, or -1. */
static int wait(struct vertex *v, uint64_t start_us)
{
    const struct vertex_config *c = &v->config;
    uint64_t now_us = c->now_us(c->context);
    int moved = cube_poll(c->cube, now_us);
    if (renewed(v)) {
        return failed(v, VERTEX_RENEWED);
    }
    if (c->patience_us != 0 && now_us - start_us > c->patience_us) {
        return failed(v, VERTEX_LATE);
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

static bool fits(const struct found *found, int source, int type)
{
    bool any = type == VERTEX_ANY && found->type < VERTEX_INNER;
    return (source == VERTEX_ANY || found->source == source) &&
           (any || found->type == type);
}

static struct found in_slot(const struct vertex *v, unsigned i)
{
    const struct vertex_slot *slot = &v->config.slots[i];
    return (struct found){slot->source, slot->type, slot->data, slot->size};
}

/* The messages of a cube that were not written by such a module are not of
 * ours: false. */
static bool open_message(const struct cube_message *message,
                         struct found *found)
{
    if (message->size < HEAD) {
        return false;
    }
    found->source = message->source;
    found->type = message->data[0] | message->data[1] << 8;
    found->data = message->data + HEAD;
    found->size = message->size - (size_t)HEAD;
    return true;
}

static void keep(struct vertex *v, const struct found *found)
{
    struct vertex_slot *slot = &v->config.slots[v->used++];
    LINK_ASSERT(v->used <= v->config.slot_count);
    slot->source = (uint16_t)found->source;
    slot->type = (uint16_t)found->type;
    slot->size = (uint16_t)found->size;
    memcpy(slot->data, found->data, found->size);
    v->used_max = v->used > v->used_max ? v->used : v->used_max;
}

static void drop(struct vertex *v, unsigned i)
{
    struct vertex_slot *slots = v->config.slots;
    v->used--;
    memmove(&slots[i], &slots[i + 1], (v->used - i) * sizeof slots[0]);
}

/* What link d has brought, up to a message that fits, which is left in hand, or
 * one for which there is no slot; *blocked then. */
static bool look_at_link(struct vertex *v, unsigned d, int source, int type,
                         struct found *found, bool *blocked)
{
    struct cube *cube = v->config.cube;
    struct cube_message message;
    while (cube_read_from(cube, d, &message)) {
        if (!open_message(&message, found)) {
            cube_release(cube);
            continue;
        }
        if (fits(found, source, type)) {
            return true;
        }
        if (v->used == v->config.slot_count) {
            cube_put_back(cube);
            *blocked = true;
            return false;
        }
        keep(v, found);
        cube_release(cube);
    }
    return false;
}

/* Where a message that fits was found: a slot, or in hand from a link. */
enum { NOWHERE = -1, IN_HAND = -2, NOBODY = -2 };

static int look(struct vertex *v, int source, int type, struct found *found,
                bool *stuck)
{
    unsigned blocked_links = 0, links = cube_links(v->config.cube);
    *stuck = false;
    for (unsigned i = 0; i < v->used; i++) {
        *found = in_slot(v, i);
        if (fits(found, source, type)) {
            return (int)i;
        }
    }
    for (unsigned d = 0; d < links; d++) {
        bool blocked = false;
        if (look_at_link(v, d, source, type, found, &blocked)) {
            return IN_HAND;
        }
        blocked_links += blocked;
    }
    *stuck = blocked_links == links && links > 0;
    return NOWHERE;
}

/* Two that write to each other, and do not read, would wait for ever: what
 * comes meanwhile goes to the slots. */
static void take_in(struct vertex *v)
{
    struct found found;
    bool stuck;
    LINK_ASSERT(look(v, NOBODY, VERTEX_ANY, &found, &stuck) == NOWHERE);
}

/* --- sending and receiving ----------------------------------------------- */

static int send_to_self(struct vertex *v, const void *data, size_t size,
                        unsigned type)
{
    struct found found = {v->config.self, (int)type, data, size};
    if (v->used == v->config.slot_count) {
        return failed(v, VERTEX_FULL);
    }
    keep(v, &found);
    return 0;
}

int vertex_send(struct vertex *v, const void *data, size_t size, unsigned dest,
                unsigned type)
{
    const struct vertex_config *c = &v->config;
    uint64_t start_us = c->now_us(c->context);
    bool node = dest < 1u << c->dimension;
    v->failure = VERTEX_FINE;
    if (size > VERTEX_BYTES_MAX ||
        (!node && dest != CUBE_HOST && dest != CUBE_ALL) ||
        (dest == CUBE_HOST && c->self == CUBE_HOST)) {
        return failed(v, VERTEX_NOT_SOUND);
    }
    if (renewed(v)) {
        return failed(v, VERTEX_RENEWED);
    }
    if (node && dest == c->self) {
        return send_to_self(v, data, size, type);
    }
    v->out[0] = (uint8_t)type;
    v->out[1] = (uint8_t)(type >> 8);
    v->out[2] = v->out[3] = 0;
    if (size > 0) {
        memmove(v->out + HEAD, data, size);
    }
    for (;;) {
        if (node && !cube_reaches(c->cube, (uint16_t)dest)) {
            return failed(v, VERTEX_NO_WAY);
        }
        if (cube_write(c->cube, (uint16_t)dest, 0, v->out, HEAD + size) == 0) {
            return 0;
        }
        if (wait(v, start_us) != 0) {
            return -1;
        }
        take_in(v);
    }
}

int vertex_receive(struct vertex *v, int *source, int *type,
                   const struct vertex_sink *sink)
{
    const struct vertex_config *c = &v->config;
    uint64_t start_us = c->now_us(c->context);
    struct found found;
    bool stuck;
    v->failure = VERTEX_FINE;
    if (renewed(v)) {
        return failed(v, VERTEX_RENEWED);
    }
    int at = look(v, *source, *type, &found, &stuck);
    while (at == NOWHERE) {
        bool node = *source >= 0 && *source < 1 << c->dimension;
        if (node && !cube_reaches(c->cube, (uint16_t)*source)) {
            return failed(v, VERTEX_NO_WAY);
        }
        if (stuck) {
            return failed(v, VERTEX_FULL);
        }
        if (wait(v, start_us) != 0) {
            return -1;
        }
        at = look(v, *source, *type, &found, &stuck);
    }
    sink->take(sink->context, found.data, found.size);
    *source = found.source;
    *type = found.type;
    if (at == IN_HAND) {
        cube_release(c->cube);
    } else {
        drop(v, (unsigned)at);
    }
    return 0;
}

/* --- the vendor's calls -------------------------------------------------- */

int nwrite(struct vertex *v, const void *buffer, int size, int dest, int type,
           int *flag)
{
    if (size < 0 || dest < 0 || type < 0 || type > VERTEX_TYPE_MAX) {
        return failed(v, VERTEX_NOT_SOUND);
    }
    if (vertex_send(v, buffer, (size_t)size, (unsigned)dest, (unsigned)type) !=
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

static void copy(void *context, const uint8_t *data, size_t size)
{
    struct buffer *b = context;
    b->size = size < b->room ? size : b->room;
    if (b->size > 0) {
        memcpy(b->bytes, data, b->size);
    }
}

int nread(struct vertex *v, void *buffer, int size, int *source, int *type,
          int *flag)
{
    struct buffer b = {buffer, 0, size > 0 ? (size_t)size : 0};
    struct vertex_sink sink = {copy, &b};
    if (size < 0 || *source < VERTEX_ANY || *type < VERTEX_ANY ||
        *type > VERTEX_TYPE_MAX) {
        return failed(v, VERTEX_NOT_SOUND);
    }
    if (vertex_receive(v, source, type, &sink) != 0) {
        return -1;
    }
    if (flag != NULL) {
        *flag = 0;
    }
    return (int)b.size;
}

int ntest(struct vertex *v, int *source, int *type)
{
    const struct vertex_config *c = &v->config;
    struct found found;
    bool stuck;
    v->failure = VERTEX_FINE;
    (void)cube_poll(c->cube, c->now_us(c->context));
    if (renewed(v)) {
        return failed(v, VERTEX_RENEWED);
    }
    int at = look(v, *source, *type, &found, &stuck);
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
