/* Where a wire between processes meets: an address and port of TCP, or the path
 * of a socket on the same machine.
 *
 * Memory: struct tcp_address.  Work: one pass over the text.
 *
 *     if (tcp_address_parse(&address, "[2001:db8::7]:7000") != 0 &&
 *         tcp_address_set_path(&address, "/run/cube/01") != 0)
 *         return -1;
 */
#ifndef TRANSPORT_DRIVERS_TCP_ADDRESS_H
#define TRANSPORT_DRIVERS_TCP_ADDRESS_H

#include <stdbool.h>
#include <sys/socket.h>

enum { TCP_PATH_MAX = 107 }; /* bytes of a path, as the kernel has it */

struct tcp_address {
    union {
        struct sockaddr any;
        struct sockaddr_storage storage;
    } to;
    socklen_t size;
};

/* "127.0.0.1:7000", "[::1]:7000": numbers alone, no names.  0, or -1. */
int tcp_address_parse(struct tcp_address *address, const char *text);

/* 0, or -1: empty, or longer than TCP_PATH_MAX. */
int tcp_address_set_path(struct tcp_address *address, const char *path);

/* NULL: it has none. */
const char *tcp_address_path(const struct tcp_address *address);

/* All addresses of a machine: 0.0.0.0 or ::. */
bool tcp_address_is_any(const struct tcp_address *address);

#endif
