#include "child_run.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

enum { FOREGROUND_MS = 20, NO_PROGRAM = 127, BY_SIGNAL = 128 };

/* Signals are held back until the child has its own ways with them: one that
 * came before would be lost. */
static _Noreturn void become(const char *const *words, const int *report,
                             pid_t host, const sigset_t *signals) {
    int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    (void)setpgid(0, 0);
    for (int i = 1; i < NSIG; i++) {
        struct sigaction action;
        if (sigaction(i, NULL, &action) == 0 && action.sa_handler != SIG_IGN) {
            (void)signal(i, SIG_DFL);
        }
    }
    (void)sigprocmask(SIG_SETMASK, signals, NULL);
    (void)prctl(PR_SET_PDEATHSIG, SIGTERM);
    (void)dup2(null, STDIN_FILENO);
    if (report != NULL) {
        (void)dup2(report[1], STDOUT_FILENO);
        (void)dup2(report[1], STDERR_FILENO);
    }
    if (getppid() == host) { /* else it ended before it could be watched */
        (void)execv("/proc/self/exe", (char *const *)words);
    }
    _exit(NO_PROGRAM);
}

int host_child_run_begin(struct host_child_run *run, const char *const *words,
                         bool quiet, struct host_error *error) {
    int report[2] = {-1, -1};
    pid_t host = getpid();
    if (quiet && pipe2(report, O_CLOEXEC) != 0) {
        return host_fail(error, HOST_BROKEN, "run: %s; close some files",
                         strerror(errno));
    }
    sigset_t all, before;
    (void)sigfillset(&all);
    (void)fflush(NULL);
    (void)sigprocmask(SIG_SETMASK, &all, &before);
    pid_t pid = fork();
    if (pid == 0) {
        become(words, quiet ? report : NULL, host, &before);
    }
    int reason = errno;
    (void)sigprocmask(SIG_SETMASK, &before, NULL);
    if (quiet) {
        (void)close(report[1]);
        (void)fcntl(report[0], F_SETFL, O_NONBLOCK);
    }
    if (pid < 0) {
        if (quiet) {
            (void)close(report[0]);
        }
        return host_fail(error, HOST_BROKEN, "run: %s; end some processes",
                         strerror(reason));
    }
    *run = (struct host_child_run){.pid = pid, .said = report[0]};
    return 0;
}

static void take(struct host_child_run *run, const char *bytes, size_t size,
                 void (*say)(void *context, const char *text), void *context) {
    for (size_t i = 0; i < size; i++) {
        bool end = bytes[i] == '\n';
        if (!end) {
            run->line[run->used++] = bytes[i];
        }
        if (end || run->used == sizeof run->line - 1) {
            run->line[run->used] = '\0';
            run->used = 0;
            say(context, run->line);
        }
    }
}

/* True: there will be no more. */
static bool read_said(struct host_child_run *run,
                      void (*say)(void *context, const char *text),
                      void *context) {
    char bytes[1024];
    for (;;) {
        ssize_t n = read(run->said, bytes, sizeof bytes);
        if (n <= 0) {
            return n == 0;
        }
        take(run, bytes, (size_t)n, say, context);
    }
}

bool host_child_run_look(struct host_child_run *run, int *status,
                         void (*say)(void *context, const char *text),
                         void *context, uint64_t wait_us) {
    struct pollfd said = {run->said, POLLIN, 0};
    int found, wait_ms = (int)(wait_us / 1000);
    bool over = false;
    if (run->said < 0 && wait_ms > FOREGROUND_MS) {
        wait_ms = FOREGROUND_MS;
    }
    if (waitpid(run->pid, &found, WNOHANG) != run->pid) {
        (void)poll(&said, run->said < 0 ? 0 : 1, wait_ms);
        over = run->said >= 0 && read_said(run, say, context);
        if (waitpid(run->pid, &found, over ? 0 : WNOHANG) != run->pid) {
            return false;
        }
    }
    if (run->said >= 0) {
        (void)read_said(run, say, context);
        if (run->used > 0) {
            take(run, "\n", 1, say, context);
        }
        (void)close(run->said);
    }
    run->pid = 0;
    *status =
        WIFEXITED(found) ? WEXITSTATUS(found) : BY_SIGNAL + WTERMSIG(found);
    return true;
}

void host_child_run_interrupt(const struct host_child_run *run) {
    if (run->pid > 0) {
        (void)kill(run->pid, SIGINT);
    }
}
