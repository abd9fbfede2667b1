/* An emulator's monitor: asked, late, lost, and another than before. */
#include <unistd.h>

#include "host/base/error.h"
#include "host/nodes/emulator.h"
#include "transport/drivers/unix_file.h"
#include "tests/unit/test.h"

#define GREETING "{\"QMP\": {\"version\": {}, \"capabilities\": []}}\r\n"
#define EVENT "{\"event\": \"RESET\", \"data\": {\"guest\": false}}\r\n"
#define GOOD "{\"return\": {}}\r\n"
#define BAD "{\"error\": {\"class\": \"GenericError\", \"desc\": \"no\"}}\r\n"

static int ends[2];
static struct host_qmp qmp;
static struct host_error error;

static int set_up(void **unused) {
    (void)unused;
    memset(&error, 0, sizeof error);
    assert_int_equal(unix_file_pair(ends), 0);
    host_qmp_init(&qmp, ends[0]);
    return 0;
}

static int tear_down(void **unused) {
    (void)unused;
    return close(ends[0]) | close(ends[1]);
}

static void say(const char *text) {
    assert_int_equal(write(ends[1], text, strlen(text)), strlen(text));
}

static void heard(const char *expected) {
    char text[512] = "";
    assert_true(read(ends[1], text, sizeof text - 1) > 0);
    assert_string_equal(text, expected);
}

TEST_WITH(requests_are_answered, set_up, tear_down) {
    say(GREETING GOOD EVENT GOOD);
    assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_STOP, &error), 0);
    heard("{\"execute\":\"qmp_capabilities\"}\n{\"execute\":\"stop\"}\n");
    say(EVENT "no object\r\n" GOOD);
    assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_CONT, &error), 0);
    heard("{\"execute\":\"cont\"}\n");
}

TEST_WITH(a_refusal_is_told, set_up, tear_down) {
    say(GREETING GOOD BAD);
    assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_RESET, &error), HOST_CUBE);
    assert_non_null(strstr(error.text, "refuses"));
}

/* Nothing waits for ever, nor as long as usual where less was asked for.
 * Where the machine is held up for ten seconds, it has more turns. */
TEST_WITH(silence_ends, set_up, tear_down) {
    uint64_t took_us = HOST_QMP_US;
    qmp.wait_us = 200000;
    say(GREETING);
    for (unsigned turn = 0; turn < 20 && took_us >= HOST_QMP_US; turn++) {
        uint64_t begun_us = host_now_us(); /* clock: of some turns, one */
        assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_RESET, &error), HOST_CUBE);
        assert_non_null(strstr(error.text, "no answer"));
        took_us = host_now_us() - begun_us;
        assert_true(took_us >= qmp.wait_us);
    }
    assert_true(took_us < HOST_QMP_US);
}

TEST_WITH(its_end_is_told, set_up, tear_down) {
    close(ends[1]);
    ends[1] = dup(ends[0]);
    assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_RESET, &error), HOST_CUBE);
}

/* What is left of the process before is passed over. */
TEST_WITH(another_process_is_greeted, set_up, tear_down) {
    say(GREETING GOOD GOOD);
    assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_STOP, &error), 0);
    say(EVENT "{\"ret");
    host_qmp_forget(&qmp);
    say("\r\n" GREETING GOOD GOOD);
    assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_CONT, &error), 0);
    heard("{\"execute\":\"qmp_capabilities\"}\n{\"execute\":\"stop\"}\n"
          "{\"execute\":\"qmp_capabilities\"}\n{\"execute\":\"cont\"}\n");
}

/* A line that has no room is passed over whole. */
TEST_WITH(a_long_line_is_passed_over, set_up, tear_down) {
    static char line[2 * HOST_QMP_LINE];
    memset(line, ' ', sizeof line - 1);
    say(line);
    say("{\"QMP\": 1}\r\n" GREETING GOOD GOOD);
    assert_int_equal(host_qmp_ask(&qmp, HOST_QMP_STOP, &error), 0);
    heard("{\"execute\":\"qmp_capabilities\"}\n{\"execute\":\"stop\"}\n");
}
