/* Pipes of bytes over TCP on Linux: pairs of connected sockets on loopback, and
 * a link's pipe over a socket.
 *
 * Memory: struct tcp_pipe here, and in the kernel TCP_BUFFER_BYTES asked for
 * each way at each end (the kernel doubles that for its own books, and
 * tcp_buffers tells what it gave). */
#ifndef TRANSPORT_DRIVERS_TCP_H
#define TRANSPORT_DRIVERS_TCP_H

#include <stdbool.h>
#include <sys/socket.h>

#include "transport/link.h"

enum { TCP_BUFFER_BYTES = 65536 };

struct tcp_pipe {
    int fd;       /* connected; -1: none */
    bool blocked; /* had no room for all bytes at the last send */
    bool closed;  /* the other end is gone */
    bool quiet;   /* nothing had come when it was last waited for */
};

/* Two connected sockets on 127.0.0.1, without delay, non-blocking, closed on
 * exec: 0, or -1 and errno. */
int tcp_pair(int fds[2]);

/* Sets a connected socket up in the same way: 0, or -1 and errno. */
int tcp_prepare(int fd);

/* The socket's buffers as the kernel counts them: 0, or -1 and errno. */
int tcp_buffers(int fd, int *send_bytes, int *receive_bytes);

/* The pipe uses fd, which stays the caller's. */
void tcp_pipe_init(struct tcp_pipe *pipe, int fd);
struct link_pipe tcp_link_pipe(struct tcp_pipe *pipe);

/* What to wait for with poll(2): POLLIN, with POLLOUT while bytes wait for
 * room; 0 when the other end is gone. */
short tcp_events(const struct tcp_pipe *pipe);

/* The result of poll(2): if no byte has arrived, the next call of receive makes
 * no system call. */
void tcp_heard(struct tcp_pipe *pipe, short revents);

/* The address of a wire between processes: an address and port of TCP, or the
 * path of a socket on the same machine. */

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
