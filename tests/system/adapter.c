/* A USB adapter, as a host sees it: a serial port whose other end is an
 * emulated board's UART, a socket.
 *
 *     adapter PORT SOCKET
 *
 * SIGUSR1 pulls it out of the host, so that the port is gone with whatever was
 * on its way, and the next one plugs it in again.  It ends by SIGTERM.
 */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

enum { TURN_MS = 100 };

static volatile sig_atomic_t toggled, ended;

static void toggle(int number) {
    (void)number;
    toggled = !toggled;
}

static void end(int number) {
    (void)number;
    ended = 1;
}

/* The far end stays open, so that the port is there without a host. */
static int port = -1, far = -1;

static bool plug_in(const char *name) {
    struct termios raw;
    port = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    const char *device = port < 0 || grantpt(port) != 0 || unlockpt(port) != 0
                             ? NULL
                             : ptsname(port);
    far = device == NULL ? -1 : open(device, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (far < 0 || tcgetattr(far, &raw) != 0)
        return false;
    cfmakeraw(&raw);
    (void)unlink(name);
    return tcsetattr(far, TCSANOW, &raw) == 0 && symlink(device, name) == 0;
}

static void pull_out(const char *name) {
    (void)unlink(name);
    close(far);
    close(port);
    port = far = -1;
}

static int call(const char *path) {
    struct sockaddr_un there = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    snprintf(there.sun_path, sizeof there.sun_path, "%s", path);
    return fd >= 0 && connect(fd, (struct sockaddr *)&there, sizeof there) == 0
               ? fd
               : -1;
}

/* What does not fit is lost, as on a wire.  False: there is no more. */
static bool pass(int from, int to) {
    char bytes[4096];
    ssize_t n = read(from, bytes, sizeof bytes), done = 0;
    while (n > 0 && done < n && to >= 0) {
        struct pollfd room = {to, POLLOUT, 0};
        ssize_t part = write(to, bytes + done, (size_t)(n - done));
        /* clock: looks again */
        if (part <= 0 && poll(&room, 1, TURN_MS) <= 0)
            break;
        done += part > 0 ? part : 0;
    }
    return n > 0 || (n < 0 && (errno == EAGAIN || errno == EINTR));
}

int main(int argc, char **argv) {
    struct sigaction action[2] = {{.sa_handler = toggle}, {.sa_handler = end}};
    int board = argc == 3 ? call(argv[2]) : -1;
    if (board < 0 || sigaction(SIGUSR1, &action[0], NULL) != 0 ||
        sigaction(SIGTERM, &action[1], NULL) != 0 || !plug_in(argv[1])) {
        fprintf(stderr, "usage: adapter PORT SOCKET: %s\n", strerror(errno));
        return 1;
    }
    bool goes_on = true;
    while (goes_on && !ended) {
        struct pollfd fds[] = {{board, POLLIN, 0}, {port, POLLIN, 0}};
        if (toggled && port >= 0) {
            pull_out(argv[1]);
        } else if (!toggled && port < 0 && !plug_in(argv[1])) {
            break;
            /* clock: looks again */
        } else if (poll(fds, port < 0 ? 1 : 2, TURN_MS) > 0) {
            goes_on = fds[0].revents == 0 || pass(board, port);
            if (port >= 0 && fds[1].revents != 0)
                (void)pass(port, board);
        }
    }
    if (port >= 0)
        pull_out(argv[1]);
    return 0;
}
