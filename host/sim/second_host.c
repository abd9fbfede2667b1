#include "second_host.h"

#include <stdio.h>
#include <string.h>

/* --- its machine ---------------------------------------------------------- */

/* The world's clock goes on without it. */
static uint64_t machine_now_us(void *context)
{
    const struct host_rival *r = context;
    return r->world->now_us + r->ahead_us;
}

static void machine_idle(void *context, uint64_t wait_us)
{
    struct host_rival *r = context;
    if (r->there) {
        r->sleep_us = r->world->now_us + wait_us;
    } else {
        r->ahead_us += wait_us + 1;
    }
}

static int machine_check(void *context, struct host_error *error)
{
    (void)context, (void)error;
    return 0;
}

static void machine_rest(void *context, uint64_t rest_us)
{
    struct host_rival *r = context;
    host_world_rest(r->world, rest_us);
}

static bool machine_ended(void *context)
{
    (void)context;
    return true;
}

static void machine_stop(void *context)
{
    (void)context;
}

/* --- rounds --------------------------------------------------------------- */

void host_rival_come(struct host_rival *rival, struct host_world *world,
                     uint64_t leave_us, uint32_t host_us)
{
    struct host_rival *r = rival;
    struct host_error error = {0};
    r->world = world;
    r->leave_us = leave_us;
    r->host_us = host_us;
    r->random = sim_seed(world->options.seed, 3);
    r->machine = host_world_machine(world);
    r->machine.context = r;
    r->machine.pipe = host_world_pipe(world, 1);
    r->machine.now_us = machine_now_us;
    r->machine.idle = machine_idle;
    r->machine.check = machine_check;
    r->machine.rest = machine_rest;
    r->machine.ended = machine_ended;
    r->machine.stop = machine_stop;
    r->service.machine = &r->machine;
    r->there = true;
    host_world_knock(world, true);
    if (host_service_open(&r->service, &error) != 0) {
        snprintf(r->fault, sizeof r->fault, "%.250s", error.text);
        host_rival_leave(r);
    }
}

void host_rival_leave(struct host_rival *rival)
{
    if (rival->there) {
        rival->there = false;
        host_world_knock(rival->world, false);
        host_service_end(&rival->service);
    }
}

/* Nobody answers it, and it is not given the cube. */
static bool let_in(const struct host_rival *r)
{
    return r->service.here > 0 ||
           cube_link_statistics(r->service.cube, 0)->sessions > 0;
}

void host_rival_round(void *rival)
{
    struct host_rival *r = rival;
    struct host_world *w = r->world;
    struct host_error error = {0};
    if (!r->there) {
        return;
    }
    if (w->now_us < r->busy_us) {
        w->guest_us = r->busy_us;
        return;
    }
    r->busy_us = w->now_us + host_world_draw(&r->random, 1, 2 * r->host_us);
    r->sleep_us = 0;
    int status = host_service_round(&r->service, &error);
    bool in_use = status == HOST_CUBE && strstr(error.text, "in use") != NULL;
    unsigned told = cube_link_peer(r->service.cube, 0)->in_use;
    r->told_us = told != r->told ? w->now_us : r->told_us;
    r->told = told;
    if (let_in(r)) {
        snprintf(r->fault, sizeof r->fault, "a second host got in");
    } else if (status != 0 && !in_use) {
        snprintf(r->fault, sizeof r->fault, "a second host: %.230s",
                 error.text);
    }
    if (status != 0 || w->now_us >= r->leave_us || r->fault[0] != '\0') {
        host_rival_leave(r);
        return;
    }
    uint64_t due = host_world_door_due(w, 1);
    due = r->sleep_us < due ? r->sleep_us : due;
    due = r->leave_us < due ? r->leave_us : due;
    w->guest_us = r->busy_us > due ? r->busy_us : due;
}
