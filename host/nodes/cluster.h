/* The nodes that the host starts on this machine: processes of incode-node,
 * each with the wires of a hypercube and no others, its data memory limited by
 * the kernel, or of an emulator, all gone when the host goes.  One that dies is
 * started again, on the same wires; one that dies too often is an error.
 *
 * Memory: 24 bytes a node; both ends of every wire, for nodes that start
 * again. */
#ifndef HOST_CLUSTER_H
#define HOST_CLUSTER_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "host/base/error.h"
#include "transport/cube.h"
#include "port.h"
#include "host/service/machine.h"

/* What the links of a cube may run over, one row a kind of wire, by which
 * --link, statistics and messages name it, and which says how it differs. */

struct host_link {
    const char *name;
    const char *help; /* what it is, in one line */
    /* Both ends of a wire as open files of this machine: 0, or -1 with errno;
     * NULL: this machine makes none. */
    int (*pair)(int fds[2]);
    const char *needs; /* what the machine may not allow of it */
    bool terminals;    /* ends are terminals, opened by name as a port would be,
                          and may be closed and opened again */
    bool ranks;        /* the nodes are ranks, which mpirun starts */
};

/* Row i of those that --link knows, the first being the default; NULL past the
 * last. */
const struct host_link *host_link_row(unsigned i);
const char *host_link_name(unsigned i);

/* Of those, or of those that only a cube file or a board has (`unix`, `mixed`,
 * `uart`); NULL: there is none of that name. */
const struct host_link *host_link_named(const char *name);

/* For tests: emulated boards that are reset, stopped for a while or killed, one
 * after the other, each once, so many microseconds apart. */

enum host_trouble_kind {
    HOST_TROUBLE_RESET,
    HOST_TROUBLE_STOP,
    HOST_TROUBLE_KILL,
    HOST_TROUBLES,
    HOST_TROUBLE_CONT = HOST_TROUBLES /* the end of a stop */
};

struct host_trouble {
    uint64_t every_us[HOST_TROUBLES]; /* 0: never.  A stop lasts half of it. */
};

struct host_troubled {
    struct host_trouble trouble;
    unsigned nodes;
    uint64_t last_us[HOST_TROUBLES]; /* 0: not begun */
    unsigned turn[HOST_TROUBLES];
    bool stopped;
    unsigned stopped_node;
};

/* Whether one is due, which, and whose. */
bool host_trouble_due(struct host_troubled *troubled, uint64_t now_us,
                      enum host_trouble_kind *kind, unsigned *node);

/* The wires between nodes that this machine emulates, and from the host to the
 * first of them: pairs of open files, one end for each side, by kind.
 *
 * Memory: 4 bytes for each port of HOST_PROCESSES_MAX nodes; in the kernel
 * what a wire of its kind takes. */

enum { HOST_PROCESSES_MAX = 64 }; /* nodes on one machine */

struct host_wires {
    int host[CUBE_HOST_PORTS_MAX]; /* its ends of its wires; -1: none */
    char host_path[64]; /* of the one to node 0, where it is a terminal */
    int end[HOST_PROCESSES_MAX][CUBE_LINKS_MAX]; /* [node][link]; -1: none */
};

/* Of a kind that has pairs; all ends non-blocking and closed on exec.  The host
 * has wires to nodes 0 .. host_ports - 1.  HOST_CUBE where the machine does not
 * give so many; what was made is closed then. */
int host_wires_make(struct host_wires *wires, const struct host_link *link,
                    unsigned nodes, unsigned dimension, unsigned host_ports,
                    struct host_error *error);

/* Closes all. */
void host_wires_close(struct host_wires *wires);

enum {
    HOST_MEMORY_MIN = 256 * 1024,  /* bytes a node */
    HOST_STATIC_BYTES = 16 * 1024, /* .data and .bss of incode-node, at most */
    HOST_STACK_BYTES = 64 * 1024   /* of a node's memory */
};

struct host_cluster_options {
    unsigned nodes;  /* a power of two, at most HOST_PROCESSES_MAX */
    uint64_t memory; /* bytes of data memory a node, stack included */
    const struct host_link *link; /* that has pairs */
    uint64_t unplug_us;           /* for tests: see port.h */
    bool one_wire;       /* for tests: the host has that to node 0 alone */
    unsigned window;     /* frames a link and direction; 0: node's choice */
    const char *program; /* NULL: incode-node beside this executable */
    /* Other programs than that one: what the child of a node does, which has
     * inherited the wires; it returns where that fails, with errno.  NULL: it
     * becomes incode-node. */
    void (*become)(const void *context, unsigned node);
    const void *context;   /* of become */
    uint64_t left_out;     /* a bit for each node that is not to be started */
    const char *directory; /* of emulated boards: what is to stay, or to be
                              reached from outside; NULL: nothing */
    int folder;            /* that directory, from host_folder_open */
    bool open;             /* there, all wires between boards: not joined */
    bool empty;            /* boards have their loaders, and no image */
    uint32_t serial_baud;  /* see machine.h */
    struct host_trouble trouble; /* for tests, of emulated boards */
};

struct host_cluster {
    unsigned nodes, dimension;
    struct host_cluster_options options;
    uint32_t host_epoch;
    uint32_t epoch;          /* of the last start of a node */
    unsigned restarts;       /* of nodes */
    struct host_wires wires; /* the nodes' ends, for those that start again */
    unsigned ports;          /* wires of the host, to nodes 0 .. ports - 1 */
    struct host_port port[CUBE_HOST_PORTS_MAX];
    uint64_t awake_us; /* that nodes stay awake for the host */
    bool limited;      /* the kernel holds the nodes to their memory */
    struct host_process process[HOST_PROCESSES_MAX];
    char path[4096]; /* of the node program */
};

/* The node program: the one given, or if NULL that of this name beside this
 * executable, as `make` and `make install` put it. */
int host_cluster_program(const char *given, const char *name, char *path,
                         size_t size, struct host_error *error);

int host_cluster_start(struct host_cluster *cluster,
                       const struct host_cluster_options *options,
                       struct host_error *error);

/* The cluster as the service's machine, which points to it. */
struct host_machine host_cluster_machine(struct host_cluster *cluster);

/* A machine whose host is slow on purpose, for tests: reads no faster than a
 * rate for a while, all its wires together, and stalls at random. */

struct host_throttle {
    uint64_t stall_us_max;   /* sleeps up to this long, at random; 0: never */
    uint64_t bytes_a_second; /* reads no faster; 0: unlimited */
    uint64_t slow_us;        /* as long as this after the start */
    uint64_t seed;
};

struct host_throttled {
    struct host_machine machine; /* the one beneath */
    struct host_throttled_wire {
        struct host_throttled *throttled;
        struct link_pipe pipe; /* beneath */
    } wire[CUBE_HOST_PORTS_MAX];
    struct host_throttle throttle;
    uint64_t start_us, taken, random;
};

/* `machine` as it looks from a host so throttled. */
struct host_machine host_throttle_machine(struct host_throttled *throttled,
                                          const struct host_machine *machine,
                                          const struct host_throttle *throttle);

#endif
