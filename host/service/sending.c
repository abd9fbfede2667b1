#include "sending.h"

#include <assert.h>
#include <string.h>

#include "failure_detector.h"
#include "idle_nodes.h"
#include "node/page_check.h"
#include "paging.h"

static bool send_counted(struct host_service *s, uint16_t to, uint8_t type,
                         const void *data, size_t size) {
    bool sent = cube_write(s->cube, to, type, data, size) == 0;
    s->node[to].sent += sent;
    return sent;
}

bool host_sending_write(void *service, unsigned node, uint8_t type,
                        const void *data, size_t size) {
    return send_counted(service, (uint16_t)node, type, data, size);
}

bool host_sending_write_to_all(void *service, uint8_t type, const void *data,
                               size_t size) {
    struct host_service *s = service;
    if (cube_write(s->cube, CUBE_ALL, type, data, size) != 0) {
        return false;
    }
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        s->node[i].sent++;
    }
    if (type == NODE_PAGE_TO_ALL) {
        s->page_bytes_to_all += size - sizeof(struct node_page_head);
    }
    return true;
}

static bool send_page(struct host_service *s, uint16_t to) {
    struct node_page_message body;
    struct host_node *node = &s->node[to];
    if (cube_room(s->cube, to) == 0) {
        return false;
    }
    body.head.page = node->pages[node->pages_first];
    size_t size = host_page(s->order, body.head.page, body.data);
    if (!send_counted(s, to, NODE_PAGE, &body,
                      node_page_seal(&body, s->setup.page_key, size))) {
        return false;
    }
    node->pages_first = (node->pages_first + 1) % HOST_PAGES_QUEUED_MAX;
    node->pages_count--;
    s->report[to].pages++;
    s->report[to].page_bytes += size;
    host_paging_sent(s);
    return true;
}

static bool send_unspill(struct host_service *s, uint16_t to,
                         struct host_error *error) {
    struct {
        struct node_spill_header header;
        struct incode_face faces[NODE_FACES_A_MESSAGE];
    } body;
    struct host_node *node = &s->node[to];
    struct host_spill_list *list = &node->unspills[node->unspills_first].list;
    if (cube_room(s->cube, to) == 0) {
        return false;
    }
    body.header = node->unspills[node->unspills_first].header;
    if (host_spill_take(&s->spill, list, body.faces, NODE_FACES_A_MESSAGE,
                        &body.header.count, error) != 0) {
        return false;
    }
    assert(node->spilled >= body.header.count);
    node->spilled -= body.header.count;
    body.header.last = list->faces == 0;
    body.header.sent = node->sent - node->missed;
    if (body.header.last) {
        node->unspills_first = (node->unspills_first + 1) % HOST_UNSPILLS_MAX;
        node->unspills_count--;
    }
    return send_counted(s, to, NODE_UNSPILL, &body,
                        sizeof body.header +
                            body.header.count * sizeof body.faces[0]);
}

static void give_job(struct host_service *s, unsigned to,
                     const struct incode_job *job) {
    struct host_node *node = &s->node[to];
    node->job.job = *job;
    node->job.epoch = host_ledger_open(&s->ledger, to, job->first, job->last);
    node->job_due = true;
    node->working = true;
    node->reported = false;
    s->working++;
}

void host_sending_deal(struct host_service *service) {
    struct host_service *s = service;
    struct incode_job job;
    s->dealt = true;
    s->work.frames = UINT32_MAX;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        uint32_t frames = s->report[i].map.map.pages;
        if (!s->work.lost[i] && frames < s->work.frames) {
            s->work.frames = frames;
        }
    }
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (!s->work.lost[i] && s->strategy->first(&s->work, i, &job)) {
            give_job(s, i, &job);
        }
    }
}

void host_sending_begin(struct host_service *service) {
    struct host_service *s = service;
    s->dealt = false;
    s->working = 0;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *node = &s->node[i];
        node->pages_first = node->pages_count = 0;
        node->unspills_first = node->unspills_count = 0;
        node->results = 0;
        node->credit = s->setup.credits;
        node->setup_due = true;
        node->job_due = node->report_due = false;
        node->working = node->reported = false;
        node->spilled = node->spilled_max = 0;
    }
}

/* What the strategy has, and what the node has asked for, in turn: a strategy
 * that always has something would leave no room for pages. */
static bool serve_data(struct host_service *s, uint16_t to,
                       struct host_error *error) {
    struct host_node *node = &s->node[to];
    bool asked = node->unspills_count > 0 || node->pages_count > 0;
    if (s->strategy->send != NULL && !(asked && node->strategy_last) &&
        s->strategy->send(&s->work, to)) {
        node->strategy_last = true;
        return true;
    }
    if (asked && (node->unspills_count > 0 ? send_unspill(s, to, error)
                                           : send_page(s, to))) {
        node->strategy_last = false;
        return true;
    }
    return false;
}

/* The next message that is due to this node, pings apart; false: none, or no
 * room. */
static bool serve_work(struct host_service *s, uint16_t to,
                       struct host_error *error) {
    struct host_node *node = &s->node[to];
    if (!s->started || !s->report[to].up) {
        return false; /* what goes before the first answer may get lost */
    }
    if (node->setup_due) {
        struct node_setup_message setup = s->setup;
        s->strategy->set_up(&s->work, to, &setup);
        node->setup_due =
            !send_counted(s, to, NODE_SETUP, &setup, sizeof setup);
        host_idle_progress(s, to);
        return !node->setup_due;
    }
    struct incode_job job;
    if (s->dealt && !node->working && s->strategy->next(&s->work, to, &job)) {
        give_job(s, to, &job);
    }
    if (node->job_due) {
        node->job_due =
            !send_counted(s, to, NODE_JOB, &node->job, sizeof node->job);
        host_idle_progress(s, to);
        return !node->job_due;
    }
    if (node->report_due) {
        node->report_due = !send_counted(s, to, NODE_REPORT, NULL, 0);
        host_idle_progress(s, to);
        return !node->report_due;
    }
    /* Half of the credit back at a time. */
    uint32_t credit = node->results + s->setup.credits;
    if (credit - node->credit >= s->setup.credits / 2) {
        if (!send_counted(s, to, NODE_CREDIT, &credit, sizeof credit)) {
            return false;
        }
        node->credit = credit;
        return true;
    }
    return serve_data(s, to, error);
}

/* What goes before the first answer may get lost. */
static bool serve_onlookers(struct host_service *s, uint16_t to) {
    struct node_question_message question;
    if (!host_onlooking_due(&s->onlooking, to, &question) ||
        !s->report[to].up ||
        !send_counted(s, to, NODE_QUESTION, &question, sizeof question)) {
        return false;
    }
    host_onlooking_sent(&s->onlooking, to);
    return true;
}

/* A ping and a message of work in turn: on a slow wire the pings of many nodes
 * would leave no room for anything else. */
static bool serve_node(struct host_service *s, uint16_t to,
                       struct host_error *error) {
    struct host_node *node = &s->node[to];
    if (s->work.lost[to]) {
        return false;
    }
    if (node->ping_due && !node->ping_last) {
        node->ping_last = host_detector_ping(s, to);
        return node->ping_last;
    }
    if (serve_onlookers(s, to)) {
        return true;
    }
    if (serve_work(s, to, error)) {
        node->ping_last = false;
        return true;
    }
    return node->ping_due && host_detector_ping(s, to);
}

/* Whether the node whose turn it was has another: for pages, of which the
 * strategy has some sent in a row. */
static bool goes_on(struct host_service *s, struct host_node *node) {
    bool more = node->pages_count > 0 &&
                node->pages_in_a_row + 1 < s->strategy->pages_in_a_row;
    node->pages_in_a_row = more ? node->pages_in_a_row + 1 : 0;
    return more;
}

unsigned host_sending_serve(struct host_service *service,
                            struct host_error *error) {
    struct host_service *s = service;
    unsigned sent = 0, idle = 0;
    while (idle < s->machine->nodes && error->code == 0) {
        if (serve_node(s, (uint16_t)s->turn, error)) {
            sent++;
            idle = 0;
            if (goes_on(s, &s->node[s->turn])) {
                continue;
            }
        } else {
            idle++;
        }
        s->turn = (s->turn + 1) % s->machine->nodes;
    }
    return sent;
}

bool host_sending_pages_wait(const struct host_service *service) {
    for (unsigned i = 0; i < service->machine->nodes; i++) {
        if (service->node[i].pages_count > 0) {
            return true;
        }
    }
    return false;
}
