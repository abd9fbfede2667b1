#include "throttle.h"

#include <time.h>

enum { RATE_IDLE_US = 1000 };

static uint64_t draw(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

static void sleep_us(uint64_t us) {
    struct timespec wait = {(time_t)(us / 1000000),
                            (long)(us % 1000000) * 1000};
    (void)nanosleep(&wait, NULL);
}

static uint64_t now_us(void *context) {
    struct host_throttled *t = context;
    return t->machine.now_us(t->machine.context);
}

static int send_on(void *context, const uint8_t *bytes, size_t size) {
    struct host_throttled_wire *wire = context;
    return wire->pipe.send(wire->pipe.context, bytes, size);
}

static int receive_slowly(void *context, uint8_t *bytes, size_t size) {
    struct host_throttled_wire *wire = context;
    struct host_throttled *t = wire->throttled;
    uint64_t passed = now_us(t) - t->start_us;
    if (t->throttle.stall_us_max != 0 && draw(&t->random) % 32 == 0) {
        sleep_us(draw(&t->random) % t->throttle.stall_us_max);
    }
    if (t->throttle.bytes_a_second != 0 && passed < t->throttle.slow_us) {
        uint64_t allowed = passed * t->throttle.bytes_a_second / 1000000 + 1;
        if (t->taken >= allowed) {
            return 0;
        }
        size = allowed - t->taken < size ? (size_t)(allowed - t->taken) : size;
    }
    int got = wire->pipe.receive(wire->pipe.context, bytes, size);
    t->taken += got > 0 ? (uint64_t)got : 0;
    return got;
}

/* Bytes that may not be read yet must not wake. */
static void idle(void *context, uint64_t wait_us) {
    struct host_throttled *t = context;
    if (t->throttle.bytes_a_second != 0) {
        sleep_us(wait_us < RATE_IDLE_US ? wait_us : RATE_IDLE_US);
    } else {
        t->machine.idle(t->machine.context, wait_us);
    }
}

static int check(void *context, struct host_error *error) {
    struct host_throttled *t = context;
    return t->machine.check(t->machine.context, error);
}

static void missing(void *context, unsigned node, unsigned link) {
    struct host_throttled *t = context;
    t->machine.missing(t->machine.context, node, link);
}

static void told(void *context, const char *line) {
    struct host_throttled *t = context;
    t->machine.told(t->machine.context, line);
}

static unsigned restarts(void *context) {
    struct host_throttled *t = context;
    return t->machine.restarts(t->machine.context);
}

static uint64_t starved_us(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.starved_us(t->machine.context, node);
}

static bool kill_node(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.kill(t->machine.context, node);
}

static const char *doubt(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.doubt(t->machine.context, node);
}

static const char *start_line(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.start_line(t->machine.context, node);
}

static const char *address(void *context, unsigned node) {
    struct host_throttled *t = context;
    return t->machine.address(t->machine.context, node);
}

static void rest(void *context, uint64_t rest_us) {
    struct host_throttled *t = context;
    t->machine.rest(t->machine.context, rest_us);
}

static bool ended(void *context) {
    struct host_throttled *t = context;
    return t->machine.ended(t->machine.context);
}

static void stop(void *context) {
    struct host_throttled *t = context;
    t->machine.stop(t->machine.context);
}

struct host_machine
host_throttle_machine(struct host_throttled *throttled,
                      const struct host_machine *machine,
                      const struct host_throttle *throttle) {
    struct host_machine result = *machine;
    throttled->machine = *machine;
    throttled->throttle = *throttle;
    throttled->taken = 0;
    throttled->random = throttle->seed * 2 + 88172645463325253u;
    throttled->start_us = machine->now_us(machine->context);
    result.context = throttled;
    for (unsigned i = 0; i < CUBE_HOST_PORTS_MAX; i++) {
        throttled->wire[i] = (struct host_throttled_wire){
            throttled, i == 0 ? machine->pipe : machine->wires[i]};
        result.wires[i] =
            (struct link_pipe){&throttled->wire[i], send_on, receive_slowly};
    }
    result.pipe = result.wires[0];
    result.now_us = now_us;
    result.idle = idle;
    result.check = check;
    result.missing = machine->missing != NULL ? missing : NULL;
    result.told = machine->told != NULL ? told : NULL;
    result.restarts = machine->restarts != NULL ? restarts : NULL;
    result.starved_us = machine->starved_us != NULL ? starved_us : NULL;
    result.kill = machine->kill != NULL ? kill_node : NULL;
    result.doubt = machine->doubt != NULL ? doubt : NULL;
    result.start_line = machine->start_line != NULL ? start_line : NULL;
    result.address = machine->address != NULL ? address : NULL;
    result.rest = machine->rest != NULL ? rest : NULL;
    result.ended = ended;
    result.stop = stop;
    return result;
}
