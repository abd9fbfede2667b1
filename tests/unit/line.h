/* Wires in virtual time for tests: a rate, a latency, the room of a driver's
 * buffer, and all that goes wrong with bytes, drawn from a seed.
 *
 * Memory: 17 times LINE_BYTES a direction.  Work: linear in the bytes.
 *
 *     line_wire(&wire, &now_us, &line, seed);
 *     config.pipe = line_pipe(&wire.ends[0]);
 */
#ifndef TESTS_UNIT_LINE_H
#define TESTS_UNIT_LINE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "../../transport/link.h"

#ifndef LINE_BYTES
#define LINE_BYTES (1u << 17)
#endif

struct line_quality {
    double bytes_per_s; /* 0: as many as there are */
    uint32_t latency_us;
    uint32_t room;    /* bytes that a driver takes ahead of the wire */
    double bit_error; /* a bit */
    double drop, insert, repeat; /* a byte */
    double stall;                /* a byte: then nothing for stall_us */
    uint32_t stall_us;
};

struct line {
    struct line_quality quality;
    const uint64_t *now_us;
    uint8_t bytes[LINE_BYTES];
    uint64_t arrival_us[LINE_BYTES];
    uint64_t begin, end, departed; /* bytes ever, modulo LINE_BYTES a place */
    uint64_t departure_us[LINE_BYTES];
    double free_us;
    uint64_t random;
    double next_flip, next_drop, next_insert, next_repeat, next_stall;
    bool broken;
    uint64_t damaged;
};

struct line_end {
    struct line *out, *in;
};

struct line_wire {
    struct line lines[2];
    struct line_end ends[2];
};

static inline uint64_t line_draw(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

/* How many go well before the next that does not. */
static inline double line_gap(uint64_t *state, double chance)
{
    double u = (double)(line_draw(state) >> 11) * 0x1p-53;
    return chance > 0 ? floor(log1p(-u) / log1p(-chance)) : 1e300;
}

static inline bool line_strikes(struct line *line, double *gap, double chance,
                                double steps)
{
    if (*gap >= steps) {
        *gap -= steps;
        return false;
    }
    *gap = line_gap(&line->random, chance);
    line->damaged++;
    return true;
}

static inline void line_put(struct line *line, uint8_t byte)
{
    const struct line_quality *q = &line->quality;
    double now = (double)*line->now_us;
    double step = q->bytes_per_s > 0 ? 1e6 / q->bytes_per_s : 0;
    if (line->end - line->begin == LINE_BYTES) {
        line->damaged++; /* overrun at the far end */
        return;
    }
    line->free_us = (line->free_us > now ? line->free_us : now) + step;
    uint64_t at = line->end++ % LINE_BYTES;
    line->bytes[at] = byte;
    line->departure_us[at] = (uint64_t)ceil(line->free_us);
    line->arrival_us[at] = line->departure_us[at] + q->latency_us;
}

static inline void line_spoil(struct line *line, uint8_t byte)
{
    const struct line_quality *q = &line->quality;
    if (q->bit_error > 0) {
        while (line_strikes(line, &line->next_flip, q->bit_error, 8)) {
            byte ^= (uint8_t)(1 << (line_draw(&line->random) >> 32) % 8);
        }
    }
    if (line_strikes(line, &line->next_stall, q->stall, 1)) {
        double now = (double)*line->now_us;
        line->free_us =
            (line->free_us > now ? line->free_us : now) + (double)q->stall_us;
    }
    if (line_strikes(line, &line->next_drop, q->drop, 1)) {
        return;
    }
    line_put(line, byte);
    if (line_strikes(line, &line->next_repeat, q->repeat, 1)) {
        line_put(line, byte);
    }
    if (line_strikes(line, &line->next_insert, q->insert, 1)) {
        line_put(line, (uint8_t)(line_draw(&line->random) >> 32));
    }
}

/* Bytes that the driver still holds. */
static inline uint64_t line_held(struct line *line)
{
    if (line->departed < line->begin) {
        line->departed = line->begin;
    }
    while (line->departed < line->end &&
           line->departure_us[line->departed % LINE_BYTES] <= *line->now_us) {
        line->departed++;
    }
    return line->end - line->departed;
}

static inline int line_send(void *context, const uint8_t *bytes, size_t size)
{
    struct line *line = ((struct line_end *)context)->out;
    if (line->broken) {
        return LINK_PIPE_CLOSED;
    }
    uint64_t held = line_held(line), room = line->quality.room;
    size_t most = held < room ? (size_t)(room - held) : 0;
    size_t place = LINE_BYTES - (size_t)(line->end - line->begin);
    most = most < place ? most : place;
    most = size < most ? size : most;
    for (size_t i = 0; i < most; i++) {
        line_spoil(line, bytes[i]);
    }
    return (int)most;
}

static inline int line_receive(void *context, uint8_t *bytes, size_t size)
{
    struct line *line = ((struct line_end *)context)->in;
    size_t got = 0;
    if (line->broken) {
        return LINK_PIPE_CLOSED;
    }
    while (got < size && line->begin < line->end &&
           line->arrival_us[line->begin % LINE_BYTES] <= *line->now_us) {
        bytes[got++] = line->bytes[line->begin++ % LINE_BYTES];
    }
    return (int)got;
}

static inline void line_set(struct line_wire *wire,
                            const struct line_quality *quality)
{
    for (int i = 0; i < 2; i++) {
        struct line *line = &wire->lines[i];
        line->quality = *quality;
        line->next_flip = line_gap(&line->random, quality->bit_error);
        line->next_drop = line_gap(&line->random, quality->drop);
        line->next_insert = line_gap(&line->random, quality->insert);
        line->next_repeat = line_gap(&line->random, quality->repeat);
        line->next_stall = line_gap(&line->random, quality->stall);
    }
}

static inline void line_wire(struct line_wire *wire, const uint64_t *now_us,
                             const struct line_quality *quality, uint64_t seed)
{
    for (int i = 0; i < 2; i++) {
        struct line *line = &wire->lines[i];
        line->now_us = now_us;
        line->begin = line->end = line->departed = 0;
        line->free_us = 0;
        line->broken = false;
        line->damaged = 0;
        line->random = (seed + 1) * UINT64_C(0x9e3779b97f4a7c15) + (unsigned)i;
        line_draw(&line->random);
        wire->ends[i] = (struct line_end){&wire->lines[i], &wire->lines[1 - i]};
    }
    line_set(wire, quality);
}

/* A wire that is cut loses what is on it. */
static inline void line_cut(struct line_wire *wire, bool broken)
{
    for (int i = 0; i < 2; i++) {
        wire->lines[i].broken = broken;
        wire->lines[i].begin = wire->lines[i].end;
    }
}

static inline struct link_pipe line_pipe(struct line_end *end)
{
    return (struct link_pipe){end, line_send, line_receive};
}

#endif
