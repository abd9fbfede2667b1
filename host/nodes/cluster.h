/* The nodes that the host starts on this machine: processes of incode-node,
 * each with the wires of a hypercube and no others, its data memory limited by
 * the kernel, or of an emulator, all gone when the host goes.  One that dies is
 * started again, on the same wires; one that dies too often is an error.
 *
 * Memory: 24 bytes a node; both ends of every wire, for nodes that start again.
 * Work: a fork and an exec a start of a node.
 *
 *     if (host_cluster_start(&cluster, &options, &error) != 0)
 *         return error.code;
 *     machine = host_cluster_machine(&cluster);
 *     host_cluster_stop(&cluster); // or the machine's own stop
 */
#ifndef HOST_CLUSTER_H
#define HOST_CLUSTER_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

#include "child.h"
#include "host/base/error.h"
#include "host/service/machine.h"
#include "port.h"
#include "trouble.h"
#include "wires.h"

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

/* Starts nodes again that have died.  0, or HOST_CUBE for one that does so too
 * often: child.h. */
int host_cluster_check(struct host_cluster *cluster, struct host_error *error);

/* Whether every node has ended, however it did.  From here on none is started
 * again. */
bool host_cluster_ended(struct host_cluster *cluster);

/* Ends what still runs and waits for it.  Also after a failed start. */
void host_cluster_stop(struct host_cluster *cluster);

#endif
