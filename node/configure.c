#include "configure.h"

#include <string.h>

/* A wire that takes what is given it: as many frames to the host and back,
 * where they are a hundredth of the memory, that each end is woken for eight.
 */
enum { HOST_WINDOW = 16, HOST_WINDOW_FROM = 3 << 20 };

/* Frames a window, where the identity leaves it open: an eighth of a small
 * memory at most goes to windows. */
static uint16_t window_for(size_t bytes) {
    return bytes >= 2u << 20 ? 8 : bytes >= 1u << 20 ? 4 : 2;
}

struct cube_config node_configure(const struct node_identity *identity,
                                  size_t memory) {
    struct cube_config config;
    memset(&config, 0, sizeof config);
    config.self = identity->self;
    config.dimension = identity->dimension;
    config.window =
        identity->window != 0 ? identity->window : window_for(memory);
    config.epoch = identity->epoch;
    config.host_port = identity->host_port;
    config.host_ports = identity->host_ports;
    config.dead_us = identity->dead_us;
    if (identity->window == 0 && identity->serial_baud == 0 &&
        memory >= HOST_WINDOW_FROM) {
        config.host_window = HOST_WINDOW;
    }
    cube_for_serial(&config, identity->serial_baud);
    return config;
}
