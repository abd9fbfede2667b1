#include "idle_nodes.h"

#include <stdio.h>

#include "node/keepers.h"
#include "notices.h"

enum { SILENT_US = 1000000 };

void host_idle_progress(struct host_service *service, unsigned node) {
    service->node[node].still_us = 0;
}

/* What the node has to work for. */
static bool owes(const struct host_service *s, unsigned i) {
    const struct host_node *node = &s->node[i];
    bool ready = !node->setup_due && !s->report[i].ready;
    bool results =
        node->working && !node->job_due && node->awaited != NODE_AWAITS_OTHERS;
    bool statistics = s->reporting && !node->report_due && !node->reported;
    bool other =
        s->dealt && s->strategy->owes != NULL && s->strategy->owes(&s->work, i);
    return s->started && !s->work.lost[i] && s->report[i].up &&
           (ready || results || statistics || other);
}

/* What it waits for is the host's to send. */
static bool is_owed(const struct host_service *s, unsigned i) {
    const struct host_node *node = &s->node[i];
    uint32_t credits = node->results + s->setup.credits - node->credit;
    return node->pages_count > 0 || node->unspills_count > 0 ||
           (s->setup.credits > 0 && credits >= s->setup.credits / 2);
}

/* The living node that this one waits for: who keeps its page, or owes it
 * answers; or CUBE_HOST. */
static unsigned awaits(const struct host_service *s, unsigned i) {
    struct node_setup_message setup = s->setup;
    s->strategy->set_up(&s->work, i, &setup);
    uint32_t page = s->node[i].awaited;
    uint32_t keeper =
        page == INCODE_NONE ? CUBE_HOST : node_keeper(page, setup.holders);
    keeper = s->node[i].owing != CUBE_HOST ? s->node[i].owing : keeper;
    bool living = keeper < s->machine->nodes && !s->work.lost[keeper];
    return living ? keeper : CUBE_HOST;
}

/* Who holds this node up: the last of those who wait for each other, be it
 * itself; or CUBE_HOST: one of them goes on, so that all may. */
static unsigned culprit(const struct host_service *s, unsigned i) {
    unsigned next = awaits(s, i);
    for (unsigned k = 0; k < s->machine->nodes && next != CUBE_HOST; k++) {
        if (s->node[next].still_us <= s->patience_us / 2) {
            return CUBE_HOST;
        }
        i = next;
        next = awaits(s, i);
    }
    return i;
}

static const char *work_of_one_left(const struct host_service *s) {
    return s->work.living > 1 ? "its work is given to others"
                              : "no other node is left to do its work";
}

bool host_idle_leave(struct host_service *service, unsigned node,
                     const char *why) {
    struct host_service *s = service;
    struct host_node *n = &s->node[node];
    n->still_us = 0;
    s->blamed = node;
    n->left = true;
    if (n->started_anew) {
        return false;
    }
    if (s->machine->kill != NULL &&
        s->machine->kill(s->machine->context, node)) {
        n->started_anew = true; /* the machine will say so */
        host_notice(s, node, "%s; it is ended and started again", why);
        return true;
    }
    n->aside = true;
    s->loss = true;
    host_notice(s, node, "%s; %s, look after that node", why,
                work_of_one_left(s));
    return true;
}

/* The same, but a node that has had its new start already is put aside. */
static void leave_for_good(struct host_service *s, unsigned node,
                           const char *why) {
    if (!host_idle_leave(s, node, why)) {
        s->node[node].aside = true;
        s->loss = true;
        host_notice(s, node,
                    "%s, for the second time; %s, look after that node", why,
                    work_of_one_left(s));
    }
}

void host_idle_check(struct host_service *service, uint64_t elapsed_us) {
    struct host_service *s = service;
    for (unsigned i = 0; i < s->machine->nodes && !s->loss; i++) {
        struct host_node *node = &s->node[i];
        node->still_us = is_owed(s, i) ? 0 : node->still_us + elapsed_us;
        /* One that is silent does not answer: failure_detector.h. */
        if (!owes(s, i) || node->still_us <= s->patience_us ||
            node->silent_us > SILENT_US) {
            continue;
        }
        char why[80];
        unsigned who = culprit(s, i);
        if (who == CUBE_HOST) {
            continue;
        }
        snprintf(why, sizeof why, "answers, but has done nothing for %llu s",
                 (unsigned long long)s->patience_us / 1000000);
        leave_for_good(s, who, why);
    }
}
