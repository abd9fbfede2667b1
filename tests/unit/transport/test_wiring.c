/* The wiring of a cube: whatever the order in which ends hear of things, all
 * come to the same; its bytes are those of PROTOCOL.md. */

#include "transport/routes.h"
#include "tests/unit/test.h"

enum { DIMENSION = 4, NODES = 16 };

static uint64_t state = 88172645463325252u;

static uint32_t draw(uint32_t below) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32) % below;
}

static void find_something(struct cube_wiring *w) {
    struct cube_dead dead = {(uint16_t)draw(NODES),
                             (uint8_t)draw(DIMENSION + 1)};
    struct cube_wrong wrong = {(uint16_t)draw(NODES), (uint16_t)draw(NODES),
                               (uint8_t)draw(4), (uint8_t)draw(4),
                               (uint8_t)(1 + draw(3))};
    if (draw(2) == 0)
        (void)wiring_add_dead(w, dead, DIMENSION);
    else
        (void)wiring_add_wrong(w, wrong);
}

/* Ends that find things and tell each other at random agree in the end, on
 * what one would know that had been told all at once. */
TEST(all_come_to_the_same) {
    enum { ENDS = 6 };
    for (unsigned round = 0; round < 500; round++) {
        struct cube_wiring ends[ENDS], all;
        memset(ends, 0, sizeof ends);
        struct cube_dead settled = {(uint16_t)draw(NODES), CUBE_WHOLE_NODE};
        for (unsigned i = 0; i < ENDS; i++) {
            ends[i].generation = 5;
            (void)wiring_add_dead(&ends[i], settled, DIMENSION);
            wiring_settle(&ends[i], DIMENSION);
        }
        all = ends[0];
        for (unsigned i = 0; i < 40; i++) {
            struct cube_wiring *end = &ends[draw(ENDS)];
            find_something(end);
            (void)wiring_merge(&all, end, DIMENSION);
            (void)wiring_merge(&ends[draw(ENDS)], end, DIMENSION);
        }
        for (unsigned i = 0; i < 2 * ENDS; i++) {
            (void)wiring_merge(&ends[(i + 1) % ENDS], &ends[i % ENDS],
                               DIMENSION);
        }
        for (unsigned i = 0; i < ENDS; i++) {
            assert_true(wiring_same(&ends[i], &all));
            assert_false(wiring_merge(&ends[i], &all, DIMENSION));
        }
        assert_true(all.dead_count <= CUBE_DEAD_MAX);
        assert_int_equal(all.settled, 1);
    }
}

TEST(what_is_newer_wins_entirely) {
    for (unsigned round = 0; round < 500; round++) {
        struct cube_wiring a, b;
        memset(&a, 0, sizeof a);
        memset(&b, 0, sizeof b);
        a.generation = draw(3);
        b.generation = draw(3);
        a.host_epoch = draw(3);
        b.host_epoch = draw(3);
        for (unsigned i = 0; i < 10; i++)
            find_something(draw(2) ? &a : &b);
        struct cube_wiring a_was = a;
        bool same = !wiring_newer(&a, &b) && !wiring_newer(&b, &a);
        assert_false(wiring_newer(&a, &b) && wiring_newer(&b, &a));
        (void)wiring_merge(&a, &b, DIMENSION);
        if (!same) {
            assert_true(
                wiring_same(&a, wiring_newer(&a_was, &b) ? &a_was : &b));
        }
        (void)wiring_merge(&b, &a, DIMENSION);
        assert_true(wiring_same(&a, &b));
    }
}

/* Around the circle: what follows is later, whatever its number. */
TEST(generations_go_round) {
    static const uint32_t far[] = {
        1,          2,          0x7fff,     0x8000,     0xffff,    0x10000,
        0x7fffffff, 0x80000000, 0x80000001, 0xfffffffe, 0xffffffff};
    enum { FAR = sizeof far / sizeof far[0] };
    for (unsigned i = 0; i < FAR; i++) {
        uint32_t a = far[i], next = wiring_next(a);
        assert_true(next != 0 && wiring_after(next, a));
        assert_false(wiring_after(a, next) || wiring_after(a, a));
        assert_true(wiring_after(a, 0) && !wiring_after(0, a));
        for (unsigned k = 0; k < FAR; k++) {
            uint32_t b = far[k];
            assert_true(wiring_after(a, b) + wiring_after(b, a) == (i != k));
        }
    }
    assert_true(wiring_after(5, 0xffffffff) && wiring_after(0x70000000, 5));
    assert_false(wiring_after(0xffffffff, 5) || wiring_after(0, 0));
}

/* Of PROTOCOL.md's message. */
TEST(a_stamp_stands_for_generation_and_host) {
    struct cube_wiring a = {.generation = 1, .host_epoch = 0x0badcafe}, b = a;
    assert_int_equal(wiring_stamp(&a), 0x3fe7);
    b.generation = 0x10001;
    assert_int_not_equal(wiring_stamp(&b), 0x3fe7);
    b.generation = 1;
    b.host_epoch++;
    assert_int_not_equal(wiring_stamp(&b), 0x3fe7);
}

TEST(a_node_whose_links_are_dead_is_one_entry) {
    struct cube_wiring w;
    memset(&w, 0, sizeof w);
    for (unsigned d = 0; d < DIMENSION; d++) {
        struct cube_dead dead = {6, (uint8_t)d};
        assert_true(wiring_add_dead(&w, dead, DIMENSION));
        assert_false(wiring_add_dead(&w, dead, DIMENSION));
        dead.node = (uint16_t)(6u ^ 1u << d); /* the same by its other end */
        assert_false(wiring_add_dead(&w, dead, DIMENSION));
    }
    struct cube_dead another = {0, 3}, host_port = {0, DIMENSION};
    assert_true(wiring_add_dead(&w, another, DIMENSION));
    assert_true(wiring_add_dead(&w, host_port, DIMENSION));
    assert_int_equal(w.dead_count, 6);
    wiring_settle(&w, DIMENSION);
    assert_int_equal(w.dead_count, 3);
    assert_int_equal(w.settled, 3);
    assert_int_equal(w.dead[0].node, 6);
    assert_int_equal(w.dead[0].dimension, CUBE_WHOLE_NODE);
    for (unsigned d = 0; d < DIMENSION; d++) {
        assert_true(wiring_is_dead(&w, 3, 6, d, DIMENSION));
        assert_true(wiring_is_dead(&w, 3, 6u ^ 1u << d, d, DIMENSION));
    }
    assert_true(wiring_is_dead(&w, 3, 0, DIMENSION, DIMENSION));
    assert_false(wiring_is_dead(&w, 3, 1, 1, DIMENSION));
    assert_false(wiring_add_dead(&w, (struct cube_dead){7, 0}, DIMENSION));
}

/* That of PROTOCOL.md, which another program made. */
static const uint8_t vector[] = {3, 0, 0, 0, 0xfe, 0xca, 0xad, 0x0b, 0,
                                 0, 1, 2, 1, 0,    6,    0,    0xff, 0,
                                 0, 1, 5, 0, 2,    2,    3,    0,    2};

/* The gateway may lose every link between nodes and still have its host's wire.
 */
TEST(a_gateway_lives_while_its_hosts_wire_does) {
    struct cube_wiring w = {.generation = 2, .gateway = 4};
    for (unsigned d = 0; d < DIMENSION; d++) {
        struct cube_dead dead = {4, (uint8_t)d};
        assert_true(wiring_add_dead(&w, dead, DIMENSION));
    }
    wiring_settle(&w, DIMENSION);
    assert_int_equal(w.dead_count, DIMENSION);
    for (unsigned i = 0; i < w.dead_count; i++)
        assert_int_not_equal(w.dead[i].dimension, CUBE_WHOLE_NODE);
    w.gateway = 0;
    wiring_settle(&w, DIMENSION);
    assert_int_equal(w.dead_count, 1);
    assert_int_equal(w.dead[0].dimension, CUBE_WHOLE_NODE);
}

TEST(its_bytes) {
    struct cube_wiring w, again;
    uint8_t bytes[WIRING_BYTES_MAX + 1];
    assert_true(wiring_unpack(&w, vector, sizeof vector, 3));
    assert_int_equal(w.generation, 3);
    assert_int_equal(w.host_epoch, 0x0badcafe);
    assert_int_equal(w.gateway, 0);
    assert_int_equal(w.settled, 1);
    assert_int_equal(w.dead_count, 2);
    assert_int_equal(w.wrong_count, 1);
    assert_int_equal(w.dead[0].node, 6);
    assert_int_equal(w.dead[0].dimension, CUBE_WHOLE_NODE);
    assert_int_equal(w.dead[1].dimension, 1);
    assert_int_equal(w.wrong[0].node, 5);
    assert_int_equal(w.wrong[0].link, 2);
    assert_int_equal(w.wrong[0].refusal, LINK_WRONG_WIRE);
    assert_int_equal(w.wrong[0].peer_node, 3);
    assert_int_equal(w.wrong[0].peer_link, 2);
    assert_int_equal(wiring_pack(&w, bytes), sizeof vector);
    assert_memory_equal(bytes, vector, sizeof vector);
    for (unsigned i = 0; i < 30; i++)
        find_something(&w);
    size_t size = wiring_pack(&w, bytes);
    assert_true(size <= WIRING_BYTES_MAX);
    assert_true(wiring_unpack(&again, bytes, size, DIMENSION));
    assert_true(wiring_same(&w, &again));
    /* Of another length, or of another cube. */
    assert_false(wiring_unpack(&again, bytes, size - 1, DIMENSION));
    assert_false(wiring_unpack(&again, bytes, size + 1, DIMENSION));
    assert_false(wiring_unpack(&again, vector, 5, 3));
    assert_false(wiring_unpack(&again, vector, sizeof vector, 2));
    memcpy(bytes, vector, sizeof vector);
    bytes[10] = 3; /* more settled than there are */
    assert_false(wiring_unpack(&again, bytes, sizeof vector, 3));
    bytes[10] = 0;
    bytes[8] = 8; /* no such gateway */
    assert_false(wiring_unpack(&again, bytes, sizeof vector, 3));
}
