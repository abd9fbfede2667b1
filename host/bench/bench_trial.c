#include "bench_trial.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/pidfd.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/clock.h"

enum { LOOK_MS = 100 };

/* In the child. */
static _Noreturn void become(char *const words[], pid_t bench, int out,
                             int err) {
    int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() == bench) { /* else it ended before it could be watched */
        (void)dup2(null, STDIN_FILENO);
        (void)dup2(out, STDOUT_FILENO);
        (void)dup2(err, STDERR_FILENO);
        (void)execvp(words[0], words);
        (void)dprintf(STDERR_FILENO, "%s: %s\n", words[0], strerror(errno));
    }
    _exit(127);
}

/* Waits for the child, which it ends at the limit. */
static void await(pid_t child, double limit_s, struct host_trial *trial) {
    uint64_t begin = host_now_us();
    int end = pidfd_open(child, 0), status = 0;
    struct pollfd ended = {.fd = end, .events = POLLIN};
    while (poll(&ended, 1, LOOK_MS) <= 0) {
        double s = 1e-6 * (double)(host_now_us() - begin);
        if (s > limit_s) {
            trial->late = true;
            (void)kill(child, SIGKILL);
            break;
        }
    }
    (void)close(end);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    trial->status =
        WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/* The last line that is not empty. */
static void last_line(FILE *err, char *text, size_t size) {
    char line[400];
    rewind(err);
    while (fgets(line, sizeof line, err) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        if (line[0] != '\0') {
            (void)snprintf(text, size, "%s", line);
        }
    }
}

static double real(const json_t *object, const char *name) {
    return json_number_value(json_object_get(object, name));
}

static uint64_t whole(const json_t *object, const char *name) {
    return (uint64_t)json_integer_value(json_object_get(object, name));
}

static void read_said(FILE *out, struct host_trial *t) {
    rewind(out);
    json_t *said = json_loadf(out, 0, NULL);
    json_t *nodes = json_object_get(said, "per_node"), *node;
    const char *digest = json_string_value(json_object_get(said, "digest"));
    size_t i;
    t->tetrahedra = whole(said, "tetrahedra");
    t->pages = whole(said, "pages");
    t->host_s = real(said, "host_triangulation_cpu_s");
    t->host_all_s = real(said, "host_cpu_s");
    t->cpu_s = real(said, "cpu_s");
    t->wall_s = real(said, nodes == NULL ? "wall_s" : "time_triangulation_s");
    (void)snprintf(t->digest, sizeof t->digest, "%s",
                   digest == NULL ? "" : digest);
    json_array_foreach(nodes, i, node) {
        t->cpu_s += real(node, "cpu_s");
        t->pages_asked += whole(node, "page_requests");
    }
    json_decref(said);
}

int host_trial_run(char *const words[], double limit_s,
                   struct host_trial *trial, struct host_error *error) {
    FILE *out = tmpfile(), *err = tmpfile();
    pid_t bench = getpid();
    uint64_t begin = host_now_us();
    memset(trial, 0, sizeof *trial);
    pid_t child = out == NULL || err == NULL ? -1 : fork();
    if (child == 0) {
        become(words, bench, fileno(out), fileno(err));
    }
    if (child < 0) {
        host_fail(error, HOST_BROKEN, "%s: %s; free memory or room in /tmp",
                  words[0], strerror(errno));
    } else {
        await(child, limit_s, trial);
        trial->whole_s = 1e-6 * (double)(host_now_us() - begin);
        last_line(err, trial->said, sizeof trial->said);
        if (!trial->late && trial->status == 0) {
            read_said(out, trial);
        }
    }
    if (out != NULL) {
        (void)fclose(out);
    }
    if (err != NULL) {
        (void)fclose(err);
    }
    return error->code;
}
