#include "service.h"

#include <stdlib.h>
#include <string.h>

#include "intake.h"

enum {
    WINDOW_DEFAULT = 32,
    CHECK_EVERY_US = 20000, /* looks after the nodes' lives */
    WIRE_LOST_US = 2000000,
    BRING_UP_US_MAX = 9000000,
    FAREWELL_US_MAX = 2000000,
    CREDITS_MIN = 8,
    CREDITS_SHARED = 128
};

static uint64_t now_of(const struct host_service *s)
{
    return s->machine->now_us(s->machine->context);
}

static int make_cube(struct host_service *s, struct host_error *error)
{
    struct cube_config config;
    memset(&config, 0, sizeof config);
    config.self = CUBE_HOST;
    config.dimension = (uint8_t)s->machine->dimension;
    config.window = (uint16_t)(s->window == 0 ? WINDOW_DEFAULT : s->window);
    if (config.window > LINK_WINDOW_MAX) {
        config.window = LINK_WINDOW_MAX;
    }
    config.epoch = s->machine->epoch;
    config.pipes[0] = s->machine->pipe;
    size_t bytes = cube_arena_bytes(&config);
    s->cube_memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (s->cube_memory == NULL) {
        return host_fail_memory(error, "the wire");
    }
    s->cube = cube_init(s->cube_memory, bytes, &config);
    if (s->cube == NULL) {
        return host_fail(error, HOST_BROKEN,
                         "host: the cube of %u nodes does not come up; please "
                         "report this",
                         s->machine->nodes);
    }
    return 0;
}

/* Sleeps until the wire has something, or until the cube's next duty. */
static void wait_for_wire(struct host_service *s, uint64_t now_us)
{
    uint64_t due = cube_next_due_us(s->cube, now_us);
    s->machine->idle(s->machine->context,
                     due > CHECK_EVERY_US ? CHECK_EVERY_US : due);
}

/* Whether nodes live, and the wire to node 0 holds.  A wire that closes is as a
 * rule that of a node about to be reaped: it is given a moment. */
static int check(struct host_service *s, uint64_t now_us,
                 struct host_error *error)
{
    if (now_us < s->check_us) {
        return 0;
    }
    s->check_us = now_us + CHECK_EVERY_US;
    if (cube_link_state(s->cube, 0) != LINK_DOWN) {
        s->wire_seen_us = now_us;
    }
    if (s->machine->check(s->machine->context, error) != 0) {
        return error->code;
    }
    if (now_us - s->wire_seen_us > WIRE_LOST_US) {
        return host_fail(error, HOST_CUBE,
                         "node 0 link %u: the wire to the host is closed; run "
                         "again, and look for what closed it",
                         s->machine->dimension);
    }
    return 0;
}

/* Reads all that has come: bytes first, then messages. */
static int read_all(struct host_service *s, unsigned *moved,
                    struct host_error *error)
{
    struct cube_message message;
    int status = 0;
    while (status == 0 && cube_read(s->cube, &message)) {
        status = host_intake(s, &message, error);
        cube_release(s->cube);
        (*moved)++;
    }
    return status;
}

static bool send_page(struct host_service *s, uint16_t to)
{
    struct {
        uint32_t page;
        uint8_t data[INCODE_PAGE_BYTES];
    } body;
    struct host_node *node = &s->node[to];
    body.page = node->pages[node->pages_first];
    size_t size = host_page(s->order, body.page, body.data);
    if (cube_write(s->cube, to, NODE_PAGE, &body, 4 + size) != 0) {
        return false;
    }
    node->pages_first = (node->pages_first + 1) % HOST_PAGES_QUEUED_MAX;
    node->pages_count--;
    s->report[to].pages++;
    s->report[to].page_bytes += size;
    return true;
}

static bool send_unspill(struct host_service *s, uint16_t to,
                         struct host_error *error)
{
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
    body.header.last = list->faces == 0;
    if (body.header.last) {
        node->unspills_first = (node->unspills_first + 1) % HOST_UNSPILLS_MAX;
        node->unspills_count--;
    }
    return cube_write(s->cube, to, NODE_UNSPILL, &body,
                      sizeof body.header +
                          body.header.count * sizeof body.faces[0]) == 0;
}

/* The next message that is due to this node; false: none, or no room. */
static bool serve_node(struct host_service *s, uint16_t to,
                       struct host_error *error)
{
    struct host_node *node = &s->node[to];
    /* A broadcast and a letter go different ways: jobs wait until every node
     * has its setup. */
    if (node->job_due && s->ready == s->machine->nodes) {
        node->job_due = cube_write(s->cube, to, NODE_JOB, &node->job,
                                   sizeof node->job) != 0;
        return !node->job_due;
    }
    if (node->report_due) {
        node->report_due = cube_write(s->cube, to, NODE_REPORT, NULL, 0) != 0;
        return !node->report_due;
    }
    /* Half of the credit back at a time. */
    uint32_t credit = node->results + s->setup.credits;
    if (credit - node->credit >= s->setup.credits / 2) {
        if (cube_write(s->cube, to, NODE_CREDIT, &credit, sizeof credit) != 0) {
            return false;
        }
        node->credit = credit;
        return true;
    }
    if (node->unspills_count > 0) {
        return send_unspill(s, to, error);
    }
    return node->pages_count > 0 && send_page(s, to);
}

/* Serves the nodes in turn, while the wire takes it. */
static unsigned serve(struct host_service *s, struct host_error *error)
{
    unsigned sent = 0, idle = 0;
    if (s->setup_due) {
        if (cube_write(s->cube, CUBE_ALL, NODE_SETUP, &s->setup,
                       sizeof s->setup) != 0) {
            return 0;
        }
        s->setup_due = false;
        sent++;
    }
    while (idle < s->machine->nodes && error->code == 0) {
        if (serve_node(s, (uint16_t)s->turn, error)) {
            sent++;
            idle = 0;
        } else {
            idle++;
        }
        s->turn = (s->turn + 1) % s->machine->nodes;
    }
    return sent;
}

static bool pages_wait(const struct host_service *s)
{
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (s->node[i].pages_count > 0) {
            return true;
        }
    }
    return false;
}

/* One round of the loop: read, serve, and sleep where nothing moved. */
static int round_trip(struct host_service *s, struct host_error *error)
{
    uint64_t now = now_of(s);
    unsigned moved = (unsigned)cube_poll(s->cube, now);
    if (read_all(s, &moved, error) != 0) {
        return error->code;
    }
    if (s->started) {
        bool pages = pages_wait(s);
        uint64_t begun = pages ? now_of(s) : 0;
        moved += serve(s, error);
        s->pages_us += pages ? now_of(s) - begun : 0;
    }
    if (error->code != 0 || check(s, now, error) != 0) {
        return error->code;
    }
    if (moved == 0) {
        wait_for_wire(s, now);
    }
    return 0;
}

int host_service_start(struct host_service *service, struct host_error *error)
{
    uint64_t start = now_of(service);
    service->wire_seen_us = start;
    service->spill.file = -1;
    service->node = calloc(service->machine->nodes, sizeof *service->node);
    service->report = calloc(service->machine->nodes, sizeof *service->report);
    if (service->node == NULL || service->report == NULL) {
        return host_fail_memory(error, "the nodes' queues");
    }
    if (make_cube(service, error) != 0) {
        return error->code;
    }
    bool called = false;
    while (service->here < service->machine->nodes) {
        called = called ||
                 cube_write(service->cube, CUBE_ALL, NODE_CALL, NULL, 0) == 0;
        if (round_trip(service, error) != 0) {
            return error->code;
        }
        if (now_of(service) - start > BRING_UP_US_MAX ||
            cube_link_state(service->cube, 0) == LINK_REFUSED) {
            return host_fail(error, HOST_CUBE,
                             "node 0 link %u: %u of %u nodes answer; is "
                             "incode-node of this version, and the machine "
                             "not too busy?",
                             service->machine->dimension, service->here,
                             service->machine->nodes);
        }
    }
    return 0;
}

/* One job a worker: its region, or all bricks where there is one region. */
static void prepare(struct host_service *s)
{
    const struct host_order *order = s->order;
    s->setup.protocol = NODE_PROTOCOL;
    s->setup.nodes = (uint16_t)s->machine->nodes;
    s->setup.holders = (uint16_t)(s->machine->nodes - s->workers);
    s->setup.credits = CREDITS_MIN + CREDITS_SHARED / s->machine->nodes;
    s->setup.setup.bricks = order->bricks;
    memcpy(s->setup.setup.lo, order->lo, sizeof order->lo);
    memcpy(s->setup.setup.hi, order->hi, sizeof order->hi);
    memcpy(s->setup.setup.cells, order->cells, sizeof order->cells);
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *node = &s->node[i];
        node->credit = s->setup.credits;
        node->job_due = i < s->workers;
        if (node->job_due) {
            const struct host_region *region = &order->region[i];
            struct incode_job *job = &node->job.job;
            job->first = region->first;
            job->last = region->last;
            memcpy(job->lo, region->lo, sizeof region->lo);
            memcpy(job->hi, region->hi, sizeof region->hi);
            node->job.epoch =
                host_ledger_open(&s->ledger, i, job->first, job->last);
        }
    }
    s->setup_due = true;
    s->started = true;
}

int host_service_run(struct host_service *service, struct host_error *error)
{
    struct host_service *s = service;
    if (host_ledger_init(&s->ledger, s->order->bricks, s->machine->nodes,
                         error) != 0 ||
        host_spill_init(&s->spill, 0, error) != 0) {
        return error->code;
    }
    prepare(s);
    host_progress_start(&s->progress, s->show_progress);
    bool asked = false;
    while (s->done < s->machine->nodes) {
        if (round_trip(s, error) != 0) {
            host_progress_end(&s->progress);
            return error->code;
        }
        if (!asked && s->done == s->workers) {
            for (unsigned i = s->workers; i < s->machine->nodes; i++) {
                s->node[i].report_due = true;
            }
            asked = true;
        }
        host_progress_show(&s->progress, s->ledger.committed, s->ledger.bricks,
                           s->tets->count);
    }
    host_progress_end(&s->progress);
    s->retransmitted = cube_link_statistics(s->cube, 0)->retransmitted;
    s->finished = true;
    if (s->ledger.committed != s->ledger.bricks) {
        return host_fail(error, HOST_BROKEN,
                         "host: %u bricks of %u committed; please report this "
                         "with the points",
                         s->ledger.committed, s->ledger.bricks);
    }
    return 0;
}

void host_service_end(struct host_service *service)
{
    struct host_service *s = service;
    uint64_t start = now_of(service);
    bool told = s->cube == NULL || !s->finished, closing = false;
    if (!s->finished) {
        s->machine->stop(s->machine->context); /* nothing to wait for */
    }
    while (!told ||
           (s->cube != NULL && !s->machine->ended(s->machine->context))) {
        uint64_t now = now_of(s);
        unsigned moved = (unsigned)cube_poll(s->cube, now);
        struct cube_message message;
        while (cube_read(s->cube, &message)) {
            cube_release(s->cube);
        }
        told = told || cube_write(s->cube, CUBE_ALL, NODE_STOP, NULL, 0) == 0;
        if (told && !closing && cube_idle(s->cube)) {
            cube_close(s->cube, start + FAREWELL_US_MAX);
            closing = true;
        }
        if (now - start > FAREWELL_US_MAX) {
            break;
        }
        if (moved == 0) {
            wait_for_wire(s, now);
        }
    }
    s->machine->stop(s->machine->context);
    host_ledger_free(&s->ledger);
    host_spill_free(&s->spill);
    free(s->node);
    free(s->report);
    free(s->cube_memory);
    s->cube = NULL;
    s->node = NULL;
    s->report = NULL;
    s->cube_memory = NULL;
}
