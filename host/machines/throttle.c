#include "throttle.h"

#include <time.h>

enum { RATE_IDLE_US = 1000 };

static uint64_t draw(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

static void sleep_us(uint64_t us)
{
    struct timespec wait = {(time_t)(us / 1000000),
                            (long)(us % 1000000) * 1000};
    (void)nanosleep(&wait, NULL);
}

static uint64_t now_us(void *context)
{
    struct host_hindered *h = context;
    return h->machine.now_us(h->machine.context);
}

static int send_on(void *context, const uint8_t *bytes, size_t size)
{
    struct host_hindered *h = context;
    return h->machine.pipe.send(h->machine.pipe.context, bytes, size);
}

static int receive_slowly(void *context, uint8_t *bytes, size_t size)
{
    struct host_hindered *h = context;
    uint64_t passed = now_us(h) - h->start_us;
    if (h->hindrance.stall_us_max != 0 && draw(&h->random) % 32 == 0) {
        sleep_us(draw(&h->random) % h->hindrance.stall_us_max);
    }
    if (h->hindrance.bytes_a_second != 0 && passed < h->hindrance.slow_us) {
        uint64_t allowed = passed * h->hindrance.bytes_a_second / 1000000 + 1;
        if (h->taken >= allowed) {
            return 0;
        }
        size = allowed - h->taken < size ? (size_t)(allowed - h->taken) : size;
    }
    int got = h->machine.pipe.receive(h->machine.pipe.context, bytes, size);
    h->taken += got > 0 ? (uint64_t)got : 0;
    return got;
}

/* Bytes that may not be read yet must not wake. */
static void idle(void *context, uint64_t wait_us)
{
    struct host_hindered *h = context;
    if (h->hindrance.bytes_a_second != 0) {
        sleep_us(wait_us < RATE_IDLE_US ? wait_us : RATE_IDLE_US);
    } else {
        h->machine.idle(h->machine.context, wait_us);
    }
}

static int check(void *context, struct host_error *error)
{
    struct host_hindered *h = context;
    return h->machine.check(h->machine.context, error);
}

static bool ended(void *context)
{
    struct host_hindered *h = context;
    return h->machine.ended(h->machine.context);
}

static void stop(void *context)
{
    struct host_hindered *h = context;
    h->machine.stop(h->machine.context);
}

struct host_machine host_hinder(struct host_hindered *hindered,
                                const struct host_machine *machine,
                                const struct host_hindrance *hindrance)
{
    struct host_machine result = *machine;
    hindered->machine = *machine;
    hindered->hindrance = *hindrance;
    hindered->taken = 0;
    hindered->random = hindrance->seed * 2 + 88172645463325253u;
    hindered->start_us = machine->now_us(machine->context);
    result.context = hindered;
    result.pipe = (struct link_pipe){hindered, send_on, receive_slowly};
    result.now_us = now_us;
    result.idle = idle;
    result.check = check;
    result.ended = ended;
    result.stop = stop;
    return result;
}
