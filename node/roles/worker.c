#include "worker.h"

#include <string.h>

#include "triangulation.h"

struct worker {
    struct node_fault *fault;
    struct node_triangulation triangulation;
};

static size_t worker_arena_min(size_t memory,
                               const struct node_setup_message *setup) {
    return node_aligned(sizeof(struct worker)) +
           node_triangulation_min(memory, setup);
}

static bool worker_start(void *self, size_t bytes,
                         const struct node_setup_message *setup,
                         struct node_counted *counted,
                         struct node_fault *fault) {
    struct worker *w = self;
    const struct incode_front_peers none = {NULL, NULL, NULL};
    if (bytes < sizeof *w) {
        node_fault_set(fault, "the node's memory does not hold its role", 0, 0);
        return false;
    }
    memset(w, 0, sizeof *w);
    w->fault = fault;
    return node_triangulation_start(&w->triangulation, self, bytes,
                                    node_aligned(sizeof *w), setup, &none, NULL,
                                    counted, fault);
}

static void worker_message(void *self, const struct cube_message *message,
                           uint64_t now_us) {
    struct worker *w = self;
    if (!node_triangulation_message(&w->triangulation, message, now_us)) {
        node_fault_set(w->fault, "message of type # for a worker",
                       message->type, 0);
    }
}

static unsigned worker_work(void *self, struct node_pace *pace) {
    struct worker *w = self;
    return node_triangulation_work(&w->triangulation, pace);
}

static unsigned worker_send(void *self) {
    struct worker *w = self;
    return node_triangulation_send(&w->triangulation);
}

static uint32_t worker_awaited(const void *self) {
    const struct worker *w = self;
    return incode_triangulator_awaited(w->triangulation.triangulator);
}

static uint32_t worker_held(const void *self) {
    const struct worker *w = self;
    return node_triangulation_held(&w->triangulation);
}

static uint32_t worker_done(const void *self) {
    const struct worker *w = self;
    return node_triangulation_done(&w->triangulation);
}

static void worker_end(void *self, uint64_t now_us) {
    struct worker *w = self;
    node_triangulation_end(&w->triangulation, now_us);
}

static void worker_totals(const void *self,
                          struct node_finished_message *totals,
                          uint64_t now_us) {
    const struct worker *w = self;
    node_triangulation_totals(&w->triangulation, totals, now_us);
}

static void worker_map(const void *self, struct node_map *map) {
    const struct worker *w = self;
    node_triangulation_map(&w->triangulation, map, 0);
}

static void worker_gauge(const void *self, struct incode_gauge *gauge) {
    const struct worker *w = self;
    incode_triangulator_gauge(w->triangulation.triangulator, gauge);
}

const struct node_role node_worker_role = {
    .name = "worker",
    .tables = {NODE_TRIANGULATION_NAMES},
    .arena_min = worker_arena_min,
    .start = worker_start,
    .message = worker_message,
    .work = worker_work,
    .send = worker_send,
    .done = worker_done,
    .end = worker_end,
    .awaited = worker_awaited,
    .held = worker_held,
    .totals = worker_totals,
    .gauge = worker_gauge,
    .map = worker_map,
};
