#include "links.h"

#include <stddef.h>

#include "transport/drivers/serial.h"
#include "transport/drivers/tcp.h"

const struct host_link_row host_links[HOST_WIRE_KINDS] = {
    [HOST_WIRE_TCP] = {"tcp", "connected sockets", tcp_pair,
                       "loopback connections"},
    [HOST_WIRE_SERIAL] = {"serial", "pseudo-terminals", serial_pair,
                          "pseudo-terminals"},
    [HOST_WIRE_MPI] = {"mpi", "ranks of Open MPI, also under mpirun", NULL,
                       NULL},
};

const char *host_link_name(unsigned i)
{
    return i < HOST_WIRE_KINDS ? host_links[i].name : NULL;
}
