/* Links that move their frames while a message is being read, or while their
 * node has looked for room and not written yet: nothing of that changes under
 * it, whatever comes meanwhile, and all arrives. */
#include "cube_machine.h"

enum { TENDED = 3 }; /* times, while a message is held */

/* Which ways this end has room for a message. */
static uint64_t rooms(const struct machine *m, unsigned i) {
    uint64_t bits = 0;
    for (unsigned to = 0; to < m->count; to++) {
        const struct place *p = &m->places[to];
        if (to != i && cube_room(m->places[i].cube, p->self) > 0)
            bits |= (uint64_t)1 << to;
    }
    return bits;
}

/* The others go on, and this one's links are tended in the midst. */
static void tend(struct machine *m, unsigned i,
                 void (*others)(struct machine *m, unsigned i)) {
    struct cube *cube = m->places[i].cube;
    for (unsigned k = 0; k < TENDED; k++) {
        uint32_t generation = cube_wiring(cube)->generation;
        uint64_t room = rooms(m, i);
        m->now_us += 20 + draw(m) % 300;
        others(m, i);
        cube_tend(cube, m->now_us);
        assert_int_equal(cube_wiring(cube)->generation, generation);
        assert_int_equal(room & ~rooms(m, i), 0);
    }
}

static void others_step(struct machine *m, unsigned i) {
    for (unsigned k = 0; k < m->count; k++) {
        unsigned j = draw(m) % m->count;
        if (j != i)
            step(m, j);
    }
}

static void read_slowly(struct machine *m, unsigned i) {
    uint8_t bytes[CUBE_PAYLOAD_MAX];
    struct cube_message message;
    struct cube *cube = m->places[i].cube;
    cube_poll(cube, m->now_us);
    while (cube_read(cube, &message)) {
        take(m, i, &message);
        memcpy(bytes, message.data, message.size);
        tend(m, i, others_step);
        assert_memory_equal(message.data, bytes, message.size);
        cube_release(cube);
    }
    tend(m, i, others_step);
    give(m, i);
}

TEST(messages_being_read_stay) {
    for (unsigned k = 0; k < 24; k++) {
        struct cube_config c = {.window = (uint16_t)(k % 2 ? 2 : 5)};
        struct host_sim_cube_options wires = perfect;
        if (k % 3 == 1) {
            wires.faults.chance[SIM_FLIP] = 2e-5;
            wires.faults.chance[SIM_DELETE] = 1e-4;
        } else if (k % 3 == 2) { /* messages of several frames */
            cube_for_serial(&c, 921600);
        }
        struct machine *m = build(2 + k % 2, &c, &wires, k);
        uint64_t passed = 0;
        settle(m, 1);
        m->each = 20;
        m->broadcasts = 3;
        m->size_max = k % 4 < 2 ? CUBE_PAYLOAD_MAX : 40;
        while (!finished(m)) {
            assert_true(m->now_us < 1000000000);
            m->now_us += 50;
            unsigned i = draw(m) % m->count;
            read_slowly(m, i);
            others_step(m, i);
        }
        for (unsigned i = 0; i < m->nodes; i++)
            passed += cube_statistics(m->places[i].cube)->passed_on;
        assert_true(passed > 0);
        destroy(m);
    }
}

/* --- in the midst of work, generations end and nodes begin anew ----------- */

static uint64_t counts[2];

static void others_chatter(struct machine *m, unsigned i) {
    for (unsigned k = 0; k < m->count; k++) {
        unsigned j = draw(m) % m->count;
        if (j != i && !m->places[j].gone) {
            cube_poll(m->places[j].cube, m->now_us);
            chatter(m, j, true, counts);
        }
    }
    struct cube *host = m->places[m->nodes].cube;
    if (i != m->nodes && draw(m) % 20 == 0) {
        struct cube_wiring next = *cube_wiring(host);
        cube_renew(host, &next);
    }
    unsigned j = draw(m) % m->nodes;
    if (j != i && draw(m) % 100 == 0)
        reboot(m, j);
}

/* What was decided in a generation is written in it, and read in no other. */
TEST(work_stays_in_its_generation) {
    uint32_t words[8];
    uint64_t late = 0;
    for (unsigned k = 0; k < 10; k++) {
        struct cube_config c = {.window = 3};
        struct machine *m = build(3, &c, &perfect, k);
        settle(m, 1);
        for (unsigned round = 0; round < 1500; round++) {
            unsigned i = draw(m) % m->count;
            unsigned to = draw(m) % m->count;
            struct cube *cube = m->places[i].cube;
            struct cube_message message;
            cube_poll(cube, m->now_us);
            uint32_t generation = cube_wiring(cube)->generation;
            if (cube_read(cube, &message)) {
                tend(m, i, others_chatter);
                memcpy(words, message.data, 4);
                assert_int_equal(words[0], generation);
                cube_release(cube);
            }
            for (unsigned w = 0; w < 8; w++)
                words[w] = generation;
            bool room = to != i && cube_room(cube, m->places[to].self) > 0;
            tend(m, i, others_chatter);
            late += generation != wiring_of(m, m->nodes)->generation;
            int status = to == i ? 0
                                 : cube_write(cube, m->places[to].self, 1,
                                              words, sizeof words);
            assert_true(status == 0 || !room);
        }
        destroy(m);
    }
    assert_true(counts[READ] > 10000 && late > 1000);
}

/* The peer has said farewell: who has looked for room has it, until it polls.
 */
TEST(a_farewell_waits) {
    struct cube_config c = {.window = 2};
    struct machine *m = build(1, &c, &perfect, 1);
    settle(m, 1);
    struct cube *one = m->places[0].cube, *other = m->places[1].cube;
    for (unsigned i = 0; i < 20; i++)
        poll_all(m, 1000);
    cube_close(other, m->now_us + 10000000);
    for (unsigned i = 0; i < 200; i++) {
        m->now_us += 1000;
        cube_poll(other, m->now_us);
        cube_tend(one, m->now_us);
        assert_true(cube_link_state(one, 0) == LINK_UP);
        assert_true(cube_room(one, 1) > 0);
    }
    assert_int_equal(cube_write(one, 1, 0, "so", 2), 0);
    for (unsigned i = 0; i < 60; i++)
        poll_all(m, 1000);
    assert_true(cube_link_state(one, 0) == LINK_CLOSED);
    assert_true(cube_link_state(other, 0) == LINK_CLOSED);
    assert_int_equal(cube_room(one, 1), 0);
    destroy(m);
}
