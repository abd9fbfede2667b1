#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include "host/base/parallel.h"
#include "sim.h"

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
    if (plan->nodes_given != 0) {
        snprintf(nodes, sizeof nodes, " --nodes %u", plan->nodes_given);
    }
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
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        (void)signal(numbers[i], on_crash);
    }
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
    if (!any) {
        printf(" no fault");
    }
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
    if (seconds >= RATE_S_MIN) {
        printf(", %.0f seeds an hour", 3600 * (double)t->seeds / seconds);
    }
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
