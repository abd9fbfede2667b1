/* The host's end of a wire, whatever its kind: a connected socket, a serial
 * port that may vanish and come back, or a call over TCP that is made again
 * when it breaks. */
#ifndef HOST_PORT_H
#define HOST_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "host/base/error.h"
#include "transport/link.h"
#include "transport/drivers/tcp.h"
#include "transport/cube.h"
#include "transport/drivers/serial_port.h"
#include "transport/drivers/tcp_wire.h"

/* Nodes as children of this process, which end when it does.  One that dies may
 * be started again, but not for ever.
 *
 * Work: a fork, and a wait until the child's program has begun; a system call
 * a look. */

enum { HOST_FAULTS_MAX = 3, HOST_DEATHS_MAX = 10, HOST_DEATHS_US = 10000000 };

struct host_process {
    pid_t pid;          /* 0: it does not run */
    int status;         /* as waitpid gave it, of the last that died */
    unsigned faults;    /* times that it ended without being killed */
    unsigned deaths;    /* times that it ended since... */
    uint64_t deaths_us; /* ...this time */
};

struct host_child {
    unsigned node;
    const char *path;      /* its program, for messages */
    const char *otherwise; /* what to do where there is no process for it */
    /* In the child, whose standard input and output are nothing: becomes the
     * program.  Returns where that fails, with errno. */
    void (*become)(const void *context, unsigned node);
    const void *context;
};

/* 0, or HOST_CUBE, HOST_BROKEN: it has not begun. */
int host_child_start(struct host_process *process,
                     const struct host_child *child, struct host_error *error);

/* Whether any child has ended that nobody has asked for. */
bool host_child_any_died(void);

/* Whether it ran and has ended. */
bool host_child_died(struct host_process *process);

/* After that.  0, or HOST_CUBE where it has done so too often: HOST_FAULTS_MAX
 * times by itself, or HOST_DEATHS_MAX times within HOST_DEATHS_US however it
 * came.  link: by which the node is reached, for the message. */
int host_child_check(struct host_process *process, unsigned node, unsigned link,
                     struct host_error *error);

/* Ends it if it runs, which host_child_died finds; false: it does not. */
bool host_child_kill(const struct host_process *process);

/* Microseconds that it was kept waiting for a processor since its start; 0: the
 * kernel does not say. */
uint64_t host_child_starved_us(const struct host_process *process);

/* Waits for the end of one that was killed. */
void host_child_wait(struct host_process *process);

/* What a bare board's console says, among the frames of a wire or alone: a
 * record is a zero, 0xFF, a text and a zero, which is no frame, so that the
 * link above passes over it.  A report of a fault is said on standard error,
 * and kept for who asks why a node is not heard. */

enum { HOST_CONSOLE_TEXT = 640 }; /* of a record, at most */

struct host_console {
    unsigned node;
    const char *board;
    enum { HOST_CONSOLE_OTHER, HOST_CONSOLE_ZERO, HOST_CONSOLE_RECORD } at;
    size_t used;
    char text[HOST_CONSOLE_TEXT + 1];
    char fault[HOST_CONSOLE_TEXT + 1]; /* what happened last; "" */
    unsigned faults;                   /* so far */
    struct link_pipe beneath;
};

void host_console_init(struct host_console *console, unsigned node,
                       const char *board);

void host_console_hear(struct host_console *console, const uint8_t *bytes,
                       size_t size);

/* A pipe as it is, but that what it brings is heard. */
struct link_pipe host_console_pipe(struct host_console *console,
                                   struct link_pipe beneath);

/* The last fault that the board reported, one printable line; NULL: none. */
const char *host_console_fault(const struct host_console *console);

/* Where a host with a port is, as a user writes it: "name:7001",
 * "10.0.0.7:7001" or "[2001:db8::7]:7001". */

/* 0, or the code of the error that it is, and why: "WHAT; WHAT TO DO NEXT".
 * HOST_INPUT: it is not written so; HOST_CUBE: the name is not found. */
int host_resolve(const char *text, struct tcp_address *address, char *why,
                 size_t size);

enum host_port_kind {
    HOST_PORT_NONE,
    HOST_PORT_SOCKET,
    HOST_PORT_SERIAL,
    HOST_PORT_NET
};

enum { HOST_PORTS_MAX = 2 /* of the host to a cube of a cube file */ };

struct host_port {
    enum host_port_kind kind;
    struct tcp_pipe tcp; /* its socket is the port's */
    struct serial_port serial;
    struct tcp_wire net;
    /* For tests: the port is closed after it was open so long, and opened when
     * it is next looked for. */
    uint64_t unplug_us, unplugged_us;
};

/* Takes a connected socket; -1: none. */
void host_port_socket(struct host_port *port, int fd);

/* Opens a serial port: 0, or HOST_CUBE. */
int host_port_serial(struct host_port *port,
                     const struct serial_port_settings *settings,
                     struct host_error *error);

/* Calls a node: 0, or HOST_CUBE.  The node may come later. */
int host_port_net(struct host_port *port, const struct tcp_wire_config *config,
                  struct host_error *error);

struct link_pipe host_port_pipe(struct host_port *port);

/* Sleeps until one of the ports has bytes, or room for them where there was
 * none, but no longer than wait_us.  At most CUBE_HOST_PORTS_MAX ports. */
void host_port_idle(struct host_port *ports, unsigned count, uint64_t wait_us);

/* Where the other end is in use: leaves it alone for a time, if it can be
 * called again then. */
void host_port_rest(struct host_port *port, uint64_t rest_us);

/* Why nobody is reached by it now, as errno has it; 0: that is not known. */
int host_port_fault(const struct host_port *port);

/* Why what was last reached by it is not the node, as tcp_wire_doubt. */
struct tcp_wire_doubt host_port_doubt(const struct host_port *port);

void host_port_close(struct host_port *port);

#endif
