/* A program for each place of a cube in virtual time, for tests: threads that
 * run one at a time and hand over when they wait.
 *
 * Memory: that of cube_machine.h, and a thread for each place.  Work: a poll
 * each time that a place waits.
 *
 *     struct stage *s = new_stage(dimension, &config, slots, seed);
 *     perform(s, node_program, host_program);
 *     free_stage(s);
 */
#ifndef TESTS_UNIT_NCUBE_MACHINE_H
#define TESTS_UNIT_NCUBE_MACHINE_H

#include "tests/unit/transport/cube_machine.h"

#include <pthread.h>
#include <stdio.h>

#include "transport/ncube/collect.h"

struct stage;

struct actor {
    struct stage *stage;
    struct ncube ncube;
    struct ncube_slot *slots;
    pthread_t thread;
    unsigned place;
    uint64_t random;
};

typedef void play(struct actor *actor);

struct stage {
    struct machine *machine;
    struct actor actors[ENDS_MAX];
    pthread_mutex_t mutex;
    pthread_cond_t next;
    unsigned turn, finished;
    play *of_nodes, *of_host;
    unsigned counts[8]; /* for the programs */
};

static inline uint64_t stage_now_us(void *context) {
    const struct actor *actor = context;
    return actor->stage->machine->now_us;
}

/* Hands over to the next place, and waits for its turn. */
static inline void stage_idle(void *context, uint64_t wait_us) {
    struct actor *actor = context;
    struct stage *s = actor->stage;
    (void)wait_us;
    s->machine->now_us += 1 + actor->place % 5;
    s->turn = s->turn + 1 == s->machine->count ? 0 : s->turn + 1;
    pthread_cond_broadcast(&s->next);
    while (s->turn != actor->place) {
        pthread_cond_wait(&s->next, &s->mutex);
    }
}

/* Passes messages on until all have finished. */
static inline void *stage_thread(void *context) {
    struct actor *actor = context;
    struct stage *s = actor->stage;
    bool host = actor->place == s->machine->nodes;
    play *program = host ? s->of_host : s->of_nodes;
    pthread_mutex_lock(&s->mutex);
    while (s->turn != actor->place) {
        pthread_cond_wait(&s->next, &s->mutex);
    }
    if (program != NULL) {
        program(actor);
    }
    s->finished++;
    while (s->finished < s->machine->count) {
        cube_poll(s->machine->places[actor->place].cube, s->machine->now_us);
        stage_idle(actor, 0);
    }
    /* The turn goes round once more, and each leaves. */
    s->turn = s->turn + 1 == s->machine->count ? 0 : s->turn + 1;
    pthread_cond_broadcast(&s->next);
    pthread_mutex_unlock(&s->mutex);
    return NULL;
}

static inline struct stage *new_stage(unsigned dimension,
                                      const struct cube_config *config,
                                      unsigned slots, uint64_t seed) {
    struct stage *s = calloc(1, sizeof *s);
    assert_non_null(s);
    s->machine = build(dimension, config, &perfect, seed);
    pthread_mutex_init(&s->mutex, NULL);
    pthread_cond_init(&s->next, NULL);
    for (unsigned i = 0; i < s->machine->count; i++) {
        struct actor *actor = &s->actors[i];
        struct ncube_config c = {0};
        actor->stage = s;
        actor->place = i;
        actor->random = seed * 1000 + i + 1;
        actor->slots = calloc(slots, sizeof *actor->slots);
        assert_non_null(actor->slots);
        c.cube = s->machine->places[i].cube;
        c.context = actor;
        c.now_us = stage_now_us;
        c.idle = stage_idle;
        c.self = s->machine->places[i].self;
        c.dimension = (uint8_t)dimension;
        c.slots = actor->slots;
        c.slot_count = (uint16_t)slots;
        c.patience_us = 3000000;
        ncube_init(&actor->ncube, &c);
    }
    return s;
}

static inline void perform(struct stage *s, play *of_nodes, play *of_host) {
    s->of_nodes = of_nodes;
    s->of_host = of_host;
    s->turn = s->finished = 0;
    for (unsigned i = 0; i < s->machine->count; i++) {
        struct actor *actor = &s->actors[i];
        assert_int_equal(
            pthread_create(&actor->thread, NULL, stage_thread, actor), 0);
    }
    for (unsigned i = 0; i < s->machine->count; i++) {
        pthread_join(s->actors[i].thread, NULL);
    }
}

static inline void free_stage(struct stage *s) {
    for (unsigned i = 0; i < s->machine->count; i++) {
        free(s->actors[i].slots);
    }
    pthread_mutex_destroy(&s->mutex);
    pthread_cond_destroy(&s->next);
    destroy(s->machine);
    free(s);
}

#endif
