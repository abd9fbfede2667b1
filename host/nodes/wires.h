/* The wires between nodes that this machine emulates, and from the host to the
 * first of them: pairs of open files, one end for each side, by kind.
 *
 * Memory: 4 bytes for each port of HOST_PROCESSES_MAX nodes; in the kernel what
 * a wire of its kind takes.  Work: a few system calls a wire.
 *
 *     const struct host_link *link = host_link_named("tcp");
 *     if (host_wires_make(&wires, link, 8, 3, 1, &error) != 0)
 *         return error.code;
 *     host_port_socket(&port, wires.host[0]);
 *     int fd = wires.end[node][0];
 *     host_wires_close(&wires);
 */
#ifndef HOST_WIRES_H
#define HOST_WIRES_H

#include "host/base/error.h"
#include "host/nodes/links.h"
#include "transport/cube.h"

enum { HOST_PROCESSES_MAX = 64 }; /* nodes on one machine */

struct host_wires {
    int host[CUBE_HOST_PORTS_MAX]; /* its ends of its wires; -1: none */
    char host_path[64]; /* of the one to node 0, where it is a terminal */
    int end[HOST_PROCESSES_MAX][CUBE_LINKS_MAX]; /* [node][link]; -1: none */
};

/* Of a kind that has pairs; all ends non-blocking and closed on exec.  The host
 * has wires to nodes 0 .. host_ports - 1.  HOST_CUBE where the machine does not
 * give so many; what was made is closed then. */
int host_wires_make(struct host_wires *wires, const struct host_link *link,
                    unsigned nodes, unsigned dimension, unsigned host_ports,
                    struct host_error *error);

/* Closes the nodes' ends here, once the nodes have theirs. */
void host_wires_close_nodes(struct host_wires *wires);

/* Closes all. */
void host_wires_close(struct host_wires *wires);

#endif
