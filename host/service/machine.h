/* All that the host's service asks of the place where its cube runs, as
 * node/board.h is all that a node asks of its board: processes of this machine,
 * ranks of MPI, real boards, or a simulation.  The service reads the time and
 * sleeps through it alone. */
#ifndef HOST_MACHINE_H
#define HOST_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#include "host/base/error.h"
#include "transport/cube.h"

struct host_watchers;

enum {
    HOST_NODES_MAX = 1024,    /* of any machine: 2^CUBE_DIMENSION_MAX */
    HOST_MEMORY_MAX = 1 << 30 /* bytes of a node that can be asked for */
};

struct host_machine {
    void *context;
    unsigned nodes, dimension;
    uint32_t epoch;        /* of this start of the host, never repeated */
    struct link_pipe pipe; /* the bytes to and from node 0 */
    uint32_t serial_baud;  /* of the slowest serial wire; 0: there is none */
    bool virtual_time;     /* time stands still while the host works */
    bool slow; /* its nodes may be silent for seconds, and where it starts them
                  need as long as the user has patience, as this machine
                  emulates them */
    /* A second wire, to another node, for when node 0 is lost; 0: none. */
    uint16_t spare_node;
    struct link_pipe spare;
    /* Instead of it, wires to nodes 0 .. host_ports - 1; see cube.h. */
    uint8_t host_ports;
    struct link_pipe wires[CUBE_HOST_PORTS_MAX]; /* [0] is `pipe` */
    /* A wire that is missing from the start is gone round, and later one that
     * was not up for so many seconds; 0: the machine has made its wires. */
    uint8_t absent_s;
    /* Is told of a wire that is missing from the start; NULL: the user is, on
     * standard error. */
    void (*missing)(void *context, unsigned node, unsigned link);
    /* Is told what the user should know, a line without "incode: "; NULL: the
     * user is, on standard error. */
    void (*told)(void *context, const char *line);
    /* Microseconds since any fixed time, never going back. */
    uint64_t (*now_us)(void *context);
    /* Sleeps until bytes have come, or room for them where there was none, but
     * no longer than wait_us. */
    void (*idle)(void *context, uint64_t wait_us);
    /* Looks after the nodes, and starts again those that it started itself and
     * that died.  0, or HOST_CUBE where the cube cannot go on. */
    int (*check)(void *context, struct host_error *error);
    /* Microseconds that a node's process has waited for a processor since its
     * start; NULL: not known. */
    uint64_t (*starved_us)(void *context, unsigned node);
    /* How many nodes `check` has started again so far; NULL: it never does. */
    unsigned (*restarts)(void *context);
    /* Ends a node that does not answer, for `check` to start it again; false,
     * as where it is NULL: the node is not this machine's to start. */
    bool (*kill)(void *context, unsigned node);
    /* How a command for this cube names it, quoted for a shell, as in "--cube
     * lab.cube"; NULL: no command can.  host_where tells it. */
    const char *where;
    bool keyed; /* the nodes must have the host's key */
    /* Why a node is not heard, as "WHAT" or "WHAT; WHAT TO DO NEXT"; NULL, or
     * the result: nothing is known of it.  Until the next call. */
    const char *(*doubt)(void *context, unsigned node);
    /* The line for a shell that starts the node, and by which address the host
     * reaches it; NULL, or the results: it is not the user who starts it, the
     * host has no wire to it.  Until the next call. */
    const char *(*start_line)(void *context, unsigned node);
    const char *(*address)(void *context, unsigned node);
    /* Leaves the host's wires alone for a time, as another host has them; NULL:
     * there is no other. */
    void (*rest)(void *context, uint64_t rest_us);
    /* Others who watch its cube: watchers.h; NULL: nobody can. */
    const struct host_watchers *watchers;
    /* Whether every node has ended: true as well where nothing tells.  Called
     * at the end, when no node is to be started again. */
    bool (*ended)(void *context);
    /* Ends what still runs and was started here. */
    void (*stop)(void *context);
};

/* For advice: the command's own words, or what they look like. */
static inline const char *host_where(const struct host_machine *machine) {
    return machine->where == NULL ? "--cube FILE" : machine->where;
}

/* The link by which a node is reached from the gateway, the last of e-cube's
 * way; of the gateway, the host's wire. */
static inline unsigned host_link_to(unsigned node, unsigned gateway,
                                    unsigned dimension) {
    unsigned away = node ^ gateway;
    return away == 0 ? dimension : 31u - (unsigned)__builtin_clz(away);
}

#endif
