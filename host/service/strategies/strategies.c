#include "strategies.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define POINT(name) &host_##name,
static const struct host_strategy *const rows[] = {HOST_STRATEGIES(POINT)};

enum { ROWS = sizeof rows / sizeof rows[0] };

const struct host_strategy *host_strategy_row(unsigned i) {
    return i < ROWS ? rows[i] : NULL;
}

const struct host_strategy *host_strategy_linda(unsigned i) {
    unsigned row = 0;
    while (row < ROWS && (rows[row]->linda == NULL || i-- > 0))
        row++;
    return host_strategy_row(row);
}

const char *host_linda_name(unsigned i) {
    const struct host_strategy *row = host_strategy_linda(i);
    return row == NULL ? NULL : row->linda;
}

const struct host_strategy *host_strategy_named(const char *name) {
    for (unsigned i = 0; i < ROWS; i++)
        if (strcmp(rows[i]->name, name) == 0)
            return rows[i];
    return NULL;
}

/* What one node alone takes for a point, and what a point takes on the host's
 * wire, its page and some 6.7 tetrahedra: measured on uniform points. */
#define POINT_S 2.5e-6
enum { POINT_BYTES = 70 };

/* What the host takes meanwhile, in the time of one node alone: measured on
 * sets of many kinds, 0.2 to 0.5. */
#define HOST_SHARE 0.45

int host_strategy_check(const struct host_strategy *strategy, unsigned nodes,
                        const struct host_sharing *sharing,
                        enum incode_face_rule rule, enum incode_build build,
                        struct host_error *error) {
    if (strategy->by_faces && build == INCODE_BUILD_POINTS) {
        return host_fail(error, HOST_USAGE,
                         "--build points: --strategy %s goes face by face; "
                         "leave it out",
                         strategy->name);
    }
    return strategy->check == NULL
               ? 0
               : strategy->check(nodes, sharing, rule, error);
}

double host_strategy_time(const struct host_strategy *strategy,
                          const struct host_task *task) {
    struct host_error refused = {0};
    if (host_strategy_check(strategy, task->nodes, &task->sharing,
                            task->face_rule, task->build, &refused) != 0 ||
        (task->fits != NULL && !task->fits(task->context, strategy)))
        return INFINITY;
    struct host_cost cost = strategy->cost(task);
    double host = task->with_host ? HOST_SHARE : 0.0;
    double all = (cost.total + host) / task->processors;
    double wire = task->wire_bytes_s == 0
                      ? 0.0
                      : POINT_BYTES / POINT_S / (double)task->wire_bytes_s;
    double longest = cost.busiest > all ? cost.busiest : all;
    return longest > wire ? longest : wire;
}

/* The row of the one that takes least, and what each takes. */
static unsigned choose(const struct host_task *task, double time[ROWS]) {
    unsigned best = 0;
    for (unsigned i = 0; i < ROWS; i++) {
        time[i] = host_strategy_time(rows[i], task);
        best = time[i] < time[best] ? i : best;
    }
    return best;
}

const struct host_strategy *host_strategy_auto(const struct host_task *task) {
    double time[ROWS];
    return rows[choose(task, time)];
}

void host_strategy_why(const struct host_task *task,
                       char text[HOST_WHY_BYTES]) {
    double time[ROWS];
    unsigned best = choose(task, time);
    int at = snprintf(text, HOST_WHY_BYTES,
                      "%s is expected to take %.2f of one node's time",
                      rows[best]->name, time[best]);
    for (unsigned i = 0; i < ROWS; i++) {
        if (i != best && time[i] < INFINITY && at < HOST_WHY_BYTES) {
            at += snprintf(text + at, HOST_WHY_BYTES - (size_t)at, ", %s %.2f",
                           rows[i]->name, time[i]);
        }
    }
}

enum host_partition
host_strategy_partition(const struct host_strategy *strategy,
                        enum host_partition asked) {
    return asked == HOST_ADAPTIVE && strategy->owner_rule == INCODE_OWNER_LOWEST
               ? HOST_OWNED
               : asked;
}

size_t host_strategy_arena(const struct host_strategy *strategy, unsigned nodes,
                           const struct node_identity *identity, size_t memory,
                           const struct host_sharing *sharing,
                           const struct node_setup_message *given) {
    struct host_work work = {.sharing = *sharing, .nodes = nodes};
    size_t most = 0;
    for (unsigned i = 0; i <= nodes; i++) {
        /* Last, what is left for one that has lost all others. */
        struct node_setup_message setup = *given;
        setup.nodes = (uint16_t)nodes;
        work.living = i < nodes ? nodes : 1;
        setup.setup.owner_rule = (uint8_t)strategy->owner_rule;
        strategy->set_up(&work, i < nodes ? i : 0, &setup);
        size_t needed = node_arena_needed(identity, memory, &setup);
        most = needed > most ? needed : most;
    }
    return most;
}

const char *host_strategy_name(unsigned i) {
    return i < ROWS ? rows[i]->name : i == ROWS ? "auto" : NULL;
}

const char *host_strategy_help(unsigned i) {
    return i < ROWS    ? rows[i]->help
           : i == ROWS ? "the one expected to be done first"
                       : NULL;
}
