/* Cubes of which wires and nodes die while they work: the death is known at
 * the host, and in the generation that the host begins nothing deadlocks and
 * nothing is lost, all pairs at once with the smallest windows. */
#include "cube_machine.h"

enum { DEAD_US = 200000 };

static const struct cube_config smallest = {.window = 1, .dead_us = DEAD_US};

static void chatter_for(struct machine *m, unsigned steps) {
    uint64_t counts[2] = {0, 0};
    for (unsigned i = 0; i < steps; i++) {
        m->now_us += 60;
        for (unsigned k = 0; k < m->count; k++) {
            if (!m->places[k].gone) {
                cube_poll(m->places[k].cube, m->now_us);
                chatter(m, k, i % 50 > 25, counts);
            }
        }
    }
}

/* Until the host has heard of `dead` dead links more. */
static void until_reported(struct machine *m, unsigned dead) {
    const struct cube_wiring *w = wiring_of(m, m->nodes);
    uint64_t start_us = m->now_us;
    while (w->dead_count < w->settled + dead) {
        poll_all(m, 5000);
        /* Beyond dead_us a wire that is down is told of in no time; one that
         * is quiet is down for another 3 s. */
        assert_true(m->now_us - start_us < 4 * DEAD_US + 3500000);
    }
    for (unsigned i = 0; i < 40; i++)
        poll_all(m, 5000);
    assert_int_equal(w->dead_count, w->settled + dead);
}

static void renew(struct machine *m) {
    struct cube *host = m->places[m->nodes].cube;
    struct cube_wiring next = *cube_wiring(host);
    cube_renew(host, &next);
    settle(m, next.generation + 1);
}

static void traffic(struct machine *m, uint32_t each) {
    count_anew(m);
    m->broadcasts = 1;
    run(m, each, 1000000000);
    for (unsigned i = 0; i < m->count; i++) {
        const struct cube_statistics *s = cube_statistics(m->places[i].cube);
        assert_int_equal(s->misrouted, 0);
        assert_int_equal(s->unreachable, 0);
    }
}

TEST(all_pairs_after_each_single_dead_link) {
    for (unsigned d = 2; d <= 4; d++) {
        for (unsigned i = 0; i < 1u << d; i++) {
            for (unsigned link = 0; link < d; link++) {
                if ((i >> link & 1) != 0)
                    continue;
                struct machine *m = build(d, &smallest, &perfect, i * 16 + d);
                settle(m, 1);
                chatter_for(m, 60);
                cut_wire(m, i, link);
                chatter_for(m, 60);
                until_reported(m, 1);
                const struct cube_wiring *w = wiring_of(m, m->nodes);
                assert_int_equal(w->dead[0].node, i);
                assert_int_equal(w->dead[0].dimension, link);
                chatter_for(m, 30);
                renew(m);
                traffic(m, d < 4 ? 3 : 1);
                assert_true(cube_link_is_dead(m->places[i].cube, link));
                destroy(m);
            }
        }
    }
}

/* The wires of one node in turn, down to the last. */
TEST(links_that_die_one_after_another) {
    struct machine *m = build(4, &smallest, &perfect, 9);
    settle(m, 1);
    for (unsigned link = 0; link < 3; link++) {
        chatter_for(m, 100);
        cut_wire(m, 6, link);
        cut_wire(m, 9, 3 - link);
        until_reported(m, 2);
        renew(m);
        traffic(m, 3);
    }
    destroy(m);
}

/* A wire that takes no byte and brings none, but does not say so. */
TEST(a_link_that_falls_silent) {
    struct machine *m = build(3, &smallest, &perfect, 5);
    settle(m, 1);
    chatter_for(m, 100);
    for (unsigned side = 0; side < 2; side++)
        host_sim_cube_deaf(&m->cube, wire_of(m, 5, 1), side, true);
    until_reported(m, 1);
    renew(m);
    traffic(m, 5);
    destroy(m);
}

TEST(a_node_that_dies) {
    for (unsigned node = 1; node < 8; node++) {
        struct machine *m = build(3, &smallest, &perfect, node);
        struct cube *host = m->places[m->nodes].cube;
        settle(m, 1);
        chatter_for(m, 100);
        m->places[node].gone = true;
        chatter_for(m, 100);
        until_reported(m, 3);
        renew(m);
        const struct cube_wiring *w = cube_wiring(host);
        assert_int_equal(w->settled, 1);
        assert_int_equal(w->dead[0].node, node);
        assert_int_equal(w->dead[0].dimension, CUBE_WHOLE_NODE);
        for (unsigned i = 0; i < 8; i++)
            assert_int_equal(cube_reaches(host, (uint16_t)i), i != node);
        traffic(m, 5);
        /* What is written to it goes nowhere, and holds nobody up. */
        for (unsigned i = 0; i < 10; i++) {
            uint16_t to = m->places[node].self;
            assert_int_equal(cube_write(m->places[0].cube, to, 1, "", 0), 0);
        }
        assert_int_equal(cube_statistics(m->places[0].cube)->unreachable, 10);
        destroy(m);
    }
}

/* The host's wire to node 0 dies, or node 0 itself: the host goes on by its
 * spare wire. */
TEST(the_gateway_is_moved) {
    for (unsigned round = 0; round < 6; round++) {
        struct cube_config c = smallest;
        bool node_dies = round % 2 != 0;
        c.spare_node = (uint16_t)(round < 2 ? 1 : round < 4 ? 5 : 7);
        struct machine *m = build(3, &c, &perfect, round);
        struct cube *host = m->places[m->nodes].cube;
        assert_int_equal(cube_links(host), 2);
        settle(m, 1);
        chatter_for(m, 100);
        if (node_dies)
            m->places[0].gone = true;
        else
            cut_wire(m, m->nodes, 0);
        until_reported(m, node_dies ? 4 : 1);
        struct cube_wiring next = *cube_wiring(host);
        next.gateway = c.spare_node;
        cube_renew(host, &next);
        settle(m, 2);
        traffic(m, 5);
        destroy(m);
    }
}

/* Its own sleep is nobody's death. */
TEST(who_sleeps_does_not_call_others_dead) {
    struct machine *m = build(3, &smallest, &perfect, 5);
    settle(m, 1);
    chatter_for(m, 100);
    for (unsigned i = 0; i < 20; i++) {
        m->now_us += 20 * DEAD_US + 4000000; /* all sleep */
        for (unsigned k = 0; k < 50; k++)
            poll_all(m, 100);
    }
    assert_int_equal(wiring_of(m, m->nodes)->dead_count, 0);
    destroy(m);
}

/* As many as are remembered, and more, at random, in larger cubes. */
TEST(many_dead_links) {
    for (unsigned seed = 0; seed < 3; seed++) {
        struct machine *m = build(seed == 0 ? 5 : 4, &smallest, &perfect, seed);
        unsigned cut = 0;
        settle(m, 1);
        for (unsigned i = 0; cut < CUBE_DEAD_MAX && i < m->nodes; i++) {
            unsigned node = i ^ draw(m) % 2;
            unsigned wire = wire_of(m, node, draw(m) % m->dimension);
            cut += m->cube.wire[wire].cuts == 0;
            host_sim_cube_cut(&m->cube, wire, true);
        }
        until_reported(m, cut);
        renew(m);
        for (unsigned i = 0; i < m->nodes; i++) {
            m->places[i].gone |=
                !cube_reaches(m->places[m->nodes].cube, (uint16_t)i);
        }
        traffic(m, 2);
        destroy(m);
    }
}

/* Nodes start late, in any order: each joins when it does. */
TEST(nodes_start_late) {
    for (unsigned seed = 0; seed < 5; seed++) {
        struct machine *m = build(4, &smallest, &perfect, seed);
        for (unsigned i = 0; i < m->count; i++)
            m->places[i].gone = true;
        for (unsigned here = 0; here < m->count;) {
            unsigned who = draw(m) % m->count;
            here += m->places[who].gone;
            m->places[who].gone = false;
            for (unsigned i = draw(m) % 200; i > 0; i--)
                poll_all(m, 5000);
        }
        m->broadcasts = 1;
        run(m, 3, 1000000000);
        assert_int_equal(wiring_of(m, m->nodes)->dead_count, 0);
        destroy(m);
    }
}
