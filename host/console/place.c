#include "place.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "commands.h"
#include "host/base/create.h"

enum { FOREGROUND_MS = 20, NO_PROGRAM = 127, BY_SIGNAL = 128 };

/* Signals are held back until the child has its own ways with them: one that
 * came before would be lost. */
static _Noreturn void become(const char *const *words, const int *report,
                             pid_t host, const sigset_t *signals) {
    int null = open("/dev/null", O_RDONLY | O_CLOEXEC);
    (void)setpgid(0, 0);
    for (int i = 1; i < NSIG; i++) {
        struct sigaction action;
        if (sigaction(i, NULL, &action) == 0 && action.sa_handler != SIG_IGN)
            (void)signal(i, SIG_DFL);
    }
    (void)sigprocmask(SIG_SETMASK, signals, NULL);
    (void)prctl(PR_SET_PDEATHSIG, SIGTERM);
    (void)dup2(null, STDIN_FILENO);
    if (report != NULL) {
        (void)dup2(report[1], STDOUT_FILENO);
        (void)dup2(report[1], STDERR_FILENO);
    }
    if (getppid() == host) /* else it ended before it could be watched */
        (void)execv("/proc/self/exe", (char *const *)words);
    _exit(NO_PROGRAM);
}

/* words: its arguments, the program's name first, NULL last.  quiet: its output
 * comes by `look`, not on the terminal. */
static int host_child_run_begin(struct host_child_run *run,
                                const char *const *words, bool quiet,
                                struct host_error *error) {
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
    if (pid == 0)
        become(words, quiet ? report : NULL, host, &before);
    int reason = errno;
    (void)sigprocmask(SIG_SETMASK, &before, NULL);
    if (quiet) {
        (void)close(report[1]);
        (void)fcntl(report[0], F_SETFL, O_NONBLOCK);
    }
    if (pid < 0) {
        if (quiet)
            (void)close(report[0]);
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
        if (!end)
            run->line[run->used++] = bytes[i];
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
        if (n <= 0)
            return n == 0;
        take(run, bytes, (size_t)n, say, context);
    }
}

/* Whether it has ended, and then *status, as a shell has it. */
static bool host_child_run_look(struct host_child_run *run, int *status,
                                void (*say)(void *context, const char *text),
                                void *context, uint64_t wait_us) {
    struct pollfd said = {run->said, POLLIN, 0};
    int found, wait_ms = (int)(wait_us / 1000);
    bool over = false;
    if (run->said < 0 && wait_ms > FOREGROUND_MS)
        wait_ms = FOREGROUND_MS;
    if (waitpid(run->pid, &found, WNOHANG) != run->pid) {
        (void)poll(&said, run->said < 0 ? 0 : 1, wait_ms);
        over = run->said >= 0 && read_said(run, say, context);
        if (waitpid(run->pid, &found, over ? 0 : WNOHANG) != run->pid)
            return false;
    }
    if (run->said >= 0) {
        (void)read_said(run, say, context);
        if (run->used > 0)
            take(run, "\n", 1, say, context);
        (void)close(run->said);
    }
    run->pid = 0;
    *status =
        WIFEXITED(found) ? WEXITSTATUS(found) : BY_SIGNAL + WTERMSIG(found);
    return true;
}

/* As Ctrl-C does. */
static void host_child_run_interrupt(const struct host_child_run *run) {
    if (run->pid > 0)
        (void)kill(run->pid, SIGINT);
}

/* --- place ---------------------------------------------------------------- */

static int open_site(void *context, struct host_machine *machine,
                     struct host_error *error) {
    struct host_console_place *p = context;
    if (host_site_open(&p->site, &p->options, error) != 0)
        return error->code;
    *machine = p->site.machine;
    host_remote_wire(&p->site.file, p->wire);
    return 0;
}

/* As the file has it; of one wire, as it was when it was open. */
static bool find_wire(void *context, char *name) {
    static struct host_cube_file file;
    const struct host_console_place *p = context;
    struct host_error error = {0};
    const char *path = p->options.cube;
    if (path != NULL) {
        bool read = host_cube_file_read(&file, path, &error) == 0;
        if (read)
            host_remote_wire(&file, name);
        host_cube_file_free(&file);
        return read;
    }
    snprintf(name, HOST_WIRE_NAME, "%s", p->wire);
    return name[0] != '\0';
}

static void close_site(void *context) {
    struct host_console_place *p = context;
    host_site_close(&p->site);
}

/* --- lines ---------------------------------------------------------------- */

static bool has_line(void *context, unsigned node) {
    const struct host_console_place *p = context;
    return host_lines_has(&p->site.file, node, HOST_LINE_RESET);
}

/* Opened for one pulse: nothing is held that another program may want. */
static int pulse(void *context, unsigned node, struct host_error *error) {
    struct host_console_place *p = context;
    struct host_lines lines;
    if (host_lines_open(&lines, &p->site.file, &p->site.remote, error) != 0)
        return error->code;
    int status = host_lines_reset(&lines, node, false, error);
    host_lines_close(&lines);
    return status;
}

/* --- runs ----------------------------------------------------------------- */

static int make_folder(struct host_console_place *p, struct host_error *error) {
    const char *above = getenv("XDG_RUNTIME_DIR");
    if (p->folder[0] != '\0')
        return 0;
    bool fits = above != NULL && above[0] == '/' &&
                strlen(above) + 24 < sizeof p->folder;
    snprintf(p->folder, sizeof p->folder, "%s/incode-console.XXXXXX",
             fits ? above : "/tmp");
    if (mkdtemp(p->folder) == NULL) {
        int reason = errno;
        p->folder[0] = '\0';
        return host_fail(error, HOST_INPUT,
                         "run: a folder for its files: %s; make room in /tmp",
                         strerror(reason));
    }
    snprintf(p->stats, sizeof p->stats, "%s/stats.json", p->folder);
    return 0;
}

/* A text in quotation marks, as libconfig reads it. */
static void write_text(FILE *out, const char *text) {
    (void)fputc('"', out);
    for (; *text != '\0'; text++) {
        (void)fprintf(out, *text == '"' || *text == '\\' ? "\\%c" : "%c",
                      *text);
    }
    (void)fputc('"', out);
}

static void write_host_wire(const struct host_console_place *p, FILE *out) {
    const struct host_site_options *o = &p->options;
    const char *name = o->port != NULL  ? o->port
                       : o->tcp != NULL ? o->tcp
                                        : o->unix_path;
    char path[PATH_MAX];
    (void)fprintf(out, "links = ( { node = 0; to = \"host\"; %s = ",
                  o->port != NULL  ? "serial"
                  : o->tcp != NULL ? "tcp"
                                   : "unix");
    if (o->port != NULL)
        (void)fprintf(out, "[\"/dev/null\", ");
    if (o->unix_path != NULL && realpath(name, path) != NULL)
        name = path;
    write_text(out, name);
    (void)fprintf(out, "%s;", o->port != NULL ? "]" : "");
    if (o->port != NULL && o->baud > 0)
        (void)fprintf(out, " baud = %llu;", (unsigned long long)o->baud);
    if (o->tcp != NULL && o->key == NULL)
        (void)fprintf(out, " insecure = true;");
    (void)fprintf(out, " }");
}

static const struct host_board *board_of(const struct host_session *session,
                                         unsigned node) {
    char name[NODE_BOARD_BYTES + 1] = "";
    memcpy(name, session->node[node].who.board, NODE_BOARD_BYTES);
    const struct host_board *board = host_board_named(name);
    return board == NULL ? host_board_row(0) : board;
}

/* How nodes with a system are wired among themselves the host need not know,
 * but a cube file has a wire for each pair. */
static void write_cube(const struct host_console_place *p,
                       const struct host_session *session, FILE *out) {
    const struct host_machine *m = session->machine;
    char path[PATH_MAX];
    (void)fprintf(out, "dimension = %u;\nnodes = (", m->dimension);
    uint32_t memory = 0;
    for (unsigned i = 0; i < m->nodes; i++) {
        const struct host_board *board = board_of(session, i);
        (void)fprintf(out, "%s{ node = %u; board = \"%s\"; }",
                      i == 0 ? "" : ", ", i, board->name);
        memory = board->bare == NULL && session->node[i].who.memory > memory
                     ? session->node[i].who.memory
                     : memory;
    }
    (void)fprintf(out, ");\n");
    if (memory > 0)
        (void)fprintf(out, "memory = \"%u\";\n", memory);
    if (p->options.key != NULL && realpath(p->options.key, path) != NULL) {
        (void)fprintf(out, "key = ");
        write_text(out, path);
        (void)fprintf(out, ";\n");
    }
    write_host_wire(p, out);
    for (unsigned i = 0; i < m->nodes; i++) {
        for (unsigned d = 0; d < m->dimension; d++) {
            unsigned to = i | 1u << d;
            if (to != i && (board_of(session, i)->bare == NULL ||
                            board_of(session, to)->bare == NULL)) {
                (void)fprintf(out,
                              ",\n    { node = %u; to = %u; unix = "
                              "\"%u-%u\"; }",
                              i, to, i, to);
            }
        }
    }
    (void)fprintf(out, " );\n");
}

/* Without a cube file, what was found stands for one. */
static int prepare(void *context, const struct host_session *session,
                   struct host_error *error) {
    struct host_console_place *p = context;
    if (make_folder(p, error) != 0 || p->options.cube != NULL)
        return error->code;
    snprintf(p->cube, sizeof p->cube, "%s/console.cube", p->folder);
    FILE *out = host_create_over(p->cube);
    bool good = out != NULL;
    if (good) {
        write_cube(p, session, out);
        good = ferror(out) == 0;
    }
    if ((out != NULL && fclose(out) != 0) || !good) {
        return host_fail(error, HOST_INPUT, "%s: %s; make room there", p->cube,
                         strerror(errno));
    }
    return 0;
}

static int begin_run(void *context, int count, const char *const *words,
                     bool behind, bool json, struct host_error *error) {
    struct host_console_place *p = context;
    const char *all[HOST_SHELL_WORDS + 10] = {"incode", "run"};
    unsigned n = 2;
    for (int i = 0; i < count; i++) {
        if (strcmp(words[i], "--cube") == 0 ||
            strncmp(words[i], "--cube=", 7) == 0) {
            return host_fail(error, HOST_USAGE,
                             "run --cube: it is on this console's cube; leave "
                             "that out");
        }
        all[n++] = words[i];
    }
    all[n++] = "--cube";
    all[n++] = p->options.cube != NULL ? p->options.cube : p->cube;
    if (json) {
        all[n++] = "-q";
        all[n++] = "--stats";
        all[n++] = p->stats;
    }
    return host_child_run_begin(&p->run, all, behind || json, error);
}

static bool look_at_run(void *context, int *status,
                        void (*say)(void *context, const char *text),
                        void *say_to, uint64_t wait_us) {
    struct host_console_place *p = context;
    return host_child_run_look(&p->run, status, say, say_to, wait_us);
}

static void interrupt_run(void *context) {
    struct host_console_place *p = context;
    host_child_run_interrupt(&p->run);
}

static json_t *statistics(void *context) {
    struct host_console_place *p = context;
    json_t *object = json_load_file(p->stats, 0, NULL);
    (void)unlink(p->stats);
    return object;
}

void host_console_place_init(struct host_console_place *place,
                             const struct host_site_options *options) {
    memset(place, 0, sizeof *place);
    place->options = *options;
    place->place = (struct host_shell_place){
        .context = place,
        .open = open_site,
        .close = close_site,
        .wire = find_wire,
        .has_line = has_line,
        .pulse = pulse,
        .prepare = prepare,
        .run = begin_run,
        .look = look_at_run,
        .interrupt = interrupt_run,
        .statistics = statistics,
    };
}

void host_console_place_end(struct host_console_place *place) {
    if (place->folder[0] != '\0') {
        (void)unlink(place->cube);
        (void)unlink(place->stats);
        (void)rmdir(place->folder);
    }
}
