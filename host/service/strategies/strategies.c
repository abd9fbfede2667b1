#include "strategies.h"

#include <string.h>

#define POINT(name) &host_##name,
static const struct host_strategy *const rows[] = {HOST_STRATEGIES(POINT)};

enum { ROWS = sizeof rows / sizeof rows[0] };

const char host_strategies_elsewhere[] =
    ",master-slaves,linda,hybrid,exchange,";

const struct host_strategy *host_strategy_row(unsigned i)
{
    return i < ROWS ? rows[i] : NULL;
}

const struct host_strategy *host_strategy_named(const char *name)
{
    for (unsigned i = 0; i < ROWS; i++) {
        if (strcmp(rows[i]->name, name) == 0) {
            return rows[i];
        }
    }
    return NULL;
}

const struct host_strategy *host_strategy_auto(const struct host_task *task)
{
    const struct host_strategy *best = rows[0];
    for (unsigned i = 1; i < ROWS; i++) {
        best = rows[i]->cost(task) < best->cost(task) ? rows[i] : best;
    }
    return best;
}

size_t host_strategy_arena(const struct host_strategy *strategy, unsigned nodes,
                           const struct node_identity *identity, size_t memory,
                           const struct node_setup_message *given)
{
    const struct host_work work = {.nodes = nodes, .living = nodes};
    size_t most = 0;
    for (unsigned i = 0; i < nodes; i++) {
        struct node_setup_message setup = *given;
        strategy->set_up(&work, i, &setup);
        size_t needed = node_arena_needed(identity, memory, &setup);
        most = needed > most ? needed : most;
    }
    return most;
}

const char *host_strategy_name(unsigned i)
{
    return i < ROWS ? rows[i]->name : i == ROWS ? "auto" : NULL;
}

const char *host_strategy_help(unsigned i)
{
    return i < ROWS ? rows[i]->help : i == ROWS ? "one of these" : NULL;
}
