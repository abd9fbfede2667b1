#include "memory_needed.h"

#include <string.h>

#include "node/node.h"

static unsigned cube_dimension(unsigned nodes) {
    unsigned dimension = 0;
    while (1u << dimension < nodes) {
        dimension++;
    }
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
    while (!does_with(options, strategy, dimension, setup, memory)) {
        memory += 16384;
    }
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
    if (options->cube != NULL) {
        return "";
    }
    if (options->window > 0 &&
        memory_needed(&narrow, strategy, cube_dimension(nodes), setup) <=
            options->memory) {
        return fewer ? ", fewer --nodes, or no --window" : ", or no --window";
    }
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

bool host_memory_fits(const struct host_run_options *options,
                      const struct host_strategy *strategy, unsigned nodes,
                      uint32_t bricks, const uint32_t cells[3]) {
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
