/* The host believes no message: whatever a node sends, the host takes it as it
 * should be, or names the node and stops; it never writes where it must not. */
#include "given_messages.h"
#include "host/service/parts.h"

static uint64_t state = 88172645463325252u;

static uint32_t draw(uint32_t below) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32) % below;
}

TEST(test_any_bytes) {
    for (uint32_t round = 0; round < 2000; round++) {
        begin();
        for (uint32_t k = 0; k < 40; k++) {
            uint8_t data[CUBE_PAYLOAD_MAX];
            uint32_t size = draw(draw(4) == 0 ? CUBE_PAYLOAD_MAX : 40);
            struct host_error error = {0};
            for (uint32_t i = 0; i < size; i++)
                data[i] = (uint8_t)(draw(2) == 0 ? 0 : draw(256));
            uint32_t epoch = 1 + draw(NODES);
            if (size >= 4 && draw(2) == 0)
                memcpy(data, &epoch, 4);
            uint8_t type =
                (uint8_t)(draw(8) == 0 ? draw(256) : NODE_READY + draw(8));
            if (send((uint16_t)draw(NODES + 1), type, data, size, &error) !=
                0) {
                assert_true(error.code == HOST_CUBE ||
                            error.code == HOST_BROKEN);
                assert_int_equal(strncmp(error.text, "node ", 5), 0);
                break;
            }
        }
        for (uint64_t i = 0; i < tets.count; i++)
            for (int k = 0; k < 4; k++)
                assert_true(tets.v[i][k] < 64 * order.bricks);
        end();
    }
}

static size_t batch(uint8_t *data, uint32_t epoch, uint32_t brick) {
    struct node_result_writer writer;
    const uint32_t apexes[1][3] = {{1, 2, 3}};
    struct node_result_header header = {epoch, 0};
    memcpy(data, &header, sizeof header);
    node_result_begin(&writer, data + sizeof header, 100, 0);
    assert_int_equal(node_result_star(&writer, 0, apexes, 1), 1);
    assert_int_equal(node_result_commit(&writer, brick), 1);
    return sizeof header + writer.size;
}

/* Results of a job that is no more are counted as read, and dropped. */
TEST(test_epochs) {
    uint8_t data[128];
    struct host_error error = {0};
    begin();
    size_t size = batch(data, service.ledger.job[1].epoch, 0);
    assert_int_equal(send(0, NODE_RESULT, data, size, &error), 0);
    assert_int_equal(tets.count, 0);
    assert_int_equal(service.ledger.committed, 0);
    assert_int_equal(service.node[0].results, 1);
    size = batch(data, service.ledger.job[0].epoch, 0);
    assert_int_equal(send(0, NODE_RESULT, data, size, &error), 0);
    assert_int_equal(tets.count, 1);
    assert_int_equal(service.ledger.committed, 1);
    /* The same brick a second time cannot be. */
    assert_int_equal(send(0, NODE_RESULT, data, size, &error), 0);
    assert_non_null(strstr(said, "node 0 link 2: a result of brick 0, which it "
                                 "has committed before; "));
    assert_true(service.loss && service.node[0].aside);
    assert_int_equal(tets.count, 1);
    assert_int_equal(service.ledger.committed, 1);
    end();
}

/* What comes after a message that was lost does not count, and is a loss. */
TEST(test_gaps) {
    static struct node_finished_message finished;
    uint8_t data[128];
    struct host_error error = {0};
    for (int i = 0; i < 2; i++) {
        begin();
        size_t size = batch(data, service.ledger.job[0].epoch, 0);
        service.node[0].received = 1;
        finished.epoch = service.ledger.job[0].epoch;
        gap = true;
        assert_int_equal(
            i == 0 ? send(0, NODE_RESULT, data, size, &error)
                   : send(0, NODE_FINISHED, &finished, sizeof finished, &error),
            0);
        gap = false;
        assert_true(service.loss);
        assert_int_equal(service.ledger.committed, 0);
        assert_int_equal(tets.count, 0);
        assert_false(service.node[0].reported);
        end();
    }
}

static void answer(uint32_t start, uint32_t pinged, uint32_t received,
                   uint32_t sent) {
    struct node_pong_message pong = {
        .start = start, .pinged = pinged, .received = received, .sent = sent};
    struct host_error error = {0};
    assert_int_equal(send(1, NODE_PONG, &pong, sizeof pong, &error), 0);
}

/* Messages that are missing, either way, and another start are losses; pings
 * that got lost before the first answer are none. */
TEST(test_answers) {
    static const struct {
        uint32_t start, pinged, received, sent;
        bool loss;
    } then[] = {{7, 5, 3, 1, false}, {7, 5, 4, 1, true}, {7, 5, 2, 1, true},
                {7, 5, 3, 2, true},  {7, 5, 3, 0, true}, {8, 5, 3, 1, true}};
    for (size_t i = 0; i < sizeof then / sizeof then[0]; i++) {
        begin();
        answer(7, 3, 1, 0); /* two pings went astray */
        assert_false(service.loss);
        assert_int_equal(service.up, 1);
        answer(then[i].start, then[i].pinged, then[i].received, then[i].sent);
        assert_int_equal(service.loss, then[i].loss);
        assert_int_equal(service.up, 1);
        end();
    }
}

/* Statistics replace those of the same start, and add to those of others; of
 * what no statistics tell, the tetrahedra that came are counted. */
TEST(test_starts) {
    static struct node_finished_message told;
    const struct incode_statistics *sum;
    struct host_error error = {0};
    uint8_t data[128];
    begin();
    sum = &service.report[1].statistics.statistics;
    answer(7, 0, 0, 0);
    told.start = 7;
    told.statistics.make_tetra_calls = 50;
    told.statistics.afl_max = 9;
    for (int i = 0; i < 2; i++) {
        assert_int_equal(send(1, NODE_FINISHED, &told, sizeof told, &error), 0);
        assert_int_equal(sum->make_tetra_calls, 50);
    }
    uint32_t brick = order.region[1].first, v = brick * INCODE_BRICK_POINTS;
    size_t size = batch_of(data, (uint32_t[]){v, v + 1, v + 2, v + 3}, brick);
    assert_int_equal(send(1, NODE_RESULT, data, size, &error), 0);
    service.report[1].up = false; /* a new generation */
    service.node[1].received = 0;
    answer(8, 0, 0, 0);
    assert_int_equal(sum->make_tetra_calls, 51);
    assert_int_equal(sum->tetrahedra_built, 1);
    told.start = 8;
    told.statistics.make_tetra_calls = 20;
    told.statistics.afl_max = 4;
    assert_int_equal(send(1, NODE_FINISHED, &told, sizeof told, &error), 0);
    assert_int_equal(sum->make_tetra_calls, 71);
    assert_int_equal(sum->afl_max, 9);
    assert_true(service.node[1].reported);
    end();
}

TEST(test_fault) {
    struct host_error error = {0};
    begin();
    assert_int_equal(send(3, NODE_FAULT, "no memory", 9, &error), HOST_CUBE);
    assert_non_null(strstr(error.text, "node 3: no memory; "));
    assert_non_null(strstr(error.text, "give the nodes more memory"));
    end();
}

static int pong_of(unsigned i, uint32_t pinged, uint32_t start,
                   struct host_error *error) {
    struct node_pong_message pong = {.start = start,
                                     .pinged = pinged,
                                     .received = pinged,
                                     .sent = service.node[i].received};
    return send((uint16_t)i, NODE_PONG, &pong, sizeof pong, error);
}

/* What a loss may explain counts once every node that has not left has answered
 * a ping that was sent after it; a node that has started again is the loss.
 * What counts ends what nodes do together, then the node's part, then the
 * run. */
TEST(test_doubtful_fault) {
    static const char text[] = "page 1 to all, expected the one below 8";
    enum { A_LOSS, TOGETHER, ALONE, LAST, CASES };
    for (unsigned k = 0; k < CASES; k++) {
        struct host_error error = {0};
        begin();
        service.ledger.alone = k >= ALONE;
        for (unsigned i = 0; i < NODES; i++) {
            service.report[i].up = true;
            service.node[i].start = 7;
            service.node[i].aside = k == LAST && i != 1;
        }
        service.node[3].left = true;
        assert_int_equal(send(1, NODE_FAULT, text, sizeof text - 1, &error), 0);
        for (unsigned i = 0; i < NODES; i++) {
            assert_true(service.node[i].ping_due);
            assert_int_equal(pong_of(i, 0, 7, &error), 0);
            assert_int_equal(service.node[i].ping_due, true);
            host_faults_pinged(&service, i, 1);
        }
        assert_int_equal(pong_of(0, 0, 7, &error), 0); /* not to that one */
        assert_int_equal(pong_of(0, 1, 7, &error), 0);
        assert_int_equal(pong_of(2, 1, 7, &error), 0);
        assert_false(service.loss);
        int status = pong_of(1, 1, k == A_LOSS ? 8 : 7, &error);
        assert_int_equal(status, k == LAST ? HOST_CUBE : 0);
        assert_int_equal(service.loss, k != LAST);
        assert_int_equal(service.excluded, k == ALONE);
        assert_int_equal(service.node[1].aside, k == ALONE);
        assert_ptr_equal(service.strategy,
                         k == TOGETHER ? &host_redo : &host_spatial);
        assert_int_equal(service.ledger.alone, k != A_LOSS);
        if (k == LAST) {
            assert_non_null(strstr(error.text, "node 1: page 1 to all, "));
            assert_non_null(strstr(error.text, "; please report this"));
        } else if (k != A_LOSS) {
            assert_non_null(strstr(said, "node 1"));
            assert_non_null(strstr(said, "reports: page 1 to all, "));
        }
        end();
    }
}

/* A list that nodes share may be too small where one that is a node's alone is
 * not: what is left is done by each node alone, and only then the run fails. */
TEST(test_shared_list_too_small) {
    static const char text[] = "the active face list of one brick does not "
                               "fit; give the nodes more memory";
    for (unsigned alone = 0; alone < 2; alone++) {
        struct host_error error = {0};
        begin();
        service.ledger.alone = alone;
        for (unsigned i = 0; i < NODES; i++) {
            service.report[i].up = true;
            service.node[i].start = 7;
        }
        assert_int_equal(send(1, NODE_FAULT, text, sizeof text - 1, &error),
                         alone ? HOST_CUBE : 0);
        for (unsigned i = 0; i < NODES && !alone; i++) {
            host_faults_pinged(&service, i, 1);
            assert_int_equal(pong_of(i, 1, 7, &error), 0);
        }
        assert_int_equal(service.loss, !alone);
        assert_int_equal(service.excluded, 0);
        assert_ptr_equal(service.strategy, alone ? &host_spatial : &host_redo);
        end();
    }
}

/* What to do about it is said once, also where the node says it itself. */
TEST(test_fault_with_its_cure) {
    static const char *const texts[] = {
        "the list is too small; give the nodes more memory",
        "no memory for the list"};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        struct host_error error = {0};
        begin();
        assert_int_equal(
            send(1, NODE_FAULT, texts[i], (uint32_t)strlen(texts[i]), &error),
            HOST_CUBE);
        const char *cure = strstr(error.text, "; give the nodes more memory");
        assert_non_null(cure);
        assert_string_equal(cure, "; give the nodes more memory");
        assert_memory_equal(error.text, "node 1: ", 8);
        end();
    }
}

enum { NODE_OWN = 100, NODE_UNSOUND };

static unsigned taken;

/* Of a strategy that knows two types of message. */
static int take_own(struct host_work *work, const struct cube_message *message,
                    struct host_error *error) {
    (void)work;
    if (message->type == NODE_UNSOUND) {
        return host_fail(error, HOST_CUBE, "node %u: tuple 5 of 3; look at it",
                         message->source);
    }
    taken += message->type == NODE_OWN;
    return message->type == NODE_OWN ? 0 : -1;
}

/* A strategy has the messages of its roles, none of which follows a gap or is
 * of a job that is no more; what it says of a wrong one is kept. */
TEST(test_strategy) {
    struct host_strategy strategy = host_spatial;
    strategy.take = take_own;
    for (uint32_t sent = 0; sent < 2; sent++) {
        struct node_result_header header = {0, sent};
        struct host_error error = {0};
        begin();
        service.strategy = &strategy;
        taken = 0;
        assert_int_equal(send(1, NODE_OWN, &header, sizeof header, &error), 0);
        assert_int_equal(taken, sent == 0);
        assert_int_equal(service.loss, sent == 1);
        end();
    }
    static const struct {
        uint8_t type;
        uint32_t epoch;
        size_t size;
        const char *text;
    } then[] = {{NODE_OWN, 1000, 8, ""},
                {NODE_OWN, 0, 7, "message of a role in 7 bytes, expected 8"},
                {NODE_UNSOUND, 0, 8, "node 1: tuple 5 of 3; look at it"},
                {NODE_OWN + 9, 0, 8, "unknown type of message"}};
    for (size_t i = 0; i < sizeof then / sizeof then[0]; i++) {
        struct node_result_header header = {then[i].epoch, 0};
        struct host_error error = {0};
        begin();
        service.strategy = &strategy;
        taken = 0;
        assert_int_equal(send(1, then[i].type, &header, then[i].size, &error),
                         then[i].text[0] == '\0' ? 0 : HOST_CUBE);
        assert_non_null(strstr(error.text, then[i].text));
        assert_int_equal(taken, 0);
        end();
    }
}

/* Pages that one node leaves to the host go to another, behind those that this
 * one has asked for itself. */
TEST(test_passed) {
    const uint32_t own = 1, passed[3] = {2, 0, 3};
    struct host_error error = {0};
    begin();
    assert_int_equal(send(2, NODE_PAGE_REQUEST, &own, sizeof own, &error), 0);
    assert_int_equal(send(1, NODE_PAGE_PASSED, passed, sizeof passed, &error),
                     0);
    assert_int_equal(service.node[1].pages_count, 0);
    assert_int_equal(service.node[1].received, 1);
    assert_int_equal(service.node[2].pages_count, 3);
    assert_int_equal(service.node[2].pages[0], 1);
    assert_int_equal(service.node[2].pages[1], 0);
    assert_int_equal(service.node[2].pages[2], 3);
    end();
}

/* A wrong page of another node's puts an end to pages between nodes, and names
 * both, as either may be at fault; one of the host's is refused. */
TEST(test_wrong_pages) {
    static const struct {
        struct node_wrong_page_message wrong;
        bool alone; /* pages come from the host alone already */
        const char *text;
    } reports[] = {
        {{7, 1}, false, "node 1 link 0: sent node 3 a wrong page 7, as that "},
        {{INCODE_NONE, 1},
         false,
         "node 1 link 0: sent node 3 a page cut short"},
        {{7, 1}, true, "node 3 link 1: reports a wrong page 7 of the host's, "},
        {{7, CUBE_HOST},
         false,
         "node 3 link 1: reports a wrong page 7 of the host's, altered on the "
         "way or by that node"}};
    for (size_t i = 0; i < sizeof reports / sizeof reports[0]; i++) {
        struct host_error error = {0};
        bool doubted = reports[i].wrong.sender != CUBE_HOST;
        begin();
        service.work.living = NODES;
        if (reports[i].alone)
            host_audit_alone(&service);
        assert_int_equal(send(3, NODE_WRONG_PAGE, &reports[i].wrong,
                              sizeof reports[i].wrong, &error),
                         0);
        if (strncmp(said, reports[i].text, strlen(reports[i].text)) != 0)
            fail_msg("%s: not %s", said, reports[i].text);
        for (unsigned n = 0; n < NODES; n++) {
            assert_int_equal(service.node[n].aside,
                             n == 3 && (!doubted || reports[i].alone));
        }
        assert_ptr_equal(service.strategy, doubted || reports[i].alone
                                               ? &host_redo
                                               : &host_spatial);
        assert_true(service.loss);
        end();
    }
}

/* What no node of this version sends is told in figures. */
TEST(test_texts) {
    static struct node_ready_message ready = {.protocol = NODE_PROTOCOL - 1};
    static uint32_t many[HOST_PAGES_QUEUED_MAX + 1];
    static struct {
        struct node_spill_header header;
        struct incode_face faces[NODE_FACES_A_MESSAGE + 1];
    } spill = {.header = {.count = NODE_FACES_A_MESSAGE + 1}};
    static struct node_spill_header beyond = {.brick = 1000000};
    uint32_t page = 1000000;
    const uint32_t passed[2] = {2, page}, by_itself[2] = {7, 3};
    const struct {
        uint8_t type;
        const void *data;
        size_t size;
        const char *text;
    } wrong[] = {
        {NODE_READY, &ready, sizeof ready, "protocol version 11, expected 12"},
        {NODE_READY, &ready, 4, "protocol version 11, expected 12"},
        {NODE_READY, &ready, 3, "memory map in 3 bytes, expected "},
        {NODE_PONG, &ready, 16, "pong in 16 bytes, expected 40"},
        {NODE_FINISHED, &ready, 8, "statistics in 8 bytes, expected "},
        {NODE_RESULT, &ready, 2, "results in 2 bytes, expected 8"},
        {NODE_PAGE_REQUEST, &page, 4, "page 1000000 out of range 0.."},
        {NODE_PAGE_REQUEST, many, sizeof many,
         "more than 256 pages requested: 257"},
        {NODE_PAGE_REQUEST, many, 7, "page numbers in 7 bytes, expected 4"},
        {NODE_PAGE_PASSED, &page, 3, "requests of another node in 3 bytes, "},
        {NODE_PAGE_PASSED, &page, 4, "requests of node 1000000, expected 0..3"},
        {NODE_PAGE_PASSED, passed, 8, "page 1000000 out of range 0.."},
        {NODE_PAGE_PASSED, many, 7, "page numbers in 7 bytes, expected 4"},
        {NODE_WRONG_PAGE, many, 4, "report of a wrong page in 4 bytes, "},
        {NODE_WRONG_PAGE, by_itself, 8, "a wrong page of node 3"},
        {NODE_WRONG_PAGE, passed, 8, "a wrong page of node 1000000"},
        {NODE_SPILL, &spill, 19, "spilled faces in 19 bytes, expected 20"},
        {NODE_SPILL, &spill, 32,
         "129 spilled faces in 32 bytes, expected 1568"},
        {NODE_SPILL, &spill, sizeof spill,
         "more than 128 spilled faces in a message: 129"},
        {NODE_UNSPILL_REQUEST, &spill, 24,
         "request for a spilled list in 24 bytes, expected 20"},
        {NODE_UNSPILL_REQUEST, &spill, 20,
         "more than 64 spilled lists requested"},
        {NODE_UNSPILL_REQUEST, &beyond, 20,
         "spilled list of brick 1000000 requested, out of range 0.."},
        {NODE_STOP, &ready, 0, "unknown type of message"},
        {NODE_FAULT, "role 7 is not known", 19,
         "role 7 is not known; run the "
         "same version"}};
    assert_int_equal(NODE_PROTOCOL, 12);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct host_error error = {0};
        begin();
        service.node[3].unspills_count = HOST_UNSPILLS_MAX;
        assert_int_equal(
            send(3, wrong[i].type, wrong[i].data, wrong[i].size, &error),
            HOST_CUBE);
        if (strstr(error.text, wrong[i].text) == NULL)
            fail_msg("%s: not %s", error.text, wrong[i].text);
        end();
    }
}

TEST_GROUP(set_up, tear_down)
