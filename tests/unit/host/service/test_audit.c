/* Results that are wrong in a chosen place: the node that is excluded, what is
 * done again, and when the run gives up. */
#include "given_messages.h"

#include "host/library/delaunay.h"
#include "host/service/parts.h"

enum { ALL = UINT16_MAX, NOBODY = UINT16_MAX, NO_TET = -1 };

/* Of the result: its true tetrahedra, and what is wrong with it. */
static struct host_tetrahedra truth;
static struct {
    unsigned alone;                     /* a bit a node */
    int64_t left_out, twice, exchanged; /* of truth; NO_TET */
    uint32_t bare;  /* all tetrahedra of that vertex are left out; ALL */
    int64_t helped; /* this one, exchanged or not, was found by `helper` */
    unsigned helper;
    unsigned only; /* the node that commits all bricks; NOBODY */
} given;
static bool loses; /* a node is lost while the check runs */

static uint64_t now_us(void *context) {
    (void)context;
    if (loses) {
        struct host_error error = {0};
        assert_int_equal(host_generation_renew(&service, 0, &error), 0);
    }
    return 0;
}

static void triangulate(const struct host_points *points) {
    struct host_error error = {0};
    uint32_t *vertex = calloc(points->count, sizeof *vertex);
    assert_non_null(vertex);
    assert_int_equal(host_delaunay(points->xyz, points->count, &truth, &error),
                     0);
    for (uint32_t v = 0; v < order.bricks * INCODE_BRICK_POINTS; v++)
        if (order.row[v] != INCODE_NONE)
            vertex[order.row[v]] = v;
    host_tetrahedra_map(&truth, vertex);
    free(vertex);
}

static int set_up_truth(void **unused) {
    struct host_points points = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", 3000, 1, &points, &error), 0);
    (void)set_up(unused);
    triangulate(&points);
    host_points_free(&points);
    return 0;
}

static int tear_down_truth(void **unused) {
    host_tetrahedra_free(&truth);
    return tear_down(unused);
}

static unsigned node_of(uint32_t brick) {
    unsigned node = 0;
    while (brick >= order.region[node].last)
        node++;
    return node;
}

static uint32_t owner_of(const uint32_t t[4]) {
    return host_ledger_owner(&service.ledger, &order, t);
}

static bool has(const uint32_t t[4], uint32_t v) {
    return t[0] == v || t[1] == v || t[2] == v || t[3] == v;
}

static bool is_of(unsigned node, const uint32_t t[4]) {
    bool is = true;
    for (int k = 0; k < 4; k++)
        is = is && node_of(t[k] / INCODE_BRICK_POINTS) == node;
    return is;
}

/* A tetrahedron inside a node's region, as all that share a vertex with it. */
static int64_t inside(unsigned node) {
    for (uint64_t i = 0; i < truth.count; i++) {
        const uint32_t *t = truth.v[i];
        bool is = is_of(node, t);
        for (uint64_t k = 0; is && k < truth.count; k++) {
            const uint32_t *u = truth.v[k];
            bool near =
                has(u, t[0]) || has(u, t[1]) || has(u, t[2]) || has(u, t[3]);
            is = !near || is_of(node, u);
        }
        if (is)
            return (int64_t)i;
    }
    fail_msg("no tetrahedron lies inside region %u", node);
    return NO_TET;
}

/* Another vertex in the place of one: positive, and of the same brick. */
static void exchange(uint32_t t[4]) {
    uint32_t brick = owner_of(t), v = brick * INCODE_BRICK_POINTS;
    for (int k = 0; k < 4; k++) {
        for (uint32_t i = 0; i < order.fill[brick]; i++) {
            struct incode_tally tally = {0};
            uint32_t u[4] = {t[0], t[1], t[2], t[3]};
            double p[4][3];
            u[k] = v + i;
            for (int n = 0; n < 4; n++)
                host_vertex(&order, u[n], p[n]);
            if (!has(t, u[k]) && owner_of(u) == brick &&
                incode_orient3d(&tally, p[0], p[1], p[2], p[3]) > 0) {
                memcpy(t, u, sizeof u);
                return;
            }
        }
    }
    fail_msg("no vertex to be exchanged");
}

static void put(unsigned node, int64_t i) {
    struct host_error error = {0};
    uint32_t(*v)[4] = host_tetrahedra_room(&tets, 1, &error);
    assert_non_null(v);
    memcpy(*v, truth.v[i], sizeof *v);
    if (i == given.exchanged)
        exchange(*v);
    host_tetrahedra_keep(&tets, 1);
    assert_int_equal(host_ledger_found(&service.ledger,
                                       i == given.helped ? given.helper : node,
                                       1, &error),
                     0);
}

/* What is open of bricks [first, last) is done by that node, as `given` says.
 */
static void work(unsigned node, uint32_t first, uint32_t last) {
    (void)host_ledger_open(&service.ledger, node, first, last);
    service.ledger.alone = (given.alone >> node & 1) != 0;
    for (uint64_t i = 0; i < truth.count; i++) {
        uint32_t brick = owner_of(truth.v[i]);
        if (brick < first || brick >= last || (int64_t)i == given.left_out ||
            host_ledger_committed(&service.ledger, brick) ||
            given.bare == ALL || has(truth.v[i], given.bare))
            continue;
        put(node, (int64_t)i);
        if ((int64_t)i == given.twice)
            put(node, (int64_t)i);
    }
    for (uint32_t b = first; b < last; b++)
        if (!host_ledger_committed(&service.ledger, b))
            assert_int_equal(host_ledger_commit(&service.ledger, node, b), 0);
}

static void work_all(void) {
    if (given.only != NOBODY) {
        work(given.only, 0, order.bricks);
        return;
    }
    for (unsigned n = 0; n < NODES; n++)
        if (order.region[n].first < order.region[n].last)
            work(n, order.region[n].first, order.region[n].last);
}

/* Nothing is wrong yet. */
static void prepare(void) {
    begin();
    machine.virtual_time = true;
    machine.now_us = now_us;
    loses = false;
    service.work.order = &order;
    service.work.tets = &tets;
    service.work.nodes = service.work.living = NODES;
    given.alone = 0;
    given.left_out = given.twice = given.exchanged = given.helped = NO_TET;
    given.bare = INCODE_NONE;
    given.only = NOBODY;
}

static void finish(void) {
    host_audit_free(&service.audit);
    end();
}

/* The check fails, and the run goes on. */
static void fails(void) {
    bool passed;
    struct host_error error = {0};
    assert_int_equal(host_audit_step(&service, &passed, &error), 0);
    assert_false(passed);
    assert_int_equal(service.audit.state, HOST_AUDIT_DUE);
    assert_ptr_equal(service.strategy, &host_redo);
    assert_true(service.ledger.alone);
    assert_true(service.loss);
    assert_true(service.audit.lost_work);
    for (unsigned n = 0; n < NODES; n++)
        assert_int_equal(service.ledger.job[n].epoch, 0);
}

static void passes(void) {
    bool passed;
    struct host_error error = {0};
    if (host_audit_step(&service, &passed, &error) != 0)
        fail_msg("%s", error.text);
    assert_true(passed);
    assert_int_equal(service.audit.state, HOST_AUDIT_PASSED);
}

static struct host_error gives_up(const char *text) {
    bool passed;
    struct host_error error = {0};
    assert_int_equal(host_audit_step(&service, &passed, &error),
                     HOST_UNVERIFIED);
    assert_false(passed);
    if (strncmp(error.text, text, strlen(text)) != 0)
        fail_msg("%s: not %s", error.text, text);
    assert_non_null(strstr(error.text, "; "));
    return error;
}

/* That node, and no other; NOBODY. */
static void excluded_is(unsigned node) {
    for (unsigned n = 0; n < NODES; n++) {
        assert_int_equal(service.node[n].aside, n == node);
        assert_int_equal(service.node[n].left, n == node);
    }
    assert_int_equal(service.excluded, node == NOBODY ? 0 : 1);
}

static void said_is(const char *text) {
    if (strstr(said, text) == NULL)
        fail_msg("%s: not %s", said, text);
    assert_non_null(strstr(said, "; "));
}

static bool is_open(uint32_t brick) {
    return !host_ledger_committed(&service.ledger, brick);
}

/* Node 1 alone; one tetrahedron that node 3 sent was of node 1's finding, and
 * it has committed a brick of which node 2 has found all. */
TEST(test_alone) {
    static const char *const texts[] = {
        "it left out the tetrahedron of rows ",
        "it sent twice the tetrahedron of rows ",
        "it sent, and that is not Delaunay, the tetrahedron of rows "};
    for (unsigned i = 0; i < 3; i++) {
        int64_t *faults[] = {&given.left_out, &given.twice, &given.exchanged};
        char text[200];
        prepare();
        *faults[i] = inside(1);
        given.alone = 1 << 1 | 1 << 2;
        given.helped = inside(3);
        given.helper = 1;
        uint32_t helped = owner_of(truth.v[given.helped]);
        work_all();
        uint32_t taken = order.region[2].first;
        service.ledger.by[taken] = HOST_LEDGER_ALONE | 1;
        fails();
        excluded_is(1);
        snprintf(text, sizeof text, "node 1 link 0: its result is wrong: %s",
                 texts[i]);
        said_is(text);
        for (uint32_t b = 0; b < order.bricks; b++) {
            assert_int_equal(is_open(b),
                             node_of(b) == 1 || b == helped || b == taken);
        }
        finish();
    }
}

/* Of nodes that worked together none is at fault, and what is near is done
 * again: by nodes alone, until it is right. */
TEST(test_together) {
    for (unsigned i = 0; i < 3; i++) {
        int64_t *faults[] = {&given.left_out, &given.twice, &given.exchanged};
        prepare();
        int64_t at = *faults[i] = inside(1);
        given.helped = at;
        given.helper = 2;
        work_all();
        fails();
        excluded_is(NOBODY);
        said_is(i == 2 ? "the check of the result failed at work of node 2 or "
                         "node 1; the bricks concerned are done again"
                       : "the check of the result failed; the bricks concerned "
                         "are done again");
        for (uint32_t b = 0; b < order.bricks; b++)
            assert_true(node_of(b) == 1 || !is_open(b));
        for (int k = 0; k < 4; k++)
            assert_true(is_open(truth.v[at][k] / INCODE_BRICK_POINTS));
        *faults[i] = NO_TET;
        given.alone = ~0u;
        host_redo.lose(&service.work);
        work_all();
        passes();
        finish();
    }
}

/* A node that both found and sent what is wrong is named once. */
TEST(test_suspect) {
    prepare();
    given.exchanged = inside(1);
    work_all();
    fails();
    said_is("failed at work of node 1; ");
    finish();
}

/* One node that did such points alone left them out; of two, or many, none. */
TEST(test_no_tetrahedra) {
    for (unsigned i = 0; i < 3; i++) {
        prepare();
        given.only = 1;
        given.alone = i == 1 ? 0 : ~0u;
        given.bare = ALL;
        work_all();
        if (i == 2)
            service.ledger.by[1] = HOST_LEDGER_ALONE | 2;
        fails();
        excluded_is(i == 0 ? 1 : NOBODY);
        said_is(i == 0 ? "node 1 link 0: its result is wrong: it left out all "
                         "tetrahedra of row "
                       : "the check of the result failed; ");
        finish();
    }
}

/* A point far away has one tetrahedron, at the base of a pyramid that holds all
 * others, and it is of another node's brick: what is left without it is convex,
 * but that other node is at fault, and not the one whose point it is. */
TEST(test_far_point) {
    static const double pyramid[5][3] = {
        {0, 0, 0}, {1, 1, 0}, {1, -0.5, 0.75}, {1, -0.5, -0.75}, {100, 0, 0}};
    const struct host_order near = order;
    struct host_tetrahedra near_truth = truth;
    struct host_points points = {0};
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", 200, 1, &points, &error), 0);
    for (size_t i = 0; i < 600; i++) {
        points.xyz[i] =
            i % 3 == 0 ? 0.3 + points.xyz[i] / 2 : (points.xyz[i] - 0.5) / 5;
    }
    assert_int_equal(host_points_append(&points, &pyramid[0][0], 5, &error), 0);
    assert_int_equal(host_order_make(&order, "test", points.xyz, points.count,
                                     HOST_UNIFORM, NODES, false, &error),
                     0);
    memset(&truth, 0, sizeof truth);
    triangulate(&points);
    host_points_free(&points);
    prepare();
    uint32_t brick = order.bricks - 1;
    assert_int_equal(order.fill[brick], 1);
    assert_int_equal(order.row[brick * INCODE_BRICK_POINTS], 204);
    assert_int_not_equal(node_of(brick), 0);
    given.bare = brick * INCODE_BRICK_POINTS;
    given.alone = ~0u;
    work_all();
    fails();
    excluded_is(0);
    assert_true(is_open(brick));
    finish();
    host_order_free(&order);
    host_tetrahedra_free(&truth);
    order = near;
    truth = near_truth;
}

/* A tetrahedron of that node's region is wrong. */
static void spoil(unsigned node) {
    uint64_t i = 0;
    while (i < tets.count && !is_of(node, tets.v[i]))
        i++;
    assert_true(i < tets.count);
    exchange(tets.v[i]);
}

/* What is near, then all that nodes did together, then everything. */
TEST(test_unclear) {
    bool again[64] = {false};
    prepare();
    assert_true(order.bricks <= 64);
    given.alone = 1 << 0;
    work_all();
    spoil(1);
    fails();
    assert_int_equal(service.audit.unclear, 1);
    assert_true(service.ledger.committed > 0);
    for (uint32_t b = 0; b < order.bricks; b++)
        again[b] = is_open(b);
    given.alone = 1 << 0 | 1 << 1;
    host_redo.lose(&service.work);
    work_all();
    spoil(3);
    fails();
    for (uint32_t b = 0; b < order.bricks; b++) {
        bool together = (service.ledger.by[b] & HOST_LEDGER_ALONE) == 0;
        assert_true(is_open(b) || !together);
        assert_int_equal(together,
                         node_of(b) >= 2 || (node_of(b) == 1 && !again[b]));
    }
    assert_true(service.ledger.committed > 0);
    given.alone = 0;
    host_redo.lose(&service.work);
    work_all();
    spoil(2);
    fails();
    assert_int_equal(service.ledger.committed, 0);
    excluded_is(NOBODY);
    finish();
}

/* As long as there are two, a brick goes to the other node. */
TEST(test_redo) {
    struct incode_job job;
    prepare();
    work_all();
    uint32_t first = order.region[0].first;
    for (uint32_t b = first; b < first + 4; b++) {
        host_ledger_reopen(&service.ledger, b);
        service.ledger.by[b] = b < first + 2 ? 0 : 1;
    }
    host_audit_alone(&service);
    service.strategy->lose(&service.work);
    service.ledger.piece_max = 4;
    service.work.living = 2;
    assert_false(service.strategy->next(&service.work, 0, &job));
    assert_true(service.strategy->next(&service.work, 1, &job));
    assert_int_equal(job.first, first);
    assert_int_equal(job.last, first + 2);
    assert_false(service.strategy->next(&service.work, 1, &job));
    assert_true(service.strategy->next(&service.work, 0, &job));
    assert_int_equal(job.first, first + 2);
    assert_int_equal(job.last, first + 4);
    service.ledger.cursor = 0;
    service.work.living = 1;
    assert_true(service.strategy->next(&service.work, 0, &job));
    assert_int_equal(job.first, first);
    assert_int_equal(job.last, first + 4);
    finish();
}

TEST(test_no_other) {
    prepare();
    assert_true(host_audit_is_other(&service, 1));
    service.node[0].aside = true;
    service.node[2].given_up = true;
    assert_true(host_audit_is_other(&service, 1));
    service.work.lost[3] = true;
    assert_false(host_audit_is_other(&service, 1));
    assert_true(host_audit_is_other(&service, 0));
    given.alone = ~0u;
    given.twice = inside(1);
    work_all();
    (void)gives_up(
        "node 1: its result is wrong: it sent twice the tetrahedron of "
        "rows ");
    finish();
}

/* A run gives up after a bounded number of checks, and reports one offence. */
TEST(test_no_end) {
    prepare();
    work_all();
    spoil(1);
    spoil(2);
    service.audit.failed = NODES + 3;
    fails();
    host_redo.lose(&service.work);
    work_all();
    spoil(1);
    spoil(2);
    const struct host_error error = gives_up("check: ");
    const char *found = service.audit.report.text;
    size_t line = strcspn(found, "\n");
    assert_true(strlen(found) > line + 1);
    assert_memory_equal(error.text + strlen("check: "), found, line);
    const char *advice = error.text + strlen("check: ") + line;
    assert_int_equal(strncmp(advice, "; doing it again did not help", 29), 0);
    finish();
}

static void is_exact(enum host_verifying verifying, bool foreign, bool exact) {
    prepare();
    service.verifying = verifying;
    service.foreign = foreign;
    work_all();
    passes();
    assert_int_equal(service.audit.exact, exact);
    assert_int_equal(service.audit.report.tetrahedra, truth.count);
    finish();
}

static void lost_is_exact(enum host_verifying verifying, bool during) {
    bool passed, exact = verifying != HOST_VERIFY_NEVER;
    struct host_error error = {0};
    prepare();
    service.verifying = verifying;
    work_all();
    loses = during;
    if (!during)
        assert_int_equal(host_generation_renew(&service, 0, &error), 0);
    if (during && exact) {
        assert_int_equal(host_audit_step(&service, &passed, &error), 0);
        assert_false(passed);
        assert_int_equal(service.audit.failed, 0);
    }
    passes();
    assert_int_equal(service.audit.exact, exact);
    finish();
}

TEST(test_exact) {
    is_exact(HOST_VERIFY_WHERE_DUE, false, false);
    is_exact(HOST_VERIFY_WHERE_DUE, true, true);
    is_exact(HOST_VERIFY_ALWAYS, false, true);
    is_exact(HOST_VERIFY_NEVER, true, false);
    for (int during = 0; during < 2; during++) {
        lost_is_exact(HOST_VERIFY_WHERE_DUE, during != 0);
        lost_is_exact(HOST_VERIFY_NEVER, during != 0);
    }
}

TEST_GROUP(set_up_truth, tear_down_truth)
