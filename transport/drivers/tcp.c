#include "tcp.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

/* --- the pipe ------------------------------------------------------------- */

/* Bytes moved, 0 for the present, or closed. */
static int result(struct tcp_pipe *pipe, ssize_t moved) {
    if (moved >= 0)
        return (int)moved;
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR ||
        errno == ENOBUFS)
        return 0;
    pipe->closed = true;
    return LINK_PIPE_CLOSED;
}

static int tcp_send(void *context, const uint8_t *bytes, size_t size) {
    struct tcp_pipe *pipe = context;
    if (pipe->closed)
        return LINK_PIPE_CLOSED;
    int taken =
        result(pipe, send(pipe->fd, bytes, size, MSG_DONTWAIT | MSG_NOSIGNAL));
    pipe->blocked = taken >= 0 && (size_t)taken < size;
    return taken;
}

static int tcp_receive(void *context, uint8_t *bytes, size_t size) {
    struct tcp_pipe *pipe = context;
    if (pipe->closed)
        return LINK_PIPE_CLOSED;
    bool quiet = pipe->quiet;
    pipe->quiet = false;
    if (quiet || size == 0)
        return 0;
    ssize_t got = recv(pipe->fd, bytes, size, MSG_DONTWAIT);
    if (got == 0) {
        pipe->closed = true;
        return LINK_PIPE_CLOSED;
    }
    return result(pipe, got);
}

void tcp_pipe_init(struct tcp_pipe *pipe, int fd) {
    *pipe = (struct tcp_pipe){.fd = fd, .closed = fd < 0};
}

struct link_pipe tcp_link_pipe(struct tcp_pipe *pipe) {
    return (struct link_pipe){pipe, tcp_send, tcp_receive};
}

short tcp_events(const struct tcp_pipe *pipe) {
    if (pipe->closed)
        return 0;
    return pipe->blocked ? POLLIN | POLLOUT : POLLIN;
}

void tcp_heard(struct tcp_pipe *pipe, short revents) {
    pipe->quiet = (revents & ~POLLOUT) == 0;
}

/* --- sockets -------------------------------------------------------------- */

/* Fixed before the connection is made, when the window's scale is agreed. */
static int fix_buffers(int fd) {
    int bytes = TCP_BUFFER_BYTES;
    if (setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes) != 0)
        return -1;
    return setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
}

int tcp_prepare(int fd) {
    int on = 1;
    int flags = fcntl(fd, F_GETFL);
    if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) != 0 ||
        fcntl(fd, F_SETFD, FD_CLOEXEC) != 0 || fix_buffers(fd) != 0)
        return -1;
    /* A socket with a path never delays. */
    return setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) == 0 ||
                   errno == EOPNOTSUPP
               ? 0
               : -1;
}

int tcp_buffers(int fd, int *send_bytes, int *receive_bytes) {
    socklen_t size = sizeof *send_bytes;
    if (getsockopt(fd, SOL_SOCKET, SO_SNDBUF, send_bytes, &size) != 0)
        return -1;
    size = sizeof *receive_bytes;
    return getsockopt(fd, SOL_SOCKET, SO_RCVBUF, receive_bytes, &size);
}

/* A listener on a port of the kernel's choice. */
static int listen_on_loopback(struct sockaddr_in *address) {
    socklen_t size = sizeof *address;
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    memset(address, 0, sizeof *address);
    address->sin_family = AF_INET;
    address->sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd < 0)
        return -1;
    if (fix_buffers(fd) != 0 ||
        bind(fd, (struct sockaddr *)address, sizeof *address) != 0 ||
        listen(fd, 8) != 0 ||
        getsockname(fd, (struct sockaddr *)address, &size) != 0) {
        int reason = errno;
        close(fd);
        errno = reason;
        return -1;
    }
    return fd;
}

/* Accepts the connection that comes from `ours`, and no stranger's. */
static int accept_ours(int listener, int ours) {
    struct sockaddr_in here, there;
    socklen_t size = sizeof here;
    memset(&here, 0, sizeof here);
    if (getsockname(ours, (struct sockaddr *)&here, &size) != 0)
        return -1;
    for (;;) {
        memset(&there, 0, sizeof there);
        size = sizeof there;
        int fd =
            accept4(listener, (struct sockaddr *)&there, &size, SOCK_CLOEXEC);
        if (fd < 0 && (errno == EINTR || errno == ECONNABORTED))
            continue;
        if (fd < 0 || (there.sin_port == here.sin_port &&
                       there.sin_addr.s_addr == here.sin_addr.s_addr))
            return fd;
        close(fd);
    }
}

int tcp_pair(int fds[2]) {
    struct sockaddr_in address;
    int listener = listen_on_loopback(&address);
    if (listener < 0)
        return -1;
    fds[1] = -1;
    fds[0] = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fds[0] >= 0 && fix_buffers(fds[0]) == 0 &&
        connect(fds[0], (struct sockaddr *)&address, sizeof address) == 0)
        fds[1] = accept_ours(listener, fds[0]);
    int reason = errno;
    close(listener);
    if (fds[1] >= 0 && tcp_prepare(fds[0]) == 0 && tcp_prepare(fds[1]) == 0)
        return 0;
    reason = fds[1] >= 0 ? errno : reason;
    for (int i = 0; i < 2; i++) {
        if (fds[i] >= 0)
            close(fds[i]);
        fds[i] = -1;
    }
    errno = reason;
    return -1;
}

/* --- tcp address ---------------------------------------------------------- */

int tcp_address_parse(struct tcp_address *address, const char *text) {
    struct sockaddr_in *v4 = (struct sockaddr_in *)&address->to;
    struct sockaddr_in6 *v6 = (struct sockaddr_in6 *)&address->to;
    char host[INET6_ADDRSTRLEN + 2], *end;
    const char *colon = strrchr(text, ':');
    memset(address, 0, sizeof *address);
    if (colon == NULL || colon[1] < '0' || colon[1] > '9' ||
        (size_t)(colon - text) >= sizeof host)
        return -1;
    unsigned long port = strtoul(colon + 1, &end, 10);
    if (*end != '\0' || port == 0 || port > 65535)
        return -1;
    size_t length = (size_t)(colon - text);
    memcpy(host, text, length);
    host[length] = '\0';
    if (length > 2 && host[0] == '[' && host[length - 1] == ']') {
        host[length - 1] = '\0';
        v6->sin6_family = AF_INET6;
        v6->sin6_port = htons((uint16_t)port);
        address->size = sizeof *v6;
        return inet_pton(AF_INET6, host + 1, &v6->sin6_addr) == 1 ? 0 : -1;
    }
    v4->sin_family = AF_INET;
    v4->sin_port = htons((uint16_t)port);
    address->size = sizeof *v4;
    return inet_pton(AF_INET, host, &v4->sin_addr) == 1 ? 0 : -1;
}

_Static_assert(sizeof((struct sockaddr_un *)0)->sun_path == TCP_PATH_MAX + 1,
               "a path and its end");

int tcp_address_set_path(struct tcp_address *address, const char *path) {
    struct sockaddr_un *at = (struct sockaddr_un *)&address->to;
    size_t length = strlen(path);
    memset(address, 0, sizeof *address);
    if (length == 0 || length > TCP_PATH_MAX)
        return -1;
    at->sun_family = AF_UNIX;
    memcpy(at->sun_path, path, length + 1);
    address->size =
        (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length + 1);
    return 0;
}

const char *tcp_address_path(const struct tcp_address *address) {
    return address->to.any.sa_family == AF_UNIX
               ? ((const struct sockaddr_un *)&address->to)->sun_path
               : NULL;
}

bool tcp_address_is_any(const struct tcp_address *address) {
    const struct sockaddr_in *v4 = (const struct sockaddr_in *)&address->to;
    const struct sockaddr_in6 *v6 = (const struct sockaddr_in6 *)&address->to;
    return address->to.any.sa_family == AF_INET6
               ? IN6_IS_ADDR_UNSPECIFIED(&v6->sin6_addr)
               : address->to.any.sa_family == AF_INET &&
                     v4->sin_addr.s_addr == htonl(INADDR_ANY);
}
