#include "doubts.h"

#include <stdio.h>
#include <string.h>

#include "failure_detector.h"
#include "notices.h"

enum {
    DOUBT_US = 1300000,
    SLOW_US = 10000000, /* of nodes that this machine may keep waiting */
    WIRE_US = 1200000,
    TIMES = 2,         /* the longest silence that ended of late */
    FADES = 16,        /* a silence of 1 s is forgotten after so many s */
    QUIET_US = 1000000 /* silences that end sooner after a doubt: due to it */
};

/* What may be on the way before an answer: a window each way of the slowest
 * wire, 10 bits a byte. */
static uint64_t wire_us(const struct host_service *s) {
    enum { WINDOWS_BITS = 10 * 2 * 8192 };
    uint32_t baud = s->machine->serial_baud;
    return baud == 0 ? 0 : UINT64_C(1000000) * WINDOWS_BITS / baud;
}

/* For how long a node may be silent before anybody is told. */
static uint64_t doubt_us(const struct host_service *s) {
    uint64_t us = DOUBT_US + wire_us(s);
    return s->machine->slow && us < SLOW_US ? SLOW_US : us;
}

/* Notes the silences that have ended since the last check. */
static void note_silences(struct host_service *s, uint64_t elapsed_us) {
    bool doubted = false;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        doubted = doubted || (s->node[i].doubted && !s->work.lost[i]);
    }
    s->undoubted_us = doubted ? 0 : s->undoubted_us + elapsed_us;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *n = &s->node[i];
        uint64_t fades_us = elapsed_us / FADES;
        bool ended = n->silent_us < n->silence_us && n->silent == 0;
        n->slow_us -= fades_us < n->slow_us ? fades_us : n->slow_us;
        if (ended && s->undoubted_us >= QUIET_US &&
            n->silence_us > n->slow_us) {
            n->slow_us = n->silence_us;
        }
        n->silence_us = n->silent_us;
    }
}

/* Silence up to this is usual for the node and its neighbours. */
static uint64_t usual_us(const struct host_service *s, unsigned i) {
    uint64_t most = s->node[i].slow_us;
    for (unsigned d = 0; d < s->machine->dimension; d++) {
        uint64_t other = s->node[i ^ 1u << d].slow_us;
        most = other > most ? other : most;
    }
    return TIMES * most;
}

static void look_at_wire(struct host_service *s, uint64_t elapsed_us) {
    uint64_t frames =
        cube_link_statistics(s->cube, host_detector_wire(s))->frames_received;
    s->wire_quiet_us =
        frames == s->wire_frames ? s->wire_quiet_us + elapsed_us : 0;
    s->wire_frames = frames;
}

/* Whether the node has answered of late. */
static bool is_heard(const struct host_service *s, unsigned i) {
    return !s->work.lost[i] && s->report[i].up && !s->node[i].doubted &&
           s->node[i].silent_us < (DOUBT_US + wire_us(s)) / 2;
}

/* How many say that the node is silent, and have not said since that it is not;
 * *others: how many are heard and say nothing of the kind. */
static unsigned witnesses(const struct host_service *s, unsigned i,
                          unsigned *others) {
    unsigned silent = 0;
    *others = 0;
    if (i == cube_wiring(s->cube)->gateway) {
        uint64_t limit = WIRE_US + wire_us(s);
        silent += s->wire_quiet_us > limit;
        *others += s->wire_quiet_us <= limit;
    }
    for (unsigned d = 0; d < s->machine->dimension; d++) {
        unsigned other = i ^ 1u << d;
        bool up = (s->node[other].links >> d & 1) != 0;
        bool quiet = (s->node[other].silent >> d & 1) != 0;
        silent += up && quiet && !s->work.lost[other];
        *others += up && !quiet && is_heard(s, other);
    }
    return silent;
}

static void doubt(struct host_service *s, unsigned i) {
    const struct host_machine *m = s->machine;
    const char *why = m->doubt == NULL ? NULL : m->doubt(m->context, i);
    bool next = why != NULL && strchr(why, ';') != NULL;
    const char *start = m->restarts != NULL || m->start_line == NULL
                            ? NULL
                            : m->start_line(m->context, i);
    s->node[i].doubted = true;
    host_notice(s, i,
                "no answer for %.1f s%s%s%s %s after %llu s without one, "
                "look after that node%s%s",
                1e-6 * (double)s->node[i].silent_us, why == NULL ? "" : ": ",
                why == NULL ? "" : why, next ? ", or" : "; it is",
                m->restarts != NULL ? "ended and started again" : "given up",
                (unsigned long long)s->patience_us / 1000000,
                start == NULL ? "" : ", it is started by: ",
                start == NULL ? "" : start);
}

static void doubt_wire(struct host_service *s, unsigned i, unsigned d) {
    s->node[i].wires_doubted |= 1u << d;
    s->node[i ^ 1u << d].wires_doubted |= 1u << d;
    host_notice_of(s, i, d,
                   "nothing comes by the wire to node %u; if it stays so "
                   "the run goes round it, look after that wire",
                   i ^ 1u << d);
}

/* Wires that one end says are silent, while the node at the other is heard: for
 * a while, as one that comes back is heard before it is told so. */
static void look_at_links(struct host_service *s, unsigned i,
                          uint64_t elapsed_us) {
    struct host_node *node = &s->node[i];
    uint32_t wires = node->silent & ~node->wires_doubted;
    for (unsigned d = 0; d < s->machine->dimension; d++) {
        bool both = is_heard(s, i) && is_heard(s, i ^ 1u << d);
        wires &= both ? ~(uint32_t)0 : ~(1u << d);
    }
    uint64_t limit = s->machine->slow ? SLOW_US : WIRE_US / 2 + wire_us(s);
    limit = limit < usual_us(s, i) ? usual_us(s, i) : limit;
    wires &= (1u << s->machine->dimension) - 1;
    node->wires_us = wires != 0 ? node->wires_us + elapsed_us : 0;
    for (unsigned d = 0; wires >> d != 0 && node->wires_us > limit; d++) {
        if ((wires >> d & 1) != 0) {
            doubt_wire(s, i, d);
        }
    }
}

void host_doubts_check(struct host_service *service, uint64_t elapsed_us) {
    struct host_service *s = service;
    unsigned others;
    look_at_wire(s, elapsed_us);
    note_silences(s, elapsed_us);
    for (unsigned i = 0; i < s->machine->nodes && s->started; i++) {
        uint64_t limit = doubt_us(s);
        limit = limit < usual_us(s, i) ? usual_us(s, i) : limit;
        limit = s->patience_us / 2 < limit ? s->patience_us / 2 : limit;
        if (s->work.lost[i] || s->node[i].doubted) {
            continue;
        }
        if (s->node[i].silent_us > limit && witnesses(s, i, &others) > 0 &&
            others == 0) {
            doubt(s, i);
        } else {
            look_at_links(s, i, elapsed_us);
        }
    }
}

void host_doubts_heard(struct host_service *service, unsigned node, bool anew) {
    struct host_service *s = service;
    struct host_node *n = &s->node[node];
    n->wires_doubted &= n->silent;
    if (anew) {
        host_notice(s, node,
                    "has started again; what it had not finished is done "
                    "again");
    } else if (n->doubted) {
        host_notice(s, node, "answers again; the run goes on with it");
    }
    n->doubted = false;
}
