/* Nodes without options learn who they are from their neighbours, over bad
 * wires too, and never from noise or from a wire in another socket. */
#include "cube_machine.h"

#include "transport/frame.h"
#include "transport/gossip.h"

/* Only the host knows what it is. */
static void forget(struct machine *m, struct learner *learners) {
    for (unsigned i = 0; i < m->nodes; i++) {
        struct place *p = &m->places[i];
        bool host_port = i == 0 || p->config.host_port;
        p->gone = true;
        learner_init(&learners[i], p->config.pipes,
                     m->dimension + (host_port ? 1u : 0u));
    }
}

static void learn_all(struct machine *m, struct learner *learners,
                      unsigned *heard_host) {
    struct learned learned;
    unsigned known = 0;
    for (unsigned round = 0; known < m->nodes; round++) {
        assert_true(round < 100000);
        for (unsigned i = 0; i < m->nodes; i++) {
            struct place *p = &m->places[i];
            if (!p->gone || !learner_poll(&learners[i], &learned))
                continue;
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

TEST(a_cube_learns_from_its_host) {
    struct learner learners[ENDS_MAX];
    unsigned heard_host = 0;
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

TEST(a_wire_in_another_socket_teaches_nothing) {
    struct cube_config c = {.window = 2};
    struct learner learner;
    struct learned learned;
    struct link_pipe pipes[3];
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
TEST(a_greeting_to_another_is_passed_over) {
    struct cube_config c = {.window = 2};
    struct learner learner;
    struct learned learned;
    struct link_pipe pipes[3];
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

TEST(noise_teaches_nothing) {
    struct learner learner;
    struct learned learned;
    struct host_sim_cube cube;
    struct host_error error = {0};
    uint64_t now_us = 0, random = 99;
    uint8_t noise[97];
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

/* --- asking --------------------------------------------------------------- */

enum { SOCKETS = 4, TICK_US = 500 };

/* A wire that nobody is at the other end of: what was sent into it. */
struct nowhere {
    uint8_t bytes[4096];
    size_t size;
    size_t most;  /* that it takes at a time; 0: as many as there are */
    bool is_shut; /* and takes none */
};

static int lose(void *context, const uint8_t *bytes, size_t size) {
    struct nowhere *n = context;
    if (n->is_shut)
        return LINK_PIPE_CLOSED;
    size = n->most > 0 && n->most < size ? n->most : size;
    size = size < sizeof n->bytes - n->size ? size : 0;
    memcpy(n->bytes + n->size, bytes, size);
    n->size += size;
    return (int)size;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): a pipe's signature */
static int bring_none(void *context, uint8_t *bytes, size_t size) {
    (void)context, (void)bytes, (void)size;
    return 0;
}

static struct nowhere unused_socket;

/* Node i of the cube on a board with SOCKETS sockets and one for a host. */
static void sit_down(struct machine *m, unsigned i, struct learner *learner) {
    struct link_pipe pipes[SOCKETS + 1];
    struct place *p = &m->places[i];
    unused_socket.size = 0;
    for (unsigned d = 0; d <= SOCKETS; d++)
        pipes[d] = (struct link_pipe){&unused_socket, lose, bring_none};
    memcpy(pipes, p->config.pipes, m->dimension * sizeof *pipes);
    if (i == 0 || p->config.host_port)
        pipes[SOCKETS] = p->config.pipes[m->dimension];
    learner_init_ports(learner, pipes, SOCKETS, true);
    p->gone = true;
    /* What lay in its UARTs is gone as well. */
    for (unsigned d = 0; d < host_sim_cube_links(&m->cube, i); d++)
        sim_direction_flush(host_sim_cube_port(&m->cube, i, d)->end->in);
}

/* One who knows starts, as that one, with that epoch. */
static void stand_up(struct machine *m, unsigned i, uint32_t epoch) {
    struct place *p = &m->places[i];
    free(p->arena);
    p->config.epoch = epoch;
    open_place(m, i);
    p->gone = false;
}

/* Asks until it knows; how long that took. */
static uint64_t ask_until(struct machine *m, unsigned i,
                          struct learner *learner, uint64_t most_us) {
    struct learned learned = {.self = UINT16_MAX};
    uint64_t begin_us = m->now_us;
    while (!learner_poll(learner, &learned)) {
        assert_true(m->now_us - begin_us <= most_us);
        unused_socket.size = 0;
        learner_ask(learner, m->now_us);
        poll_all(m, TICK_US);
    }
    assert_int_equal(learned.self, i);
    assert_int_equal(learned.dimension, m->dimension);
    assert_int_equal(learned.host_port,
                     m->places[i].config.host_port && learned.self > 0);
    return m->now_us - begin_us;
}

/* All on boards of four sockets, and the host's wire to node 0 alone, or to a
 * spare node as well. */
TEST(boards_of_four_sockets_learn) {
    struct learner learners[NODES_MAX];
    struct learned learned;
    for (unsigned k = 0; k < 10; k++) {
        unsigned dimension = k % 5, known = 0;
        struct host_sim_cube_options bad = perfect;
        bad.faults.chance[SIM_FLIP] = k >= 5 ? 1e-4 : 0;
        bad.faults.chance[SIM_DELETE] = k >= 5 ? 1e-3 : 0;
        struct cube_config c = {.window = 2};
        c.spare_node = k == 2 ? 3 : 0;
        struct machine *m = build(dimension, &c, &bad, k);
        for (unsigned i = 0; i < m->nodes; i++)
            sit_down(m, i, &learners[i]);
        while (known < m->nodes) {
            assert_true(m->now_us < 10000000);
            for (unsigned i = 0; i < m->nodes; i++) {
                struct place *p = &m->places[i];
                if (p->gone)
                    learner_ask(&learners[i], m->now_us);
                if (p->gone && learner_poll(&learners[i], &learned)) {
                    assert_int_equal(learned.self, i);
                    assert_int_equal(learned.dimension, dimension);
                    assert_int_equal(learned.epoch, 0);
                    assert_true(learned.host_port == p->config.host_port);
                    stand_up(m, i, 1);
                    known++;
                }
            }
            unused_socket.size = 0;
            poll_all(m, TICK_US);
        }
        assert_true(k > 0 || m->now_us < 50000);
        assert_true(m->now_us < 500000 + 500000 * dimension);
        host_sim_cube_faults(&m->cube, NULL);
        m->broadcasts = 1;
        settle(m, 1);
        run(m, 2, 1000000000);
        destroy(m);
    }
}

/* That all links but those of one place never were anything but up. */
static void check_others(const struct machine *m, unsigned besides) {
    for (unsigned i = 0; i < m->count; i++) {
        for (unsigned d = 0; d < host_sim_cube_links(&m->cube, i); d++) {
            unsigned peer = host_sim_cube_port(&m->cube, i, d)->peer;
            if (i != besides && peer != besides) {
                const struct cube *cube = m->places[i].cube;
                const struct link_statistics *s = cube_link_statistics(cube, d);
                assert_int_equal(s->sessions, 1);
                assert_int_equal(s->resumed, 0);
                assert_true(cube_link_state(cube, d) == LINK_UP);
            }
        }
    }
}

/* Reset, while its neighbours are up: they would never greet again. */
TEST(a_node_that_was_reset_asks) {
    for (unsigned k = 0; k < 12; k++) {
        struct cube_config c = {.window = 2};
        struct host_sim_cube_options wires = perfect;
        struct learner learner;
        struct learned learned;
        wires.wire.bytes_per_s = k % 3 ? 11520 : 0;
        wires.wire.room = k % 3 ? 40 : 4000;
        struct machine *m = build(2, &c, &wires, k);
        unsigned i = k % m->nodes;
        uint32_t epoch = m->places[i].config.epoch;
        settle(m, 1);
        run(m, 3, 1000000000);
        for (unsigned life = 1; life < 4; life++) {
            sit_down(m, i, &learner);
            for (unsigned round = 0; round < 10000; round++) {
                poll_all(m, TICK_US); /* five seconds */
                assert_false(learner_poll(&learner, &learned));
            }
            uint64_t took_us = ask_until(m, i, &learner, 2000000);
            assert_true(took_us < 120000 || i != 0);
            assert_true(took_us < 350000);
            assert_int_equal(learner.known.epoch, epoch);
            stand_up(m, i, ++epoch);
            struct cube *host = m->places[m->nodes].cube;
            struct cube_wiring next = *cube_wiring(host);
            cube_renew(host, &next);
            settle(m, next.generation + 1);
            count_anew(m);
            run(m, 3, 1000000000);
            check_others(m, i);
        }
        destroy(m);
    }
}

/* Neighbours that have met different starts of a node, one of which does not
 * answer at first: the largest counts, and who is silent is not waited for for
 * ever. */
TEST(the_largest_epoch_counts) {
    struct cube_config c = {.window = 2};
    struct learner learner;
    struct machine *m = build(2, &c, &perfect, 3);
    settle(m, 1);
    run(m, 1, 1000000000);
    /* Node 2 alone hears of the second start. */
    uint32_t first = m->places[3].config.epoch;
    unsigned wire = wire_of(m, 3, 1);
    host_sim_cube_deaf(&m->cube, wire, 0, true);
    host_sim_cube_deaf(&m->cube, wire, 1, true);
    stand_up(m, 3, first + 5);
    for (unsigned i = 0; i < 200; i++)
        poll_all(m, TICK_US);
    m->places[3].gone = true;
    host_sim_cube_deaf(&m->cube, wire, 0, false);
    host_sim_cube_deaf(&m->cube, wire, 1, false);
    for (unsigned k = 0; k < 2; k++) {
        /* Node 2 stands still for a while, and then for long. */
        uint64_t wakes_us = m->now_us + (k == 0 ? 600000 : 60000000);
        struct learned learned;
        sit_down(m, 3, &learner);
        uint64_t begin_us = m->now_us;
        while (!learner_poll(&learner, &learned)) {
            m->places[2].gone = m->now_us < wakes_us;
            unused_socket.size = 0;
            learner_ask(&learner, m->now_us);
            poll_all(m, TICK_US);
        }
        m->places[2].gone = false;
        assert_int_equal(learned.self, 3);
        assert_int_equal(learned.epoch, k == 0 ? first + 5 : first);
        assert_true(m->now_us - begin_us < 1200000);
        assert_true(m->now_us - begin_us > 500000);
    }
    destroy(m);
}

/* The questions among bytes that went over a wire. */
static unsigned count_questions(const struct nowhere *n) {
    unsigned count = 0;
    size_t begin = 0;
    for (size_t i = 0; i < n->size; i++) {
        struct frame_reader reader;
        struct frame_header header;
        if (n->bytes[i] != 0)
            continue;
        if (i > begin) {
            assert_int_equal(
                frame_open(&reader, n->bytes + begin, i - begin, &header),
                FRAME_GOOD);
            assert_int_equal(header.session, 0);
            assert_int_equal(header.size, 0);
            assert_int_equal(frame_take(&reader, &header, NULL), FRAME_GOOD);
            count++;
        }
        begin = i + 1;
    }
    return count;
}

TEST(questions_are_few_and_whole) {
    static struct nowhere wires[4];
    struct link_pipe pipes[4];
    struct learner learner;
    memset(wires, 0, sizeof wires);
    for (unsigned d = 0; d < 4; d++)
        pipes[d] = (struct link_pipe){&wires[d], lose, bring_none};
    wires[1].most = 3;       /* a slow one */
    pipes[2].send = NULL;    /* not to be asked */
    wires[3].is_shut = true; /* until it opens */
    learner_init(&learner, pipes, 4);
    for (unsigned ms = 0; ms < 2000; ms++) {
        learner_ask(&learner, 5000000 + 1000 * ms);
        wires[3].is_shut = ms < 1234;
    }
    assert_int_equal(count_questions(&wires[0]), 20);
    assert_int_equal(count_questions(&wires[1]), 20);
    assert_int_equal(wires[2].size, 0);
    assert_int_equal(count_questions(&wires[3]), 7);
    assert_true(wires[0].size <= 20 * 21);
    /* A pipe that takes a byte in 20 ms delays them, and cuts none. */
    memset(wires, 0, sizeof wires);
    wires[0].most = 1;
    learner_init(&learner, pipes, 1);
    for (unsigned ms = 0; ms < 4300; ms += 20)
        learner_ask(&learner, 1000 * ms);
    assert_in_range(count_questions(&wires[0]), 8, 10);
}

/* Questions in the midst of traffic, by all wires: all arrives, and no link is
 * ever anything but up. */
TEST(questions_do_no_harm) {
    struct cube_config c = {.window = 3};
    struct learner learner;
    uint64_t stale = 0;
    struct machine *m = build(3, &c, &perfect, 8);
    settle(m, 1);
    m->broadcasts = 1;
    m->each = 40;
    for (unsigned round = 0; !finished(m); round++) {
        assert_true(round < 100000);
        m->now_us += 20 + draw(m) % 80;
        for (unsigned k = 0; k < m->count; k++)
            step(m, draw(m) % m->count);
        unsigned i = draw(m) % m->count;
        learner_init(&learner, m->places[i].config.pipes,
                     host_sim_cube_links(&m->cube, i));
        learner_ask(&learner, m->now_us);
    }
    for (unsigned i = 0; i < m->count; i++) {
        for (unsigned d = 0; d < cube_links(m->places[i].cube); d++) {
            const struct link_statistics *s =
                cube_link_statistics(m->places[i].cube, d);
            stale += s->stale;
            assert_true(s->hellos_sent < 10 + m->now_us / 50000);
        }
    }
    assert_true(stale > 1000);
    check_others(m, UINT32_MAX);
    destroy(m);
}

/* Who has found who it is hears what strangers say, and takes nothing from it;
 * a host at a neighbour's socket, and a neighbour at the host's, are found. */
TEST(strangers_are_not_believed) {
    struct cube_config c = {.window = 2};
    struct learner learner;
    struct learned learned;
    struct link_pipe pipes[SOCKETS + 1];
    struct machine *m = build(2, &c, &perfect, 4),
                   *other = build(2, &c, &perfect, 5);
    settle(m, 1);
    settle(other, 1);
    uint32_t epoch = m->places[3].config.epoch;
    sit_down(m, 3, &learner);
    other->places[1].gone = true;
    /* A neighbour of node 1 of another cube, which knows of a later epoch. */
    learner.pipes[1] = other->places[1].config.pipes[1];
    learner.pipes[3] = other->places[1].config.pipes[0];
    while (!learner_poll(&learner, &learned)) {
        assert_true(m->now_us < 5000000);
        unused_socket.size = 0;
        learner_ask(&learner, m->now_us);
        poll_all(m, TICK_US);
        poll_all(other, TICK_US);
    }
    assert_int_equal(learned.self, 3);
    assert_int_equal(learned.epoch, epoch);
    assert_int_equal(learner.settled & 1u << 1, 0);
    assert_true(learner.misplaced > 3);
    destroy(other);
    /* Node 0 with the host in the socket of dimension 2, which is the number
     * that a host greets there. */
    for (unsigned d = 0; d <= SOCKETS; d++)
        pipes[d] = (struct link_pipe){&unused_socket, lose, bring_none};
    pipes[2] = m->places[0].config.pipes[2];
    m->places[0].gone = true;
    learner_init_ports(&learner, pipes, SOCKETS, true);
    for (unsigned i = 0; i < 1000; i++) {
        unused_socket.size = 0;
        learner_ask(&learner, m->now_us);
        assert_false(learner_poll(&learner, &learned));
        poll_all(m, TICK_US);
    }
    assert_true(learner.misplaced > 3);
    assert_int_equal(learner.misplaced_link, 2);
    assert_int_equal(learner.misplaced_expected, SOCKETS);
    destroy(m);
}
