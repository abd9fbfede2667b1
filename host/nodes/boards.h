/* What a node may run on, one row a board, by which --board, cube files,
 * statistics and messages name it, and by which its nodes are started.  A new
 * board with an operating system is a file that defines host_board_NAME, and a
 * row of boards.c.  A bare board is a folder of boards/, of whose facts.h the
 * build makes the row.  A run
 * on a cube file has its board's name alone, and starts what the file says.
 * Ranks of MPI, whose program is that of boards/mpi, are a kind of link: they
 * are processes of the board linux. */
#ifndef HOST_BOARDS_H
#define HOST_BOARDS_H

#include <stdbool.h>

#include "cluster.h"
#include "emulator.h"
#include "host/service/machine.h"

/* A cube of nodes that a board has started. */
struct host_started {
    struct host_machine machine; /* whose end stops them */
    bool limited;                /* the kernel holds each to its memory */
    /* How each is held to its memory, behind "bytes of data memory a node";
     * NULL: nothing to say. */
    const char *memory_held;
    int send_bytes, receive_bytes; /* buffers of a wire's end; 0: not known */
};

struct host_board {
    const char *name;
    const char *help;    /* what it is, in one line */
    const char *program; /* its nodes' own, a file beside this one; NULL: it
                            has no system to start one */
    const struct host_bare *bare; /* then: what it is, and what emulates it */
    /* Starts nodes of this board here, wired as a cube.  0, HOST_CUBE or
     * HOST_BROKEN.  Once at a time. */
    int (*start)(const struct host_board *board,
                 const struct host_cluster_options *options,
                 struct host_started *started, struct host_error *error);
};

/* Row i, the first being the default; NULL past the last. */
const struct host_board *host_board_row(unsigned i);
const char *host_board_name(unsigned i);

/* Of a cube file whose nodes run on several: a name, and nothing to start. */
extern const struct host_board host_board_mixed;

/* NULL: there is none of that name. */
const struct host_board *host_board_named(const char *name);

/* Boards without a system alone. */
const struct host_board *host_bare_named(const char *name);

/* Their names, separated by commas. */
enum { HOST_BARE_NAMES = 400 };
void host_bare_names(char text[HOST_BARE_NAMES]);

#endif
