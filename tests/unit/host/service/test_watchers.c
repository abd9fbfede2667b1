/* Those who watch a run ask all the time, and change nothing of what comes
 * out: the simulated cube of service_world.h, in virtual time. */
#include "host/service/watchers.h"
#include "service_world.h"

enum {
    SECOND = 1000000,
    LATE_US = 2100000, /* of answers, and a round of the service */
    EVERY_US = 50000
};

/* One who has the next question at once. */
static struct {
    bool asked;
    uint32_t questions, answers, finished, sizes[NODE_QUESTIONS + 1];
    uint64_t asked_us, longest_us, committed, tetrahedra;
    enum node_question what;
    struct host_node_set nodes, answered;
} watcher;

static bool ask(void *context, uint64_t now_us,
                struct host_watchers_question *question) {
    (void)context;
    assert_false(watcher.asked);
    watcher.asked = true;
    watcher.asked_us = now_us;
    watcher.what =
        (enum node_question)(NODE_WHO + watcher.questions++ % NODE_LOG);
    memset(&watcher.answered, 0, sizeof watcher.answered);
    question->what = watcher.what;
    question->nodes = watcher.nodes;
    return true;
}

static void answer(void *context, unsigned node, const uint8_t *data,
                   size_t size) {
    (void)context, (void)data;
    assert_true(watcher.asked);
    assert_true(host_node_set_has(&watcher.nodes, node));
    assert_false(host_node_set_has(&watcher.answered, node));
    host_node_set_add(&watcher.answered, node);
    watcher.answers++;
    watcher.sizes[watcher.what] = (uint32_t)size;
}

static void answered(void *context, uint64_t now_us,
                     const struct host_watchers_progress *progress) {
    uint64_t took_us = now_us - watcher.asked_us;
    (void)context;
    assert_true(watcher.asked);
    assert_true(progress->committed <= progress->bricks);
    assert_true(progress->committed >= watcher.committed);
    watcher.asked = false;
    watcher.finished++;
    watcher.committed = progress->committed;
    watcher.tetrahedra = progress->tetrahedra;
    watcher.longest_us =
        took_us > watcher.longest_us ? took_us : watcher.longest_us;
}

static const char *holder(void *context) {
    (void)context;
    return "incode run a.xyz, process 12 of alice";
}

static const struct host_watchers watchers = {NULL, ask, answer, answered,
                                              holder};

static int set_up(void **unused) {
    (void)unused;
    begin_runs(16000);
    return 0;
}

static void watch(void) {
    prepare();
    memset(&watcher, 0, sizeof watcher);
    host_node_set_all(&watcher.nodes, NODES);
    world.watchers = &watchers;
}

TEST(test_each_strategy) {
    static const struct host_strategy *const strategies[] = {
        &host_sequential, &host_spatial, &host_exchange};
    for (size_t k = 0; k < sizeof strategies / sizeof strategies[0]; k++) {
        watch();
        survives(strategies[k]);
        assert_int_equal(result.generations, 1);
        assert_true(watcher.finished > 0);
        assert_true(watcher.finished + 1 >= watcher.questions);
        assert_true(watcher.answers >= NODES * watcher.finished);
        assert_int_equal(watcher.sizes[NODE_WHO], sizeof(struct node_who));
        assert_true(watcher.longest_us < SECOND);
        assert_true(watcher.questions <= world.sim.now_us / EVERY_US + 1);
    }
}

/* Who starts again has forgotten what it was asked, and is asked again; who is
 * gone is left out. */
TEST(test_losses) {
    static const enum what events[] = {RESTART, KILL, CUT};
    for (unsigned k = 0; k < 12; k++) {
        unsigned tenths = 1 + k / 3;
        watch();
        world.events[0] =
            (struct event){events[k % 3], 0.1 * tenths, 1 + k % 7, k % 3};
        survives(k % 2 == 0 ? &host_spatial : &host_sequential);
        assert_true(watcher.finished > 0);
        assert_true(watcher.longest_us <= LATE_US);
    }
}

/* A part of the nodes, and one question alone: the others hear nothing. */
TEST(test_some) {
    watch();
    memset(&watcher.nodes, 0, sizeof watcher.nodes);
    host_node_set_add(&watcher.nodes, 5);
    survives(&host_spatial);
    assert_true(watcher.answers >= watcher.finished);
    assert_true(watcher.answers <= watcher.questions);
}

/* Nobody asks: to the microsecond the same run as where nobody can. */
static bool asks_not(void *context, uint64_t now_us,
                     struct host_watchers_question *question) {
    (void)context, (void)now_us, (void)question;
    watcher.questions++;
    return false;
}

TEST(test_nobody) {
    static const struct host_watchers nobody = {NULL, asks_not, answer,
                                                answered, holder};
    uint64_t took_us[2], before = state;
    for (unsigned k = 0; k < 2; k++) {
        watch();
        state = before;
        world.watchers = k == 0 ? NULL : &nobody;
        survives(&host_spatial);
        took_us[k] = world.sim.now_us;
    }
    assert_int_equal(took_us[0], took_us[1]);
    assert_true(watcher.questions > 0);
    assert_true(watcher.questions <= took_us[1] / EVERY_US + 1);
}

TEST_GROUP(set_up, end_runs)
