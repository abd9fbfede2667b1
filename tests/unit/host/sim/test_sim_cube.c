/* The cube in memory: who is at the ends of each wire, that bytes come out
 * where they should, that what breaks is whole again when all that broke it is
 * taken back; and that every kind of fault can be drawn, strike and be counted.
 */

#include "host/sim/sim_cube.h"
#include "host/sim/sim_plan.h"
#include "tests/unit/test.h"

static const struct host_sim_cube_options plain = {
    .seed = 1,
    .wire = {.latency_us = 10, .room = 4000, .bytes = SIM_BYTES_MIN}};

static uint64_t now_us;

static void open_cube(struct host_sim_cube *cube,
                      const struct host_sim_cube_options *options) {
    struct host_error error = {0};
    now_us = 1000;
    assert_int_equal(host_sim_cube_open(cube, options, &now_us, &error), 0);
}

/* The byte that comes to that link, or nothing: -1; closed: -2. */
static int get(const struct host_sim_cube *cube, unsigned place,
               unsigned link) {
    uint8_t byte = 0;
    struct link_pipe pipe = host_sim_cube_pipe(cube, place, link);
    int got = pipe.receive(pipe.context, &byte, 1);
    return got == LINK_PIPE_CLOSED ? -2 : got == 0 ? -1 : byte;
}

static int put(const struct host_sim_cube *cube, unsigned place, unsigned link,
               uint8_t byte) {
    struct link_pipe pipe = host_sim_cube_pipe(cube, place, link);
    return pipe.send(pipe.context, &byte, 1);
}

/* A byte goes from one end to the other and nowhere else. */
static void check_wire(const struct host_sim_cube *cube, unsigned from,
                       unsigned link, unsigned to, unsigned to_link) {
    unsigned wire = host_sim_cube_wire(cube, from, link);
    assert_true(wire < cube->wires);
    assert_int_equal(wire, host_sim_cube_wire(cube, to, to_link));
    assert_int_equal(host_sim_cube_port(cube, from, link)->peer, to);
    assert_int_equal(put(cube, from, link, (uint8_t)(1 + from)), 1);
    now_us += 100;
    for (unsigned i = 0; i < cube->places; i++) {
        for (unsigned d = 0; d < host_sim_cube_links(cube, i); d++) {
            bool here = i == to && d == to_link;
            assert_int_equal(get(cube, i, d), here ? 1 + (int)from : -1);
        }
    }
}

TEST(every_wire_leads_where_it_should) {
    for (unsigned dimension = 0; dimension <= 5; dimension++) {
        struct host_sim_cube cube;
        struct host_sim_cube_options o = plain;
        o.dimension = dimension;
        open_cube(&cube, &o);
        assert_int_equal(cube.places, (1u << dimension) + 1);
        assert_int_equal(cube.wires, (dimension << dimension) / 2 + 1);
        for (unsigned i = 0; i < cube.nodes; i++) {
            assert_int_equal(host_sim_cube_links(&cube, i),
                             dimension + (i == 0));
            for (unsigned d = 0; d < dimension; d++)
                check_wire(&cube, i, d, i ^ 1u << d, d);
        }
        check_wire(&cube, 0, dimension, cube.nodes, 0);
        check_wire(&cube, cube.nodes, 0, 0, dimension);
        host_sim_cube_close(&cube);
    }
}

TEST(a_host_may_have_more_wires) {
    struct host_sim_cube cube;
    struct host_sim_cube_options o = plain;
    o.dimension = 3;
    o.host_ports = 4;
    open_cube(&cube, &o);
    for (unsigned k = 0; k < 4; k++)
        check_wire(&cube, 8, k, k, 3);
    host_sim_cube_close(&cube);
    o.host_ports = 0;
    o.spare_node = 6;
    open_cube(&cube, &o);
    check_wire(&cube, 8, 0, 0, 3);
    check_wire(&cube, 8, 1, 6, 3);
    assert_int_equal(host_sim_cube_links(&cube, 5), 3);
    host_sim_cube_close(&cube);
}

/* What breaks a wire twice must be taken back twice. */
TEST(a_wire_breaks_as_often_as_it_is_mended) {
    struct host_sim_cube cube;
    struct host_sim_cube_options o = plain;
    o.dimension = 2;
    open_cube(&cube, &o);
    unsigned wire = host_sim_cube_wire(&cube, 1, 1);
    for (unsigned k = 0; k < 2; k++) {
        host_sim_cube_cut(&cube, wire, true);
        host_sim_cube_deaf(&cube, wire, 0, true);
    }
    assert_int_equal(get(&cube, 3, 1), -2);
    host_sim_cube_cut(&cube, wire, false);
    assert_int_equal(put(&cube, 1, 1, 5), LINK_PIPE_CLOSED);
    host_sim_cube_cut(&cube, wire, false);
    for (unsigned k = 0; k < 3; k++) {
        assert_int_equal(put(&cube, 1, 1, 7), 1); /* side 0: it is lost */
        assert_int_equal(put(&cube, 3, 1, 9), 1);
        now_us += 100;
        assert_int_equal(get(&cube, 1, 1), 9);
        assert_int_equal(get(&cube, 3, 1), k < 2 ? -1 : 7);
        if (k < 2)
            host_sim_cube_deaf(&cube, wire, 0, false);
    }
    assert_int_equal(host_sim_cube_struck(&cube, SIM_CUT), 2);
    assert_int_equal(host_sim_cube_struck(&cube, SIM_DEAF), 2);
    host_sim_cube_leave_out(&cube, 0);
    assert_true(cube.wire[0].missing);
    assert_int_equal(put(&cube, 0, 0, 1), LINK_PIPE_CLOSED);
    host_sim_cube_close(&cube);
}

/* Node 0 sees the connection before break once, and has the other's bytes. */
TEST(one_host_is_connected_at_a_time) {
    struct host_sim_cube cube;
    struct host_sim_cube_options o = plain;
    o.dimension = 1;
    o.second_host = true;
    open_cube(&cube, &o);
    assert_int_equal(cube.places, 4);
    assert_int_equal(put(&cube, 2, 0, 4), 1);
    assert_int_equal(put(&cube, 3, 0, 4), LINK_PIPE_CLOSED);
    for (unsigned host = 1; host < 3; host++) {
        unsigned now = 2 + host % 2, before = 5 - now;
        host_sim_cube_cut(&cube, host_sim_cube_wire(&cube, before, 0), true);
        host_sim_cube_cut(&cube, host_sim_cube_wire(&cube, now, 0), false);
        host_sim_cube_connect(&cube, host % 2);
        assert_int_equal(put(&cube, 0, 1, 1), LINK_PIPE_CLOSED);
        assert_int_equal(get(&cube, 0, 1), -2);
        assert_int_equal(put(&cube, now, 0, 8), 1);
        assert_int_equal(put(&cube, before, 0, 4), LINK_PIPE_CLOSED);
        now_us += 100;
        assert_int_equal(get(&cube, 0, 1), 8);
        assert_int_equal(host_sim_cube_port(&cube, 0, 1)->peer, now);
    }
    host_sim_cube_close(&cube);
}

static unsigned woken;
static uint64_t woken_us;

static void wake(void *context, unsigned place, uint64_t us) {
    assert_ptr_equal(context, &woken);
    woken = place;
    woken_us = us;
}

/* Who is sent something is told when it comes; all that is sent is traced. */
TEST(bytes_wake_and_leave_a_trace) {
    struct host_sim_cube cube;
    struct host_sim_cube_options o = plain;
    uint64_t traces[3];
    o.dimension = 2;
    o.wake = wake;
    o.context = &woken;
    for (unsigned k = 0; k < 3; k++) {
        open_cube(&cube, &o);
        now_us += k == 2;
        assert_int_equal(put(&cube, 2, 0, 1), 1);
        assert_int_equal(woken, 3);
        assert_true(woken_us == now_us + 10);
        assert_int_equal(put(&cube, 0, 2, 6), 1);
        assert_int_equal(woken, 4);
        traces[k] = cube.trace;
        host_sim_cube_close(&cube);
    }
    assert_true(traces[0] == traces[1] && traces[0] != traces[2]);
}

/* Each row of the table can be drawn, and is, and says what it does. */
TEST(every_kind_of_fault_is_drawn) {
    unsigned wanted[HOST_SIM_FAULTS] = {0};
    for (uint64_t seed = 1; seed <= 400; seed++) {
        struct host_sim_plan plan;
        host_sim_plan_draw(&plan, seed, 0);
        for (int k = 0; k < HOST_SIM_FAULTS; k++)
            wanted[k] += plan.wanted[k];
    }
    for (int k = 0; k < HOST_SIM_FAULTS; k++) {
        const struct host_sim_kind *kind = &host_sim_kinds[k];
        assert_non_null(kind->name);
        assert_true(wanted[k] > 20);
        assert_false(kind->one_in > 0 && kind->draw != NULL);
        assert_true(kind->take_back == NULL || kind->happen != NULL);
        for (int other = 0; other < k; other++)
            assert_string_not_equal(kind->name, host_sim_kinds[other].name);
    }
}
