#include "handlers.h"

#include <string.h>

#include "node/result.h"
#include "node/totals.h"
#include "missing_links.h"
#include "failure_detector.h"

/* A message that no sound node sends. */
static int unsound(const struct cube_message *message, const char *what,
                   struct host_error *error)
{
    return host_fail(error, HOST_CUBE,
                     "node %u: %s (message %u of %u bytes); are host and node "
                     "of one version? run make",
                     message->source, what, message->type, message->size);
}

/* Whether messages of that node have been lost before this one: then what it
 * says is a part that must not be taken for the whole. */
static bool missing(struct host_service *s, const struct host_node *node,
                    uint32_t sent)
{
    if (sent == node->received) {
        return false;
    }
    s->loss = true;
    return true;
}

static int take_requests(struct host_service *s,
                         const struct cube_message *message,
                         struct host_error *error)
{
    struct host_node *node = &s->node[message->source];
    uint32_t count = message->size / 4u;
    if (message->size % 4 != 0 ||
        node->pages_count + count > HOST_PAGES_QUEUED_MAX) {
        return unsound(message, "asked for more pages than agreed", error);
    }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t page;
        memcpy(&page, message->data + 4 * i, 4);
        if (page >= s->order->tree.pages) {
            return unsound(message, "asked for a page that is not", error);
        }
        node->pages[(node->pages_first + node->pages_count++) %
                    HOST_PAGES_QUEUED_MAX] = page;
    }
    return 0;
}

/* Rows go straight to their place; a commit may follow any of them. */
static int take_results(struct host_service *s,
                        const struct cube_message *message,
                        struct host_error *error)
{
    struct node_result_reader reader;
    enum node_result_event event;
    struct node_result_header header;
    if (message->size < sizeof header) {
        return unsound(message, "sent results without a header", error);
    }
    memcpy(&header, message->data, sizeof header);
    struct host_node *node = &s->node[message->source];
    node->results++;
#ifdef INCODE_PLANT_LOST_BATCH /* a fault that the simulation has to find */
    if (node->results % 8 == 0) {
        return 0;
    }
#endif
    if (missing(s, node, header.sent) ||
        !host_ledger_current(&s->ledger, message->source, header.epoch)) {
        return 0;
    }
    /* Four bytes are the least that a tetrahedron takes. */
    size_t room = message->size / 4u + 1;
    node_result_open(&reader, message->data + sizeof header,
                     message->size - sizeof header,
                     s->order->bricks * INCODE_BRICK_POINTS);
    do {
        size_t count;
        uint32_t(*rows)[4] = host_tetrahedra_room(s->tets, room, error);
        if (rows == NULL) {
            return error->code;
        }
        event = node_result_read(&reader, rows, room, &count);
        if (event == NODE_RESULT_GARBAGE) {
            return unsound(message, "sent results that cannot be", error);
        }
        host_tetrahedra_keep(s->tets, count);
        node->unreported += count;
        if (event == NODE_RESULT_COMMIT &&
            host_ledger_commit(&s->ledger, message->source, reader.brick) !=
                0) {
            return unsound(message, "committed a brick that is not its own",
                           error);
        }
    } while (event != NODE_RESULT_END);
    return 0;
}

static int take_spill(struct host_service *s,
                      const struct cube_message *message,
                      struct host_error *error)
{
    struct node_spill_header header;
    struct incode_face faces[NODE_FACES_A_MESSAGE];
    if (message->size < sizeof header) {
        return unsound(message, "spilled without a header", error);
    }
    memcpy(&header, message->data, sizeof header);
    if (header.count > NODE_FACES_A_MESSAGE ||
        message->size != sizeof header + header.count * sizeof faces[0]) {
        return unsound(message, "spilled a list of a wrong size", error);
    }
    if (!host_ledger_current(&s->ledger, message->source, header.epoch)) {
        return 0;
    }
    memcpy(faces, message->data + sizeof header,
           header.count * sizeof faces[0]);
    return host_spill_put(&s->spill, message->source, faces, header.count,
                          error);
}

static int take_unspill_request(struct host_service *s,
                                const struct cube_message *message,
                                struct host_error *error)
{
    struct host_node *node = &s->node[message->source];
    struct node_spill_header header;
    if (message->size != sizeof header ||
        node->unspills_count == HOST_UNSPILLS_MAX) {
        return unsound(message, "asked for more spilled lists than agreed",
                       error);
    }
    memcpy(&header, message->data, sizeof header);
    if (missing(s, node, header.sent)) {
        return 0; /* what was lost may have been part of the list */
    }
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
                         struct host_error *error)
{
    struct host_node_report *report = &s->report[message->source];
    struct host_node *node = &s->node[message->source];
    struct node_finished_message finished;
    if (message->size != sizeof finished) {
        return unsound(message, "sent statistics in another language", error);
    }
    memcpy(&finished, message->data, sizeof finished);
    if (missing(s, node, finished.sent)) {
        return 0;
    }
    if (finished.epoch != 0 &&
        !host_ledger_current(&s->ledger, message->source, finished.epoch)) {
        return unsound(message, "sent statistics out of turn", error);
    }
    if (finished.epoch != 0 &&
        host_ledger_finish(&s->ledger, message->source) != 0) {
        return host_fail(error, HOST_BROKEN,
                         "node %u: finished with %u bricks of %u committed; "
                         "please report this with the points",
                         message->source,
                         s->ledger.job[message->source].committed,
                         node->job.job.last - node->job.job.first);
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

static int take_fault(const struct cube_message *message,
                      struct host_error *error)
{
    char text[NODE_FAULT_TEXT_MAX + 1];
    size_t size = message->size < NODE_FAULT_TEXT_MAX ? message->size
                                                      : NODE_FAULT_TEXT_MAX;
    memcpy(text, message->data, size);
    text[size] = '\0';
    return host_fail(error, HOST_CUBE, "node %u: %s; %s", message->source, text,
                     strstr(text, "memory") != NULL
                         ? "give the nodes more memory"
                         : "please report this with the points");
}

static int take(struct host_service *service,
                const struct cube_message *message, struct host_error *error)
{
    struct host_node_report *report = &service->report[message->source];
    switch (message->type) {
    case NODE_READY:
        if (message->size != sizeof report->map) {
            return unsound(message, "is ready in another language", error);
        }
        memcpy(&report->map, message->data, sizeof report->map);
        service->ready += !report->ready;
        report->ready = true;
        return 0;
    case NODE_PONG:
        return host_detector_pong(service, message, error);
    case NODE_PAGE_REQUEST:
        return take_requests(service, message, error);
    case NODE_RESULT:
        return take_results(service, message, error);
    case NODE_SPILL:
        return take_spill(service, message, error);
    case NODE_UNSPILL_REQUEST:
        return take_unspill_request(service, message, error);
    case NODE_FINISHED:
        return take_finished(service, message, error);
    case NODE_FAULT:
        return take_fault(message, error);
    default:
        return unsound(message, "sent what the host does not know", error);
    }
}

int host_handle(struct host_service *service,
                const struct cube_message *message, struct host_error *error)
{
    if (message->source >= service->machine->nodes) {
        return unsound(message, "is not of this cube", error);
    }
    struct host_node *node = &service->node[message->source];
    bool expected = message->type == NODE_PONG || message->type == NODE_FAULT ||
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
