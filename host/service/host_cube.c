#include "host_cube.h"

#include <stdlib.h>
#include <string.h>

enum { WINDOW_DEFAULT = 32 };

struct cube *host_cube_make(const struct host_machine *machine, unsigned window,
                            void **memory, struct host_error *error) {
    struct cube_config config;
    memset(&config, 0, sizeof config);
    config.self = CUBE_HOST;
    config.dimension = (uint8_t)machine->dimension;
    config.window = (uint16_t)(window == 0 ? WINDOW_DEFAULT : window);
    if (config.window > LINK_WINDOW_MAX) {
        config.window = LINK_WINDOW_MAX;
    }
    config.epoch = machine->epoch;
    config.pipes[0] = machine->pipe;
    config.pipes[1] = machine->spare;
    config.spare_node = machine->spare_node;
    config.host_ports = machine->host_ports;
    for (unsigned i = 1; i < config.host_ports; i++) {
        config.pipes[i] = machine->wires[i];
    }
    cube_for_serial(&config, machine->serial_baud);
    size_t bytes = cube_arena_bytes(&config);
    *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (*memory == NULL) {
        host_fail_memory(error, "the wire");
        return NULL;
    }
    struct cube *cube = cube_init(*memory, bytes, &config);
    if (cube == NULL) {
        host_fail(error, HOST_BROKEN,
                  "host: the cube of %u nodes does not come up; please report "
                  "this",
                  machine->nodes);
    }
    return cube;
}
