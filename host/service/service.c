#include "service.h"

#include <stdlib.h>
#include <string.h>

#include "transport/wiring.h"
#include "handlers.h"
#include "missing_links.h"
#include "failure_detector.h"

enum {
    WINDOW_DEFAULT = 32,
    IDLE_US_MAX = 20000,
    FRUITLESS_MAX = 64,
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
    config.pipes[1] = s->machine->spare;
    config.spare_node = s->machine->spare_node;
    config.host_wires = s->machine->host_wires;
    for (unsigned i = 1; i < config.host_wires; i++) {
        config.pipes[i] = s->machine->wires[i];
    }
    cube_for_serial(&config, s->machine->serial_baud);
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
                     due > IDLE_US_MAX ? IDLE_US_MAX : due);
}

/* Reads all that has come: bytes first, then messages. */
static int read_all(struct host_service *s, unsigned *moved,
                    struct host_error *error)
{
    struct cube_message message;
    int status = 0;
    while (status == 0 && cube_read(s->cube, &message)) {
        status = host_handle(s, &message, error);
        cube_release(s->cube);
        (*moved)++;
    }
    return status;
}

static bool send_counted(struct host_service *s, uint16_t to, uint8_t type,
                         const void *data, size_t size)
{
    bool sent = cube_write(s->cube, to, type, data, size) == 0;
    s->node[to].sent += sent;
    return sent;
}

/* The same for the strategy. */
static bool write_counted(void *context, unsigned node, uint8_t type,
                          const void *data, size_t size)
{
    return send_counted(context, (uint16_t)node, type, data, size);
}

static bool send_page(struct host_service *s, uint16_t to)
{
    struct {
        uint32_t page;
        uint8_t data[INCODE_PAGE_BYTES];
    } body;
    struct host_node *node = &s->node[to];
    if (cube_room(s->cube, to) == 0) {
        return false;
    }
    body.page = node->pages[node->pages_first];
    size_t size = host_page(s->order, body.page, body.data);
    if (!send_counted(s, to, NODE_PAGE, &body, 4 + size)) {
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
    body.header.sent = node->sent - node->missed;
    if (body.header.last) {
        node->unspills_first = (node->unspills_first + 1) % HOST_UNSPILLS_MAX;
        node->unspills_count--;
    }
    return send_counted(s, to, NODE_UNSPILL, &body,
                        sizeof body.header +
                            body.header.count * sizeof body.faces[0]);
}

/* --- jobs ----------------------------------------------------------------- */

static void give_job(struct host_service *s, unsigned to,
                     const struct incode_job *job)
{
    struct host_node *node = &s->node[to];
    node->job.job = *job;
    node->job.epoch = host_ledger_open(&s->ledger, to, job->first, job->last);
    node->job_due = true;
    node->working = true;
    node->reported = false;
    s->working++;
}

/* Every node has its setup: the first jobs. */
static void deal(struct host_service *s)
{
    struct incode_job job;
    s->dealt = true;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (!s->work.lost[i] && s->strategy->first(&s->work, i, &job)) {
            give_job(s, i, &job);
        }
    }
}

/* Begins with the nodes as after their start: nothing is out, nothing asked
 * for, and each has to have its setup. */
static void set_up(struct host_service *s)
{
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
    }
}

/* --- the loop ------------------------------------------------------------- */

/* The next message that is due to this node, pings apart; false: none, or no
 * room. */
static bool serve_work(struct host_service *s, uint16_t to,
                       struct host_error *error)
{
    struct host_node *node = &s->node[to];
    if (!s->started || !s->report[to].here) {
        return false; /* what goes before the first answer may get lost */
    }
    if (node->setup_due) {
        struct node_setup_message setup = s->setup;
        s->strategy->set_up(&s->work, to, &setup);
        node->setup_due =
            !send_counted(s, to, NODE_SETUP, &setup, sizeof setup);
        return !node->setup_due;
    }
    struct incode_job job;
    if (s->dealt && !node->working && s->strategy->next(&s->work, to, &job)) {
        give_job(s, to, &job);
    }
    if (node->job_due) {
        node->job_due =
            !send_counted(s, to, NODE_JOB, &node->job, sizeof node->job);
        return !node->job_due;
    }
    if (node->report_due) {
        node->report_due = !send_counted(s, to, NODE_REPORT, NULL, 0);
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
    if (s->strategy->send != NULL && s->strategy->send(&s->work, to)) {
        return true;
    }
    if (node->unspills_count > 0) {
        return send_unspill(s, to, error);
    }
    return node->pages_count > 0 && send_page(s, to);
}

/* A ping and a message of work in turn: on a slow wire the pings of many nodes
 * would leave no room for anything else. */
static bool serve_node(struct host_service *s, uint16_t to,
                       struct host_error *error)
{
    struct host_node *node = &s->node[to];
    if (s->work.lost[to]) {
        return false;
    }
    if (node->ping_due && !node->ping_last) {
        node->ping_last = host_detector_ping(s, to);
        return node->ping_last;
    }
    if (serve_work(s, to, error)) {
        node->ping_last = false;
        return true;
    }
    return node->ping_due && host_detector_ping(s, to);
}

/* Serves the nodes in turn, while the wire takes it. */
static unsigned serve(struct host_service *s, struct host_error *error)
{
    unsigned sent = 0, idle = 0;
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

/* --- generations ---------------------------------------------------------- */

/* Whether the host can speak by that node: by a wire, and on to another. */
static bool speaks(const struct host_service *s, const struct cube_wiring *w,
                   uint16_t gateway)
{
    unsigned dimension = s->machine->dimension;
    bool on = dimension == 0;
    for (unsigned d = 0; d < dimension; d++) {
        on = on || !wiring_is_dead(w, w->dead_count, gateway, d, dimension);
    }
    return on &&
           !wiring_is_dead(w, w->dead_count, gateway, dimension, dimension);
}

uint16_t host_service_gateway(const struct host_service *service,
                              const struct cube_wiring *next)
{
    const struct host_service *s = service;
    uint16_t other = next->gateway != 0 ? 0 : s->machine->spare_node;
    return !speaks(s, next, next->gateway) && speaks(s, next, other)
               ? other
               : next->gateway;
}

/* The gateway must be there, and what was given up must not be on the way. */
static int check_renewed(const struct host_service *s, struct host_error *error)
{
    const struct cube_wiring *w = cube_wiring(s->cube);
    unsigned dimension = s->machine->dimension;
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        bool dead = wiring_is_dead(w, w->dead_count, i, dimension, dimension);
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

/* In a new generation all nodes begin again, with what is not committed. */
static int begin_again(struct host_service *s, uint64_t now_us,
                       struct host_error *error)
{
    host_detector_begin(s, now_us);
    if (check_renewed(s, error) != 0) {
        return error->code;
    }
    if (s->started) {
        s->strategy->lose(&s->work);
        host_spill_clear(&s->spill);
        set_up(s);
    }
    return 0;
}

/* Boards that reset themselves would have the run begin for ever. */
static int check_progress(struct host_service *s, struct host_error *error)
{
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

/* After a loss: a new generation, without what was given up. */
static int renew(struct host_service *s, uint64_t now_us,
                 struct host_error *error)
{
    struct cube_wiring next = *cube_wiring(s->cube);
    unsigned dimension = s->machine->dimension;
    s->loss = false;
    if (s->started && s->ledger.committed == s->ledger.bricks) {
        s->over = true; /* nothing is lost that is needed */
        return 0;
    }
    if (check_progress(s, error) != 0) {
        return error->code;
    }
    next.generation++;
    if (s->searching) {
        next.dead_count = next.settled; /* that a wire is absent shows later */
    } else {
        next.absent_s = s->started ? s->machine->absent_s : next.absent_s;
    }
    if (s->wire_lost) {
        struct cube_dead dead = {next.gateway, (uint8_t)dimension};
        (void)wiring_add_dead(&next, dead, dimension);
        s->wire_lost = false;
        s->wire_down_us = now_us;
    }
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct cube_dead dead = {(uint16_t)i, CUBE_WHOLE_NODE};
        if (s->node[i].given_up) {
            (void)wiring_add_dead(&next, dead, dimension);
        }
    }
    next.gateway = host_service_gateway(s, &next);
    cube_renew(s->cube, &next);
    s->generations++;
    return begin_again(s, now_us, error);
}

/* One round of the loop: read, serve, and sleep where nothing moved. */
int host_service_round(struct host_service *service, struct host_error *error)
{
    struct host_service *s = service;
    uint64_t now = now_of(s);
    unsigned moved = (unsigned)cube_poll(s->cube, now);
    /* Nodes that have served another start of the host know a later one. */
    if (cube_wiring(s->cube)->generation != s->generation &&
        begin_again(s, now, error) != 0) {
        return error->code;
    }
    if (read_all(s, &moved, error) != 0) {
        return error->code;
    }
    bool pages = s->started && pages_wait(s);
    uint64_t begun = pages ? now_of(s) : 0;
    moved += serve(s, error);
    s->pages_us += pages ? now_of(s) - begun : 0;
    if (error->code != 0 || host_detector_check(s, now, error) != 0) {
        return error->code;
    }
    if (s->loss) {
        return renew(s, now, error);
    }
    if (moved == 0) {
        wait_for_wire(s, now);
    }
    return 0;
}

int host_service_open(struct host_service *service, struct host_error *error)
{
    struct host_service *s = service;
    s->spill.file = -1;
    s->patience_us = s->patience_us == 0 ? HOST_PATIENCE_US : s->patience_us;
    s->node = calloc(s->machine->nodes, sizeof *s->node);
    s->report = calloc(s->machine->nodes, sizeof *s->report);
    s->work.nodes = s->machine->nodes;
    s->work.lost = calloc(s->machine->nodes, sizeof *s->work.lost);
    if (s->node == NULL || s->report == NULL || s->work.lost == NULL) {
        return host_fail_memory(error, "the nodes' queues");
    }
    if (make_cube(s, error) != 0) {
        return error->code;
    }
    s->generations = 1;
    s->check_us = s->wire_down_us = now_of(s);
    host_detector_begin(s, s->check_us);
    return 0;
}

bool host_service_is_up(const struct host_service *service)
{
    return service->here == service->work.living && !service->searching;
}

int host_service_start(struct host_service *service, struct host_error *error)
{
    int status = host_service_open(service, error);
    while (status == 0 && !host_service_is_up(service)) {
        status = host_service_round(service, error);
    }
    return status;
}

/* The strategy's part, and what it sees. */
static int prepare_work(struct host_service *s, struct host_error *error)
{
    struct host_work *work = &s->work;
    work->order = s->order;
    work->ledger = &s->ledger;
    work->tets = s->tets;
    work->write = write_counted;
    work->context = s;
    work->state = calloc(1, s->strategy->state_bytes + 1);
    return work->state != NULL
               ? 0
               : host_fail_memory(error, "the strategy's state");
}

/* What is the same in all generations. */
static void prepare(struct host_service *s)
{
    const struct host_order *order = s->order;
    s->setup.protocol = NODE_PROTOCOL;
    s->setup.nodes = (uint16_t)s->machine->nodes;
    s->setup.credits = CREDITS_MIN + CREDITS_SHARED / s->machine->nodes;
    s->setup.setup.bricks = order->bricks;
    memcpy(s->setup.setup.lo, order->lo, sizeof order->lo);
    memcpy(s->setup.setup.hi, order->hi, sizeof order->hi);
    memcpy(s->setup.setup.cells, order->cells, sizeof order->cells);
    s->started = true;
}

/* Statistics of all that nodes have done, from those who have not told. */
static void ask_for_reports(struct host_service *s)
{
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        struct host_node *node = &s->node[i];
        node->report_due = !s->work.lost[i] && !node->reported;
    }
}

static bool all_reported(const struct host_service *s)
{
    for (unsigned i = 0; i < s->machine->nodes; i++) {
        if (!s->work.lost[i] && !s->node[i].reported) {
            return false;
        }
    }
    return true;
}

int host_service_run(struct host_service *service, struct host_error *error)
{
    struct host_service *s = service;
    if (host_ledger_init(&s->ledger, s->order->bricks, s->machine->nodes,
                         error) != 0 ||
        host_spill_init(&s->spill, 0, error) != 0 ||
        prepare_work(s, error) != 0) {
        return error->code;
    }
    prepare(s);
    set_up(s);
    host_progress_start(&s->progress, s->show_progress);
    bool asked = false;
    while (!s->over && !(asked && all_reported(s))) {
        if (host_service_round(s, error) != 0) {
            host_progress_end(&s->progress);
            return error->code;
        }
        if (!s->dealt && s->ready == s->work.living) {
            deal(s);
        }
        if (!asked && s->ledger.committed == s->ledger.bricks &&
            s->working == 0) {
            ask_for_reports(s);
            asked = true;
        }
        host_progress_show(&s->progress, s->ledger.committed, s->ledger.bricks,
                           s->tets->count);
    }
    host_progress_end(&s->progress);
    host_detector_end(s);
    for (unsigned d = 0; d < cube_links(s->cube); d++) {
        s->retransmitted += cube_link_statistics(s->cube, d)->retransmitted;
    }
    s->finished = true;
    return 0;
}

int host_service_wires(struct host_service *service, struct host_error *error)
{
    int status = 0;
    while (status == 0 && host_missing_links_awaited(service)) {
        status = host_service_round(service, error);
    }
    return status;
}

/* Whether no node is there that has to hear the end. */
static bool parted(const struct host_service *s)
{
    enum link_state state = cube_link_state(s->cube, 0);
    return s->machine->ended(s->machine->context) &&
           (s->machine->restarts != NULL || state == LINK_CLOSED ||
            state == LINK_DOWN);
}

void host_service_end(struct host_service *service)
{
    struct host_service *s = service;
    uint64_t start = now_of(s);
    bool told = s->cube == NULL || !s->finished, closing = false;
    if (!s->finished) {
        s->machine->stop(s->machine->context); /* nothing to wait for */
    }
    while (!told || (s->cube != NULL && !parted(s))) {
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
    free(s->work.lost);
    free(s->work.state);
    free(s->cube_memory);
    s->cube = NULL;
    s->node = NULL;
    s->report = NULL;
    memset(&s->work, 0, sizeof s->work);
    s->cube_memory = NULL;
}
