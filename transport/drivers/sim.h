/* Wires in virtual time.  A wire has two ends and a direction each way, with a
 * rate, a latency, a driver's buffer, and faults of bytes and frames that are
 * drawn from a seed.  The same calls at the same times give the same bytes at
 * the same times, on every machine.
 *
 * Memory: struct sim_wire, and sim_wire_bytes() that the caller gives. */
#ifndef TRANSPORT_DRIVERS_SIM_H
#define TRANSPORT_DRIVERS_SIM_H

#include <stdbool.h>

#include "transport/link.h"

enum {
    SIM_SEGMENTS = 32, /* bursts of bytes on a direction at a time */
    SIM_BYTES_MIN = 8192
};

/* Random faults of a direction, and faults that the caller causes. */
enum sim_fault {
    SIM_LOSS,   /* a frame, up to its zero, is not there */
    SIM_FLIP,   /* a bit is the other one */
    SIM_DELETE, /* a byte is not there */
    SIM_INSERT, /* a byte that was not sent */
    SIM_REPEAT, /* a byte comes twice */
    SIM_BURST,  /* burst_bytes of noise */
    SIM_STALL,  /* nothing for stall_us */
    SIM_CHANCES,
    SIM_DEAF = SIM_CHANCES, /* sim_direction_deaf: takes bytes, brings none */
    SIM_CUT,                /* sim_wire_cut: both ends see it closed */
    SIM_FAULTS
};

/* What happens to one frame if the caller decides. */
enum sim_fate { SIM_PASSES, SIM_DROPPED, SIM_SPOILED, SIM_TWICE, SIM_LATE };

struct sim_quality {
    uint32_t bytes_per_s; /* 0: as many as there are */
    uint32_t latency_us;
    uint32_t room;  /* bytes that a driver takes ahead of the wire */
    uint32_t bytes; /* on a direction at a time, room included; SIM_BYTES_MIN or
                       more; what an end does not read holds up the other */
};

/* SIM_LOSS is a frame's chance, SIM_FLIP a bit's, all others a byte's. */
struct sim_faults {
    double chance[SIM_CHANCES];
    uint32_t burst_bytes, stall_us;
};

/* Bytes from `first` on follow each other step_ns apart: byte first + k comes
 * at from_ns + (k + 1) * step_ns. */
struct sim_segment {
    uint64_t first, from_ns;
};

/* One direction.  Positions count the bytes ever put on it. */
struct sim_direction {
    struct sim_quality quality;
    struct sim_faults faults;
    const uint64_t *now_us;
    uint8_t *bytes;
    uint64_t begin, end, frame; /* taken off; put on; where a frame began */
    uint64_t free_ns, step_ns;
    uint64_t *medium_ns; /* when what several share is free; NULL: its own */
    struct sim_segment segment[SIM_SEGMENTS];
    uint32_t segment_first, segments;
    uint64_t random;
    uint64_t gap[SIM_CHANCES]; /* how many go well before the next strike */
    uint64_t burst;            /* bytes of noise left */
    bool deaf, inside, losing, blocked;
    enum sim_fate fate;
    uint64_t frames; /* begun */
    uint64_t struck[SIM_FAULTS];
    /* NULL, or what becomes of frame `frames`, counted from 1. */
    enum sim_fate (*decide)(void *context, struct sim_direction *direction);
    void *context;
};

struct sim_end {
    struct sim_direction *out, *in;
    const bool *cut;
};

struct sim_wire {
    struct sim_direction direction[2];
    struct sim_end end[2];
    bool cut;
};

/* Bytes of memory for the directions of a wire. */
size_t sim_wire_bytes(const struct sim_quality *quality);

/* A wire without faults. */
void sim_wire_init(struct sim_wire *wire, void *memory,
                   const struct sim_quality *quality, const uint64_t *now_us,
                   uint64_t seed);

struct link_pipe sim_pipe(struct sim_end *end);

/* From now on its two directions and all that have the same medium take turns,
 * first come, first served, as on one Ethernet; free_ns: when it is free, 0 at
 * first. */
void sim_wire_share(struct sim_wire *wire, uint64_t *free_ns);

/* From now on; NULL: no more faults of chance. */
void sim_direction_faults(struct sim_direction *direction,
                          const struct sim_faults *faults);

/* A direction that is deaf loses all that is sent. */
void sim_direction_deaf(struct sim_direction *direction, bool deaf);

/* Loses what is on the direction. */
void sim_direction_flush(struct sim_direction *direction);

/* A wire that is cut loses what is on it, and is closed at both ends. */
void sim_wire_cut(struct sim_wire *wire, bool cut);

/* When the far end may read: at the first byte or up to gather_us later, if
 * more is on its way; UINT64_MAX: nothing comes. */
uint64_t sim_next_us(const struct sim_direction *direction, uint32_t gather_us);

/* When half of the driver's room is free for one who found none; UINT64_MAX:
 * the last bytes offered were all taken, or it is the far end that must read
 * first. */
uint64_t sim_room_us(const struct sim_direction *direction);

/* Draws as the directions do: xorshift, never 0. */
uint64_t sim_draw(uint64_t *state);

/* A state of one's own for each seed and purpose. */
uint64_t sim_seed(uint64_t seed, uint64_t purpose);

#endif
