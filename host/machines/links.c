#include "links.h"

#include <stddef.h>
#include <string.h>

#include "transport/drivers/serial.h"
#include "transport/drivers/tcp.h"

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

const struct host_link *host_link_row(unsigned i)
{
    return i < sizeof rows / sizeof rows[0] ? &rows[i] : NULL;
}

const char *host_link_name(unsigned i)
{
    const struct host_link *link = host_link_row(i);
    return link == NULL ? NULL : link->name;
}

const struct host_link *host_link_named(const char *name)
{
    const struct host_link *link;
    for (unsigned i = 0; (link = host_link_row(i)) != NULL; i++) {
        if (strcmp(name, link->name) == 0) {
            break;
        }
    }
    return link;
}
