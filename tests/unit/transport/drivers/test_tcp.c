/* Pipes over TCP: pairs are what they claim to be, a link runs over them, and
 * an end that goes away is noticed. */

#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "held_clock.h"
#include "transport/drivers/tcp.h"
#include "tests/unit/test.h"

/* clock: within minutes. */
static bool has_input(int fd) {
    struct pollfd wait = {fd, POLLIN, 0};
    return poll(&wait, 1, WAIT_MS) == 1;
}

TEST(a_pair_is_connected_and_set_up) {
    int fds[2], on = 0, bytes[2];
    char byte;
    socklen_t size = sizeof on;
    assert_int_equal(tcp_pair(fds), 0);
    for (int i = 0; i < 2; i++) {
        assert_true((fcntl(fds[i], F_GETFL) & O_NONBLOCK) != 0);
        assert_true((fcntl(fds[i], F_GETFD) & FD_CLOEXEC) != 0);
        assert_int_equal(
            getsockopt(fds[i], IPPROTO_TCP, TCP_NODELAY, &on, &size), 0);
        assert_true(on != 0);
        assert_int_equal(tcp_buffers(fds[i], &bytes[0], &bytes[1]), 0);
        /* Linux doubles what it is asked for. */
        assert_int_equal(bytes[0], 2 * TCP_BUFFER_BYTES);
        assert_int_equal(bytes[1], 2 * TCP_BUFFER_BYTES);
    }
    assert_int_equal(write(fds[0], "x", 1), 1);
    assert_true(has_input(fds[1]));
    assert_int_equal(read(fds[1], &byte, 1), 1);
    assert_int_equal(byte, 'x');
    close(fds[0]);
    close(fds[1]);
}

TEST(a_pipe_tells_room_and_end) {
    static uint8_t bytes[100000];
    int fds[2], taken = 1;
    struct tcp_pipe a, b;
    assert_int_equal(tcp_pair(fds), 0);
    tcp_pipe_init(&a, fds[0]);
    tcp_pipe_init(&b, fds[1]);
    struct link_pipe from = tcp_link_pipe(&a), to = tcp_link_pipe(&b);
    assert_int_equal(to.receive(to.context, bytes, sizeof bytes), 0);
    assert_int_equal(tcp_events(&a), POLLIN);
    size_t sent = 0;
    for (unsigned i = 0; taken > 0; i++) {
        assert_true(i < 100);
        taken = from.send(from.context, bytes, sizeof bytes);
        assert_true(taken >= 0);
        sent += (size_t)taken;
    }
    assert_int_equal(tcp_events(&a), POLLIN | POLLOUT);
    size_t received = 0;
    while (received < sent) {
        assert_true(has_input(fds[1]));
        int got = to.receive(to.context, bytes, sizeof bytes);
        assert_true(got > 0);
        received += (size_t)got;
    }
    assert_int_equal(from.send(from.context, bytes, 1), 1);
    assert_int_equal(tcp_events(&a), POLLIN);
    close(fds[1]);
    assert_true(has_input(fds[0]));
    assert_int_equal(from.receive(from.context, bytes, 10), LINK_PIPE_CLOSED);
    assert_int_equal(from.send(from.context, bytes, 10), LINK_PIPE_CLOSED);
    assert_int_equal(tcp_events(&a), 0);
    close(fds[0]);
}

struct end {
    struct tcp_pipe pipe;
    struct link *link;
    void *memory;
    int fd;
};

static void open_end(struct end *end, int fd, unsigned who, uint16_t window) {
    struct link_config c = {.epoch = 5 + who,
                            .node = (uint16_t)who,
                            .peer_node = (uint16_t)(1 - who),
                            .window = window};
    end->fd = fd;
    tcp_pipe_init(&end->pipe, fd);
    c.pipe = tcp_link_pipe(&end->pipe);
    end->memory = malloc(link_bytes(&c));
    end->link = link_init(end->memory, link_bytes(&c), &c);
    assert_non_null(end->link);
}

TEST(a_link_over_tcp) {
    enum { MESSAGES = 3000, SIZE = 1600 };
    static uint8_t bytes[SIZE];
    for (uint16_t window = 1; window <= 64; window *= 4) {
        struct end ends[2];
        int fds[2];
        unsigned written[2] = {0, 0}, read[2] = {0, 0};
        uint64_t begin = clock_us();
        assert_int_equal(tcp_pair(fds), 0);
        open_end(&ends[0], fds[0], 0, window);
        open_end(&ends[1], fds[1], 1, window);
        while (read[0] < MESSAGES || read[1] < MESSAGES) {
            assert_true(clock_us() - begin < WAIT_US);
            for (unsigned who = 0; who < 2; who++) {
                struct link *link = ends[who].link;
                struct link_message message;
                link_poll(link, clock_us());
                while (link_read(link, &message)) {
                    uint32_t number;
                    memcpy(&number, message.data, sizeof number);
                    assert_int_equal(number, read[who]);
                    assert_int_equal(message.size, SIZE);
                    read[who]++;
                    link_release(link);
                }
                while (written[who] < MESSAGES &&
                       link_write(link, &written[who], 4, bytes + 4,
                                  SIZE - 4) == 0)
                    written[who]++;
            }
        }
        close(fds[1]);
        link_poll(ends[0].link, clock_us());
        link_poll(ends[0].link, clock_us());
        assert_true(link_state(ends[0].link) == LINK_DOWN);
        assert_int_equal(link_statistics(ends[0].link)->bad_crc, 0);
        close(fds[0]);
        free(ends[0].memory);
        free(ends[1].memory);
    }
}

/* What poll has found spares one call, and no more: bytes and an end that come
 * after it are not missed. */
TEST(what_was_heard_spares_one_call) {
    uint8_t byte = 0;
    int fds[2];
    struct tcp_pipe pipe;
    assert_int_equal(tcp_pair(fds), 0);
    tcp_pipe_init(&pipe, fds[1]);
    struct link_pipe to = tcp_link_pipe(&pipe);
    struct pollfd wait = {fds[1], tcp_events(&pipe), 0};
    assert_int_equal(poll(&wait, 1, 0), 0);
    tcp_heard(&pipe, wait.revents);
    assert_int_equal(write(fds[0], "x", 1), 1);
    assert_true(has_input(fds[1]));
    assert_int_equal(to.receive(to.context, &byte, 1), 0);
    assert_int_equal(to.receive(to.context, &byte, 1), 1);
    assert_int_equal(byte, 'x');
    close(fds[0]);
    assert_true(has_input(fds[1]));
    tcp_heard(&pipe, POLLIN);
    assert_int_equal(to.receive(to.context, &byte, 1), LINK_PIPE_CLOSED);
    tcp_heard(&pipe, 0);
    assert_int_equal(to.receive(to.context, &byte, 1), LINK_PIPE_CLOSED);
    close(fds[1]);
}
