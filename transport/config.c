/* What the settings of a link mean: their defaults, those for serial wires, and
 * whether they are sound. */
#include <assert.h>
#include <string.h>

#include "link_internal.h"
#include "cube_internal.h"

enum { STAGING_MOST = 8, TIMEOUT_MIN_US = 100000, TIMEOUT_MAX_US = 1000000 };

static uint32_t or_default(uint32_t value, uint32_t otherwise) {
    return value != 0 ? value : otherwise;
}

struct link_config link_complete(const struct link_config *config) {
    struct link_config c = *config;
    unsigned half = c.window / 2u > 4 ? c.window / 2u : 4;
    unsigned staging = c.window < half ? c.window : half;
    staging = staging < STAGING_MOST ? staging : STAGING_MOST;
    c.message_max = (uint16_t)or_default(c.message_max, LINK_MESSAGE_MAX);
    c.frame_payload = (uint16_t)or_default(c.frame_payload, c.message_max);
    c.staging = (uint16_t)or_default(c.staging, staging);
    c.timeout_min_us = or_default(c.timeout_min_us, TIMEOUT_MIN_US);
    c.timeout_max_us = or_default(c.timeout_max_us, TIMEOUT_MAX_US);
    c.ack_delay_us = or_default(c.ack_delay_us, 5000);
    c.hello_us = or_default(c.hello_us, 50000);
    c.keep_alive_us = or_default(c.keep_alive_us, 500000);
    c.silence_us = or_default(c.silence_us, 3000000);
    return c;
}

/* Bytes that may go over the wire between a frame and its acknowledgement: what
 * either driver has given to the wire, and what the peer has encoded ahead. */
enum { SERIAL_BYTES = 2400, SERIAL_BAUD_MIN = 300 };

void link_for_serial(struct link_config *config, uint32_t baud) {
    uint32_t rate = baud < SERIAL_BAUD_MIN ? SERIAL_BAUD_MIN : baud;
    uint32_t wait_us = (uint32_t)(UINT64_C(10000000) * SERIAL_BYTES / rate);
    config->frame_payload = 408;
    config->staging = 2;
    config->timeout_min_us =
        wait_us < TIMEOUT_MIN_US ? TIMEOUT_MIN_US : wait_us;
    config->timeout_max_us = 4 * config->timeout_min_us;
    if (config->timeout_max_us < TIMEOUT_MAX_US)
        config->timeout_max_us = TIMEOUT_MAX_US;
    config->ack_delay_us = 1000;
}

unsigned link_fragments(const struct link_config *c, size_t size) {
    return size == 0
               ? 1
               : (unsigned)((size + c->frame_payload - 1u) / c->frame_payload);
}

static_assert(LINK_WINDOW_MAX == 64 && LINK_MESSAGE_MAX == 1616 &&
                  LINK_FRAME_PAYLOAD_MIN == 32 &&
                  LINK_FRAME_PAYLOAD_MAX == 1616,
              "the texts of a fault say so");

/* Of a config that is complete. */
static const char *fault_of(const struct link_config *c) {
    if (c->pipe.send == NULL || c->pipe.receive == NULL)
        return "a pipe has no functions";
    if (c->epoch == 0)
        return "epoch is 0";
    if (c->window < 1 || c->window > LINK_WINDOW_MAX)
        return "window is not 1 .. 64 frames";
    if (c->message_max > LINK_MESSAGE_MAX)
        return "message_max is above 1616 bytes";
    if (c->frame_payload % 8 != 0 ||
        c->frame_payload < LINK_FRAME_PAYLOAD_MIN ||
        c->frame_payload > LINK_FRAME_PAYLOAD_MAX)
        return "frame_payload is no multiple of 8 from 32 to 1616 bytes";
    if (link_fragments(c, c->message_max) > c->window)
        return "window does not hold the frames of a message";
    if (c->staging > LINK_WINDOW_MAX)
        return "staging is above 64 frames";
    if (c->timeout_min_us > c->timeout_max_us)
        return "timeout_min_us is above timeout_max_us";
    return NULL;
}

const char *link_config_fault(const struct link_config *config) {
    struct link_config c = link_complete(config);
    return fault_of(&c);
}

/* What a config of a cube means: whether it is sound, how many links an end
 * has, where each leads, and what it is set to. */

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
    if (config->serial_baud != 0)
        link_for_serial(&c, config->serial_baud);
    return c;
}

unsigned cube_links_of(const struct cube_config *config) {
    if (config->host_ports > 1) {
        return config->self == CUBE_HOST
                   ? config->host_ports
                   : config->dimension +
                         (config->self < config->host_ports ? 1u : 0u);
    }
    if (config->self == CUBE_HOST)
        return config->spare_node != 0 ? 2 : 1;
    return config->dimension +
           (config->self == 0 || config->host_port ? 1u : 0u);
}

/* Who has host ports. */
static const char *host_port_fault(const struct cube_config *config) {
    unsigned ports = config->host_ports, nodes = 1u << config->dimension;
    if ((ports & (ports - 1)) != 0 || ports > CUBE_HOST_PORTS_MAX)
        return "host_ports is no power of two up to 8";
    if (ports > nodes)
        return "host_ports is above the number of nodes";
    if (ports > 1 && config->spare_node != 0)
        return "host_ports and spare_node are both given";
    if (config->spare_node >= nodes)
        return "spare_node is no node of the cube";
    if (config->self == CUBE_HOST && config->gateway != 0 &&
        config->gateway != config->spare_node && config->gateway >= ports)
        return "gateway has no host port";
    return NULL;
}

const char *cube_config_fault(const struct cube_config *config) {
    if (config->dimension > CUBE_DIMENSION_MAX)
        return "dimension is above 10";
    if (config->self != CUBE_HOST && config->self >= 1u << config->dimension)
        return "self is no node of the cube";
    const char *fault = host_port_fault(config);
    for (unsigned d = 0; fault == NULL && d < cube_links_of(config); d++) {
        struct link_config c = cube_link_config(config, d);
        fault = link_config_fault(&c);
    }
    return fault;
}

void cube_for_serial(struct cube_config *config, uint32_t baud) {
    config->serial_baud = baud;
    if (baud != 0)
        config->window = config->window >= 8 ? 14 : 7;
}
