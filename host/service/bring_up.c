#include "bring_up.h"

#include <stdio.h>
#include <string.h>

#include "failure_detector.h"
#include "notices.h"
#include "onlookers.h"

enum {
    STARTED_HERE_US = 9000000, /* the machine's own nodes need no more */
    TELL_US = 1500000,
    NEWS_US = 1000000, /* in which who is there answers */
    TELL_AGAIN_US = 1000000,
    STEP_US = 500000, /* between two polls of the time without processor */
    WHY_BYTES = 400,
    START_BYTES = 400 /* of a line that an error has room for */
};

#define NO_ANSWER "no answer"

uint64_t host_bring_up_patience(const struct host_service *service) {
    const struct host_machine *m = service->machine;
    return m->restarts != NULL && !m->slow ? STARTED_HERE_US
                                           : service->patience_us;
}

/* How many nodes are not there, and the first of them, nearest first.  by_wire:
 * one whose wire was up is there. */
static unsigned count(const struct host_service *s, bool by_wire,
                      unsigned *first) {
    unsigned sum = 0, least = UINT32_MAX;
    unsigned gateway = cube_wiring(s->cube)->gateway;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        unsigned away = (unsigned)__builtin_popcount(i ^ gateway);
        bool missing = !s->work.lost[i] && !s->report[i].up &&
                       !(by_wire && s->node[i].links != 0);
        sum += missing;
        if (missing && away < least) {
            least = away;
            *first = i;
        }
    }
    return sum;
}

/* Wires tell of nodes that cannot answer yet, and of some that are gone. */
static unsigned count_missing(const struct host_service *s, unsigned *first) {
    unsigned missing = count(s, true, first);
    return missing > 0 ? missing : count(s, false, first);
}

/* A neighbour that has met somebody with another key where the node should be;
 * -1: none has. */
static int refused_by(const struct host_service *s, unsigned node) {
    for (unsigned d = 0; d < s->machine->dimension; d++) {
        if ((s->node[node ^ 1u << d].refused >> d & 1) != 0) {
            return (int)(node ^ 1u << d);
        }
    }
    return -1;
}

/* Whether the node at the host's wire says that a host has it already. */
static bool is_with_another(const struct host_service *s, unsigned node) {
    return node == cube_wiring(s->cube)->gateway &&
           cube_link_peer(s->cube, host_detector_wire(s))->refusal ==
               LINK_IN_USE;
}

static void tell_holder(const struct host_service *s, char *text, size_t size) {
    const struct host_onlookers *them = s->machine->onlookers;
    const char *holder = them == NULL ? NULL : them->holder(them->context);
    if (holder == NULL) {
        snprintf(text, size,
                 "is with another host, or one that has just ended; it is free "
                 "some seconds after that");
    } else {
        snprintf(text, size, "is with %s; it is free some seconds after that",
                 holder);
    }
}

/* Why the node is not heard, as "WHAT" or "WHAT; NEXT". */
static const char *reason(const struct host_service *s, unsigned node,
                          char *text, size_t size) {
    const struct host_machine *m = s->machine;
    const char *doubt = m->doubt == NULL ? NULL : m->doubt(m->context, node);
    int other = refused_by(s, node);
    if (doubt != NULL) {
        snprintf(text, size, "%s", doubt);
    } else if (other >= 0) {
        snprintf(text, size,
                 "node %d meets another key there; give both the same key file",
                 other);
    } else if (is_with_another(s, node)) {
        tell_holder(s, text, size);
    } else {
        snprintf(text, size, NO_ANSWER);
    }
    return text;
}

/* Writes who is waited for: "node 3 at ADDRESS: WHY, 2 of 4 nodes are there;
 * start it with: LINE". */
static void describe(const struct host_service *s, char *line, size_t size) {
    const struct host_machine *m = s->machine;
    char why[WHY_BYTES], more[80] = "";
    unsigned node = 0, missing = count_missing(s, &node);
    const char *at = m->address == NULL ? NULL : m->address(m->context, node);
    const char *start =
        m->start_line == NULL ? NULL : m->start_line(m->context, node);
    bool next = strchr(reason(s, node, why, sizeof why), ';') != NULL;
    if (missing == m->nodes && missing > 1) {
        snprintf(more, sizeof more, ", and the other %u are behind it",
                 missing - 1);
    } else if (missing > 1) {
        snprintf(more, sizeof more,
                 ", nor of %u more, %u of %u are known to be there",
                 missing - 1, m->nodes - missing, m->nodes);
    } else {
        snprintf(more, sizeof more, ", %u of %u are there", m->nodes - missing,
                 m->nodes);
    }
    snprintf(line, size, "node %u%s%s: %s%s%s%s", node,
             at != NULL ? " at " : "", at != NULL ? at : "", why,
             next ? "" : more,
             next            ? ""
             : start != NULL ? "; start it with: "
                             : "; is it started, and wired as it should be?",
             next || start == NULL ? "" : start);
}

static void tell(struct host_service *s, uint64_t now_us) {
    char line[HOST_NOTICE_BYTES];
    /* A generation begins without anybody, and all come again one by one. */
    if (now_us - s->opened_us < TELL_US || now_us - s->news_us < NEWS_US ||
        s->machine->restarts != NULL ||
        (s->waiting[0] != '\0' && now_us - s->waiting_us < TELL_AGAIN_US)) {
        return;
    }
    describe(s, line, sizeof line);
    if (strncmp(line, s->waiting, sizeof s->waiting - 1) != 0) {
        snprintf(s->waiting, sizeof s->waiting, "%.*s",
                 (int)sizeof s->waiting - 1, line);
        s->waiting_us = now_us;
        host_notice_line(s, line);
    }
}

static int fail(const struct host_service *s, struct host_error *error) {
    const struct host_machine *m = s->machine;
    char why[WHY_BYTES], next[START_BYTES + 40];
    unsigned first = 0, missing = count_missing(s, &first);
    const char *start =
        m->start_line == NULL ? NULL : m->start_line(m->context, first);
    bool known = strcmp(reason(s, first, why, sizeof why), NO_ANSWER) != 0;
    char *advice = strstr(why, "; ");
    if (advice != NULL) {
        snprintf(next, sizeof next, "%s", advice + 2);
        *advice = '\0';
    } else if (known && start != NULL && strlen(start) < START_BYTES) {
        snprintf(next, sizeof next, "start it with: %s", start);
    } else {
        snprintf(next, sizeof next, "%s%s",
                 known ? "look after that node and its wires"
                 : m->start_line != NULL
                     ? "start those that are missing, incode cube FILE prints "
                       "how"
                     : "is the node's program of this version, and the machine "
                       "not too busy?",
                 m->keyed && !known ? ", with the same key file" : "");
    }
    return host_fail(
        error, HOST_CUBE,
        "node %u link %u: %s for %llu s, %u of %u nodes are there; %s", first,
        host_detector_link(s, first), why,
        (unsigned long long)host_bring_up_patience(s) / 1000000,
        m->nodes - missing, m->nodes, next);
}

/* The longest time that any node's process has waited for a processor since the
 * last call.  Any node may be on the path to the missing one. */
static uint64_t starved_us(struct host_service *s) {
    const struct host_machine *m = s->machine;
    uint64_t most = 0;
    for (unsigned i = 0; m->starved_us != NULL && i < m->nodes; i++) {
        uint64_t all = m->starved_us(m->context, i);
        uint64_t before = s->node[i].starved_us;
        uint64_t since = all >= before ? all - before : all; /* a new process */
        s->node[i].starved_us = all;
        most = since > most ? since : most;
    }
    return most;
}

static void count_time(struct host_service *s, uint64_t elapsed_us) {
    s->step_us += elapsed_us;
    if (s->step_us < STEP_US) {
        return;
    }
    uint64_t starved = starved_us(s);
    s->waited_us += starved < s->step_us ? s->step_us - starved : 0;
    s->step_us = 0;
}

int host_bring_up_check(struct host_service *service, uint64_t now_us,
                        uint64_t elapsed_us, struct host_error *error) {
    struct host_service *s = service;
    unsigned first = 0;
    if (s->started || s->up == s->work.living) {
        return 0;
    }
    unsigned there = s->machine->nodes - count(s, true, &first);
    if (there > s->there) {
        s->there = there;
        s->waited_us = s->step_us = 0;
    }
    count_time(s, elapsed_us);
    tell(s, now_us);
    return s->waited_us < host_bring_up_patience(s) ? 0 : fail(s, error);
}

void host_bring_up_done(struct host_service *service) {
    if (service->waiting[0] != '\0') {
        host_notice_line(service, "host: all nodes are there; the run begins");
    }
}
