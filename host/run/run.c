#include "run.h"

#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/progress.h"
#include "host/formats/output.h"
#include "host/formats/write.h"
#include "host/formats/formats.h"
#include "host/formats/read.h"
#include "host/service/strategies/strategies.h"
#include "node/node.h"
#include "as_made.h"
#include "choose.h"
#include "report.h"
#include "state.h"
#include "host/library/delaunay.h"
#include "host/verify/check.h"

void host_run_defaults(struct host_run_options *options) {
    memset(options, 0, sizeof *options);
    options->partition = HOST_ADAPTIVE;
    options->index = INCODE_KD;
    options->face_rule = INCODE_FACE_OWN;
    options->build = INCODE_BUILD_AUTO;
    options->link = host_link_row(0);
    options->board = host_board_row(0);
    options->memory = 4u << 20;
    options->patience_s = 60;
    options->progress = true;
}

static double seconds_since(uint64_t start_us) {
    return 1e-6 * (double)(host_now_us() - start_us);
}

/* Of this process, all its threads, or of this thread. */
static double used_seconds(clockid_t clock) {
    struct timespec used;
    clock_gettime(clock, &used);
    return (double)used.tv_sec + 1e-9 * (double)used.tv_nsec;
}

/* A stretch of what a library call would do as well: from points in memory to
 * tetrahedra in memory. */
struct stretch {
    uint64_t start_us;
    double cpu_s;
};

static struct stretch begin_stretch(void) {
    return (struct stretch){host_now_us(),
                            used_seconds(CLOCK_PROCESS_CPUTIME_ID)};
}

static void end_stretch(const struct stretch *stretch,
                        struct host_run_result *result) {
    result->time_triangulation_s += seconds_since(stretch->start_us);
    result->host_triangulation_cpu_s +=
        used_seconds(CLOCK_PROCESS_CPUTIME_ID) - stretch->cpu_s;
}

/* The sums over the reports of result->node. */
static void host_run_sum_nodes(struct host_run_result *result) {
    struct host_run_result *r = result;
    for (unsigned i = 0; i < r->nodes; i++) {
        const struct node_finished_message *f = &r->node[i].statistics;
        const struct incode_statistics *s = &f->statistics;
        double wall = 1e-6 * (double)f->wall_us;
        r->retransmitted += f->retransmitted;
        if (wall > 0 && (r->t_min_s == 0.0 || wall < r->t_min_s))
            r->t_min_s = wall;
        r->t_max_s = wall > r->t_max_s ? wall : r->t_max_s;
        r->make_tetra_calls += s->make_tetra_calls;
        r->built += s->tetrahedra_built;
        r->exact_orient3d += s->tally.exact_orient3d;
        r->exact_in_sphere += s->tally.exact_in_sphere;
        r->candidates += s->candidates;
        r->vertices += s->vertices;
        r->vertices_waited += s->vertices_waited;
        r->stars_lent += s->stars_lent;
        r->stars_borrowed += s->stars_borrowed;
        r->tetrahedra_late += s->tetrahedra_late;
        for (unsigned k = 0; k < 24; k++)
            r->candidates_histogram[k] += s->candidates_histogram[k];
    }
}

void host_run_sum(const struct host_service *service,
                  struct host_run_result *result) {
    struct host_run_result *r = result;
    memcpy(r->node, service->report, r->nodes * sizeof r->node[0]);
    r->retransmitted = service->retransmitted;
    r->bytes_sent = service->bytes_sent;
    r->bytes_received = service->bytes_received;
    r->faces_spilled = service->spill.faces_total;
    r->restarts = service->restarts;
    r->lost = r->nodes - service->work.living;
    r->generations = service->generations;
    host_run_sum_nodes(r);
}

static uint64_t at_least(uint64_t count, uint64_t least) {
    return count > least ? count : least;
}

/* It need not be secret from nodes: page_check.h.  In virtual time it is always
 * the same, for a frame's size depends on its bytes, and time on its size. */
static uint64_t draw_key(const struct host_machine *machine) {
    uint64_t key = 1;
    if (!machine->virtual_time &&
        getrandom(&key, sizeof key, 0) != (ssize_t)sizeof key)
        key = host_now_us();
    return key;
}

/* The part on the nodes: ordered points in, rows of input rows out. */
static int run_service(const struct host_run_options *options,
                       const struct host_order *order,
                       struct host_service *service,
                       struct host_tetrahedra *tets,
                       struct host_run_result *result,
                       struct host_error *error) {
    service->order = order;
    service->tets = tets;
    service->setup.setup.index = (uint8_t)options->index;
    service->setup.setup.face_rule = (uint8_t)options->face_rule;
    service->setup.setup.build = (uint8_t)result->build;
    service->setup.setup.shuffle_seed = options->shuffle_seed;
    service->setup.page_key = draw_key(service->machine);
    service->audit.secret = draw_key(service->machine);
    int status = host_service_run(service, error);
    host_run_sum(service, result);
    /* A tetrahedron builder that was lost has taken its counts with it. */
    result->built = at_least(result->built, tets->count);
    result->make_tetra_calls = at_least(result->make_tetra_calls, tets->count);
    result->time_io_s += 1e-6 * (double)service->pages_us;
    return status;
}

static int check_strategy(const struct host_run_options *options,
                          const struct host_run_result *result,
                          struct host_error *error) {
    return host_strategy_check(result->strategy, result->nodes,
                               &options->sharing, options->face_rule,
                               options->build, error);
}

/* Points in their order, by which `auto` may choose again: cut for all nodes,
 * as one that wants them whole can join them. */
static int order_points(const struct host_run_options *options,
                        const struct host_points *points,
                        struct host_order *order,
                        struct host_run_result *result,
                        struct host_error *error) {
    struct stretch stretch = begin_stretch();
    unsigned regions = options->strategy == NULL
                           ? result->nodes
                           : result->strategy->regions(result->nodes);
    host_progress_phase("ordering", NULL);
    int status = host_state_order(
        options->state, order,
        options->input == NULL ? "points" : options->input, points,
        host_strategy_partition(result->strategy, options->partition), regions,
        options->index == INCODE_GRID, error);
    if (status == 0) {
        result->rows = order->rows;
        result->points = order->points;
        result->duplicates = order->duplicates;
        result->negative_zeros = order->negative_zeros;
        result->pages = order->tree.pages;
        result->bricks = order->bricks;
        (void)host_choose_ordered(options, order, result);
        status = host_memory_check(options, result->strategy, result->nodes,
                                   order->bricks, order->cells, error);
    }
    if (status == 0)
        status = host_state_start(options->state, order, result, error);
    result->time_order_s = seconds_since(stretch.start_us);
    end_stretch(&stretch, result);
    return status;
}

/* What the check has found, and its time, which is no part of the
 * triangulation's. */
static void take_check(struct host_service *service,
                       struct host_run_result *result, int status) {
    struct host_audit *audit = &service->audit;
    host_audit_free(audit); /* if the run failed, the check may still run */
    double spent = 1e-6 * (double)audit->spent_us;
    result->check = audit->report;
    result->hull_facets = audit->report.hull_facets;
    result->excluded = service->excluded;
    result->checks_failed = audit->failed;
    result->verified = status == 0 && audit->exact;
    result->time_verify_s += spent;
    result->time_triangulation_s -= spent;
    if (status == HOST_UNVERIFIED) {
        host_progress_erase();
        fputs(audit->report.text, stderr);
    }
}

/* On nodes that are there, which it ends. */
static int on_nodes(const struct host_run_options *options,
                    struct host_machine *machine,
                    const struct host_order *order,
                    struct host_tetrahedra *tets,
                    struct host_run_result *result, struct host_error *error) {
    static struct host_service service;
    struct host_throttled throttled;
    struct host_machine slowed;
    uint64_t start = host_now_us();
    memset(&service, 0, sizeof service);
    service.machine = machine;
    if (options->throttle.stall_us_max != 0 ||
        options->throttle.bytes_a_second != 0) {
        slowed = host_throttle_machine(&throttled, machine, &options->throttle);
        service.machine = &slowed;
    }
    service.strategy = result->strategy;
    service.sharing = options->sharing;
    service.window = options->window;
    service.memory = options->quiet ? 0 : result->memory;
    service.memory_of = options->cube;
    service.patience_us = options->patience_s * UINT64_C(1000000);
    service.verifying = options->verifying;
    service.kept = host_state_kept(options->state);
    service.foreign = options->begin != NULL; /* a cube file, or ranks */
    int status = host_service_start(&service, error);
    result->time_start_up_s += seconds_since(start);
    struct stretch stretch = begin_stretch();
    if (status == 0) {
        host_progress_phase("triangulating", "Mtet");
        status = run_service(options, order, &service, tets, result, error);
    }
    end_stretch(&stretch, result);
    take_check(&service, result, status);
    result->tetrahedra = tets->count;
    if (status == 0) {
        status = host_service_wires(&service, error);
        result->missing_wires = service.missing_wires;
    }
    host_service_end(&service);
    if (status == 0) {
        stretch = begin_stretch();
        host_tetrahedra_map(tets, order->row);
        end_stretch(&stretch, result);
    }
    return status;
}

int host_triangulate_on(const struct host_run_options *options,
                        struct host_machine *machine,
                        const struct host_points *points,
                        struct host_tetrahedra *tets,
                        struct host_run_result *result,
                        struct host_error *error) {
    struct host_order order;
    int status = order_points(options, points, &order, result, error);
    if (status == 0)
        status = on_nodes(options, machine, &order, tets, result, error);
    else
        machine->stop(machine->context);
    host_order_free(&order);
    return status;
}

/* Starts nodes of the board that is asked for. */
static int begin_on_board(const struct host_run_options *options,
                          struct host_run_result *result,
                          struct host_machine *machine,
                          struct host_error *error) {
    struct host_cluster_options nodes = {0};
    struct host_started started;
    memset(&started, 0, sizeof started);
    nodes.nodes = result->nodes;
    nodes.memory = options->memory;
    nodes.window = options->window;
    nodes.link = options->link;
    nodes.unplug_us = options->unplug_us;
    /* So many bytes a second that all nodes together are heard. */
    nodes.one_wire = options->throttle.bytes_a_second != 0;
    nodes.program = options->node_program;
    nodes.trouble = options->trouble;
    if (options->board->start(options->board, &nodes, &started, error) != 0)
        return error->code;
    *machine = started.machine;
    result->limited = started.limited;
    result->memory_held = started.memory_held;
    result->socket_send_bytes = started.send_bytes;
    result->socket_receive_bytes = started.receive_bytes;
    return 0;
}

/* Starts nodes and goes on with them. */
static int start_nodes(const struct host_run_options *options,
                       const struct host_order *order,
                       struct host_tetrahedra *tets,
                       struct host_run_result *result,
                       struct host_error *error) {
    struct host_machine machine;
    uint64_t start = host_now_us();
    host_progress_phase("starting nodes", NULL);
    if ((options->begin != NULL ? options->begin : begin_on_board)(
            options, result, &machine, error) != 0)
        return error->code;
    result->time_start_up_s = seconds_since(start);
    return on_nodes(options, &machine, order, tets, result, error);
}

int host_triangulate(const struct host_run_options *options,
                     const struct host_points *points,
                     struct host_tetrahedra *tets,
                     struct host_run_result *result, struct host_error *error) {
    static const uint32_t no_cells[3] = {0, 0, 0};
    struct host_order order;
    host_choose(options, points->count, result);
    if (check_strategy(options, result, error) != 0 ||
        host_memory_check(options, result->strategy, result->nodes, 1, no_cells,
                          error) != 0)
        return error->code;
    if (order_points(options, points, &order, result, error) == 0)
        (void)start_nodes(options, &order, tets, result, error);
    int status = host_state_order_kept(options->state, result, error);
    host_order_free(&order);
    return status;
}

static void clean(void *context, const char *file) {
    const pid_t *writer = context;
    host_output_clean(file, *writer);
}

void host_run_clean(const struct host_run_options *options, pid_t writer) {
    host_write_files(options->output, options->outputs, clean, &writer);
    if (options->stats != NULL)
        host_output_clean(options->stats, writer);
}

/* The file of the points, if its name tells its format: such a .node beside an
 * .ele is not written again. */
static const char *points_file(const struct host_run_options *options) {
    return options->format == NULL ? options->input : NULL;
}

/* No output may be a file that is read, nor be another output. */
static int check_claims(const struct host_run_options *options,
                        struct host_error *error) {
    struct host_claims claims = {0};
    char state[3][HOST_PATH_MAX];
    host_claims_read(&claims, options->input, error);
    if (options->cube != NULL)
        host_claims_read(&claims, options->cube, error);
    for (unsigned i = 0; i < options->outputs; i++) {
        host_claims_write(&claims, "-o ", options->output[i],
                          points_file(options), error);
    }
    if (options->stats != NULL)
        host_claims_write(&claims, "--stats ", options->stats, NULL, error);
    for (int i = 0; i < 3 && options->resume != NULL; i++) {
        static const char *const kept[] = {"state", "order", "spool"};
        (void)snprintf(state[i], sizeof state[i], "%s/%s", options->resume,
                       kept[i]);
        host_claims_write(&claims, "--resume ", state[i], NULL, error);
    }
    host_claims_free(&claims);
    return error->code;
}

static int check_outputs(const struct host_run_options *options,
                         struct host_error *error) {
    if (check_claims(options, error) != 0 ||
        host_as_made_check(options, error) != 0)
        return error->code;
    if (options->stats != NULL && strcmp(options->stats, "-") != 0 &&
        host_write_probe(options->stats, NULL, error) != 0)
        return error->code;
    for (unsigned i = 0; i < options->outputs; i++)
        if (host_write_check(options->output[i], error) != 0 ||
            host_write_probe(options->output[i], points_file(options), error) !=
                0)
            return error->code;
    return 0;
}

/* The digest, on a thread of its own, while others read the tetrahedra. */
struct digest {
    const struct host_tetrahedra *tets;
    struct host_digest *digest;
    double cpu_s;
};

static void make_digest(void *argument) {
    struct digest *d = argument;
    d->cpu_s = -used_seconds(CLOCK_THREAD_CPUTIME_ID);
    host_digest(d->tets, d->digest);
    d->cpu_s += used_seconds(CLOCK_THREAD_CPUTIME_ID);
}

static int write_outputs(const struct host_run_options *options,
                         const struct host_points *points,
                         const struct host_tetrahedra *tets,
                         struct host_run_result *result,
                         struct host_error *error) {
    uint64_t start = host_now_us();
    for (unsigned i = 0; i < options->outputs; i++)
        if (host_write(options->output[i], points_file(options), points, tets,
                       error) != 0)
            return error->code;
    result->time_write_s += seconds_since(start);
    return 0;
}

/* Order, digest and files, once the tetrahedra are here. */
static int finish(const struct host_run_options *options,
                  const struct host_points *points,
                  struct host_tetrahedra *tets, struct host_run_result *result,
                  struct host_error *error) {
    struct digest digest = {.tets = tets, .digest = &result->digest};
    struct host_fork fork;
    uint64_t start = host_now_us();
    if (options->row_order == HOST_AS_MADE) {
        bool is_done = host_as_made_end(tets, result, error);
        result->host_cpu_s += used_seconds(CLOCK_PROCESS_CPUTIME_ID);
        return is_done ? error->code
                       : write_outputs(options, points, tets, result, error);
    }
    host_progress_phase("sorting", NULL);
    host_tetrahedra_sort(tets);
    result->host_cpu_s += used_seconds(CLOCK_PROCESS_CPUTIME_ID);
    host_fork_start(&fork, make_digest, &digest);
    result->time_write_s = seconds_since(start);
    write_outputs(options, points, tets, result, error);
    start = host_now_us();
    host_fork_join(&fork);
    result->host_cpu_s += digest.cpu_s;
    result->time_write_s += seconds_since(start);
    return error->code;
}

/* The same on one node, for the table's speed-up. */
static int run_alone(const struct host_run_options *options,
                     const struct host_points *points,
                     struct host_run_result *alone, struct host_error *error) {
    struct host_run_options one = *options;
    struct host_tetrahedra tets = {0};
    one.nodes = 1;
    one.strategy = host_strategy_named("sequential");
    int status = host_triangulate(&one, points, &tets, alone, error);
    host_tetrahedra_free(&tets);
    return status;
}

static int host_triangulate_direct(const struct host_run_options *options,
                                   const struct host_points *points,
                                   struct host_tetrahedra *tets,
                                   struct host_run_result *result,
                                   struct host_error *error);

static int run_on(const struct host_run_options *options,
                  const struct host_points *points,
                  struct host_run_result *result, struct host_run_result *alone,
                  struct host_error *error) {
    struct host_tetrahedra tets = {0};
    alone->time_io_s = result->time_read_s;
    if (options->table && run_alone(options, points, alone, error) != 0)
        return error->code;
    result->time_io_s = result->time_read_s;
    result->host_cpu_s = -used_seconds(CLOCK_PROCESS_CPUTIME_ID);
    int status = (options->direct ? host_triangulate_direct : host_triangulate)(
        options, points, &tets, result, error);
    if (status == 0)
        status = finish(options, points, &tets, result, error);
    host_tetrahedra_free(&tets);
    return status;
}

/* Refuses points that are likely a mistake, and notes what the user may not
 * expect, before the run takes time. */
static int look_at_points(const struct host_run_options *options,
                          const struct host_points *points,
                          struct host_error *error) {
    char list[HOST_FORMAT_LIST_MAX];
    if (points->count == 3 && points->wide) {
        return host_fail(error, HOST_INPUT,
                         "%s: 3 rows of more than 3 numbers, each of which "
                         "would be a point; save the transpose, with one row "
                         "for each point",
                         options->input);
    }
    if (options->quiet)
        return 0;
    host_points_note(options->input, points);
    if (options->outputs == 0 && options->stats == NULL && !options->table &&
        !options->map) {
        host_format_list(HOST_WRITE_TETRAHEDRA, list, sizeof list);
        host_note("no output was asked for, so only the counts and the digest "
                  "will be printed; -o FILE writes the tetrahedra, as %s",
                  list);
    }
    return 0;
}

int host_run(const struct host_run_options *options,
             struct host_run_result *result, struct host_error *error) {
    static struct host_run_result alone;
    struct host_run_options kept = *options; /* what is open in them, too */
    struct host_points points = {0};
    uint64_t start = host_now_us();
    memset(result, 0, sizeof *result);
    memset(&alone, 0, sizeof alone);
    if (check_outputs(options, error) != 0 ||
        host_limits_enter(&options->limits, options->threads, options->input,
                          options->outputs > 0 ? options->output[0] : NULL,
                          error) != 0)
        return error->code;
    result->host_memory = host_limits_memory() > 0
                              ? host_limits_memory()
                              : host_memory_available() / 2;
    if (options->anywhere)
        host_progress_begin_anywhere();
    else
        host_progress_begin(options->progress && !options->quiet);
    int status =
        host_points_read_as(options->input, options->format, &points, error);
    result->time_read_s = seconds_since(start);
    if (status == 0)
        status = look_at_points(options, &points, error);
    if (status == 0)
        status = host_limits_check(points.count * host_memory_aside(options),
                                   !options->quiet, error);
    if (status == 0)
        status = host_state_begin(&kept, &points, error);
    if (status == 0)
        status = run_on(&kept, &points, result, &alone, error);
    host_progress_end();
    host_points_free(&points);
    result->scratch_bytes = host_limits_leave();
    result->host_peak_bytes = host_memory_peak();
    result->time_total_s = seconds_since(start);
    if (status == 0 && options->stats != NULL)
        status = host_stats_write(options->stats, result, error);
    if (status == 0 && !options->quiet)
        host_report(options, result, options->table ? &alone : NULL, error);
    (void)host_output_commit(error);
    return host_state_end(&kept, error);
}

/* The library's way: threads of this process instead of nodes. */

static const struct host_strategy strategy_direct = {
    .name = "direct",
    .title = "Direct",
    .help = "one triangulator a thread, over points that they share"};

static const struct host_link link_memory = {
    .name = "memory", .help = "the memory of one process"};

static uint32_t bricks;

static void show_progress(uint32_t committed) {
    host_progress_show(committed, bricks, committed);
}

/* The threads take the place of nodes. */
static void take_sums(const struct host_direct_sums *sums,
                      struct host_run_result *r) {
    r->nodes = sums->threads;
    for (unsigned i = 0; i < sums->threads; i++) {
        const struct host_direct_part *part = &sums->part[i];
        struct node_finished_message *f = &r->node[i].statistics;
        f->statistics = part->statistics;
        f->busy_us = (uint64_t)(1e6 * part->cpu_s);
        f->wall_us = (uint64_t)(1e6 * part->wall_s);
        f->memory_high_water = part->arena;
        r->faces_spilled += part->faces_spilled;
        r->memory = part->arena > r->memory ? part->arena : r->memory;
    }
    host_run_sum_nodes(r);
}

/* What an earlier run has kept is checked, too. */
static bool is_checked(const struct host_run_options *options) {
    return options->verifying == HOST_VERIFY_ALWAYS || options->stats != NULL ||
           host_state_is_resumed(options->state);
}

/* The exact check where it is asked for.  The count of the hull's facets, which
 * only statistics need, comes from the check that the tetrahedra tile.  What is
 * put aside is checked by vertex numbers of the order, as neighbours have close
 * ones: each place of it is read once. */
static bool is_checked_in_order(const struct host_run_options *options) {
    return host_limits_memory() > 0 && is_checked(options);
}

static int check(const struct host_run_options *options,
                 const struct host_points *points,
                 const struct host_order *order,
                 const struct host_tetrahedra *tets, struct host_run_result *r,
                 struct host_error *error) {
    bool exact = options->verifying == HOST_VERIFY_ALWAYS;
    enum host_check_depth depth =
        exact ? HOST_CHECK_DELAUNAY : HOST_CHECK_TILING;
    if (!is_checked(options))
        return 0;
    uint64_t start = host_now_us();
    host_progress_phase("checking", NULL);
    struct host_sites sites = {0};
    if (order != NULL)
        sites = host_sites_of_order(order);
    int status = order != NULL
                     ? host_check(&sites, tets, depth, NULL, &r->check, error)
                     : host_verify(points, tets, depth, &r->check, error);
    r->hull_facets = r->check.hull_facets;
    r->verified = status == 0 && exact;
    r->checks_failed = status == HOST_UNVERIFIED;
    r->time_verify_s = 1e-6 * (double)(host_now_us() - start);
    if (status == HOST_UNVERIFIED) {
        host_progress_erase();
        fputs(r->check.text, stderr);
    }
    return status;
}

static int triangulate(const struct host_run_options *options,
                       const struct host_points *points,
                       struct host_tetrahedra *tets, struct host_order *order,
                       struct host_run_result *r, struct host_error *error) {
    static struct host_direct_sums sums;
    uint64_t start = host_now_us();
    host_progress_phase("ordering", NULL);
    int status = host_state_order(
        options->state, order, options->input, points, HOST_ADAPTIVE,
        host_state_regions(options->state, points->count), false, error);
    if (status == 0)
        status = host_state_start(options->state, order, r, error);
    r->time_order_s = 1e-6 * (double)(host_now_us() - start);
    if (status != 0)
        return status;
    r->rows = order->rows;
    r->points = order->points;
    r->duplicates = order->duplicates;
    r->negative_zeros = order->negative_zeros;
    r->pages = order->tree.pages;
    r->bricks = bricks = order->bricks;
    host_progress_phase("triangulating", NULL);
    memset(&sums, 0, sizeof sums);
    sums.committed = show_progress;
    sums.by_vertex = is_checked_in_order(options);
    sums.store = host_state_store(options->state);
    if (host_as_made_begin(options, points, &sums, error) != 0)
        return error->code;
    if (host_direct_run(order, tets, &sums, error) != HOST_DIRECT_DONE)
        return host_as_made_fail(error);
    take_sums(&sums, r);
    if (!sums.by_vertex)
        return 0;
    status = check(options, points, order, tets, r, error);
    host_tetrahedra_map(tets, order->row);
    return status;
}

/* The same by threads of this process, the library's way. */
static int host_triangulate_direct(const struct host_run_options *options,
                                   const struct host_points *points,
                                   struct host_tetrahedra *tets,
                                   struct host_run_result *result,
                                   struct host_error *error) {
    struct host_order order = {0};
    result->strategy = &strategy_direct;
    result->partition = HOST_ADAPTIVE;
    result->index = INCODE_KD;
    result->link = &link_memory;
    result->board = host_board_row(0);
    struct stretch stretch = begin_stretch();
    (void)triangulate(options, points, tets, &order, result, error);
    int status = host_state_order_kept(options->state, result, error);
    host_order_free(&order);
    end_stretch(&stretch, result);
    result->time_triangulation_s -= result->time_verify_s;
    result->tetrahedra = tets->count;
    return status == 0 && !is_checked_in_order(options)
               ? check(options, points, NULL, tets, result, error)
               : status;
}
