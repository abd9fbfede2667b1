#include "sim.h"

#include <string.h>

enum { SPOILED_BYTE = 6, LATE_STALLS = 3 };

/* --- chance -------------------------------------------------------------- */

uint64_t sim_draw(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

/* Steele, Lea and Flood's mixing (2014). */
uint64_t sim_seed(uint64_t seed, uint64_t purpose)
{
    uint64_t x = seed * UINT64_C(0x9e3779b97f4a7c15) + purpose * 0x632be5abu;
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    x ^= x >> 31;
    return x == 0 ? 1 : x;
}

/* Exponentially distributed with mean 1, by comparisons alone (von Neumann,
 * 1951), so that it is the same on every machine. */
static double exponential(uint64_t *state)
{
    for (double whole = 0;; whole++) {
        uint64_t first = sim_draw(state), last = first;
        unsigned falling = 1;
        for (;;) {
            uint64_t next = sim_draw(state);
            if (next >= last) {
                break;
            }
            last = next;
            falling++;
        }
        if (falling % 2 == 1) {
            return whole + (double)(first >> 11) * 0x1p-53;
        }
    }
}

/* How many go well before the next that does not. */
static uint64_t draw_gap(uint64_t *state, double chance)
{
    if (chance <= 0) {
        return UINT64_MAX;
    }
    double gap = exponential(state) * (1 / chance - 0.5);
    return gap < 1e18 ? (uint64_t)gap : UINT64_MAX;
}

/* Whether one of the next `steps` is struck; the gap is counted down. */
static bool strikes(struct sim_line *line, enum sim_fault kind, uint64_t steps)
{
    uint64_t *gap = &line->gap[kind];
    if (*gap == UINT64_MAX) {
        return false;
    }
    if (*gap >= steps) {
        *gap -= steps;
        return false;
    }
    *gap = draw_gap(&line->random, line->faults.chance[kind]);
    line->struck[kind]++;
    return true;
}

/* --- the line ------------------------------------------------------------ */

static uint64_t now_ns(const struct sim_line *line)
{
    return *line->now_us * 1000;
}

static uint64_t latency_ns(const struct sim_line *line)
{
    return (uint64_t)line->quality.latency_us * 1000;
}

static struct sim_segment *segment_at(const struct sim_line *line, uint32_t i)
{
    return (struct sim_segment *)&line
        ->segment[(line->segment_first + i) % SIM_SEGMENTS];
}

/* Past the last byte of segment i. */
static uint64_t segment_end(const struct sim_line *line, uint32_t i)
{
    return i + 1 < line->segments ? segment_at(line, i + 1)->first : line->end;
}

/* Bytes [first, result) of segment i have left the driver at time_ns. */
static uint64_t passed_of(const struct sim_line *line, uint32_t i,
                          uint64_t time_ns)
{
    const struct sim_segment *s = segment_at(line, i);
    uint64_t end = segment_end(line, i);
    if (time_ns < s->from_ns) {
        return s->first;
    }
    if (line->step_ns == 0) {
        return end;
    }
    uint64_t count = (time_ns - s->from_ns) / line->step_ns;
    return count < end - s->first ? s->first + count : end;
}

/* Position up to which bytes have left the driver at time_ns. */
static uint64_t passed(const struct sim_line *line, uint64_t time_ns)
{
    for (uint32_t i = line->segments; i-- > 0;) {
        if (segment_at(line, i)->from_ns <= time_ns) {
            uint64_t at = passed_of(line, i, time_ns);
            return at > line->begin ? at : line->begin;
        }
    }
    return line->begin;
}

/* Bytes that nobody holds up any more begin a segment of their own. */
static void put(struct sim_line *line, const uint8_t *bytes, size_t size)
{
    uint64_t now = now_ns(line), room = line->quality.bytes;
    uint64_t left = room - (line->end - line->begin);
    size = size < left ? size : (size_t)left;
    if (size == 0) {
        return;
    }
    if (line->segments == 0 || line->free_ns < now) {
        line->free_ns = line->free_ns < now ? now : line->free_ns;
        struct sim_segment *s = segment_at(line, line->segments++);
        *s = (struct sim_segment){line->end, line->free_ns};
    }
    size_t at = (size_t)(line->end % room);
    size_t first = size < room - at ? size : (size_t)room - at;
    memcpy(line->bytes + at, bytes, first);
    memcpy(line->bytes, bytes + first, size - first);
    line->end += size;
    line->free_ns += size * line->step_ns;
}

/* Nothing for a while; then another segment. */
static void stall(struct sim_line *line, uint64_t us)
{
    uint64_t now = now_ns(line);
    if (line->segments + 1 >= SIM_SEGMENTS) {
        return;
    }
    line->free_ns = (line->free_ns < now ? now : line->free_ns) + us * 1000;
    if (line->segments > 0 && segment_end(line, line->segments - 1) ==
                                  segment_at(line, line->segments - 1)->first) {
        line->segments--; /* an empty one */
    }
    struct sim_segment *s = segment_at(line, line->segments++);
    *s = (struct sim_segment){line->end, line->free_ns};
}

/* A frame that went by, once more, if it is still there. */
static void put_again(struct sim_line *line)
{
    uint64_t at = line->frame, end = line->end, room = line->quality.bytes;
    if (2 * (end - at) > room) {
        return;
    }
    for (; at < end; at++) {
        uint8_t byte = line->bytes[at % room];
        put(line, &byte, 1);
    }
}

/* --- what goes wrong ----------------------------------------------------- */

/* Bytes that pass before the next strike. */
static uint64_t untouched(const struct sim_line *line)
{
    uint64_t least = line->gap[SIM_FLIP] / 8;
    for (int kind = SIM_DELETE; kind < SIM_CHANCES; kind++) {
        least = line->gap[kind] < least ? line->gap[kind] : least;
    }
    return line->burst > 0 ? 0 : least;
}

static void count_down(struct sim_line *line, uint64_t bytes)
{
    for (int kind = SIM_FLIP; kind < SIM_CHANCES; kind++) {
        if (line->gap[kind] != UINT64_MAX) {
            line->gap[kind] -= kind == SIM_FLIP ? 8 * bytes : bytes;
        }
    }
}

/* A byte that something may happen to. */
static void put_struck(struct sim_line *line, uint8_t byte)
{
    while (strikes(line, SIM_FLIP, 8)) {
        byte ^= (uint8_t)(1u << (sim_draw(&line->random) >> 32) % 8);
    }
    if (strikes(line, SIM_BURST, 1)) {
        line->burst = line->faults.burst_bytes;
    }
    if (line->burst > 0) {
        line->burst--;
        byte = (uint8_t)(sim_draw(&line->random) >> 32);
    }
    if (strikes(line, SIM_STALL, 1)) {
        stall(line, line->faults.stall_us);
    }
    bool gone = strikes(line, SIM_DELETE, 1);
    if (!gone) {
        put(line, &byte, 1);
    }
    if (strikes(line, SIM_REPEAT, 1)) {
        put(line, &byte, 1);
    }
    if (strikes(line, SIM_INSERT, 1)) {
        byte = (uint8_t)(sim_draw(&line->random) >> 32);
        put(line, &byte, 1);
    }
}

static void put_piece(struct sim_line *line, const uint8_t *bytes, size_t size)
{
    while (size > 0) {
        uint64_t good = untouched(line);
        size_t run = good < size ? (size_t)good : size;
        put(line, bytes, run);
        count_down(line, run);
        bytes += run;
        size -= run;
        if (size > 0) {
            put_struck(line, *bytes++);
            size--;
        }
    }
}

/* The first piece of a frame. */
static void begin_frame(struct sim_line *line)
{
    line->frames++;
    line->inside = true;
    line->frame = line->end;
    line->fate =
        line->decide != NULL ? line->decide(line->context, line) : SIM_PASSES;
    line->losing = line->fate == SIM_DROPPED || strikes(line, SIM_LOSS, 1);
    if (line->fate == SIM_LATE) {
        stall(line, LATE_STALLS * 100000);
    }
}

/* A frame, or a part of one: its last byte is the only zero it may hold. */
static void send_piece(struct sim_line *line, const uint8_t *bytes, size_t size,
                       bool last)
{
    bool first = !line->inside;
    if (first) {
        begin_frame(line);
    }
    if (line->deaf) {
        line->struck[SIM_DEAF]++;
    } else if (!line->losing && line->fate == SIM_SPOILED && first) {
        size_t at = size > SPOILED_BYTE ? SPOILED_BYTE : size - 1;
        uint8_t byte = bytes[at] ^ 0x10;
        put_piece(line, bytes, at);
        put_piece(line, &byte, 1);
        put_piece(line, bytes + at + 1, size - at - 1);
    } else if (!line->losing) {
        put_piece(line, bytes, size);
    }
    if (last) {
        line->inside = false;
        if (line->fate == SIM_TWICE && !line->deaf) {
            put_again(line);
        }
    }
}

/* --- the pipe ------------------------------------------------------------ */

static int sim_send(void *context, const uint8_t *bytes, size_t size)
{
    struct sim_end *end = context;
    struct sim_line *line = end->out;
    if (*end->cut) {
        return LINK_PIPE_CLOSED;
    }
    uint64_t held = line->end - passed(line, now_ns(line));
    uint64_t most = held < line->quality.room ? line->quality.room - held : 0;
    uint64_t place = line->quality.bytes - (line->end - line->begin);
    most = most < place ? most : place;
    if (line->segments == SIM_SEGMENTS) {
        most = 0;
    }
    line->blocked = most < size;
    size = size < most ? size : (size_t)most;
    for (size_t at = 0; at < size;) {
        const uint8_t *zero = memchr(bytes + at, 0, size - at);
        size_t piece =
            zero != NULL ? (size_t)(zero + 1 - (bytes + at)) : size - at;
        send_piece(line, bytes + at, piece, zero != NULL);
        at += piece;
    }
    return (int)size;
}

static int sim_receive(void *context, uint8_t *bytes, size_t size)
{
    struct sim_end *end = context;
    struct sim_line *line = end->in;
    uint64_t now = now_ns(line), late = latency_ns(line);
    if (*end->cut) {
        return LINK_PIPE_CLOSED;
    }
    uint64_t there = now < late ? line->begin : passed(line, now - late);
    uint64_t room = line->quality.bytes, got = there - line->begin;
    got = got < size ? got : size;
    size_t at = (size_t)(line->begin % room);
    size_t first = got < room - at ? (size_t)got : (size_t)room - at;
    memcpy(bytes, line->bytes + at, first);
    memcpy(bytes + first, line->bytes, (size_t)got - first);
    line->begin += got;
    while (line->segments > 0 && segment_end(line, 0) <= line->begin &&
           (line->segments > 1 || line->free_ns <= now)) {
        line->segment_first = (line->segment_first + 1) % SIM_SEGMENTS;
        line->segments--;
    }
    return (int)got;
}

struct link_pipe sim_pipe(struct sim_end *end)
{
    return (struct link_pipe){end, sim_send, sim_receive};
}

uint64_t sim_next_us(const struct sim_line *line, uint32_t gather_us)
{
    for (uint32_t i = 0; i < line->segments; i++) {
        const struct sim_segment *s = segment_at(line, i);
        uint64_t end = segment_end(line, i);
        uint64_t first = s->first > line->begin ? s->first : line->begin;
        if (first >= end) {
            continue;
        }
        uint64_t from = s->from_ns + latency_ns(line);
        uint64_t head = from + (first - s->first + 1) * line->step_ns;
        uint64_t tail = from + (end - s->first) * line->step_ns;
        uint64_t most = head + (uint64_t)gather_us * 1000;
        return ((tail < most ? tail : most) + 999) / 1000;
    }
    return UINT64_MAX;
}

uint64_t sim_room_us(const struct sim_line *line)
{
    uint64_t half = line->quality.room / 2 * line->step_ns;
    if (!line->blocked || line->segments == SIM_SEGMENTS ||
        line->end - line->begin == line->quality.bytes) {
        return UINT64_MAX;
    }
    return line->free_ns > half ? (line->free_ns - half + 999) / 1000 : 0;
}

/* --- the wire ------------------------------------------------------------ */

void sim_line_faults(struct sim_line *line, const struct sim_faults *faults)
{
    line->burst = 0;
    if (faults == NULL) {
        memset(&line->faults, 0, sizeof line->faults);
    } else {
        line->faults = *faults;
    }
    for (int kind = 0; kind < SIM_CHANCES; kind++) {
        line->gap[kind] = draw_gap(&line->random, line->faults.chance[kind]);
    }
}

void sim_line_deaf(struct sim_line *line, bool deaf)
{
    line->deaf = deaf;
}

void sim_line_flush(struct sim_line *line)
{
    line->begin = line->end;
    line->segments = 0;
    line->segment_first = 0;
    line->free_ns = now_ns(line);
    line->inside = false;
    line->blocked = false;
}

void sim_wire_cut(struct sim_wire *wire, bool cut)
{
    for (int i = 0; i < 2; i++) {
        sim_line_flush(&wire->line[i]);
        wire->line[i].struck[SIM_CUT] += cut && !wire->cut;
    }
    wire->cut = cut;
}

size_t sim_wire_bytes(const struct sim_quality *quality)
{
    return 2 * (size_t)quality->bytes;
}

void sim_wire_init(struct sim_wire *wire, void *memory,
                   const struct sim_quality *quality, const uint64_t *now_us,
                   uint64_t seed)
{
    memset(wire, 0, sizeof *wire);
    for (unsigned i = 0; i < 2; i++) {
        struct sim_line *line = &wire->line[i];
        line->quality = *quality;
        line->now_us = now_us;
        line->bytes = (uint8_t *)memory + (size_t)i * quality->bytes;
        line->step_ns = quality->bytes_per_s == 0
                            ? 0
                            : UINT64_C(1000000000) / quality->bytes_per_s;
        line->random = sim_seed(seed, i);
        sim_line_faults(line, NULL);
        wire->end[i] =
            (struct sim_end){&wire->line[i], &wire->line[1 - i], &wire->cut};
    }
}
