#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "in_use.h"
#include "watchers.h"
#include "parts.h"
#include "host/base/progress.h"
#include "transport/routes.h"

enum {
    IN_USE_US_MAX = 5000000,  /* longer than a link keeps to a silent host, */
    IN_USE_US_LAST = 9000000, /* whether it was told so again or not */
    IN_USE_TOLD_US = 2000000, /* it is told so more often as long as it is so */
    IN_USE_REST_US = 1000000
};

enum host_in_use_state host_in_use_look(struct host_in_use *in_use,
                                        const struct host_machine *machine,
                                        const struct link_peer *peer,
                                        uint64_t now_us) {
    if (peer->refusal != LINK_IN_USE) {
        in_use->since_us = 0;
        return HOST_FREE;
    }
    if (in_use->since_us == 0)
        in_use->since_us = now_us;
    if (in_use->told != peer->in_use) {
        in_use->told_us = now_us;
        if (machine->rest != NULL)
            machine->rest(machine->context, IN_USE_REST_US);
    }
    in_use->told = peer->in_use;
    uint64_t passed = now_us - in_use->since_us;
    bool stays =
        passed > IN_USE_US_LAST ||
        (passed > IN_USE_US_MAX && now_us - in_use->told_us <= IN_USE_TOLD_US);
    return stays ? HOST_STAYS : HOST_TAKEN;
}

int host_in_use_fail(const struct host_machine *machine, unsigned node,
                     struct host_error *error) {
    const struct host_watchers *them = machine->watchers;
    const char *holder = them == NULL ? NULL : them->holder(them->context);
    return holder == NULL
               ? host_fail(error, HOST_CUBE,
                           "node %u link %u: the cube is in use by another "
                           "host; wait until its run is over, or end it",
                           node, machine->dimension)
               : host_fail(error, HOST_CUBE,
                           "node %u link %u: the cube is in use by %s; wait "
                           "until it has ended, or end it; look on meanwhile "
                           "with: incode console %s",
                           node, machine->dimension, holder,
                           host_where(machine));
}

/* --- host cube ------------------------------------------------------------ */

enum { WINDOW_DEFAULT = 32 };

struct cube *host_cube_make(const struct host_machine *machine, unsigned window,
                            void **memory, struct host_error *error) {
    struct cube_config config;
    memset(&config, 0, sizeof config);
    config.self = CUBE_HOST;
    config.dimension = (uint8_t)machine->dimension;
    config.window = (uint16_t)(window == 0 ? WINDOW_DEFAULT : window);
    if (config.window > LINK_WINDOW_MAX)
        config.window = LINK_WINDOW_MAX;
    config.epoch = machine->epoch;
    config.pipes[0] = machine->pipe;
    config.pipes[1] = machine->spare;
    config.spare_node = machine->spare_node;
    config.host_ports = machine->host_ports;
    for (unsigned i = 1; i < config.host_ports; i++)
        config.pipes[i] = machine->wires[i];
    cube_for_serial(&config, machine->serial_baud);
    size_t bytes = cube_arena_bytes(&config);
    *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (*memory == NULL) {
        host_fail_memory(error, "the wire");
        return NULL;
    }
    struct cube *cube = cube_init(*memory, bytes, &config);
    if (cube == NULL) {
        host_fail(error, HOST_BROKEN,
                  "host: the cube of %u nodes does not come up; please report "
                  "this",
                  machine->nodes);
    }
    return cube;
}

/* --- notices -------------------------------------------------------------- */

void host_notice_line(struct host_service *service, const char *line) {
    struct host_service *s = service;
    if (s->machine->told != NULL) {
        s->machine->told(s->machine->context, line);
        return;
    }
    host_note("%s", line);
}

static void notice(struct host_service *s, unsigned node, unsigned link,
                   const char *format, va_list arguments) {
    char line[HOST_NOTICE_BYTES];
    int at = snprintf(line, sizeof line, "node %u link %u: ", node, link);
    (void)vsnprintf(line + at, sizeof line - (size_t)at, format, arguments);
    host_notice_line(s, line);
}

void host_notice(struct host_service *service, unsigned node,
                 const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    notice(service, node, host_detector_link(service, node), format, arguments);
    va_end(arguments);
}

void host_notice_of(struct host_service *service, unsigned node, unsigned link,
                    const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    notice(service, node, link, format, arguments);
    va_end(arguments);
}

/* --- bring up ------------------------------------------------------------- */

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
    for (unsigned d = 0; d < s->machine->dimension; d++)
        if ((s->node[node ^ 1u << d].refused >> d & 1) != 0)
            return (int)(node ^ 1u << d);
    return -1;
}

/* Whether the node at the host's wire says that a host has it already. */
static bool is_with_another(const struct host_service *s, unsigned node) {
    return node == cube_wiring(s->cube)->gateway &&
           cube_link_peer(s->cube, host_detector_wire(s))->refusal ==
               LINK_IN_USE;
}

static void tell_holder(const struct host_service *s, char *text, size_t size) {
    const struct host_watchers *them = s->machine->watchers;
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
        (s->waiting[0] != '\0' && now_us - s->waiting_us < TELL_AGAIN_US))
        return;
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
    if (s->step_us < STEP_US)
        return;
    uint64_t starved = starved_us(s);
    s->waited_us += starved < s->step_us ? s->step_us - starved : 0;
    s->step_us = 0;
}

int host_bring_up_check(struct host_service *service, uint64_t now_us,
                        uint64_t elapsed_us, struct host_error *error) {
    struct host_service *s = service;
    unsigned first = 0;
    if (s->started || s->up == s->work.living)
        return 0;
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
    if (service->waiting[0] != '\0')
        host_notice_line(service, "host: all nodes are there; the run begins");
}

/* --- generations ---------------------------------------------------------- */

enum {
    FRUITLESS_MAX = 64,
    /* Generations of other hosts that are answered: one is normal where a host
     * was here before, a few come of nodes that were cut off meanwhile. */
    OUTDONE_MAX = 4
};

/* Whether the host can speak by that node: by a wire, and on to another. */
static bool speaks(const struct host_service *s, const struct cube_wiring *w,
                   uint16_t gateway) {
    unsigned dimension = s->machine->dimension;
    bool on = dimension == 0;
    for (unsigned d = 0; d < dimension; d++)
        on = on || !wiring_is_dead(w, w->dead_count, gateway, d, dimension);
    return on &&
           !wiring_is_dead(w, w->dead_count, gateway, dimension, dimension);
}

uint16_t host_generation_gateway(const struct host_service *service,
                                 const struct cube_wiring *next) {
    const struct host_service *s = service;
    uint16_t other = next->gateway != 0 ? 0 : s->machine->spare_node;
    return !speaks(s, next, next->gateway) && speaks(s, next, other)
               ? other
               : next->gateway;
}

/* The gateway must be there, and what was given up must not be on the way.
 * What is dead only since is looked at later. */
static int check_renewed(const struct host_service *s,
                         struct host_error *error) {
    const struct cube_wiring *w = cube_wiring(s->cube);
    unsigned dimension = s->machine->dimension;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        bool dead = wiring_is_dead(w, w->settled, i, dimension, dimension);
        if (i == w->gateway ? dead : s->node[i].given_up && !dead) {
            return host_detector_doubt(s, i, error) != 0
                       ? error->code
                       : host_fail(
                             error, HOST_CUBE,
                             "node %u link %u: lost, and the cube cannot go "
                             "on without it; look after that node and its "
                             "wires, and run again",
                             i, host_detector_link(s, i));
        }
    }
    return 0;
}

/* Nodes that come back to another host's generation, whatever is answered,
 * would have the run begin for ever. */
static int check_outdone(const struct host_service *s,
                         struct host_error *error) {
    unsigned gateway = cube_wiring(s->cube)->gateway;
    return cube_statistics(s->cube)->outdone <= OUTDONE_MAX
               ? 0
               : host_fail(error, HOST_CUBE,
                           "node %u link %u: tells of a generation of another "
                           "host, and goes back to it when it is told a new "
                           "one; restart the nodes, and run again",
                           gateway, host_detector_link(s, gateway));
}

int host_generation_begin(struct host_service *service, uint64_t now_us,
                          struct host_error *error) {
    struct host_service *s = service;
    host_detector_begin(s, now_us);
    host_watching_again(&s->watching);
    if (check_outdone(s, error) != 0 || check_renewed(s, error) != 0)
        return error->code;
    s->late = false;
    if (s->started) {
        s->audit.lost_work = true;
        if (host_kept_lose(s->kept, s->tets, error) != 0)
            return error->code;
        s->strategy->lose(&s->work);
        host_kept_lost(s->kept, &s->ledger, s->tets);
        host_spill_clear(&s->spill);
        host_sending_begin(s);
    }
    return 0;
}

/* Boards that reset themselves would have the run begin for ever. */
static int check_progress(struct host_service *s, struct host_error *error) {
    s->fruitless =
        s->ledger.committed == s->committed_before ? s->fruitless + 1 : 0;
    s->committed_before = s->ledger.committed;
    return s->fruitless <= FRUITLESS_MAX
               ? 0
               : host_fail(error, HOST_CUBE,
                           "node %u link %u: %u losses in a row, and nothing "
                           "done between them; look after that node and its "
                           "wires, and run again",
                           s->blamed, host_detector_link(s, s->blamed),
                           s->fruitless);
}

int host_generation_renew(struct host_service *service, uint64_t now_us,
                          struct host_error *error) {
    struct host_service *s = service;
    struct cube_wiring next = *cube_wiring(s->cube);
    unsigned dimension = s->machine->dimension;
    s->loss = false;
    if (s->started && s->ledger.committed == s->ledger.bricks) {
        /* All bricks are here: if the result is right, this loss costs nothing.
         */
        s->audit.lost_work = true;
        s->late = true;
        s->over = s->reporting;
        return 0;
    }
    if (check_progress(s, error) != 0)
        return error->code;
    if (s->searching || !host_missing_links_spare(s)) {
        /* That a wire is absent shows later, and who is cut off is waited
         * for. */
        next.dead_count = next.settled;
    }
    if (!s->searching)
        next.absent_s = s->started ? s->machine->absent_s : next.absent_s;
    if (s->wire_lost) {
        struct cube_dead dead = {next.gateway, (uint8_t)dimension};
        (void)wiring_add_dead(&next, dead, dimension);
        s->wire_lost = false;
        s->wire_down_us = now_us;
    }
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct cube_dead dead = {(uint16_t)i, CUBE_WHOLE_NODE};
        if (s->node[i].given_up)
            (void)wiring_add_dead(&next, dead, dimension);
    }
    next.gateway = host_generation_gateway(s, &next);
    cube_renew(s->cube, &next);
    s->generations++;
    return host_generation_begin(s, now_us, error);
}
