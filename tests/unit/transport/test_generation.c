/* Generations of a cube: all learn of a new one, and nothing of an old one is
 * read after it, however much was on its way. */
#include "cube_machine.h"

/* From one generation to the next, at the most: as far as a host goes that
 * finds the nodes in those of another. */
static const uint32_t leaps[] = {0,      0x7fff,  0x8000,  0x8001,
                                 0xffff, 0x10000, 1 << 30, 0x7fffffff};
enum { LEAPS = sizeof leaps / sizeof leaps[0] };

/* The host begins anew while windows are full and nobody reads. */
TEST(nothing_of_an_old_generation_is_read) {
    for (unsigned d = 0; d <= 4; d++) {
        struct cube_config c = {.window = (uint16_t)(d % 2 == 0 ? 1 : 4)};
        c.frame_payload = d % 2 == 0 ? 0 : 408;
        struct machine *m = build(d, &c, &perfect, d);
        struct cube *host = m->places[m->nodes].cube;
        uint64_t counts[2] = {0, 0};
        for (uint32_t round = 0; round < 30; round++) {
            bool reads = round % 3 != 0;
            for (unsigned i = 0; i < 300; i++) {
                m->now_us += 40;
                for (unsigned k = 0; k < m->count; k++) {
                    unsigned who = draw(m) % m->count;
                    cube_poll(m->places[who].cube, m->now_us);
                    chatter(m, who, reads, counts);
                }
            }
            struct cube_wiring next = *cube_wiring(host);
            next.generation += leaps[round % LEAPS];
            cube_renew(host, &next);
        }
        settle(m, cube_wiring(host)->generation);
        assert_true(counts[READ] > 100 && counts[READ] < counts[WRITTEN]);
        m->broadcasts = 2;
        run(m, 5, 1000000000); /* and the cube is as good as new */
        check_statistics(m, false);
        destroy(m);
    }
}

/* On lines that lose every third frame or so. */
TEST(datagrams_that_are_lost_are_told_again) {
    struct host_sim_cube_options bad = perfect;
    struct cube_config c = {.window = 2};
    bad.faults.chance[SIM_DELETE] = 0.005;
    struct machine *m = build(4, &c, &bad, 3);
    for (uint32_t generation = 1; generation <= 10; generation++) {
        uint64_t start_us = m->now_us;
        settle(m, generation);
        assert_true(m->now_us - start_us < 2000000);
        struct cube_wiring next = *wiring_of(m, m->nodes);
        cube_renew(m->places[m->nodes].cube, &next);
    }
    destroy(m);
}

/* Who is told first writes at once; what comes to those who are told later
 * waits until they are. */
TEST(nothing_of_the_new_generation_is_lost) {
    struct host_sim_cube_options bad = perfect;
    struct cube_config c = {.window = 4};
    uint32_t written = 0, read = 0;
    bad.faults.chance[SIM_DELETE] = 0.005;
    struct machine *m = build(3, &c, &bad, 3);
    settle(m, 1);
    for (uint32_t generation = 2; generation <= 40; generation++) {
        bool wrote[ENDS_MAX] = {false};
        struct cube_message message;
        struct cube *host = m->places[m->nodes].cube;
        struct cube_wiring next = *cube_wiring(host);
        cube_renew(host, &next);
        for (unsigned i = 0; i < 400000 && (read < written || i < 100); i++) {
            unsigned who = draw(m) % m->count, to = draw(m) % m->count;
            struct cube *cube = m->places[who].cube;
            m->now_us += 10;
            cube_poll(cube, m->now_us);
            if (wiring_of(m, who)->generation == generation && !wrote[who] &&
                who != to &&
                cube_write(cube, m->places[to].self, 1, "new", 3) == 0) {
                wrote[who] = true;
                written++;
            }
            while (cube_read(cube, &message)) {
                cube_release(cube);
                read++;
            }
        }
        assert_int_equal(read, written);
        settle(m, generation);
    }
    assert_true(written > 100);
    destroy(m);
}

/* State datagrams cost nothing once all agree. */
TEST(all_is_quiet_when_all_agree) {
    struct cube_config c = {.window = 2};
    uint64_t datagrams[2] = {0, 0};
    struct machine *m = build(3, &c, &perfect, 3);
    settle(m, 1);
    for (unsigned round = 0; round < 2; round++) {
        for (unsigned i = 0; i < 1000; i++)
            poll_all(m, 1000);
        for (unsigned i = 0; i < m->count; i++) {
            for (unsigned d = 0; d < cube_links(m->places[i].cube); d++) {
                datagrams[round] +=
                    cube_link_statistics(m->places[i].cube, d)->datagrams_sent;
            }
        }
    }
    assert_true(datagrams[0] > 0 && datagrams[0] < 200);
    assert_int_equal(datagrams[1], datagrams[0]);
    destroy(m);
}

TEST(a_node_that_restarts_is_told) {
    struct cube_config c = {.window = 2};
    uint8_t byte = 1;
    struct machine *m = build(3, &c, &perfect, 3);
    struct cube *host = m->places[m->nodes].cube;
    struct cube_wiring next = *cube_wiring(host);
    settle(m, 1);
    next.generation = 70000; /* more than a message's header holds */
    cube_renew(host, &next);
    settle(m, 70000);
    for (unsigned i = 0; i < m->nodes; i++) {
        reboot(m, i);
        assert_int_equal(wiring_of(m, i)->generation, 0);
        assert_int_equal(cube_room(m->places[i].cube, CUBE_HOST), 0);
        assert_int_equal(cube_write(m->places[i].cube, CUBE_HOST, 1, &byte, 1),
                         CUBE_AGAIN);
        settle(m, 70000);
        assert_true(cube_room(m->places[i].cube, CUBE_HOST) > 0);
    }
    destroy(m);
}

/* A host that starts again finds the nodes in generations of its former self,
 * and its own is the later one: at once, or as it outdoes theirs.  After the
 * 3 s in which a node keeps to the host that it has. */
TEST(a_host_that_restarts_is_in_charge) {
    static const uint32_t generations[] = {2,          4,          0xffff,
                                           0x7fffffff, 0x80000001, 0x80000002,
                                           0xfffffffe, 0xffffffff};
    struct cube_config c = {.window = 2};
    for (unsigned k = 0; k < sizeof generations / sizeof generations[0]; k++) {
        uint32_t before = generations[k];
        uint32_t after = wiring_after(1, before) ? 1 : wiring_next(before);
        struct machine *m = build(3, &c, &perfect, k);
        struct place *host = &m->places[m->nodes];
        settle(m, 1);
        renew_to(m, before);
        reboot(m, m->nodes);
        for (unsigned i = 0; i < 2900; i++) {
            poll_all(m, 1000);
            assert_false(all_in(m, after));
        }
        for (unsigned i = 0; i < 300; i++)
            poll_all(m, 1000);
        assert_true(all_in(m, after));
        /* From just opposite it takes a step of its own before. */
        uint64_t outdone = cube_statistics(host->cube)->outdone;
        assert_true(after == 1 ? outdone == 0 : outdone >= 1 && outdone <= 2);
        for (unsigned i = 0; i < m->count; i++)
            assert_int_equal(wiring_of(m, i)->host_epoch, host->config.epoch);
        m->broadcasts = 2;
        run(m, 5, 1000000000);
        destroy(m);
    }
}

/* What is unread when a generation begins is no hindrance, however far that is
 * from the last: another host's may be anywhere. */
TEST(an_unread_message_outlives_no_leap) {
    struct cube_config c = {.window = 2};
    uint8_t bytes[CUBE_PAYLOAD_MAX] = {0};
    for (unsigned i = 0; i < LEAPS; i++) {
        struct machine *m = build(2, &c, &perfect, i);
        struct cube *host = m->places[m->nodes].cube;
        settle(m, 1);
        for (unsigned k = 0; k < 2000; k++) { /* all that windows take */
            unsigned who = k % m->count, to = k / 7 % m->count;
            if (who != to) {
                (void)cube_write(m->places[who].cube, m->places[to].self, 1,
                                 bytes, sizeof bytes);
            }
            poll_all(m, 20);
        }
        struct cube_wiring next = *cube_wiring(host);
        next.generation += leaps[i];
        cube_renew(host, &next);
        settle(m, cube_wiring(host)->generation);
        m->broadcasts = 2;
        run(m, 5, 1000000);
        destroy(m);
    }
}

/* The message in hand stays until it is released. */
TEST(a_message_being_read_outlives_its_generation) {
    struct cube_config c = {.window = 1};
    struct cube_message message;
    struct machine *m = build(1, &c, &perfect, 1);
    struct cube *host = m->places[m->nodes].cube;
    settle(m, 1);
    assert_int_equal(cube_write(m->places[1].cube, CUBE_HOST, 7, "held", 4), 0);
    while (!cube_read(host, &message))
        poll_all(m, 100);
    struct cube_wiring next = *cube_wiring(host);
    cube_renew(host, &next);
    poll_all(m, 100);
    assert_memory_equal(message.data, "held", 4);
    cube_release(host);
    settle(m, 2);
    run(m, 5, 1000000000);
    destroy(m);
}
