#include "sim.h"

#include <string.h>

enum { SPOILED_BYTE = 6, LATE_STALLS = 3 };

/* --- chance --------------------------------------------------------------- */

uint64_t sim_draw(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

/* Steele, Lea and Flood's mixing (2014). */
uint64_t sim_seed(uint64_t seed, uint64_t purpose) {
    uint64_t x = seed * UINT64_C(0x9e3779b97f4a7c15) + purpose * 0x632be5abu;
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    x ^= x >> 31;
    return x == 0 ? 1 : x;
}

/* Exponentially distributed with mean 1, by comparisons alone (von Neumann,
 * 1951), so that it is the same on every machine. */
static double exponential(uint64_t *state) {
    for (double whole = 0;; whole++) {
        uint64_t first = sim_draw(state), last = first;
        unsigned falling = 1;
        for (;;) {
            uint64_t next = sim_draw(state);
            if (next >= last)
                break;
            last = next;
            falling++;
        }
        if (falling % 2 == 1)
            return whole + (double)(first >> 11) * 0x1p-53;
    }
}

/* How many go well before the next that does not. */
static uint64_t draw_gap(uint64_t *state, double chance) {
    if (chance <= 0)
        return UINT64_MAX;
    double gap = exponential(state) * (1 / chance - 0.5);
    return gap < 1e18 ? (uint64_t)gap : UINT64_MAX;
}

/* Whether one of the next `steps` is struck; the gap is counted down. */
static bool strikes(struct sim_direction *direction, enum sim_fault kind,
                    uint64_t steps) {
    uint64_t *gap = &direction->gap[kind];
    if (*gap == UINT64_MAX)
        return false;
    if (*gap >= steps) {
        *gap -= steps;
        return false;
    }
    *gap = draw_gap(&direction->random, direction->faults.chance[kind]);
    direction->struck[kind]++;
    return true;
}

/* --- the direction
 * ------------------------------------------------------------ */

static uint64_t now_ns(const struct sim_direction *direction) {
    return *direction->now_us * 1000;
}

static uint64_t latency_ns(const struct sim_direction *direction) {
    return (uint64_t)direction->quality.latency_us * 1000;
}

static struct sim_segment *segment_at(const struct sim_direction *direction,
                                      uint32_t i) {
    return (struct sim_segment *)&direction
        ->segment[(direction->segment_first + i) % SIM_SEGMENTS];
}

/* Past the last byte of segment i. */
static uint64_t segment_end(const struct sim_direction *direction, uint32_t i) {
    return i + 1 < direction->segments ? segment_at(direction, i + 1)->first
                                       : direction->end;
}

/* Bytes [first, result) of segment i have left the driver at time_ns. */
static uint64_t passed_of(const struct sim_direction *direction, uint32_t i,
                          uint64_t time_ns) {
    const struct sim_segment *s = segment_at(direction, i);
    uint64_t end = segment_end(direction, i);
    if (time_ns < s->from_ns)
        return s->first;
    if (direction->step_ns == 0)
        return end;
    uint64_t count = (time_ns - s->from_ns) / direction->step_ns;
    return count < end - s->first ? s->first + count : end;
}

/* Position up to which bytes have left the driver at time_ns. */
static uint64_t passed(const struct sim_direction *direction,
                       uint64_t time_ns) {
    for (uint32_t i = direction->segments; i-- > 0;) {
        if (segment_at(direction, i)->from_ns <= time_ns) {
            uint64_t at = passed_of(direction, i, time_ns);
            return at > direction->begin ? at : direction->begin;
        }
    }
    return direction->begin;
}

/* Bytes that nobody holds up any more begin a segment of their own. */
static void put(struct sim_direction *direction, const uint8_t *bytes,
                size_t size) {
    uint64_t now = now_ns(direction), room = direction->quality.bytes;
    uint64_t left = room - (direction->end - direction->begin);
    size = size < left ? size : (size_t)left;
    if (size == 0)
        return;
    uint64_t *medium = direction->medium_ns;
    bool others = medium != NULL && *medium != direction->free_ns;
    if (others && *medium > direction->free_ns)
        direction->free_ns = *medium;
    if (direction->segments == 0 || direction->free_ns < now || others) {
        direction->free_ns =
            direction->free_ns < now ? now : direction->free_ns;
        struct sim_segment *s = segment_at(direction, direction->segments++);
        *s = (struct sim_segment){direction->end, direction->free_ns};
    }
    size_t at = (size_t)(direction->end % room);
    size_t first = size < room - at ? size : (size_t)room - at;
    memcpy(direction->bytes + at, bytes, first);
    memcpy(direction->bytes, bytes + first, size - first);
    direction->end += size;
    direction->free_ns += size * direction->step_ns;
    if (medium != NULL)
        *medium = direction->free_ns;
}

/* Nothing for a while; then another segment. */
static void stall(struct sim_direction *direction, uint64_t us) {
    uint64_t now = now_ns(direction);
    if (direction->segments + 1 >= SIM_SEGMENTS)
        return;
    direction->free_ns =
        (direction->free_ns < now ? now : direction->free_ns) + us * 1000;
    if (direction->segments > 0 &&
        segment_end(direction, direction->segments - 1) ==
            segment_at(direction, direction->segments - 1)->first)
        direction->segments--; /* an empty one */
    struct sim_segment *s = segment_at(direction, direction->segments++);
    *s = (struct sim_segment){direction->end, direction->free_ns};
}

/* A frame that went by, once more, if it is still there. */
static void put_again(struct sim_direction *direction) {
    uint64_t at = direction->frame, end = direction->end,
             room = direction->quality.bytes;
    if (2 * (end - at) > room)
        return;
    for (; at < end; at++) {
        uint8_t byte = direction->bytes[at % room];
        put(direction, &byte, 1);
    }
}

/* --- what goes wrong ------------------------------------------------------ */

/* Bytes that pass before the next strike. */
static uint64_t untouched(const struct sim_direction *direction) {
    uint64_t least = direction->gap[SIM_FLIP] / 8;
    for (int kind = SIM_DELETE; kind < SIM_CHANCES; kind++)
        least = direction->gap[kind] < least ? direction->gap[kind] : least;
    return direction->burst > 0 ? 0 : least;
}

static void count_down(struct sim_direction *direction, uint64_t bytes) {
    for (int kind = SIM_FLIP; kind < SIM_CHANCES; kind++)
        if (direction->gap[kind] != UINT64_MAX)
            direction->gap[kind] -= kind == SIM_FLIP ? 8 * bytes : bytes;
}

/* A byte that something may happen to. */
static void put_struck(struct sim_direction *direction, uint8_t byte) {
    while (strikes(direction, SIM_FLIP, 8))
        byte ^= (uint8_t)(1u << (sim_draw(&direction->random) >> 32) % 8);
    if (strikes(direction, SIM_BURST, 1))
        direction->burst = direction->faults.burst_bytes;
    if (direction->burst > 0) {
        direction->burst--;
        byte = (uint8_t)(sim_draw(&direction->random) >> 32);
    }
    if (strikes(direction, SIM_STALL, 1))
        stall(direction, direction->faults.stall_us);
    bool gone = strikes(direction, SIM_DELETE, 1);
    if (!gone)
        put(direction, &byte, 1);
    if (strikes(direction, SIM_REPEAT, 1))
        put(direction, &byte, 1);
    if (strikes(direction, SIM_INSERT, 1)) {
        byte = (uint8_t)(sim_draw(&direction->random) >> 32);
        put(direction, &byte, 1);
    }
}

static void put_piece(struct sim_direction *direction, const uint8_t *bytes,
                      size_t size) {
    while (size > 0) {
        uint64_t good = untouched(direction);
        size_t run = good < size ? (size_t)good : size;
        put(direction, bytes, run);
        count_down(direction, run);
        bytes += run;
        size -= run;
        if (size > 0) {
            put_struck(direction, *bytes++);
            size--;
        }
    }
}

/* The first piece of a frame. */
static void begin_frame(struct sim_direction *direction) {
    direction->frames++;
    direction->inside = true;
    direction->frame = direction->end;
    direction->fate = direction->decide != NULL
                          ? direction->decide(direction->context, direction)
                          : SIM_PASSES;
    direction->losing =
        direction->fate == SIM_DROPPED || strikes(direction, SIM_LOSS, 1);
    if (direction->fate == SIM_LATE)
        stall(direction, LATE_STALLS * 100000);
}

/* A frame, or a part of one: its last byte is the only zero it may hold. */
static void send_piece(struct sim_direction *direction, const uint8_t *bytes,
                       size_t size, bool last) {
    bool first = !direction->inside;
    if (first)
        begin_frame(direction);
    if (direction->deaf) {
        direction->struck[SIM_DEAF]++;
    } else if (!direction->losing && direction->fate == SIM_SPOILED && first) {
        size_t at = size > SPOILED_BYTE ? SPOILED_BYTE : size - 1;
        uint8_t byte = bytes[at] ^ 0x10;
        put_piece(direction, bytes, at);
        put_piece(direction, &byte, 1);
        put_piece(direction, bytes + at + 1, size - at - 1);
    } else if (!direction->losing) {
        put_piece(direction, bytes, size);
    }
    if (last) {
        direction->inside = false;
        if (direction->fate == SIM_TWICE && !direction->deaf)
            put_again(direction);
    }
}

/* --- the pipe ------------------------------------------------------------- */

static int sim_send(void *context, const uint8_t *bytes, size_t size) {
    struct sim_end *end = context;
    struct sim_direction *direction = end->out;
    if (*end->cut)
        return LINK_PIPE_CLOSED;
    uint64_t held = direction->end - passed(direction, now_ns(direction));
    uint64_t most =
        held < direction->quality.room ? direction->quality.room - held : 0;
    uint64_t place =
        direction->quality.bytes - (direction->end - direction->begin);
    most = most < place ? most : place;
    if (direction->segments == SIM_SEGMENTS)
        most = 0;
    direction->blocked = most < size;
    size = size < most ? size : (size_t)most;
    for (size_t at = 0; at < size;) {
        const uint8_t *zero = memchr(bytes + at, 0, size - at);
        size_t piece =
            zero != NULL ? (size_t)(zero + 1 - (bytes + at)) : size - at;
        send_piece(direction, bytes + at, piece, zero != NULL);
        at += piece;
    }
    return (int)size;
}

static int sim_receive(void *context, uint8_t *bytes, size_t size) {
    struct sim_end *end = context;
    struct sim_direction *direction = end->in;
    uint64_t now = now_ns(direction), late = latency_ns(direction);
    if (*end->cut)
        return LINK_PIPE_CLOSED;
    uint64_t there =
        now < late ? direction->begin : passed(direction, now - late);
    uint64_t room = direction->quality.bytes, got = there - direction->begin;
    got = got < size ? got : size;
    size_t at = (size_t)(direction->begin % room);
    size_t first = got < room - at ? (size_t)got : (size_t)room - at;
    memcpy(bytes, direction->bytes + at, first);
    memcpy(bytes + first, direction->bytes, (size_t)got - first);
    direction->begin += got;
    while (direction->segments > 0 &&
           segment_end(direction, 0) <= direction->begin &&
           (direction->segments > 1 || direction->free_ns <= now)) {
        direction->segment_first =
            (direction->segment_first + 1) % SIM_SEGMENTS;
        direction->segments--;
    }
    return (int)got;
}

struct link_pipe sim_pipe(struct sim_end *end) {
    return (struct link_pipe){end, sim_send, sim_receive};
}

uint64_t sim_next_us(const struct sim_direction *direction,
                     uint32_t gather_us) {
    for (uint32_t i = 0; i < direction->segments; i++) {
        const struct sim_segment *s = segment_at(direction, i);
        uint64_t end = segment_end(direction, i);
        uint64_t first =
            s->first > direction->begin ? s->first : direction->begin;
        if (first >= end)
            continue;
        uint64_t from = s->from_ns + latency_ns(direction);
        uint64_t head = from + (first - s->first + 1) * direction->step_ns;
        uint64_t tail = from + (end - s->first) * direction->step_ns;
        uint64_t most = head + (uint64_t)gather_us * 1000;
        return ((tail < most ? tail : most) + 999) / 1000;
    }
    return UINT64_MAX;
}

uint64_t sim_room_us(const struct sim_direction *direction) {
    uint64_t half = direction->quality.room / 2 * direction->step_ns;
    if (!direction->blocked || direction->segments == SIM_SEGMENTS ||
        direction->end - direction->begin == direction->quality.bytes)
        return UINT64_MAX;
    return direction->free_ns > half ? (direction->free_ns - half + 999) / 1000
                                     : 0;
}

/* --- the wire ------------------------------------------------------------- */

void sim_direction_faults(struct sim_direction *direction,
                          const struct sim_faults *faults) {
    direction->burst = 0;
    if (faults == NULL)
        memset(&direction->faults, 0, sizeof direction->faults);
    else
        direction->faults = *faults;
    for (int kind = 0; kind < SIM_CHANCES; kind++) {
        direction->gap[kind] =
            draw_gap(&direction->random, direction->faults.chance[kind]);
    }
}

void sim_direction_deaf(struct sim_direction *direction, bool deaf) {
    direction->deaf = deaf;
}

void sim_direction_flush(struct sim_direction *direction) {
    direction->begin = direction->end;
    direction->segments = 0;
    direction->segment_first = 0;
    direction->free_ns = now_ns(direction);
    direction->inside = false;
    direction->blocked = false;
}

void sim_wire_share(struct sim_wire *wire, uint64_t *free_ns) {
    wire->direction[0].medium_ns = wire->direction[1].medium_ns = free_ns;
}

void sim_wire_cut(struct sim_wire *wire, bool cut) {
    for (int i = 0; i < 2; i++) {
        sim_direction_flush(&wire->direction[i]);
        wire->direction[i].struck[SIM_CUT] += cut && !wire->cut;
    }
    wire->cut = cut;
}

size_t sim_wire_bytes(const struct sim_quality *quality) {
    return 2 * (size_t)quality->bytes;
}

void sim_wire_init(struct sim_wire *wire, void *memory,
                   const struct sim_quality *quality, const uint64_t *now_us,
                   uint64_t seed) {
    memset(wire, 0, sizeof *wire);
    for (unsigned i = 0; i < 2; i++) {
        struct sim_direction *direction = &wire->direction[i];
        direction->quality = *quality;
        direction->now_us = now_us;
        direction->bytes = (uint8_t *)memory + (size_t)i * quality->bytes;
        direction->step_ns = quality->bytes_per_s == 0
                                 ? 0
                                 : UINT64_C(1000000000) / quality->bytes_per_s;
        direction->random = sim_seed(seed, i);
        sim_direction_faults(direction, NULL);
        wire->end[i] = (struct sim_end){&wire->direction[i],
                                        &wire->direction[1 - i], &wire->cut};
    }
}
