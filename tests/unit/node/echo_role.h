/* A role of the tests' own, as small as one can be: it sends back each text
 * that it is sent, and its jobs are three steps long. */
#ifndef TESTS_ECHO_ROLE_H
#define TESTS_ECHO_ROLE_H

#include <string.h>

#include "node/roles/roles.h"
#include "tests/unit/test.h"

enum {
    ECHO_FAILS = 13, /* a job's epoch: a fault in its third step */
    ECHO_ASKS = 77,
    ECHO_ANSWERS,
    ECHO_TABLE = 640
};

struct echo {
    struct node_counted *counted;
    struct node_fault *fault;
    uint8_t text[16];
    uint16_t size; /* of what is owed; 0: nothing */
    uint32_t epoch, worked;
    uint64_t heard, ended_us;
};

static bool echo_is_worn;

static size_t echo_arena_min(size_t memory,
                             const struct node_setup_message *setup) {
    return memory / 1024 + setup->credits;
}

static bool echo_start(void *self, size_t bytes,
                       const struct node_setup_message *setup,
                       struct node_counted *counted, struct node_fault *fault) {
    struct echo *e = self;
    memset(self, 0, bytes);
    e->counted = counted;
    e->fault = fault;
    if (setup->credits == 0)
        node_fault_set(fault, "nothing to echo", 0, 0);
    return setup->credits > 0;
}

static void echo_message(void *self, const struct cube_message *message,
                         uint64_t now_us) {
    struct echo *e = self;
    struct node_job_message job;
    (void)now_us;
    if (message->type == NODE_JOB && message->size == sizeof job) {
        memcpy(&job, message->data, sizeof job);
        e->epoch = job.epoch;
    } else if (message->type != ECHO_ASKS || message->size > sizeof e->text) {
        node_fault_set(e->fault, "message # in # bytes has no echo",
                       message->type, message->size);
    } else {
        e->size = message->size;
        e->heard++;
        memcpy(e->text, message->data, message->size);
    }
}

static unsigned echo_work(void *self, struct node_pace *pace) {
    struct echo *e = self;
    (void)pace;
    if (e->epoch == ECHO_FAILS) {
        if (++e->worked == 3) {
            node_fault_set(e->fault, "worn out", 0, 0);
            echo_is_worn = true;
        }
        return 0;
    }
    return e->epoch != 0 && e->worked < 3 ? ++e->worked : 0;
}

static unsigned echo_send(void *self) {
    struct echo *e = self;
    if (e->size == 0 || node_counted_write(e->counted, CUBE_HOST, ECHO_ANSWERS,
                                           e->text, e->size) != 0)
        return 0;
    e->size = 0;
    return 1;
}

static uint32_t echo_done(const void *self) {
    const struct echo *e = self;
    return e->worked == 3 && e->epoch != ECHO_FAILS ? e->epoch : 0;
}

static void echo_end(void *self, uint64_t now_us) {
    struct echo *e = self;
    e->epoch = e->worked = 0;
    e->ended_us = now_us;
}

/* The epoch of its job, as if it were a page. */
static uint32_t echo_awaited(const void *self) {
    const struct echo *e = self;
    return e->epoch == 0 ? INCODE_NONE : e->epoch;
}

static uint32_t echo_held(const void *self) {
    const struct echo *e = self;
    return e->size > 0;
}

static void echo_totals(const void *self, struct node_finished_message *totals,
                        uint64_t now_us) {
    const struct echo *e = self;
    assert_true(now_us >= e->ended_us);
    totals->pages_held = e->heard;
    totals->memory_high_water = sizeof *e;
}

static void echo_map(const void *self, struct node_map *map) {
    (void)self;
    map->tables[0].bytes = ECHO_TABLE;
    map->tables[0].count = 1;
    map->pages = 5;
}

static const struct node_role echo_role = {
    .name = "echo",
    .tables = {{"texts", "texts"}},
    .arena_min = echo_arena_min,
    .start = echo_start,
    .message = echo_message,
    .work = echo_work,
    .send = echo_send,
    .done = echo_done,
    .end = echo_end,
    .awaited = echo_awaited,
    .held = echo_held,
    .totals = echo_totals,
    .map = echo_map,
};

#endif
