#include "uart.h"

#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>
#include <linux/sockios.h>

#include "chance.h"

enum { BITS_A_BYTE = 10, BYTES_A_LOOK = 4, POLL_MS = 1000 };

/* --- chance --------------------------------------------------------------- */

static uint64_t until(struct uart_lane *lane, uint32_t mean) {
    return mean == 0 ? UINT64_MAX
                     : chance_draw(&lane->random) % (2 * (uint64_t)mean) + 1;
}

static void init_lane(struct uart_lane *lane, const struct uart_settings *s,
                      unsigned place) {
    lane->random = chance_of_seed(s->seed * 2 * UART_WIRES_MAX + place);
    for (unsigned i = 0; i < 4; i++)
        (void)chance_draw(&lane->random);
    lane->until_flip = until(lane, s->flip_bytes);
    lane->until_drop = until(lane, s->drop_bytes);
    lane->until_burst = until(lane, s->burst_bytes);
}

/* Counts down to a fault. */
static bool strikes(struct uart_lane *lane, uint64_t *left, uint32_t mean) {
    if (mean == 0 || --*left > 0)
        return false;
    *left = until(lane, mean);
    return true;
}

/* What becomes of some bytes: how many are left of them. */
static size_t damage(struct uart_wires *wires, struct uart_lane *lane,
                     uint8_t *bytes, size_t size) {
    const struct uart_settings *s = &wires->settings;
    size_t left = 0;
    for (size_t i = 0; i < size; i++) {
        uint8_t byte = bytes[i];
        if (strikes(lane, &lane->until_burst, s->burst_bytes)) {
            lane->burst =
                UART_BURST_MIN +
                (unsigned)(chance_draw(&lane->random) % UART_BURST_SPREAD);
            wires->counts.bursts++;
        }
        if (lane->burst > 0) {
            lane->burst--;
            byte = (uint8_t)chance_draw(&lane->random);
            wires->counts.burst_bytes++;
        }
        if (strikes(lane, &lane->until_flip, s->flip_bytes)) {
            byte ^= (uint8_t)(1u << chance_draw(&lane->random) % 8);
            wires->counts.flips++;
        }
        if (strikes(lane, &lane->until_drop, s->drop_bytes))
            wires->counts.drops++;
        else
            bytes[left++] = byte;
    }
    return left;
}

/* --- ends ----------------------------------------------------------------- */

/* What a byte that was sent and is not read counts for, as the kernel sees it;
 * 0: it does not say. */
static uint64_t unread_unit(void) {
    int pair[2], unread = 0;
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0)
        return 0;
    if (send(pair[0], "", 1, 0) != 1 || ioctl(pair[0], SIOCOUTQ, &unread) != 0)
        unread = 0;
    close(pair[0]);
    close(pair[1]);
    return unread > 0 ? (uint64_t)unread : 0;
}

/* Bytes that were sent there one by one and are not read. */
static uint64_t unread_at(const struct uart_wires *wires, int fd) {
    int unread = 0;
    return ioctl(fd, SIOCOUTQ, &unread) == 0 && unread > 0
               ? (uint64_t)unread / wires->unread_unit
               : 0;
}

/* The end is away: what was under way to it, or from it, is lost. */
static void leave(struct uart_wires *wires, struct uart_wire *wire, unsigned i,
                  uint64_t now_us) {
    wires->counts.unheard += wire->lane[1 - i].held;
    close(wire->end[i].fd);
    wire->end[i].fd = -1;
    wire->end[i].call_us = now_us;
    wire->lane[i].busy = false;
    wire->lane[1 - i].held = 0;
}

static void take(struct uart_wires *wires, struct uart_wire *wire, unsigned i,
                 int fd) {
    wire->end[i].fd = fd;
    wire->lane[i].busy = false;
    wires->counts.connections++;
}

static bool call(struct uart_wires *wires, struct uart_wire *wire, unsigned i) {
    struct uart_end *end = &wire->end[i];
    struct sockaddr_un there = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0)
        return false;
    memcpy(there.sun_path, end->path, sizeof end->path);
    if (connect(fd, (struct sockaddr *)&there, sizeof there) != 0) {
        close(fd);
        return false;
    }
    take(wires, wire, i, fd);
    return true;
}

/* Whoever called last has the wire. */
static void answer(struct uart_wires *wires, struct uart_wire *wire, unsigned i,
                   uint64_t now_us) {
    int fd = accept4(wire->end[i].listener, NULL, NULL,
                     SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0)
        return;
    if (wire->end[i].fd >= 0)
        leave(wires, wire, i, now_us);
    take(wires, wire, i, fd);
}

static bool listen_at(struct uart_end *end) {
    struct sockaddr_un here = {.sun_family = AF_UNIX};
    memcpy(here.sun_path, end->path, sizeof end->path);
    (void)unlink(end->path);
    end->listener =
        socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    return end->listener >= 0 &&
           bind(end->listener, (struct sockaddr *)&here, sizeof here) == 0 &&
           listen(end->listener, 4) == 0;
}

/* --- bytes ---------------------------------------------------------------- */

/* Sends what there is room for; `size` more at once.  False: that end is gone.
 */
static bool put(struct uart_lane *lane, int fd, size_t size) {
    size_t gone = 0;
    ssize_t sent = 0;
    while (gone < lane->held && sent >= 0) {
        size_t left = lane->held - gone;
        sent = send(fd, lane->bytes + gone, left < size ? left : size,
                    MSG_NOSIGNAL);
        gone += sent > 0 ? (size_t)sent : 0;
    }
    bool open = sent >= 0 || errno == EAGAIN;
    lane->held -= gone;
    memmove(lane->bytes, lane->bytes + gone, lane->held);
    return open;
}

/* What was read and damaged goes out; without `fifo`, some of it may stay. With
 * it, one by one, so that what is unread can be counted. */
static void give(struct uart_wires *wires, struct uart_wire *wire, unsigned i,
                 uint64_t now_us) {
    struct uart_lane *lane = &wire->lane[i];
    uint32_t fifo = wires->settings.fifo;
    int fd = wire->end[1 - i].fd;
    if (fd >= 0 && (fifo == 0 || unread_at(wires, fd) < fifo) &&
        !put(lane, fd, fifo == 0 ? UART_HELD_BYTES : 1)) {
        leave(wires, wire, 1 - i, now_us);
    } else if (fd < 0) {
        wires->counts.unheard += lane->held;
        lane->held = 0;
    } else if (fifo > 0) {
        wires->counts.overruns += lane->held;
        lane->held = 0;
    }
}

/* As many bytes as the wire could take by now. */
static size_t due(const struct uart_wires *wires, struct uart_lane *lane,
                  uint64_t now_ns) {
    uint64_t bytes = (now_ns - lane->free_ns) / wires->byte_ns;
    if (bytes > UART_HELD_BYTES) { /* the relay was kept from its work */
        lane->free_ns = now_ns - UART_HELD_BYTES * wires->byte_ns;
        bytes = UART_HELD_BYTES;
    }
    return (size_t)bytes;
}

static void carry(struct uart_wires *wires, struct uart_wire *wire, unsigned i,
                  uint64_t now_us) {
    struct uart_lane *lane = &wire->lane[i];
    uint64_t now_ns = now_us * 1000;
    if (lane->held > 0) {
        give(wires, wire, i, now_us);
        lane->free_ns = now_ns;
        return;
    }
    size_t most = due(wires, lane, now_ns);
    if (most == 0)
        return;
    ssize_t got = read(wire->end[i].fd, lane->bytes, most);
    if (got == 0 || (got < 0 && errno != EAGAIN)) {
        leave(wires, wire, i, now_us);
        return;
    }
    lane->busy = got > 0;
    if (got > 0) {
        lane->free_ns = (size_t)got < most
                            ? now_ns
                            : lane->free_ns + (uint64_t)got * wires->byte_ns;
        wires->counts.bytes += (uint64_t)got;
        lane->held = damage(wires, lane, lane->bytes, (size_t)got);
        give(wires, wire, i, now_us);
    }
}

/* --- all of them ---------------------------------------------------------- */

bool uart_wires_init(struct uart_wires *wires,
                     const struct uart_settings *settings) {
    memset(wires, 0, sizeof *wires);
    wires->settings = *settings;
    wires->byte_ns = BITS_A_BYTE * UINT64_C(1000000000) / settings->baud;
    wires->tick_us = BYTES_A_LOOK * wires->byte_ns / 1000;
    if (wires->tick_us < UART_TICK_US)
        wires->tick_us = UART_TICK_US;
    wires->unread_unit = unread_unit();
    return wires->unread_unit > 0;
}

static struct uart_wire *add(struct uart_wires *wires) {
    unsigned place = wires->count;
    if (place == UART_WIRES_MAX) {
        errno = EINVAL;
        return NULL;
    }
    struct uart_wire *wire = &wires->wire[wires->count++];
    memset(wire, 0, sizeof *wire);
    for (unsigned i = 0; i < 2; i++) {
        wire->end[i].listener = wire->end[i].fd = -1;
        init_lane(&wire->lane[i], &wires->settings, 2 * place + i);
    }
    return wire;
}

bool uart_wires_join(struct uart_wires *wires, int fd0, int fd1) {
    struct uart_wire *wire = add(wires);
    if (wire != NULL) {
        take(wires, wire, 0, fd0);
        take(wires, wire, 1, fd1);
    }
    return wire != NULL;
}

bool uart_wires_add(struct uart_wires *wires, const char *text) {
    struct uart_wire *wire = add(wires);
    for (unsigned i = 0; wire != NULL && i < 2; i++) {
        struct uart_end *end = &wire->end[i];
        bool listens = *text == '@';
        text += listens;
        size_t size = strcspn(text, ",");
        if (size == 0 || size >= sizeof end->path ||
            text[size] != (i == 0 ? ',' : '\0')) {
            errno = EINVAL;
            return false;
        }
        memcpy(end->path, text, size);
        if (listens && !listen_at(end))
            return false;
        text += size + 1 - i;
    }
    return wire != NULL;
}

/* An end that is away: calls it, if that is due.  When it is, if it stays so.
 */
static uint64_t reach(struct uart_wires *wires, struct uart_wire *wire,
                      unsigned i, uint64_t now_us) {
    struct uart_end *end = &wire->end[i];
    if (end->fd >= 0 || end->path[0] == '\0' || end->listener >= 0)
        return UINT64_MAX;
    if (now_us >= end->call_us) {
        if (call(wires, wire, i))
            return UINT64_MAX;
        end->call_us = now_us + UART_CALL_US;
    }
    return end->call_us;
}

/* What is waited for: fds[3 i + ..] of each end. */
static nfds_t events(const struct uart_wires *wires, struct pollfd *fds) {
    nfds_t used = 0;
    for (unsigned k = 0; k < 2 * wires->count; k++) {
        const struct uart_wire *wire = &wires->wire[k / 2];
        bool waits = !wire->lane[k % 2].busy && wire->lane[k % 2].held == 0;
        fds[used++] =
            (struct pollfd){waits ? wire->end[k % 2].fd : -1, POLLIN, 0};
        fds[used++] = (struct pollfd){wire->end[k % 2].listener, POLLIN, 0};
    }
    return used;
}

static void look(struct uart_wires *wires, uint64_t now_us) {
    struct pollfd fds[4 * UART_WIRES_MAX];
    if (poll(fds, events(wires, fds), 0) <= 0)
        return;
    for (unsigned k = 0; k < 2 * wires->count; k++) {
        struct uart_wire *wire = &wires->wire[k / 2];
        if (fds[2 * k].revents != 0) {
            wire->lane[k % 2].busy = true;
            wire->lane[k % 2].free_ns = now_us * 1000;
        }
        if (fds[2 * k + 1].revents != 0)
            answer(wires, wire, k % 2, now_us);
    }
}

uint64_t uart_wires_carry(struct uart_wires *wires, uint64_t now_us) {
    uint64_t next_us = UINT64_MAX;
    look(wires, now_us);
    for (unsigned k = 0; k < 2 * wires->count; k++) {
        struct uart_wire *wire = &wires->wire[k / 2];
        struct uart_lane *lane = &wire->lane[k % 2];
        if (lane->busy || lane->held > 0)
            carry(wires, wire, k % 2, now_us);
        uint64_t at_us = lane->busy || lane->held > 0
                             ? now_us + wires->tick_us
                             : reach(wires, wire, k % 2, now_us);
        next_us = at_us < next_us ? at_us : next_us;
    }
    return next_us;
}

static struct timespec time_of(uint64_t us) {
    return (struct timespec){(time_t)(us / 1000000),
                             (long)(us % 1000000) * 1000};
}

/* Where bytes go, others that come are looked at together with them. */
void uart_wires_wait(const struct uart_wires *wires, uint64_t until_us) {
    struct pollfd fds[4 * UART_WIRES_MAX];
    uint64_t now_us = chance_now_us();
    if (until_us <= now_us)
        return;
    if (until_us <= now_us + wires->tick_us) {
        struct timespec until = time_of(until_us); /* clock: a wire's rate */
        (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        return;
    }
    uint64_t left_ms = (until_us - now_us) / 1000;
    (void)poll(fds, events(wires, fds),
               left_ms < POLL_MS ? (int)left_ms : POLL_MS);
}

void uart_wires_close(struct uart_wires *wires) {
    for (unsigned k = 0; k < 2 * wires->count; k++) {
        struct uart_end *end = &wires->wire[k / 2].end[k % 2];
        if (end->fd >= 0)
            close(end->fd);
        if (end->listener >= 0) {
            close(end->listener);
            (void)unlink(end->path);
        }
    }
    wires->count = 0;
}
