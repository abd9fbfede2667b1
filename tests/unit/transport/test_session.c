/* Peers that come, go and come again: handshake, restart, wrong wires,
 * farewell, and the bytes that PROTOCOL.md promises. */
#include "link_pair.h"

/* --- peers that come, go and come again ----------------------------------- */

TEST(a_cut_wire_goes_on_where_it_was) {
    for (uint64_t seed = 0; seed < 20; seed++) {
        struct pair *p = new_pair(&small, &perfect, seed);
        p->ends[0].size_max = p->ends[1].size_max = 1608;
        p->ends[0].most = p->ends[1].most = 400;
        for (unsigned i = 0; i < 20000 && !finished(p); i++) {
            uint64_t phase = (i + seed) % 90;
            if (phase == 60)
                cut_pair(p, true);
            else if (phase == 61 + seed)
                cut_pair(p, false);
            step(p, 150);
            if (phase > 61 && phase < 61 + seed)
                assert_true(link_state(p->ends[0].link) == LINK_DOWN);
        }
        assert_true(finished(p));
        const struct link_statistics *s = link_statistics(p->ends[0].link);
        assert_int_equal(s->sessions, 1);
        if (seed > 1)
            assert_true(s->resumed >= 1 && s->pipe_closed >= 1);
        free_pair(p);
    }
}

TEST(a_peer_that_stops_for_long_is_called_silent) {
    struct pair *p = new_pair(&small, &perfect, 2);
    for (unsigned i = 0; i < 200; i++)
        step(p, 100);
    for (unsigned i = 0; i < 1000; i++) { /* ten seconds */
        p->now_us += 10000;
        link_poll(p->ends[0].link, p->now_us);
    }
    assert_true(link_state(p->ends[0].link) == LINK_SILENT);
    assert_true(link_statistics(p->ends[0].link)->retransmitted < 40);
    run(p, p->ends[0].written + 50, 100, 5000000);
    assert_true(link_state(p->ends[0].link) == LINK_UP);
    assert_int_equal(link_statistics(p->ends[0].link)->sessions, 1);
    free_pair(p);
}

/* End 1 starts again; the other must notice and begin a session without
 * anything of the old one. */
static void restart(struct pair *p, uint32_t epoch,
                    struct link_statistics *sum) {
    struct end *peer = &p->ends[0], *reborn = &p->ends[1];
    uint64_t sessions = link_statistics(peer->link)->sessions;
    start(p, 1, epoch);
    reborn->written = reborn->read = 0;
    reborn->most = 0;
    unsigned i;
    for (i = 0; link_statistics(peer->link)->sessions == sessions; i++) {
        assert_true(i < 100000);
        p->now_us += 100;
        link_poll_receive(peer->link, p->now_us);
        struct link_message message;
        while (link_read(peer->link, &message)) {
            /* What was whole when the old session ended is still read. */
            size_t size = size_of(reborn, 1, peer->read);
            assert_int_equal(message.size, size);
            link_release(peer->link);
            peer->read++;
        }
        if (link_statistics(peer->link)->sessions == sessions)
            write_some(peer, 0);
        link_poll_send(peer->link, p->now_us);
        assert_false(link_read(reborn->link, &message));
        link_poll(reborn->link, p->now_us);
    }
    sum->messages_dropped = link_statistics(peer->link)->messages_dropped;
    /* Both begin anew: 0's queue is empty by now. */
    peer->written = peer->read = 0;
    reborn->most = UINT32_MAX;
}

TEST(a_restarted_peer_is_noticed) {
    struct host_sim_cube_options bad = perfect;
    bad.wire.latency_us = 3000;
    bad.faults.chance[SIM_DELETE] = 2e-4;
    for (uint64_t seed = 0; seed < 20; seed++) {
        struct pair *p = new_pair(&small, seed % 2 ? &bad : &perfect, seed);
        struct link_statistics sum = {0};
        p->ends[0].size_max = p->ends[1].size_max = 1608;
        for (unsigned life = 1; life < 6; life++) {
            while (p->ends[0].written < 40 + 9 * seed)
                step(p, 100);
            restart(p, 77777 * life + (uint32_t)seed, &sum);
        }
        run(p, p->ends[0].written + 50, 100, 60000000);
        assert_true(sum.messages_dropped > 0);
        assert_int_equal(link_statistics(p->ends[0].link)->sessions, 6);
        free_pair(p);
    }
}

static void greet_only(struct pair *p) {
    for (unsigned i = 0; i < 50; i++) {
        p->now_us += 10000;
        for (unsigned who = 0; who < 2; who++)
            link_poll(p->ends[who].link, p->now_us);
    }
}

/* One end keeps to its peer, and both are up. */
static struct pair *new_loyal_pair(void) {
    struct link_config loyal = small;
    loyal.keeps_peer = true;
    struct pair *p = new_pair(&small, &perfect, 3);
    p->ends[0].config = loyal;
    start(p, 0, 77);
    run(p, 50, 100, 1000000000);
    return p;
}

/* Three ends: a third one in the place of the second. */
TEST(an_end_may_keep_to_its_peer) {
    struct pair *p = new_loyal_pair();
    struct end other = p->ends[1];
    p->ends[1].memory = NULL;
    /* Another start of that end: it is told, again and again, and the session
     * is not touched. */
    start(p, 1, 99);
    for (unsigned i = 0; i < 25000; i++) {
        p->now_us += 100;
        for (unsigned who = 0; who < 2; who++)
            link_poll(p->ends[who].link, p->now_us);
    }
    assert_int_equal(link_peer(p->ends[1].link)->refusal, LINK_IN_USE);
    assert_int_equal(link_state(p->ends[1].link), LINK_REFUSED);
    assert_int_equal(link_statistics(p->ends[0].link)->sessions, 1);
    assert_int_equal(link_peer(p->ends[0].link)->epoch, other.config.epoch);
    assert_true(link_statistics(p->ends[0].link)->hellos_sent < 100);
    struct end third = p->ends[1];
    p->ends[1] = other;
    p->ends[1].link = other.link;
    run(p, 80, 100, 1000000000);
    assert_int_equal(link_statistics(p->ends[0].link)->sessions, 1);
    /* The first is gone for good: after a time the other has the link. */
    p->ends[1] = third;
    for (unsigned i = 0; i < 35000; i++) {
        p->now_us += 100;
        for (unsigned who = 0; who < 2; who++)
            link_poll(p->ends[who].link, p->now_us);
        bool up = link_state(p->ends[1].link) == LINK_UP;
        assert_true(!up || i > 29000);
    }
    assert_int_equal(link_state(p->ends[1].link), LINK_UP);
    assert_int_equal(link_statistics(p->ends[0].link)->sessions, 2);
    free(other.memory);
    free_pair(p);
}

/* One that was told so does not slip in when that end starts again: whom it
 * kept to has time to come back. */
TEST(who_is_sent_away_waits_for_the_other) {
    struct pair *p = new_loyal_pair();
    struct end first = p->ends[1];
    p->ends[1].memory = NULL;
    start(p, 1, 99);
    for (unsigned i = 0; link_peer(p->ends[1].link)->in_use == 0; i++) {
        assert_true(i < 1000);
        step(p, 100);
    }
    start(p, 0, 78);
    for (unsigned i = 0; i < 32000; i++) {
        p->now_us += 100;
        for (unsigned who = 0; who < 2; who++)
            link_poll(p->ends[who].link, p->now_us);
        bool up = link_state(p->ends[1].link) == LINK_UP;
        assert_true(!up || i > 29000);
    }
    assert_int_equal(link_state(p->ends[1].link), LINK_UP);
    free(first.memory);
    free_pair(p);
}

TEST(a_wrong_wire_is_named) {
    struct pair *p = new_pair(&small, &perfect, 1);
    p->ends[1].config.node = 99;
    /* start() sets who it is: another node, by hand. */
    struct link_config c = p->ends[1].config;
    c.node = 99;
    p->ends[1].link = link_init(p->ends[1].memory, p->ends[1].bytes, &c);
    greet_only(p);
    const struct link_peer *peer = link_peer(p->ends[0].link);
    assert_true(link_state(p->ends[0].link) == LINK_REFUSED);
    assert_true(peer->refusal == LINK_WRONG_WIRE);
    assert_int_equal(peer->node, 99);
    assert_int_equal(peer->port, 2);
    assert_true(link_state(p->ends[1].link) == LINK_REFUSED);
    /* Wired right at last: no restart of this end is needed. */
    start(p, 1, 4242);
    run(p, 20, 100, 5000000);
    assert_true(link_state(p->ends[0].link) == LINK_UP);
    free_pair(p);
}

TEST(sizes_that_do_not_fit_are_refused) {
    struct pair *p = new_pair(&small, &perfect, 1);
    p->ends[1].config.frame_payload = 168;
    start(p, 1, 4242);
    greet_only(p);
    assert_true(link_state(p->ends[0].link) == LINK_REFUSED);
    assert_true(link_peer(p->ends[0].link)->refusal == LINK_WRONG_SIZES);
    free_pair(p);
}

/* Its own bytes come back: the plug is in both sockets of one port. */
TEST(a_wire_to_itself_is_refused) {
    struct pair *p = new_pair(&small, &perfect, 1);
    struct sim_end *end = host_sim_cube_port(&p->cube, 0, 0)->end;
    end->in = end->out;
    greet_only(p);
    assert_true(link_state(p->ends[0].link) == LINK_REFUSED);
    assert_int_equal(link_peer(p->ends[0].link)->node, 10);
    free_pair(p);
}

TEST(farewell) {
    for (uint64_t seed = 0; seed < 20; seed++) {
        struct host_sim_cube_options bad = perfect;
        bad.faults.chance[SIM_DELETE] = seed % 2 ? 0.002 : 0;
        struct pair *p = new_pair(&small, &bad, seed);
        p->ends[0].size_max = p->ends[1].size_max = 300;
        p->ends[0].most = 40;
        p->ends[1].most = 0;
        for (unsigned i = 0; i < 3; i++)
            step(p, 100);
        p->ends[0].most = p->ends[0].written;
        link_close(p->ends[0].link, p->now_us + 10000000);
        for (unsigned i = 0; i < 90000; i++) {
            step(p, 100);
            if (link_state(p->ends[0].link) == LINK_CLOSED)
                break;
        }
        assert_true(link_state(p->ends[1].link) == LINK_CLOSED);
        assert_int_equal(p->ends[1].read, p->ends[0].most);
        /* Another start of the closed end is welcome. */
        start(p, 0, 31 + (uint32_t)seed);
        p->ends[0].written = p->ends[1].read = 0;
        run(p, 10, 100, 60000000);
        free_pair(p);
    }
}

/* The other end's farewell comes before this one has begun its own, on a wire
 * with room for it, or for less than the answer. */
TEST(farewells_that_cross_are_answered) {
    for (unsigned held = 0; held < 2; held++) {
        struct pair *p = new_pair(&small, &perfect, 1);
        p->ends[0].most = p->ends[1].most = 0;
        for (unsigned i = 0; i < 50; i++)
            step(p, 100);
        struct link *one = p->ends[0].link, *other = p->ends[1].link;
        struct sim_direction *out =
            host_sim_cube_port(&p->cube, 1, 0)->end->out;
        uint64_t deadline = p->now_us + 10000000;
        uint32_t room = out->quality.room;
        link_close(one, deadline);
        link_close(other, deadline);
        link_poll(one, p->now_us);
        p->now_us += 1000;
        out->quality.room = held ? 5 : room;
        link_poll(other, p->now_us);
        assert_true(link_state(other) == (held ? LINK_CLOSING : LINK_CLOSED));
        out->quality.room = room;
        p->now_us += 1000;
        link_poll(other, p->now_us);
        assert_true(link_state(other) == LINK_CLOSED);
        p->now_us += 1000;
        link_poll(one, p->now_us);
        assert_true(link_state(one) == LINK_CLOSED);
        free_pair(p);
    }
}

TEST(farewell_to_the_dead_ends_in_time) {
    for (unsigned cut = 0; cut < 2; cut++) {
        struct pair *p = new_pair(&small, &perfect, 1);
        for (unsigned i = 0; i < 50; i++)
            step(p, 100);
        if (cut)
            cut_pair(p, true);
        uint64_t deadline = p->now_us + 300000;
        link_close(p->ends[0].link, deadline);
        while (link_state(p->ends[0].link) != LINK_CLOSED) {
            uint64_t due = link_next_due_us(p->ends[0].link, p->now_us);
            assert_true(p->now_us <= deadline && due <= 300000);
            p->now_us += due > 0 ? due : 1;
            link_poll(p->ends[0].link, p->now_us);
        }
        free_pair(p);
    }
}

/* --- what is not sent yet ------------------------------------------------- */

/* End 0 forgets what it has not begun to send; what arrives is whole, and the
 * count is right. */
TEST(what_is_unsent_is_forgotten) {
    struct host_sim_cube_options slow = perfect;
    struct link_message message;
    slow.wire.bytes_per_s = 100000;
    slow.wire.room = 100;
    for (uint64_t seed = 0; seed < 40; seed++) {
        struct pair *p = new_pair(&small, &slow, seed);
        struct end *from = &p->ends[0], *to = &p->ends[1];
        uint8_t bytes[LINK_MESSAGE_MAX] = {0};
        unsigned written = 0, forgotten = 0, read = 0;
        for (unsigned i = 0; i < 3000; i++) {
            size_t size = 1 + mix((uint32_t)seed * 3000 + i) % 1600;
            memset(bytes, (uint8_t)size, size);
            p->now_us += 200;
            written +=
                i < 2000 && link_write(from->link, bytes, size, NULL, 0) == 0;
            if (i % (20 + seed) == 19)
                forgotten += link_forget_unsent(from->link);
            link_poll(from->link, p->now_us);
            link_poll(to->link, p->now_us);
            while (link_read(to->link, &message)) {
                memset(bytes, (uint8_t)message.size, message.size);
                assert_memory_equal(message.data, bytes, message.size);
                link_release(to->link);
                read++;
            }
        }
        assert_true(forgotten > 20 && read > 20 && link_idle(from->link));
        assert_int_equal(read + forgotten, written);
        assert_int_equal(link_statistics(from->link)->messages_dropped,
                         forgotten);
        free_pair(p);
    }
}

/* --- test vectors --------------------------------------------------------- */

/* What one end hears is written by hand; what it says is looked at. */
struct script {
    const uint8_t *hear;
    size_t left;
    uint8_t said[256];
    size_t size;
};

static int script_receive(void *context, uint8_t *bytes, size_t size) {
    struct script *s = context;
    size = size < s->left ? size : s->left;
    if (size == 0)
        return 0;
    memcpy(bytes, s->hear, size);
    s->hear += size;
    s->left -= size;
    return (int)size;
}

static int script_send(void *context, const uint8_t *bytes, size_t size) {
    struct script *s = context;
    assert_true(s->size + size <= sizeof s->said);
    memcpy(s->said + s->size, bytes, size);
    s->size += size;
    return (int)size;
}

static void hear(struct script *s, struct link *link, const uint8_t *bytes,
                 size_t size) {
    s->hear = bytes;
    s->left = size;
    s->size = 0;
    link_poll(link, 1000);
    assert_int_equal(s->left, 0);
}

/* Those of PROTOCOL.md, which another program made. */
static const uint8_t hello_5[] = {
    0x03, 0x01, 0x08, 0x01, 0x01, 0x01, 0x03, 0x44, 0x33, 0x01, 0x02,
    0x18, 0x06, 0x02, 0x23, 0x02, 0x02, 0x05, 0x02, 0x01, 0x07, 0x02,
    0x04, 0x44, 0x33, 0x22, 0x11, 0x01, 0x01, 0x01, 0x02, 0x08, 0x05,
    0x48, 0x06, 0x48, 0x06, 0x01, 0x05, 0x08, 0x1d, 0x80, 0x55, 0x00};
static const uint8_t hello_1[] = {
    0x00, 0x03, 0x01, 0x08, 0x01, 0x01, 0x01, 0x03, 0xfe, 0xff, 0x01, 0x02,
    0x18, 0x06, 0x36, 0x8f, 0x02, 0x02, 0x01, 0x02, 0x05, 0x05, 0x02, 0x04,
    0xfe, 0xff, 0x01, 0x06, 0x44, 0x33, 0x22, 0x11, 0x08, 0x05, 0x48, 0x06,
    0x48, 0x06, 0x01, 0x05, 0x27, 0xbd, 0xd0, 0xf3, 0x00};
static const uint8_t ack_5[] = {0x0b, 0x03, 0x08, 0xcc, 0x41, 0xc0, 0x42,
                                0x44, 0x33, 0xfe, 0xff, 0x01, 0x07, 0x69,
                                0x2d, 0x17, 0xc1, 0x8b, 0x3d, 0x00};
static const uint8_t ack_1[] = {0x00, 0x0b, 0x03, 0x08, 0x8f, 0x87, 0x96,
                                0xfb, 0xfe, 0xff, 0x44, 0x33, 0x01, 0x07,
                                0x20, 0xdc, 0x80, 0x96, 0xdc, 0x71, 0x00};
static const uint8_t data_1[] = {
    0x00, 0x0c, 0x02, 0x08, 0x8f, 0x87, 0x96, 0xfb, 0xfe, 0xff, 0x44,
    0x33, 0x0c, 0x04, 0x99, 0x68, 0x05, 0x02, 0x01, 0x02, 0x22, 0x0b,
    0xe7, 0x3f, 0x70, 0x61, 0x67, 0x65, 0xae, 0x72, 0x77, 0xef, 0x00,
    0x0c, 0x02, 0x08, 0x8f, 0x87, 0x96, 0xfb, 0xff, 0xff, 0x44, 0x33,
    0x08, 0x04, 0xb4, 0xea, 0x05, 0x02, 0x01, 0x02, 0x22, 0x07, 0xe7,
    0x3f, 0xd1, 0xfe, 0xac, 0xe7, 0x00};
static const uint8_t sack_5[] = {0x0c, 0x03, 0x08, 0xcc, 0x41, 0xc0, 0x42,
                                 0x44, 0x33, 0xfe, 0xff, 0x08, 0x04, 0xfd,
                                 0x42, 0x01, 0x01, 0x01, 0x01, 0x01, 0x01,
                                 0x01, 0x05, 0x31, 0xb1, 0x89, 0x83, 0x00};
static const uint8_t ack_all_5[] = {0x09, 0x03, 0x08, 0xcc, 0x41, 0xc0, 0x42,
                                    0x44, 0x33, 0x01, 0x01, 0x01, 0x07, 0x34,
                                    0x0c, 0xda, 0xea, 0x50, 0x11, 0x00};
static const uint8_t state_5[] = {
    0x09, 0x25, 0x08, 0xcc, 0x41, 0xc0, 0x42, 0x44, 0x33, 0x01, 0x02, 0x1b,
    0x04, 0xb0, 0x0b, 0x03, 0x01, 0x01, 0x05, 0xfe, 0xca, 0xad, 0x0b, 0x01,
    0x04, 0x01, 0x02, 0x01, 0x02, 0x06, 0x02, 0xff, 0x01, 0x03, 0x01, 0x05,
    0x04, 0x02, 0x02, 0x03, 0x06, 0x02, 0xe3, 0x6b, 0x8f, 0x73, 0x00};
static const uint8_t wiring_5[] = {0x03, 0x00, 0x00, 0x00, 0xfe, 0xca, 0xad,
                                   0x0b, 0x00, 0x00, 0x01, 0x02, 0x01, 0x00,
                                   0x06, 0x00, 0xff, 0x00, 0x00, 0x01, 0x05,
                                   0x00, 0x02, 0x02, 0x03, 0x00, 0x02};
static const uint8_t bye_1[] = {0x00, 0x07, 0x24, 0x08, 0x8f, 0x87, 0x96,
                                0xfb, 0x01, 0x03, 0x44, 0x33, 0x01, 0x07,
                                0xb6, 0xaf, 0x77, 0x35, 0x4c, 0x98, 0x00};

/* Node 1 of epoch 0xfffe answers node 5 of epoch 0x11223344 on port 2. */
TEST(test_vectors) {
    const uint8_t head[8] = {5, 0, 1, 0, 34, 0, 0xe7, 0x3f};
    struct link_message datagram;
    bool ask;
    struct script s = {.left = 0};
    struct link_config c = {.pipe = {&s, script_send, script_receive},
                            .epoch = 0xfffe,
                            .node = 1,
                            .port = 2,
                            .peer_node = 5,
                            .peer_port = 2,
                            .greeting = 4,
                            .window = 8,
                            .message_max = 1608};
    void *memory = malloc(link_bytes(&c));
    struct link *link = link_init(memory, link_bytes(&c), &c);
    assert_non_null(link);
    hear(&s, link, hello_5, sizeof hello_5);
    assert_memory_equal(s.said, hello_1, sizeof hello_1);
    assert_int_equal(s.size, sizeof hello_1);
    hear(&s, link, ack_5, sizeof ack_5);
    assert_true(link_state(link) == LINK_UP);
    assert_int_equal(s.size, sizeof ack_1);
    assert_memory_equal(s.said, ack_1, sizeof ack_1);
    assert_int_equal(link_write(link, head, 8, "page", 4), 0);
    assert_int_equal(link_write(link, head, 8, NULL, 0), 0);
    hear(&s, link, NULL, 0);
    assert_int_equal(s.size, sizeof data_1);
    assert_memory_equal(s.said, data_1, sizeof data_1);
    /* The second has arrived, so the first is lost: it goes again. */
    hear(&s, link, sack_5, sizeof sack_5);
    assert_int_equal(s.size, 33);
    assert_memory_equal(s.said, data_1, 33);
    hear(&s, link, ack_all_5, sizeof ack_all_5);
    assert_int_equal(s.size, 0);
    assert_true(link_idle(link));
    assert_false(link_take_datagram(link, &datagram, &ask));
    hear(&s, link, state_5, sizeof state_5);
    assert_int_equal(s.size, 0);
    assert_true(link_take_datagram(link, &datagram, &ask) && ask);
    assert_int_equal(datagram.size, sizeof wiring_5);
    assert_memory_equal(datagram.data, wiring_5, sizeof wiring_5);
    assert_int_equal(datagram.sequence, 0x3344);
    link_close(link, 100000);
    hear(&s, link, NULL, 0);
    assert_int_equal(s.size, sizeof bye_1);
    assert_memory_equal(s.said, bye_1, sizeof bye_1);
    free(memory);
}
