/* Serial wires: pseudo-terminals pass every byte, wires that break come back, a
 * port in use is named with its user, and a link fills a paced wire. */

#include <fcntl.h>
#include <linux/magic.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/vfs.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include "tests/unit/emulated.h"
#include "transport/drivers/serial_port.h"
#include "tests/unit/test.h"

/* clock: minutes, for what has been sent already. */
static void wait_for(int fd) {
    struct pollfd wait = {fd, POLLIN, 0};
    assert_int_equal(poll(&wait, 1, 120000), 1);
}

/* A pseudo-terminal; where this machine has none, the test is skipped. */
static void make_pair(int fds[2]) {
    struct statfs pts;
    if (statfs("/dev/pts", &pts) != 0 || pts.f_type != DEVPTS_SUPER_MAGIC) {
        print_message("there are no pseudo-terminals here: no /dev/pts\n");
        skip();
    }
    assert_int_equal(serial_pair(fds), 0);
}

TEST(a_pair_passes_every_byte) {
    int fds[2];
    make_pair(fds);
    for (unsigned from = 0; from < 2; from++) {
        uint8_t sent[256], got[256];
        size_t have = 0;
        for (unsigned i = 0; i < 256; i++)
            sent[i] = (uint8_t)i;
        assert_int_equal(write(fds[from], sent, 256), 256);
        while (have < 256) {
            wait_for(fds[1 - from]);
            ssize_t n = read(fds[1 - from], got + have, 256 - have);
            assert_true(n > 0);
            have += (size_t)n;
        }
        assert_memory_equal(sent, got, 256);
    }
    assert_true((fcntl(fds[0], F_GETFL) & O_NONBLOCK) != 0);
    assert_true((fcntl(fds[1], F_GETFD) & FD_CLOEXEC) != 0);
    close(fds[0]);
    close(fds[1]);
}

/* The slave goes and comes back; then the master goes for good. */
TEST(a_wire_that_breaks_comes_back) {
    int fds[2];
    char path[64];
    uint8_t byte = 7;
    struct serial_pipe master, slave;
    make_pair(fds);
    assert_int_equal(ttyname_r(fds[1], path, sizeof path), 0);
    serial_pipe_init(&master, fds[0], 0);
    struct link_pipe up = serial_link_pipe(&master);
    assert_int_equal(up.receive(up.context, &byte, 1), 0);
    serial_close(fds[1]);
    assert_int_equal(up.receive(up.context, &byte, 1), LINK_PIPE_CLOSED);
    assert_int_equal(up.send(up.context, &byte, 1), LINK_PIPE_CLOSED);
    assert_int_equal(serial_events(&master), 0);
    fds[1] = serial_open(path, 115200, false);
    assert_true(fds[1] >= 0);
    assert_int_equal(up.receive(up.context, &byte, 1), 0);
    assert_int_equal(up.send(up.context, &byte, 1), 1);
    wait_for(fds[1]);
    serial_pipe_init(&slave, fds[1], 0);
    struct link_pipe down = serial_link_pipe(&slave);
    assert_int_equal(down.receive(down.context, &byte, 1), 1);
    close(fds[0]);
    assert_int_equal(down.receive(down.context, &byte, 1), LINK_PIPE_CLOSED);
    serial_close(fds[1]);
    assert_int_equal(serial_open(path, 115200, false), -1);
}

TEST(rates_and_modes) {
    int fds[2];
    char path[64];
    struct termios t;
    make_pair(fds);
    assert_int_equal(ttyname_r(fds[1], path, sizeof path), 0);
    close(fds[1]);
    assert_int_equal(serial_open(path, 12345, false), -1);
    fds[1] = serial_open(path, 921600, true);
    assert_true(fds[1] >= 0);
    assert_int_equal(tcgetattr(fds[1], &t), 0);
    assert_int_equal(cfgetospeed(&t), B921600);
    assert_true((t.c_cflag & CRTSCTS) != 0);
    assert_true((t.c_cflag & (HUPCL | PARENB | CSTOPB)) == 0);
    serial_close(fds[1]);
    close(fds[0]);
}

/* A child has the port open; it must be named. */
TEST(a_port_in_use_says_by_whom) {
    int fds[2], ready[2];
    char byte, want[64];
    struct serial_port port;
    struct serial_port_settings settings = {.dtr = true, .rts = true};
    make_pair(fds);
    assert_int_equal(ttyname_r(fds[1], settings.name, sizeof settings.name), 0);
    assert_int_equal(pipe(ready), 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        close(fds[0]);
        (void)!write(ready[1], "x", 1);
        pause();
        _exit(0);
    }
    assert_int_equal(read(ready[0], &byte, 1), 1);
    close(fds[1]);
    assert_int_equal(serial_port_open(&port, &settings), -1);
    snprintf(want, sizeof want, "in use by process %d (", (int)child);
    assert_non_null(strstr(port.fault, want));
    assert_non_null(strstr(port.fault, settings.name));
    assert_int_equal(kill(child, SIGKILL), 0);
    assert_int_equal(waitpid(child, NULL, 0), child);
    /* It is looked for again while the pipe is used. */
    struct link_pipe pipe = serial_link_pipe(&port.pipe);
    for (unsigned i = 0; i < 6000 && port.pipe.fd < 0; i++) {
        uint8_t bytes[8];
        (void)pipe.receive(pipe.context, bytes, sizeof bytes);
        usleep(20000); /* clock: two minutes at most */
    }
    assert_true(port.pipe.fd >= 0);
    assert_int_equal(port.returned, 1);
    close(fds[0]);
    uint8_t bytes[8];
    assert_int_equal(pipe.receive(pipe.context, bytes, 8), LINK_PIPE_CLOSED);
    assert_int_equal(pipe.receive(pipe.context, bytes, 8), LINK_PIPE_CLOSED);
    assert_non_null(strstr(port.fault, "gone"));
    serial_port_close(&port);
    close(ready[0]);
    close(ready[1]);
}

/* Another process has made the pseudo-terminal and keeps both its ends open, as
 * socat does; it passes on what is sent. */
TEST(who_made_a_terminal_is_no_user) {
    int fds[2], ready[2];
    struct serial_port port;
    struct serial_port_settings settings = {.baud = 115200};
    uint8_t byte = 7;
    make_pair(fds);
    assert_int_equal(ttyname_r(fds[1], settings.name, sizeof settings.name), 0);
    assert_int_equal(pipe(ready), 0);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        close(ready[0]);
        do {
            wait_for(fds[0]);
        } while (read(fds[0], &byte, 1) == 1 && write(ready[1], &byte, 1) == 1);
        _exit(0);
    }
    close(fds[0]);
    close(fds[1]);
    close(ready[1]);
    if (serial_port_open(&port, &settings) != 0)
        fail_msg("%s", port.fault);
    struct link_pipe pipe = serial_link_pipe(&port.pipe);
    assert_int_equal(pipe.send(pipe.context, &byte, 1), 1);
    byte = 0;
    assert_int_equal(read(ready[0], &byte, 1), 1);
    assert_int_equal(byte, 7);
    assert_int_equal(kill(child, SIGKILL), 0);
    assert_int_equal(waitpid(child, NULL, 0), child);
    serial_port_close(&port);
    close(ready[0]);
}

/* A pseudo-terminal has no lasting name but that of a link, which leads to
 * another one when both ends were made anew. */
TEST(a_link_is_followed_each_time) {
    char directory[] = "/tmp/incode-serial.XXXXXX", path[64];
    int first[2], second[2];
    uint8_t byte = 7;
    struct serial_port port;
    struct serial_port_settings settings = {.baud = 921600};
    assert_non_null(mkdtemp(directory));
    snprintf(settings.name, sizeof settings.name, "%s/wire", directory);
    make_pair(first);
    make_pair(second);
    assert_int_equal(ttyname_r(first[1], path, sizeof path), 0);
    assert_int_equal(symlink(path, settings.name), 0);
    close(first[1]);
    assert_int_equal(serial_port_open(&port, &settings), 0);
    struct link_pipe pipe = serial_link_pipe(&port.pipe);
    assert_int_equal(write(first[0], &byte, 1), 1);
    wait_for(port.pipe.fd);
    assert_int_equal(pipe.receive(pipe.context, &byte, 1), 1);
    close(first[0]);
    assert_int_equal(pipe.receive(pipe.context, &byte, 1), LINK_PIPE_CLOSED);
    assert_int_equal(unlink(settings.name), 0);
    assert_int_equal(ttyname_r(second[1], path, sizeof path), 0);
    close(second[1]);
    assert_int_equal(symlink(path, settings.name), 0);
    for (unsigned i = 0; i < 6000 && port.returned == 0; i++) {
        (void)pipe.receive(pipe.context, &byte, 1);
        usleep(20000); /* clock: two minutes at most */
    }
    assert_int_equal(port.returned, 1);
    assert_int_equal(write(second[0], &byte, 1), 1);
    wait_for(port.pipe.fd);
    assert_int_equal(pipe.receive(pipe.context, &byte, 1), 1);
    serial_port_close(&port);
    close(second[0]);
    assert_int_equal(unlink(settings.name), 0);
    assert_int_equal(symlink("/dev/null", settings.name), 0);
    assert_int_equal(serial_port_open(&port, &settings), -1);
    assert_non_null(strstr(port.fault, settings.name));
    serial_port_close(&port);
    assert_int_equal(unlink(settings.name) | rmdir(directory), 0);
}

TEST(ports_that_are_not_there) {
    static const char *const names[] = {"usb:no such number", "at:9-9.9",
                                        "/dev/ttyNONE7", "/dev/pts/99999"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        struct serial_port port;
        struct serial_port_settings settings = {.baud = 115200};
        snprintf(settings.name, sizeof settings.name, "%s", names[i]);
        assert_int_equal(serial_port_open(&port, &settings), -1);
        /* Without /sys there is no list of ports to look a number up in. */
        const char *what = i < 2 && access("/sys/class/tty", F_OK) != 0
                               ? "is /sys mounted?"
                               : "plug ";
        assert_non_null(strstr(port.fault, what));
        serial_port_close(&port);
    }
}

/* --- paced wires ---------------------------------------------------------- */

/* Real descriptors and the real driver, in the test's own time: between two
 * socket pairs the relay carries baud / 10 bytes a second each way. */
static uint64_t now;
static uint64_t test_clock(void) {
    return now;
}

struct end {
    struct serial_pipe pipe;
    struct link *link;
    void *memory;
    size_t bytes;
    uint64_t written, read;
};

struct lane {
    int from, to;
    double credit, until_flip;
};

struct wire {
    uint32_t baud;
    uint32_t step_us; /* of time: a byte's, within bounds */
    double error_rate;
    uint64_t random, flips;
    struct end ends[2];
    struct lane lanes[2];
    int fds[4];
};

enum { STEP_US_MIN = 20, STEP_US_MAX = 200, MESSAGE = 1600, TRANSFER = 65536 };

/* Bits until the next error, about exponential: a sum of many small chances. */
static double next_flip(struct wire *wire) {
    wire->random = wire->random * 6364136223846793005u + 1442695040888963407u;
    double u = (double)(wire->random >> 11) * 0x1p-53, sum = 0, term;
    if (wire->error_rate <= 0)
        return 1e300;
    /* -ln(1 - u) by its series. */
    term = u = u > 0.999 ? 0.999 : u;
    for (int k = 1; k < 2000 && term > 1e-9; k++, term *= u)
        sum += term / k;
    return sum / wire->error_rate;
}

static void carry(struct wire *wire, struct lane *lane) {
    uint8_t bytes[64];
    lane->credit += wire->step_us * 1e-7 * wire->baud;
    size_t most =
        lane->credit > sizeof bytes ? sizeof bytes : (size_t)lane->credit;
    ssize_t n = most == 0 ? 0 : read(lane->from, bytes, most);
    if (n <= 0) {
        /* An idle wire keeps nothing but the part of a byte. */
        lane->credit = lane->credit > 1 ? 1 : lane->credit;
        return;
    }
    lane->credit -= (double)n;
    for (ssize_t i = 0; i < n; i++) {
        lane->until_flip -= 8;
        if (lane->until_flip < 0) {
            bytes[i] ^= (uint8_t)(1u << (wire->random >> 60 & 7));
            lane->until_flip = next_flip(wire);
            wire->flips++;
        }
    }
    assert_int_equal(write(lane->to, bytes, (size_t)n), n);
}

static void open_wire(struct wire *wire, uint32_t baud, double error_rate) {
    memset(wire, 0, sizeof *wire);
    wire->baud = baud;
    wire->step_us = 10000000 / baud;
    wire->step_us = wire->step_us < STEP_US_MIN   ? STEP_US_MIN
                    : wire->step_us > STEP_US_MAX ? STEP_US_MAX
                                                  : wire->step_us;
    wire->error_rate = error_rate;
    wire->random = baud + 17;
    for (unsigned i = 0; i < 4; i += 2) {
        assert_int_equal(
            socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, wire->fds + i),
            0);
    }
    wire->lanes[0] = (struct lane){wire->fds[1], wire->fds[2], 0, 0};
    wire->lanes[1] = (struct lane){wire->fds[2], wire->fds[1], 0, 0};
    for (unsigned who = 0; who < 2; who++) {
        struct end *end = &wire->ends[who];
        struct link_config c = {.epoch = 7 + who,
                                .node = (uint16_t)who,
                                .peer_node = (uint16_t)(1 - who),
                                .window = 14,
                                .message_max = 1608};
        link_for_serial(&c, baud);
        serial_pipe_init(&end->pipe, wire->fds[3 * who], baud);
        end->pipe.now_us = test_clock;
        end->pipe.ahead_us = now;
        c.pipe = serial_link_pipe(&end->pipe);
        end->bytes = link_bytes(&c);
        end->memory = malloc(end->bytes);
        assert_non_null(end->memory);
        end->link = link_init(end->memory, end->bytes, &c);
        assert_non_null(end->link);
        wire->lanes[who].until_flip = next_flip(wire);
    }
}

/* Moves `transfers` times 64 KB each way; returns the payload's share of
 * baud / 10. */
static double transfer(struct wire *wire, unsigned transfers) {
    static uint8_t bytes[MESSAGE];
    uint64_t wanted = (uint64_t)transfers * TRANSFER, begin = 0;
    while (wire->ends[0].read < wanted || wire->ends[1].read < wanted) {
        now += wire->step_us;
        for (unsigned who = 0; who < 2; who++) {
            struct end *end = &wire->ends[who];
            struct link_message message;
            link_poll_receive(end->link, now);
            while (link_read(end->link, &message)) {
                uint64_t at;
                memcpy(&at, message.data, sizeof at);
                assert_true(at == end->read);
                end->read += message.size;
                link_release(end->link);
            }
            while (link_state(end->link) == LINK_UP && end->written < wanted) {
                uint64_t left = wanted - end->written;
                size_t size = left < MESSAGE ? left : MESSAGE;
                memcpy(bytes, &end->written, 8);
                if (link_write(end->link, bytes, size, NULL, 0) != 0)
                    break;
                begin = begin == 0 ? now : begin;
                end->written += size;
            }
            link_poll_send(end->link, now);
        }
        carry(wire, &wire->lanes[0]);
        carry(wire, &wire->lanes[1]);
        assert_true(begin == 0 || now - begin < 60000000);
    }
    return (double)wanted / (1e-6 * (double)(now - begin)) / (0.1 * wire->baud);
}

static void close_wire(struct wire *wire) {
    for (unsigned i = 0; i < 4; i++)
        close(wire->fds[i]);
    free(wire->ends[0].memory);
    free(wire->ends[1].memory);
}

/* A message from end 0, and its echo. */
static void echo(struct wire *wire, size_t size) {
    static uint8_t bytes[MESSAGE];
    struct link_message message;
    bool back = false;
    assert_int_equal(link_write(wire->ends[0].link, bytes, size, NULL, 0), 0);
    while (!back) {
        now += wire->step_us;
        for (unsigned who = 0; who < 2; who++) {
            struct link *link = wire->ends[who].link;
            link_poll_receive(link, now);
            while (link_read(link, &message)) {
                back = who == 0;
                assert_true(back || link_write(link, message.data, message.size,
                                               NULL, 0) == 0);
                link_release(link);
            }
            link_poll_send(link, now);
        }
        carry(wire, &wire->lanes[0]);
        carry(wire, &wire->lanes[1]);
    }
}

/* Short messages, long ones and both directions at once, in turn: what waits
 * behind others is not lost. */
TEST(a_clean_wire_resends_nothing) {
    static const uint32_t bauds[] = {19200, 57600, 115200, 921600, 3000000};
    for (size_t i = 0; i < sizeof bauds / sizeof bauds[0];
         i += SANITIZED ? 2 : 1) {
        struct wire wire;
        open_wire(&wire, bauds[i], 0);
        for (unsigned turn = 0; turn < 3; turn++) {
            for (unsigned k = 0; k < 20; k++)
                echo(&wire, 16);
            echo(&wire, MESSAGE);
            echo(&wire, 16);
            wire.ends[0].written = wire.ends[0].read = 0;
            wire.ends[1].written = wire.ends[1].read = 0;
            (void)transfer(&wire, bauds[i] < 100000 ? 1 : 2);
        }
        for (unsigned who = 0; who < 2; who++) {
            const struct link_statistics *s =
                link_statistics(wire.ends[who].link);
            if (s->retransmitted != 0 || s->timeouts != 0) {
                fail_msg("%u baud: %u frames again, %u timeouts", bauds[i],
                         (unsigned)s->retransmitted, (unsigned)s->timeouts);
            }
        }
        close_wire(&wire);
    }
}

TEST(a_link_fills_a_paced_wire) {
    static const uint32_t bauds[] = {115200, 921600, 3000000};
    for (size_t i = 0; i < sizeof bauds / sizeof bauds[0]; i++) {
        for (unsigned noisy = 0; noisy < 2; noisy++) {
            struct wire wire;
            open_wire(&wire, bauds[i], noisy ? 1e-5 : 0);
            double share = transfer(&wire, noisy ? 4 : 1);
            print_message("%u baud%s: %.1f %% of baud/10 each way, %zu bytes "
                          "of memory, %llu bit errors\n",
                          bauds[i], noisy ? ", 1e-5" : "", 100 * share,
                          wire.ends[0].bytes, (unsigned long long)wire.flips);
            assert_true(wire.ends[0].bytes <= 16384);
            assert_true(share >= (noisy ? 0.7 : 0.9) && share <= 1);
            assert_true((wire.flips > 0) == (noisy != 0));
            close_wire(&wire);
        }
    }
}

/* What is given to the kernel ahead of the wire is bounded by the clock. */
TEST(little_is_written_ahead) {
    static uint8_t bytes[4096];
    int fds[2];
    struct serial_pipe pipe;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, fds),
                     0);
    serial_pipe_init(&pipe, fds[0], 100000);
    pipe.now_us = test_clock;
    pipe.ahead_us = now;
    struct link_pipe p = serial_link_pipe(&pipe);
    assert_int_equal(p.send(p.context, bytes, 4096), SERIAL_AHEAD_BYTES);
    assert_int_equal(p.send(p.context, bytes, 4096), 0);
    assert_true(serial_wait_us(&pipe) > 1000 && serial_wait_us(&pipe) < 60000);
    now += 10000; /* 100 bytes */
    assert_int_equal(p.send(p.context, bytes, 4096), 0);
    assert_int_equal(p.send(p.context, bytes, 100), 100);
    now += SERIAL_AHEAD_BYTES / 2 * 100 - 100;
    assert_int_equal(p.send(p.context, bytes, 4096), 0);
    now += 100;
    assert_int_equal(p.send(p.context, bytes, 4096), SERIAL_AHEAD_BYTES / 2);
    assert_int_equal(p.send(p.context, bytes, 1), 0);
    now += 10000000;
    assert_int_equal(p.send(p.context, bytes, 4096), SERIAL_AHEAD_BYTES);
    close(fds[0]);
    close(fds[1]);
}
