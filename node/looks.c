#include "looks.h"

#include <string.h>

#include "common.h"

enum {
    LOOK_US = 50000,
    SILENT_US =
        1200000, /* twice the time in which a link has to say something */
    SERIAL_BITS = 24000, /* more where frames wait for a slow wire */
    TEND_US = NODE_PACE_US / 4,
    CLOCK_US = NODE_PACE_US / 16, /* between two looks at the clock: some
                                     units are seven times as long as others */
    UNIT_NS = 250000,             /* of the slowest processor, and at first */
    UNITS_MIN = 4,                /* so that the clock costs little */
    FALL = 8                      /* the estimate falls by so small a part */
};

void node_looks_init(struct node_looks *looks, const struct node_board *board,
                     struct cube *cube) {
    memset(looks, 0, sizeof *looks);
    looks->board = board;
    looks->cube = cube;
    looks->unit_ns = UNIT_NS;
    looks->units = UNITS_MIN;
}

/* The frames are moved now. */
static void note_poll(struct node_looks *looks, uint64_t now_us) {
    uint64_t passed_us = looks->busy ? now_us - looks->polled_us : 0;
    if (passed_us > looks->poll_us_max) {
        looks->poll_us_max =
            passed_us < UINT32_MAX ? (uint32_t)passed_us : UINT32_MAX;
    }
    looks->busy = true;
    looks->polled_us = now_us;
    looks->working = false;
}

unsigned node_looks_poll(struct node_looks *looks, uint64_t now_us) {
    note_poll(looks, now_us);
    return (unsigned)cube_poll(looks->cube, now_us);
}

/* How long a unit takes: longer at once, and shorter by and by, as it is not
 * known that all that was to be done since the last look was done. */
static void measure(struct node_looks *looks, uint64_t passed_us) {
    uint64_t unit_ns = passed_us * 1000 / looks->units;
    looks->unit_ns = unit_ns >= looks->unit_ns
                         ? unit_ns
                         : looks->unit_ns - (looks->unit_ns - unit_ns) / FALL;
    uint64_t fit = CLOCK_US * UINT64_C(1000) / (looks->unit_ns + 1);
    looks->units = fit < UNITS_MIN                ? UNITS_MIN
                   : fit > INCODE_YIELD_UNITS_MAX ? INCODE_YIELD_UNITS_MAX
                                                  : (uint32_t)fit;
}

/* Returns the time afterwards. */
static uint64_t tend(struct node_looks *looks, uint64_t now_us) {
    if (now_us - looks->polled_us < TEND_US)
        return now_us;
    note_poll(looks, now_us);
    (void)cube_tend(looks->cube, now_us);
    return looks->board->now_us(looks->board->context);
}

void node_looks_between(struct node_looks *looks) {
    if (looks->tends)
        (void)tend(looks, looks->board->now_us(looks->board->context));
}

static uint32_t at_yield(void *context) {
    struct node_looks *looks = context;
    if (!looks->tends)
        return INCODE_YIELD_UNITS_MAX;
    uint64_t now_us = looks->board->now_us(looks->board->context);
    if (looks->working)
        measure(looks, now_us - looks->paused_us);
    now_us = tend(looks, now_us);
    looks->working = true;
    looks->paused_us = now_us;
    return looks->units;
}

struct incode_yield node_looks_yield(struct node_looks *looks) {
    return (struct incode_yield){.poll = at_yield, .context = looks};
}

void node_looks_idle(struct node_looks *looks) {
    looks->busy = looks->working = false;
}

/* Whether a link that was up has said nothing for long, by this node's own
 * time: while it stood still itself it could not hear. */
static bool is_silent(struct node_looks *looks, unsigned d,
                      uint32_t passed_us) {
    const struct link_statistics *s = cube_link_statistics(looks->cube, d);
    uint32_t baud = looks->board->identity.serial_baud;
    uint32_t limit_us =
        SILENT_US +
        (baud == 0 ? 0 : SERIAL_BITS * UINT32_C(10000) / baud * 100);
    if (s->frames_received != looks->heard[d].frames || s->sessions == 0) {
        looks->heard[d].frames = s->frames_received;
        looks->heard[d].quiet_us = 0;
    } else if (looks->heard[d].quiet_us <= limit_us) {
        looks->heard[d].quiet_us += passed_us;
    }
    return looks->heard[d].quiet_us > limit_us;
}

bool node_looks_silent(struct node_looks *looks, uint64_t now_us) {
    uint64_t passed_us = now_us - looks->looked_us;
    uint32_t silent = 0;
    if (passed_us < LOOK_US)
        return false;
    looks->looked_us = now_us;
    uint32_t step_us =
        passed_us < 2 * LOOK_US ? (uint32_t)passed_us : 2 * LOOK_US;
    for (unsigned d = 0; d < cube_links(looks->cube); d++)
        silent |= (uint32_t)is_silent(looks, d, step_us) << d;
    bool news = silent != looks->silent;
    looks->silent = silent;
    return news;
}

uint32_t node_looks_silent_yet(const struct node_looks *looks) {
    uint32_t silent = looks->silent;
    for (unsigned d = 0; d < cube_links(looks->cube); d++) {
        const struct link_statistics *s = cube_link_statistics(looks->cube, d);
        if (s->frames_received != looks->heard[d].frames)
            silent &= ~((uint32_t)1 << d);
    }
    return silent;
}

/* A wire whose ends never met is missing, or not there yet: the host says. */
uint32_t node_looks_seen(const struct node_looks *looks) {
    uint32_t seen = 0;
    for (unsigned d = 0; d < cube_links(looks->cube); d++) {
        bool up = cube_link_statistics(looks->cube, d)->sessions > 0;
        seen |= (uint32_t)up << d;
    }
    return seen;
}

bool node_looks_parted(const struct node_looks *looks, unsigned d) {
    enum link_state state = cube_link_state(looks->cube, d);
    return state == LINK_CLOSED || state == LINK_DOWN ||
           cube_link_statistics(looks->cube, d)->pipe_closed > 0;
}

void node_looks_totals(const struct node_looks *looks,
                       struct node_finished_message *finished) {
    const struct node_board *board = looks->board;
    struct node_gauges gauges = {0};
    for (unsigned d = 0; d < cube_links(looks->cube); d++) {
        const struct link_statistics *s = cube_link_statistics(looks->cube, d);
        finished->retransmitted += s->retransmitted;
    }
    if (board->gauges != NULL)
        board->gauges(board->context, &gauges);
    finished->stack_bytes = gauges.stack_bytes;
    finished->stack_high_water = gauges.stack_high_water;
    finished->overruns = gauges.overruns;
    finished->look_us_max = looks->poll_us_max;
    finished->busy_us = board->busy_us(board->context);
    finished->links = node_looks_seen(looks);
}
