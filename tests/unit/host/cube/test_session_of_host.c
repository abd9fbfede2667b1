/* A host at a cube without a run: what nodes answer, who is told from whom,
 * what is gone round. */
#include "session_world.h"

static const struct place eight = {.dimension = 3, .seed = 1};
static const struct place boards = {.dimension = 3, .seed = 2, .bare = true};

TEST(nodes_say_who_they_are) {
    open_place(&eight);
    come();
    wait_for(all(), S);
    for (unsigned i = 0; i < 8; i++) {
        const struct host_session_node *node = &place.session.node[i];
        assert_int_equal(node->who.protocol, NODE_PROTOCOL);
        assert_int_equal(node->who.kind, NODE_KIND_PROCESS);
        assert_int_equal(node->who.memory, MEMORY);
        assert_int_equal(node->who.epoch,
                         place.world.node[i].board.identity.epoch);
        assert_int_equal(node->who.role, 0);
        assert_int_equal(node->starts, 1);
        assert_true(node->heard);
    }
    stay(2 * S);
    for (unsigned i = 0; i < 8; i++) {
        assert_int_equal(place.session.node[i].links, i == 0 ? 15 : 7);
        assert_true(place.session.node[i].heard);
    }
    close_place();
}

TEST_WITH(nodes_answer_all_questions, NULL, NULL) {
    struct node_link_state links[4];
    struct node_top top;
    struct node_ready_message memory;
    struct node_finished_message totals;
    struct node_probe probe;
    open_place(&eight);
    come();
    wait_for(all(), S);
    ask(all(), NODE_LINKS, 0, S);
    assert_int_equal(place.session.node[5].size, 3 * sizeof links[0]);
    memcpy(links, place.session.node[0].answer, sizeof links);
    for (unsigned d = 0; d < 4; d++) {
        assert_int_equal(links[d].state, LINK_UP);
        assert_int_equal(links[d].refusal, LINK_FITS);
        assert_int_equal(links[d].peer_node, d == 3 ? CUBE_HOST : 1u << d);
        assert_int_equal(links[d].dead, 0);
        assert_true(links[d].bytes_in > 0 && links[d].frames_out > 0);
    }
    ask(all(), NODE_TOP, 0, S);
    assert_int_equal(place.session.node[7].size, sizeof top);
    memcpy(&top, place.session.node[7].answer, sizeof top);
    assert_int_equal(top.memory, MEMORY);
    assert_in_range(top.used, 1000, MEMORY);
    assert_int_equal(top.role, 0);
    assert_true(top.bytes_in > 0 && top.wall_us > 0);
    ask(all(), NODE_MEMORY, 0, S);
    assert_int_equal(place.session.node[7].size, sizeof memory);
    memcpy(&memory, place.session.node[7].answer, sizeof memory);
    assert_int_equal(memory.map.memory, MEMORY);
    assert_int_equal(memory.role, 0);
    ask(all(), NODE_TOTALS, 0, S);
    memcpy(&totals, place.session.node[7].answer, sizeof totals);
    assert_int_equal(totals.start, place.world.node[7].board.identity.epoch);
    ask(all(), NODE_LOG, 0, S);
    assert_int_equal(place.session.node[3].size, 0);
    ask(all(), NODE_PROBE, 6, S);
    for (unsigned i = 0; i < 8; i++) {
        assert_int_equal(place.session.node[i].size, sizeof probe);
        memcpy(&probe, place.session.node[i].answer, sizeof probe);
        assert_int_equal(probe.node, 6);
        assert_in_range(probe.rtt_us, i == 6 ? 0 : 1, i == 6 ? 0 : 100000);
    }
    ask(only(2), 99, 0, S); /* of a later version of the host */
    assert_int_equal(place.session.node[2].size, 0);
    close_place();
}

TEST(a_probe_of_who_is_silent_ends) {
    struct node_probe probe;
    open_place(&eight);
    come();
    wait_for(all(), S);
    host_world_pause(&place.world, 5, 100 * S);
    uint64_t before = place.world.now_us;
    ask(only(4), NODE_PROBE, 5, 4 * S);
    memcpy(&probe, place.session.node[4].answer, sizeof probe);
    assert_int_equal(probe.rtt_us, UINT32_MAX);
    assert_in_range(place.world.now_us - before, NODE_PROBE_US,
                    NODE_PROBE_US + S);
    close_place();
}

TEST(the_next_host_comes_at_once) {
    open_place(&eight);
    for (unsigned k = 0; k < 5; k++) {
        come();
        wait_for(all(), S);
        uint64_t before = place.world.now_us;
        host_session_close(&place.session);
        assert_true(place.world.now_us - before < S / 2);
    }
    come();
    close_place();
}

TEST(a_host_that_vanished_is_waited_for) {
    open_place(&eight);
    come();
    wait_for(all(), S);
    struct host_session gone = place.session; /* no farewell */
    come();
    stay(2 * S);
    assert_true(place.session.in_use);
    assert_int_equal(there(&(struct host_node_set){{255}}), 0);
    char text[200];
    assert_non_null(
        strstr(host_session_reason(&place.session, 0, text, sizeof text),
               "other host"));
    wait_for(all(), 6 * S);
    assert_false(place.session.in_use);
    struct host_session now = place.session;
    place.session = gone;
    free(place.session.cube_memory);
    free(place.session.node);
    free(place.session.answers);
    free(place.session.dead);
    place.session = now;
    close_place();
}

TEST(starts_are_told_apart) {
    open_place(&eight);
    come();
    wait_for(all(), S);
    uint32_t epoch = place.session.node[3].who.epoch;
    host_world_crash(&place.world, 3, 10000, false);
    stay(3 * S);
    wait_for(all(), 2 * S);
    assert_int_equal(place.session.node[3].starts, 2);
    assert_int_not_equal(place.session.node[3].who.epoch, epoch);
    close_place();
}

TEST(nodes_restart_when_told) {
    struct host_node_set set = all();
    open_place(&boards);
    come();
    wait_for(all(), 4 * S);
    good(host_session_restart(&place.session, &set, NODE_RESTART_PLAIN,
                              &place.error));
    stay(3 * S);
    wait_for(all(), 6 * S);
    for (unsigned i = 0; i < 8; i++)
        assert_int_equal(place.session.node[i].starts, 2);
    close_place();
}

/* Nodes that have just begun are asked of their wires before these are up. */
TEST(wires_of_nodes_that_have_just_begun_are_waited_for) {
    struct host_node_set set = all();
    open_place(&boards);
    come();
    good(host_session_settle(&place.session, &set, 12 * S, &place.error));
    good(host_session_settle_wires(&place.session, 10 * S, &place.error));
    assert_int_equal(host_session_faults(&place.session, NULL, NULL), 0);
    good(host_session_restart(&place.session, &set, NODE_RESTART_PLAIN,
                              &place.error));
    stay(S);
    wait_for(all(), 8 * S);
    good(host_session_settle_wires(&place.session, 10 * S, &place.error));
    assert_int_equal(host_session_faults(&place.session, NULL, NULL), 0);
    uint64_t before = place.world.now_us;
    good(host_session_settle_wires(&place.session, 10 * S, &place.error));
    assert_in_range(place.world.now_us - before, 0, S / 100);
    pull(5, 1, true);
    stay(12 * S);
    before = place.world.now_us;
    good(host_session_settle_wires(&place.session, 10 * S, &place.error));
    assert_in_range(place.world.now_us - before, 0, S / 100);
    assert_int_equal(host_session_faults(&place.session, NULL, NULL), 1);
    close_place();
    open_place(&boards);
    host_sim_cube_leave_out(&place.world.cube, wire_of(5, 1));
    come();
    wait_for(all(), 12 * S);
    before = place.world.now_us;
    good(host_session_settle_wires(&place.session, 10 * S, &place.error));
    assert_int_equal(host_session_faults(&place.session, NULL, NULL), 1);
    assert_true(place.world.now_us - before < 5 * S);
    close_place();
}

/* A wire that is pulled, and put back. */
static void pull_and_put_back(const struct place *as, unsigned node,
                              unsigned link) {
    open_place(as);
    come();
    wait_for(all(), 4 * S);
    pull(node, link, true);
    stay(8 * S + as->dead_us);
    assert_int_equal(cube_wiring(place.session.cube)->dead_count, 1);
    ask(all(), NODE_LINKS, 0, S);
    pull(node, link, false);
    stay(10 * S);
    assert_int_equal(cube_wiring(place.session.cube)->dead_count, 0);
    ask(all(), NODE_LINKS, 0, S);
    for (unsigned i = 0; i < place.world.nodes; i++)
        assert_int_equal(place.session.node[i].starts, 1);
    close_place();
}

TEST(a_pulled_wire_is_gone_round) {
    struct place patient = eight;
    pull_and_put_back(&boards, 0, 1);
    pull_and_put_back(&boards, 5, 1);
    pull_and_put_back(&eight, 0, 0);
    patient.dead_us = 2 * S;
    pull_and_put_back(&patient, 2, 0);
}

TEST(a_wire_that_was_never_there) {
    open_place(&boards);
    host_sim_cube_leave_out(&place.world.cube, wire_of(0, 2));
    host_sim_cube_leave_out(&place.world.cube, wire_of(1, 1));
    come();
    wait_for(all(), 12 * S);
    stay(5 * S);
    assert_int_equal(cube_wiring(place.session.cube)->dead_count, 2);
    ask(all(), NODE_LINKS, 0, 2 * S);
    close_place();
}

/* A node that is off, and comes while the host is there. */
static void come_late(const struct place *as, unsigned node) {
    char text[300];
    open_place(as);
    host_world_late(&place.world, node, 30 * (uint64_t)S);
    come();
    struct host_node_set everyone = all();
    good(host_session_settle(&place.session, &everyone, 15 * S, &place.error));
    assert_true(place.world.now_us < 10 * S);
    wait_for(but(node), 0);
    assert_false(place.session.node[node].there);
    const char *why =
        host_session_reason(&place.session, node, text, sizeof text);
    assert_non_null(strstr(why, "; "));
    uint64_t before = place.world.now_us;
    good(host_session_ask(&place.session, &(struct host_node_set){{255}},
                          NODE_LINKS, 0, 5 * S, &place.error));
    assert_true(place.world.now_us - before < 4 * S);
    stay(30 * S - place.world.now_us);
    wait_for(all(), 15 * S);
    close_place();
}

TEST(a_node_that_is_off) {
    come_late(&eight, 7);
    come_late(&eight, 1);
    come_late(&boards, 4);
    come_late(&boards, 3);
}

TEST(a_cube_of_one) {
    const struct place one = {.dimension = 0, .seed = 5, .bare = true};
    open_place(&one);
    come();
    wait_for(all(), 2 * S);
    ask(all(), NODE_PROBE, 0, S);
    close_place();
}

TEST(a_node_that_loses_power_and_comes_back) {
    open_place(&boards);
    come();
    wait_for(all(), 4 * S);
    host_world_crash(&place.world, 1, 20 * (uint64_t)S, false);
    stay(10 * S);
    ask(but(1), NODE_LINKS, 0, 2 * S);
    assert_false(place.session.node[1].heard);
    stay(10 * S);
    wait_for(all(), 12 * S);
    stay(5 * S);
    assert_int_equal(place.session.node[1].starts, 2);
    ask(all(), NODE_LINKS, 0, 2 * S);
    close_place();
}
