#include "child.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

/* Ends with the reason in `report`, which a program that begins closes. */
static _Noreturn void become(const struct host_child *child, pid_t host,
                             int report)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
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

int host_child_start(pid_t *pid, const struct host_child *child,
                     struct host_error *error)
{
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
    *pid = started;
    ssize_t got = read(report[0], &reason, sizeof reason);
    close(report[0]);
    if (got == (ssize_t)sizeof reason) {
        return host_fail(error, HOST_CUBE,
                         "node %u: %s: %s; run make to build it anew",
                         child->node, child->path, strerror(reason));
    }
    return 0;
}
