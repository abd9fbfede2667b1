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
 * that question of node/message.h, byte for byte; a node that has not
 * answered in two seconds is left out.  WHAT: "who", "links", "top", "memory",
 * "totals", "log".
 *
 * Memory: a KB for each watcher, and an answer of up to 2.1 KB a node.  Work: a
 * system call every 50 ms; with a watcher also a message to each node asked
 * for, and its answer. */
#ifndef HOST_LOOK_H
#define HOST_LOOK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/un.h>

#include "host/base/error.h"
#include "host/base/node_set.h"
#include "node/message.h"

/* Who has a wire on this machine. */

enum {
    HOST_WIRE_NAME = 4400, /* bytes of a wire's name: KIND:PATH */
    HOST_HOLDER_TEXT = 320
};

struct host_holder {
    pid_t pid; /* 0: not known, it takes no calls */
    uid_t uid;
    char user[40];     /* its name, or number */
    char command[200]; /* line, printable, as much of it as fits */
    int64_t since_s;   /* of the epoch, when it began; 0: not known */
};

/* The program that is using a wire.  False: none, this process, or one that is
 * not believed. */
bool host_holder_find(struct host_holder *holder, const char *wire);

/* "incode run bunny.xyz --cube lab.cube, process 4711 of alice, since 19:02" */
const char *host_holder_text(const struct host_holder *holder, char *text,
                             size_t size);

/* For look.h and offer.h: the meeting place of a wire, and the process at the
 * other end of a socket there. */
socklen_t host_holder_address(const char *wire, struct sockaddr_un *address);

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

/* What those who watch may ask, as look.h names it. */

/* Of a question's line, every second node of the largest cube named. */
enum { HOST_LOOK_QUESTION_BYTES = 4096 };

/* 0: no question by that name, or of NULL; NULL: it is not to be asked. */
enum node_question host_look_question(const char *name);
const char *host_look_name(enum node_question what);

#endif
