/* What is said of an image's way: nodes of which the same is true share a line,
 * or a row where a terminal has fewer than there are nodes. */

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <unistd.h>

#include "host/base/progress.h"
#include "host/flash/flash.h"
#include "tests/unit/test.h"

enum { NODES = 8, TEXT = 4000 };

static struct host_machine machine = {.nodes = NODES, .dimension = 3};
static struct host_session_node seen[NODES];
static struct host_session session = {.machine = &machine, .node = seen};
static struct host_spread_node node[NODES];
static struct host_spread spread;
static struct host_flash_show show;
static char text[TEXT];

static int prepare(void **unused) {
    (void)unused;
    memset(seen, 0, sizeof seen);
    memset(node, 0, sizeof node);
    spread = (struct host_spread){
        .session = &session,
        .node = node,
        .image = {.number = 3, .board = "mps2-an500", .version = "1.2"}};
    host_node_set_all(&spread.options.nodes, NODES);
    for (unsigned i = 0; i < NODES; i++)
        node[i].blocks = 100;
    return 0;
}

/* What `print` says on standard output or error. */
static void capture(int stream, void (*print)(void)) {
    int ends[2], before = dup(stream);
    assert_int_equal(pipe(ends), 0);
    (void)fflush(stdout);
    assert_int_equal(dup2(ends[1], stream), stream);
    print();
    (void)fflush(stdout);
    assert_int_equal(dup2(before, stream), stream);
    (void)close(before);
    (void)close(ends[1]);
    ssize_t size = read(ends[0], text, sizeof text - 1);
    text[size > 0 ? size : 0] = '\0';
    (void)close(ends[0]);
}

static void print_result(void) {
    host_flash_show_begin(&show, &spread, false);
    host_flash_show_result(&show);
}

static void print_cut(void) {
    static char *const argv[] = {"incode flash", "--cube", "my lab.cube",
                                 "new.img"};
    host_flash_cut_tell(stderr, &spread, 4, argv);
}

/* Ctrl-C: what each board does now, and the command that goes on. */
TEST_WITH(test_cut, prepare, NULL) {
    node[0].phase = HOST_SPREAD_TAKES;
    node[1].phase = HOST_SPREAD_WHOLE;
    node[2].phase = HOST_SPREAD_VERIFIED;
    node[3].phase = HOST_SPREAD_HAS;
    node[5].phase = HOST_SPREAD_LEAVES;
    node[5].left = true;
    capture(STDERR_FILENO, print_cut);
    assert_non_null(strstr(text, "nodes 0-1: in the loader, and what has "));
    assert_non_null(strstr(text, "node 2: in the loader; turned off and on, "
                                 "the new image runs"));
    assert_non_null(strstr(text, "node 3: with the new image\n"));
    assert_non_null(strstr(text, "nodes 4,6-7: as before\n"));
    assert_non_null(strstr(text, "node 5: on the way into the loader"));
    assert_non_null(strstr(text, "interrupted; go on with: incode flash "
                                 "--cube 'my lab.cube' new.img\n"));
}

static void print_plan(void) {
    host_flash_show_begin(&show, &spread, true);
    host_flash_show_plan(&show);
}

static void print_changes(void) {
    host_flash_show_begin(&show, &spread, false);
    node[3].phase = HOST_SPREAD_TAKES;
    host_flash_show_change(&show, 3);
    node[3].held = 10; /* is no news */
    host_flash_show_change(&show, 3);
    node[3].phase = HOST_SPREAD_DONE;
    host_flash_show_change(&show, 3);
    host_progress_end();
}

TEST_WITH(nodes_of_a_kind_share_a_line, prepare, NULL) {
    for (unsigned i = 0; i < NODES; i++) {
        node[i].phase = i == 2   ? HOST_SPREAD_PASSED
                        : i == 7 ? HOST_SPREAD_LOST
                        : i < 5  ? HOST_SPREAD_DONE
                                 : HOST_SPREAD_HAS;
    }
    snprintf(node[2].text, sizeof node[2].text, "is no mps2-an500 but linux");
    capture(STDOUT_FILENO, print_result);
    assert_string_equal(text,
                        "nodes 0-1,3-4: run mps2-an500 1.2, number 3\n"
                        "node 2: passed over, as it is no mps2-an500 but "
                        "linux\n"
                        "nodes 5-6: had mps2-an500 1.2, number 3 already\n");
}

TEST_WITH(a_plan_tells_what_runs_now, prepare, NULL) {
    for (unsigned i = 0; i < NODES; i++) {
        node[i].phase = i < 2 ? HOST_SPREAD_LEAVES : HOST_SPREAD_BEGINS;
        memcpy(seen[i].who.version, i == 0 ? "0.9" : "1.0", 3);
    }
    capture(STDOUT_FILENO, print_plan);
    assert_string_equal(
        text, "node 0: would restart and be given mps2-an500 1.2, number 3: it "
              "runs 0.9\n"
              "node 1: would restart and be given mps2-an500 1.2, number 3: it "
              "runs 1.0\n"
              "nodes 2-7: would be given mps2-an500 1.2, number 3: it is in "
              "its loader\n");
}

TEST_WITH(where_there_is_no_terminal_there_are_lines, prepare, NULL) {
    capture(STDERR_FILENO, print_changes);
    assert_string_equal(text, "incode: flash: node 3: takes blocks\n"
                              "incode: flash: node 3: runs it\n");
}

/* As much as a terminal was sent, up to a bell of ours.  clock: within a
 * minute. */
static void take_all(int master, int slave) {
    size_t size = 0;
    assert_int_equal(write(slave, "\a", 1), 1);
    while (size == 0 || text[size - 1] != '\a') {
        struct pollfd file = {master, POLLIN, 0};
        assert_true(poll(&file, 1, 60000) > 0);
        assert_true(size < sizeof text - 1);
        assert_int_equal(read(master, &text[size++], 1), 1);
    }
    text[size] = '\0';
}

TEST_WITH(a_small_terminal_has_several_nodes_a_row, prepare, NULL) {
    struct winsize size = {.ws_row = 5, .ws_col = 70};
    int master, slave, before = dup(STDERR_FILENO);
    assert_int_equal(openpty(&master, &slave, NULL, NULL, &size), 0);
    assert_int_equal(dup2(slave, STDERR_FILENO), STDERR_FILENO);
    for (unsigned i = 0; i < NODES; i++) {
        node[i].phase = i == 7 ? HOST_SPREAD_AWAITED : HOST_SPREAD_TAKES;
        node[i].held = i < 3 ? 50 : 20;
    }
    host_flash_show_begin(&show, &spread, false);
    host_flash_show_draw(&show);
    host_progress_end();
    take_all(master, slave);
    assert_int_equal(dup2(before, STDERR_FILENO), STDERR_FILENO);
    (void)close(before);
    (void)close(slave);
    (void)close(master);
    assert_int_equal(show.rows, 3);
    assert_non_null(strstr(text, "nodes 0-2 [#######"));
    assert_non_null(strstr(text, "]  50 % takes blocks"));
    assert_non_null(strstr(text, "nodes 3-5 [####"));
    assert_non_null(strstr(text, "nodes 6-7 is not there"));
}
