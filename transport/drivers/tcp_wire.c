#include "tcp_wire.h"

#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

#include "transport/secure_wipe.h"
#include "unix_file.h"

static uint64_t clock_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

/* Whether the kernel says who is at the other end. */
static bool is_local(const struct tcp_wire *wire) {
    return tcp_address_path(&wire->config.address) != NULL;
}

/* --- connections that are not proven -------------------------------------- */

static void drop(struct tcp_candidate *c) {
    if (c->fd >= 0) {
        close(c->fd);
        c->fd = -1;
        secure_wipe(&c->heard, sizeof c->heard);
    }
}

/* Whether it has begun as the peer does. */
static bool begun(const struct tcp_wire *wire, const struct tcp_candidate *c) {
    return wire->config.suite != NULL && c->heard.shake.greeted;
}

/* A free place, or one that is taken from the oldest of those that have not
 * begun as the peer does; from the oldest that has, where they have more than
 * half of the places, so that newcomers have time to begin.  So strangers who
 * say little cannot crowd out one who is about to prove himself. */
static struct tcp_candidate *place(struct tcp_wire *wire) {
    struct tcp_candidate *oldest[2] = {NULL, NULL};
    unsigned count[2] = {0, 0};
    for (unsigned i = 0; i < TCP_CANDIDATES_MAX; i++) {
        struct tcp_candidate *c = &wire->candidate[i];
        if (c->fd < 0)
            return c;
        bool has = begun(wire, c);
        count[has]++;
        if (oldest[has] == NULL || c->since_us < oldest[has]->since_us)
            oldest[has] = c;
    }
    return oldest[count[true] > count[false]];
}

/* Whether the next to come would take the place of one who began well. */
static bool crowded(struct tcp_wire *wire) {
    const struct tcp_candidate *c = place(wire);
    return c->fd >= 0 && begun(wire, c);
}

bool tcp_random(void *context, uint8_t *bytes, size_t size) {
    (void)context;
    return getrandom(bytes, size, 0) == (ssize_t)size;
}

static bool begin_shake(struct tcp_wire *wire, struct secure_shake *shake) {
    static const struct link_end unknown = {SECURE_NODE_UNKNOWN,
                                            SECURE_PORT_UNKNOWN};
    const struct tcp_wire_config *c = &wire->config;
    struct secure_self self = {
        c->suite, c->key, !c->listens, {unknown, unknown}};
    struct secure_source *source =
        c->source != NULL ? c->source : &wire->source;
    struct secure_seed seed;
    if (!secure_seed_draw(source, c->suite, c->key, &seed)) {
        errno = EAGAIN;
        return false;
    }
    if (c->ends != NULL)
        self.ends = *c->ends;
    secure_shake_init(shake, &self, &seed);
    secure_wipe(&seed, sizeof seed);
    return true;
}

static bool begin(struct tcp_wire *wire, struct tcp_candidate *c, int fd,
                  bool connected, uint64_t now_us) {
    memset(&c->heard, 0, sizeof c->heard);
    if (wire->config.suite != NULL && !begin_shake(wire, &c->heard.shake))
        return false;
    /* A peer that answers no more is a broken connection, in the end. */
    unsigned silent_ms = TCP_SILENT_MS;
    if (!is_local(wire)) {
        (void)setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &silent_ms,
                         sizeof silent_ms);
    }
    c->fd = fd;
    c->connected = connected;
    c->since_us = now_us;
    tcp_pipe_init(&c->pipe, fd);
    return true;
}

static bool accept_some(struct tcp_wire *wire, uint64_t now_us) {
    bool some = false;
    for (unsigned i = 0; i < TCP_ACCEPTS_MAX; i++) {
        struct tcp_candidate *c = place(wire);
        if (i >= TCP_TURNS_MAX && crowded(wire))
            break;
        int fd = accept4(wire->listener, NULL, NULL, SOCK_CLOEXEC);
        if (fd < 0)
            break;
        some = true;
        if (tcp_prepare(fd) != 0) {
            close(fd);
            continue;
        }
        wire->strangers += c->fd >= 0;
        drop(c);
        if (!begin(wire, c, fd, true, now_us))
            close(fd);
    }
    return some;
}

/* A call that failed is made again after a pause, longer each time. */
static void pause_calls(struct tcp_wire *wire, uint64_t now_us, uint64_t most) {
    uint64_t pause = 2 * wire->pause_us;
    wire->pause_us = pause < TCP_PAUSE_MIN_US ? TCP_PAUSE_MIN_US
                     : pause > most           ? most
                                              : pause;
    wire->call_us = now_us + wire->pause_us;
}

static void call(struct tcp_wire *wire, uint64_t now_us) {
    const struct tcp_address *to = &wire->config.address;
    int fd = socket(to->to.any.sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 && tcp_prepare(fd) == 0) {
        bool at_once = connect(fd, &to->to.any, to->size) == 0;
        if ((at_once || errno == EINPROGRESS) &&
            begin(wire, &wire->candidate[0], fd, at_once, now_us))
            return;
    }
    wire->fault = errno;
    if (fd >= 0)
        close(fd);
    pause_calls(wire, now_us, TCP_PAUSE_MAX_US);
}

static uint64_t within(uint64_t least_us, uint64_t us) {
    return us < least_us ? least_us : us > TCP_PROVE_US ? TCP_PROVE_US : us;
}

/* Whether the call was answered: 1, 0 not yet, -1 no. */
static int answered(struct tcp_wire *wire, struct tcp_candidate *c,
                    uint64_t now_us) {
    struct pollfd wait = {c->fd, POLLOUT, 0};
    int fault = 0;
    socklen_t size = sizeof fault;
    if (c->connected)
        return 1;
    if (poll(&wait, 1, 0) == 0)
        return 0;
    if (getsockopt(c->fd, SOL_SOCKET, SO_ERROR, &fault, &size) != 0 ||
        fault != 0) {
        wire->fault = fault;
        wire->other_key = wire->lone_key = false; /* it is gone */
        return -1;
    }
    wire->answer_us = within(TCP_CALL_MIN_US, 8 * (now_us - c->since_us));
    c->connected = true;
    c->since_us = now_us;
    return 1;
}

/* Without a key: 1 when it has greeted as a link does, or there is no better
 * one and it has kept silent, or greets as one with a key, which is to hear
 * that there is none here; 0 not yet, -1 it says something else. */
static int hear_first(const struct tcp_wire *wire, struct tcp_candidate *c,
                      uint64_t now_us) {
    struct tcp_first *first = &c->heard.first;
    struct link_pipe pipe = tcp_link_pipe(&c->pipe);
    int got = pipe.receive(pipe.context, first->bytes + first->end,
                           sizeof first->bytes - first->end);
    first->end += got > 0 ? (size_t)got : 0;
    if (got > 0 && link_greets(first->bytes, first->end))
        return 1;
    if (got < 0 || first->end == sizeof first->bytes)
        return -1;
    if (first->end > 0)
        return wire->tcp.fd < 0 && secure_greets(first->bytes, first->end);
    return !wire->proven && now_us - c->since_us > TCP_QUIET_US;
}

/* What the end of a proof tells of who it was. */
static void note_keys(struct tcp_wire *wire, int status,
                      enum secure_fault fault, uint64_t now_us) {
    if (status != 0) {
        wire->other_key = status < 0 && fault == SECURE_OTHER_KEY;
        wire->lone_key = status < 0 && fault == SECURE_NO_KEY;
        wire->other_key_us = now_us;
    }
}

static int prove(struct tcp_wire *wire, struct tcp_candidate *c,
                 uint64_t now_us) {
    struct link_pipe pipe = tcp_link_pipe(&c->pipe);
    wire->other_user = is_local(wire) && !unix_file_peer_is_ours(c->fd);
    if (wire->other_user)
        return -1;
    if (wire->config.suite == NULL)
        return wire->config.listens ? hear_first(wire, c, now_us) : 1;
    int status = secure_shake(&c->heard.shake, &pipe);
    note_keys(wire, status, c->heard.shake.fault, now_us);
    bool elsewhere =
        status > 0 && wire->tcp.fd >= 0 && secure_shake_misled(&c->heard.shake);
    return elsewhere ? -1 : status;
}

/* The candidate becomes the connection. */
static void promote(struct tcp_wire *wire, struct tcp_candidate *c,
                    uint64_t now_us) {
    if (wire->tcp.fd >= 0) {
        close(wire->tcp.fd);
        wire->replaced = true;
    }
    wire->tcp = c->pipe;
    c->fd = -1;
    wire->connections++;
    wire->pause_us = wire->lone_key ? wire->pause_us : 0;
    wire->fault = 0;
    wire->prove_us = within(TCP_PROVE_MIN_US, 8 * (now_us - c->since_us));
    wire->proven = wire->config.suite != NULL;
    if (wire->proven) {
        struct link_pipe beneath = tcp_link_pipe(&wire->tcp);
        secure_records_start(&wire->records, &c->heard.shake, &beneath);
    } else {
        wire->first = c->heard.first;
    }
}

/* A call that is not answered, or a proof that does not come: bytes of it are
 * lost, strangers crowd the other end, or the way is longer than was thought.
 * The end that called gives up first, and calls again. */
static uint64_t patience(const struct tcp_wire *wire,
                         const struct tcp_candidate *c) {
    return wire->config.listens ? TCP_PROVE_US
           : c->connected       ? wire->prove_us
                                : wire->answer_us;
}

/* A call came to nothing: whether for want of time, or of a key. */
static void call_again(struct tcp_wire *wire, const struct tcp_candidate *c,
                       bool late, uint64_t now_us) {
    bool crowded_out = late ? !c->connected
                            : c->connected && tcp_wire_doubt(wire).what == NULL;
    uint64_t *again = c->connected ? &wire->prove_us : &wire->answer_us;
    if (late)
        *again = within(0, 2 * *again);
    pause_calls(wire, now_us,
                crowded_out ? TCP_PAUSE_AWAY_US : TCP_PAUSE_MAX_US);
}

static void look_at(struct tcp_wire *wire, struct tcp_candidate *c,
                    uint64_t now_us) {
    int status = answered(wire, c, now_us);
    if (status > 0)
        status = prove(wire, c, now_us);
    if (status > 0) {
        promote(wire, c, now_us);
        return;
    }
    bool late = now_us - c->since_us > patience(wire, c);
    if (status == 0 && !late)
        return;
    if (wire->config.listens)
        wire->strangers++;
    else
        call_again(wire, c, status == 0, now_us);
    drop(c);
}

/* Whether strangers have to wait for their turn. */
static bool holds_off(const struct tcp_wire *wire, uint64_t now_us) {
    return wire->listener >= 0 && wire->tcp.fd >= 0 && wire->proven &&
           now_us < wire->look_us;
}

/* Whether the door is open. */
static bool admits(const struct tcp_wire *wire, uint64_t now_us) {
    return wire->listener >= 0 && now_us >= wire->admit_us;
}

static void tick(struct tcp_wire *wire) {
    uint64_t now_us = clock_us();
    bool quiet = wire->quiet, met = false;
    wire->quiet = false;
    if (holds_off(wire, now_us))
        return;
    if (admits(wire, now_us))
        met = !quiet && accept_some(wire, now_us);
    else if (wire->listener < 0 && wire->tcp.fd < 0 &&
             wire->candidate[0].fd < 0 && now_us >= wire->call_us)
        call(wire, now_us);
    for (unsigned i = 0; i < TCP_CANDIDATES_MAX; i++) {
        if (wire->candidate[i].fd >= 0) {
            met = true;
            look_at(wire, &wire->candidate[i], now_us);
        }
    }
    if (now_us - wire->other_key_us > TCP_OTHER_KEY_US)
        wire->other_key = wire->lone_key = false;
    bool in_use = wire->tcp.fd >= 0 && wire->proven;
    wire->look_us = met ? now_us + TCP_LOOK_US : 0;
    if (admits(wire, now_us))
        wire->admit_us = !in_use && crowded(wire) ? now_us + TCP_CROWD_US : 0;
}

/* --- the pipe ------------------------------------------------------------- */

static void leave(struct tcp_wire *wire) {
    if (wire->tcp.fd >= 0) {
        close(wire->tcp.fd);
        tcp_pipe_init(&wire->tcp, -1);
        secure_records_end(&wire->records);
    }
}

/* The connection is over: the next one begins. */
static int broken(struct tcp_wire *wire) {
    if (wire->tcp.fd >= 0) {
        leave(wire);
        wire->proven = false;
        wire->first.begin = wire->first.end = 0;
        pause_calls(wire, clock_us(), TCP_PAUSE_MAX_US);
    }
    return LINK_PIPE_CLOSED;
}

static struct link_pipe inner(struct tcp_wire *wire) {
    return wire->config.suite != NULL ? secure_records_pipe(&wire->records)
                                      : tcp_link_pipe(&wire->tcp);
}

static int wire_send(void *context, const uint8_t *bytes, size_t size) {
    struct tcp_wire *wire = context;
    if (wire->tcp.fd < 0 || wire->replaced)
        return LINK_PIPE_CLOSED;
    struct link_pipe pipe = inner(wire);
    int sent = pipe.send(pipe.context, bytes, size);
    return sent < 0 ? broken(wire) : sent;
}

/* What the connection said before it was taken. */
static int receive_first(struct tcp_wire *wire, uint8_t *bytes, size_t size) {
    struct tcp_first *first = &wire->first;
    size_t have = first->end - first->begin;
    have = have < size ? have : size;
    memcpy(bytes, first->bytes + first->begin, have);
    first->begin += have;
    return (int)have;
}

/* Without a key: whether the connection greets as a link does, or as one with a
 * key. */
static void hear_greeting(struct tcp_wire *wire, const uint8_t *bytes,
                          size_t size) {
    wire->proven = link_greets(bytes, size);
    if (wire->proven || secure_greets(bytes, size)) {
        wire->lone_key = !wire->proven;
        wire->other_key_us = clock_us();
    }
}

static int wire_receive(void *context, uint8_t *bytes, size_t size) {
    struct tcp_wire *wire = context;
    tick(wire);
    if (wire->tcp.fd < 0 || wire->replaced) {
        wire->replaced = false;
        return LINK_PIPE_CLOSED;
    }
    struct link_pipe pipe = inner(wire);
    int got = wire->first.begin < wire->first.end
                  ? receive_first(wire, bytes, size)
                  : pipe.receive(pipe.context, bytes, size);
    if (got > 0 && !wire->proven)
        hear_greeting(wire, bytes, (size_t)got);
    return got < 0 ? broken(wire) : got;
}

struct tcp_wire_doubt tcp_wire_doubt(const struct tcp_wire *wire) {
    static const char same_key[] = "give both ends the same key file";
    struct tcp_wire_doubt doubt = {NULL, NULL};
    if (wire->other_key) {
        doubt.what = "answers, but with another key";
        doubt.next = same_key;
    } else if (wire->lone_key) {
        doubt.what = wire->config.suite != NULL ? "answers, but has no key"
                                                : "answers, but wants a key";
        doubt.next = same_key;
    } else if (wire->other_user) {
        doubt.what = "answers, but is another user's";
        doubt.next = "start both as the same user";
    }
    return doubt;
}

struct link_pipe tcp_wire_pipe(struct tcp_wire *wire) {
    return (struct link_pipe){wire, wire_send, wire_receive};
}

/* --- opening -------------------------------------------------------------- */

static int bind_there(const struct tcp_wire *wire, int fd) {
    const struct tcp_address *at = &wire->config.address;
    int on = 1;
    if (is_local(wire))
        return unix_file_bind(fd, at);
    (void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    return bind(fd, &at->to.any, at->size);
}

static int listen_there(struct tcp_wire *wire) {
    int fd = socket(wire->config.address.to.any.sa_family,
                    SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return -1;
    if (tcp_prepare(fd) != 0 || bind_there(wire, fd) != 0 ||
        listen(fd, TCP_QUEUE_MAX) != 0) {
        int reason = errno;
        close(fd);
        errno = reason;
        return -1;
    }
    wire->listener = fd;
    return 0;
}

int tcp_wire_open(struct tcp_wire *wire, const struct tcp_wire_config *config) {
    memset(wire, 0, sizeof *wire);
    wire->config = *config;
    wire->listener = -1;
    wire->source.random = tcp_random;
    wire->answer_us = TCP_CALL_MIN_US;
    wire->prove_us = TCP_PROVE_MIN_US;
    tcp_pipe_init(&wire->tcp, -1);
    for (unsigned i = 0; i < TCP_CANDIDATES_MAX; i++)
        wire->candidate[i].fd = -1;
    if (is_local(wire)) {
        wire->config.suite = NULL;
    } else if (config->suite == NULL && !config->insecure) {
        errno = EACCES;
        return -1;
    }
    return config->listens ? listen_there(wire) : 0;
}

void tcp_wire_close(struct tcp_wire *wire) {
    for (unsigned i = 0; i < TCP_CANDIDATES_MAX; i++)
        drop(&wire->candidate[i]);
    leave(wire);
    if (wire->listener >= 0) {
        close(wire->listener);
        wire->listener = -1;
        if (is_local(wire))
            unix_file_remove(&wire->config.address);
    }
}

void tcp_wire_rest(struct tcp_wire *wire, uint64_t rest_us) {
    drop(&wire->candidate[0]);
    (void)broken(wire);
    wire->call_us = clock_us() + rest_us;
}

unsigned tcp_wire_events(const struct tcp_wire *wire, struct pollfd *fds) {
    unsigned used = 0;
    short events = wire->tcp.fd < 0 ? 0 : tcp_events(&wire->tcp);
    if (events != 0)
        fds[used++] = (struct pollfd){wire->tcp.fd, events, 0};
    uint64_t now_us = clock_us();
    if (holds_off(wire, now_us))
        return used;
    if (admits(wire, now_us))
        fds[used++] = (struct pollfd){wire->listener, POLLIN, 0};
    for (unsigned i = 0; i < TCP_CANDIDATES_MAX; i++) {
        const struct tcp_candidate *c = &wire->candidate[i];
        if (c->fd >= 0) {
            events = c->connected ? tcp_events(&c->pipe) : POLLOUT;
            fds[used++] = (struct pollfd){c->fd, events, 0};
        }
    }
    return used;
}

uint64_t tcp_wire_wait_us(const struct tcp_wire *wire) {
    return wire->listener < 0    ? UINT64_MAX
           : wire->admit_us != 0 ? TCP_CROWD_US
           : wire->look_us != 0  ? TCP_LOOK_US
                                 : UINT64_MAX;
}

void tcp_wire_heard(struct tcp_wire *wire, const struct pollfd *fds,
                    unsigned count) {
    for (unsigned i = 0; i < count; i++)
        if (fds[i].fd == wire->tcp.fd)
            tcp_heard(&wire->tcp, fds[i].revents);
        else if (fds[i].fd == wire->listener)
            wire->quiet = fds[i].revents == 0;
}
