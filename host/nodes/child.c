#include "child.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/base/clock.h"
#include "node/board.h"

/* Ends with the reason in `report`, which a program that begins closes. */
static _Noreturn void become(const struct host_child *child, pid_t host,
                             int report) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    (void)setpgid(0, 0);     /* an interrupt from the terminal is the host's */
    if (getppid() == host) { /* else it ended before it could be watched */
        int null = open("/dev/null", O_RDWR | O_CLOEXEC);
        dup2(null, STDIN_FILENO);
        dup2(null, STDOUT_FILENO);
        child->become(child->context, child->node);
        int reason = errno;
        (void)!write(report, &reason, sizeof reason);
    }
    _exit(127);
}

int host_child_start(struct host_process *process,
                     const struct host_child *child, struct host_error *error) {
    int report[2], reason = 0;
    if (pipe2(report, O_CLOEXEC) != 0) {
        return host_fail(error, HOST_BROKEN, "node %u: %s; close some files",
                         child->node, strerror(errno));
    }
    pid_t host = getpid(), started = fork();
    if (started == 0) {
        become(child, host, report[1]);
    }
    reason = errno;
    close(report[1]);
    if (started < 0) {
        close(report[0]);
        return host_fail(error, HOST_CUBE, "node %u: %s; %s", child->node,
                         strerror(reason), child->otherwise);
    }
    process->pid = started;
    ssize_t got;
    do {
        got = read(report[0], &reason, sizeof reason);
    } while (got < 0 && errno == EINTR);
    close(report[0]);
    if (got == (ssize_t)sizeof reason) {
        return host_fail(error, HOST_CUBE,
                         "node %u: %s: %s; run make to build it anew",
                         child->node, child->path, strerror(reason));
    }
    return 0;
}

/* --- its end -------------------------------------------------------------- */

static bool reap(struct host_process *process, int flags) {
    int status;
    if (process->pid == 0 ||
        waitpid(process->pid, &status, flags) != process->pid) {
        return false;
    }
    process->pid = 0;
    process->status = status;
    return true;
}

bool host_child_any_died(void) {
    siginfo_t who = {0};
    return waitid(P_ALL, 0, &who, WEXITED | WNOHANG | WNOWAIT) != 0 ||
           who.si_pid != 0;
}

bool host_child_died(struct host_process *process) {
    return reap(process, WNOHANG);
}

bool host_child_kill(const struct host_process *process) {
    return process->pid != 0 && kill(process->pid, SIGKILL) == 0;
}

void host_child_wait(struct host_process *process) {
    (void)reap(process, 0);
}

static int describe(const struct host_process *process, unsigned node,
                    unsigned link, struct host_error *error) {
    int status = process->status;
    if (WIFSIGNALED(status)) {
        int number = WTERMSIG(status);
        return host_fail(
            error, HOST_CUBE,
            "node %u link %u: ended %u times, the last by signal %d (%s)%s; "
            "run again, and look for what stopped it",
            node, link, process->deaths, number, strsignal(number),
            number == SIGILL    ? ", an invariant failed"
            : number == SIGSEGV ? ", perhaps out of its memory"
                                : "");
    }
    return host_fail(error, HOST_CUBE,
                     "node %u link %u: ended %u times, the last with status "
                     "%d; see what it printed, and run again",
                     node, link, process->deaths, WEXITSTATUS(status));
}

/* What kills from without may stop; a node that ends by itself would do so
 * again. */
int host_child_check(struct host_process *process, unsigned node, unsigned link,
                     struct host_error *error) {
    uint64_t now = host_now_us();
    int status = process->status;
    bool killed = WIFSIGNALED(status) &&
                  (WTERMSIG(status) == SIGKILL || WTERMSIG(status) == SIGTERM);
    bool told = WIFEXITED(status) && (WEXITSTATUS(status) == NODE_RESET_AGAIN ||
                                      WEXITSTATUS(status) == NODE_RESET_STAY);
    if (now - process->deaths_us > HOST_DEATHS_US) {
        process->deaths = process->faults;
        process->deaths_us = now;
    }
    process->deaths++;
    process->faults += !killed && !told;
    return process->faults < HOST_FAULTS_MAX &&
                   process->deaths < HOST_DEATHS_MAX
               ? 0
               : describe(process, node, link, error);
}

uint64_t host_child_starved_us(const struct host_process *process) {
    char path[64];
    unsigned long long ran_ns, waited_ns = 0;
    snprintf(path, sizeof path, "/proc/%ld/schedstat", (long)process->pid);
    FILE *file = process->pid > 0 ? fopen(path, "re") : NULL;
    if (file != NULL) {
        int read = fscanf(file, "%llu %llu", &ran_ns, &waited_ns);
        waited_ns = read == 2 ? waited_ns : 0;
        fclose(file);
    }
    return waited_ns / 1000;
}
