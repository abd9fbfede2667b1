/* The host's side of a cube whose nodes are ranks of MPI: this is rank 0, node
 * i is rank i + 1.  Open MPI ends all ranks when it loses one; the host has a
 * moment then to say which.
 *
 * With the last cube that is due the other ranks leave, and MPI ends: what is
 * done afterwards is not lost with a rank.
 *
 * Memory: CUBE_HOST_PORTS_MAX pipes of 64 KiB. */
#ifndef HOST_MPI_RANKS_H
#define HOST_MPI_RANKS_H

#include <signal.h>

#include "host/service/machine.h"
#include "transport/drivers/mpi.h"

struct host_ranks {
    struct mpi_place place;
    struct mpi_pipe pipe[CUBE_HOST_PORTS_MAX]; /* to nodes 0 .. */
    unsigned wires;
    struct mpi_order order;   /* of the present cube */
    unsigned cubes_due;       /* until the ranks may leave */
    unsigned cubes, ended;    /* begun so far; nodes of this one */
    bool open, running, left; /* the place; a cube; MPI */
    bool terminated;          /* the job is ended from outside */
    bool stuck;               /* a rank does not answer */
    int lost;                 /* rank; 0: none */
    struct sigaction before;  /* on SIGTERM, once MPI has ended */
};

/* All ranks together.  HOST_USAGE where their number makes no cube. */
int host_ranks_open(struct host_ranks *ranks, struct host_error *error);

/* A cube of so many nodes, at most one for each rank but this. */
int host_ranks_begin(struct host_ranks *ranks, unsigned nodes, uint64_t memory,
                     unsigned window, struct host_error *error);

struct host_machine host_ranks_machine(struct host_ranks *ranks);

/* Lets the other ranks go and ends MPI, where that has not been done; `status`
 * is what the program will end with.  Does not return where ranks are left that
 * do not hear: mpirun ends them then. */
void host_ranks_close(struct host_ranks *ranks, int status);

#endif
