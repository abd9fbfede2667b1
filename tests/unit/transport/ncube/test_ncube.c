/* The nCUBE's calls, and what all nodes do together, on cubes of dimension 0 to
 * 5 whose nodes run real programs. */
#include "ncube_machine.h"

/* cmocka's jumps must not leave a thread. */
static void demand_at(bool true_now, int line) {
    if (!true_now) {
        fprintf(stderr, "tests/unit/transport/ncube/test_ncube.c:%d: not so\n",
                line);
        abort();
    }
}
#define demand(condition) demand_at(condition, __LINE__)

static const struct cube_config narrow = {.window = 1};

/* --- the vendor's calls -------------------------------------------------- */

/* All send to all, themselves and the host as well. */
static void greet_all(struct actor *a) {
    struct ncube *v = &a->ncube;
    int node, process, host, dimension, flag = 7, number = 0;
    bool heard[ENDS_MAX] = {false};
    whoami(v, &node, &process, &host, &dimension);
    demand(host == 0xfffe && process == 0 &&
           dimension == (int)a->stage->machine->dimension &&
           (a->place == a->stage->machine->nodes ? node == host
                                                 : node == (int)a->place));
    int ends = (1 << dimension) + 1;
    for (int i = 0; i < ends; i++) {
        int to = i == ends - 1 ? host : i;
        if (node == host && to == host) {
            continue;
        }
        number = node * 1000 + to;
        demand(nwrite(v, &number, sizeof number, to, i % 9, &flag) ==
               (int)sizeof number);
        demand(flag == 0);
    }
    for (int i = node == host; i < ends; i++) {
        int source = -1, type = -1;
        demand(nread(v, &number, sizeof number, &source, &type, NULL) ==
               (int)sizeof number);
        unsigned from = place_of(a->stage->machine, (uint16_t)source);
        demand(number == source * 1000 + node && !heard[from]);
        demand(type == (node == host ? ends - 1 : node) % 9);
        heard[from] = true;
    }
}

static void every_node_greets_every_node(void **unused) {
    (void)unused;
    for (unsigned d = 0; d <= 5; d++) {
        struct stage *s = new_stage(d, &narrow, (1u << d) + 1, d);
        perform(s, greet_all, greet_all);
        free_stage(s);
    }
}

enum { TYPES_SENT = 6, EACH = 3 };

/* Node 0 reads by type, the last that was sent first; of a type, in order. */
static void choose_by_type(struct actor *a) {
    struct ncube *v = &a->ncube;
    int nodes = (int)a->stage->machine->nodes, size;
    for (int i = 0; i < TYPES_SENT * EACH && a->place != 0; i++) {
        demand(nwrite(v, &i, sizeof i, 0, i % TYPES_SENT, NULL) >= 0);
    }
    for (int node = nodes - 1; node > 0 && a->place == 0; node--) {
        for (int i = TYPES_SENT - 1; i >= 0; i--) {
            for (int k = 0; k < EACH; k++) {
                int number = -1, source = node, type = i;
                size = nread(v, &number, sizeof number, &source, &type, NULL);
                demand(size == (int)sizeof number && source == node &&
                       type == i && number == k * TYPES_SENT + i);
            }
        }
    }
    if (a->place == 0) {
        int source = -1, type = -1;
        demand(ntest(v, &source, &type) == -1 && v->failure == NCUBE_FINE);
        demand(v->used == 0 && v->used_max > 0);
    }
}

static void messages_wait_for_who_asks_for_them(void **unused) {
    (void)unused;
    for (unsigned d = 1; d <= 3; d++) {
        unsigned slots = (unsigned)TYPES_SENT * EACH << d;
        struct stage *s = new_stage(d, &narrow, slots, d);
        perform(s, choose_by_type, NULL);
        free_stage(s);
    }
}

/* 0xffff, sizes from nothing to the most, and buffers that are too small. */
static void tell_all(struct actor *a) {
    static const int sizes[] = {0, 1, 5, 1000, NCUBE_BYTES_MAX};
    struct ncube *v = &a->ncube;
    uint8_t bytes[NCUBE_BYTES_MAX + 1];
    for (int i = 0; i < 5; i++) {
        int source = -1, type = -1, size = sizes[i];
        memset(bytes, i + 1, sizeof bytes);
        if (a->place == a->stage->machine->nodes) {
            demand(nwrite(v, bytes, size, 0xffff, i, NULL) == size);
            continue;
        }
        int room = size / 2 + (int)(a->place % 2) * size;
        int expected = room < size ? room : size;
        int seen = ntest(v, &source, &type);
        while (seen == -1) {
            stage_idle(a, 1);
            source = type = -1;
            seen = ntest(v, &source, &type);
        }
        demand(seen == size && type == i && source == CUBE_HOST);
        memset(bytes, 0, sizeof bytes);
        demand(nread(v, bytes, room, &source, &type, NULL) == expected);
        for (int k = 0; k < (int)sizeof bytes; k++) {
            demand(bytes[k] == (k < expected ? i + 1 : 0));
        }
    }
}

static void the_host_tells_all(void **unused) {
    (void)unused;
    for (unsigned d = 0; d <= 5; d++) {
        struct stage *s = new_stage(d, &narrow, 1, d);
        perform(s, tell_all, tell_all);
        free_stage(s);
    }
}

static void ask_wrongly(struct actor *a) {
    struct ncube *v = &a->ncube;
    uint8_t bytes[NCUBE_BYTES_MAX + 1] = {0};
    int source = -1, type = -1, nobody = 99, negative = -2;
    int above = NCUBE_TYPE_MAX + 1;
    demand(nwrite(v, bytes, -1, 0, 0, NULL) == -1);
    demand(nwrite(v, bytes, sizeof bytes, 0, 0, NULL) == -1);
    demand(nwrite(v, bytes, 1, 4, 0, NULL) == -1);
    demand(nwrite(v, bytes, 1, -1, 0, NULL) == -1);
    demand(nwrite(v, bytes, 1, 0, -1, NULL) == -1);
    demand(nwrite(v, bytes, 1, 0, above, NULL) == -1);
    demand(v->failure == NCUBE_NOT_SOUND);
    demand(nread(v, bytes, -1, &source, &type, NULL) == -1);
    demand(nread(v, bytes, 1, &negative, &type, NULL) == -1);
    demand(nread(v, bytes, 1, &source, &above, NULL) == -1);
    demand(v->failure == NCUBE_NOT_SOUND);
    v->config.patience_us = 100000;
    demand(nread(v, bytes, 1, &nobody, &type, NULL) == -1);
    demand(v->failure == NCUBE_LATE);
}

static void what_makes_no_sense_is_refused(void **unused) {
    (void)unused;
    struct stage *s = new_stage(2, &narrow, 1, 1);
    perform(s, ask_wrongly, ask_wrongly);
    free_stage(s);
}

/* Node 1 writes what node 0 does not ask for, as does the host. */
static void fill_up(struct actor *a) {
    struct ncube *v = &a->ncube;
    int source = -1, type = 5, number = 0;
    if (a->place != 0) {
        for (int i = 0; i < 3; i++) {
            demand(nwrite(v, &i, sizeof i, 0, 1, NULL) >= 0);
        }
        return;
    }
    demand(nread(v, &number, sizeof number, &source, &type, NULL) == -1);
    demand(v->failure == NCUBE_FULL);
    for (int i = 0; i < 6; i++) {
        source = type = -1;
        demand(nread(v, &number, sizeof number, &source, &type, NULL) > 0);
    }
}

static void full_slots_are_said_to_be(void **unused) {
    (void)unused;
    struct stage *s = new_stage(1, &narrow, 2, 1);
    perform(s, fill_up, fill_up);
    free_stage(s);
}

static void live_through(struct actor *a) {
    struct ncube *v = &a->ncube;
    int source = -1, type = 5, number = 3;
    if (a->place == a->stage->machine->nodes) {
        struct cube *cube = v->config.cube;
        for (unsigned i = 0; i < 200; i++) {
            cube_poll(cube, a->stage->machine->now_us);
            stage_idle(a, 0);
        }
        struct cube_wiring next = *cube_wiring(cube);
        cube_renew(cube, &next);
        demand(nwrite(v, &number, sizeof number, 0, 5, NULL) == -1);
        demand(v->failure == NCUBE_RENEWED);
        demand(nwrite(v, &number, sizeof number, 0xffff, 5, NULL) > 0);
        return;
    }
    demand(nwrite(v, &number, sizeof number, (int)a->place ^ 1, 1, NULL) > 0);
    demand(nread(v, &number, sizeof number, &source, &type, NULL) == -1);
    demand(v->failure == NCUBE_RENEWED && v->used == 0);
    source = -1;
    type = 5;
    demand(nread(v, &number, sizeof number, &source, &type, NULL) > 0);
    demand(source == CUBE_HOST);
}

static void a_new_generation_is_told(void **unused) {
    (void)unused;
    struct stage *s = new_stage(3, &narrow, 4, 1);
    perform(s, live_through, live_through);
    free_stage(s);
}

/* --- together ------------------------------------------------------------ */

enum { LARGE = 4000 };

static uint8_t byte_of(unsigned node, unsigned round, size_t i) {
    return (uint8_t)(node * 31 + round * 7 + i * 3 + (i >> 8));
}

static void broadcast_round(struct actor *a, unsigned root, unsigned round,
                            size_t size) {
    uint8_t data[LARGE];
    for (size_t i = 0; i < size; i++) {
        data[i] = a->place == root ? byte_of(root, round, i) : 0;
    }
    demand(ncube_broadcast(&a->ncube, root, data, size) == 0);
    for (size_t i = 0; i < size; i++) {
        demand(data[i] == byte_of(root, round, i));
    }
}

static void gather_round(struct actor *a, unsigned root, unsigned round,
                         size_t size) {
    unsigned nodes = a->stage->machine->nodes;
    uint8_t own[LARGE], *all = malloc(nodes * size + 1);
    demand(all != NULL);
    for (size_t i = 0; i < size; i++) {
        own[i] = byte_of(a->place, round, i);
    }
    demand(ncube_gather(&a->ncube, root, own, size, all) == 0);
    for (unsigned k = 0; k < nodes && a->place == root; k++) {
        for (size_t i = 0; i < size; i++) {
            demand(all[k * size + i] == byte_of(k, round, i));
        }
    }
    free(all);
}

static void add(void *into, const void *from, size_t bytes) {
    for (size_t i = 0; i < bytes; i += sizeof(uint32_t)) {
        uint32_t a, b;
        memcpy(&a, (uint8_t *)into + i, sizeof a);
        memcpy(&b, (const uint8_t *)from + i, sizeof b);
        a += b;
        memcpy((uint8_t *)into + i, &a, sizeof a);
    }
}

static void reduce_round(struct actor *a, unsigned root, unsigned round,
                         size_t size) {
    uint32_t data[LARGE / 4];
    uint32_t nodes = a->stage->machine->nodes;
    for (uint32_t i = 0; i < size / 4; i++) {
        data[i] = a->place * (i + 1) + round;
    }
    demand(ncube_reduce(&a->ncube, root, data, size / 4 * 4, 4, add) == 0);
    for (uint32_t i = 0; i < size / 4 && a->place == root; i++) {
        demand(data[i] == nodes * (nodes - 1) / 2 * (i + 1) + nodes * round);
    }
}

static void barrier_round(struct actor *a, unsigned round) {
    unsigned *count = &a->stage->counts[round % 4];
    unsigned nodes = a->stage->machine->nodes;
    ++*count;
    for (uint64_t i = sim_draw(&a->random) % 30; i > 0; i--) {
        cube_poll(a->ncube.config.cube, a->stage->machine->now_us);
        stage_idle(a, 0);
    }
    demand(ncube_barrier(&a->ncube) == 0);
    demand(*count == nodes);
    demand(ncube_barrier(&a->ncube) == 0);
    *count = 0; /* by each, before any can be two rounds ahead */
}

static void do_together(struct actor *a) {
    static const size_t sizes[] = {8, 0, LARGE, 1, 1596};
    unsigned nodes = a->stage->machine->nodes;
    for (unsigned round = 0; round < 20; round++) {
        unsigned root = round * 5 % nodes;
        size_t size = sizes[round % 5];
        broadcast_round(a, root, round, size);
        reduce_round(a, (root + 1) % nodes, round, size);
        gather_round(a, (root + 2) % nodes, round, size);
        if (round % 7 == 0) {
            barrier_round(a, round);
        }
        broadcast_round(a, (root + 3) % nodes, round, 4);
        broadcast_round(a, (root + 3) % nodes, round, 4);
    }
}

static void nodes_do_things_together(void **unused) {
    (void)unused;
    for (unsigned d = 0; d <= 5; d++) {
        struct cube_config c = {.window = (uint16_t)(d % 2 == 0 ? 1 : 4)};
        struct stage *s = new_stage(d, &c, 1, d);
        perform(s, do_together, NULL);
        free_stage(s);
    }
}

static void do_together_with_care(struct actor *a) {
    while (cube_wiring(a->ncube.config.cube)->generation < 2) {
        cube_poll(a->ncube.config.cube, a->stage->machine->now_us);
        stage_idle(a, 0);
    }
    a->ncube.generation = 2;
    for (unsigned round = 0; round < 10; round++) {
        unsigned root = round % a->stage->machine->nodes;
        broadcast_round(a, root, round, LARGE);
        demand(ncube_barrier(&a->ncube) == 0);
        reduce_round(a, root, round, LARGE);
        demand(ncube_barrier(&a->ncube) == 0);
        gather_round(a, root, round, 100);
        demand(ncube_barrier(&a->ncube) == 0);
    }
}

static void cut_and_renew(struct actor *a) {
    struct cube *cube = a->ncube.config.cube;
    struct cube_wiring next = *cube_wiring(cube);
    next.dead[next.dead_count++] = (struct cube_dead){0, 1};
    next.dead[next.dead_count++] = (struct cube_dead){5, 1};
    cube_renew(cube, &next);
}

static void and_after_links_have_died(void **unused) {
    (void)unused;
    struct stage *s = new_stage(3, &narrow, 8, 2);
    cut_wire(s->machine, 0, 1);
    cut_wire(s->machine, 5, 1);
    perform(s, do_together_with_care, cut_and_renew);
    free_stage(s);
}

static void miss_a_node(struct actor *a) {
    struct ncube *v = &a->ncube;
    uint32_t data = 1;
    int source = 2, type = -1;
    while (cube_wiring(v->config.cube)->generation < 2) {
        cube_poll(v->config.cube, a->stage->machine->now_us);
        stage_idle(a, 0);
        if (a->place == 2 && a->stage->finished == 4) {
            return;
        }
    }
    v->generation = 2;
    demand(nwrite(v, &data, 4, 2, 1, NULL) == -1);
    demand(v->failure == NCUBE_NO_WAY);
    demand(nread(v, &data, 4, &source, &type, NULL) == -1);
    demand(v->failure == NCUBE_NO_WAY);
    /* Node 1 has done its part; 0 and 3 are neighbours of the dead. */
    demand(ncube_reduce(v, 0, &data, 4, 4, add) == (a->place == 1 ? 0 : -1));
    demand(a->place == 1 || v->failure == NCUBE_NO_WAY);
}

static void lose_a_node(struct actor *a) {
    struct cube *cube = a->ncube.config.cube;
    struct cube_wiring next = *cube_wiring(cube);
    next.dead[next.dead_count++] = (struct cube_dead){2, CUBE_WHOLE_NODE};
    cube_renew(cube, &next);
}

static void a_dead_node_is_named_at_once(void **unused) {
    (void)unused;
    struct stage *s = new_stage(2, &narrow, 8, 2);
    cut_wire(s->machine, 2, 0);
    cut_wire(s->machine, 2, 1);
    perform(s, miss_a_node, lose_a_node);
    free_stage(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_node_greets_every_node),
        cmocka_unit_test(messages_wait_for_who_asks_for_them),
        cmocka_unit_test(the_host_tells_all),
        cmocka_unit_test(what_makes_no_sense_is_refused),
        cmocka_unit_test(full_slots_are_said_to_be),
        cmocka_unit_test(a_new_generation_is_told),
        cmocka_unit_test(nodes_do_things_together),
        cmocka_unit_test(and_after_links_have_died),
        cmocka_unit_test(a_dead_node_is_named_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
