#include "remote.h"

#include <ctype.h>
#include <errno.h>
#include <limits.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#include "host/base/error.h"
#include "host/base/progress.h"
#include "host/base/text.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/drivers/unix_file.h"

/* In the child: becomes the node. */
static void become_node(const void *context, unsigned node) {
    static char options[HOST_NODE_OPTIONS_MAX][HOST_NODE_OPTION_BYTES];
    static char name[HOST_NODE_OPTION_BYTES];
    const struct host_remote *r = context;
    char *argv[HOST_NODE_OPTIONS_MAX + 2] = {name};
    char *no_environment[] = {NULL};
    unsigned count = host_cube_node_options(r->file, node, options);
    snprintf(name, sizeof name, "%s", r->file->board_of[node]->program);
    for (unsigned i = 0; i < count; i++)
        argv[1 + i] = options[i];
    execve(r->program, argv, no_environment);
}

static int start_node(struct host_remote *r, unsigned node,
                      struct host_error *error) {
    const struct host_child child = {node, r->program,
                                     "start it yourself and take it from start",
                                     become_node, r};
    return host_child_start(&r->process[node], &child, error);
}

static int open_port(struct host_remote *r, const struct host_cube_wire *wire,
                     struct host_error *error) {
    const struct host_cube_file *file = r->file;
    struct host_port *port = &r->port[r->ports];
    r->ends[r->ports] = (struct secure_ends){
        {CUBE_HOST, (uint8_t)r->ports}, {wire->node, (uint8_t)file->dimension}};
    if (wire->serial) {
        struct serial_port_settings s = {.baud = wire->baud,
                                         .rts_cts = wire->rts_cts,
                                         .dtr = !wire->dtr_low,
                                         .rts = !wire->rts_low};
        memcpy(s.name, wire->device[1], sizeof s.name);
        if (host_port_serial(port, &s, error) != 0)
            return error->code;
    } else {
        struct tcp_wire_config config = {.address = wire->via};
        config.ends = &r->ends[r->ports];
        config.insecure = wire->insecure;
        config.key = wire->insecure ? NULL : file->key;
        config.suite = wire->insecure ? NULL : &secure_sodium;
        if (wire->insecure && wire->line != 0) { /* else it was just said */
            char name[160];
            host_cube_name_wire(file, wire, name);
            host_note("%s is insecure: whoever reaches its address can take it "
                      "over, and send false results; make a key with: incode "
                      "key FILE",
                      name);
        }
        if (host_port_net(port, &config, error) != 0)
            return error->code;
    }
    r->ports++;
    return 0;
}

const struct host_board *
host_remote_started(const struct host_cube_file *file) {
    for (unsigned i = 0; i < file->nodes; i++)
        if (file->local[i])
            return file->board_of[i];
    return NULL;
}

int host_remote_program(const struct host_cube_file *file, const char *given,
                        char *path, size_t size, struct host_error *error) {
    const struct host_board *board = host_remote_started(file);
    path[0] = '\0';
    return board == NULL
               ? 0
               : host_cluster_program(given, board->program, path, size, error);
}

/* What stands for a file's name is such words already. */
static void tell_where(const struct host_cube_file *file, char *where) {
    static const char option[] = "--cube ";
    enum { HEAD = sizeof option - 1 };
    memcpy(where, option, sizeof option);
    if (strncmp(file->path, "--", 2) == 0)
        snprintf(where, HOST_REMOTE_WHERE, "%s", file->path);
    else if (host_text_quote(where + HEAD, HOST_REMOTE_WHERE - HEAD,
                             file->path) != 0)
        snprintf(where + HEAD, HOST_REMOTE_WHERE - HEAD, "FILE");
}

int host_remote_start(struct host_remote *remote,
                      const struct host_cube_file *file, const char *program,
                      struct host_error *error) {
    char wire[HOST_WIRE_NAME];
    if (sodium_init() < 0) { /* the fastest code for this processor */
        return host_fail(error, HOST_BROKEN,
                         "libsodium does not start; install it anew");
    }
    memset(remote, 0, sizeof *remote);
    remote->file = file;
    remote->program = program;
    tell_where(file, remote->where);
    host_remote_wire(file, wire);
    host_offer_begin(&remote->offer, wire);
    int status = host_remote_free(file, 0, error);
    for (unsigned i = 0; i < file->nodes && status == 0; i++)
        if (file->local[i])
            status = start_node(remote, i, error);
    for (unsigned k = 0; k < HOST_PORTS_MAX && status == 0; k++)
        if (host_cube_host_wire(file, k) != NULL)
            status = open_port(remote, host_cube_host_wire(file, k), error);
    if (status != 0)
        host_remote_stop(remote);
    return status;
}

enum { PATH_BYTES = PATH_MAX + SERIAL_NAME_MAX + 1, LOOK_AGAIN_US = 50000 };

/* What is there, by whatever name it is called; of a socket that is not there
 * yet, its folder. */
static void put_path(const char *path, char *name) {
    char folder[PATH_MAX], real[PATH_MAX];
    const char *slash = strrchr(path, '/');
    size_t size = slash == NULL ? 0 : (size_t)(slash - path);
    snprintf(folder, sizeof folder, "%.*s", size == 0 ? 1 : (int)size,
             slash == NULL ? "." : path);
    if (realpath(path, real) != NULL) {
        snprintf(name, PATH_BYTES, "%s", real);
    } else if (realpath(folder, real) != NULL) {
        snprintf(name, PATH_BYTES, "%s/%s", real,
                 slash == NULL ? path : slash + 1);
    } else {
        snprintf(name, PATH_BYTES, "%s", path);
    }
}

void host_remote_wire(const struct host_cube_file *file,
                      char name[HOST_WIRE_NAME]) {
    const struct host_cube_wire *wire = host_cube_host_wire(file, 0);
    char path[PATH_BYTES], text[SERIAL_NAME_MAX];
    const char *socket = wire == NULL ? NULL : tcp_address_path(&wire->via);
    name[0] = '\0';
    if (wire == NULL)
        return;
    if (wire->serial || socket != NULL) {
        put_path(wire->serial ? wire->device[1] : socket, path);
        snprintf(name, HOST_WIRE_NAME, "%s:%s",
                 wire->serial ? "serial" : "unix", path);
    } else {
        snprintf(name, HOST_WIRE_NAME, "tcp:%s",
                 host_cube_wire_name(wire, text, sizeof text));
    }
}

int host_remote_free(const struct host_cube_file *file, uint64_t wait_us,
                     struct host_error *error) {
    char wire[HOST_WIRE_NAME], text[HOST_HOLDER_TEXT], where[HOST_REMOTE_WHERE];
    struct host_holder holder;
    uint64_t begun_us = host_now_us();
    bool told = false;
    host_remote_wire(file, wire);
    const char *name = strchr(wire, ':');
    while (name != NULL && host_holder_find(&holder, wire)) {
        (void)host_holder_text(&holder, text, sizeof text);
        if (host_now_us() - begun_us >= wait_us) {
            tell_where(file, where);
            return host_fail(error, HOST_CUBE,
                             "%s: in use by %s; wait until it has ended, or "
                             "end it; look on meanwhile with: incode console "
                             "%s",
                             name + 1, text, where);
        }
        if (!told) {
            host_note("%s: in use by %s; waits for its end, %llu s at most",
                      name + 1, text, (unsigned long long)wait_us / 1000000);
            told = true;
        }
        (void)usleep(LOOK_AGAIN_US);
    }
    return 0;
}

void host_remote_stop(struct host_remote *remote) {
    host_offer_end(&remote->offer);
    for (unsigned i = 0; i < remote->file->nodes; i++) {
        (void)host_child_kill(&remote->process[i]);
        host_child_wait(&remote->process[i]);
    }
    for (unsigned i = 0; i < remote->file->wires; i++) {
        const struct host_cube_wire *wire = &remote->file->wire[i];
        if (remote->file->local[wire->node] &&
            tcp_address_path(&wire->at) != NULL)
            unix_file_remove(&wire->at);
    }
    while (remote->ports > 0)
        host_port_close(&remote->port[--remote->ports]);
}

/* --- as a machine --------------------------------------------------------- */

static uint64_t machine_now_us(void *context) {
    (void)context;
    return host_now_us();
}

static void machine_idle(void *context, uint64_t wait_us) {
    struct host_remote *r = context;
    host_port_idle(r->port, r->ports, wait_us);
}

static int machine_check(void *context, struct host_error *error) {
    struct host_remote *r = context;
    if (!host_child_any_died())
        return 0;
    for (unsigned i = 0; i < r->file->nodes; i++) {
        unsigned link = host_link_to(i, 0, r->file->dimension);
        if (!host_child_died(&r->process[i]))
            continue;
        if (host_child_check(&r->process[i], i, link, error) != 0 ||
            start_node(r, i, error) != 0)
            return error->code;
        r->restarts++;
    }
    return 0;
}

static unsigned machine_restarts(void *context) {
    return ((struct host_remote *)context)->restarts;
}

static uint64_t machine_starved_us(void *context, unsigned node) {
    const struct host_remote *r = context;
    return host_child_starved_us(&r->process[node]);
}

static bool machine_kill(void *context, unsigned node) {
    const struct host_remote *r = context;
    return host_child_kill(&r->process[node]);
}

/* Which of the host's own wires leads to the node; -1: none. */
static int port_to(const struct host_remote *r, unsigned node) {
    for (unsigned i = 0; i < r->ports; i++)
        if (host_cube_host_wire(r->file, i)->node == node)
            return (int)i;
    return -1;
}

static const char *machine_doubt(void *context, unsigned node) {
    static char text[TCP_PATH_MAX + 160];
    const struct host_remote *r = context;
    int port = port_to(r, node);
    if (port < 0)
        return NULL;
    int fault = host_port_fault(&r->port[port]);
    struct tcp_wire_doubt doubt = host_port_doubt(&r->port[port]);
    if (doubt.what != NULL) {
        snprintf(text, sizeof text, "%s; %s", doubt.what, doubt.next);
        return text;
    }
    if (r->console[port].faults > 0) {
        snprintf(text, sizeof text, "its console says: %.100s",
                 r->console[port].fault);
        return text;
    }
    const struct host_cube_wire *wire =
        host_cube_host_wire(r->file, (unsigned)port);
    const char *path = tcp_address_path(&wire->via);
    if (fault == EACCES && path != NULL) {
        snprintf(text, sizeof text,
                 "no permission to use the socket %s; let this user write to "
                 "it, and enter its folders, or be the user who started the "
                 "node",
                 path);
        return text;
    }
    snprintf(text, sizeof text, "%s", fault == 0 ? "" : strerror(fault));
    text[0] = (char)tolower((unsigned char)text[0]);
    return fault == 0 ? NULL : text;
}

static const char *machine_start_line(void *context, unsigned node) {
    static char line[1600];
    const struct host_remote *r = context;
    return r->file->local[node]
               ? NULL
               : host_cube_start_line(r->file, node, line, sizeof line);
}

static const char *machine_address(void *context, unsigned node) {
    static char name[SERIAL_NAME_MAX];
    const struct host_remote *r = context;
    int port = port_to(r, node);
    return port < 0 ? NULL
                    : host_cube_wire_name(
                          host_cube_host_wire(r->file, (unsigned)port), name,
                          sizeof name);
}

static void machine_rest(void *context, uint64_t rest_us) {
    struct host_remote *r = context;
    for (unsigned i = 0; i < r->ports; i++)
        host_port_rest(&r->port[i], rest_us);
}

/* Nothing tells of nodes elsewhere, and those here begin anew. */
static bool machine_ended(void *context) {
    (void)context;
    return true;
}

static void machine_stop(void *context) {
    host_remote_stop(context);
}

/* A node that starts again may need a moment to find its neighbours. */
static uint8_t absent_s(const struct host_cube_file *file) {
    unsigned s = file->dead_s;
    return (uint8_t)(s == 0                  ? 0
                     : s < HOST_ABSENT_MIN_S ? HOST_ABSENT_MIN_S
                     : s > UINT8_MAX         ? UINT8_MAX
                                             : s);
}

/* A bare board's console shares its wire; what is at one that no file names is
 * not known. */
static struct link_pipe pipe_of(struct host_remote *r, unsigned port) {
    const struct host_cube_wire *wire = host_cube_host_wire(r->file, port);
    unsigned node = wire->node;
    struct link_pipe pipe = host_port_pipe(&r->port[port]);
    if (!host_cube_is_bare(r->file, node) && wire->line != 0)
        return pipe;
    host_console_init(&r->console[port], node, r->file->board_of[node]->name);
    return host_console_pipe(&r->console[port], pipe);
}

struct host_machine host_remote_machine(struct host_remote *remote) {
    const struct host_cube_wire *second = host_cube_host_wire(remote->file, 1);
    struct host_machine machine;
    memset(&machine, 0, sizeof machine);
    machine.context = remote;
    machine.nodes = remote->file->nodes;
    machine.dimension = remote->file->dimension;
    machine.serial_baud = remote->file->serial_baud;
    machine.absent_s = absent_s(remote->file);
    while (machine.epoch == 0)
        (void)!getrandom(&machine.epoch, sizeof machine.epoch, 0);
    machine.pipe = pipe_of(remote, 0);
    if (second != NULL) {
        machine.spare_node = second->node;
        machine.spare = pipe_of(remote, 1);
    }
    machine.now_us = machine_now_us;
    machine.idle = machine_idle;
    machine.check = machine_check;
    /* Without them, nodes are waited for as patiently as the user wants. */
    bool all_here = true;
    for (unsigned i = 0; i < machine.nodes; i++) {
        machine.slow = machine.slow || host_cube_is_bare(remote->file, i);
        all_here = all_here && remote->file->local[i];
    }
    machine.restarts = all_here ? machine_restarts : NULL;
    machine.starved_us = machine_starved_us;
    machine.kill = machine_kill;
    machine.where = remote->where;
    machine.keyed = remote->file->has_key;
    machine.doubt = machine_doubt;
    machine.start_line = machine_start_line;
    machine.address = machine_address;
    machine.rest = machine_rest;
    machine.ended = machine_ended;
    machine.stop = machine_stop;
    host_offer_machine(&remote->offer, &machine);
    machine.watchers = &remote->offer.watchers;
    return machine;
}
