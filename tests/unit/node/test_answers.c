/* What a node answers, and that both sides count it; echoes of neighbours; the
 * order to restart. */

#include "node/message.h"
#include "node_talk.h"
#include "tests/unit/test.h"

enum { ALL = 16 };

static struct {
    uint8_t type;
    size_t size;
    uint8_t data[CUBE_PAYLOAD_MAX];
} heard[ALL];
static unsigned heard_count;

/* Steps, and what comes to that end meanwhile; false: the node has stopped. */
static bool steps(unsigned end, unsigned count) {
    struct cube_message message;
    heard_count = 0;
    for (unsigned i = 0; i < count; i++) {
        talk.now_us += 1000;
        if (node_step(talk.node) == NODE_STOPPED)
            return false;
        for (unsigned e = 0; e < 2; e++) {
            (void)cube_poll(talk.end[e].cube, talk.now_us);
            while (cube_read(talk.end[e].cube, &message)) {
                if (e == end && heard_count < ALL) {
                    heard[heard_count].type = message.type;
                    heard[heard_count].size = message.size;
                    memcpy(heard[heard_count++].data, message.data,
                           message.size);
                }
                cube_release(talk.end[e].cube);
            }
        }
    }
    return true;
}

static void say(unsigned who, uint8_t type, const void *data, size_t size) {
    assert_true(talk_say(who, type, data, size));
}

static void begin(void) {
    talk_begin();
    assert_true(steps(1, 300));
}

static void ask(uint32_t tag, uint32_t what) {
    const struct node_question_message question = {tag, what, 0};
    say(1, NODE_QUESTION, &question, sizeof question);
}

TEST(answers_are_counted) {
    const struct node_ping_message ping = {3};
    struct node_answer_head head;
    struct node_pong_message pong;
    struct node_who who;
    begin();
    ask(70, NODE_WHO);
    ask(71, NODE_LINKS);
    ask(72, 1000);
    say(1, NODE_PING, &ping, sizeof ping);
    assert_true(steps(1, 300));
    assert_int_equal(heard_count, 4);
    unsigned before = 0;
    for (unsigned i = 0; i < 4; i++) {
        if (heard[i].type == NODE_PONG) {
            memcpy(&pong, heard[i].data, sizeof pong);
            assert_int_equal(pong.sent, i);
            assert_int_equal(pong.received, 3);
            continue;
        }
        assert_int_equal(heard[i].type, NODE_ANSWER);
        memcpy(&head, heard[i].data, sizeof head);
        assert_int_equal(head.tag, 70 + before++);
        if (head.what == NODE_WHO) {
            assert_int_equal(heard[i].size, sizeof head + sizeof who);
            memcpy(&who, heard[i].data + sizeof head, sizeof who);
            assert_int_equal(who.epoch, 7);
            assert_int_equal(who.memory, TALK_MEMORY);
            assert_string_equal((char *)who.board, "linux");
        } else if (head.what == 1000) {
            assert_int_equal(heard[i].size, sizeof head);
        }
    }
    assert_int_equal(before, 3);
    talk_end_all();
}

/* More than fit are dropped, and the node goes on. */
TEST(questions_without_end) {
    begin();
    for (uint32_t i = 0; i < 100; i++)
        ask(i, NODE_TOTALS);
    assert_true(steps(1, 500));
    ask(500, NODE_TOP);
    assert_true(steps(1, 500));
    assert_int_equal(heard_count, 1);
    say(1, NODE_QUESTION, &heard, 11);
    say(1, NODE_RESTART, &heard, 5);
    assert_true(steps(1, 500));
    assert_int_equal(heard_count, 0);
    talk_end_all();
}

TEST(echoes_come_back) {
    const struct node_echo_message echo = {1234};
    struct node_echo_message back;
    begin();
    say(0, NODE_ECHO, &echo, sizeof echo);
    assert_true(steps(0, 300));
    assert_int_equal(heard_count, 1);
    assert_int_equal(heard[0].type, NODE_ECHOED);
    assert_int_equal(heard[0].size, sizeof back);
    memcpy(&back, heard[0].data, sizeof back);
    assert_int_equal(back.tag, 1234);
    say(0, NODE_ECHOED, &echo, sizeof echo); /* of no probe */
    assert_true(steps(0, 300));
    assert_int_equal(heard_count, 0);
    talk_end_all();
}

TEST(what_is_for_loaders_is_passed_over) {
    static const uint8_t nothing[300];
    begin();
    for (unsigned type = NODE_IMAGE_BEGIN; type <= NODE_IMAGE_DO; type++)
        say(1, (uint8_t)type, nothing, sizeof nothing);
    assert_true(steps(1, 300));
    assert_int_equal(heard_count, 0);
    talk_end_all();
}

TEST(an_order_to_restart) {
    const struct node_restart_message stay = {NODE_RESTART_STAY},
                                      plain = {NODE_RESTART_PLAIN},
                                      none = {.what = 77};
    begin();
    say(1, NODE_RESTART, &none, sizeof none);
    assert_true(steps(1, 1000));
    assert_int_equal(node_reset_why(talk.node), NODE_RESET_OVER);
    say(1, NODE_RESTART, &stay, sizeof stay);
    assert_false(steps(1, 1000));
    assert_int_equal(node_reset_why(talk.node), NODE_RESET_STAY);
    talk_end_all();
    begin();
    say(1, NODE_RESTART, &plain, sizeof plain);
    assert_false(steps(1, 1000));
    assert_int_equal(node_reset_why(talk.node), NODE_RESET_AGAIN);
    talk_end_all();
}
