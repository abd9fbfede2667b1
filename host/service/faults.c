#include "faults.h"

#include <stdio.h>
#include <string.h>

#include "notices.h"

void host_faults_begin(struct host_service *service) {
    service->fault.told = false;
    for (unsigned i = 0; i < service->machine->nodes; i++) {
        service->node[i].vouches = HOST_VOUCHES;
    }
}

/* What to do about a fault that a node reports, by a word of its text; NULL: a
 * loss may explain it. */
static const char *advice(const char *text) {
    static const char *const known[][2] = {
        {"takes no record", "mend that, then reset the board"},
        {"memory", "give the nodes more memory"},
        {"protocol version", "run the same version of the program everywhere"},
        {"role", "run the same version of the program everywhere"}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strstr(text, known[i][0]) != NULL) {
            return known[i][1];
        }
    }
    return NULL;
}

static int fail(const struct host_service *s, struct host_error *error) {
    const char *next = advice(s->fault.text);
    if (strstr(s->fault.text, "no program is running") != NULL) {
        return host_fail(error, HOST_CUBE,
                         "node %u: %s; bring one with: incode flash %s IMAGE, "
                         "where make firmware has made IMAGE, "
                         "build/firmware/BOARD.img",
                         s->fault.node, s->fault.text, host_where(s->machine));
    }
    next = next != NULL ? next : "please report this with the points";
    bool told = strstr(s->fault.text, next) != NULL;
    return host_fail(error, HOST_CUBE, "node %u: %s%s%s", s->fault.node,
                     s->fault.text, told ? "" : "; ", told ? "" : next);
}

/* A list that nodes share may be too small for what they send each other, where
 * the one of a node that works alone is not. */
static bool may_go_on(const struct host_service *s) {
    return !s->ledger.alone &&
           strstr(s->fault.text, "active face list") != NULL;
}

int host_faults_take(struct host_service *service,
                     const struct cube_message *message,
                     struct host_error *error) {
    struct host_service *s = service;
    size_t size = message->size < NODE_FAULT_TEXT_MAX ? message->size
                                                      : NODE_FAULT_TEXT_MAX;
    if (s->fault.told) {
        return 0; /* the first is enough */
    }
    memcpy(s->fault.text, message->data, size);
    s->fault.text[size] = '\0';
    s->fault.node = message->source;
    if (!s->started || (advice(s->fault.text) != NULL && !may_go_on(s))) {
        return fail(s, error);
    }
    s->fault.told = true;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (!s->work.lost[i]) {
            s->node[i].vouches = HOST_DOUBTED;
            s->node[i].ping_due = true;
        }
    }
    return 0;
}

void host_faults_pinged(struct host_service *service, unsigned node,
                        uint32_t count) {
    struct host_node *n = &service->node[node];
    if (n->vouches == HOST_DOUBTED) {
        n->vouches = HOST_ASKED;
        n->asked = count;
    }
}

/* Nodes that have left are not asked. */
static bool all_vouch(const struct host_service *s) {
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (s->node[i].vouches != HOST_VOUCHES && !s->node[i].left) {
            return false;
        }
    }
    return true;
}

/* If nodes work together, another node's message may have caused the fault; a
 * node that works alone is itself at fault.  The run goes on as long as another
 * node is left. */
static int believe(struct host_service *s, struct host_error *error) {
    char why[NODE_FAULT_TEXT_MAX + 40];
    unsigned node = s->fault.node;
    s->fault.told = false;
    if (!s->ledger.alone) {
        host_notice(s, node, "reports: %s; from now on each node works alone",
                    s->fault.text);
        host_audit_alone(s);
        s->loss = true;
        return 0;
    }
    if (!host_audit_is_other(s, node)) {
        return fail(s, error);
    }
    snprintf(why, sizeof why, "reports: %s", s->fault.text);
    host_audit_exclude(s, node, why);
    return 0;
}

int host_faults_answered(struct host_service *service, unsigned node,
                         uint32_t count, struct host_error *error) {
    struct host_node *n = &service->node[node];
    if (n->vouches == HOST_ASKED && (int32_t)(count - n->asked) >= 0) {
        n->vouches = HOST_VOUCHES;
    }
    return service->fault.told && all_vouch(service) ? believe(service, error)
                                                     : 0;
}
