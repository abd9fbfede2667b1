/* Resets by lines of chips that are played here: what is set when, and that
 * nothing stays active, whatever happens meanwhile. */
#define TEST_OWN_MAIN
#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/error.h"
#include "host/cube/gpio.h"
#include "host/cube/lines.h"
#include "tests/unit/test.h"

/* --- chips ---------------------------------------------------------------- */

struct host_gpio {
    unsigned offset;
};

enum { LINES_MAX = 8, NEVER = 99 };

/* Also where a child can leave it for its parent. */
static struct played {
    char told[400]; /* "+1" active, "-1" inactive, .. */
    bool active[LINES_MAX];
    unsigned open, fails_to_open, fails_to_set;
    int signal; /* comes as soon as `on` is active */
    unsigned on;
    uint64_t up_us[LINES_MAX], held_us[LINES_MAX];
} * played;

static void tell(char what, unsigned offset) {
    size_t used = strlen(played->told);
    snprintf(played->told + used, sizeof played->told - used, "%c%u ", what,
             offset);
}

int host_gpio_open(struct host_gpio **gpio, const struct host_cube_pin *pin,
                   char why[HOST_GPIO_WHY]) {
    *gpio = NULL;
    if (pin->offset == played->fails_to_open) {
        snprintf(why, HOST_GPIO_WHY, "line %u: in use by another; end it",
                 pin->offset);
        return HOST_CUBE;
    }
    *gpio = calloc(1, sizeof **gpio);
    assert_non_null(*gpio);
    (*gpio)->offset = pin->offset;
    played->active[pin->offset] = false;
    played->open++;
    return 0;
}

/* clock: lines are held no shorter than is stated. */
int host_gpio_set(struct host_gpio *gpio, bool active) {
    unsigned line = gpio->offset;
    tell(active ? '+' : '-', line);
    if (active && line == played->fails_to_set) {
        errno = EIO;
        return -1;
    }
    played->up_us[line] = active ? host_now_us() : played->up_us[line];
    played->held_us[line] = host_now_us() - played->up_us[line];
    played->active[line] = active;
    if (active && line == played->on && played->signal != 0)
        kill(getpid(), played->signal);
    return 0;
}

void host_gpio_close(struct host_gpio *gpio) {
    if (gpio != NULL) {
        played->open--;
        free(gpio);
    }
}

/* --- a cube --------------------------------------------------------------- */

static struct host_cube_file file;
static struct host_lines lines;
static struct host_error error;

/* Node 0 has both, node 1 no boot line, node 2 and node 3 none. */
static int set_up(void **unused) {
    (void)unused;
    memset(&error, 0, sizeof error);
    memset(played, 0, sizeof *played);
    played->fails_to_open = played->fails_to_set = NEVER;
    return host_cube_file_parse(
        &file, "a.cube",
        "dimension = 2; board = \"mps2-an500\";\n"
        "nodes = ( { node = 0; reset = { chip = \"c\"; line = 1; };\n"
        "            boot = { chip = \"c\"; line = 2; }; },\n"
        "          { node = 1; reset = { chip = \"c\"; line = 3; }; } );\n"
        "links = ( { node = 0; to = \"host\"; unix = \"h\"; } );",
        &error);
}

static int tear_down(void **unused) {
    (void)unused;
    host_cube_file_free(&file);
    return (int)played->open;
}

static void open_lines(void) {
    assert_int_equal(host_lines_open(&lines, &file, NULL, &error), 0);
    assert_int_equal(played->open, 3);
}

static void nothing_is_active(void) {
    for (unsigned i = 0; i < LINES_MAX; i++)
        assert_false(played->active[i]);
}

/* --- resets --------------------------------------------------------------- */

TEST_WITH(a_reset, set_up, tear_down) {
    assert_true(host_lines_has(&file, 0, HOST_LINE_BOOT));
    assert_false(host_lines_has(&file, 1, HOST_LINE_BOOT));
    open_lines();
    assert_int_equal(host_lines_reset(&lines, 0, false, &error), 0);
    assert_string_equal(played->told, "+1 -1 ");
    assert_true(played->held_us[1] >= HOST_RESET_MS * 1000);
    host_lines_close(&lines);
}

TEST_WITH(a_loader_that_waits, set_up, tear_down) {
    open_lines();
    assert_int_equal(host_lines_reset(&lines, 0, true, &error), 0);
    assert_string_equal(played->told, "+2 +1 -1 -2 ");
    assert_true(played->held_us[1] >= HOST_RESET_MS * 1000);
    assert_true(played->held_us[2] >= (HOST_RESET_MS + HOST_BOOT_MS) * 1000);
    assert_int_equal(host_lines_reset(&lines, 1, true, &error), 0);
    assert_string_equal(played->told, "+2 +1 -1 -2 +3 -3 ");
    host_lines_close(&lines);
}

TEST_WITH(a_node_without_one, set_up, tear_down) {
    open_lines();
    assert_int_equal(host_lines_reset(&lines, 3, false, &error), HOST_CUBE);
    assert_non_null(strstr(error.text, "a.cube: node 3 has no reset line; "));
    assert_string_equal(played->told, "");
    host_lines_close(&lines);
}

TEST_WITH(a_line_in_use, set_up, tear_down) {
    played->fails_to_open = 3;
    assert_int_equal(host_lines_open(&lines, &file, NULL, &error), HOST_CUBE);
    assert_string_equal(error.text,
                        "a.cube:4: the reset line of node 1: line 3: in use by "
                        "another; end it");
    assert_int_equal(played->open, 0);
}

TEST_WITH(a_line_that_fails, set_up, tear_down) {
    open_lines();
    played->fails_to_set = 1;
    assert_int_equal(host_lines_reset(&lines, 0, true, &error), HOST_CUBE);
    assert_non_null(
        strstr(error.text, "a.cube:2: the reset line of node 0 (c): "));
    assert_string_equal(played->told, "+2 +1 -1 -2 ");
    nothing_is_active();
    host_lines_close(&lines);
}

/* --- signals -------------------------------------------------------------- */

static volatile sig_atomic_t seen;
static volatile bool active_then;

static void see(int signal) {
    seen = signal;
    for (unsigned i = 0; i < LINES_MAX; i++)
        active_then = active_then || played->active[i];
}

/* A reset of node 0 in which a signal comes while line `on` is active. */
static int reset_amid(int signal, unsigned on, void (*handler)(int)) {
    struct sigaction action = {.sa_handler = handler}, before;
    open_lines();
    seen = 0;
    active_then = false;
    played->signal = signal;
    played->on = on;
    assert_int_equal(sigaction(signal, &action, &before), 0);
    int status = host_lines_reset(&lines, 0, true, &error);
    assert_int_equal(sigaction(signal, &before, &action), 0);
    assert_ptr_equal(action.sa_handler, handler);
    assert_false(active_then);
    nothing_is_active();
    host_lines_close(&lines);
    return status;
}

/* Its handler comes when nothing is active any more. */
TEST_WITH(a_signal_that_is_handled, set_up, tear_down) {
    static const int ends[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};
    for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++) {
        memset(&error, 0, sizeof error);
        assert_int_equal(reset_amid(ends[i], 1 + i % 2, see), HOST_CUBE);
        assert_int_equal(seen, ends[i]);
        assert_non_null(strstr(error.text, "cut the reset of node 0 short"));
    }
}

/* Ctrl-Z waits for the end of the reset. */
TEST_WITH(a_signal_that_stops, set_up, tear_down) {
    assert_int_equal(reset_amid(SIGTSTP, 1, see), 0);
    assert_int_equal(seen, SIGTSTP);
    assert_true(played->held_us[1] >= HOST_RESET_MS * 1000);
}

TEST_WITH(a_signal_that_is_ignored, set_up, tear_down) {
    assert_int_equal(reset_amid(SIGHUP, 1, SIG_IGN), 0);
    assert_true(played->held_us[1] >= HOST_RESET_MS * 1000);
}

/* The program ends by it as it would have without. */
TEST_WITH(a_signal_that_ends_the_program, set_up, tear_down) {
    int status = 0;
    pid_t child = fork();
    if (child == 0) {
        (void)reset_amid(SIGTERM, 1, SIG_DFL);
        _exit(0);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status));
    assert_int_equal(WTERMSIG(status), SIGTERM);
    assert_string_equal(played->told, "+2 +1 -1 -2 ");
    nothing_is_active();
    played->open = 0; /* the child's */
}

/* --- the host's port ------------------------------------------------------ */

/* A terminal that has no such lines, in the hands of another. */
TEST_WITH(a_port_without_them, set_up, tear_down) {
    static struct host_remote remote;
    int master = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(master >= 0 && grantpt(master) == 0 && unlockpt(master) == 0);
    host_cube_file_free(&file);
    assert_int_equal(
        host_cube_file_parse(&file, "a.cube",
                             "dimension = 0; links = ( { node = 0; to = "
                             "\"host\";\n serial = [\"uart\", \"/dev/t\"]; "
                             "dtr = \"reset\"; } );",
                             &error),
        0);
    remote.port[0].serial.pipe.fd = master;
    assert_int_equal(host_lines_open(&lines, &file, &remote, &error), 0);
    assert_int_equal(host_lines_reset(&lines, 0, false, &error), HOST_CUBE);
    assert_non_null(
        strstr(error.text, "a.cube:2: the reset line of node 0 (/dev/t): "));
    host_lines_close(&lines);
    close(master);
    memset(&error, 0, sizeof error);
    remote.port[0].serial.pipe.fd = -1;
    assert_int_equal(host_lines_open(&lines, &file, &remote, &error), 0);
    assert_int_equal(host_lines_reset(&lines, 0, false, &error), HOST_CUBE);
    assert_non_null(strstr(error.text, strerror(ENODEV)));
    host_lines_close(&lines);
    /* Nobody has it. */
    memset(&error, 0, sizeof error);
    assert_int_equal(host_lines_open(&lines, &file, NULL, &error), HOST_CUBE);
    assert_non_null(strstr(error.text, "/dev/t: "));
}

int main(void) {
    played = mmap(NULL, sizeof *played, PROT_READ | PROT_WRITE,
                  MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    return played == MAP_FAILED ? 1 : test_run();
}
