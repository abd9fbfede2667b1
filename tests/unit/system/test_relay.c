/* The relay that the system tests put between UARTs: its rate, what it counts,
 * and what becomes of an end that does not read or goes away. */
#define TEST_OWN_MAIN
#include <errno.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "tests/system/relay/chance.h"
#include "tests/system/relay/uart.h"
#include "tests/unit/test.h"

enum { CHUNK = 4096, SENT_MAX = 400000 };

static struct uart_wires wires;
static uint64_t now;
static int sender, receiver;
static uint8_t sent[SENT_MAX], heard[SENT_MAX];
static size_t sent_bytes, heard_bytes;

/* One wire between two sockets of the test's own. */
static void join(const struct uart_settings *settings) {
    int from[2], to[2];
    int type = SOCK_STREAM | SOCK_NONBLOCK;
    now = 5000000;
    sent_bytes = heard_bytes = 0;
    assert_true(uart_wires_init(&wires, settings));
    assert_int_equal(socketpair(AF_UNIX, type, 0, from), 0);
    assert_int_equal(socketpair(AF_UNIX, type, 0, to), 0);
    sender = from[0];
    receiver = to[0];
    assert_true(uart_wires_join(&wires, from[1], to[1]));
}

static void part(void) {
    uart_wires_close(&wires);
    close(sender);
    close(receiver);
}

/* As much as the sender's socket takes, of `most` in all. */
static void send_on(size_t most) {
    while (sent_bytes < most) {
        size_t left = most - sent_bytes;
        ssize_t put = send(sender, sent + sent_bytes,
                           left < CHUNK ? left : CHUNK, MSG_NOSIGNAL);
        if (put <= 0)
            return;
        sent_bytes += (size_t)put;
    }
}

static void hear(void) {
    ssize_t got;
    while ((got = read(receiver, heard + heard_bytes, SENT_MAX - heard_bytes)) >
           0)
        heard_bytes += (size_t)got;
}

/* As long as there is something to carry, or for so long. */
static void carry(uint64_t for_us, bool reads) {
    uint64_t until = now + for_us;
    while (now < until) {
        uint64_t next = uart_wires_carry(&wires, now);
        if (reads)
            hear();
        now = next < until ? next : until;
    }
}

static void fill(void) {
    for (size_t i = 0; i < SENT_MAX; i++)
        sent[i] = (uint8_t)(i * 7 + i / 251);
}

TEST(rates) {
    static const uint32_t baud[] = {19200, 115200, 921600};
    for (size_t i = 0; i < sizeof baud / sizeof baud[0]; i++) {
        join(&(struct uart_settings){.seed = 1, .baud = baud[i]});
        uint64_t begun = now;
        while (now < begun + 3000000) {
            send_on(SENT_MAX);
            carry(2000, true);
        }
        double rate = (double)heard_bytes * 10 / 3;
        assert_true(rate > 0.95 * baud[i] && rate < 1.05 * baud[i]);
        assert_memory_equal(heard, sent, heard_bytes);
        part();
    }
}

/* What a fifth of a second of the clock carries, in bits a second. */
static double rate_now(void) {
    join(&(struct uart_settings){.seed = 1, .baud = 115200, .fifo = 4096});
    uint64_t begun = chance_now_us(), at = begun;
    while (at < begun + 200000) {
        send_on(SENT_MAX);
        uint64_t next = uart_wires_carry(&wires, at = chance_now_us());
        hear();
        uart_wires_wait(&wires, next);
    }
    double rate = (double)heard_bytes * 1e7 / (double)(at - begun);
    part();
    return rate;
}

/* Never faster than the line, and as fast where other work on the machine has
 * not held this program up, once in five minutes.  clock: it is what is meant.
 */
TEST(rate_by_the_clock) {
    double rate = 0;
    for (int round = 0; round < 1500 && rate < 0.95 * 115200; round++) {
        rate = rate_now();
        assert_true(rate < 1.05 * 115200);
    }
    assert_true(rate > 0.95 * 115200);
}

/* An idle wire saves up no time, and looks are four bytes apart. */
TEST(bytes_take_their_time) {
    join(&(struct uart_settings){.seed = 1, .baud = 1000});
    carry(1000000, true);
    send_on(6);
    carry(39000, true);
    assert_int_equal(heard_bytes, 0);
    carry(1000, true);
    assert_int_equal(heard_bytes, 3);
    carry(50000, true);
    assert_int_equal(heard_bytes, 6);
    part();
}

/* Sends all, and returns how many bytes of equal place differ. */
static size_t differing(size_t size) {
    size_t different = 0;
    while (sent_bytes < size) {
        send_on(size);
        carry(10000, true);
    }
    carry(5000000, true);
    for (size_t i = 0; i < heard_bytes; i++)
        different += heard[i] != sent[i];
    assert_int_equal(wires.counts.bytes, size);
    return different;
}

TEST(flips) {
    join(&(struct uart_settings){.seed = 3, .baud = 921600, .flip_bytes = 100});
    size_t different = differing(100000);
    assert_int_equal(heard_bytes, 100000);
    assert_int_equal(different, wires.counts.flips);
    assert_in_range(different, 900, 1100);
    part();
}

TEST(drops) {
    join(
        &(struct uart_settings){.seed = 4, .baud = 921600, .drop_bytes = 1000});
    (void)differing(100000);
    assert_int_equal(heard_bytes + wires.counts.drops, 100000);
    assert_in_range(wires.counts.drops, 80, 120);
    part();
}

TEST(bursts) {
    join(&(struct uart_settings){
        .seed = 5, .baud = 921600, .burst_bytes = 1000});
    size_t different = differing(100000);
    assert_int_equal(heard_bytes, 100000);
    assert_in_range(wires.counts.bursts, 80, 120);
    assert_in_range(wires.counts.burst_bytes, 8 * wires.counts.bursts,
                    64 * wires.counts.bursts);
    /* One byte of noise in 256 is the right one. */
    assert_in_range(different, wires.counts.burst_bytes * 95 / 100,
                    wires.counts.burst_bytes);
    part();
}

TEST(the_same_seed_does_the_same) {
    static uint8_t first[20000];
    for (unsigned i = 0; i < 3; i++) {
        join(&(struct uart_settings){.seed = i / 2 + 1,
                                     .baud = 921600,
                                     .flip_bytes = 50,
                                     .burst_bytes = 900});
        (void)differing(sizeof first);
        if (i == 0)
            memcpy(first, heard, sizeof first);
        else
            assert_int_equal(memcmp(first, heard, sizeof first) == 0, i == 1);
        part();
    }
}

/* Without `fifo`, nothing is lost, and the sender waits. */
TEST(a_receiver_is_waited_for) {
    join(&(struct uart_settings){.seed = 1, .baud = 921600});
    for (unsigned i = 0; i < 500; i++) {
        send_on(SENT_MAX);
        carry(10000, false);
    }
    assert_true(sent_bytes < SENT_MAX);
    hear();
    size_t size = sent_bytes;
    carry(100000000, true);
    assert_int_equal(heard_bytes, size);
    assert_memory_equal(heard, sent, size);
    assert_int_equal(wires.counts.overruns, 0);
    part();
}

TEST(a_receiver_overruns) {
    join(&(struct uart_settings){.seed = 1, .baud = 19200, .fifo = 1});
    send_on(1000);
    carry(100000, true);
    size_t taken = heard_bytes;
    assert_in_range(taken, 180, 192);
    assert_int_equal(wires.counts.overruns, 0);
    carry(200000, false);
    hear();
    assert_in_range(heard_bytes - taken, 1, 4); /* those of one look */
    assert_int_equal(wires.counts.overruns, wires.counts.bytes - heard_bytes);
    assert_in_range(wires.counts.overruns, 370, 390);
    carry(1000000, true); /* and goes on */
    assert_int_equal(heard_bytes + wires.counts.overruns, 1000);
    part();
}

static int connected(const char *path) {
    struct sockaddr_un there = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
    snprintf(there.sun_path, sizeof there.sun_path, "%s", path);
    assert_int_equal(connect(fd, (struct sockaddr *)&there, sizeof there), 0);
    return fd;
}

static int listening(const char *path) {
    struct sockaddr_un here = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
    snprintf(here.sun_path, sizeof here.sun_path, "%s", path);
    (void)unlink(path);
    assert_int_equal(bind(fd, (struct sockaddr *)&here, sizeof here), 0);
    assert_int_equal(listen(fd, 4), 0);
    return fd;
}

/* One end is killed and comes back, twice: the other stays as it is. */
TEST(an_end_goes_and_comes) {
    char folder[] = "/tmp/relay.XXXXXX", calls[64], text[200], made[64];
    assert_non_null(mkdtemp(folder));
    snprintf(calls, sizeof calls, "%s/a", folder);
    snprintf(made, sizeof made, "%s/b", folder);
    snprintf(text, sizeof text, "%s,@%s", calls, made);
    now = 5000000;
    sent_bytes = heard_bytes = 0;
    assert_true(
        uart_wires_init(&wires, &(struct uart_settings){.baud = 921600}));
    assert_true(uart_wires_add(&wires, text));
    sender = connected(made);
    send_on(100);
    carry(100000, false);
    assert_int_equal(wires.counts.unheard, 100);
    for (unsigned i = 0; i < 2; i++) {
        int listener = listening(calls);
        carry(100000, false);
        receiver = accept4(listener, NULL, NULL, SOCK_NONBLOCK);
        assert_true(receiver >= 0);
        send_on(sent_bytes + 50);
        carry(100000, true);
        assert_int_equal(heard_bytes, 50 * (i + 1));
        close(receiver);
        close(listener);
        carry(100000, false);
    }
    assert_int_equal(wires.counts.connections, 3);
    uart_wires_close(&wires);
    assert_int_equal(access(made, F_OK), -1);
    close(sender);
    (void)unlink(calls);
    assert_int_equal(rmdir(folder), 0);
}

TEST(wrong_texts) {
    static const char *const texts[] = {"",    ",",        "/a",  "/a,",
                                        ",/a", "/a,/b,/c", "@,/b"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        assert_true(
            uart_wires_init(&wires, &(struct uart_settings){.baud = 9600}));
        errno = 0;
        assert_false(uart_wires_add(&wires, texts[i]));
        assert_int_equal(errno, EINVAL);
        uart_wires_close(&wires);
    }
}

int main(void) {
    fill();
    return test_run();
}
