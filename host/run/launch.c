#include "launch.h"

#include <errno.h>
#include <fcntl.h>
#include <mpi.h> /* its version alone */
#include <poll.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "host/formats/output.h"
#include "host/base/error.h"
#include "host/base/text.h"
#include "boards/processor/processor.h"
#include "transport/drivers/mpi_environment.h"

/* Of what was closed, nothing is read, and writing to it remains an error. */
static void open_standard(void) {
    int file;
    do {
        file = open("/dev/null", O_RDONLY);
    } while (file >= 0 && file <= STDERR_FILENO);
    if (file > STDERR_FILENO)
        (void)close(file);
}

void host_begin(const char *name) {
    (void)prctl(PR_SET_NAME, name);
    open_standard();
    (void)signal(SIGCHLD, SIG_DFL);
    host_output_guard();
}

int host_begin_processor(struct host_error *error) {
    const char *name = getenv(PROCESSOR_VARIABLE);
    const char *what = processor_force(name);
    if (what == NULL)
        return 0;
    return host_fail(error, HOST_USAGE, PROCESSOR_VARIABLE "=%s: %s; %s", name,
                     what, processor_allowed());
}

/* --- launch --------------------------------------------------------------- */

#define SOCKET_NAME "INCODE_LAUNCHER"
#define REPORT_NAME "INCODE_REPORT"

enum {
    SAID_BYTES = 16384, /* kept of what mpirun says: its beginning */
    STREAMS = 3,
    TURN_MS = 200,
    END_US_MAX = 5000000, /* for mpirun, once rank 0 is gone */
    KILL_US_MAX = 2500000
};

/* What rank 0 has to say at its end. */
struct report {
    int status, lost;
    bool ended; /* from outside */
};

struct launch {
    int listener;
    int host;       /* connection of rank 0; -1: none yet, or gone */
    pid_t host_pid; /* of rank 0; 0: it never came */
    bool reported;
    struct report report;
    pid_t mpirun;
    int said_file;
    char said[SAID_BYTES];
    size_t said_size;
    uint64_t gone_us;  /* when rank 0 went; 0: not yet */
    uint64_t ended_us; /* when mpirun was told to end; 0: not yet */
};

static volatile sig_atomic_t caught;

static void catch (int signal) {
    caught = signal;
}

/* --- in a rank ------------------------------------------------------------ */

int host_launch_rank(void) {
    static const char *const names[] = {"OMPI_COMM_WORLD_RANK", "PMIX_RANK",
                                        "PMI_RANK"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const char *text = getenv(names[i]);
        uint64_t rank;
        if (text != NULL && host_parse_number(text, 0, INT32_MAX, &rank) == 0)
            return (int)rank;
    }
    return -1;
}

/* The file of another program of this project, beside this one; NULL: this
 * one's name and "-mpi". */
static int beside(const char *name, char *path, size_t size,
                  struct host_error *error) {
    ssize_t length = readlink("/proc/self/exe", path, size - 32);
    if (length <= 0) {
        return host_fail(error, HOST_BROKEN,
                         "/proc/self/exe: %s; is /proc mounted?",
                         strerror(errno));
    }
    path[length] = '\0';
    char *slash = strrchr(path, '/');
    if (name == NULL)
        strcat(path, "-mpi");
    else
        strcpy(slash == NULL ? path : slash + 1, name);
    return 0;
}

/* The launcher's address, which vanishes with it. */
static socklen_t address_of(const char *name, struct sockaddr_un *address) {
    memset(address, 0, sizeof *address);
    address->sun_family = AF_UNIX;
    strcpy(address->sun_path + 1, name);
    return (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 +
                       strlen(name));
}

/* The launcher's socket, from its name in the environment; -1: there is none,
 * or not on this machine. */
static int call_launcher(void) {
    struct sockaddr_un address;
    const char *name = getenv(SOCKET_NAME);
    struct ucred peer;
    socklen_t size = sizeof peer;
    if (name == NULL || strlen(name) + 2 > sizeof address.sun_path)
        return -1;
    socklen_t length = address_of(name, &address);
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (fd < 0 || connect(fd, (struct sockaddr *)&address, length) != 0 ||
        getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 ||
        peer.uid != geteuid()) {
        close(fd);
        return -1;
    }
    return fd;
}

/* Takes the launcher's own standard streams in the place of mpirun's. */
static void take_streams(void) {
    union {
        struct cmsghdr header;
        char bytes[CMSG_SPACE(STREAMS * sizeof(int))];
    } control;
    char byte, text[16];
    struct iovec part = {&byte, 1};
    struct msghdr message = {.msg_iov = &part,
                             .msg_iovlen = 1,
                             .msg_control = &control,
                             .msg_controllen = sizeof control};
    int streams[STREAMS], fd = call_launcher();
    if (fd < 0)
        return;
    if (recvmsg(fd, &message, 0) == 1) {
        struct cmsghdr *header = CMSG_FIRSTHDR(&message);
        if (header != NULL && header->cmsg_type == SCM_RIGHTS &&
            header->cmsg_len == CMSG_LEN(sizeof streams)) {
            memcpy(streams, CMSG_DATA(header), sizeof streams);
            for (int i = 0; i < STREAMS; i++) {
                (void)dup2(streams[i], i);
                close(streams[i]);
            }
        }
    }
    snprintf(text, sizeof text, "%d", fd);
    (void)setenv(REPORT_NAME, text, 1);
}

int host_launch_become(int rank, char **argv, struct host_error *error) {
    char path[4096];
    const char *name = rank == 0 ? NULL : "incode-node-mpi";
    if (beside(name, path, sizeof path, error) != 0)
        return error->code;
    if (rank == 0)
        take_streams();
    (void)execv(path, argv);
    return host_fail(error, HOST_CUBE,
                     "%s: %s; it belongs beside incode on each machine, run "
                     "make",
                     path, strerror(errno));
}

bool host_launch_report(int status, int lost, bool ended) {
    struct report report = {status, lost, ended};
    const char *text = getenv(REPORT_NAME);
    uint64_t fd;
    return text != NULL && host_parse_number(text, 3, INT16_MAX, &fd) == 0 &&
           send((int)fd, &report, sizeof report, MSG_NOSIGNAL) ==
               (ssize_t)sizeof report;
}

/* --- before mpirun -------------------------------------------------------- */

static int listen_for_host(struct launch *l, struct host_error *error) {
    uint64_t random = 0;
    struct sockaddr_un address;
    char name[64];
    (void)!getrandom(&random, sizeof random, 0);
    snprintf(name, sizeof name, "incode-%ld-%016llx", (long)getpid(),
             (unsigned long long)random);
    socklen_t length = address_of(name, &address);
    l->listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (l->listener < 0 ||
        bind(l->listener, (struct sockaddr *)&address, length) != 0 ||
        listen(l->listener, 4) != 0 || setenv(SOCKET_NAME, name, 1) != 0) {
        return host_fail(error, HOST_BROKEN,
                         "a socket for rank 0: %s; close "
                         "some files",
                         strerror(errno));
    }
    return 0;
}

/* Whether a scheduler or the user says where ranks go: slots are theirs. */
static bool placed(void) {
    static const char *const names[] = {"SLURM_JOB_ID",
                                        "PBS_JOBID",
                                        "LSB_JOBID",
                                        "PE_HOSTFILE",
                                        "LOADL_STEP_ID",
                                        "OMPI_MCA_orte_default_hostfile",
                                        "PRTE_MCA_prte_default_hostfile",
                                        "PRTE_MCA_plm_ssh_agent",
                                        "OMPI_MCA_plm_rsh_agent"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        if (getenv(names[i]) != NULL)
            return true;
    return false;
}

/* The arguments of mpirun, and after them those of this program. */
static char **command_for(char **argv, char *ranks, char *self) {
    static char *const always[] = {
        "mpirun", "--oversubscribe", "--bind-to", "none", "-x", SOCKET_NAME};
    static char *const as_root[] = {"--allow-run-as-root"};
    /* One machine: no look for networks, nor for a way to log in elsewhere.
     * Open MPI 5 calls shared memory sm, and logs in nowhere unless it has to.
     */
#if OMPI_MAJOR_VERSION < 5
    static char *const at_home[] = {"--mca", "pml", "ob1",
                                    "--mca", "btl", "self,vader",
                                    "--mca", "plm", "isolated"};
#else
    static char *const at_home[] = {"--mca", "pml", "ob1",
                                    "--mca", "btl", "self,sm"};
#endif
    size_t count = 0, at = 0;
    while (argv[count] != NULL)
        count++;
    char **command = calloc(count + 32, sizeof *command);
    if (command == NULL)
        return NULL;
    memcpy(command, always, sizeof always);
    at += sizeof always / sizeof always[0];
    if (geteuid() == 0)
        command[at++] = as_root[0];
    if (!placed()) {
        memcpy(command + at, at_home, sizeof at_home);
        at += sizeof at_home / sizeof at_home[0];
    }
    char *last[] = {"-np", ranks, self, "run"};
    memcpy(command + at, last, sizeof last);
    at += sizeof last / sizeof last[0];
    memcpy(command + at, argv + 1, (count - 1) * sizeof *command);
    return command;
}

/* In the child: becomes mpirun, in a group of its own, so that an interrupt at
 * the terminal comes to it once, from its parent. */
static _Noreturn void become_mpirun(pid_t parent, char **argv, unsigned nodes,
                                    int said) {
    char ranks[16], self[4096];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    int null = open("/dev/null", O_RDONLY);
    (void)setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent || length <= 0 || null < 0)
        _exit(127);
    self[length] = '\0';
    mpi_environment();
    dup2(null, STDIN_FILENO);
    dup2(said, STDOUT_FILENO);
    dup2(said, STDERR_FILENO);
    snprintf(ranks, sizeof ranks, "%u", nodes + 1);
    char **command = command_for(argv, ranks, self);
    if (command != NULL)
        (void)execvp(command[0], command);
    (void)fprintf(stderr, "%s", strerror(errno));
    _exit(127);
}

static int start_mpirun(struct launch *l, char **argv, unsigned nodes,
                        struct host_error *error) {
    int pair[2];
    pid_t self = getpid();
    if (pipe2(pair, O_CLOEXEC) != 0) {
        return host_fail(error, HOST_BROKEN, "mpirun: %s; close some files",
                         strerror(errno));
    }
    l->mpirun = fork();
    if (l->mpirun == 0)
        become_mpirun(self, argv, nodes, pair[1]);
    close(pair[1]);
    l->said_file = pair[0];
    if (l->mpirun < 0) {
        return host_fail(error, HOST_BROKEN, "mpirun: %s; end some processes",
                         strerror(errno));
    }
    return 0;
}

/* A terminal answers only those in its foreground, which ranks are not: what
 * is typed is copied by a process that is. */
static int input_for_host(bool wanted) {
    int pair[2];
    char bytes[4096];
    ssize_t n;
    if (!isatty(STDIN_FILENO))
        return dup(STDIN_FILENO);
    if (!wanted || pipe2(pair, O_CLOEXEC) != 0)
        return open("/dev/null", O_RDONLY | O_CLOEXEC);
    pid_t self = getpid();
    if (fork() == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        close(pair[0]);
        while (getppid() == self &&
               (n = read(STDIN_FILENO, bytes, sizeof bytes)) > 0 &&
               write(pair[1], bytes, (size_t)n) == n) {
        }
        _exit(0);
    }
    close(pair[1]);
    return pair[0];
}

/* --- while it runs -------------------------------------------------------- */

/* Gives rank 0 the standard streams of this process. */
static void welcome(struct launch *l, bool input) {
    union {
        struct cmsghdr header;
        char bytes[CMSG_SPACE(STREAMS * sizeof(int))];
    } control = {.bytes = {0}};
    char byte = 0;
    struct iovec part = {&byte, 1};
    struct msghdr message = {.msg_iov = &part,
                             .msg_iovlen = 1,
                             .msg_control = &control,
                             .msg_controllen = sizeof control};
    struct ucred peer;
    socklen_t size = sizeof peer;
    int fd = accept4(l->listener, NULL, NULL, SOCK_CLOEXEC);
    if (fd < 0 || l->host >= 0 || l->host_pid != 0 ||
        getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 ||
        peer.uid != geteuid()) {
        close(fd);
        return;
    }
    int streams[STREAMS] = {input_for_host(input), STDOUT_FILENO,
                            STDERR_FILENO};
    struct cmsghdr *header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof streams);
    memcpy(CMSG_DATA(header), streams, sizeof streams);
    if (sendmsg(fd, &message, MSG_NOSIGNAL) == 1) {
        l->host = fd;
        l->host_pid = peer.pid;
    } else {
        close(fd);
    }
    close(streams[0]);
}

/* What rank 0 says, or that it is gone. */
static void hear_host(struct launch *l) {
    struct report report;
    ssize_t n = recv(l->host, &report, sizeof report, MSG_DONTWAIT);
    if (n == (ssize_t)sizeof report) {
        l->report = report;
        l->reported = true;
    } else if (n >= 0 || errno != EAGAIN) {
        close(l->host);
        l->host = -1;
        l->gone_us = host_now_us();
    }
}

/* Keeps the beginning of what mpirun says.  False at its end. */
static bool hear_mpirun(struct launch *l) {
    char bytes[4096];
    ssize_t n = read(l->said_file, bytes, sizeof bytes);
    size_t room = SAID_BYTES - 1 - l->said_size;
    if (n <= 0)
        return n < 0 && errno == EINTR;
    size_t part = (size_t)n < room ? (size_t)n : room;
    memcpy(l->said + l->said_size, bytes, part);
    l->said_size += part;
    return true;
}

/* mpirun ends its ranks when it is told to, and must not outlive rank 0. */
static void look_after(struct launch *l) {
    uint64_t now = host_now_us();
    bool late = l->gone_us != 0 && now - l->gone_us > END_US_MAX;
    if (l->ended_us == 0 && (caught != 0 || late)) {
        kill(l->mpirun, SIGTERM);
        l->ended_us = now;
    } else if (l->ended_us != 0 && now - l->ended_us > KILL_US_MAX) {
        kill(l->mpirun, SIGKILL);
    }
}

/* Until mpirun has ended: its status as waitpid gives it. */
static int watch(struct launch *l, bool input) {
    bool speaks = true;
    int status = 0;
    while (speaks) {
        struct pollfd fds[] = {{l->said_file, POLLIN, 0},
                               {l->listener, POLLIN, 0},
                               {l->host, POLLIN, 0}};
        (void)poll(fds, sizeof fds / sizeof fds[0], TURN_MS);
        if (fds[1].revents != 0)
            welcome(l, input);
        if (fds[2].revents != 0)
            hear_host(l);
        if (fds[0].revents != 0)
            speaks = hear_mpirun(l);
        look_after(l);
    }
    while (waitpid(l->mpirun, &status, WNOHANG) == 0) {
        look_after(l);
        (void)poll(NULL, 0, 10);
    }
    if (l->host >= 0)
        hear_host(l);
    return status;
}

/* --- after it ------------------------------------------------------------- */

/* The first words that mpirun has said, between its rules. */
static void first_words(const char *said, char *words, size_t size) {
    size_t at = 0;
    while (*said == '-' || *said == '\n')
        said++;
    while (*said != '\0' && strncmp(said, "\n\n", 2) != 0 &&
           strncmp(said, "\n--", 3) != 0 && at + 1 < size) {
        words[at++] = *said == '\n' ? ' ' : *said;
        said++;
    }
    words[at] = '\0';
}

/* Which rank, by mpirun's own account, was the first to end badly, and how.
 * -1: it does not say. */
static int rank_lost(const char *said, char *how, size_t size) {
    const char *rank = strstr(said, "process rank ");
    const char *on = rank == NULL ? NULL : strstr(rank, "exited on signal ");
    unsigned number = 0, signal = 0, code = 0;
    if (on != NULL && sscanf(rank, "process rank %u", &number) == 1 &&
        sscanf(on, "exited on signal %u", &signal) == 1) {
        snprintf(how, size, "ended by signal %u (%s)", signal,
                 strsignal((int)signal));
        return (int)number;
    }
    const char *name = strstr(said, "Process name: [[");
    const char *exited = name == NULL ? NULL : strstr(name, "Exit code:");
    if (exited != NULL &&
        sscanf(name, "Process name: [[%*u,%*u],%u]", &number) == 1 &&
        sscanf(exited, "Exit code: %u", &code) == 1) {
        snprintf(how, size, "ended with status %u", code);
        return (int)number;
    }
    return -1;
}

static int explain(const struct launch *l, unsigned nodes, int status,
                   struct host_error *error) {
    char words[400], how[80] = "its process has ended";
    int rank = rank_lost(l->said, how, sizeof how);
    if (l->reported && l->report.lost != 0)
        rank = rank == l->report.lost ? rank : l->report.lost;
    if (rank > 0) {
        return host_fail(error, HOST_CUBE,
                         "node %d (rank %d): %s, and the job with it; look for "
                         "what stopped it, and run again",
                         rank - 1, rank, how);
    }
    if (WIFSIGNALED(status)) {
        return host_fail(error, HOST_CUBE,
                         "mpirun: ended by signal %d (%s); look for what "
                         "stopped it, and run again",
                         WTERMSIG(status), strsignal(WTERMSIG(status)));
    }
    if (rank == 0 || l->host_pid != 0) {
        return host_fail(error, HOST_CUBE,
                         "host (rank 0): %s, and the job with it; look for "
                         "what stopped it, and run again",
                         how);
    }
    if (strstr(l->said, "slots") != NULL) {
        return host_fail(
            error, HOST_CUBE,
            "mpirun: not enough slots for a host and %u nodes; slots are what "
            "a hostfile grants (HOST slots=N), the scheduler, or else a "
            "machine's processors: grant %u, or give a smaller --nodes",
            nodes, nodes + 1);
    }
    first_words(l->said, words, sizeof words);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 127) {
        return host_fail(error, HOST_CUBE,
                         "mpirun: %s; install openmpi-bin, or take another "
                         "--link",
                         words);
    }
    return host_fail(error, HOST_CUBE,
                     "mpirun: did not start the ranks (status %d)%s%s; see "
                     "that mpirun -np 2 hostname works",
                     WIFEXITED(status) ? WEXITSTATUS(status) : 128,
                     words[0] == '\0' ? "" : ": ", words);
}

int host_launch_mpi(char **argv, const struct host_run_options *options,
                    struct host_error *error) {
    static struct launch launch = {.listener = -1, .host = -1};
    struct launch *l = &launch;
    struct sigaction action = {.sa_handler = catch}, before[2];
    unsigned nodes = host_run_nodes(options);
    bool input = options->input != NULL && strcmp(options->input, "-") == 0;
    if (listen_for_host(l, error) != 0)
        return error->code;
    (void)sigaction(SIGINT, &action, &before[0]);
    (void)sigaction(SIGTERM, &action, &before[1]);
    if (start_mpirun(l, argv, nodes, error) != 0)
        return error->code;
    int status = watch(l, input);
    bool whole = l->reported && l->report.lost == 0 && !l->report.ended;
    if (!whole && l->host_pid != 0)
        host_run_clean(options, l->host_pid);
    if (caught != 0 && !(whole && l->report.status == 0)) {
        if (options->outputs > 0 || options->stats != NULL)
            host_output_expect();
        (void)sigaction(SIGINT, &before[0], NULL);
        (void)sigaction(SIGTERM, &before[1], NULL);
        (void)raise(caught);
    }
    if (whole) {
        error->code = l->report.status; /* it has said why itself */
        return error->code;
    }
    return explain(l, nodes, status, error);
}
