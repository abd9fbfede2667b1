/* What a config of a cube means: whether it is sound, how many links an end
 * has, where each leads, and what it is set to. */
#include <assert.h>
#include <string.h>

#include "cube_internal.h"

static_assert(CUBE_DIMENSION_MAX == 10 && CUBE_HOST_PORTS_MAX == 8,
              "the texts of cube_config_fault say so");

struct link_end cube_peer_of(const struct cube_config *config, unsigned self,
                             unsigned d) {
    bool many = config->host_ports > 1;
    unsigned spare = config->spare_node;
    if (self == CUBE_HOST) {
        unsigned node = many || d == 0 || spare == 0 ? d : spare;
        return (struct link_end){(uint16_t)node, config->dimension};
    }
    if (d >= config->dimension) {
        unsigned port = many ? self : self != 0;
        return (struct link_end){CUBE_HOST, (uint8_t)port};
    }
    return (struct link_end){(uint16_t)(self ^ 1u << d), (uint8_t)d};
}

struct link_config cube_link_config(const struct cube_config *config,
                                    unsigned d) {
    bool host = config->self == CUBE_HOST;
    bool to_host = !host && d == config->dimension;
    struct link_end peer = cube_peer_of(config, config->self, d);
    struct link_config c;
    memset(&c, 0, sizeof c);
    c.pipe = config->pipes[d];
    c.epoch = config->epoch;
    c.node = config->self;
    c.port = (uint8_t)d;
    c.peer_node = peer.node;
    c.peer_port = peer.port;
    c.keeps_peer = to_host;
    c.greeting = (uint8_t)(config->dimension + 1);
    c.window = (host || to_host) && config->host_window != 0
                   ? config->host_window
                   : config->window;
    c.message_max = CUBE_MESSAGE_MAX;
    c.frame_payload = config->frame_payload;
    c.staging = config->staging;
    if (config->serial_baud != 0) {
        link_for_serial(&c, config->serial_baud);
    }
    return c;
}

unsigned cube_links_of(const struct cube_config *config) {
    if (config->host_ports > 1) {
        return config->self == CUBE_HOST
                   ? config->host_ports
                   : config->dimension +
                         (config->self < config->host_ports ? 1u : 0u);
    }
    if (config->self == CUBE_HOST) {
        return config->spare_node != 0 ? 2 : 1;
    }
    return config->dimension +
           (config->self == 0 || config->host_port ? 1u : 0u);
}

/* Who has host ports. */
static const char *host_port_fault(const struct cube_config *config) {
    unsigned ports = config->host_ports, nodes = 1u << config->dimension;
    if ((ports & (ports - 1)) != 0 || ports > CUBE_HOST_PORTS_MAX) {
        return "host_ports is no power of two up to 8";
    }
    if (ports > nodes) {
        return "host_ports is above the number of nodes";
    }
    if (ports > 1 && config->spare_node != 0) {
        return "host_ports and spare_node are both given";
    }
    if (config->spare_node >= nodes) {
        return "spare_node is no node of the cube";
    }
    if (config->self == CUBE_HOST && config->gateway != 0 &&
        config->gateway != config->spare_node && config->gateway >= ports) {
        return "gateway has no host port";
    }
    return NULL;
}

const char *cube_config_fault(const struct cube_config *config) {
    if (config->dimension > CUBE_DIMENSION_MAX) {
        return "dimension is above 10";
    }
    if (config->self != CUBE_HOST && config->self >= 1u << config->dimension) {
        return "self is no node of the cube";
    }
    const char *fault = host_port_fault(config);
    for (unsigned d = 0; fault == NULL && d < cube_links_of(config); d++) {
        struct link_config c = cube_link_config(config, d);
        fault = link_config_fault(&c);
    }
    return fault;
}

void cube_for_serial(struct cube_config *config, uint32_t baud) {
    config->serial_baud = baud;
    if (baud != 0) {
        config->window = config->window >= 8 ? 14 : 7;
    }
}
