/* All outputs get their names or none, and what fails leaves nothing new: not
 * by a signal, nor beyond the limit of a file's size. */

#include "tests/unit/test.h"
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdbool.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/formats/output.h"

enum { OUTPUTS = 4 };

static void put(const char *name, const char *text) {
    FILE *file = fopen(name, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

/* What the host calls in the place of the C library's. */
static bool no_links;
static int
    raise_at; /* the change of a name that a signal comes with; 0: none */
static const char *taken_over; /* a name that another file has soon after */

int link(const char *from, const char *to) {
    if (no_links && access(from, F_OK) == 0) {
        errno = EPERM;
        return -1;
    }
    return (int)syscall(SYS_linkat, AT_FDCWD, from, AT_FDCWD, to, 0);
}

int rename(const char *from, const char *to) {
    if (raise_at > 0 && --raise_at == 0)
        (void)raise(SIGTERM);
    if (taken_over != NULL && strcmp(to, taken_over) != 0) {
        (void)unlink(taken_over);
        put(taken_over, "of somebody else");
        taken_over = NULL;
    }
    return (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
}

/* A directory of its own, which is the current one. */
static char directory[] = "/tmp/incode-output-XXXXXX";
static const char *const names[OUTPUTS] = {"a.node", "a.neigh", "a.face",
                                           "a.ele"};

static int enter(void **unused) {
    (void)unused;
    return mkdtemp(directory) != NULL && chdir(directory) == 0 ? 0 : -1;
}

static int leave(void **unused) {
    (void)unused;
    return chdir("/") == 0 && rmdir(directory) == 0 ? 0 : -1;
}

static unsigned files(void) {
    unsigned count = 0;
    DIR *all = opendir(".");
    assert_non_null(all);
    for (struct dirent *one; (one = readdir(all)) != NULL;)
        count += one->d_name[0] != '.';
    (void)closedir(all);
    return count;
}

/* Takes the file away, whose text this is. */
static void take(const char *name, const char *text) {
    char found[64] = "";
    FILE *file = fopen(name, "r");
    if (file == NULL) {
        fail_msg("there is no %s", name);
    } else {
        assert_non_null(fgets(found, sizeof found, file));
        (void)fclose(file);
    }
    assert_string_equal(found, text);
    assert_int_equal(unlink(name), 0);
}

static const char *beside(const char *name, const char *what, pid_t writer) {
    static char text[64];
    (void)snprintf(text, sizeof text, "%s.%s-%ld", name, what, (long)writer);
    return text;
}

static void open_all(struct host_output *out, struct host_error *error) {
    for (int i = 0; i < OUTPUTS; i++) {
        if (host_output_open(&out[i], names[i], error) != 0)
            _exit(100);
        host_output_text(&out[i], "not whole");
    }
}

/* In a process of its own: opens outputs, closes `closed` of them, is ended, or
 * else gives all of them their names. */
static _Noreturn void be_ended(int number, int closed, void (*ignored)(int)) {
    struct host_output out[OUTPUTS];
    struct host_error error = {0};
    (void)signal(number, ignored);
    host_output_guard();
    open_all(out, &error);
    if (files() != OUTPUTS ||
        host_output_close(out, (size_t)closed, &error) != 0)
        _exit(101);
    (void)raise(number);
    host_output_close(out + closed, (size_t)(OUTPUTS - closed), &error);
    host_output_commit(&error);
    (void)raise(number); /* too late */
    _exit(error.code);
}

static int ended(int number, int closed, void (*ignored)(int)) {
    int status = -1;
    pid_t child = fork();
    if (child == 0)
        be_ended(number, closed, ignored);
    assert_true(child > 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    return status;
}

TEST(a_signal_leaves_no_parts) {
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
    for (int i = 0; i < 3; i++) {
        for (int closed = 0; closed <= OUTPUTS; closed += 2) {
            int status = ended(numbers[i], closed, SIG_DFL);
            assert_true(WIFSIGNALED(status));
            assert_int_equal(WTERMSIG(status), numbers[i]);
            assert_int_equal(files(), 0);
        }
    }
}

/* What a process says that is ended while this is its output; NULL: none. */
static const char *last_words(int number, const char *path) {
    static char said[256];
    int ends[2], status = -1;
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    if (child == 0) {
        struct host_error error = {0};
        struct host_output out;
        (void)dup2(ends[1], STDERR_FILENO);
        host_output_guard();
        if (path != NULL && host_output_open(&out, path, &error) == 0) {
            host_output_text(&out, "not whole");
            (void)host_output_close(&out, 1, &error);
        }
        (void)raise(number);
        _exit(101);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == number);
    (void)close(ends[1]);
    ssize_t n = read(ends[0], said, sizeof said - 1);
    said[n > 0 ? n : 0] = '\0';
    (void)close(ends[0]);
    return said;
}

TEST(a_signal_says_what_is_written) {
    assert_string_equal(last_words(SIGINT, names[0]),
                        "incode: interrupted; no output was written\n");
    assert_string_equal(last_words(SIGTERM, names[0]),
                        "incode: terminated; no output was written\n");
    assert_string_equal(
        last_words(SIGINT, "/dev/null"),
        "incode: interrupted; what was written so far is not whole\n");
    assert_string_equal(last_words(SIGHUP, NULL), "incode: hung up\n");
    assert_int_equal(files(), 0);
}

TEST(an_ignored_signal_stays_ignored) {
    int status = ended(SIGHUP, 0, SIG_IGN);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    assert_int_equal(files(), OUTPUTS);
    for (int k = 0; k < OUTPUTS; k++)
        take(names[k], "not whole");
}

TEST(a_signal_amid_the_names_is_too_late) {
    for (int at = 1; at <= OUTPUTS; at++) {
        raise_at = at;
        int status = ended(0, OUTPUTS, SIG_DFL);
        raise_at = 0;
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
        assert_int_equal(files(), OUTPUTS);
        for (int k = 0; k < OUTPUTS; k++)
            take(names[k], "not whole");
    }
}

/* More than one command line can ask for. */
TEST(however_many_there_are) {
    enum { MANY = 100 };
    int status = -1;
    pid_t child = fork();
    if (child == 0) {
        struct host_error error = {0};
        host_output_guard();
        for (int i = 0; i < MANY; i++) {
            struct host_output out;
            char name[16];
            (void)snprintf(name, sizeof name, "%d.npy", i);
            if (host_output_open(&out, name, &error) != 0 ||
                host_output_close(&out, 1, &error) != 0)
                _exit(100);
        }
        (void)raise(files() == MANY ? SIGTERM : SIGKILL);
        _exit(101);
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
    assert_int_equal(files(), 0);
}

TEST(what_was_there_outlives_a_failure) {
    struct host_output out[OUTPUTS];
    struct host_error error = {0};
    put(names[1], "former");
    open_all(out, &error);
    assert_int_equal(host_output_close(out, OUTPUTS, &error), 0);
    assert_int_equal(host_fail(&error, HOST_CUBE, "later"), HOST_CUBE);
    assert_int_equal(host_output_commit(&error), HOST_CUBE);
    assert_int_equal(files(), 1);
    take(names[1], "former");
}

/* a.face is a directory by then; a.node was a file before. */
static void fail_amid_the_names(struct host_error *error) {
    struct host_output out[OUTPUTS];
    put(names[0], "former");
    open_all(out, error);
    assert_int_equal(host_output_close(out, OUTPUTS, error), 0);
    assert_int_equal(mkdir(names[2], 0777), 0);
    assert_int_equal(host_output_commit(error), HOST_INPUT);
    assert_int_equal(rmdir(names[2]), 0);
}

TEST(all_get_their_names_or_none) {
    struct host_error error = {0};
    fail_amid_the_names(&error);
    assert_string_equal(error.text, "a.face: cannot be written (Is a "
                                    "directory); choose another place");
    assert_int_equal(files(), 1);
    take(names[0], "former");
}

TEST(what_cannot_be_kept_is_told) {
    struct host_error error = {0};
    no_links = true;
    fail_amid_the_names(&error);
    no_links = false;
    assert_non_null(strstr(error.text, "what was in a.node before is lost; "));
    assert_int_equal(files(), 0);
}

TEST(what_a_killed_process_left_is_no_hindrance) {
    struct host_output out[OUTPUTS], again;
    struct host_error error = {0}, other = {0};
    put(names[0], "former");
    put(beside(names[0], "part", getpid()), "left");
    put(beside(names[0], "kept", getpid()), "left");
    open_all(out, &error);
    /* but what this process has begun is not taken from it */
    assert_int_equal(host_output_open(&again, names[1], &other), HOST_INPUT);
    assert_int_equal(host_output_close(out, OUTPUTS, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    assert_int_equal(files(), OUTPUTS);
    for (int k = 0; k < OUTPUTS; k++)
        take(names[k], "not whole");
}

static void write_one(const char *path) {
    struct host_output out;
    struct host_error error = {0};
    assert_int_equal(host_output_open(&out, path, &error), 0);
    host_output_text(&out, "new");
    assert_int_equal(host_output_close(&out, 1, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
}

TEST(links_to_what_is_not_yet_are_followed) {
    struct host_output out;
    struct host_error error = {0};
    assert_int_equal(mkdir("sub", 0777), 0);
    assert_int_equal(symlink("sub/second", "first"), 0);
    assert_int_equal(symlink("../third", "sub/second"), 0);
    write_one("first");
    take("third", "new");
    assert_int_equal(unlink("sub/second"), 0);
    write_one("first");
    take("sub/second", "new");
    assert_int_equal(symlink("../first", "sub/second"), 0);
    assert_int_equal(host_output_open(&out, "first", &error), HOST_INPUT);
    assert_non_null(strstr(error.text, "first: cannot be written (Too many"));
    assert_int_equal(unlink("sub/second"), 0);
    assert_int_equal(unlink("first"), 0);
    assert_int_equal(rmdir("sub"), 0);
}

/* Of a lost process, from outside. */
static const pid_t lost = 4194305; /* no process has it */

/* What it left of `name` once that had the name, beside what `former` was. */
static void leave_whole(const char *name, const char *former) {
    put(name, "new");
    assert_int_equal(link(name, beside(name, "made", lost)), 0);
    if (former != NULL)
        put(beside(name, "kept", lost), former);
}

TEST(cleaning_takes_no_more_than_was_made) {
    assert_int_equal(mkdir("sub", 0777), 0);
    assert_int_equal(symlink("sub/file", "link"), 0);
    assert_int_equal(mkfifo("pipe", 0666), 0);
    leave_whole("sub/file", NULL);
    put(beside("sub/file", "part", lost), "part");
    host_output_clean("link", lost);
    host_output_clean("pipe", lost);
    assert_int_equal(rmdir("sub"), 0); /* it is empty */
    assert_int_equal(unlink("link"), 0);
    assert_int_equal(unlink("pipe"), 0);
    /* ended while names changed: after, and before this one had its own */
    leave_whole("file", "former");
    host_output_clean("file", lost);
    assert_int_equal(files(), 1);
    put(beside("file", "part", lost), "part");
    assert_int_equal(link(beside("file", "part", lost), "other"), 0);
    assert_int_equal(rename("other", beside("file", "made", lost)), 0);
    assert_int_equal(link("file", beside("file", "kept", lost)), 0);
    host_output_clean("file", lost);
    assert_int_equal(files(), 1);
    take("file", "former");
}

/* Changed, or put there anew, while a run went on that failed. */
TEST(cleaning_leaves_the_files_of_others) {
    put("file", "former");
    assert_int_equal(chmod("file", 0600), 0);
    put(beside("file", "part", lost), "part");
    host_output_clean("file", lost);
    assert_int_equal(files(), 1);
    take("file", "former");
    leave_whole("file", "former");
    assert_int_equal(unlink("file"), 0);
    put("file", "of somebody else");
    host_output_clean("file", lost);
    assert_int_equal(files(), 1);
    take("file", "of somebody else");
}

/* Nor does the process itself take more back than it has put there. */
TEST(a_name_taken_over_is_left) {
    struct host_output out[OUTPUTS];
    struct host_error error = {0};
    open_all(out, &error);
    assert_int_equal(host_output_close(out, OUTPUTS, &error), 0);
    taken_over = names[0];
    assert_int_equal(mkdir(names[2], 0777), 0);
    assert_int_equal(host_output_commit(&error), HOST_INPUT);
    assert_null(taken_over);
    assert_int_equal(rmdir(names[2]), 0);
    assert_int_equal(files(), 1);
    take(names[0], "of somebody else");
}

TEST(a_limit_is_an_error) {
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

TEST_GROUP(enter, leave)
