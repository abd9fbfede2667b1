#include "unix_file.h"

#include <errno.h>
#include <sched.h>
#include <stddef.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Whether the file is a socket without a listener: 0, or what it is instead. */
static int left_over(const struct tcp_address *address) {
    struct stat about;
    if (lstat(tcp_address_path(address), &about) != 0)
        return errno;
    if (!S_ISSOCK(about.st_mode))
        return EEXIST;
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return errno;
    int reason = connect(fd, &address->to.any, address->size) == 0 ? 0 : errno;
    close(fd);
    return reason == ECONNREFUSED ? 0 : EADDRINUSE;
}

static int bind_for_owner(int fd, const struct tcp_address *address) {
    mode_t before = umask(0177);
    int status = bind(fd, &address->to.any, address->size);
    int reason = errno;
    umask(before);
    errno = reason;
    return status;
}

int unix_file_pair(int fds[2]) {
    return socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0,
                      fds);
}

int unix_file_bind(int fd, const struct tcp_address *address) {
    if (bind_for_owner(fd, address) == 0)
        return 0;
    if (errno != EADDRINUSE)
        return -1;
    int reason = left_over(address);
    if (reason == 0 && unlink(tcp_address_path(address)) != 0)
        reason = errno;
    if (reason != 0) {
        errno = reason;
        return -1;
    }
    return bind_for_owner(fd, address);
}

bool unix_file_peer_is_ours(int fd) {
    struct ucred peer;
    socklen_t size = sizeof peer;
    return getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 &&
           (peer.uid == geteuid() || peer.uid == 0);
}

void unix_file_remove(const struct tcp_address *address) {
    int before = errno;
    if (left_over(address) == 0)
        (void)unlink(tcp_address_path(address));
    errno = before;
}

/* --- wait ----------------------------------------------------------------- */

static uint64_t clock_us(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

void wait_files(struct pollfd *fds, nfds_t count, uint64_t wait_us,
                uint64_t awake_us) {
    uint64_t awake = awake_us < wait_us ? awake_us : wait_us;
    uint64_t start = awake > 0 ? clock_us() : 0;
    while (awake > 0 && clock_us() - start < awake) {
        if (poll(fds, count, 0) != 0)
            return;
        (void)sched_yield();
    }
    struct timespec wait = {(time_t)(wait_us / 1000000),
                            (long)(wait_us % 1000000) * 1000};
    (void)ppoll(fds, count, &wait, NULL);
}
