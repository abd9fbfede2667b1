#include "settle.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

#include "host/mesh/open.h"
#include "memory_needed.h"

/* The largest power of two of nodes that have a processor each. */
static unsigned suitable_nodes(void) {
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    unsigned nodes = 1;
    while (nodes < HOST_PROCESSES_MAX && (long)nodes * 2 <= processors) {
        nodes *= 2;
    }
    return nodes;
}

unsigned host_run_nodes(const struct host_run_options *options) {
    if (options->nodes != 0) {
        return options->nodes;
    }
    unsigned nodes =
        options->strategy == NULL ? 0 : options->strategy->nodes_default;
    nodes = nodes != 0 ? nodes : suitable_nodes();
    unsigned most = options->board->bare == NULL
                        ? nodes
                        : host_bare_nodes_max(options->board->bare);
    return nodes < most ? nodes : most;
}

/* For whom memory is asked about. */
struct run {
    const struct host_run_options *options;
    unsigned nodes;
    uint32_t bricks;
    const uint32_t *cells;
};

static bool fits(const void *context, const struct host_strategy *strategy) {
    const struct run *run = context;
    return host_memory_fits(run->options, strategy, run->nodes, run->bricks,
                            run->cells);
}

/* Whether a node may insert points, as far as the options go. */
static bool may_insert(const struct host_run_options *options) {
    return options->build != INCODE_BUILD_FACES &&
           options->index == INCODE_KD && options->face_rule == INCODE_FACE_OWN;
}

/* What `auto` is told.  Nodes of this machine share its processors, with the
 * host. */
static struct host_task task_of(const struct run *run, uint64_t points) {
    const struct host_run_options *options = run->options;
    unsigned nodes = run->nodes;
    long here = sysconf(_SC_NPROCESSORS_ONLN);
    unsigned processors = options->processors + (unsigned)(here > 0 ? here : 1);
    bool with_host = options->processors == 0;
    unsigned at_once = nodes + with_host;
    return (struct host_task){.points = points,
                              .memory = options->memory,
                              .nodes = nodes,
                              .processors =
                                  processors < at_once ? processors : at_once,
                              .with_host = with_host,
                              .wire_bytes_s = options->wire_bytes_s,
                              .face_rule = options->face_rule,
                              .build = options->build,
                              .sharing = options->sharing,
                              .fits = fits,
                              .context = run,
                              .by_points = may_insert(options)};
}

static void choose(const struct host_task *task,
                   struct host_run_result *result) {
    result->strategy = host_strategy_auto(task);
    host_strategy_why(task, result->why);
}

void host_settle(const struct host_run_options *options, uint64_t points,
                 struct host_run_result *result) {
    result->strategy = options->strategy;
    result->partition = options->partition;
    result->index = options->index;
    result->build = options->build;
    result->link = options->link;
    result->board = options->board;
    result->memory = options->memory;
    result->nodes = host_run_nodes(options);
    if (result->strategy == NULL) {
        const uint32_t no_cells[3] = {0};
        const struct run run = {options, result->nodes, 1, no_cells};
        struct host_task task = task_of(&run, points);
        choose(&task, result);
    }
}

/* Whether it is thinner by far along one axis than along another, or a quarter
 * of its points have a coordinate of the one before, as in a lattice. */
static bool is_thin(const struct host_order *order, uint32_t brick) {
    const struct incode_brick *b = &order->brick[brick];
    const double *const axis[3] = {b->x, b->y, b->z};
    double least = INFINITY, most = 0;
    for (int d = 0; d < 3; d++) {
        double lo = INFINITY, hi = -INFINITY;
        unsigned again = 0;
        for (unsigned i = 0; i < order->fill[brick]; i++) {
            double x = axis[d][i];
            lo = x < lo ? x : lo;
            hi = x > hi ? x : hi;
            again += i > 0 && x == axis[d][i - 1];
        }
        if (4 * again > order->fill[brick]) {
            return true;
        }
        least = hi - lo < least ? hi - lo : least;
        most = hi - lo > most ? hi - lo : most;
    }
    return least < most / 10;
}

/* Whether points fill a volume evenly, for all that their bricks tell: a few of
 * them, spread over all, are looked at.  Of surfaces lifted boxes tell more
 * than those along the axes. */
static bool is_uneven(const struct host_order *order) {
    enum { LOOKS = 1024, FEW = 20 };
    uint32_t step = order->bricks / LOOKS + 1, looked = 0, uneven = 0;
    for (uint32_t i = 0; i < order->bricks; i += step, looked++) {
        const struct incode_boxes *boxes = &order->boxes[i / INCODE_FANOUT];
        uneven += boxes->is_lifted[i % INCODE_FANOUT] != 0 || is_thin(order, i);
    }
    return uneven > looked / FEW;
}

/* Whether points that fill no volume evenly can be inserted brick after brick
 * where nodes have so much memory: all tetrahedra fit, or those that are open
 * at a time do.  Each takes a cell and a fourth of a point, and there are some
 * 6.5 a point; a part of the memory has other uses. */
static bool is_room(const struct host_order *order, uint64_t memory) {
    enum { CELL = 40, HALF_CELLS_A_POINT = 13, OTHER = 256 << 10 };
    uint64_t room = memory - memory / 8;
    uint64_t cells = room > OTHER ? (room - OTHER) / CELL : 0;
    return order->points * (uint64_t)HALF_CELLS_A_POINT / 2 <= cells ||
           host_order_open(order) <= cells;
}

bool host_settle_ordered(const struct host_run_options *options,
                         struct host_order *order,
                         struct host_run_result *result) {
    const struct host_strategy *before = result->strategy;
    bool uneven = is_uneven(order);
    if (options->build == INCODE_BUILD_AUTO && may_insert(options) && uneven &&
        !is_room(order, options->memory)) {
        result->build = INCODE_BUILD_FACES;
    }
    if (result->why[0] == '\0') { /* it was not for `auto` to say */
        return false;
    }
    const struct run run = {options, result->nodes, order->bricks,
                            order->cells};
    struct host_task task = task_of(&run, order->points);
    task.uneven = uneven;
    task.by_points = task.by_points && result->build != INCODE_BUILD_FACES;
    choose(&task, result);
    if (result->strategy->regions(result->nodes) == 1) {
        host_order_join(order);
    }
    if (options->nodes == 0 && options->begin == NULL &&
        result->strategy->nodes_default != 0) {
        result->nodes = result->strategy->nodes_default;
    }
    return result->strategy != before;
}
