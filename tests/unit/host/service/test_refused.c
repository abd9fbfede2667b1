/* What a node says of its job is refused before it is used, where it cannot be:
 * results, the end of the job, spilled faces. */
#include "given_messages.h"

/* What cannot be is refused before it is used: the node is named, and has no
 * part in the run any more; where it was ended and started again, it gets no
 * second start. */
static bool ends_node(void *context, unsigned node) {
    (void)context;
    assert_int_equal(node, 1);
    return true;
}

/* 0: no one ends it; 1: it is ended and started again; 2: it had that, and is
 * excluded; 3: and no other node is left. */
static void refuses_message(uint8_t type, const void *data, size_t size,
                            const char *text) {
    for (int anew = 0; anew < 4; anew++) {
        struct host_error error = {0};
        begin();
        machine.kill = anew > 0 ? ends_node : NULL;
        service.node[1].started_anew = anew >= 2;
        for (unsigned i = 0; anew == 3 && i < NODES; i++)
            service.node[i].aside = i != 1;
        assert_int_equal(send(1, type, data, size, &error),
                         anew == 3 ? HOST_UNVERIFIED : 0);
        if (strstr(anew == 3 ? error.text : said, text) == NULL)
            fail_msg("no '%s' in: %s %s", text, said, error.text);
        assert_int_equal(strstr(error.text, "no other node is left") != NULL,
                         anew == 3);
        assert_int_equal(strstr(said, "it is excluded") != NULL,
                         anew == 0 || anew == 2);
        assert_int_equal(service.excluded, anew == 0 || anew == 2);
        assert_int_equal(service.node[1].aside, anew == 0 || anew == 2);
        assert_int_equal(service.loss, anew == 0 || anew == 2);
        assert_int_equal(service.ledger.committed, 0);
        assert_int_equal(service.spill.faces, 0);
        assert_false(service.node[1].reported);
        /* Whatever else it says is of no interest. */
        assert_int_equal(send(1, NODE_RESULT, data, 3, &error), 0);
        machine.kill = NULL;
        end();
    }
}

static void refuses(const uint32_t v[4], uint32_t brick, const char *text) {
    uint8_t data[128];
    size_t size = batch_of(data, v, brick);
    refuses_message(NODE_RESULT, data, size, text);
}

TEST(test_refused_results) {
    uint32_t first = order.region[1].first, v = first * INCODE_BRICK_POINTS;
    uint32_t loose = first, last = order.bricks - 1;
    char text[80];
    while (order.fill[loose] == INCODE_BRICK_POINTS)
        assert_true(++loose < order.region[1].last);
    uint32_t padding = loose * INCODE_BRICK_POINTS + order.fill[loose];
    snprintf(text, sizeof text, "a result with vertex %u, which is no point",
             padding);
    for (unsigned i = 0; i < 4; i++) {
        uint32_t row[4] = {v, v + 1, v + 2, v + 3};
        row[i] = padding;
        refuses(row, first, text);
    }
    refuses((uint32_t[]){v, v + 1, v + 2, v + 1}, first, " twice");
    refuses((uint32_t[]){v, v + 1, v, v + 2}, first, " twice");
    refuses((uint32_t[]){v, v, v + 1, v + 2}, first, " twice");
    refuses((uint32_t[]){0, 1, 2, 3}, first,
            "a result of brick 0, which is not of its job");
    refuses((uint32_t[]){v, v + 1, v + 2, v + 3}, last, "committed brick ");
    refuses((uint32_t[]){v, v + 1, v + 2, 64 * last + 64}, first,
            "invalid results");
}

/* A node that has not committed all its bricks is not done. */
TEST(test_unfinished) {
    static struct node_finished_message finished;
    struct host_error error = {0};
    char text[80];
    finished.epoch = JOB_OF_NODE_1;
    snprintf(text, sizeof text, "finished with 0 bricks of %u committed",
             order.region[1].last - order.region[1].first);
    refuses_message(NODE_FINISHED, &finished, sizeof finished, text);
    begin();
    assert_int_equal(send(2, NODE_FINISHED, &finished, sizeof finished, &error),
                     HOST_CUBE); /* that job is another node's */
    end();
}

/* Spilled faces are of points, and marks of points of the job. */
TEST(test_spilled) {
    struct {
        struct node_spill_header header;
        struct incode_face faces[2];
    } spill = {.header = {.epoch = JOB_OF_NODE_1, .count = 2}};
    uint32_t v = order.region[1].first * INCODE_BRICK_POINTS;
    uint32_t after = order.bricks * INCODE_BRICK_POINTS, padding = 0;
    while (padding % INCODE_BRICK_POINTS <
           order.fill[padding / INCODE_BRICK_POINTS])
        padding++;
    const struct incode_face good[] = {
        {{v, v + 1, 0}}, {{0, 1, v}}, {{v + 1, INCODE_NONE, INCODE_NONE}}};
    const struct incode_face bad[] = {
        {{after, v, v + 1}},
        {{v, after, v + 1}},
        {{v, v + 1, after}},
        {{padding, v, v + 1}},
        {{v, padding, v + 1}},
        {{v, v + 1, padding}},
        {{v, v, v + 1}},
        {{v, v + 1, v}},
        {{v + 1, v, v}},
        {{INCODE_NONE, v, v + 1}},
        {{v, INCODE_NONE, v + 1}},
        {{v, v + 1, INCODE_NONE}},
        {{0, INCODE_NONE, INCODE_NONE}}, /* a mark of another's vertex */
        {{after, INCODE_NONE, INCODE_NONE}}};
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        struct host_error error = {0};
        spill.faces[0] = good[0];
        spill.faces[1] = good[i];
        begin();
        assert_int_equal(send(1, NODE_SPILL, &spill, sizeof spill, &error), 0);
        assert_int_equal(service.spill.faces, 2);
        assert_string_equal(said, "");
        end();
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        char text[100];
        spill.faces[1] = bad[i];
        snprintf(text, sizeof text,
                 "spilled vertices %u, %u and %u, which are no face",
                 bad[i].v[0], bad[i].v[1], bad[i].v[2]);
        refuses_message(NODE_SPILL, &spill, sizeof spill, text);
    }
}

/* A node that repeats a tetrahedron, or spills a face, without end makes the
 * host keep no more than a bound that its points give. */
static void floods(uint8_t type, const void *data, size_t size,
                   const char *text) {
    struct host_error error = {0};
    uint64_t bricks = order.region[1].last - order.region[1].first;
    unsigned sent = 0;
    begin();
    while (!service.node[1].left && sent < 1000000) {
        assert_int_equal(send(1, type, data, size, &error), 0);
        sent++;
    }
    assert_true(sent < 1000000);
    if (strstr(said, text) == NULL)
        fail_msg("no '%s' in: %s", text, said);
    assert_true(service.node[1].aside);
    assert_true(tets.count <= 4097 + 1024 * bricks);
    assert_true(service.spill.faces <= 65538 + 1024 * bricks);
    end();
}

TEST(test_floods) {
    uint32_t v = order.region[1].first * INCODE_BRICK_POINTS;
    const uint32_t row[4] = {v, v + 1, v + 2, v + 3};
    uint8_t data[128];
    struct {
        struct node_spill_header header;
        struct incode_face faces[2];
    } spill = {.header = {.epoch = JOB_OF_NODE_1, .count = 2},
               .faces = {{{v, v + 1, v + 2}}, {{v, v + 2, v + 1}}}};
    size_t size = batch_of(data, row, order.region[1].first);
    struct node_result_writer writer;
    node_result_begin(&writer, data + 8, 100, 1);
    const uint32_t apexes[1][3] = {{v + 1, v + 2, v + 3}};
    assert_int_equal(node_result_star(&writer, v, apexes, 1), 1);
    assert_true(8 + writer.size < size); /* no commit */
    floods(NODE_RESULT, data, 8 + writer.size,
           "more results than its points allow");
    floods(NODE_SPILL, &spill, sizeof spill,
           "more spilled faces than its points allow");
}

TEST_GROUP(set_up, tear_down)
