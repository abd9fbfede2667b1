/* An output that is not whole leaves nothing: not by a signal, nor beyond the
 * limit of a file's size. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "../../host/output.h"

enum { OUTPUTS = 4 };

/* A directory of its own, which is the current one. */
static char directory[] = "/tmp/incode-output-XXXXXX";
static const char *const names[OUTPUTS] = {"a.node", "a.neigh", "a.face",
                                           "a.ele"};

static int enter(void **unused)
{
    (void)unused;
    return mkdtemp(directory) != NULL && chdir(directory) == 0 ? 0 : -1;
}

static int leave(void **unused)
{
    (void)unused;
    return chdir("/") == 0 && rmdir(directory) == 0 ? 0 : -1;
}

static unsigned files(void)
{
    unsigned count = 0;
    DIR *all = opendir(".");
    assert_non_null(all);
    for (struct dirent *one; (one = readdir(all)) != NULL;) {
        count += one->d_name[0] != '.';
    }
    (void)closedir(all);
    return count;
}

static void open_all(struct host_output *out, struct host_error *error)
{
    for (int i = 0; i < OUTPUTS; i++) {
        if (host_output_open(&out[i], names[i], error) != 0) {
            _exit(100);
        }
        host_output_text(&out[i], "not whole");
    }
}

/* In a process of its own: opens outputs, closes `closed` of them, ends. */
static _Noreturn void be_ended(int number, int closed, void (*ignored)(int))
{
    struct host_output out[OUTPUTS];
    struct host_error error = {0};
    (void)signal(number, ignored);
    host_output_guard();
    open_all(out, &error);
    if (files() != OUTPUTS ||
        host_output_close(out, (size_t)closed, &error) != 0) {
        _exit(101);
    }
    (void)raise(number);
    host_output_close(out + closed, (size_t)(OUTPUTS - closed), &error);
    _exit(error.code);
}

static int ended(int number, int closed, void (*ignored)(int))
{
    int status = -1;
    pid_t child = fork();
    if (child == 0) {
        be_ended(number, closed, ignored);
    }
    assert_true(child > 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    return status;
}

static void a_signal_leaves_no_parts(void **unused)
{
    (void)unused;
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
    for (int i = 0; i < 3; i++) {
        for (int closed = 0; closed <= OUTPUTS; closed += 2) {
            int status = ended(numbers[i], closed, SIG_DFL);
            assert_true(WIFSIGNALED(status));
            assert_int_equal(WTERMSIG(status), numbers[i]);
            assert_int_equal(files(), closed);
            for (int k = 0; k < closed; k++) {
                assert_int_equal(unlink(names[k]), 0);
            }
        }
    }
}

static void an_ignored_signal_stays_ignored(void **unused)
{
    (void)unused;
    int status = ended(SIGHUP, 0, SIG_IGN);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    assert_int_equal(files(), OUTPUTS);
    for (int k = 0; k < OUTPUTS; k++) {
        assert_int_equal(unlink(names[k]), 0);
    }
}

static void a_limit_is_an_error(void **unused)
{
    (void)unused;
    struct rlimit limit, little;
    struct host_output out[OUTPUTS];
    struct host_error error = {0};
    char *bytes = calloc(1, 4096);
    assert_non_null(bytes);
    host_output_guard();
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    little = limit;
    little.rlim_cur = 1000;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &little), 0);
    open_all(out, &error);
    host_output_bytes(&out[2], bytes, 4096);
    assert_int_equal(host_output_close(out, OUTPUTS, &error), HOST_INPUT);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    assert_non_null(strstr(error.text, "a.face: writing failed (File too"));
    assert_int_equal(files(), 0);
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_signal_leaves_no_parts),
        cmocka_unit_test(an_ignored_signal_stays_ignored),
        cmocka_unit_test(a_limit_is_an_error),
    };
    return cmocka_run_group_tests(tests, enter, leave);
}
