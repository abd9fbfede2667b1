/* Pipes of bytes between ranks of MPI, and a sleep for a rank.  MPI has no wait
 * with a timeout, and a rank that spins takes the processor from the others.
 * Ranks of one machine wake each other by a word of shared memory.  A rank with
 * a peer on another machine polls every MPI_LOOK_US.
 *
 * Each rank on the way is expensive.  Two ranks that share processors pass 8
 * bytes in 4 to 7 us; each rank between them adds 15 us and halves the
 * throughput (tests/bench/mpi_hops.c).  So the host has pipes to nodes 0 .. 7,
 * which makes runs on 8 to 64 nodes 15 to 30 % shorter than one pipe to node 0.
 * Pipes between nodes are the cube's edges.
 *
 * Memory: a pipe is MPI_PIPE_SLOTS buffers of MPI_PIPE_BYTES each way, and
 * struct mpi_place one pointer a rank.  MPI itself never holds more than twice
 * that in unrequested bytes of a pipe: one message in MPI_PIPE_SLOTS is
 * synchronous, and no slot is used again before its message is complete.  Work:
 * send and receive handle at most MPI_PIPE_SLOTS messages a call. */
#ifndef TRANSPORT_DRIVERS_MPI_H
#define TRANSPORT_DRIVERS_MPI_H

#include <mpi.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "transport/link.h"

enum {
    MPI_RANKS_MAX = 65,    /* the host and its nodes */
    MPI_PIPE_BYTES = 4032, /* a message: below where MPI asks before it sends */
    MPI_PIPE_SLOTS = 8,
    MPI_LOOK_US = 200
};

/* What rank 0 tells all others.  A cube begins with BEGIN and ends with END, at
 * which each rank meets the others in mpi_place_part. */
enum mpi_word { MPI_WORD_BEGIN, MPI_WORD_END, MPI_WORD_LEAVE };

struct mpi_order {
    uint32_t word;
    uint32_t nodes, dimension, window, epoch; /* of the cube that begins */
    uint32_t host_ports;                      /* see cube.h */
    uint32_t tag;                             /* of its pipes */
    uint64_t memory;                          /* bytes a node */
};

/* Of messages: orders; the tag of a cube in which a node has ended; the first
 * for the pipes of a cube. */
enum { MPI_TAG_ORDER, MPI_TAG_ENDED, MPI_TAG_PIPES };

struct mpi_place {
    MPI_Comm comm;  /* of all ranks, for this program only */
    MPI_Comm local; /* those of this machine */
    MPI_Win window; /* a word of each of them: */
    _Atomic uint32_t *bell[MPI_RANKS_MAX]; /* it sleeps; NULL: elsewhere */
    int rank, ranks;
    bool yields;                /* MPI does by itself, at start and end */
    int process[MPI_RANKS_MAX]; /* of this machine; 0: elsewhere */
};

struct mpi_pipe {
    struct mpi_place *place;
    int peer, tag;
    bool blocked;         /* there was no room for all */
    bool pending;         /* the last message may not be on its way yet */
    bool closed;          /* the peer has ended it */
    uint32_t sent, taken; /* messages; their slots by the low bits */
    size_t at;            /* of the oldest message received */
    MPI_Request out[MPI_PIPE_SLOTS], in[MPI_PIPE_SLOTS];
    int in_size; /* of the oldest message received; -1: it has not come */
    uint8_t out_bytes[MPI_PIPE_SLOTS][MPI_PIPE_BYTES];
    uint8_t in_bytes[MPI_PIPE_SLOTS][MPI_PIPE_BYTES];
};

/* All ranks together.  0, or -1 where there are more than MPI_RANKS_MAX. */
int mpi_place_open(struct mpi_place *place);
void mpi_place_close(struct mpi_place *place);

/* Closes the pipes of a cube, in all ranks together, once nothing is on its
 * way in them: true; false where another rank did not come within wait_us. */
bool mpi_place_part(struct mpi_place *place, struct mpi_pipe *pipes,
                    unsigned count, uint64_t wait_us);

void mpi_pipe_open(struct mpi_pipe *pipe, struct mpi_place *place, int peer,
                   int tag);
struct link_pipe mpi_link_pipe(struct mpi_pipe *pipe);

/* This end is used no more: the other's is closed then. */
void mpi_pipe_end(struct mpi_pipe *pipe);

/* Wakes a rank that sleeps on this machine. */
void mpi_ring(struct mpi_place *place, int rank);

/* Sleeps until one of the pipes has bytes, or room where it had none, or
 * `request` (NULL: none), which is rank 0's to fulfil, is complete; no longer
 * than wait_us. */
void mpi_sleep(struct mpi_place *place, struct mpi_pipe *pipes, unsigned count,
               MPI_Request *request, uint64_t wait_us);

#endif
