#include "serial.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

/* --- the pipe ------------------------------------------------------------- */

static uint64_t clock_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* Ten bits a byte: the wire sends baud / 10 bytes a second, which is as many
 * millionths of a byte a microsecond. */
static void drain_by_clock(struct serial_pipe *pipe) {
    uint64_t now_us = pipe->now_us(), gone = now_us - pipe->ahead_us;
    gone = (gone > 1000000 ? 1000000 : gone) * pipe->baud / 10;
    pipe->ahead_us = now_us;
    pipe->ahead_microbytes -=
        gone < pipe->ahead_microbytes ? gone : pipe->ahead_microbytes;
}

/* Bytes that may be ahead of the wire: a process that sleeps needs some time to
 * wake. */
static size_t ahead_most(const struct serial_pipe *pipe) {
    size_t bytes = (size_t)((uint64_t)pipe->baud * SERIAL_AHEAD_US / 10000000);
    return bytes > SERIAL_AHEAD_BYTES ? bytes : SERIAL_AHEAD_BYTES;
}

/* Bytes that may be given to the kernel now. */
static size_t room(struct serial_pipe *pipe) {
    size_t ahead = 0;
    int queued = 0;
    if (pipe->baud != 0) {
        drain_by_clock(pipe);
        ahead = (size_t)((pipe->ahead_microbytes + 999999) / 1000000);
        if (pipe->counts && ioctl(pipe->fd, TIOCOUTQ, &queued) == 0 &&
            queued > (int)ahead)
            ahead = (size_t)queued;
    }
    size_t most = ahead_most(pipe);
    return ahead < most ? most - ahead : 0;
}

/* Bytes moved, 0 for the present, or closed. */
static int result(struct serial_pipe *pipe, ssize_t moved) {
    pipe->closed =
        moved < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR;
    return pipe->closed ? LINK_PIPE_CLOSED : moved < 0 ? 0 : (int)moved;
}

static int serial_send(void *context, const uint8_t *bytes, size_t size) {
    struct serial_pipe *pipe = context;
    if (pipe->closed)
        return LINK_PIPE_CLOSED;
    size_t most = room(pipe);
    /* No dribble: a few bytes would wake the other end, whose few would wake
     * this one. */
    if (most < size && most < ahead_most(pipe) / 2)
        most = 0;
    most = most < size ? most : size;
    int taken = most == 0 ? 0 : result(pipe, write(pipe->fd, bytes, most));
    pipe->blocked = taken >= 0 && (size_t)taken < size;
    if (taken > 0 && pipe->baud != 0)
        pipe->ahead_microbytes += UINT64_C(1000000) * (unsigned)taken;
    return taken;
}

static int serial_receive(void *context, uint8_t *bytes, size_t size) {
    struct serial_pipe *pipe = context;
    if (pipe->closed && pipe->recover != NULL)
        pipe->recover(pipe->context);
    if (pipe->fd < 0) {
        pipe->closed = true;
        return LINK_PIPE_CLOSED;
    }
    if (size == 0)
        return pipe->closed ? LINK_PIPE_CLOSED : 0;
    /* With VMIN 1, no bytes is EAGAIN, and 0 is a terminal that hung up. */
    ssize_t got = read(pipe->fd, bytes, size);
    if (got == 0) {
        pipe->closed = true;
        return LINK_PIPE_CLOSED;
    }
    return result(pipe, got);
}

void serial_pipe_init(struct serial_pipe *pipe, int fd, uint32_t baud) {
    memset(pipe, 0, sizeof *pipe);
    pipe->fd = fd;
    pipe->baud = baud;
    pipe->closed = fd < 0;
    pipe->now_us = clock_us;
    pipe->ahead_us = clock_us();
    pipe->counts = isatty(fd) == 1;
}

struct link_pipe serial_link_pipe(struct serial_pipe *pipe) {
    return (struct link_pipe){pipe, serial_send, serial_receive};
}

short serial_events(const struct serial_pipe *pipe) {
    if (pipe->closed)
        return 0;
    return pipe->blocked && pipe->baud == 0 ? POLLIN | POLLOUT : POLLIN;
}

uint64_t serial_wait_us(const struct serial_pipe *pipe) {
    if (pipe->closed || !pipe->blocked || pipe->baud == 0)
        return UINT64_MAX;
    /* Until half of what may be ahead is on the wire. */
    return (uint64_t)ahead_most(pipe) / 2 * 10000000 / pipe->baud;
}

/* --- terminals ------------------------------------------------------------ */

int serial_raw(int fd) {
    struct termios t;
    int flags = fcntl(fd, F_GETFL);
    if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) != 0 ||
        fcntl(fd, F_SETFD, FD_CLOEXEC) != 0 || tcgetattr(fd, &t) != 0)
        return -1;
    cfmakeraw(&t);
    t.c_iflag &= (tcflag_t) ~(IXOFF | IXANY | INPCK);
    t.c_cflag |= CLOCAL | CREAD;
    /* HUPCL would let DTR fall on close, and the next open raise it: that edge
     * resets many a board. */
    t.c_cflag &= (tcflag_t) ~(HUPCL | CSTOPB | PARENB | CRTSCTS);
    t.c_cc[VMIN] = 1;
    t.c_cc[VTIME] = 0;
    return tcsetattr(fd, TCSANOW, &t);
}

static const struct {
    uint32_t baud;
    speed_t code;
} speeds[] = {{9600, B9600},       {19200, B19200},     {38400, B38400},
              {57600, B57600},     {115200, B115200},   {230400, B230400},
              {460800, B460800},   {500000, B500000},   {576000, B576000},
              {921600, B921600},   {1000000, B1000000}, {1152000, B1152000},
              {1500000, B1500000}, {2000000, B2000000}, {2500000, B2500000},
              {3000000, B3000000}, {3500000, B3500000}, {4000000, B4000000}};

static int set_wire(int fd, uint32_t baud, bool rts_cts) {
    struct termios t;
    if (tcgetattr(fd, &t) != 0)
        return -1;
    if (rts_cts)
        t.c_cflag |= CRTSCTS;
    for (size_t i = 0; i < sizeof speeds / sizeof speeds[0]; i++) {
        if (speeds[i].baud == baud) {
            (void)cfsetispeed(&t, speeds[i].code);
            (void)cfsetospeed(&t, speeds[i].code);
            return tcsetattr(fd, TCSANOW, &t);
        }
    }
    errno = EINVAL;
    return baud == 0 ? tcsetattr(fd, TCSANOW, &t) : -1;
}

int serial_open(const char *path, uint32_t baud, bool rts_cts) {
    int fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return -1;
    if (ioctl(fd, TIOCEXCL) != 0 || serial_raw(fd) != 0 ||
        set_wire(fd, baud, rts_cts) != 0) {
        int reason = errno;
        serial_close(fd);
        errno = reason;
        return -1;
    }
    return fd;
}

void serial_close(int fd) {
    struct termios t;
    if (fd < 0)
        return;
    /* A close waits for bytes to go out, up to 30 s where CTS holds them. */
    if (tcgetattr(fd, &t) == 0 && (t.c_cflag & CRTSCTS) != 0) {
        t.c_cflag &= (tcflag_t)~CRTSCTS;
        (void)tcsetattr(fd, TCSANOW, &t);
    }
    (void)tcflush(fd, TCOFLUSH);
    (void)ioctl(fd, TIOCNXCL);
    close(fd);
}

int serial_pair(int fds[2]) {
    char path[64];
    fds[1] = -1;
    fds[0] = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (fds[0] >= 0 && grantpt(fds[0]) == 0 && unlockpt(fds[0]) == 0 &&
        ptsname_r(fds[0], path, sizeof path) == 0)
        fds[1] = open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (fds[1] >= 0 && serial_raw(fds[1]) == 0 && serial_raw(fds[0]) == 0)
        return 0;
    int reason = errno;
    for (int i = 0; i < 2; i++) {
        if (fds[i] >= 0)
            close(fds[i]);
        fds[i] = -1;
    }
    errno = reason;
    return -1;
}
