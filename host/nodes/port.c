#include "port.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/error.h"
#include "node/board.h"
#include "host/base/progress.h"
#include "host/base/text.h"
#include "transport/drivers/unix_file.h"

/* Ends with the reason in `report`, which a program that begins closes. */
static _Noreturn void become(const struct host_child *child, pid_t host,
                             int report) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    (void)setpgid(0, 0);     /* an interrupt from the terminal is the host's */
    if (getppid() == host) { /* else it ended before it could be watched */
        int null = open("/dev/null", O_RDWR | O_CLOEXEC);
        dup2(null, STDIN_FILENO);
        dup2(null, STDOUT_FILENO);
        child->become(child->context, child->node);
        int reason = errno;
        (void)!write(report, &reason, sizeof reason);
    }
    _exit(127);
}

int host_child_start(struct host_process *process,
                     const struct host_child *child, struct host_error *error) {
    int report[2], reason = 0;
    if (pipe2(report, O_CLOEXEC) != 0) {
        return host_fail(error, HOST_BROKEN, "node %u: %s; close some files",
                         child->node, strerror(errno));
    }
    pid_t host = getpid(), started = fork();
    if (started == 0)
        become(child, host, report[1]);
    reason = errno;
    close(report[1]);
    if (started < 0) {
        close(report[0]);
        return host_fail(error, HOST_CUBE, "node %u: %s; %s", child->node,
                         strerror(reason), child->otherwise);
    }
    process->pid = started;
    ssize_t got;
    do {
        got = read(report[0], &reason, sizeof reason);
    } while (got < 0 && errno == EINTR);
    close(report[0]);
    if (got == (ssize_t)sizeof reason) {
        return host_fail(error, HOST_CUBE,
                         "node %u: %s: %s; run make to build it anew",
                         child->node, child->path, strerror(reason));
    }
    return 0;
}

/* --- its end -------------------------------------------------------------- */

static bool reap(struct host_process *process, int flags) {
    int status;
    if (process->pid == 0 ||
        waitpid(process->pid, &status, flags) != process->pid)
        return false;
    process->pid = 0;
    process->status = status;
    return true;
}

bool host_child_any_died(void) {
    siginfo_t who = {0};
    return waitid(P_ALL, 0, &who, WEXITED | WNOHANG | WNOWAIT) != 0 ||
           who.si_pid != 0;
}

bool host_child_died(struct host_process *process) {
    return reap(process, WNOHANG);
}

bool host_child_kill(const struct host_process *process) {
    return process->pid != 0 && kill(process->pid, SIGKILL) == 0;
}

void host_child_wait(struct host_process *process) {
    (void)reap(process, 0);
}

static int describe(const struct host_process *process, unsigned node,
                    unsigned link, struct host_error *error) {
    int status = process->status;
    if (WIFSIGNALED(status)) {
        int number = WTERMSIG(status);
        return host_fail(
            error, HOST_CUBE,
            "node %u link %u: ended %u times, the last by signal %d (%s)%s; "
            "run again, and look for what stopped it",
            node, link, process->deaths, number, strsignal(number),
            number == SIGILL    ? ", an invariant failed"
            : number == SIGSEGV ? ", perhaps out of its memory"
                                : "");
    }
    return host_fail(error, HOST_CUBE,
                     "node %u link %u: ended %u times, the last with status "
                     "%d; see what it printed, and run again",
                     node, link, process->deaths, WEXITSTATUS(status));
}

/* What kills from without may stop; a node that ends by itself would do so
 * again. */
int host_child_check(struct host_process *process, unsigned node, unsigned link,
                     struct host_error *error) {
    uint64_t now = host_now_us();
    int status = process->status;
    bool killed = WIFSIGNALED(status) &&
                  (WTERMSIG(status) == SIGKILL || WTERMSIG(status) == SIGTERM);
    bool told = WIFEXITED(status) && (WEXITSTATUS(status) == NODE_RESET_AGAIN ||
                                      WEXITSTATUS(status) == NODE_RESET_STAY);
    if (now - process->deaths_us > HOST_DEATHS_US) {
        process->deaths = process->faults;
        process->deaths_us = now;
    }
    process->deaths++;
    process->faults += !killed && !told;
    return process->faults < HOST_FAULTS_MAX &&
                   process->deaths < HOST_DEATHS_MAX
               ? 0
               : describe(process, node, link, error);
}

uint64_t host_child_starved_us(const struct host_process *process) {
    char path[64];
    unsigned long long ran_ns, waited_ns = 0;
    snprintf(path, sizeof path, "/proc/%ld/schedstat", (long)process->pid);
    FILE *file = process->pid > 0 ? fopen(path, "re") : NULL;
    if (file != NULL) {
        int read = fscanf(file, "%llu %llu", &ran_ns, &waited_ns);
        waited_ns = read == 2 ? waited_ns : 0;
        fclose(file);
    }
    return waited_ns / 1000;
}

/* --- console -------------------------------------------------------------- */

enum { RECORD = 0xff };

/* Between what happened and the registers, in every board's report of a fault
 * (boards/bare/fault_text.c). */
#define RESTARTING "; restarting"

void host_console_init(struct host_console *console, unsigned node,
                       const char *board) {
    memset(console, 0, sizeof *console);
    console->node = node;
    console->board = board;
}

/* A record is whole.  Of a report its board's name is left out: here it has a
 * number, too. */
static void take(struct host_console *c) {
    char before[48];
    c->used -= c->used > 0 && c->text[c->used - 1] == ' ';
    c->text[c->used] = '\0';
    char *rest = strstr(c->text, RESTARTING);
    if (rest == NULL)
        return;
    *rest = '\0';
    rest += strlen(RESTARTING);
    int length = snprintf(before, sizeof before, "incode: %s: ", c->board);
    bool named = strncmp(c->text, before, (size_t)length) == 0;
    snprintf(c->fault, sizeof c->fault, "%s", c->text + (named ? length : 0));
    c->faults++;
    host_note("node %u (%s): its report of a fault: %s,%s; it starts again",
              c->node, c->board, c->fault, rest);
}

/* A byte that no text has makes a frame of a record. */
static void hear(struct host_console *c, uint8_t byte) {
    bool blank = byte == '\n' || byte == '\r' || byte == '\t' || byte == ' ';
    if (byte == 0) {
        if (c->at == HOST_CONSOLE_RECORD && c->used > 0)
            take(c);
        c->at = HOST_CONSOLE_ZERO;
    } else if (c->at == HOST_CONSOLE_ZERO) {
        c->at = byte == RECORD ? HOST_CONSOLE_RECORD : HOST_CONSOLE_OTHER;
        c->used = 0;
    } else if (c->at == HOST_CONSOLE_RECORD) {
        if (!blank && (byte < ' ' || byte > '~'))
            c->at = HOST_CONSOLE_OTHER;
        else if (c->used < HOST_CONSOLE_TEXT && (!blank || c->used > 0) &&
                 (!blank || c->text[c->used - 1] != ' '))
            c->text[c->used++] = blank ? ' ' : (char)byte;
    }
}

void host_console_hear(struct host_console *console, const uint8_t *bytes,
                       size_t size) {
    for (size_t i = 0; i < size; i++)
        hear(console, bytes[i]);
}

static int pipe_send(void *context, const uint8_t *bytes, size_t size) {
    const struct host_console *c = context;
    return c->beneath.send(c->beneath.context, bytes, size);
}

static int pipe_receive(void *context, uint8_t *bytes, size_t size) {
    struct host_console *c = context;
    int got = c->beneath.receive(c->beneath.context, bytes, size);
    if (got > 0)
        host_console_hear(c, bytes, (size_t)got);
    return got;
}

struct link_pipe host_console_pipe(struct host_console *console,
                                   struct link_pipe beneath) {
    console->beneath = beneath;
    return (struct link_pipe){console, pipe_send, pipe_receive};
}

const char *host_console_fault(const struct host_console *console) {
    return console->faults == 0 ? NULL : console->fault;
}

/* --- resolve -------------------------------------------------------------- */

int host_resolve(const char *text, struct tcp_address *address, char *why,
                 size_t size) {
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM}, *found = NULL;
    char host[256];
    const char *colon = strrchr(text, ':');
    uint64_t port = 0;
    if (tcp_address_parse(address, text) == 0)
        return 0;
    if (colon == NULL || (size_t)(colon - text) >= sizeof host ||
        host_parse_number(colon + 1, 1, 65535, &port) != 0) {
        snprintf(why, size,
                 "not a host with a port; write \"name:7001\", "
                 "\"10.0.0.7:7001\" or \"[2001:db8::7]:7001\"");
        return HOST_INPUT;
    }
    snprintf(host, sizeof host, "%.*s", (int)(colon - text), text);
    int status = getaddrinfo(host, colon + 1, &hints, &found);
    if (status != 0) {
        snprintf(why, size, "host %s: %s; correct the name or give its address",
                 host, gai_strerror(status));
        return HOST_CUBE;
    }
    memcpy(&address->to, found->ai_addr, found->ai_addrlen);
    address->size = found->ai_addrlen;
    freeaddrinfo(found);
    return 0;
}

/* --- port ----------------------------------------------------------------- */

void host_port_socket(struct host_port *port, int fd) {
    memset(port, 0, sizeof *port);
    port->kind = fd < 0 ? HOST_PORT_NONE : HOST_PORT_SOCKET;
    tcp_pipe_init(&port->tcp, fd);
}

int host_port_serial(struct host_port *port,
                     const struct serial_port_settings *settings,
                     struct host_error *error) {
    memset(port, 0, sizeof *port);
    if (serial_port_open(&port->serial, settings) != 0)
        return host_fail(error, HOST_CUBE, "%s", port->serial.fault);
    port->kind = HOST_PORT_SERIAL;
    return 0;
}

int host_port_net(struct host_port *port, const struct tcp_wire_config *config,
                  struct host_error *error) {
    memset(port, 0, sizeof *port);
    if (tcp_wire_open(&port->net, config) != 0) {
        return host_fail(error, HOST_CUBE,
                         "the host's wire: %s; see incode cube FILE",
                         strerror(errno));
    }
    port->kind = HOST_PORT_NET;
    return 0;
}

struct link_pipe host_port_pipe(struct host_port *port) {
    return port->kind == HOST_PORT_SERIAL ? serial_link_pipe(&port->serial.pipe)
           : port->kind == HOST_PORT_NET  ? tcp_wire_pipe(&port->net)
                                          : tcp_link_pipe(&port->tcp);
}

static void unplug(struct host_port *port) {
    uint64_t now_us = host_now_us();
    if (port->unplugged_us == 0 || port->serial.pipe.fd < 0)
        port->unplugged_us = now_us;
    if (now_us - port->unplugged_us >= port->unplug_us) {
        port->unplugged_us = now_us;
        serial_close(port->serial.pipe.fd);
        port->serial.pipe.fd = -1;
        port->serial.pipe.closed = true;
        port->serial.look_us = now_us;
    }
}

/* Adds what to wait for: the number of entries. */
static unsigned add_events(const struct host_port *port, struct pollfd *fds) {
    switch (port->kind) {
    case HOST_PORT_NET:
        return tcp_wire_events(&port->net, fds);
    case HOST_PORT_SERIAL:
        fds->fd = port->serial.pipe.fd;
        fds->events = serial_events(&port->serial.pipe);
        return fds->events != 0 ? 1 : 0;
    case HOST_PORT_SOCKET:
        fds->fd = port->tcp.fd;
        fds->events = tcp_events(&port->tcp);
        return fds->events != 0 ? 1 : 0;
    default:
        return 0;
    }
}

void host_port_idle(struct host_port *ports, unsigned count, uint64_t wait_us) {
    struct pollfd fds[CUBE_HOST_PORTS_MAX * TCP_WIRE_FDS_MAX];
    nfds_t used = 0;
    for (unsigned i = 0; i < count; i++) {
        struct host_port *port = &ports[i];
        struct serial_pipe *pipe = &port->serial.pipe;
        bool serial = port->kind == HOST_PORT_SERIAL;
        if (serial && serial_wait_us(pipe) < wait_us)
            wait_us = serial_wait_us(pipe);
        used += add_events(port, fds + used);
        if (serial && port->unplug_us != 0)
            unplug(port);
    }
    wait_files(fds, used, wait_us, 0);
}

void host_port_rest(struct host_port *port, uint64_t rest_us) {
    if (port->kind == HOST_PORT_NET)
        tcp_wire_rest(&port->net, rest_us);
}

int host_port_fault(const struct host_port *port) {
    return port->kind == HOST_PORT_NET && port->net.tcp.fd < 0 ? port->net.fault
                                                               : 0;
}

struct tcp_wire_doubt host_port_doubt(const struct host_port *port) {
    return port->kind == HOST_PORT_NET ? tcp_wire_doubt(&port->net)
                                       : (struct tcp_wire_doubt){NULL, NULL};
}

void host_port_close(struct host_port *port) {
    if (port->kind == HOST_PORT_SERIAL) {
        serial_port_close(&port->serial);
    } else if (port->kind == HOST_PORT_SOCKET) {
        close(port->tcp.fd);
        port->tcp.closed = true;
    } else if (port->kind == HOST_PORT_NET) {
        tcp_wire_close(&port->net);
    }
    port->kind = HOST_PORT_NONE;
}
