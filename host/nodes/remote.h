/* A cube of real nodes, wired as a cube file says.  Nodes that the file lists
 * under `start` the host starts on this machine, and again when they die; the
 * others are there already, or come.
 *
 * Memory: two ports, and 24 bytes a node. */
#ifndef HOST_REMOTE_H
#define HOST_REMOTE_H

#include "port.h"
#include "cube_file.h"
#include "host/watch/offer.h"

enum { HOST_ABSENT_MIN_S = 3 };

enum { HOST_REMOTE_WHERE = 1024 };

struct host_remote {
    const struct host_cube_file *file;
    const char *program;
    unsigned ports;
    struct host_port port[HOST_PORTS_MAX];
    struct host_console console[HOST_PORTS_MAX]; /* of bare boards there */
    struct secure_ends ends[HOST_PORTS_MAX];     /* of their wires */
    struct host_process process[HOST_NODES_MAX]; /* of those started here */
    unsigned restarts;
    struct host_offer offer;       /* of a look at it */
    char where[HOST_REMOTE_WHERE]; /* "--cube FILE" */
};

/* What the first node of those that the host starts runs on; NULL: there is
 * none. */
const struct host_board *host_remote_started(const struct host_cube_file *file);

/* The program of those: the one given, or where that is NULL the board's own,
 * beside this one.  Empty where there are none. */
int host_remote_program(const struct host_cube_file *file, const char *given,
                        char *path, size_t size, struct host_error *error);

/* program: of a node, for those that are started here. */
int host_remote_start(struct host_remote *remote,
                      const struct host_cube_file *file, const char *program,
                      struct host_error *error);

struct host_machine host_remote_machine(struct host_remote *remote);

/* The name of the host's first wire, by which look.h finds who has it. */
void host_remote_wire(const struct host_cube_file *file,
                      char name[HOST_WIRE_NAME]);

/* Waits for the end of the program of this machine that has that wire; beside
 * it there would be no answers, or mixed ones.  0, or HOST_CUBE: it has it
 * still. */
int host_remote_free(const struct host_cube_file *file, uint64_t wait_us,
                     struct host_error *error);

/* Ends the nodes that were started here, and closes the host's wires. */
void host_remote_stop(struct host_remote *remote);

#endif
