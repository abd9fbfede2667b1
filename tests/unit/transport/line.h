/* Wires of transport/drivers/sim.h as tests of links like them: with their own
 * memory, one struct that says what they are like, and faults both ways.
 *
 * Memory: LINE_BYTES a direction.  Work: linear in the bytes.
 *
 *     line_wire(&wire, &now_us, &line, seed);
 *     config.pipe = line_pipe(&wire.ends[0]);
 */
#ifndef TESTS_UNIT_LINE_H
#define TESTS_UNIT_LINE_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "transport/drivers/sim.h"

#ifndef LINE_BYTES
#define LINE_BYTES (1u << 17)
#endif

struct line_quality {
    double bytes_per_s; /* 0: as many as there are */
    uint32_t latency_us;
    uint32_t room;    /* bytes that a driver takes ahead of the wire */
    double bit_error; /* a bit */
    double drop, insert, repeat; /* a byte; drop 1: nothing comes through */
    double stall;                /* a byte: then nothing for stall_us */
    uint32_t stall_us;
};

struct line_wire {
    struct sim_wire sim;
    struct sim_end *ends; /* of sim */
    uint8_t bytes[2 * LINE_BYTES];
};

static inline uint64_t line_draw(uint64_t *state)
{
    return sim_draw(state);
}

/* Another weather from now on; rate, latency and room stay. */
static inline void line_set(struct line_wire *wire,
                            const struct line_quality *quality)
{
    struct sim_faults faults = {.stall_us = quality->stall_us};
    faults.chance[SIM_FLIP] = quality->bit_error;
    faults.chance[SIM_DELETE] = quality->drop;
    faults.chance[SIM_INSERT] = quality->insert;
    faults.chance[SIM_REPEAT] = quality->repeat;
    faults.chance[SIM_STALL] = quality->stall;
    for (int i = 0; i < 2; i++) {
        sim_direction_faults(&wire->sim.direction[i], &faults);
        sim_direction_deaf(&wire->sim.direction[i], quality->drop >= 1);
    }
}

static inline void line_wire(struct line_wire *wire, const uint64_t *now_us,
                             const struct line_quality *quality, uint64_t seed)
{
    struct sim_quality q = {(uint32_t)quality->bytes_per_s, quality->latency_us,
                            quality->room, LINE_BYTES};
    sim_wire_init(&wire->sim, wire->bytes, &q, now_us, seed);
    wire->ends = wire->sim.end;
    line_set(wire, quality);
}

/* A wire that is cut loses what is on it. */
static inline void line_cut(struct line_wire *wire, bool broken)
{
    sim_wire_cut(&wire->sim, broken);
}

static inline struct link_pipe line_pipe(struct sim_end *end)
{
    return sim_pipe(end);
}

/* Bytes that nobody sent, on the way from end `side`. */
static inline void line_put(struct line_wire *wire, unsigned side,
                            const uint8_t *bytes, size_t size)
{
    struct link_pipe pipe = line_pipe(&wire->ends[side]);
    (void)pipe.send(pipe.context, bytes, size);
}

/* Times that chance struck, both ways. */
static inline uint64_t line_damaged(const struct line_wire *wire)
{
    uint64_t sum = 0;
    for (int k = 0; k < SIM_CHANCES; k++) {
        sum +=
            wire->sim.direction[0].struck[k] + wire->sim.direction[1].struck[k];
    }
    return sum;
}

#endif
