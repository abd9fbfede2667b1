#include "service.h"

#include <stdlib.h>
#include <string.h>

#include "parts.h"
#include "host/base/progress.h"

enum {
    IDLE_US_MAX = 20000,
    AUDIT_US_MAX = 1000, /* the end of the check does not wake the loop */
    FAREWELL_US_MAX = 2000000,
    CREDITS_MIN = 8,
    CREDITS_SHARED = 128
};

static uint64_t now_of(const struct host_service *s) {
    return s->machine->now_us(s->machine->context);
}

/* Sleeps until the wire has something, or until the cube's next duty. */
static void wait_for_wire(struct host_service *s, uint64_t now_us) {
    uint64_t due = cube_next_due_us(s->cube, now_us);
    uint64_t most =
        s->audit.state == HOST_AUDIT_RUNS ? AUDIT_US_MAX : IDLE_US_MAX;
    s->machine->idle(s->machine->context, due > most ? most : due);
}

/* Reads all that has come: bytes first, then messages. */
static int read_all(struct host_service *s, unsigned *moved,
                    struct host_error *error) {
    struct cube_message message;
    int status = 0;
    while (status == 0 && cube_read(s->cube, &message)) {
        status = host_handle(s, &message, error);
        cube_release(s->cube);
        (*moved)++;
    }
    return status;
}

/* Who watches asks those nodes alone that have a part in this generation. */
static void look_out(struct host_service *s, uint64_t now_us) {
    struct host_watchers_progress progress = {s->ledger.committed,
                                              s->ledger.bricks, 0};
    progress.tetrahedra = s->tets == NULL ? 0 : s->tets->count;
    host_watching_look(&s->watching, s->machine, now_us, &progress);
    for (unsigned i = 0; s->watching.asked && i < s->machine->nodes; i++)
        if (s->work.lost[i])
            host_watching_leave_out(&s->watching, i);
}

/* One round of the loop: read, serve, and sleep where nothing moved. */
int host_service_round(struct host_service *service, struct host_error *error) {
    struct host_service *s = service;
    uint64_t now = now_of(s);
    unsigned moved = (unsigned)cube_poll(s->cube, now);
    /* Nodes that have served another start of the host know a later one. */
    if (cube_wiring(s->cube)->generation != s->generation &&
        host_generation_begin(s, now, error) != 0)
        return error->code;
    if (read_all(s, &moved, error) != 0 ||
        host_kept_write(s->kept, s->tets, now, error) != 0)
        return error->code;
    bool pages = s->started && host_sending_pages_wait(s);
    uint64_t begun = pages ? now_of(s) : 0;
    if (s->machine->watchers != NULL)
        look_out(s, now);
    moved += host_sending_serve(s, error);
    s->pages_us += pages ? now_of(s) - begun : 0;
    if (error->code != 0 || host_detector_check(s, now, error) != 0)
        return error->code;
    if (s->loss)
        return host_generation_renew(s, now, error);
    if (moved == 0)
        wait_for_wire(s, now);
    return 0;
}

int host_service_open(struct host_service *service, struct host_error *error) {
    struct host_service *s = service;
    s->spill.file = -1;
    s->patience_us = s->patience_us == 0 ? HOST_PATIENCE_US : s->patience_us;
    s->node = calloc(s->machine->nodes, sizeof *s->node);
    s->report = calloc(s->machine->nodes, sizeof *s->report);
    s->work.nodes = s->machine->nodes;
    s->work.sharing = s->sharing;
    s->work.lost = calloc(s->machine->nodes, sizeof *s->work.lost);
    if (s->node == NULL || s->report == NULL || s->work.lost == NULL)
        return host_fail_memory(error, "the nodes' queues");
    s->cube = host_cube_make(s->machine, s->window, &s->cube_memory, error);
    if (s->cube == NULL)
        return error->code;
    s->generations = 1;
    s->check_us = s->wire_down_us = now_of(s);
    s->opened_us = s->check_us;
    host_detector_begin(s, s->check_us);
    return 0;
}

static bool host_service_is_up(const struct host_service *service) {
    return service->up == service->work.living && !service->searching;
}

int host_service_start(struct host_service *service, struct host_error *error) {
    int status = host_service_open(service, error);
    while (status == 0 && !host_service_is_up(service))
        status = host_service_round(service, error);
    if (status == 0)
        host_bring_up_done(service);
    return status;
}

/* The strategy's part, and what it sees. */
static int prepare_work(struct host_service *s, struct host_error *error) {
    struct host_work *work = &s->work;
    work->order = s->order;
    work->ledger = &s->ledger;
    work->tets = s->tets;
    work->write = host_sending_write;
    work->write_to_all = host_sending_write_to_all;
    work->context = s;
    work->state = calloc(1, s->strategy->state_bytes + 1);
    return work->state != NULL
               ? 0
               : host_fail_memory(error, "the strategy's state");
}

/* What is the same in all generations. */
static void prepare(struct host_service *s) {
    const struct host_order *order = s->order;
    s->setup.protocol = NODE_PROTOCOL;
    s->setup.nodes = (uint16_t)s->machine->nodes;
    s->setup.credits = CREDITS_MIN + CREDITS_SHARED / s->machine->nodes;
    s->setup.setup.owner_rule = (uint8_t)s->strategy->owner_rule;
    s->ledger.owner_rule = s->strategy->owner_rule;
    s->ledger.alone = !s->strategy->meshes;
    s->setup.setup.bricks = order->bricks;
    memcpy(s->setup.setup.lo, order->lo, sizeof order->lo);
    memcpy(s->setup.setup.hi, order->hi, sizeof order->hi);
    memcpy(s->setup.setup.cells, order->cells, sizeof order->cells);
    s->work.page_key = s->setup.page_key;
    s->started = true;
}

/* Statistics of all that nodes have done, from those who have not told. */
static void ask_for_reports(struct host_service *s) {
    s->reporting = true;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *node = &s->node[i];
        node->reported = node->reported && !s->strategy->helps;
        node->report_due = !s->work.lost[i] && !node->reported;
    }
}

static bool all_reported(const struct host_service *s) {
    for (unsigned i = 0; i < s->machine->nodes; i++)
        if (!s->work.lost[i] && !s->node[i].reported)
            return false;
    return true;
}

/* All bricks are here: checks the result, and requests the statistics if it is
 * right. */
static int conclude(struct host_service *s, struct host_error *error) {
    bool passed;
    if (host_audit_step(s, &passed, error) != 0)
        return error->code;
    if (passed && s->late)
        s->over = true;
    else if (passed)
        ask_for_reports(s);
    return 0;
}

int host_service_run(struct host_service *service, struct host_error *error) {
    struct host_service *s = service;
    if (host_ledger_init(&s->ledger, s->order->bricks, s->machine->nodes,
                         error) != 0 ||
        host_spill_init(&s->spill, 0, error) != 0 ||
        prepare_work(s, error) != 0)
        return error->code;
    prepare(s);
    if (host_kept_load(s->kept, &s->ledger, s->order, s->tets, error) != 0)
        return error->code;
    if (s->ledger.committed > 0) { /* in an earlier run: as after a loss */
        s->audit.lost_work = true;
        s->strategy->lose(&s->work);
    }
    host_kept_lost(s->kept, &s->ledger, s->tets);
    host_sending_begin(s);
    while (!s->over && !(s->reporting && all_reported(s))) {
        if (host_service_round(s, error) != 0)
            return error->code;
        if (!s->dealt && s->ready == s->work.living)
            host_sending_deal(s);
        if (!s->reporting && s->ledger.committed == s->ledger.bricks &&
            (s->working == 0 || s->late) && conclude(s, error) != 0)
            return error->code;
        host_progress_show(s->ledger.committed, s->ledger.bricks,
                           s->tets->count);
    }
    host_detector_end(s);
    host_paging_end(s);
    for (unsigned d = 0; d < cube_links(s->cube); d++) {
        const struct link_statistics *l = cube_link_statistics(s->cube, d);
        s->retransmitted += l->retransmitted;
        s->bytes_sent += l->bytes_sent;
        s->bytes_received += l->bytes_received;
    }
    s->finished = true;
    return 0;
}

int host_service_wires(struct host_service *service, struct host_error *error) {
    int status = 0;
    while (status == 0 && host_missing_links_awaited(service))
        status = host_service_round(service, error);
    return status;
}

/* Whether no node is there that has to hear the end. */
static bool parted(const struct host_service *s) {
    enum link_state state = cube_link_state(s->cube, 0);
    return s->machine->ended(s->machine->context) &&
           (s->machine->restarts != NULL || state == LINK_CLOSED ||
            state == LINK_DOWN);
}

void host_service_end(struct host_service *service) {
    struct host_service *s = service;
    uint64_t start = now_of(s);
    bool told = s->cube == NULL || !s->finished, closing = false;
    if (!s->finished)
        s->machine->stop(s->machine->context); /* nothing to wait for */
    while (!told || (s->cube != NULL && !parted(s))) {
        uint64_t now = now_of(s);
        unsigned moved = (unsigned)cube_poll(s->cube, now);
        struct cube_message message;
        while (cube_read(s->cube, &message))
            cube_release(s->cube);
        told = told || cube_write(s->cube, CUBE_ALL, NODE_STOP, NULL, 0) == 0;
        if (told && !closing && cube_idle(s->cube)) {
            cube_close(s->cube, start + FAREWELL_US_MAX);
            closing = true;
        }
        if (now - start > FAREWELL_US_MAX)
            break;
        if (moved == 0)
            wait_for_wire(s, now);
    }
    s->machine->stop(s->machine->context);
    host_audit_free(&s->audit);
    host_ledger_free(&s->ledger);
    struct host_error unkept = {0}; /* what it costs is work done again */
    (void)host_kept_lose(s->kept, s->tets, &unkept);
    host_kept_free(s->kept);
    host_spill_free(&s->spill);
    free(s->node);
    free(s->report);
    free(s->work.lost);
    free(s->work.state);
    free(s->cube_memory);
    s->cube = NULL;
    s->node = NULL;
    s->report = NULL;
    memset(&s->work, 0, sizeof s->work);
    s->cube_memory = NULL;
}
