/* What the question of a node that does not know who it is does to a link, in
 * each of its states: a greeting goes out, and nothing else is as it was not.
 */
#include "link_pair.h"

#include "transport/gossip.h"

/* End 1 asks, as one that has only just begun. */
static void ask(struct pair *p) {
    struct learner learner;
    struct link_pipe pipe = host_sim_cube_pipe(&p->cube, 1, 0);
    learner_init(&learner, &pipe, 1);
    learner_ask(&learner, p->now_us);
}

/* Asked ten times a second for a second, end 0 stays in its state and greets
 * each time; asked a hundred times more, it greets 20 times a second. */
static void stays(struct pair *p, enum link_state state) {
    struct link *link = p->ends[0].link;
    struct link_statistics before = *link_statistics(link);
    struct link_peer peer = *link_peer(link);
    assert_int_equal(link_state(link), state);
    for (unsigned ms = 0; ms < 2000; ms++) {
        if (ms >= 1000 || ms % 100 == 0)
            ask(p);
        p->now_us += 1000;
        link_poll(link, p->now_us);
        sim_direction_flush(host_sim_cube_port(&p->cube, 1, 0)->end->in);
        assert_true(link_state(link) == state ||
                    (state == LINK_UP && link_state(link) == LINK_SILENT));
    }
    const struct link_statistics *after = link_statistics(link);
    uint64_t hellos = after->hellos_sent - before.hellos_sent;
    assert_true(hellos >= 29 && hellos <= 45);
    assert_int_equal(after->sessions, before.sessions);
    assert_int_equal(after->resumed, before.resumed);
    assert_int_equal(after->messages_dropped, before.messages_dropped);
    assert_int_equal(after->messages_received, before.messages_received);
    assert_int_equal(after->bad_code + after->bad_header + after->bad_crc,
                     before.bad_code + before.bad_header + before.bad_crc);
    assert_memory_equal(link_peer(link), &peer, sizeof peer);
}

static struct pair *talking(const struct link_config *config) {
    struct pair *p = new_pair(config, &perfect, 5);
    p->ends[0].size_max = p->ends[1].size_max = 300;
    p->ends[0].most = p->ends[1].most = 20;
    for (unsigned i = 0; i < 300; i++)
        step(p, 1000);
    assert_true(finished(p));
    return p;
}

TEST(a_link_that_opens) {
    struct pair *p = new_pair(&small, &perfect, 1);
    link_poll(p->ends[0].link, p->now_us);
    stays(p, LINK_OPENING);
    run(p, 20, 100, 1000000);
    free_pair(p);
}

TEST(a_link_that_is_up) {
    for (unsigned keeps = 0; keeps < 2; keeps++) {
        struct link_config config = small;
        config.keeps_peer = keeps > 0;
        struct pair *p = talking(&config);
        stays(p, LINK_UP);
        run(p, 40, 100, 1000000);
        assert_int_equal(link_statistics(p->ends[0].link)->sessions, 1);
        assert_int_equal(link_statistics(p->ends[1].link)->sessions, 1);
        assert_int_equal(link_statistics(p->ends[1].link)->resumed, 0);
        p->now_us += 10000000;
        link_poll(p->ends[0].link, p->now_us);
        p->now_us += 10000000;
        link_poll(p->ends[0].link, p->now_us);
        stays(p, LINK_SILENT);
        free_pair(p);
    }
}

TEST(a_link_that_refuses) {
    struct pair *p = new_pair(&small, &perfect, 1);
    p->ends[1].config.frame_payload = 168;
    start(p, 1, 4242);
    for (unsigned i = 0; i < 50; i++) {
        p->now_us += 1000;
        link_poll(p->ends[0].link, p->now_us);
        link_poll(p->ends[1].link, p->now_us);
    }
    stays(p, LINK_REFUSED);
    free_pair(p);
}

/* Its peer has said farewell, and is reset then. */
TEST(a_link_that_is_closed) {
    struct pair *p = talking(&small);
    link_close(p->ends[1].link, p->now_us + 1000000);
    for (unsigned i = 0; i < 50; i++)
        step(p, 1000);
    stays(p, LINK_CLOSED);
    /* The new start is welcome. */
    start(p, 1, 31);
    p->ends[0].written = p->ends[0].read = 0;
    p->ends[1].written = p->ends[1].read = 0;
    run(p, 10, 100, 1000000);
    free_pair(p);
}

/* This end says farewell, and nobody answers. */
TEST(a_link_that_closes) {
    struct pair *p = talking(&small);
    link_close(p->ends[0].link, p->now_us + 60000000);
    link_poll(p->ends[0].link, p->now_us);
    stays(p, LINK_CLOSING);
    free_pair(p);
}

/* Nothing comes by a pipe that is closed; what comes when it works again finds
 * a link that greets as ever. */
TEST(a_link_that_is_down) {
    struct pair *p = talking(&small);
    cut_pair(p, true);
    link_poll(p->ends[0].link, p->now_us);
    ask(p);
    link_poll(p->ends[0].link, p->now_us);
    assert_int_equal(link_state(p->ends[0].link), LINK_DOWN);
    cut_pair(p, false);
    link_poll(p->ends[0].link, p->now_us);
    stays(p, LINK_OPENING);
    run(p, 40, 100, 1000000);
    assert_int_equal(link_statistics(p->ends[0].link)->sessions, 1);
    free_pair(p);
}
