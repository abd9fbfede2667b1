/* Two processes: one that has a cube, played, and lets others look, and one
 * that looks. */
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/error.h"
#include "host/watch/look.h"
#include "host/watch/offer.h"
#include "node/version.h"
#include "tests/unit/test.h"

enum {
    NODES = 4,
    SILENT = 2, /* the node that does not answer NODE_LINKS */
    WAIT_US = 600000000,
    SECOND = 1000000
};

static char wire[128];
static pid_t holder;
static int end; /* closed: the holder ends */
static struct host_error error;
static struct host_node_set all;

/* --- who has the cube ----------------------------------------------------- */

/* Its time passes faster than the watcher's.  clock: both wait for minutes.
 */
static uint64_t holder_us(void *context) {
    (void)context;
    return 10 * host_now_us();
}

static void answer_for(struct host_watching *watching,
                       const struct host_machine *machine, unsigned node) {
    struct node_question_message question;
    uint8_t bytes[CUBE_PAYLOAD_MAX] = {0};
    if (!host_watching_due(watching, node, &question))
        return;
    struct node_answer_head head = {question.tag, question.what};
    struct cube_message message = {.data = bytes, .source = (uint16_t)node};
    size_t size = question.what == NODE_LOG ? sizeof bytes : 16 + node;
    memcpy(bytes, &head, sizeof head);
    for (size_t i = sizeof head; i < size; i++)
        bytes[i] = (uint8_t)(i * 7 + node + question.what);
    message.size = (uint16_t)size;
    host_watching_sent(watching, node);
    if (node != SILENT || question.what != NODE_LINKS)
        assert_true(host_watching_take(watching, machine, &message));
}

static _Noreturn void hold(int begun, int ended) {
    static struct host_offer offer;
    struct host_watching watching = {0};
    struct host_machine machine = {.nodes = NODES,
                                   .dimension = 2,
                                   .serial_baud = 115200,
                                   .now_us = holder_us};
    struct host_watchers_progress progress = {1, 9, 100};
    char byte;
    host_offer_begin(&offer, wire);
    host_offer_machine(&offer, &machine);
    machine.watchers = &offer.watchers;
    (void)!write(begun, "b", 1);
    while (read(ended, &byte, 1) < 0 && errno == EAGAIN) {
        host_watching_look(&watching, &machine, holder_us(NULL), &progress);
        for (unsigned i = 0; i < NODES; i++)
            answer_for(&watching, &machine, i);
        progress.tetrahedra++;
        usleep(1000); /* clock: looks again */
    }
    host_offer_end(&offer);
    exit(0);
}

static void begin_holder(void) {
    int begun[2], ended[2];
    char byte;
    assert_int_equal(pipe(begun), 0);
    assert_int_equal(pipe2(ended, O_NONBLOCK), 0);
    (void)fflush(NULL);
    holder = fork();
    if (holder == 0) {
        close(ended[1]);
        hold(begun[1], ended[0]);
    }
    close(begun[1]);
    close(ended[0]);
    assert_int_equal(read(begun[0], &byte, 1), 1);
    close(begun[0]);
    end = ended[1];
}

static void end_holder(void) {
    int status;
    close(end);
    assert_int_equal(waitpid(holder, &status, 0), holder);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0); /* nor has it leaked */
}

static int set_up(void **unused) {
    static unsigned count;
    (void)unused;
    memset(&error, 0, sizeof error);
    host_node_set_all(&all, NODES);
    snprintf(wire, sizeof wire, "unix:/a test %ld %u", (long)getpid(), count++);
    return 0;
}

static void look_at(struct host_look *look) {
    if (host_look_open(look, wire, &error) != 0)
        fail_msg("%s", error.text);
}

/* --- looks ---------------------------------------------------------------- */

TEST_WITH(test_nobody, set_up, NULL) {
    struct host_look look;
    struct host_holder who;
    assert_false(host_holder_find(&who, wire));
    assert_int_equal(host_look_open(&look, wire, &error), HOST_CUBE);
    assert_non_null(strstr(error.text, "no program of this machine has it; "));
    host_look_close(&look);
}

static void check_answers(const struct host_look *look, unsigned what) {
    for (unsigned i = 0; i < NODES; i++) {
        const struct host_look_node *node = &look->node[i];
        size_t size = what == NODE_LOG ? CUBE_PAYLOAD_MAX - 8 : 8 + i;
        assert_int_equal(node->answered, i != SILENT || what != NODE_LINKS);
        for (size_t k = 0; node->answered && k < size; k++) {
            assert_int_equal(node->size, size);
            assert_int_equal(node->answer[k],
                             (uint8_t)((k + 8) * 7 + i + what));
        }
    }
}

TEST_WITH(test_answers, set_up, NULL) {
    struct host_look look;
    uint64_t before = 0;
    begin_holder();
    look_at(&look);
    assert_int_equal(look.nodes, NODES);
    assert_int_equal(look.dimension, 2);
    assert_int_equal(look.serial_baud, 115200);
    for (unsigned what = NODE_WHO; what <= NODE_LOG; what++) {
        assert_int_equal(host_look_ask(&look, &all, (enum node_question)what,
                                       WAIT_US, &error),
                         0);
        check_answers(&look, what);
        assert_int_equal(look.committed, 1);
        assert_int_equal(look.bricks, 9);
        assert_true(look.tetrahedra > before);
        before = look.tetrahedra;
    }
    struct host_node_set one = {{0}};
    host_node_set_add(&one, 3);
    assert_int_equal(host_look_ask(&look, &one, NODE_TOP, WAIT_US, &error), 0);
    assert_true(look.node[3].answered);
    assert_false(look.node[1].answered);
    assert_int_equal(host_look_ask(&look, &all, NODE_PROBE, WAIT_US, &error),
                     HOST_CUBE); /* is not to look */
    host_look_close(&look);
    end_holder();
}

TEST_WITH(test_holder, set_up, NULL) {
    struct host_holder who;
    char text[HOST_HOLDER_TEXT], number[40];
    begin_holder();
    assert_true(host_holder_find(&who, wire));
    assert_int_equal(who.pid, holder);
    assert_int_equal(who.uid, geteuid());
    assert_true(who.since_s > 0);
    assert_true(who.command[0] != '\0' && strchr(who.command, '/') == NULL);
    host_holder_text(&who, text, sizeof text);
    snprintf(number, sizeof number, ", process %ld of ", (long)holder);
    assert_non_null(strstr(text, number));
    assert_non_null(strstr(text, ", since "));
    end_holder();
    assert_false(host_holder_find(&who, wire));
}

TEST_WITH(test_several, set_up, NULL) {
    struct host_look look[HOST_LOOKERS_MAX], late;
    begin_holder();
    for (unsigned i = 0; i < HOST_LOOKERS_MAX; i++)
        look_at(&look[i]);
    assert_int_equal(host_look_open(&late, wire, &error), HOST_CUBE);
    assert_non_null(strstr(error.text, "four programs look on already; "));
    host_look_close(&late);
    memset(&error, 0, sizeof error);
    for (unsigned k = 0; k < 2 * HOST_LOOKERS_MAX; k++) {
        assert_int_equal(host_look_ask(&look[k % HOST_LOOKERS_MAX], &all,
                                       NODE_TOP, WAIT_US, &error),
                         0);
        check_answers(&look[k % HOST_LOOKERS_MAX], NODE_TOP);
    }
    host_look_close(&look[1]); /* and its place is free, a moment later */
    while (host_look_open(&late, wire, &error) != 0) {
        host_look_close(&late);
        memset(&error, 0, sizeof error);
    }
    assert_int_equal(host_look_ask(&late, &all, NODE_TOP, WAIT_US, &error), 0);
    host_look_close(&late);
    for (unsigned i = 0; i < HOST_LOOKERS_MAX; i++)
        if (i != 1)
            host_look_close(&look[i]);
    end_holder();
}

/* However the other ends, its place is free at once. */
TEST_WITH(test_killed, set_up, NULL) {
    struct host_look look;
    struct host_holder who;
    int status;
    begin_holder();
    look_at(&look);
    kill(holder, SIGKILL);
    assert_int_equal(waitpid(holder, &status, 0), holder);
    close(end);
    assert_int_equal(host_look_ask(&look, &all, NODE_TOP, WAIT_US, &error),
                     HOST_CUBE);
    assert_non_null(strstr(error.text, "has ended; "));
    host_look_close(&look);
    assert_false(host_holder_find(&who, wire));
    begin_holder();
    end_holder();
}

/* Who stands still is waited for no longer than one has patience; clock: a
 * fifth of a second, in which nobody could answer. */
TEST_WITH(test_stopped, set_up, NULL) {
    struct host_look look;
    begin_holder();
    look_at(&look);
    kill(holder, SIGSTOP);
    assert_int_equal(host_look_ask(&look, &all, NODE_TOP, SECOND / 5, &error),
                     HOST_CUBE);
    assert_non_null(strstr(error.text, "does not answer; "));
    assert_non_null(strstr(error.text, "kill "));
    kill(holder, SIGCONT);
    host_look_close(&look); /* its question is answered to nobody */
    memset(&error, 0, sizeof error);
    look_at(&look);
    assert_int_equal(host_look_ask(&look, &all, NODE_TOP, WAIT_US, &error), 0);
    host_look_close(&look);
    end_holder();
}

/* Whoever asks who has it, and how often: it is had. */
TEST_WITH(test_queue, set_up, NULL) {
    enum { CALLS = 200 };
    struct host_look look;
    struct host_holder who;
    char text[HOST_HOLDER_TEXT];
    begin_holder();
    look_at(&look);
    kill(holder, SIGSTOP);
    for (unsigned i = 0; i < CALLS; i++)
        assert_true(host_holder_find(&who, wire));
    assert_int_equal(who.pid, 0);
    host_holder_text(&who, text, sizeof text);
    assert_string_equal(text, "a program that stands still");
    kill(holder, SIGCONT);
    assert_int_equal(host_look_ask(&look, &all, NODE_TOP, WAIT_US, &error), 0);
    while (!host_holder_find(&who, wire) || who.pid != holder)
        (void)usleep(SECOND / 100); /* clock: looks again */
    host_look_close(&look);
    end_holder();
}

/* --- who says what is no question ----------------------------------------- */

static int call(void) {
    struct sockaddr_un address;
    socklen_t size = host_holder_address(wire, &address);
    int file = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_true(file >= 0);
    assert_int_equal(connect(file, (struct sockaddr *)&address, size), 0);
    return file;
}

/* A line, or what came before the end. */
static void hears(int file, const char *expected) {
    char line[400];
    size_t used = 0;
    while (used + 1 < sizeof line && read(file, line + used, 1) == 1 &&
           line[used] != '\n')
        used++;
    line[used] = '\0';
    if (strstr(line, expected) == NULL)
        fail_msg("no '%s' in: %s", expected, line);
}

static void says(int file, const char *text) {
    assert_int_equal(send(file, text, strlen(text), MSG_NOSIGNAL),
                     strlen(text));
}

TEST_WITH(test_nonsense, set_up, NULL) {
    static const char *const lines[] = {
        "who\n", "{\"ask\":\"who\",\"nodes\":\"9\"}\n", "{\"ask\":\"probe\"}\n",
        "{\"ask\":7}\n", "\n"};
    static char much[3 * HOST_LOOK_QUESTION_BYTES];
    char byte;
    begin_holder();
    int file = call();
    hears(file, "\"incode\":\"" NODE_VERSION "\"");
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        says(file, lines[i]);
        hears(file, "{\"error\":\"that is no question; ");
    }
    says(file, "{\"ask\":\"who\"}\n"); /* without a set: all */
    hears(file, "\"answers\":{\"");
    memset(much, '{', sizeof much - 1);
    (void)!send(file, much, strlen(much), MSG_NOSIGNAL);
    assert_true(read(file, &byte, 1) <= 0);
    close(file);
    end_holder();
}

/* Who does not read is dropped after a while; the others go on. */
TEST_WITH(test_deaf, set_up, NULL) {
    struct host_look look;
    int size = 1, file;
    begin_holder();
    file = call();
    (void)setsockopt(file, SOL_SOCKET, SO_RCVBUF, &size, sizeof size);
    hears(file, "\"incode\"");
    look_at(&look);
    for (unsigned k = 0; k < 200; k++) {
        if (send(file, "{\"ask\":\"log\"}\n", 14, MSG_NOSIGNAL) < 0)
            break;
        assert_int_equal(host_look_ask(&look, &all, NODE_TOP, WAIT_US, &error),
                         0);
    }
    close(file);
    host_look_close(&look);
    end_holder();
}

/* The next one waits for the place, and takes it. */
TEST_WITH(test_next, set_up, NULL) {
    struct host_look look;
    pid_t first;
    int first_end, status;
    begin_holder();
    first = holder;
    first_end = end;
    begin_holder();
    look_at(&look);
    assert_int_equal(look.holder.pid, first);
    host_look_close(&look);
    close(first_end);
    /* The second has its copy of that end. */
    kill(first, SIGKILL);
    assert_int_equal(waitpid(first, &status, 0), first);
    while (host_look_open(&look, wire, &error) != 0) {
        host_look_close(&look);
        memset(&error, 0, sizeof error);
    }
    assert_int_equal(look.holder.pid, holder);
    host_look_close(&look);
    end_holder();
}

/* --- what root believes --------------------------------------------------- */

enum { OTHER_USER = 65534 };

/* A process of another user that has taken the place, and has `file` open. */
static void begin_other(int file) {
    int begun[2], ended[2];
    char byte;
    assert_int_equal(pipe(begun), 0);
    assert_int_equal(pipe2(ended, O_NONBLOCK), 0);
    (void)fflush(NULL);
    holder = fork();
    if (holder == 0) {
        close(ended[1]);
        if (setresuid(OTHER_USER, OTHER_USER, OTHER_USER) != 0)
            exit(1);
        hold(begun[1], ended[0]);
    }
    close(begun[1]);
    close(ended[0]);
    assert_int_equal(read(begun[0], &byte, 1), 1);
    close(begun[0]);
    end = ended[1];
    close(file); /* that it has alone, from now on */
}

/* believed: it says so, and root takes its word. */
static void check_other(int file, bool believed) {
    struct host_look look;
    struct host_holder who;
    begin_other(file);
    assert_int_equal(host_holder_find(&who, wire), believed);
    assert_int_equal(host_look_open(&look, wire, &error),
                     believed ? 0 : HOST_CUBE);
    if (!believed)
        assert_non_null(strstr(error.text, "not have its wire open; "));
    host_look_close(&look);
    memset(&error, 0, sizeof error);
    end_holder();
}

/* A socket that listens there, and one that has called it. */
static void make_calls(int family, struct sockaddr *at, socklen_t size,
                       int *listener, int *call) {
    *listener = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_int_equal(bind(*listener, at, size), 0);
    assert_int_equal(listen(*listener, 4), 0);
    assert_int_equal(getsockname(*listener, at, &size), 0);
    *call = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_int_equal(connect(*call, at, size), 0);
}

TEST_WITH(test_other_users, set_up, NULL) {
    struct sockaddr_in in = {.sin_family = AF_INET,
                             .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    struct sockaddr_un un = {.sun_family = AF_UNIX};
    int listener, call, other;
    if (geteuid() != 0)
        skip();
    int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    assert_int_equal(grantpt(terminal) | unlockpt(terminal), 0);
    snprintf(wire, sizeof wire, "serial:%s", ptsname(terminal));
    check_other(open(ptsname(terminal), O_RDWR | O_NOCTTY), true);
    check_other(open("/dev/null", O_RDWR), false);
    close(terminal);
    make_calls(AF_INET, (struct sockaddr *)&in, sizeof in, &listener, &call);
    snprintf(wire, sizeof wire, "tcp:127.0.0.1:%u", ntohs(in.sin_port));
    check_other(call, true);
    check_other(open("/dev/null", O_RDWR), false);
    close(listener);
    snprintf(un.sun_path, sizeof un.sun_path, "/tmp/test_offer.%ld",
             (long)getpid());
    make_calls(AF_UNIX, (struct sockaddr *)&un, sizeof un, &listener, &call);
    snprintf(wire, sizeof wire, "unix:%s", un.sun_path);
    check_other(call, true);
    other = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    check_other(other, false);
    close(listener);
    assert_int_equal(unlink(un.sun_path), 0);
}
