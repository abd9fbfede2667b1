#include "network.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "chance.h"

enum { WIRES_MAX = 64, PAIRS_MAX = 128, CHUNKS = 64, CHUNK_BYTES = 2048 };

struct chunk {
    uint64_t due_us;
    size_t begin, end;
    uint8_t bytes[CHUNK_BYTES];
};

/* One direction: what has come and is not due, or has no room. */
struct lane {
    struct chunk *chunk;
    unsigned first, count;
};

struct pair {
    int fd[2]; /* -1: unused */
    struct lane lane[2];
};

static struct {
    uint64_t random, bytes_a_fault, close_us, delay_us, next_close_us;
    unsigned wires;
    int listener[WIRES_MAX];
    uint16_t to[WIRES_MAX];
    struct pair pair[PAIRS_MAX];
    unsigned long flips, deletions, closes, connections;
} relay;

static struct sockaddr_in loopback(uint16_t port) {
    struct sockaddr_in a;
    memset(&a, 0, sizeof a);
    a.sin_family = AF_INET;
    a.sin_port = htons(port);
    a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return a;
}

bool network_add(const char *text) {
    unsigned from, to;
    int on = 1;
    if (relay.wires == WIRES_MAX || sscanf(text, "%u:%u", &from, &to) != 2)
        return false;
    struct sockaddr_in here = loopback((uint16_t)from);
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    (void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(fd, (struct sockaddr *)&here, sizeof here) != 0 ||
        listen(fd, 16) != 0)
        return false;
    relay.listener[relay.wires] = fd;
    relay.to[relay.wires++] = (uint16_t)to;
    return true;
}

static void close_pair(struct pair *p) {
    for (unsigned i = 0; i < 2; i++) {
        close(p->fd[i]);
        p->fd[i] = -1;
        p->lane[i].count = 0;
    }
}

static void take_connection(unsigned wire) {
    int on = 1;
    int fd = accept4(relay.listener[wire], NULL, NULL, SOCK_NONBLOCK);
    struct sockaddr_in there = loopback(relay.to[wire]);
    if (fd < 0)
        return;
    int other = socket(AF_INET, SOCK_STREAM, 0);
    for (unsigned i = 0; i < PAIRS_MAX; i++) {
        struct pair *p = &relay.pair[i];
        if (p->fd[0] < 0 &&
            connect(other, (struct sockaddr *)&there, sizeof there) == 0) {
            (void)fcntl(other, F_SETFL, O_NONBLOCK);
            (void)setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
            (void)setsockopt(other, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
            p->fd[0] = fd;
            p->fd[1] = other;
            relay.connections++;
            return;
        }
    }
    close(fd);
    close(other);
}

/* Changes a bit or deletes some bytes, by chance. */
static void damage(struct chunk *c) {
    size_t size = c->end;
    if (relay.bytes_a_fault == 0 ||
        chance_draw(&relay.random) % relay.bytes_a_fault >= size)
        return;
    if (chance_draw(&relay.random) % 2 == 0) {
        c->bytes[chance_draw(&relay.random) % size] ^=
            (uint8_t)(1u << chance_draw(&relay.random) % 8);
        relay.flips++;
    } else {
        c->end -= 1 + chance_draw(&relay.random) % size;
        relay.deletions++;
    }
}

/* False: the connection is over. */
static bool take(struct pair *p, unsigned from) {
    struct lane *lane = &p->lane[from];
    struct chunk *c = &lane->chunk[(lane->first + lane->count) % CHUNKS];
    ssize_t got = read(p->fd[from], c->bytes, CHUNK_BYTES);
    if (got <= 0)
        return got < 0 && errno == EAGAIN;
    c->begin = 0;
    c->end = (size_t)got;
    damage(c);
    c->due_us = chance_now_us();
    if (relay.delay_us > 0)
        c->due_us += chance_draw(&relay.random) % relay.delay_us;
    lane->count++;
    return true;
}

/* In order: a late chunk holds up the next.  False as above. */
static bool give(struct pair *p, unsigned from) {
    struct lane *lane = &p->lane[from];
    while (lane->count > 0 &&
           lane->chunk[lane->first].due_us <= chance_now_us()) {
        struct chunk *c = &lane->chunk[lane->first];
        if (c->begin < c->end) {
            ssize_t put = send(p->fd[1 - from], c->bytes + c->begin,
                               c->end - c->begin, MSG_NOSIGNAL);
            if (put < 0)
                return errno == EAGAIN;
            c->begin += (size_t)put;
        }
        if (c->begin == c->end) {
            lane->first = (lane->first + 1) % CHUNKS;
            lane->count--;
        }
    }
    return true;
}

static void serve(struct pair *p) {
    for (unsigned from = 0; from < 2 && p->fd[0] >= 0; from++) {
        bool open = give(p, from);
        if (open && p->lane[from].count < CHUNKS)
            open = take(p, from) && give(p, from);
        if (!open)
            close_pair(p);
    }
}

static void close_one(void) {
    unsigned i = (unsigned)(chance_draw(&relay.random) % PAIRS_MAX);
    for (unsigned k = 0; k < PAIRS_MAX; k++) {
        struct pair *p = &relay.pair[(i + k) % PAIRS_MAX];
        if (p->fd[0] >= 0) {
            close_pair(p);
            relay.closes++;
            return;
        }
    }
}

void network_run(const volatile sig_atomic_t *ended) {
    static struct pollfd fds[WIRES_MAX + 2 * PAIRS_MAX];
    while (!*ended) {
        nfds_t used = 0;
        int wait_ms = 50;
        for (unsigned i = 0; i < relay.wires; i++)
            fds[used++] = (struct pollfd){relay.listener[i], POLLIN, 0};
        for (unsigned i = 0; i < 2 * PAIRS_MAX; i++) {
            const struct pair *p = &relay.pair[i / 2];
            const struct lane *lane = &p->lane[i % 2];
            if (p->fd[0] >= 0 && lane->count > 0)
                wait_ms = 1;
            if (p->fd[0] >= 0 && lane->count < CHUNKS)
                fds[used++] = (struct pollfd){p->fd[i % 2], POLLIN, 0};
        }
        (void)poll(fds, used, wait_ms);
        for (unsigned i = 0; i < relay.wires; i++)
            if (fds[i].revents != 0)
                take_connection(i);
        for (unsigned i = 0; i < PAIRS_MAX; i++)
            serve(&relay.pair[i]);
        if (relay.close_us > 0 && chance_now_us() >= relay.next_close_us) {
            close_one();
            relay.next_close_us = chance_now_us() + chance_draw(&relay.random) %
                                                        (2 * relay.close_us);
        }
    }
}

bool network_open(const struct network_settings *settings) {
    relay.random = chance_of_seed(settings->seed);
    relay.bytes_a_fault = settings->bytes_a_fault;
    relay.close_us = 1000 * settings->ms_a_close;
    relay.delay_us = 1000 * settings->delay_ms;
    for (unsigned i = 0; i < PAIRS_MAX; i++) {
        struct pair *p = &relay.pair[i];
        p->fd[0] = p->fd[1] = -1;
        for (unsigned k = 0; k < 2; k++) {
            p->lane[k].chunk = calloc(CHUNKS, sizeof *p->lane[k].chunk);
            if (p->lane[k].chunk == NULL)
                return false;
        }
    }
    return true;
}

void network_print(void) {
    printf("%lu flips, %lu deletions, %lu closes, %lu connections\n",
           relay.flips, relay.deletions, relay.closes, relay.connections);
}
