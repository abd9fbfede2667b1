#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "parts.h"
#include "host/service/strategies/strategies.h"
#include "node/result.h"

/* A message that no sound node sends: what is wrong with it, as printf. */
__attribute__((format(printf, 3, 4))) static int
unsound(const struct cube_message *message, struct host_error *error,
        const char *format, ...) {
    char what[160];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    return host_fail(error, HOST_CUBE,
                     "node %u: %s (message %u of %u bytes); are host and node "
                     "of one version? run make",
                     message->source, what, message->type, message->size);
}

/* A message whose layout another version may have changed. */
static int wrong_size(const struct cube_message *message, const char *what,
                      size_t expected, struct host_error *error) {
    return unsound(message, error, "%s in %u bytes, expected %zu", what,
                   message->size, expected);
}

/* Whether messages of that node have been lost before this one: then what it
 * says is a part that must not be taken for the whole. */
static bool missing(struct host_service *s, const struct host_node *node,
                    uint32_t sent) {
    if (sent == node->received)
        return false;
    s->loss = true;
    return true;
}

/* Page numbers from byte `at` on, which `node` has asked for. */
static int queue_pages(struct host_service *s, struct host_node *node,
                       const struct cube_message *message, uint32_t at,
                       struct host_error *error) {
    uint32_t count = (message->size - at) / 4u;
    if (message->size % 4 != 0) {
        return unsound(message, error,
                       "page numbers in %u bytes, expected 4 each",
                       message->size);
    }
    if (node->pages_count + count > HOST_PAGES_QUEUED_MAX) {
        return unsound(message, error, "more than %d pages requested: %u",
                       HOST_PAGES_QUEUED_MAX, node->pages_count + count);
    }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t page;
        memcpy(&page, message->data + at + 4 * i, 4);
        if (page >= s->order->tree.pages) {
            return unsound(message, error, "page %u out of range 0..%u", page,
                           s->order->tree.pages - 1);
        }
        node->pages[(node->pages_first + node->pages_count++) %
                    HOST_PAGES_QUEUED_MAX] = page;
    }
    return 0;
}

/* Pages that another has asked the node for. */
static int take_passed(struct host_service *s,
                       const struct cube_message *message,
                       struct host_error *error) {
    uint32_t node;
    if (message->size < sizeof node) {
        return wrong_size(message, "requests of another node", sizeof node,
                          error);
    }
    memcpy(&node, message->data, sizeof node);
    if (node >= s->machine->nodes) {
        return unsound(message, error, "requests of node %u, expected 0..%u",
                       node, s->machine->nodes - 1);
    }
    return queue_pages(s, &s->node[node], message, sizeof node, error);
}

static int take_results(struct host_service *s,
                        const struct cube_message *message,
                        struct host_error *error) {
    struct node_result_header header;
    if (message->size < sizeof header)
        return wrong_size(message, "results", sizeof header, error);
    memcpy(&header, message->data, sizeof header);
    struct host_node *node = &s->node[message->source];
    node->results++;
#ifdef INCODE_PLANT_LOST_BATCH /* a fault that the simulation has to find */
    if (node->results % 8 == 0)
        return 0;
#endif
    if (missing(s, node, header.sent) ||
        !host_ledger_current(&s->ledger, message->source, header.epoch))
        return 0;
    return host_results_take(s, message, error);
}

static int take_spill(struct host_service *s,
                      const struct cube_message *message,
                      struct host_error *error) {
    struct node_spill_header header;
    struct incode_face faces[NODE_FACES_A_MESSAGE];
    if (message->size < sizeof header)
        return wrong_size(message, "spilled faces", sizeof header, error);
    memcpy(&header, message->data, sizeof header);
    size_t size = sizeof header + header.count * sizeof faces[0];
    if (message->size != size) {
        return unsound(message, error,
                       "%u spilled faces in %u bytes, expected %zu",
                       header.count, message->size, size);
    }
    if (header.count > NODE_FACES_A_MESSAGE) {
        return unsound(message, error,
                       "more than %d spilled faces in a message: %u",
                       NODE_FACES_A_MESSAGE, header.count);
    }
    if (!host_ledger_current(&s->ledger, message->source, header.epoch))
        return 0;
    memcpy(faces, message->data + sizeof header,
           header.count * sizeof faces[0]);
    return host_results_spill(s, message->source, faces, header.count, error);
}

static int take_unspill_request(struct host_service *s,
                                const struct cube_message *message,
                                struct host_error *error) {
    struct host_node *node = &s->node[message->source];
    struct node_spill_header header;
    if (message->size != sizeof header) {
        return wrong_size(message, "request for a spilled list", sizeof header,
                          error);
    }
    memcpy(&header, message->data, sizeof header);
    if (header.brick >= s->order->bricks) {
        return unsound(message, error,
                       "spilled list of brick %u requested, out of range 0..%u",
                       header.brick, s->order->bricks - 1);
    }
    if (node->unspills_count == HOST_UNSPILLS_MAX) {
        return unsound(message, error, "more than %d spilled lists requested",
                       HOST_UNSPILLS_MAX);
    }
    if (missing(s, node, header.sent))
        return 0; /* what was lost may have been part of the list */
    uint32_t at =
        (node->unspills_first + node->unspills_count++) % HOST_UNSPILLS_MAX;
    node->unspills[at].header = header;
    node->unspills[at].list =
        host_spill_detach(&s->spill, message->source, header.brick);
    return 0;
}

/* Statistics tell of all that a start of the node has done: they replace those
 * that it told before. */
static int take_finished(struct host_service *s,
                         const struct cube_message *message,
                         struct host_error *error) {
    struct host_node_report *report = &s->report[message->source];
    struct host_node *node = &s->node[message->source];
    struct node_finished_message finished;
    if (message->size != sizeof finished)
        return wrong_size(message, "statistics", sizeof finished, error);
    memcpy(&finished, message->data, sizeof finished);
    if (missing(s, node, finished.sent))
        return 0;
    if (finished.epoch != 0 &&
        !host_ledger_current(&s->ledger, message->source, finished.epoch)) {
        return unsound(message, error,
                       "statistics of job %u, which it does not have",
                       finished.epoch);
    }
    if (finished.epoch != 0 &&
        host_ledger_finish(&s->ledger, message->source) != 0) {
        const struct host_job *job = &s->ledger.job[message->source];
        char why[80];
        snprintf(why, sizeof why, "finished with %u bricks of %u committed",
                 job->committed, job->last - job->first);
        return host_results_refuse(s, message->source, why, error);
    }
    if (finished.epoch != 0) {
        node->working = false;
        s->working--;
    }
    node->reported = true;
    host_missing_links_heard(s, message->source, finished.links);
    node->unreported = 0;
    report->statistics = node->before;
    node_totals_add(&report->statistics, &finished);
    return 0;
}

static int take_ready(struct host_service *s,
                      const struct cube_message *message,
                      struct host_error *error) {
    struct host_node_report *report = &s->report[message->source];
    uint32_t protocol = NODE_PROTOCOL;
    if (message->size >= sizeof protocol)
        memcpy(&protocol, message->data, sizeof protocol);
    if (protocol != NODE_PROTOCOL) {
        return unsound(message, error, "protocol version %u, expected %d",
                       protocol, NODE_PROTOCOL);
    }
    if (message->size != sizeof report->map)
        return wrong_size(message, "memory map", sizeof report->map, error);
    memcpy(&report->map, message->data, sizeof report->map);
    s->ready += !report->ready;
    report->ready = true;
    return 0;
}

/* The reporter says that a page which `sender` sent it is not as the host made
 * it.  If the sender is a node, the sender or the reporter is at fault, and
 * nothing shows which: a notice names both, and from now on all pages come from
 * the host.  If the sender is the host, the page was altered on its way or by
 * the reporter, and the reporter is refused. */
static int doubt_page(struct host_service *s, unsigned reporter,
                      unsigned sender, uint32_t page,
                      struct host_error *error) {
    char which[32] = "a page cut short", why[120];
    if (s->work.lost[reporter] || s->node[reporter].left)
        return 0;
    if (page != INCODE_NONE)
        snprintf(which, sizeof which, "a wrong page %u", page);
    if (sender == CUBE_HOST || s->strategy == &host_redo) {
        snprintf(why, sizeof why,
                 "reports %s of the host's, altered on the way or by that node",
                 which);
        return host_results_refuse(s, reporter, why, error);
    }
    host_notice(s, sender,
                "sent node %u %s, as that node reports; from now on all pages "
                "come from the host; look after both nodes",
                reporter, which);
    host_audit_alone(s);
    s->loss = true;
    return 0;
}

static int take_wrong_page(struct host_service *s,
                           const struct cube_message *message,
                           struct host_error *error) {
    struct node_wrong_page_message wrong;
    if (message->size != sizeof wrong) {
        return wrong_size(message, "report of a wrong page", sizeof wrong,
                          error);
    }
    memcpy(&wrong, message->data, sizeof wrong);
    if (wrong.sender == message->source ||
        (wrong.sender != CUBE_HOST && wrong.sender >= s->machine->nodes))
        return unsound(message, error, "a wrong page of node %u", wrong.sender);
    return doubt_page(s, message->source, wrong.sender, wrong.page, error);
}

/* What the strategy's roles have to say.  An error that it has set stays. */
static int take_other(struct host_service *s,
                      const struct cube_message *message,
                      struct host_error *error) {
    const struct host_strategy *strategy = s->strategy;
    struct node_result_header header;
    if (strategy->take == NULL)
        return unsound(message, error, "unknown type of message");
    if (message->size < sizeof header)
        return wrong_size(message, "message of a role", sizeof header, error);
    memcpy(&header, message->data, sizeof header);
    if (missing(s, &s->node[message->source], header.sent) ||
        (header.epoch != 0 &&
         !host_ledger_current(&s->ledger, message->source, header.epoch)))
        return 0;
    int status = strategy->take(&s->work, message, error);
    if (status != 0 && error->code == 0)
        return unsound(message, error, "unknown type of message");
    return error->code;
}

static int take(struct host_service *service,
                const struct cube_message *message, struct host_error *error) {
    switch (message->type) {
    case NODE_READY:
        return take_ready(service, message, error);
    case NODE_PONG:
        return host_detector_pong(service, message, error);
    case NODE_PAGE_REQUEST:
        return queue_pages(service, &service->node[message->source], message, 0,
                           error);
    case NODE_PAGE_PASSED:
        return take_passed(service, message, error);
    case NODE_RESULT:
        return take_results(service, message, error);
    case NODE_SPILL:
        return take_spill(service, message, error);
    case NODE_UNSPILL_REQUEST:
        return take_unspill_request(service, message, error);
    case NODE_FINISHED:
        return take_finished(service, message, error);
    case NODE_FAULT:
        return host_faults_take(service, message, error);
    case NODE_WRONG_PAGE:
        return take_wrong_page(service, message, error);
    case NODE_ANSWER:
        return host_watching_take(&service->watching, service->machine, message)
                   ? 0
                   : unsound(message, error, "answer to what was not asked");
    default:
        return take_other(service, message, error);
    }
}

/* What a node says of itself in any state, and is no sign of its work. */
static bool is_of_itself(uint8_t type) {
    return type == NODE_PONG || type == NODE_ANSWER;
}

int host_handle(struct host_service *service,
                const struct cube_message *message, struct host_error *error) {
    if (message->source >= service->machine->nodes)
        return unsound(message, error, "not in this cube");
    struct host_node *node = &service->node[message->source];
    if (service->work.lost[message->source] || node->left)
        return 0; /* it has no part in this generation, or no more */
    if (!is_of_itself(message->type))
        host_idle_progress(service, message->source);
    bool expected = is_of_itself(message->type) ||
                    message->type == NODE_FAULT ||
                    (service->started && !node->setup_due);
    int status = 0;
    if (expected) {
        status = take(service, message, error);
    } else {
        /* Without a setup from this host: it works for one before. */
        service->loss = true;
    }
    node->received++;
    node->silent_us = 0;
    return status;
}

/* --- paging --------------------------------------------------------------- */

/* Of what a node has more, somewhat more than half goes to pages: 79 in 512K,
 * 1,334 in 4M. */
static double needed_for(uint64_t memory, uint64_t frames, uint64_t pages) {
    double more = pages > frames ? (double)(pages - frames) : 0;
    return (double)memory + 2.0 * INCODE_PAGE_BYTES * more;
}

uint64_t host_paging_memory(uint64_t memory, uint64_t frames, uint64_t pages) {
    double needed = needed_for(memory, frames, pages);
    uint64_t enough = 1;
    while (enough <= memory ||
           ((double)enough < needed && enough < HOST_MEMORY_MAX))
        enough *= 2;
    return enough < HOST_MEMORY_MAX ? enough : HOST_MEMORY_MAX;
}

static const char *size_text(uint64_t bytes, char *text, size_t size) {
    unsigned shift = bytes % (1 << 20) != 0 ? 10 : bytes < 1 << 30 ? 20 : 30;
    snprintf(text, size, "%llu%c", (unsigned long long)(bytes >> shift),
             shift == 10   ? 'K'
             : shift == 20 ? 'M'
                           : 'G');
    return text;
}

/* Of nodes that have their setup, the most pages that one holds. */
static uint64_t frames_of(const struct host_service *s) {
    uint64_t frames = 0;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        uint64_t has = s->report[i].map.map.pages;
        frames = has > frames ? has : frames;
    }
    return frames;
}

static void tell(struct host_service *s) {
    char line[HOST_NOTICE_BYTES], now[24], then[24];
    uint64_t frames = frames_of(s), pages = s->order->tree.pages;
    uint64_t enough = host_paging_memory(s->memory, frames, pages);
    bool holds = (double)enough >= needed_for(s->memory, frames, pages);
    unsigned long long part = 100 * frames / pages;
    bool file = s->memory_of != NULL;
    snprintf(line, sizeof line,
             "%s%s %s: a node holds %llu %% of these points at a time, and "
             "much of the time goes into pages that it asks for again; ",
             file ? s->memory_of : "", file ? ": memory" : "--memory",
             size_text(s->memory, now, sizeof now), part < 100 ? part : 99);
    size_t at = strlen(line);
    size_text(enough, then, sizeof then);
    snprintf(line + at, sizeof line - at,
             enough <= s->memory ? "more nodes would share them"
             : file              ? "nodes with %s would hold %s of them"
                                 : "--memory %s would hold %s of them",
             then, holds ? "all" : "more");
    host_notice_line(s, line);
}

/* Each node needs each page once, in each generation of the wiring. */
static void look(struct host_service *s, uint64_t pages) {
    uint64_t needed =
        (uint64_t)s->order->tree.pages * s->machine->nodes * s->generations;
    if (s->memory == 0 || s->paging_told || pages <= needed ||
        pages - needed < HOST_PAGING_AGAIN_MIN ||
        (pages - needed) * HOST_PAGING_TETRAHEDRA < s->tets->count)
        return;
    s->paging_told = true;
    tell(s);
}

void host_paging_sent(struct host_service *service) {
    service->pages_sent++;
    look(service, service->pages_sent);
}

void host_paging_end(struct host_service *service) {
    uint64_t pages = 0;
    for (unsigned i = 0; i < service->machine->nodes; i++)
        pages += service->report[i].statistics.statistics.page_requests;
    look(service, pages);
}
