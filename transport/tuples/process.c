/* What eval has started here. */
#include "internal.h"

#include <string.h>

#include "transport/check.h"

unsigned tuples_processes_free(const struct tuples *space) {
    unsigned count = 0;
    for (unsigned i = 0; i < space->config.processes; i++) {
        count += space->processes[i].state == TUPLES_IDLE;
    }
    return count;
}

void tuples_process_start(struct tuples *space, uint32_t function,
                          const uint8_t *data, size_t size) {
    unsigned i = 0;
    while (space->processes[i].state != TUPLES_IDLE) {
        i++;
        LINK_ASSERT(i < space->config.processes);
    }
    struct tuples_process *process = &space->processes[i];
    memcpy(process->bytes, data, size);
    LINK_ASSERT(tuple_read(&process->tuple, process->bytes, size));
    process->state = TUPLES_RUNNING;
    process->function = function;
}

unsigned tuples_processes_run(struct tuples *space) {
    const struct tuples_config *config = &space->config;
    unsigned moved = 0;
    for (unsigned i = 0; i < config->processes; i++) {
        struct tuples_process *process = &space->processes[i];
        unsigned out = config->operations + i;
        if (process->state == TUPLES_RUNNING) {
            if (config->functions[process->function](config->context,
                                                     &process->tuple)) {
                LINK_ASSERT(tuples_operation_put(space, out, &process->tuple));
                space->operations[out].closed = true;
                process->state = TUPLES_LEAVING;
                moved++;
            }
        } else if (process->state == TUPLES_LEAVING &&
                   space->operations[out].phase == TUPLES_FREE) {
            process->state = TUPLES_IDLE;
            tuples_request_promise(space);
            moved++;
        }
    }
    return moved;
}
