#include "bench_end.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "host/base/clock.h"

enum {
    PINGS = 200,
    FIRST = 16, /* messages of the first trial, by which the second is sized */
    MOST = 200000,
    TRIAL_US = 700000,
    PATIENCE_US = 20000000,
    LINGER_US = 30000,
    FAST_BAUD = 3000000 /* as which a pseudo-terminal counts */
};

/* What a message asks, in its first byte. */
enum { ECHO, STREAM, DATA, USED, LEAVE };

struct bench {
    struct host_bench_end *end;
    struct link *link;
    uint64_t heard_us;
    uint32_t due; /* of a stream: to be written, */
    uint32_t got; /* and read */
    bool left;
    uint8_t answer[HOST_BENCH_SMALL];
};

uint64_t host_bench_used_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

static bool say(struct bench *b, uint8_t what, uint64_t value, size_t size) {
    uint8_t bytes[HOST_BENCH_MESSAGE] = {what};
    memcpy(bytes + 8, &value, sizeof value);
    return link_write(b->link, bytes, size, NULL, 0) == 0;
}

/* False: no room for the answer yet. */
static bool take(struct bench *b, const struct link_message *m, unsigned role) {
    uint64_t value;
    uint8_t what = m->data[0];
    memcpy(&value, m->data + 8, sizeof value);
    if (role == 1 && what == ECHO) {
        return say(b, ECHO, value, m->size);
    }
    if (role == 1 && what == USED) {
        return say(b, USED, host_bench_used_us(), HOST_BENCH_SMALL);
    }
    if (what == STREAM) {
        b->due = (uint32_t)value;
    } else if (what == DATA) {
        b->got++;
    } else if (what == LEAVE) {
        b->left = true;
    }
    memcpy(b->answer, m->data, HOST_BENCH_SMALL);
    return true;
}

/* One look at the link: how many messages came. */
static unsigned turn(struct bench *b, unsigned role) {
    struct link_message message;
    unsigned got = 0;
    uint64_t now = host_now_us();
    int moved = link_poll_receive(b->link, now);
    while (link_read(b->link, &message) && take(b, &message, role)) {
        link_release(b->link);
        b->heard_us = now;
        got++;
    }
    while (b->due > 0 && say(b, DATA, 0, HOST_BENCH_MESSAGE)) {
        b->due--;
    }
    moved += link_poll_send(b->link, host_now_us());
    if (got == 0 && moved == 0) {
        b->end->idle(b->end->context, link_next_due_us(b->link, now));
    }
    return got;
}

static bool patient(const struct bench *b) {
    return host_now_us() - b->heard_us < PATIENCE_US;
}

/* Microseconds from question to answer; < 0: there is none. */
static double ask(struct bench *b, uint8_t what, size_t size) {
    uint64_t begin = host_now_us();
    while (!say(b, what, 0, size)) {
        (void)turn(b, 0);
    }
    while (turn(b, 0) == 0) {
        if (!patient(b)) {
            return -1;
        }
    }
    return (double)(host_now_us() - begin);
}

static double mean_round_trip(struct bench *b, size_t size) {
    double sum = 0;
    uint64_t begin = host_now_us();
    for (unsigned i = 1; i <= PINGS; i++) {
        double us = ask(b, ECHO, size);
        sum += us;
        if (us < 0 || host_now_us() - begin > TRIAL_US) {
            return us < 0 ? us : sum / i;
        }
    }
    return sum / PINGS;
}

/* `count` messages each way at once: microseconds. */
static double stream(struct bench *b, uint32_t count) {
    uint64_t begin = host_now_us();
    while (!say(b, STREAM, count, HOST_BENCH_SMALL)) {
        (void)turn(b, 0);
    }
    b->due = count;
    b->got = 0;
    while (b->got < count || b->due > 0 || !link_idle(b->link)) {
        (void)turn(b, 0);
        if (!patient(b)) {
            return -1;
        }
    }
    return (double)(host_now_us() - begin);
}

static uint64_t used_by_both(struct bench *b) {
    uint64_t other;
    (void)ask(b, USED, HOST_BENCH_SMALL);
    memcpy(&other, b->answer + 8, sizeof other);
    return other + host_bench_used_us();
}

static int measure(struct bench *b, struct host_bench_row *row) {
    row->round_trip_us =
        ask(b, ECHO, HOST_BENCH_SMALL) < 0 ? -1 : 0; /* shakes hands */
    if (row->round_trip_us < 0) {
        return -1;
    }
    row->round_trip_us = mean_round_trip(b, HOST_BENCH_SMALL);
    row->hop_us = mean_round_trip(b, HOST_BENCH_MESSAGE) / 2;
    double trial = stream(b, FIRST);
    double fits = FIRST * (double)TRIAL_US / trial;
    uint32_t count = fits < FIRST ? FIRST : fits > MOST ? MOST : (uint32_t)fits;
    uint64_t used = used_by_both(b);
    double us = stream(b, count);
    used = used_by_both(b) - used;
    const struct link_statistics *s = link_statistics(b->link);
    row->bytes_per_s = 1e6 * count * HOST_BENCH_MESSAGE / us;
    row->cpu_us = (double)used / (2.0 * count);
    row->retransmitted = (double)s->retransmitted / (double)s->frames_sent;
    return trial < 0 || us < 0 ? -1 : 0;
}

/* Until the farewell has arrived, as far as that can be told. */
static void linger(struct bench *b) {
    uint64_t begin = host_now_us();
    while (host_now_us() - begin < LINGER_US) {
        (void)link_poll(b->link, host_now_us());
        b->end->idle(b->end->context, LINGER_US / 10);
    }
}

int host_bench_end(struct host_bench_end *end, unsigned role,
                   struct host_bench_row *row) {
    struct bench b = {.end = end, .heard_us = host_now_us()};
    struct link_config config = end->settings;
    int status = -1;
    config.pipe = end->pipe;
    config.epoch = (uint32_t)b.heard_us | 1;
    config.node = (uint16_t)role;
    config.peer_node = (uint16_t)(1 - role);
    size_t bytes = link_bytes(&config);
    void *memory = malloc(bytes);
    b.link = memory == NULL ? NULL : link_init(memory, bytes, &config);
    if (b.link != NULL && role == 0) {
        status = measure(&b, row);
        (void)say(&b, LEAVE, 0, HOST_BENCH_SMALL);
        linger(&b);
    } else if (b.link != NULL) {
        while (!b.left && patient(&b)) {
            (void)turn(&b, role);
        }
        linger(&b);
        status = b.left ? 0 : -1;
    }
    free(memory);
    return status;
}

struct link_config host_bench_serial(uint32_t baud) {
    struct link_config config = {.window = 14, .message_max = 1608};
    link_for_serial(&config, baud == 0 ? FAST_BAUD : baud);
    return config;
}
