/* Two ends of a wire, a link at each, stepped by turns: what the tests of wires
 * over TCP and at paths share. */
#ifndef TESTS_WIRE_ENDS_H
#define TESTS_WIRE_ENDS_H

#include <stdlib.h>
#include <string.h>

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "held_clock.h"
#include "transport/drivers/secure_sodium.h"
#include "transport/drivers/tcp_wire.h"
#include "tests/unit/test.h"

static const uint8_t key[SECURE_KEY_BYTES] = "the cube's key, 32 bytes of it ";

struct end {
    struct tcp_wire wire;
    struct link *link;
    void *memory;
    uint32_t written, read;
};

/* A port that was free a moment ago. */
static inline struct tcp_address free_address(int family) {
    struct tcp_address a;
    assert_int_equal(
        tcp_address_parse(&a, family == AF_INET ? "127.0.0.1:1" : "[::1]:1"),
        0);
    if (family == AF_INET)
        ((struct sockaddr_in *)&a.to)->sin_port = 0;
    else
        ((struct sockaddr_in6 *)&a.to)->sin6_port = 0;
    int fd = socket(family, SOCK_STREAM, 0);
    assert_true(fd >= 0);
    assert_int_equal(bind(fd, &a.to.any, a.size), 0);
    assert_int_equal(getsockname(fd, &a.to.any, &a.size), 0);
    close(fd);
    return a;
}

static inline void open_end(struct end *end, unsigned who,
                            const struct tcp_address *address,
                            const uint8_t *with) {
    struct tcp_wire_config wire = {
        .address = *address, .listens = who == 1, .insecure = true};
    struct link_config c = {.epoch = 5 + who,
                            .node = (uint16_t)who,
                            .peer_node = (uint16_t)(1 - who),
                            .window = 8};
    memset(end, 0, sizeof *end);
    wire.suite = with == NULL ? NULL : &secure_sodium;
    wire.key = with;
    assert_int_equal(tcp_wire_open(&end->wire, &wire), 0);
    c.pipe = tcp_wire_pipe(&end->wire);
    end->memory = malloc(link_bytes(&c));
    end->link = link_init(end->memory, link_bytes(&c), &c);
    assert_non_null(end->link);
}

static inline void close_end(struct end *end) {
    tcp_wire_close(&end->wire);
    free(end->memory);
}

static inline void step(struct end *end) {
    static uint8_t bytes[1500];
    struct link_message message;
    link_poll(end->link, clock_us());
    while (link_read(end->link, &message)) {
        uint32_t number;
        memcpy(&number, message.data, sizeof number);
        assert_int_equal(number, end->read);
        end->read++;
        link_release(end->link);
    }
    while (link_write(end->link, &end->written, 4, bytes, sizeof bytes) == 0)
        end->written++;
}

/* Steps until both have read so many more. */
static inline bool exchange(struct end *ends, uint32_t messages) {
    uint32_t want[2] = {ends[0].read + messages, ends[1].read + messages};
    uint64_t begin = clock_us();
    while (ends[0].read < want[0] || ends[1].read < want[1]) {
        step(&ends[0]);
        step(&ends[1]);
        if (clock_us() - begin > WAIT_US)
            return false;
    }
    return true;
}

static inline int stranger(const struct tcp_address *at) {
    int fd = socket(at->to.any.sa_family, SOCK_STREAM, 0);
    assert_true(fd >= 0);
    assert_int_equal(tcp_prepare(fd), 0);
    (void)connect(fd, &at->to.any, at->size);
    return fd;
}

#endif
