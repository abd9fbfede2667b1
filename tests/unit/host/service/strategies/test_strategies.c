/* Each strategy's functions by themselves: roles, first jobs, next jobs,
 * commits, and what a loss leaves; and what holds for every row of the table.
 */
#include <math.h>

#include "begun_strategy.h"

/* The box is that of the job's points, or of their region. */
static void check_box(const struct incode_job *job) {
    for (uint32_t v = job->first * INCODE_BRICK_POINTS;
         v < job->last * INCODE_BRICK_POINTS; v++) {
        double p[3];
        host_vertex(&order, v, p);
        for (int k = 0; k < 3; k++)
            assert_true(job->lo[k] <= p[k] && p[k] <= job->hi[k]);
    }
}

static void commit_all(const struct host_strategy *strategy, unsigned node,
                       const struct incode_job *job) {
    for (uint32_t b = job->first; b < job->last; b++)
        assert_int_equal(strategy->commit(&work, node, b), 0);
    assert_int_equal(host_ledger_finish(&ledger, node), 0);
}

TEST(test_sequential) {
    const struct host_strategy *s = &host_sequential;
    struct incode_job job, none;
    assert_int_equal(s->regions(1), 1);
    begin(s);
    assert_int_equal(order.regions, 1);
    assert_string_equal(roles(s), "whhh");
    assert_true(s->first(&work, 0, &job));
    assert_int_equal(job.first, 0);
    assert_int_equal(job.last, order.bricks);
    check_box(&job);
    (void)give(0, &job);
    for (unsigned i = 1; i < NODES; i++)
        assert_false(s->first(&work, i, &none));
    for (unsigned i = 0; i < NODES; i++)
        assert_false(s->next(&work, i, &none));
    /* Bricks 0 to 4 are done when node 0 is lost: the rest is node 1's, whole,
     * and no node holds pages any more. */
    for (uint32_t b = 0; b < 5; b++)
        assert_int_equal(s->commit(&work, 0, b), 0);
    lose(s, 0);
    assert_string_equal(roles(s), "wwww");
    for (unsigned i = 1; i < NODES; i++)
        assert_false(s->first(&work, i, &none));
    assert_false(s->next(&work, 2, &none));
    assert_false(s->next(&work, 3, &none));
    assert_true(s->next(&work, 1, &job));
    assert_int_equal(job.first, 5);
    assert_int_equal(job.last, order.bricks);
    check_box(&job);
    (void)give(1, &job);
    assert_false(s->next(&work, 1, &none));
    commit_all(s, 1, &job);
    assert_int_equal(ledger.committed, order.bricks);
    end();
}

TEST(test_spatial_first) {
    const struct host_strategy *s = &host_spatial;
    struct incode_job job, none;
    begin(s);
    assert_int_equal(order.regions, NODES);
    assert_string_equal(roles(s), "wwww");
    for (unsigned i = 0; i < NODES; i++) {
        const struct host_region *region = &order.region[i];
        assert_true(s->first(&work, i, &job));
        assert_int_equal(job.first, region->first);
        assert_int_equal(job.last, region->last);
        assert_memory_equal(job.lo, region->lo, sizeof job.lo);
        assert_memory_equal(job.hi, region->hi, sizeof job.hi);
        check_box(&job);
        (void)give(i, &job);
    }
    for (unsigned i = 0; i < NODES; i++)
        assert_false(s->next(&work, i, &none));
    /* A brick is for its own node to commit, once. */
    assert_int_equal(s->commit(&work, 1, 0), -1);
    assert_int_equal(s->commit(&work, 0, 0), 0);
    assert_int_equal(s->commit(&work, 0, 0), -1);
    end();
}

/* After a loss everybody takes of what is left, and all of it is done; two
 * ranges a node, or one where it is alone. */
TEST(test_spatial_loss) {
    const struct host_strategy *s = &host_spatial;
    for (unsigned gone = 1; gone < NODES; gone++) {
        struct incode_job job;
        unsigned given = 0;
        begin(s);
        for (unsigned i = 0; i < NODES; i++) {
            assert_true(s->first(&work, i, &job));
            (void)give(i, &job);
        }
        assert_int_equal(s->commit(&work, 2, order.region[2].first), 0);
        for (unsigned i = 0; i < gone; i++)
            lose(s, i);
        assert_string_equal(roles(s), "wwww");
        assert_false(s->first(&work, NODES - 1, &job));
        unsigned turn = gone;
        uint32_t most = 0;
        while (s->next(&work, turn, &job)) {
            check_box(&job);
            most = job.last - job.first > most ? job.last - job.first : most;
            (void)give(turn, &job);
            commit_all(s, turn, &job);
            turn = turn + 1 < NODES ? turn + 1 : gone;
            given++;
        }
        assert_int_equal(ledger.committed, order.bricks);
        assert_true(given >= NODES);
        unsigned living = NODES - gone;
        assert_true(living == 1 ||
                    most <= (order.bricks - 1) / (2 * living) + 1);
        end();
    }
}

/* Nothing is done, and nodes only start again: each has its region again. */
TEST(test_spatial_restart) {
    const struct host_strategy *s = &host_spatial;
    struct incode_job job;
    begin(s);
    assert_true(s->first(&work, 0, &job));
    uint32_t before = give(0, &job);
    s->lose(&work);
    assert_false(host_ledger_current(&ledger, 0, before));
    for (unsigned i = 0; i < NODES; i++) {
        assert_true(s->first(&work, i, &job));
        assert_int_equal(job.first, order.region[i].first);
        assert_int_equal(job.last, order.region[i].last);
    }
    end();
}

/* Who builds for the manager, one bit each. */
static unsigned builders_of(const struct host_strategy *strategy,
                            unsigned manager) {
    struct node_setup_message setup = {0};
    strategy->set_up(&work, manager, &setup);
    assert_int_equal(setup.role, NODE_MANAGER);
    assert_true(setup.faces_per_job > 0 && setup.jobs_per_worker > 0);
    unsigned builders = setup.builders[0];
    for (unsigned i = 0; i < NODES; i++) {
        struct node_setup_message other = {0};
        strategy->set_up(&work, i, &other);
        if ((builders >> i & 1) != 0) {
            assert_int_equal(other.role, NODE_BUILDER);
            assert_int_equal(other.manager, manager);
            assert_int_equal(other.jobs_per_worker, setup.jobs_per_worker);
        }
    }
    return builders;
}

TEST(test_master_slaves) {
    const struct host_strategy *s = &host_master_slaves;
    struct incode_job job, none;
    begin(s);
    assert_string_equal(roles(s), "mbbb");
    assert_int_equal(builders_of(s, 0), 14);
    work.sharing = (struct host_sharing){.builders = 2};
    assert_string_equal(roles(s), "mhbb"); /* who does not build keeps pages */
    assert_int_equal(builders_of(s, 0), 12);
    work.sharing =
        (struct host_sharing){.faces_per_job = 7, .jobs_per_worker = 5};
    struct node_setup_message setup = {0};
    s->set_up(&work, 0, &setup);
    assert_int_equal(setup.faces_per_job, 7);
    assert_int_equal(setup.jobs_per_worker, 5);
    work.sharing = (struct host_sharing){0};
    assert_true(s->first(&work, 0, &job));
    assert_int_equal(job.first, 0);
    assert_int_equal(job.last, order.bricks);
    check_box(&job);
    (void)give(0, &job);
    for (unsigned i = 0; i < NODES; i++) {
        assert_false(i > 0 && s->first(&work, i, &none));
        assert_false(s->next(&work, i, &none));
    }
    /* Without its builder it goes on with two, and what is committed stays. */
    assert_int_equal(s->commit(&work, 0, 0), 0);
    lose(s, 2);
    assert_string_equal(roles(s), "mbwb");
    assert_int_equal(builders_of(s, 0), 10);
    assert_false(s->first(&work, 0, &job));
    assert_true(s->next(&work, 0, &job));
    assert_int_equal(job.first, 1);
    (void)give(0, &job);
    /* Without its manager, the next one is it; the last one works alone. */
    lose(s, 0);
    assert_string_equal(roles(s), "wmwb");
    assert_int_equal(builders_of(s, 1), 8);
    assert_false(s->next(&work, 3, &none));
    lose(s, 1);
    assert_string_equal(roles(s), "wwww");
    assert_true(s->next(&work, 3, &job));
    (void)give(3, &job);
    commit_all(s, 3, &job);
    assert_int_equal(ledger.committed, order.bricks);
    end();
}

TEST(test_hybrid) {
    const struct host_strategy *s = &host_hybrid;
    struct incode_job job, none;
    begin(s);
    assert_int_equal(order.regions, NODES);
    assert_string_equal(roles(s), "mbbb");
    work.sharing = (struct host_sharing){.cluster = 2};
    assert_string_equal(roles(s), "mbmb");
    assert_int_equal(builders_of(s, 0), 2);
    assert_int_equal(builders_of(s, 2), 8);
    for (unsigned i = 0; i < NODES; i += 2) {
        assert_true(s->first(&work, i, &job));
        assert_int_equal(job.first, order.region[i].first);
        assert_int_equal(job.last, order.region[i + 1].last);
        check_box(&job);
        (void)give(i, &job);
        assert_false(s->first(&work, i + 1, &none));
    }
    for (unsigned i = 0; i < NODES; i++)
        assert_false(s->next(&work, i, &none));
    assert_int_equal(s->commit(&work, 0, 0), 0);
    /* Nodes only start again: the managers share what is left. */
    s->lose(&work);
    assert_string_equal(roles(s), "mbmb");
    assert_false(s->first(&work, 0, &none));
    assert_false(s->next(&work, 1, &none));
    assert_true(s->next(&work, 2, &job));
    /* After a loss clusters go on with whom they have left. */
    lose(s, 1);
    assert_string_equal(roles(s), "wwmb");
    assert_int_equal(builders_of(s, 2), 8);
    assert_false(s->next(&work, 3, &none));
    for (unsigned i = 0; s->next(&work, i, &job); i = 2 - i) {
        (void)give(i, &job);
        commit_all(s, i, &job);
    }
    assert_int_equal(ledger.committed, order.bricks);
    end();
    /* A lost manager is followed by its first builder, */
    begin(s);
    lose(s, 0);
    assert_string_equal(roles(s), "wmbb");
    assert_false(s->next(&work, 2, &none));
    assert_true(s->next(&work, 1, &job));
    /* and a cluster without nodes by none. */
    work.sharing = (struct host_sharing){.cluster = 2};
    lose(s, 1);
    assert_string_equal(roles(s), "wwmb");
    assert_true(s->next(&work, 2, &job));
    end();
}

static void check_refused(const struct host_strategy *s, unsigned nodes,
                          struct host_sharing sharing,
                          enum incode_face_rule rule, const char *text) {
    struct host_error error = {0};
    assert_int_equal(s->check(nodes, &sharing, rule, &error),
                     text == NULL ? 0 : HOST_USAGE);
    assert_true(text == NULL || strstr(error.text, text) != NULL);
}

TEST(test_refusals) {
    static const struct host_strategy *const rows[] = {&host_master_slaves,
                                                       &host_hybrid};
    const struct host_sharing none = {0};
    for (unsigned i = 0; i < 2; i++) {
        const struct host_strategy *s = rows[i];
        check_refused(s, 1, none, INCODE_FACE_OWN, "--nodes 2");
        check_refused(s, 2, none, INCODE_FACE_OWN, NULL);
        check_refused(s, 8, none, INCODE_FACE_PAPER, "--face-rule paper");
        check_refused(s, 4, (struct host_sharing){.builders = 3},
                      INCODE_FACE_OWN, NULL);
        check_refused(s, 4, (struct host_sharing){.builders = 4},
                      INCODE_FACE_OWN, "--builders 4");
    }
    const struct host_strategy *s = &host_hybrid;
    check_refused(s, 8, (struct host_sharing){.cluster = 8}, INCODE_FACE_OWN,
                  NULL);
    check_refused(s, 8, (struct host_sharing){.cluster = 3}, INCODE_FACE_OWN,
                  "--cluster 3");
    check_refused(s, 8, (struct host_sharing){.cluster = 16}, INCODE_FACE_OWN,
                  "--cluster 16");
    check_refused(s, 8, (struct host_sharing){.cluster = 2, .builders = 2},
                  INCODE_FACE_OWN, "--builders 2");
}

/* The first node that is given bricks at the beginning, and its job; NODES: a
 * strategy that gives none. */
static unsigned first_with_bricks(const struct host_strategy *s,
                                  struct incode_job *job) {
    unsigned node = 0;
    while (node < NODES &&
           !(s->first(&work, node, job) && job->first + 2 <= job->last))
        node++;
    return node;
}

/* What comes of a brick that is not committed goes with a loss. */
TEST(test_lost_tetrahedra) {
    unsigned tried = 0;
    for (unsigned r = 0; host_strategy_row(r) != NULL; r++) {
        const struct host_strategy *s = host_strategy_row(r);
        struct host_error error = {0};
        struct incode_job job;
        begin(s);
        unsigned node = first_with_bricks(s, &job);
        if (node == NODES) {
            end();
            continue;
        }
        tried++;
        (void)give(node, &job);
        uint32_t v = job.first * INCODE_BRICK_POINTS; /* of its first brick */
        uint32_t(*row)[4] = host_tetrahedra_room(&tets, 2, &error);
        assert_non_null(row);
        for (uint32_t i = 0; i < 4; i++) {
            row[0][i] = v + i;
            row[1][i] = v + INCODE_BRICK_POINTS + i;
        }
        host_tetrahedra_keep(&tets, 2);
        assert_int_equal(host_ledger_found(work.ledger, 0, 2, &error), 0);
        assert_int_equal(s->commit(&work, node, job.first + 1), 0);
        s->lose(&work);
        assert_int_equal(tets.count, 1);
        assert_int_equal(tets.v[0][0], v + INCODE_BRICK_POINTS);
        end();
    }
    assert_true(tried > 0);
}

/* The memory that is asked for does for every role that a strategy gives, and
 * is no more than one of them needs. */
TEST(test_arena) {
    const struct node_identity identity = {.dimension = 2, .epoch = 1};
    const struct node_setup_message given = {.setup = {.bricks = 100}};
    const struct host_sharing sharing = {0};
    for (unsigned r = 0; host_strategy_row(r) != NULL; r++) {
        const struct host_strategy *s = host_strategy_row(r);
        size_t bytes = host_strategy_arena(s, NODES, &identity, 1u << 20,
                                           &sharing, &given);
        bool needed = false;
        begin(s);
        for (unsigned i = 0; i <= NODES; i++) {
            struct node_setup_message setup = given;
            work.living = i < NODES ? NODES : 1; /* all others were lost */
            setup.nodes = NODES;
            setup.setup.owner_rule = (uint8_t)s->owner_rule;
            s->set_up(&work, i % NODES, &setup);
            size_t one = node_arena_needed(&identity, 1u << 20, &setup);
            assert_true(one <= bytes);
            needed = needed || one == bytes;
        }
        assert_true(needed);
        end();
    }
}

TEST_GROUP(set_up, tear_down)
