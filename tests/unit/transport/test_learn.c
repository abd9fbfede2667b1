/* Nodes without options learn who they are from their neighbours, over bad
 * wires too, and never from noise or from a wire in another socket. */
#include "cube_machine.h"

#include "transport/learn.h"

/* Only the host knows what it is. */
static void forget(struct machine *m, struct learner *learners)
{
    for (unsigned i = 0; i < m->nodes; i++) {
        struct place *p = &m->places[i];
        bool host_port = i == 0 || p->config.host_port;
        p->gone = true;
        learner_init(&learners[i], p->config.pipes,
                     m->dimension + (host_port ? 1u : 0u));
    }
}

static void learn_all(struct machine *m, struct learner *learners,
                      unsigned *heard_host)
{
    struct learned learned;
    unsigned known = 0;
    for (unsigned round = 0; known < m->nodes; round++) {
        assert_true(round < 100000);
        for (unsigned i = 0; i < m->nodes; i++) {
            struct place *p = &m->places[i];
            if (!p->gone || !learner_poll(&learners[i], &learned)) {
                continue;
            }
            assert_int_equal(learned.self, i);
            assert_int_equal(learned.dimension, m->dimension);
            *heard_host += learned.host_port;
            free(p->arena);
            p->config.epoch = draw(m) | 1;
            open_place(m, i);
            p->gone = false;
            known++;
        }
        poll_all(m, 500);
    }
}

static void a_cube_learns_from_its_host(void **unused)
{
    struct learner learners[ENDS_MAX];
    unsigned heard_host = 0;
    (void)unused;
    for (unsigned d = 0; d <= 5; d++) {
        struct host_sim_cube_options bad = perfect;
        bad.faults.chance[SIM_FLIP] = d % 2 ? 1e-4 : 0;
        bad.faults.chance[SIM_DELETE] = bad.faults.chance[SIM_INSERT] =
            d % 2 ? 1e-3 : 0;
        struct cube_config c = {.window = 2};
        c.spare_node = d == 4 ? 9 : 0;
        struct machine *m = build(d, &c, &bad, d);
        forget(m, learners);
        learn_all(m, learners, &heard_host);
        host_sim_cube_faults(&m->cube, NULL);
        m->broadcasts = 1;
        settle(m, 1);
        run(m, 2, 1000000000);
        destroy(m);
    }
    assert_int_equal(heard_host, 1);
}

static void a_wire_in_another_socket_teaches_nothing(void **unused)
{
    struct cube_config c = {.window = 2};
    struct learner learner;
    struct learned learned;
    struct link_pipe pipes[3];
    (void)unused;
    struct machine *m = build(3, &c, &perfect, 1);
    memcpy(pipes, m->places[5].config.pipes, sizeof pipes);
    struct link_pipe first = pipes[0];
    pipes[0] = pipes[1];
    pipes[1] = pipes[2];
    pipes[2] = first;
    learner_init(&learner, pipes, 3);
    m->places[5].gone = true;
    for (unsigned i = 0; i < 1000; i++) {
        poll_all(m, 500);
        assert_false(learner_poll(&learner, &learned));
    }
    assert_true(learner.misplaced > 3);
    assert_true(learner.misplaced_expected ==
                (learner.misplaced_link + 1u) % 3);
    destroy(m);
}

/* A node of a cube of 8 hears a node of a cube of 2 on the same link first: it
 * passes that over, and hears its own neighbours. */
static void a_greeting_to_another_is_passed_over(void **unused)
{
    struct cube_config c = {.window = 2};
    struct learner learner;
    struct learned learned;
    struct link_pipe pipes[3];
    (void)unused;
    struct machine *small = build(1, &c, &perfect, 1);
    struct machine *m = build(3, &c, &perfect, 1);
    memcpy(pipes, m->places[5].config.pipes, sizeof pipes);
    struct link_pipe own = pipes[0];
    pipes[0] = small->places[1].config.pipes[0];
    learner_init(&learner, pipes, 3);
    m->places[5].gone = small->places[1].gone = true;
    for (unsigned i = 0; learner.misfits < 3; i++) {
        assert_true(i < 1000);
        poll_all(small, 500);
        assert_false(learner_poll(&learner, &learned));
    }
    learner.pipes[0] = own;
    for (unsigned i = 0; !learner_poll(&learner, &learned); i++) {
        assert_true(i < 1000);
        poll_all(m, 500);
    }
    assert_int_equal(learned.self, 5);
    assert_int_equal(learned.dimension, 3);
    destroy(small);
    destroy(m);
}

static void noise_teaches_nothing(void **unused)
{
    struct learner learner;
    struct learned learned;
    struct host_sim_cube cube;
    struct host_error error = {0};
    uint64_t now_us = 0, random = 99;
    uint8_t noise[97];
    (void)unused;
    assert_int_equal(host_sim_cube_open(&cube, &perfect, &now_us, &error), 0);
    struct link_pipe pipe = host_sim_cube_pipe(&cube, 0, 0);
    struct link_pipe far = host_sim_cube_pipe(&cube, 1, 0);
    learner_init(&learner, &pipe, 1);
    for (unsigned i = 0; i < 20000; i++) {
        size_t size = 1 + sim_draw(&random) % sizeof noise;
        for (size_t k = 0; k < size; k++) {
            uint64_t byte = sim_draw(&random) >> 32;
            noise[k] = byte % 5 == 0 ? 0 : (uint8_t)(byte >> 8);
        }
        (void)far.send(far.context, noise, size);
        now_us += 100;
        assert_false(learner_poll(&learner, &learned));
    }
    host_sim_cube_close(&cube);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cube_learns_from_its_host),
        cmocka_unit_test(a_wire_in_another_socket_teaches_nothing),
        cmocka_unit_test(a_greeting_to_another_is_passed_over),
        cmocka_unit_test(noise_teaches_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
