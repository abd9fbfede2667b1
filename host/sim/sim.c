#include "sim.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include "host/library/delaunay.h"
#include "host/verify/check.h"
#include "host/mesh/gen.h"
#include "host/service/strategies/strategies.h"
#include "sim_draw.h"
#include "sim_run.h"
#include "host/base/options.h"
#include "host/base/text.h"
#include "host/service/machine.h"
#include "host/base/parallel.h"

enum {
    TIME_US_MAX = 1800000000, /* half an hour in virtual time, */
    STEPS_MAX = 60000000      /* or so many steps: it hangs */
};

/* Bytes with which every node does. */
static uint64_t memory_of(const struct host_sim_run *r) {
    const struct host_sim_plan *p = r->plan;
    struct node_setup_message setup = {
        .setup = {.bricks = r->order.bricks, .index = (uint8_t)p->index}};
    unsigned dimension = (unsigned)__builtin_ctz(p->nodes);
    struct node_identity identity = {.dimension = (uint8_t)dimension,
                                     .window = (uint8_t)p->window,
                                     .serial_baud = p->serial_baud,
                                     .epoch = 1};
    memcpy(setup.setup.cells, r->order.cells, sizeof setup.setup.cells);
    uint64_t memory = 0, needed = 1;
    while (needed > memory) {
        memory += 4096;
        needed = host_strategy_arena(p->strategy, p->nodes, &identity, memory,
                                     &p->sharing, &setup) +
                 HOST_WORLD_STACK + HOST_WORLD_STATIC;
    }
    return memory + p->memory_more / 64 * 64;
}

static int open_world(struct host_sim_run *r, struct host_error *error) {
    const struct host_sim_plan *p = r->plan;
    struct host_world_options o = {
        .cube = {.dimension = (unsigned)__builtin_ctz(p->nodes),
                 .seed = p->seed,
                 .wire = p->wire,
                 .host_wire = p->host_wire,
                 .second_host = p->wanted[HOST_SIM_SECOND_HOST],
                 .gather_us = p->gather_us},
        .memory = memory_of(r),
        .window = (uint8_t)p->window,
        .dead_us = p->dead_us,
        .step_us = p->step_us,
        .host_us = p->host_us,
        .look_us = p->look_us,
        .bare = p->wanted[HOST_SIM_BARE],
        .serial_baud = p->serial_baud,
        .time_us_max = TIME_US_MAX,
        .steps_max = STEPS_MAX,
        .absent_s = p->absent_s,
        .strike = host_sim_faults_strike,
        .context = r,
        .second = host_second_host_round,
        .second_context = &r->second,
        .liar = p->wanted[HOST_SIM_LIAR] ? &r->liar : NULL,
        .liar_node = p->liar.node,
    };
    r->liar.way = p->liar.way;
    r->liar.one_in = p->liar.one_in;
    r->liar.random = sim_seed(p->seed, 5);
    if (host_world_open(&r->world, &o, error) != 0)
        return error->code;
    struct host_sim_cube *cube = &r->world.cube;
    for (unsigned i = 0; i < p->missing; i++) {
        unsigned wire =
            (unsigned)host_sim_draw(&r->random, 0, cube->host_wire - 1);
        if (!cube->wire[wire].missing)
            host_sim_cube_leave_out(cube, wire);
    }
    return 0;
}

static int make_work(struct host_sim_run *r, struct host_error *error) {
    const struct host_sim_plan *p = r->plan;
    if (host_gen(p->kind, p->points, p->seed, &r->points, error) != 0)
        return error->code;
    return host_order_make(&r->order, "points", r->points.xyz, r->points.count,
                           host_strategy_partition(p->strategy, p->partition),
                           p->strategy->regions(p->nodes),
                           p->index == INCODE_GRID, error);
}

/* What is left in the queues of host and nodes when all is done. */
static int check_queues(const struct host_sim_run *r,
                        struct host_error *error) {
    const struct host_service *s = &r->service;
    uint64_t left = s->over ? 0 : s->spill.faces;
    for (unsigned i = 0; i < r->plan->nodes && !s->over; i++) {
        const struct host_world_node *node = &r->world.node[i];
        left += s->node[i].pages_count + s->node[i].unspills_count;
        /* A node that was cut off for good keeps what it has. */
        bool counts = node->state == HOST_WORLD_UP && node->node != NULL &&
                      !s->work.lost[i];
        left += counts ? node_held(node->node) : 0;
    }
    if (s->ledger.committed != s->ledger.bricks || left > 0) {
        return host_fail(error, HOST_BROKEN,
                         "cube: %u of %u bricks committed and %llu slots of "
                         "queues in use at the end; replay it",
                         s->ledger.committed, s->ledger.bricks,
                         (unsigned long long)left);
    }
    return 0;
}

static int check_second_host(const struct host_sim_run *r,
                             struct host_error *error) {
    return r->second.fault[0] == '\0'
               ? 0
               : host_fail(error, HOST_BROKEN, "node 0: %s; replay it",
                           r->second.fault);
}

/* Every wire that was missing was named, and no other. */
static int check_wires(const struct host_sim_run *r, struct host_error *error) {
    const struct host_world *w = &r->world;
    const bool *wanted = r->plan->wanted;
    /* What died or was lost since may be named as dead, or not at all. */
    bool all = !r->service.over && !wanted[HOST_SIM_DEAD_WIRE] &&
               !wanted[HOST_SIM_DEAD_NODE];
    for (unsigned i = 0; i < w->cube.wires; i++) {
        bool missing = w->cube.wire[i].missing, named = w->named[i];
        /* One that died before its ends had met counts as either. */
        bool dead = w->cube.wire[i].dead;
        if (missing ? all && !named : named && !dead) {
            return host_fail(error, HOST_BROKEN, "host: wire %u %s; replay it",
                             i,
                             missing ? "is missing and was not named"
                                     : "was named as missing and is there");
        }
    }
    return 0;
}

/* What the service mends is a fault all the same, where no node lies: a result
 * that was wrong at first, or a node at fault.  Where one lies, no other node
 * may be blamed. */
static int check_mended(const struct host_sim_run *r,
                        struct host_error *error) {
    const struct host_service *s = &r->service;
    bool lies = r->plan->wanted[HOST_SIM_LIAR];
    bool mended =
        s->audit.failed > 0 || s->excluded > 0 || s->strategy == &host_redo;
    if (mended && !lies) {
        return host_fail(error, HOST_UNVERIFIED,
                         "host: %u checks of the result failed and %u nodes "
                         "were excluded, although no node lies; replay it",
                         s->audit.failed, s->excluded);
    }
    return s->excluded <= (lies && s->node[r->plan->liar.node].aside)
               ? 0
               : host_fail(error, HOST_CUBE,
                           "host: a node was excluded that does not lie; "
                           "replay it");
}

static int serve(struct host_sim_run *r, struct host_machine *machine,
                 struct host_error *error) {
    const struct host_sim_plan *p = r->plan;
    struct host_service *s = &r->service;
    s->machine = machine;
    s->order = &r->order;
    s->tets = &r->tets;
    s->window = p->host_window;
    s->patience_us = p->patience_us;
    s->strategy = p->strategy;
    s->sharing = p->sharing;
    s->setup.setup.index = (uint8_t)p->index;
    s->setup.setup.face_rule = (uint8_t)p->face_rule;
    s->setup.setup.build = (uint8_t)p->build;
    s->setup.setup.shuffle_seed = p->shuffle_seed;
    s->setup.page_key = sim_seed(p->seed, 90);
    s->audit.secret = sim_seed(p->seed, 91);
    s->verifying =
        p->wanted[HOST_SIM_LIAR] ? HOST_VERIFY_ALWAYS : HOST_VERIFY_WHERE_DUE;
    host_sim_faults_prepare(r);
    int status = host_service_start(s, error);
    if (status == 0) {
        uint64_t start_us = r->world.now_us;
        host_sim_faults_begin(r);
        status = host_service_run(s, error);
        host_sim_faults_finish(r);
        host_second_host_leave(&r->second);
        r->outcome->work_us = r->world.now_us - start_us;
    }
    status = status != 0 ? status : check_queues(r, error);
    status = status != 0 ? status : check_mended(r, error);
    status = status != 0 ? status : check_second_host(r, error);
    status = status != 0 ? status : host_service_wires(s, error);
    status = status != 0 ? status : check_wires(r, error);
    r->calm_us = 0;
    r->world.strike_us = 0;
    host_service_end(s);
    return status;
}

static int compare(struct host_sim_run *r, struct host_error *error) {
    static struct host_check_report report;
    struct host_tetrahedra right = {0};
    struct host_digest digest = {{0}};
    int status = host_delaunay(r->points.xyz, r->points.count, &right, error);
    if (status == 0) {
        status = host_verify(&r->points, &right, HOST_CHECK_DELAUNAY, &report,
                             error);
    }
    if (status == 0) {
        host_digest(&right, &digest);
        host_tetrahedra_map(&r->tets, r->order.row);
        host_tetrahedra_sort(&r->tets);
        host_digest(&r->tets, &r->outcome->digest);
        if (strcmp(digest.text, r->outcome->digest.text) != 0) {
            status = host_fail(error, HOST_UNVERIFIED,
                               "host: %llu tetrahedra, digest %.15s; %llu and "
                               "%.15s are right; replay it",
                               (unsigned long long)r->tets.count,
                               r->outcome->digest.text,
                               (unsigned long long)right.count, digest.text);
        }
    }
    host_tetrahedra_free(&right);
    return status;
}

/* --- the host's memory ---------------------------------------------------- */

static int begin_memory(struct host_sim_run *r, struct host_error *error) {
    const char *folder = getenv("TMPDIR");
    if (!r->plan->wanted[HOST_SIM_SMALL_HOST])
        return 0;
    r->call.threads = 1;
    r->call.memory_max = UINT64_MAX;
    if (host_scratch_begin_small(&r->scratch, folder == NULL ? "/tmp" : folder,
                                 r->plan->host_memory, error) != 0)
        return error->code;
    r->call.scratch = &r->scratch;
    host_call_enter(&r->call);
    return 0;
}

static int check_memory(struct host_sim_run *r, struct host_error *error) {
    struct host_scratch *s = r->call.scratch;
    if (s == NULL)
        return 0;
    host_scratch_trim(s, 0);
    return s->resident_seen <= s->resident_max
               ? 0
               : host_fail(error, HOST_BROKEN,
                           "host: %lluK of its arrays were resident, where it "
                           "may have %lluK; replay it",
                           (unsigned long long)s->resident_seen >> 10,
                           (unsigned long long)s->resident_max >> 10);
}

/* A run that gave up as a node lies, and says which. */
static bool names_liar(const struct host_sim_run *r, int status,
                       const struct host_error *error) {
    char name[16];
    snprintf(name, sizeof name, "node %u: ", r->plan->liar.node);
    return r->liar.told > 0 && status == HOST_UNVERIFIED &&
           strncmp(error->text, name, strlen(name)) == 0;
}

static void tell(struct host_sim_run *r) {
    struct host_sim_outcome *out = r->outcome;
    const struct host_world *w = &r->world;
    out->trace = w->cube.trace;
    out->steps = w->steps;
    out->time_us = w->now_us;
    for (unsigned i = 0; i < w->nodes; i++) {
        out->restarts += w->node[i].starts - 1;
        for (unsigned d = 0; i < 16 && d < w->node[i].links; d++) {
            const struct host_sim_port *port =
                host_sim_cube_port(&w->cube, i, d);
            out->node_frames[i] += port->end->out->frames;
        }
    }
    for (unsigned i = 0; i < 2 * w->cube.wires; i++)
        out->frames += host_sim_cube_direction(&w->cube, i / 2, i % 2)->frames;
}

int host_sim_run(const struct host_sim_plan *plan,
                 struct host_sim_outcome *outcome, struct host_error *error) {
    struct host_sim_run *r = calloc(1, sizeof *r);
    memset(outcome, 0, sizeof *outcome);
    if (r == NULL)
        return host_fail_memory(error, "the simulation");
    r->plan = plan;
    r->outcome = outcome;
    r->random = sim_seed(plan->seed, 2);
    struct host_call *outer = host_call();
    int status = begin_memory(r, error);
    status = status != 0 ? status : make_work(r, error);
    if (status == 0 && open_world(r, error) == 0) {
        struct host_machine machine = host_world_machine(&r->world);
        status = serve(r, &machine, error);
        tell(r);
        const char *damage = host_world_damage(&r->world);
        bool gave_up = names_liar(r, status, error);
        if (gave_up) {
            *error = (struct host_error){0};
            status = 0;
        }
        if (status == 0 && damage != NULL) {
            status =
                host_fail(error, HOST_BROKEN, "node: %s; replay it", damage);
        }
        host_world_close(&r->world);
        status = status != 0 ? status : check_memory(r, error);
        host_call_enter(outer);
        status = status != 0 || gave_up ? status : compare(r, error);
    }
    if (r->call.scratch != NULL)
        host_call_enter(&r->call);
    host_order_free(&r->order);
    host_points_free(&r->points);
    host_tetrahedra_free(&r->tets);
    host_call_enter(outer);
    if (r->call.scratch != NULL)
        host_scratch_end(&r->scratch);
    free(r);
    return status != 0 ? status : error->code;
}

/* --- sim arguments -------------------------------------------------------- */

static void add_range(struct host_sim_options *o, uint64_t first, uint64_t last,
                      struct host_error *error) {
    if (o->ranges == HOST_SIM_RANGES_MAX) {
        host_fail(error, HOST_USAGE,
                  "--seed: more than %d of --seed and --seeds; give a range",
                  HOST_SIM_RANGES_MAX);
        return;
    }
    o->range[o->ranges].first = first;
    o->range[o->ranges++].last = last;
}

static void take_seed(void *into, const char *value, struct host_error *error) {
    uint64_t n = 0;
    if (host_option_number("seed", value, 0, UINT64_MAX, &n, error) == 0)
        add_range(into, n, n, error);
}

/* A..B, both included. */
static void take_seeds(void *into, const char *value,
                       struct host_error *error) {
    uint64_t first_seed = 0, last_seed = 0;
    char first[32] = "";
    const char *dots = strstr(value, "..");
    size_t length = dots == NULL ? sizeof first : (size_t)(dots - value);
    if (length < sizeof first)
        memcpy(first, value, length);
    if (dots == NULL ||
        host_parse_number(first, 0, UINT64_MAX, &first_seed) != 0 ||
        host_parse_number(dots + 2, first_seed, UINT64_MAX, &last_seed) != 0) {
        host_fail(error, HOST_USAGE,
                  "--seeds %s: not a range of seeds; give A..B, as in 1..1000",
                  value);
        return;
    }
    add_range(into, first_seed, last_seed, error);
}

int host_sim_arguments(int argc, char **argv, struct host_sim_options *options,
                       struct host_error *error) {
    static const struct host_option rows[] = {
        {"seed", 0, "S",
         "Run seed S, which may be given more than once. Default: 1",
         .take = take_seed},
        {"seeds", 0, "A..B", "Run seeds A to B, and print totals",
         .take = take_seeds},
        {"nodes", 0, "N",
         "Nodes of the cube: 1, 2, 4 .. 1024. Default: the seed decides",
         HOST_AT(struct host_sim_options, nodes), .most = HOST_NODES_MAX,
         .powers = ""},
        {"seconds", 0, "T", "Begin no seed after T seconds of processor time",
         HOST_AT(struct host_sim_options, seconds_max), .least = 1,
         .most = 1000000},
        {0}};
    static const struct host_options mine = {
        .rows = rows,
        .refusal = "sim takes options alone; see incode sim --help",
        .arguments = "",
        .about =
            "Runs a whole cube - host, nodes and links as they are - in one "
            "process in virtual time.  The seed decides on points, cube, wires "
            "and faults: lost and damaged frames, stalls, closed wires, "
            "partitions, pauses, crashes, idle nodes, small memories of "
            "nodes and of the host, a slow host, a node that lies.  Then the "
            "faults stop, and the result "
            "must be the right one; of a node that lies, the run may also give "
            "up if it names it.  Each seed prints what struck while work was "
            "open; a failure prints the command that replays it.\v"
            "Examples:\n"
            "  incode sim --seed 17\n"
            "  incode sim --seed 17 --seed 34\n"
            "  incode sim --seeds 1..1000\n"
            "  incode sim --seeds 1..20 --nodes 64\n\n"
            "Exit status: 0 every result right, 1 something was left behind or "
            "the program failed, 2 wrong usage, 4 a run did not end or a node "
            "failed, 5 a wrong result."};
    memset(options, 0, sizeof *options);
    int status =
        host_options_parse(&mine, argc, argv, false, options, NULL, error);
    if (status == 0 && options->ranges == 0)
        add_range(options, 1, 1, error);
    return status;
}

/* --- sim seeds ------------------------------------------------------------ */

#ifndef INCODE_COMMIT
#define INCODE_COMMIT "unknown"
#endif

enum {
    STUCK_S = 300
}; /* processor time of a seed: a loop that never looks at
      the clock */

/* How the seed at work is replayed: for a handler of signals, too. */
static char replay[160];

static void note_replay(const struct host_sim_plan *plan) {
    char nodes[32] = "";
    if (plan->nodes_given != 0)
        snprintf(nodes, sizeof nodes, " --nodes %u", plan->nodes_given);
    snprintf(replay, sizeof replay,
             "  replay: git checkout %s && make && build/incode sim --seed "
             "%llu%s\n",
             INCODE_COMMIT, (unsigned long long)plan->seed, nodes);
}

static void on_crash(int number) {
    static const char what[] = "\nincode: sim: crashed or stuck\n";
    (void)!write(STDERR_FILENO, what, sizeof what - 1);
    (void)!write(STDERR_FILENO, replay, strlen(replay));
    (void)signal(number, SIG_DFL);
    (void)raise(number);
}

static void watch_crashes(void) {
    static const int numbers[] = {SIGSEGV, SIGBUS,  SIGILL,   SIGFPE,
                                  SIGTRAP, SIGABRT, SIGVTALRM};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        (void)signal(numbers[i], on_crash);
}

/* Processor time for one more seed. */
static void give_time(void) {
    const struct itimerval time = {.it_value = {.tv_sec = STUCK_S}};
    (void)setitimer(ITIMER_VIRTUAL, &time, NULL);
}

/* A shorter time says nothing of the rate. */
static const double RATE_S_MIN = 1;

struct totals {
    uint64_t seeds, failed, steps, time_us, restarts;
    uint64_t struck[HOST_SIM_FAULTS], seeds_struck[HOST_SIM_FAULTS];
};

static void print_struck(const uint64_t *struck) {
    const char *comma = " ";
    bool any = false;
    for (int k = 0; k < HOST_SIM_FAULTS; k++) {
        if (struck[k] > 0) {
            printf("%s%s %llu", comma, host_sim_kinds[k].name,
                   (unsigned long long)struck[k]);
            comma = ", ";
            any = true;
        }
    }
    if (!any)
        printf(" no fault");
}

static void run_seed(uint64_t seed, unsigned nodes, struct totals *totals,
                     struct host_error *first) {
    struct host_sim_plan plan;
    struct host_sim_outcome outcome;
    struct host_error error = {0};
    host_sim_plan_draw(&plan, seed, nodes);
    note_replay(&plan);
    give_time();
    printf("seed %llu: ", (unsigned long long)seed);
    host_sim_plan_print(stdout, &plan);
    fflush(stdout);
    int status = host_sim_run(&plan, &outcome, &error);
    print_struck(outcome.struck);
    printf("; %llu ms, %llu frames, trace %016llx%s\n",
           (unsigned long long)outcome.time_us / 1000,
           (unsigned long long)outcome.frames,
           (unsigned long long)outcome.trace, status == 0 ? "" : ": FAILED");
    totals->seeds++;
    totals->steps += outcome.steps;
    totals->time_us += outcome.time_us;
    totals->restarts += outcome.restarts;
    for (int k = 0; k < HOST_SIM_FAULTS; k++) {
        totals->struck[k] += outcome.struck[k];
        totals->seeds_struck[k] += outcome.struck[k] > 0;
    }
    if (status != 0) {
        totals->failed++;
        printf("  seed %llu: %s\n%s", (unsigned long long)seed, error.text,
               replay);
        (void)host_fail(first, error.code, "sim: seed %llu: %s",
                        (unsigned long long)seed, error.text);
    }
    fflush(stdout);
}

static void print_totals(const struct totals *t, double seconds) {
    printf("%llu seed%s, %llu failed; %llu restart%s, %.0f s in virtual time, "
           "%.1f in ours",
           (unsigned long long)t->seeds, t->seeds == 1 ? "" : "s",
           (unsigned long long)t->failed, (unsigned long long)t->restarts,
           t->restarts == 1 ? "" : "s", 1e-6 * (double)t->time_us, seconds);
    if (seconds >= RATE_S_MIN)
        printf(", %.0f seeds an hour", 3600 * (double)t->seeds / seconds);
    printf("\n");
    printf("%-12s %12s %8s  while work was open\n", "fault", "strikes",
           "seeds");
    for (int k = 0; k < HOST_SIM_FAULTS; k++) {
        printf("%-12s %12llu %8llu\n", host_sim_kinds[k].name,
               (unsigned long long)t->struck[k],
               (unsigned long long)t->seeds_struck[k]);
    }
}

static double processor_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int host_sim_seeds(const struct host_sim_options *options,
                   struct host_error *error) {
    struct totals totals = {0};
    double start = processor_s(), seconds = 0;
    bool late = false;
    static struct host_call alone = {.threads = 1, .memory_max = UINT64_MAX};
    host_call_enter(&alone);
    watch_crashes();
    for (unsigned i = 0; i < options->ranges && !late; i++) {
        uint64_t seed = options->range[i].first;
        uint64_t left = options->range[i].last - seed;
        for (bool more = true; more && !late; more = left-- > 0) {
            run_seed(seed++, options->nodes, &totals, error);
            seconds = processor_s() - start;
            late = options->seconds_max > 0 &&
                   seconds > (double)options->seconds_max;
        }
    }
    print_totals(&totals, seconds);
    return error->code;
}
