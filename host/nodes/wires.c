#include "wires.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

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
            if (other < i) {
                continue;
            }
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
    for (unsigned i = 0; status == 0 && i < host_ports; i++) {
        status = make_to_host(wires, link, dimension, i, error);
    }
    if (status != 0) {
        host_wires_close(wires);
    }
    return status;
}

void host_wires_close_nodes(struct host_wires *wires) {
    for (unsigned i = 0; i < HOST_PROCESSES_MAX; i++) {
        for (unsigned d = 0; d < CUBE_LINKS_MAX; d++) {
            close_end(&wires->end[i][d]);
        }
    }
}

void host_wires_close(struct host_wires *wires) {
    host_wires_close_nodes(wires);
    for (unsigned i = 0; i < CUBE_HOST_PORTS_MAX; i++) {
        close_end(&wires->host[i]);
    }
}
