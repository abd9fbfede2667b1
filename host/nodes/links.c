#include "links.h"

#include <stddef.h>
#include <string.h>

#include "transport/drivers/serial.h"
#include "transport/drivers/tcp.h"
#include "transport/drivers/unix_file.h"

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
    for (i = 0; (link = host_link_row(i)) != NULL; i++) {
        if (strcmp(name, link->name) == 0) {
            return link;
        }
    }
    for (i = 0; i < sizeof of_files / sizeof of_files[0]; i++) {
        if (strcmp(name, of_files[i].name) == 0) {
            return &of_files[i];
        }
    }
    return NULL;
}
