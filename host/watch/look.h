/* Watches a cube that another program of this machine is using: a run, a
 * console or a transfer.  That program is found by the name of the host's first
 * wire.  A command that finds a wire in use learns which program is using it.
 * Programs of the same user, or of root, up to four at once, may also request
 * the nodes' answers; they change nothing.
 *
 * The meeting place is an abstract socket: it needs no file, and is gone with
 * its process however that ends.  Other users see it, and the kernel tells them
 * whose process listens.  The program answers only root and its own user.  A
 * watcher believes only root and its own user; root also believes another
 * user's process that has the wire open.
 *
 * A line of JSON each.  Unasked, first: {"incode": VERSION, "protocol":
 * NODE_PROTOCOL, "nodes": N, "dimension": D, "serial_baud": B}, or {"error":
 * "WHAT; NEXT"}.  Then {"ask": WHAT, "nodes": SET} is
 * answered by {"ask": WHAT, "committed": bricks, "bricks": of so many,
 * "tetrahedra": so far, "answers": {"0": HEX, ..}}: what each node answered to
 * that question of node/questions.h, byte for byte; a node that has not
 * answered in two seconds is left out.  WHAT: "who", "links", "top", "memory",
 * "totals", "log".
 *
 * Memory: a KB for each watcher, and an answer of up to 2.1 KB a node.  Work: a
 * system call every 50 ms; with a watcher also a message to each node asked
 * for, and its answer.
 *
 *     struct host_look look;
 *     if (host_look_open(&look, "serial:/dev/ttyUSB0", &error) != 0 ||
 *         host_look_ask(&look, &set, NODE_TOP, 3000000, &error) != 0)
 *         return error.code;
 *     memcpy(&top, look.node[3].answer, look.node[3].size);
 *     host_look_close(&look);
 */
#ifndef HOST_LOOK_H
#define HOST_LOOK_H

#include "holder.h"
#include "host/base/node_set.h"
#include "node/questions.h"

enum { HOST_LOOKERS_MAX = 4 };

/* A node's answer to the last question. */
struct host_look_node {
    bool answered;
    size_t size;
    uint8_t *answer; /* CUBE_PAYLOAD_MAX bytes of room */
};

struct host_look {
    struct host_holder holder; /* of the cube */
    unsigned nodes, dimension;
    uint32_t serial_baud; /* of the slowest serial wire; 0: there is none */
    struct host_look_node *node; /* [nodes] */
    /* Of a run, as of the last question; all 0: there is none. */
    uint64_t committed, bricks, tetrahedra;
    /* Private. */
    int file;
    char *line;
    size_t used, room;
    uint8_t *answers;
};

/* wire: its name, as host_remote_wire has it (host/nodes/remote.h).  0, or
 * HOST_CUBE: nobody on this machine has it, or who has it lets nobody look. */
int host_look_open(struct host_look *look, const char *wire,
                   struct host_error *error);

/* Asks the set: 0, and node[i].answered tells; or HOST_CUBE: the other program
 * has ended, or not answered in wait_us.  Nothing but host_look_close then. */
int host_look_ask(struct host_look *look, const struct host_node_set *set,
                  enum node_question what, uint64_t wait_us,
                  struct host_error *error);

/* After host_look_open, whatever that returned. */
void host_look_close(struct host_look *look);

#endif
