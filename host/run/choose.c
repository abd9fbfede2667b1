#include "choose.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

#include "node/node.h"
#include "host/mesh/order.h"
#include "host/nodes/remote.h"
#include "transport/secure_wipe.h"
#include "host/formats/write.h"

static unsigned cube_dimension(unsigned nodes) {
    unsigned dimension = 0;
    while (1u << dimension < nodes)
        dimension++;
    return dimension;
}

static bool does_with(const struct host_run_options *options,
                      const struct host_strategy *strategy, unsigned dimension,
                      const struct node_setup_message *setup, uint64_t memory) {
    struct node_identity identity = {.dimension = (uint8_t)dimension,
                                     .window = (uint8_t)options->window,
                                     .epoch = 1};
    return host_strategy_arena(strategy, 1u << dimension, &identity, memory,
                               &options->sharing, setup) +
               HOST_STACK_BYTES + HOST_STATIC_BYTES <=
           memory;
}

/* The least memory that every node does with. */
static uint64_t memory_needed(const struct host_run_options *options,
                              const struct host_strategy *strategy,
                              unsigned dimension,
                              const struct node_setup_message *setup) {
    uint64_t memory = HOST_MEMORY_MIN;
    while (!does_with(options, strategy, dimension, setup, memory))
        memory += 16384;
    return memory;
}

/* What can be done where a cube needs more memory than its nodes have. */
static const char *memory_advice(const struct host_run_options *options,
                                 const struct host_strategy *strategy,
                                 unsigned nodes,
                                 const struct node_setup_message *setup) {
    struct host_run_options narrow = *options;
    narrow.window = 0;
    bool fewer = nodes > 1 &&
                 memory_needed(options, strategy, 0, setup) <= options->memory;
    if (options->cube != NULL)
        return "";
    if (options->window > 0 &&
        memory_needed(&narrow, strategy, cube_dimension(nodes), setup) <=
            options->memory)
        return fewer ? ", fewer --nodes, or no --window" : ", or no --window";
    return fewer ? ", or fewer --nodes" : "";
}

static struct node_setup_message
setup_of(const struct host_run_options *options, uint32_t bricks,
         const uint32_t cells[3]) {
    struct node_setup_message setup = {0};
    setup.setup.bricks = bricks;
    setup.setup.index = (uint8_t)options->index;
    memcpy(setup.setup.cells, cells, sizeof setup.setup.cells);
    return setup;
}

/* Whether every node does with the memory of the options.  bricks, cells: of
 * the order, where it is known; else 1 and none. */
static bool host_memory_fits(const struct host_run_options *options,
                             const struct host_strategy *strategy,
                             unsigned nodes, uint32_t bricks,
                             const uint32_t cells[3]) {
    struct node_setup_message setup = setup_of(options, bricks, cells);
    return does_with(options, strategy, cube_dimension(nodes), &setup,
                     options->memory);
}

int host_memory_check(const struct host_run_options *options,
                      const struct host_strategy *strategy, unsigned nodes,
                      uint32_t bricks, const uint32_t cells[3],
                      struct host_error *error) {
    struct node_setup_message setup = setup_of(options, bricks, cells);
    uint64_t needed =
        memory_needed(options, strategy, cube_dimension(nodes), &setup);
    return needed <= options->memory
               ? 0
               : host_fail(error, HOST_USAGE,
                           "%s%s %lluK: a node of %u needs at least %lluK; "
                           "give that%s",
                           options->cube == NULL ? "" : options->cube,
                           options->cube == NULL ? "--memory" : ": memory",
                           (unsigned long long)options->memory / 1024, nodes,
                           (unsigned long long)needed / 1024,
                           memory_advice(options, strategy, nodes, &setup));
}

/* --- settle --------------------------------------------------------------- */

/* The largest power of two of nodes that have a processor each. */
static unsigned suitable_nodes(void) {
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    unsigned nodes = 1;
    while (nodes < HOST_PROCESSES_MAX && (long)nodes * 2 <= processors)
        nodes *= 2;
    return nodes;
}

unsigned host_run_nodes(const struct host_run_options *options) {
    if (options->nodes != 0)
        return options->nodes;
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

void host_choose(const struct host_run_options *options, uint64_t points,
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
        if (4 * again > order->fill[brick])
            return true;
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

bool host_choose_ordered(const struct host_run_options *options,
                         struct host_order *order,
                         struct host_run_result *result) {
    const struct host_strategy *before = result->strategy;
    bool uneven = is_uneven(order);
    if (options->build == INCODE_BUILD_AUTO && may_insert(options) && uneven &&
        !is_room(order, options->memory))
        result->build = INCODE_BUILD_FACES;
    if (result->why[0] == '\0') /* it was not for `auto` to say */
        return false;
    const struct run run = {options, result->nodes, order->bricks,
                            order->cells};
    struct host_task task = task_of(&run, order->points);
    task.uneven = uneven;
    task.by_points = task.by_points && result->build != INCODE_BUILD_FACES;
    choose(&task, result);
    if (result->strategy->regions(result->nodes) == 1)
        host_order_join(order);
    if (options->nodes == 0 && options->begin == NULL &&
        result->strategy->nodes_default != 0)
        result->nodes = result->strategy->nodes_default;
    return result->strategy != before;
}

/* --- on cube -------------------------------------------------------------- */

/* Until another program of this machine has ended. */
enum { IN_USE_US = 5000000 };

/* One run a program. */
static struct host_cube_file the_file;
static void (*stop_remote)(void *context);

/* Its wires are closed: nothing needs the key. */
static void stop(void *context) {
    stop_remote(context);
    secure_wipe(the_file.key, sizeof the_file.key);
}

static int begin(const struct host_run_options *options,
                 struct host_run_result *result, struct host_machine *machine,
                 struct host_error *error) {
    static struct host_remote remote;
    static char program[4096];
    (void)result;
    if (host_remote_free(&the_file, IN_USE_US, error) != 0 ||
        host_remote_program(&the_file, options->node_program, program,
                            sizeof program, error) != 0 ||
        host_remote_start(&remote, &the_file, program, error) != 0)
        return error->code;
    *machine = host_remote_machine(&remote);
    stop_remote = machine->stop;
    machine->stop = stop;
    return 0;
}

int host_run_on_cube(struct host_run_options *options,
                     struct host_error *error) {
    unsigned asked = options->nodes;
    if (host_cube_file_read(&the_file, options->cube, error) != 0)
        return error->code;
    if (asked != 0 && asked != the_file.nodes) {
        return host_fail(error, HOST_USAGE,
                         "--nodes %u: the cube of %s has %u; leave it out",
                         asked, options->cube, the_file.nodes);
    }
    if (options->table) {
        return host_fail(error, HOST_USAGE,
                         "--table: compares with one node, and the cube of %s "
                         "has its own; leave it out",
                         options->cube);
    }
    if (options->node_program != NULL &&
        host_remote_started(&the_file) == NULL) {
        return host_fail(error, HOST_USAGE,
                         "--node-program: the host starts none of the nodes of "
                         "%s; leave it out",
                         options->cube);
    }
    options->nodes = the_file.nodes;
    options->memory = the_file.memory;
    options->board = the_file.board;
    options->link = host_cube_link(&the_file);
    for (unsigned i = 0; i < the_file.nodes; i++)
        options->processors += !the_file.local[i];
    const struct host_cube_wire *wire = host_cube_host_wire(&the_file, 0);
    options->wire_bytes_s = wire == NULL   ? 0
                            : wire->serial ? wire->baud / 10
                            : host_cube_is_bare(&the_file, wire->node)
                                ? HOST_BARE_WIRE_BYTES
                                : 0;
    options->begin = begin;
    return 0;
}

/* Of a point, what is put aside: at most the tetrahedra of a volume twice over,
 * and the points in order; for their neighbours, which .ele has beside it, four
 * times. */
enum { ASIDE_BYTES = 320, ASIDE_NEIGHBOURS_BYTES = 500 };

uint64_t host_memory_aside(const struct host_run_options *options) {
    char name[HOST_PATH_MAX];
    for (unsigned i = 0; i < options->outputs; i++)
        if (host_write_file(options->output[i], 2, name, sizeof name) != NULL)
            return ASIDE_NEIGHBOURS_BYTES;
    return ASIDE_BYTES;
}
