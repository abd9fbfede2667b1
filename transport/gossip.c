/* How what is known of the wiring spreads: each end of a link tells the other
 * in a note, when the link comes up and when something new was learnt, again
 * and again until the other has said the same. */
#include "check.h"
#include "cube_internal.h"

static bool is_host(const struct cube *cube)
{
    return cube->config.self == CUBE_HOST;
}

static void tell(struct cube *cube, unsigned d, uint64_t now_us, bool ask)
{
    link_note(cube->links[d], cube->note, cube->note_size, ask);
    cube->neighbours[d].told_us = now_us;
}

/* After a change: nobody has heard of it yet. */
static void spread(struct cube *cube)
{
    cube->note_size = wiring_pack(&cube->wiring, cube->note);
    for (unsigned d = 0; d < cube->count; d++) {
        cube->neighbours[d].agreed = false;
        cube->neighbours[d].told_us -= CUBE_GOSSIP_US;
    }
}

static void begin_generation(struct cube *cube)
{
    cube->stamp = (uint16_t)cube->wiring.generation;
    cube_drop_all(cube);
}

void cube_gossip_start(struct cube *cube)
{
    if (is_host(cube)) {
        cube->wiring.generation = 1;
        cube->wiring.host_epoch = cube->config.epoch;
        cube->wiring.gate = cube->config.gate;
    }
    cube->stamp = (uint16_t)cube->wiring.generation;
    spread(cube);
}

void cube_renew(struct cube *cube, const struct cube_wiring *next)
{
    uint32_t present = cube->wiring.generation;
    LINK_ASSERT(is_host(cube) && next->dead_count <= CUBE_DEAD_MAX &&
                next->gate < 1u << cube->config.dimension);
    cube->wiring = *next;
    if (next->generation <= present) {
        cube->wiring.generation = present + 1;
    }
    cube->wiring.host_epoch = cube->config.epoch;
    cube->wiring.wrong_count = 0;
    wiring_settle(&cube->wiring, cube->config.dimension);
    begin_generation(cube);
    spread(cube);
}

/* The nodes still have the wiring of another host, or of an earlier start of
 * this one: ours must be the newer. */
static void outdo(struct cube *cube, const struct cube_wiring *theirs)
{
    struct cube_wiring next = cube->wiring;
    next.generation = theirs->generation + 1;
    next.dead_count = next.settled;
    cube_renew(cube, &next);
}

static void hear(struct cube *cube, const struct cube_wiring *theirs)
{
    uint32_t generation = cube->wiring.generation;
    uint32_t host_epoch = cube->wiring.host_epoch;
    bool foreign = theirs->host_epoch != cube->config.epoch;
    if (is_host(cube) && foreign) {
        if (theirs->generation >= generation) {
            outdo(cube, theirs);
        }
        return;
    }
    if (wiring_merge(&cube->wiring, theirs, cube->config.dimension)) {
        if (cube->wiring.generation != generation ||
            cube->wiring.host_epoch != host_epoch) {
            begin_generation(cube);
        }
        spread(cube);
    }
}

static void take_note(struct cube *cube, unsigned d,
                      const struct link_message *note, bool ask,
                      uint64_t now_us)
{
    struct cube_wiring theirs;
    if (!wiring_unpack(&theirs, note->data, note->size,
                       cube->config.dimension)) {
        cube->statistics.misrouted++;
        return;
    }
    hear(cube, &theirs);
    cube->neighbours[d].agreed = wiring_same(&theirs, &cube->wiring);
    if (ask && cube->neighbours[d].agreed) {
        tell(cube, d, now_us, false);
    } else if (!cube->neighbours[d].agreed) {
        tell(cube, d, now_us, true);
    }
}

void cube_gossip(struct cube *cube, uint64_t now_us)
{
    struct link_message note;
    bool ask;
    for (unsigned d = 0; d < cube->count; d++) {
        const struct link_statistics *s = link_statistics(cube->links[d]);
        struct cube_neighbour *n = &cube->neighbours[d];
        if (n->comings != s->sessions + s->resumed) {
            n->comings = s->sessions + s->resumed;
            n->agreed = false;
            n->told_us = now_us - CUBE_GOSSIP_US;
        }
        if (link_take_note(cube->links[d], &note, &ask)) {
            take_note(cube, d, &note, ask, now_us);
        }
    }
    for (unsigned d = 0; d < cube->count; d++) {
        struct cube_neighbour *n = &cube->neighbours[d];
        if (!n->agreed && n->comings > 0 &&
            now_us - n->told_us >= CUBE_GOSSIP_US) {
            tell(cube, d, now_us, true);
        }
    }
}

uint64_t cube_gossip_due_us(const struct cube *cube, uint64_t now_us)
{
    uint64_t due = UINT64_MAX;
    for (unsigned d = 0; d < cube->count; d++) {
        const struct cube_neighbour *n = &cube->neighbours[d];
        uint64_t passed = now_us - n->told_us;
        uint64_t left = passed < CUBE_GOSSIP_US ? CUBE_GOSSIP_US - passed : 0;
        if (!n->agreed && n->comings > 0 && left < due) {
            due = left;
        }
    }
    return due;
}

const struct cube_wiring *cube_wiring(const struct cube *cube)
{
    return &cube->wiring;
}
