/* Cubes in virtual time: every pair at once with the smallest windows, in
 * order and whole; broadcasts; hosts that are slow; wires that are wrong. */
#include "cube_machine.h"

/* --- tests ---------------------------------------------------------------- */

TEST(every_pair_at_once_with_windows_of_one) {
    for (unsigned d = 0; d <= 5; d++) {
        struct cube_config c = {.window = 1};
        struct machine *m = build(d, &c, &perfect, d);
        run(m, d < 4 ? 40 : 8, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

TEST(every_pair_at_once_with_wider_windows) {
    for (unsigned d = 0; d <= 4; d++) {
        struct cube_config c = {.window = (uint16_t)(2 + 3 * d)};
        struct machine *m = build(d, &c, &perfect, d);
        run(m, 30, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

/* A message in four frames, windows of one message. */
TEST(every_pair_at_once_in_small_frames) {
    for (unsigned d = 1; d <= 4; d++) {
        struct cube_config c = {
            .window = 4, .frame_payload = 408, .staging = 1};
        struct machine *m = build(d, &c, &perfect, d);
        run(m, 10, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

TEST(every_pair_at_once_on_bad_wires) {
    struct host_sim_cube_options bad = perfect;
    bad.faults.chance[SIM_FLIP] = 1e-5;
    bad.faults.chance[SIM_DELETE] = bad.faults.chance[SIM_INSERT] =
        bad.faults.chance[SIM_REPEAT] = 2e-5;
    for (unsigned d = 0; d <= 3; d++) {
        struct cube_config c = {
            .window = 5, .frame_payload = 408, .staging = 2};
        struct machine *m = build(d, &c, &bad, d);
        m->broadcasts = 5;
        run(m, 20, 4000000000);
        check_statistics(m, false);
        destroy(m);
    }
}

TEST(broadcasts_from_everywhere) {
    for (unsigned d = 0; d <= 5; d++) {
        struct cube_config c = {.window = 1 + d % 2};
        struct machine *m = build(d, &c, &perfect, d);
        m->broadcasts = 20;
        run(m, 3, 1000000000);
        check_statistics(m, true);
        destroy(m);
    }
}

/* The host is wired to each of the first nodes: no message of it makes a hop in
 * the dimensions in which those differ. */
TEST(a_host_with_many_wires) {
    for (unsigned d = 1; d <= 5; d++) {
        for (unsigned wires = 2; wires <= 1u << d && wires <= 8; wires *= 2) {
            struct cube_config c = {.window = 1, .host_ports = (uint8_t)wires};
            struct machine *m = build(d, &c, &perfect, d);
            m->broadcasts = 10;
            run(m, 5, 1000000000);
            check_statistics(m, true);
            assert_int_equal(cube_links(m->places[m->nodes].cube), wires);
            destroy(m);
        }
    }
}

TEST(a_host_wired_to_all_needs_nobody_between) {
    struct cube_config c = {.window = 2, .host_ports = 8};
    struct machine *m = build(3, &c, &perfect, 1);
    for (unsigned turn = 0; turn < 2000; turn++) { /* all come up */
        m->now_us += 50;
        for (unsigned i = 0; i < 9; i++)
            cube_poll(m->places[i].cube, m->now_us);
    }
    struct cube *host = m->places[8].cube;
    for (uint16_t i = 0; i < 8; i++) {
        struct cube *node = m->places[i].cube;
        assert_int_equal(cube_write(host, i, 1, "one", 3), 0);
        assert_int_equal(cube_write(node, CUBE_HOST, 1, "one", 3), 0);
    }
    assert_int_equal(cube_write(host, CUBE_ALL, 2, "all", 3), 0);
    unsigned counts[9] = {0};
    for (unsigned turn = 0; turn < 2000; turn++) {
        struct cube_message message;
        m->now_us += 50;
        for (unsigned i = 0; i < 9; i++) {
            struct cube *cube = m->places[i].cube;
            cube_poll(cube, m->now_us);
            while (cube_read(cube, &message)) {
                counts[i]++;
                cube_release(cube);
            }
        }
    }
    for (unsigned i = 0; i < 9; i++) {
        assert_int_equal(counts[i], i < 8 ? 2 : 8);
        assert_int_equal(cube_statistics(m->places[i].cube)->passed_on, 0);
    }
    destroy(m);
}

/* Each place stops, or does not read, at random times. */
TEST(places_that_stall) {
    for (uint64_t seed = 0; seed < 4; seed++) {
        struct cube_config c = {.window = 1};
        struct machine *m = build(3 + (unsigned)seed % 3, &c, &perfect, seed);
        m->each = 6;
        m->broadcasts = 2;
        while (!finished(m)) {
            m->now_us += 50;
            assert_true(m->now_us < 4000000000);
            unsigned who = draw(m) % m->count;
            if (draw(m) % 50 == 0)
                m->places[m->nodes].deaf_until_us = m->now_us + draw(m) % 30000;
            if (draw(m) % 1500 == 0)
                m->places[who].stopped_until_us = m->now_us + draw(m) % 100000;
            for (unsigned i = 0; i < m->count; i++)
                step(m, i);
        }
        check_statistics(m, false);
        destroy(m);
    }
}

/* The host reads a message now and then: all wait, none is lost. */
TEST(a_host_that_is_slow) {
    struct cube_config c = {.window = 2};
    struct cube_message message;
    struct machine *m = build(3, &c, &perfect, 1);
    struct place *host = &m->places[m->nodes];
    m->each = 10;
    for (uint64_t i = 0; !finished(m); i++) {
        assert_true(i < 2000000);
        m->now_us += 100;
        for (unsigned k = 0; k < m->nodes; k++)
            step(m, k);
        cube_poll(host->cube, m->now_us);
        if (i % 1000 == 0 && cube_read(host->cube, &message)) {
            take(m, m->nodes, &message);
            cube_release(host->cube);
        }
        give(m, m->nodes);
    }
    check_statistics(m, false);
    destroy(m);
}

/* Node 1 does not read what node 0 sent it; messages from 3 to 0 pass through
 * it all the same. */
TEST(an_unread_message_holds_its_own_link_alone) {
    struct cube_config c = {.window = 1};
    struct cube_message message;
    unsigned passed = 0;
    struct machine *m = build(2, &c, &perfect, 1);
    for (unsigned i = 0; i < 1000; i++) {
        m->now_us += 100;
        for (unsigned k = 0; k < m->count; k++)
            cube_poll(m->places[k].cube, m->now_us);
        cube_write(m->places[0].cube, 1, 1, "unread", 6);
        cube_write(m->places[2].cube, 1, 2, "by another way", 14);
        if (cube_read(m->places[2].cube, &message))
            fail();
        while (cube_read(m->places[0].cube, &message)) {
            assert_int_equal(message.source, 3);
            cube_release(m->places[0].cube);
            passed++;
        }
        cube_write(m->places[3].cube, 0, 3, "passing", 7);
    }
    /* 3 differs from 0 in both dimensions: lowest first is by way of 2. */
    assert_true(passed > 100);
    assert_int_equal(cube_statistics(m->places[2].cube)->passed_on > 100, 1);
    assert_true(cube_read(m->places[1].cube, &message));
    assert_int_equal(message.size, message.source == 0 ? 6 : 14);
    destroy(m);
}

/* Node 0 is flooded with messages for the host; its own get through. */
TEST(a_flood_does_not_starve_the_node_it_passes) {
    struct cube_config c = {.window = 1};
    struct cube_message message;
    unsigned own = 0, others = 0;
    struct machine *m = build(2, &c, &perfect, 1);
    for (unsigned i = 0; i < 20000; i++) {
        m->now_us += 40;
        for (unsigned k = 0; k < m->nodes; k++) {
            cube_poll(m->places[k].cube, m->now_us);
            cube_write(m->places[k].cube, CUBE_HOST, 1, "flood", 5);
        }
        struct cube *host = m->places[m->nodes].cube;
        cube_poll(host, m->now_us);
        while (cube_read(host, &message)) {
            *(message.source == 0 ? &own : &others) += 1;
            cube_release(host);
        }
    }
    assert_true(own > 1000 && others > 1000);
    destroy(m);
}

/* Nor where its own messages are of four frames, and those that pass of one. */
TEST(small_messages_leave_room_for_a_large_one) {
    static const uint8_t large[CUBE_PAYLOAD_MAX];
    struct host_sim_cube_options slow = perfect;
    struct cube_config c = {.window = 7, .frame_payload = 408, .staging = 2};
    struct cube_message message;
    unsigned own = 0, others = 0;
    slow.wire.bytes_per_s = 100000;
    struct machine *m = build(2, &c, &slow, 1);
    for (unsigned i = 0; i < 50000; i++) {
        m->now_us += 100;
        for (unsigned k = 0; k < m->nodes; k++) {
            struct cube *node = m->places[k].cube;
            cube_poll(node, m->now_us);
            cube_write(node, CUBE_HOST, 1, large, k == 0 ? sizeof large : 40);
        }
        struct cube *host = m->places[m->nodes].cube;
        cube_poll(host, m->now_us);
        while (cube_read(host, &message)) {
            *(message.source == 0 ? &own : &others) += 1;
            cube_release(host);
        }
    }
    assert_true(own > 100 && others > 200);
    destroy(m);
}

TEST(a_wrong_wire_is_named) {
    struct cube_config c = {.window = 2};
    struct machine *m = build(3, &c, &perfect, 1);
    /* Ends of the wires 5-1 and 3-7 in dimension 2 are exchanged. */
    struct place *five = &m->places[5], *seven = &m->places[7];
    struct link_pipe pipe = five->config.pipes[2];
    five->config.pipes[2] = seven->config.pipes[2];
    seven->config.pipes[2] = pipe;
    free(five->arena);
    free(seven->arena);
    open_place(m, 5);
    open_place(m, 7);
    for (unsigned i = 0; i < 1000; i++) {
        m->now_us += 100;
        for (unsigned k = 0; k < m->count; k++)
            cube_poll(m->places[k].cube, m->now_us);
    }
    assert_true(cube_link_state(five->cube, 2) == LINK_REFUSED);
    const struct link_peer *peer = cube_link_peer(five->cube, 2);
    assert_true(peer->refusal == LINK_WRONG_WIRE);
    assert_int_equal(peer->node, 3);
    assert_int_equal(peer->port, 2);
    assert_true(cube_link_state(five->cube, 1) == LINK_UP);
    /* All four ends are known at the host, and everywhere. */
    static const char *const said[] = {
        "node 1 link 2 is wired to node 7, expected node 5",
        "node 3 link 2 is wired to node 5, expected node 7",
        "node 5 link 2 is wired to node 3, expected node 1",
        "node 7 link 2 is wired to node 1, expected node 3"};
    char text[CUBE_FAULT_BYTES];
    for (unsigned k = 0; k < m->count; k++) {
        const struct cube_wiring *w = cube_wiring(m->places[k].cube);
        assert_int_equal(w->wrong_count, 4);
        assert_true(cube_wiring_fault(m->places[k].cube, text));
        assert_string_equal(text, said[0]);
        for (unsigned i = 0; i < 4; i++) {
            cube_wrong_text(&w->wrong[i], &m->places[k].config, text);
            assert_string_equal(text, said[i]);
        }
    }
    destroy(m);
}

TEST(wrong_wires_in_words) {
    static const struct {
        struct cube_wrong wrong;
        const char *text;
    } cases[] = {
        {{1000, 7, 9, 2, LINK_WRONG_WIRE},
         "node 1000 link 9 is wired to node 7, expected node 488"},
        {{5, 1, 2, 0, LINK_WRONG_WIRE},
         "node 5 link 2 is wired to node 1 link 0, expected link 2"},
        {{0, 3, 10, 1, LINK_WRONG_WIRE},
         "node 0 link 10 is wired to node 3, expected the host"},
        {{6, CUBE_HOST, 10, 0, LINK_WRONG_WIRE},
         "node 6 link 10 is wired to the host link 0, expected link 1"},
        {{CUBE_HOST, 3, 0, 1, LINK_WRONG_WIRE},
         "the host link 0 is wired to node 3, expected node 0"},
        {{CUBE_HOST, 3, 1, 1, LINK_WRONG_WIRE},
         "the host link 1 is wired to node 3, expected node 6"},
        {{2, 3, 0, 0, LINK_WRONG_VERSION},
         "node 2 link 0: node 3 has another protocol version, expected 2"},
        {{2, 3, 0, 0, LINK_WRONG_GREETING},
         "node 2 link 0: node 3 has another cube dimension, expected 10"},
        {{2, 3, 0, 0, LINK_WRONG_SIZES},
         "node 2 link 0: node 3 has other sizes of frames or messages"},
    };
    static const struct cube_config spare = {.dimension = 10, .spare_node = 6};
    char text[CUBE_FAULT_BYTES];
    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        cube_wrong_text(&cases[i].wrong, &spare, text);
        assert_string_equal(text, cases[i].text);
    }
    static const struct cube_config four = {.dimension = 10, .host_ports = 4};
    static const struct cube_wrong port = {3, CUBE_HOST, 10, 2,
                                           LINK_WRONG_WIRE};
    static const struct cube_wrong at_host = {CUBE_HOST, 2, 3, 10,
                                              LINK_WRONG_WIRE};
    cube_wrong_text(&port, &four, text);
    assert_string_equal(
        text, "node 3 link 10 is wired to the host link 2, expected link 3");
    cube_wrong_text(&at_host, &four, text);
    assert_string_equal(text,
                        "the host link 3 is wired to node 2, expected node 3");
}

static bool starts(const struct cube_config *config) {
    size_t bytes = cube_arena_bytes(config), room = 1 << 21;
    void *arena = aligned_alloc(64, room);
    assert_non_null(arena);
    struct cube *cube = cube_init(arena, room, config);
    assert_true(bytes <= room && (cube != NULL) == (bytes > 0));
    assert_true((cube != NULL) == (cube_config_fault(config) == NULL));
    if (cube != NULL)
        assert_null(cube_init(arena, bytes - 1, config));
    free(arena);
    return cube != NULL;
}

/* That a field may have the one value, and may not have the other. */
#define limit(config, field, good, bad)                                        \
    do {                                                                       \
        struct cube_config c_ = config;                                        \
        c_.field = good;                                                       \
        assert_true(starts(&c_));                                              \
        c_.field = bad;                                                        \
        assert_false(starts(&c_));                                             \
    } while (0)

TEST(limits_of_a_config) {
    struct sim_end nowhere = {NULL, NULL, NULL};
    struct link_pipe pipe = sim_pipe(&nowhere), none = {NULL, NULL, NULL};
    struct cube_config node = {
        .self = 3, .dimension = 2, .window = 4, .epoch = 1};
    for (unsigned d = 0; d < CUBE_LINKS_MAX; d++)
        node.pipes[d] = pipe;
    struct cube_config host = node;
    host.self = CUBE_HOST;
    limit(node, self, 3, 4);
    limit(node, self, CUBE_HOST, CUBE_HOST - 1);
    limit(node, dimension, CUBE_DIMENSION_MAX, CUBE_DIMENSION_MAX + 1);
    limit(node, dimension, 2, 255);
    limit(node, window, 1, 0);
    limit(node, window, LINK_WINDOW_MAX, LINK_WINDOW_MAX + 1);
    limit(node, epoch, UINT32_MAX, 0);
    limit(node, pipes[1], pipe, none);
    limit(host, pipes[0], pipe, none);
    limit(host, spare_node, 3, 4);
    limit(host, host_ports, 4, 3);
    limit(host, host_ports, 4, 8); /* of 4 nodes */
    limit(host, gateway, 0, 3);
    limit(host, host_window, LINK_WINDOW_MAX, LINK_WINDOW_MAX + 1);
    limit(node, frame_payload, 1608, 1612);
    limit(node, frame_payload, LINK_FRAME_PAYLOAD_MAX,
          LINK_FRAME_PAYLOAD_MAX + 8);
    limit(node, frame_payload, 408, 400); /* a message of 1,608, 4 frames */
    limit(node, staging, LINK_WINDOW_MAX, LINK_WINDOW_MAX + 1);
    host.dimension = CUBE_DIMENSION_MAX;
    limit(host, host_ports, CUBE_HOST_PORTS_MAX, 2 * CUBE_HOST_PORTS_MAX);
    host.host_ports = 4;
    limit(host, spare_node, 0, 1);
    limit(host, gateway, 3, 4);
    host.host_ports = 0;
    host.spare_node = 3;
    limit(host, gateway, 3, 2);
    host.gateway = 2;
    assert_string_equal(cube_config_fault(&host), "gateway has no host port");
    host.window = 0;
    host.gateway = 3;
    assert_string_equal(cube_config_fault(&host),
                        "window is not 1 .. 64 frames");
    node.host_ports = 4;
    assert_true(starts(&node));
}

TEST(all_say_farewell) {
    struct cube_config c = {.window = 2};
    struct machine *m = build(3, &c, &perfect, 1);
    run(m, 3, 100000000);
    uint64_t deadline = m->now_us + 1000000;
    for (unsigned i = 0; i < m->count; i++)
        cube_close(m->places[i].cube, deadline);
    for (unsigned i = 0; i < 100; i++) {
        m->now_us += 1000;
        for (unsigned k = 0; k < m->count; k++)
            cube_poll(m->places[k].cube, m->now_us);
    }
    for (unsigned i = 0; i < m->count; i++)
        for (unsigned d = 0; d < cube_links(m->places[i].cube); d++)
            assert_true(cube_link_state(m->places[i].cube, d) == LINK_CLOSED);
    destroy(m);
}
