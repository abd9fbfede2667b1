#include "cluster.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "transport/drivers/serial.h"
#include "transport/drivers/tcp.h"
#include "transport/drivers/unix_file.h"
#include "host/base/error.h"
#include "host/base/parallel.h"
#include "boards/processor/processor.h"

static const struct host_link rows[] = {
    {.name = "tcp",
     .help = "connected sockets",
     .pair = tcp_pair,
     .needs = "loopback connections"},
    {.name = "serial",
     .help = "pseudo-terminals",
     .pair = serial_pair,
     .needs = "pseudo-terminals",
     .terminals = true},
    {.name = "mpi",
     .help = "ranks of Open MPI, also under mpirun",
     .ranks = true},
};

/* What cube files and boards have besides. */
static const struct host_link of_files[] = {
    {.name = "unix", .help = "sockets with a path"},
    {.name = "mixed", .help = "wires of several kinds"},
    {.name = "uart",
     .help = "those of emulated boards",
     .pair = unix_file_pair,
     .needs = "socket pairs"},
};

const struct host_link *host_link_row(unsigned i) {
    return i < sizeof rows / sizeof rows[0] ? &rows[i] : NULL;
}

const char *host_link_name(unsigned i) {
    const struct host_link *link = host_link_row(i);
    return link == NULL ? NULL : link->name;
}

const struct host_link *host_link_named(const char *name) {
    const struct host_link *link;
    unsigned i;
    for (i = 0; (link = host_link_row(i)) != NULL; i++)
        if (strcmp(name, link->name) == 0)
            return link;
    for (i = 0; i < sizeof of_files / sizeof of_files[0]; i++)
        if (strcmp(name, of_files[i].name) == 0)
            return &of_files[i];
    return NULL;
}

/* --- trouble -------------------------------------------------------------- */

bool host_trouble_due(struct host_troubled *troubled, uint64_t now_us,
                      enum host_trouble_kind *kind, unsigned *node) {
    struct host_troubled *t = troubled;
    if (t->stopped && now_us - t->last_us[HOST_TROUBLE_STOP] >=
                          t->trouble.every_us[HOST_TROUBLE_STOP] / 2) {
        t->stopped = false;
        *kind = HOST_TROUBLE_CONT;
        *node = t->stopped_node;
        return true;
    }
    for (unsigned k = 0; k < HOST_TROUBLES; k++) {
        uint64_t every_us = t->trouble.every_us[k];
        if (t->last_us[k] == 0)
            t->last_us[k] = now_us;
        if (every_us == 0 || t->turn[k] == t->nodes ||
            now_us - t->last_us[k] < every_us)
            continue;
        t->last_us[k] = now_us;
        *kind = (enum host_trouble_kind)k;
        *node = t->turn[k]++;
        if (k == HOST_TROUBLE_STOP) {
            t->stopped = true;
            t->stopped_node = *node;
        }
        return true;
    }
    return false;
}

/* --- wires ---------------------------------------------------------------- */

static void close_end(int *end) {
    if (*end >= 0) {
        close(*end);
        *end = -1;
    }
}

static int make_between_nodes(struct host_wires *wires,
                              const struct host_link *link, unsigned nodes,
                              unsigned dimension, struct host_error *error) {
    int pair[2];
    for (unsigned i = 0; i < nodes; i++) {
        for (unsigned d = 0; d < dimension; d++) {
            unsigned other = i ^ 1u << d;
            if (other < i)
                continue;
            if (link->pair(pair) != 0) {
                return host_fail(error, HOST_CUBE,
                                 "wire between nodes %u and %u: %s; are %s "
                                 "and %u open files allowed?",
                                 i, other, strerror(errno), link->needs,
                                 nodes * (dimension + 1) + 16);
            }
            wires->end[i][d] = pair[0];
            wires->end[other][d] = pair[1];
        }
    }
    return 0;
}

static int make_to_host(struct host_wires *wires, const struct host_link *link,
                        unsigned dimension, unsigned node,
                        struct host_error *error) {
    int pair[2];
    if (link->pair(pair) != 0) {
        return host_fail(error, HOST_CUBE,
                         "wire between host and node %u: %s; are %s allowed?",
                         node, strerror(errno), link->needs);
    }
    wires->end[node][dimension] = pair[0];
    wires->host[node] = pair[1];
    if (node == 0 && link->terminals &&
        ttyname_r(pair[1], wires->host_path, sizeof wires->host_path) != 0) {
        return host_fail(error, HOST_CUBE,
                         "wire between host and node 0: a pseudo-terminal "
                         "without a name; is /dev/pts mounted?");
    }
    return 0;
}

int host_wires_make(struct host_wires *wires, const struct host_link *link,
                    unsigned nodes, unsigned dimension, unsigned host_ports,
                    struct host_error *error) {
    memset(wires, -1, sizeof *wires);
    wires->host_path[0] = '\0';
    int status = make_between_nodes(wires, link, nodes, dimension, error);
    for (unsigned i = 0; status == 0 && i < host_ports; i++)
        status = make_to_host(wires, link, dimension, i, error);
    if (status != 0)
        host_wires_close(wires);
    return status;
}

/* Closes the nodes' ends here, once the nodes have theirs. */
static void host_wires_close_nodes(struct host_wires *wires) {
    for (unsigned i = 0; i < HOST_PROCESSES_MAX; i++)
        for (unsigned d = 0; d < CUBE_LINKS_MAX; d++)
            close_end(&wires->end[i][d]);
}

void host_wires_close(struct host_wires *wires) {
    host_wires_close_nodes(wires);
    for (unsigned i = 0; i < CUBE_HOST_PORTS_MAX; i++)
        close_end(&wires->host[i]);
}

/* --- cluster -------------------------------------------------------------- */

/* Sanitizers map memory by the terabyte: no limit then. */
#ifdef INCODE_SANITIZED
#define LIMITED false
#else
#define LIMITED true
#endif

enum { AWAKE_US = 100 }; /* a page's way to a node, where nobody sleeps */

extern char **environ;

int host_cluster_program(const char *given, const char *name, char *path,
                         size_t size, struct host_error *error) {
    ssize_t length;
    char *slash;
    if (given != NULL) {
        snprintf(path, size, "%s", given);
    } else {
        length = readlink("/proc/self/exe", path, size - strlen(name) - 1);
        if (length <= 0) {
            return host_fail(error, HOST_BROKEN,
                             "/proc/self/exe: %s; is /proc mounted?",
                             strerror(errno));
        }
        path[length] = '\0';
        slash = strrchr(path, '/');
        strcpy(slash == NULL ? path : slash + 1, name);
    }
    if (access(path, X_OK) != 0) {
        return host_fail(error, HOST_CUBE,
                         "%s: %s; the node program belongs beside incode, "
                         "run make",
                         path, strerror(errno));
    }
    return 0;
}

static bool set_limit(int resource, uint64_t bytes) {
    struct rlimit limit = {bytes, bytes};
    return setrlimit((__rlimit_resource_t)resource, &limit) == 0;
}

/* In the child: becomes the node. */
static void become_node(const void *context, unsigned node) {
    const struct host_cluster *c = context;
    char text[8][32], links[CUBE_LINKS_MAX * 12] = "";
    char *environment[] = {processor_variable(), NULL};
    size_t at = 0;
    (void)close_range(3, ~0u, CLOSE_RANGE_CLOEXEC);
    for (unsigned d = 0; d < c->dimension + (node < c->ports ? 1u : 0u); d++) {
        int fd = c->wires.end[node][d];
        fcntl(fd, F_SETFD, 0);
        at += (size_t)snprintf(links + at, sizeof links - at, "%s%d",
                               d == 0 ? "" : ",", fd);
    }
    snprintf(text[0], sizeof text[0], "%u", node);
    snprintf(text[1], sizeof text[1], "%u", c->dimension);
    snprintf(text[2], sizeof text[2], "%llu",
             (unsigned long long)c->options.memory);
    snprintf(text[3], sizeof text[3], "%d", (int)HOST_STACK_BYTES);
    snprintf(text[4], sizeof text[4], "%u", c->options.window);
    snprintf(text[5], sizeof text[5], "%lu", (unsigned long)c->epoch);
    snprintf(text[6], sizeof text[6], "%llu", (unsigned long long)c->awake_us);
    snprintf(text[7], sizeof text[7], "%u", c->ports);
    char *argv[] = {(char[]){"incode-node"},
                    (char[]){"--node"},
                    text[0],
                    (char[]){"--dimension"},
                    text[1],
                    (char[]){"--memory"},
                    text[2],
                    (char[]){"--stack"},
                    text[3],
                    (char[]){"--window"},
                    text[4],
                    (char[]){"--epoch"},
                    text[5],
                    (char[]){"--awake"},
                    text[6],
                    (char[]){"--host-ports"},
                    text[7],
                    (char[]){"--links"},
                    links,
                    NULL};
    if (set_limit(RLIMIT_CORE, 0) &&
        (!c->limited ||
         (set_limit(RLIMIT_STACK, HOST_STACK_BYTES) &&
          set_limit(RLIMIT_DATA, c->options.memory - HOST_STACK_BYTES))))
        execve(c->path, argv, c->limited ? environment : environ);
}

static int start_node(struct host_cluster *c, unsigned node,
                      struct host_error *error) {
    const struct host_cluster_options *o = &c->options;
    const struct host_child child = {
        node, c->path, "ask for fewer with --nodes",
        o->become != NULL ? o->become : become_node,
        o->become != NULL ? o->context : c};
    c->epoch++;
    return host_child_start(&c->process[node], &child, error);
}

/* The host's ends of its wires.  A terminal is opened by its name as a real
 * port would be. */
static int take_wires(struct host_cluster *c, struct host_error *error) {
    const struct host_cluster_options *options = &c->options;
    struct host_wires *wires = &c->wires;
    struct serial_port_settings settings = {.dtr = true, .rts = true};
    if (!options->link->terminals) {
        for (unsigned i = 0; i < c->ports; i++) {
            host_port_socket(&c->port[i], wires->host[i]);
            wires->host[i] = -1;
        }
        return 0;
    }
    memcpy(settings.name, wires->host_path, sizeof wires->host_path);
    int status = host_port_serial(&c->port[0], &settings, error);
    c->port[0].unplug_us = options->unplug_us;
    close(wires->host[0]);
    wires->host[0] = -1;
    return status;
}

/* Half of all numbers may follow, so that no start's epoch is 0. */
static uint32_t first_epoch(void) {
    uint32_t epoch;
    if (getrandom(&epoch, sizeof epoch, 0) != (ssize_t)sizeof epoch)
        epoch = (uint32_t)host_now_us();
    return epoch % (UINT32_MAX / 2) + 1;
}

/* Where wires are this machine's own, as many nodes as can be have one to the
 * host: passing on what is another's takes a node a fifteenth of the time in
 * which that other computes.  A board has one UART for it, and what goes over
 * terminals is as on real wires. */
static unsigned host_ports(const struct host_cluster_options *options) {
    if (options->become != NULL || options->link->terminals ||
        options->one_wire)
        return 1;
    return options->nodes < CUBE_HOST_PORTS_MAX ? options->nodes
                                                : CUBE_HOST_PORTS_MAX;
}

static void host_cluster_stop(struct host_cluster *cluster);

int host_cluster_start(struct host_cluster *cluster,
                       const struct host_cluster_options *options,
                       struct host_error *error) {
    memset(cluster, 0, sizeof *cluster);
    memset(&cluster->wires, -1, sizeof cluster->wires);
    cluster->nodes = options->nodes;
    cluster->options = *options;
    cluster->ports = host_ports(options);
    cluster->limited = LIMITED && options->become == NULL;
    /* Not where others wait for the processor. */
    cluster->awake_us = options->nodes < host_threads() ? AWAKE_US : 0;
    cluster->epoch = first_epoch();
    while (1u << cluster->dimension < options->nodes)
        cluster->dimension++;
    if (host_cluster_program(options->program, "incode-node", cluster->path,
                             sizeof cluster->path, error) != 0)
        return error->code;
    int status = host_wires_make(&cluster->wires, options->link, cluster->nodes,
                                 cluster->dimension, cluster->ports, error);
    if (status == 0)
        status = take_wires(cluster, error);
    cluster->host_epoch = cluster->epoch;
    for (unsigned i = 0; status == 0 && i < cluster->nodes; i++)
        if ((options->left_out >> i & 1) == 0)
            status = start_node(cluster, i, error);
    if (status != 0)
        host_cluster_stop(cluster);
    return status;
}

/* Starts nodes again that have died.  0, or HOST_CUBE for one that does so too
 * often: child.h. */
static int host_cluster_check(struct host_cluster *cluster,
                              struct host_error *error) {
    if (!host_child_any_died())
        return 0;
    for (unsigned i = 0; i < cluster->nodes; i++) {
        struct host_process *process = &cluster->process[i];
        unsigned link = host_link_to(i, 0, cluster->dimension);
        if (!host_child_died(process))
            continue;
        if (host_child_check(process, i, link, error) != 0 ||
            start_node(cluster, i, error) != 0)
            return error->code;
        cluster->restarts++;
    }
    return 0;
}

/* Whether every node has ended, however it did.  From here on none is started
 * again. */
static bool host_cluster_ended(struct host_cluster *cluster) {
    bool ended = true;
    host_wires_close_nodes(&cluster->wires); /* so that an end is heard */
    for (unsigned i = 0; i < cluster->nodes; i++) {
        (void)host_child_died(&cluster->process[i]);
        ended &= cluster->process[i].pid == 0;
    }
    return ended;
}

/* Ends what still runs and waits for it.  Also after a failed start. */
static void host_cluster_stop(struct host_cluster *cluster) {
    for (unsigned i = 0; i < cluster->nodes; i++)
        (void)host_child_kill(&cluster->process[i]);
    for (unsigned i = 0; i < cluster->nodes; i++)
        host_child_wait(&cluster->process[i]);
    host_wires_close(&cluster->wires);
    for (unsigned i = 0; i < cluster->ports; i++)
        host_port_close(&cluster->port[i]);
}

/* --- as a machine --------------------------------------------------------- */

static uint64_t machine_now_us(void *context) {
    (void)context;
    return host_now_us();
}

static void machine_idle(void *context, uint64_t wait_us) {
    struct host_cluster *cluster = context;
    host_port_idle(cluster->port, cluster->ports, wait_us);
}

static int machine_check(void *context, struct host_error *error) {
    return host_cluster_check(context, error);
}

static unsigned machine_restarts(void *context) {
    const struct host_cluster *cluster = context;
    return cluster->restarts;
}

static uint64_t machine_starved_us(void *context, unsigned node) {
    const struct host_cluster *cluster = context;
    return host_child_starved_us(&cluster->process[node]);
}

/* As it ends, host_cluster_check finds it. */
static bool machine_kill(void *context, unsigned node) {
    const struct host_cluster *cluster = context;
    (void)host_child_kill(&cluster->process[node]);
    return true;
}

static bool machine_ended(void *context) {
    return host_cluster_ended(context);
}

static void machine_stop(void *context) {
    host_cluster_stop(context);
}

struct host_machine host_cluster_machine(struct host_cluster *cluster) {
    struct host_machine machine;
    memset(&machine, 0, sizeof machine);
    machine.context = cluster;
    machine.nodes = cluster->nodes;
    machine.dimension = cluster->dimension;
    machine.epoch = cluster->host_epoch;
    machine.serial_baud = cluster->options.serial_baud;
    machine.pipe = host_port_pipe(&cluster->port[0]);
    machine.host_ports = (uint8_t)cluster->ports;
    for (unsigned i = 0; i < cluster->ports; i++)
        machine.wires[i] = host_port_pipe(&cluster->port[i]);
    machine.now_us = machine_now_us;
    machine.idle = machine_idle;
    machine.check = machine_check;
    machine.restarts = machine_restarts;
    machine.starved_us = machine_starved_us;
    machine.kill = machine_kill;
    machine.ended = machine_ended;
    machine.stop = machine_stop;
    return machine;
}

/* --- throttle ------------------------------------------------------------- */

enum { RATE_IDLE_US = 1000 };

static uint64_t draw(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

static void sleep_us(uint64_t us) {
    struct timespec wait = {(time_t)(us / 1000000),
                            (long)(us % 1000000) * 1000};
    (void)nanosleep(&wait, NULL);
}

static uint64_t now_us(void *context) {
    struct host_throttled *t = context;
    return t->machine.now_us(t->machine.context);
}

static int send_on(void *context, const uint8_t *bytes, size_t size) {
    struct host_throttled_wire *wire = context;
    return wire->pipe.send(wire->pipe.context, bytes, size);
}

static int receive_slowly(void *context, uint8_t *bytes, size_t size) {
    struct host_throttled_wire *wire = context;
    struct host_throttled *t = wire->throttled;
    uint64_t passed = now_us(t) - t->start_us;
    if (t->throttle.stall_us_max != 0 && draw(&t->random) % 32 == 0)
        sleep_us(draw(&t->random) % t->throttle.stall_us_max);
    if (t->throttle.bytes_a_second != 0 && passed < t->throttle.slow_us) {
        uint64_t allowed = passed * t->throttle.bytes_a_second / 1000000 + 1;
        if (t->taken >= allowed)
            return 0;
        size = allowed - t->taken < size ? (size_t)(allowed - t->taken) : size;
    }
    int got = wire->pipe.receive(wire->pipe.context, bytes, size);
    t->taken += got > 0 ? (uint64_t)got : 0;
    return got;
}

/* Bytes that may not be read yet must not wake. */
static void idle(void *context, uint64_t wait_us) {
    struct host_throttled *t = context;
    if (t->throttle.bytes_a_second != 0)
        sleep_us(wait_us < RATE_IDLE_US ? wait_us : RATE_IDLE_US);
    else
        t->machine.idle(t->machine.context, wait_us);
}

static int check(void *context, struct host_error *error) {
    struct host_throttled *t = context;
    return t->machine.check(t->machine.context, error);
}

static void missing(void *context, unsigned node, unsigned link) {
    struct host_throttled *t = context;
    t->machine.missing(t->machine.context, node, link);
}

static void told(void *context, const char *line) {
    struct host_throttled *t = context;
    t->machine.told(t->machine.context, line);
}

static unsigned restarts(void *context) {
    struct host_throttled *t = context;
    return t->machine.restarts(t->machine.context);
}

static uint64_t starved_us(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.starved_us(t->machine.context, node);
}

static bool kill_node(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.kill(t->machine.context, node);
}

static const char *doubt(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.doubt(t->machine.context, node);
}

static const char *start_line(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.start_line(t->machine.context, node);
}

static const char *address(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.address(t->machine.context, node);
}

static void rest(void *context, uint64_t rest_us) {
    struct host_throttled *t = context;
    t->machine.rest(t->machine.context, rest_us);
}

static bool ended(void *context) {
    struct host_throttled *t = context;
    return t->machine.ended(t->machine.context);
}

static void stop(void *context) {
    struct host_throttled *t = context;
    t->machine.stop(t->machine.context);
}

struct host_machine
host_throttle_machine(struct host_throttled *throttled,
                      const struct host_machine *machine,
                      const struct host_throttle *throttle) {
    struct host_machine result = *machine;
    throttled->machine = *machine;
    throttled->throttle = *throttle;
    throttled->taken = 0;
    throttled->random = throttle->seed * 2 + 88172645463325253u;
    throttled->start_us = machine->now_us(machine->context);
    result.context = throttled;
    for (unsigned i = 0; i < CUBE_HOST_PORTS_MAX; i++) {
        throttled->wire[i] = (struct host_throttled_wire){
            throttled, i == 0 ? machine->pipe : machine->wires[i]};
        result.wires[i] =
            (struct link_pipe){&throttled->wire[i], send_on, receive_slowly};
    }
    result.pipe = result.wires[0];
    result.now_us = now_us;
    result.idle = idle;
    result.check = check;
    result.missing = machine->missing != NULL ? missing : NULL;
    result.told = machine->told != NULL ? told : NULL;
    result.restarts = machine->restarts != NULL ? restarts : NULL;
    result.starved_us = machine->starved_us != NULL ? starved_us : NULL;
    result.kill = machine->kill != NULL ? kill_node : NULL;
    result.doubt = machine->doubt != NULL ? doubt : NULL;
    result.start_line = machine->start_line != NULL ? start_line : NULL;
    result.address = machine->address != NULL ? address : NULL;
    result.rest = machine->rest != NULL ? rest : NULL;
    result.ended = ended;
    result.stop = stop;
    return result;
}
