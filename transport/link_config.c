/* What the settings of a link mean: their defaults, those for serial wires, and
 * whether they are sound. */
#include <assert.h>

#include "link_internal.h"

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
    if (config->timeout_max_us < TIMEOUT_MAX_US) {
        config->timeout_max_us = TIMEOUT_MAX_US;
    }
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
    if (c->pipe.send == NULL || c->pipe.receive == NULL) {
        return "a pipe has no functions";
    }
    if (c->epoch == 0) {
        return "epoch is 0";
    }
    if (c->window < 1 || c->window > LINK_WINDOW_MAX) {
        return "window is not 1 .. 64 frames";
    }
    if (c->message_max > LINK_MESSAGE_MAX) {
        return "message_max is above 1616 bytes";
    }
    if (c->frame_payload % 8 != 0 ||
        c->frame_payload < LINK_FRAME_PAYLOAD_MIN ||
        c->frame_payload > LINK_FRAME_PAYLOAD_MAX) {
        return "frame_payload is no multiple of 8 from 32 to 1616 bytes";
    }
    if (link_fragments(c, c->message_max) > c->window) {
        return "window does not hold the frames of a message";
    }
    if (c->staging > LINK_WINDOW_MAX) {
        return "staging is above 64 frames";
    }
    if (c->timeout_min_us > c->timeout_max_us) {
        return "timeout_min_us is above timeout_max_us";
    }
    return NULL;
}

const char *link_config_fault(const struct link_config *config) {
    struct link_config c = link_complete(config);
    return fault_of(&c);
}
