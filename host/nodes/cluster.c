#include "cluster.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "host/base/clock.h"
#include "host/base/parallel.h"

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
    char *no_environment[] = {NULL};
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
          set_limit(RLIMIT_DATA, c->options.memory - HOST_STACK_BYTES)))) {
        execve(c->path, argv, c->limited ? no_environment : environ);
    }
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
    if (getrandom(&epoch, sizeof epoch, 0) != (ssize_t)sizeof epoch) {
        epoch = (uint32_t)host_now_us();
    }
    return epoch % (UINT32_MAX / 2) + 1;
}

/* Where wires are this machine's own, as many nodes as can be have one to the
 * host: passing on what is another's takes a node a fifteenth of the time in
 * which that other computes.  A board has one UART for it, and what goes over
 * terminals is as on real wires. */
static unsigned host_ports(const struct host_cluster_options *options) {
    if (options->become != NULL || options->link->terminals ||
        options->one_wire) {
        return 1;
    }
    return options->nodes < CUBE_HOST_PORTS_MAX ? options->nodes
                                                : CUBE_HOST_PORTS_MAX;
}

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
    while (1u << cluster->dimension < options->nodes) {
        cluster->dimension++;
    }
    if (host_cluster_program(options->program, "incode-node", cluster->path,
                             sizeof cluster->path, error) != 0) {
        return error->code;
    }
    int status = host_wires_make(&cluster->wires, options->link, cluster->nodes,
                                 cluster->dimension, cluster->ports, error);
    if (status == 0) {
        status = take_wires(cluster, error);
    }
    cluster->host_epoch = cluster->epoch;
    for (unsigned i = 0; status == 0 && i < cluster->nodes; i++) {
        if ((options->left_out >> i & 1) == 0) {
            status = start_node(cluster, i, error);
        }
    }
    if (status != 0) {
        host_cluster_stop(cluster);
    }
    return status;
}

int host_cluster_check(struct host_cluster *cluster, struct host_error *error) {
    if (!host_child_any_died()) {
        return 0;
    }
    for (unsigned i = 0; i < cluster->nodes; i++) {
        struct host_process *process = &cluster->process[i];
        unsigned link = host_link_to(i, 0, cluster->dimension);
        if (!host_child_died(process)) {
            continue;
        }
        if (host_child_check(process, i, link, error) != 0 ||
            start_node(cluster, i, error) != 0) {
            return error->code;
        }
        cluster->restarts++;
    }
    return 0;
}

bool host_cluster_ended(struct host_cluster *cluster) {
    bool ended = true;
    host_wires_close_nodes(&cluster->wires); /* so that an end is heard */
    for (unsigned i = 0; i < cluster->nodes; i++) {
        (void)host_child_died(&cluster->process[i]);
        ended &= cluster->process[i].pid == 0;
    }
    return ended;
}

void host_cluster_stop(struct host_cluster *cluster) {
    for (unsigned i = 0; i < cluster->nodes; i++) {
        (void)host_child_kill(&cluster->process[i]);
    }
    for (unsigned i = 0; i < cluster->nodes; i++) {
        host_child_wait(&cluster->process[i]);
    }
    host_wires_close(&cluster->wires);
    for (unsigned i = 0; i < cluster->ports; i++) {
        host_port_close(&cluster->port[i]);
    }
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
    for (unsigned i = 0; i < cluster->ports; i++) {
        machine.wires[i] = host_port_pipe(&cluster->port[i]);
    }
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
