#include "console.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "host/base/progress.h"
#include "host/base/options.h"
#include "place.h"
#include "terminal.h"

enum { TEND_US = 20000, IDLE_MS = 1000 };

static volatile sig_atomic_t ending;

/* A second one finds the default action. */
static void interrupt(int number) {
    ending = number;
}

/* The signal that ends it, for who has cleared away; 0: none came. */
static int host_script_ending(void) {
    return ending;
}

static void show_line(void *context, const char *text) {
    (void)context;
    (void)printf("%s\n", text);
}

static void show_note(void *context, const char *text) {
    (void)context;
    (void)fflush(stdout);
    host_note("%s", text);
}

static void show_failed(void *context, const char *text) {
    (void)context;
    (void)fflush(stdout);
    (void)fprintf(stderr, "incode: %s\n", text);
}

static bool interrupted(void *context) {
    (void)context;
    return ending != 0;
}

static const struct host_shell_sink *host_script_sink(void) {
    static const struct host_shell_sink sink = {
        NULL, show_line, show_note, show_failed, NULL, NULL, interrupted};
    const struct sigaction action = {.sa_handler = interrupt,
                                     .sa_flags = (int)SA_RESETHAND};
    struct sigaction before;
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    if (sigaction(SIGHUP, NULL, &before) == 0 &&
        before.sa_handler != SIG_IGN) /* as nohup has it */
        (void)sigaction(SIGHUP, &action, NULL);
    return &sink;
}

/* Waits for bytes, and tends the cube; false: it was interrupted. */
static bool await_bytes(struct host_shell *shell, int file) {
    struct pollfd input = {file, POLLIN, 0};
    for (;;) {
        bool tended = shell->open || shell->running;
        int n = poll(&input, 1, tended ? 0 : IDLE_MS);
        if (ending != 0)
            return false;
        if (n > 0)
            return true;
        if (tended)
            host_shell_tend(shell, TEND_US);
    }
}

/* Each whole line of the buffer; what is left of it is moved to its start. */
static size_t do_lines(struct host_shell *shell, char *text, size_t used) {
    char *at = text, *end;
    while (!shell->leaves && ending == 0 &&
           (end = memchr(at, '\n', used - (size_t)(at - text))) != NULL) {
        *end = '\0';
        (void)host_shell_line(shell, at);
        (void)fflush(stdout);
        at = end + 1;
    }
    used -= (size_t)(at - text);
    memmove(text, at, used);
    return used;
}

/* Does the lines until the end, `exit` or a signal.  0, or HOST_INPUT: it
 * cannot be read. */
static int host_script_read(struct host_shell *shell, const char *name,
                            int file, struct host_error *error) {
    static char text[HOST_SCRIPT_LINE];
    size_t used = 0;
    while (!shell->leaves && await_bytes(shell, file)) {
        ssize_t n = read(file, text + used, sizeof text - 1 - used);
        if (n < 0 && errno != EINTR) {
            return host_fail(error, HOST_INPUT, "%s: %s; give another file",
                             name, strerror(errno));
        }
        if (n == 0) {
            text[used] = '\n'; /* the last line may lack it */
            (void)do_lines(shell, text, used + 1);
            break;
        }
        used = do_lines(shell, text, used + (n > 0 ? (size_t)n : 0));
        if (used == sizeof text - 1) {
            return host_fail(error, HOST_INPUT,
                             "%s: a line of more than %d bytes; give commands",
                             name, HOST_SCRIPT_LINE - 2);
        }
    }
    return 0;
}

/* --- console -------------------------------------------------------------- */

enum { LINES = 64 };

struct options {
    struct host_site_options site;
    const char *line[LINES]; /* of -c */
    unsigned lines;
    const char *file;
    bool json;
};

static void take_line(void *into, const char *value, struct host_error *error) {
    struct options *o = into;
    if (o->lines == LINES) {
        host_fail(error, HOST_USAGE,
                  "-c: more than %d lines; put them in a file, and give "
                  "--file FILE",
                  LINES);
        return;
    }
    o->line[o->lines++] = value;
}

static int read_file(struct host_shell *shell, const char *path,
                     struct host_error *error) {
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        return host_fail(error, HOST_INPUT, "%s: %s; give a file of commands",
                         path, strerror(errno));
    }
    int status = host_script_read(shell, path, file, error);
    (void)close(file);
    return status;
}

static int do_script(struct host_shell *shell, const struct options *o,
                     struct host_error *error) {
    for (unsigned i = 0;
         i < o->lines && !shell->leaves && host_script_ending() == 0; i++)
        (void)host_shell_line(shell, o->line[i]);
    if (o->file != NULL && !shell->leaves && host_script_ending() == 0)
        return read_file(shell, o->file, error);
    return o->lines > 0 || o->file != NULL
               ? 0
               : host_script_read(shell, "standard input", STDIN_FILENO, error);
}

int host_console_command(int argc, char **argv, struct host_error *error) {
    static struct host_console_place place;
    static struct host_shell shell;
    static const struct host_option rows[] = {
        {.help = "What is done:"},
        {"command", 'c', "LINE",
         "Do this line, and the next, and leave; may be given several times",
         .take = take_line},
        {"file", 0, "FILE", "Do the lines of FILE, and leave",
         HOST_AT(struct options, file)},
        {"json", 0, NULL, "Answer with an object of JSON a command",
         HOST_AT(struct options, json)},
        {0}};
    static const struct host_options mine = {
        .rows = rows,
        .more = host_site_rows,
        .more_at = offsetof(struct options, site),
        .refusal = "no argument of console; to do a command, write -c",
        .arguments = "",
        .about = "Looks at a cube, and tells its nodes what to do: help lists "
                 "the commands. Without a terminal, lines come from standard "
                 "input, and the status is that of the first that failed."};
    struct options options = {0};
    if (host_options_parse(&mine, argc, argv, false, &options, NULL, error) !=
        0)
        return error->code;
    bool person = options.lines == 0 && options.file == NULL &&
                  isatty(STDIN_FILENO) && isatty(STDOUT_FILENO) &&
                  !options.json;
    int status, signal_number = 0;
    host_console_place_init(&place, &options.site);
    host_shell_init(&shell, &place.place,
                    person ? host_terminal_sink() : host_script_sink(),
                    options.json);
    status = host_site_check(&options.site, error);
    if (status == 0)
        status = host_site_read(&options.site, error);
    if (status == 0) {
        status = person ? host_terminal_run(&shell, &signal_number, error)
                        : do_script(&shell, &options, error);
    }
    if (status != 0 && options.json) {
        status = host_shell_fail(&shell, NULL, error);
        memset(error, 0, sizeof *error); /* it is told */
    }
    host_shell_close(&shell);
    host_console_place_end(&place);
    signal_number = person ? signal_number : host_script_ending();
    if (signal_number != 0) {
        (void)signal(signal_number, SIG_DFL);
        (void)raise(signal_number);
    }
    return status != 0 ? status : person ? 0 : shell.first;
}

/* --- nodes ---------------------------------------------------------------- */

enum { SETTLE_US = 12000000 };

struct nodes_options {
    struct host_site_options site;
    bool json;
};

/* Those that begin may need a moment. */
static int wait_for_all(struct host_shell *shell, struct host_error *error) {
    struct host_node_set all;
    host_node_set_all(&all, shell->machine.nodes);
    return host_session_settle(&shell->session, &all, SETTLE_US, error);
}

/* Beside another program it watches, and says beside whom. */
static int reach(struct host_shell *shell, struct host_error *error) {
    struct host_holder holder;
    char text[HOST_HOLDER_TEXT];
    if (host_shell_is_held(shell, &holder)) {
        host_note("nodes: a look beside %s, which has the cube",
                  host_holder_text(&holder, text, sizeof text));
        return 0;
    }
    return host_shell_open(shell, error) != 0 ? error->code
                                              : wait_for_all(shell, error);
}

int host_nodes_command(int argc, char **argv, struct host_error *error) {
    static struct host_console_place place;
    static struct host_shell shell;
    static const struct host_option rows[] = {
        {.help = "What is printed:"},
        {"json", 0, NULL, "Print an object of JSON",
         HOST_AT(struct nodes_options, json)},
        {0}};
    static const struct host_options mine = {
        .rows = rows,
        .more = host_site_rows,
        .more_at = offsetof(struct nodes_options, site),
        .refusal = "no argument of nodes; to name a cube file, write --cube",
        .arguments = "",
        .about = "Tells which nodes of a cube are there, what is missing, what "
                 "is wired wrongly, and what to do next. Exit status: 0 all "
                 "nodes and wires are there, 4 not."};
    struct nodes_options nodes_options = {0};
    if (host_options_parse(&mine, argc, argv, false, &nodes_options, NULL,
                           error) != 0)
        return error->code;
    host_console_place_init(&place, &nodes_options.site);
    host_shell_init(&shell, &place.place, host_script_sink(),
                    nodes_options.json);
    struct host_error lost = {0};
    int status = host_site_check(&nodes_options.site, &lost);
    status = status == 0 ? reach(&shell, &lost) : status;
    status = status != 0 && !shell.open && !shell.in_use
                 ? host_shell_fail(&shell, "nodes", &lost)
                 : host_shell_line(&shell, "nodes"); /* says what it is */
    host_shell_close(&shell);
    host_console_place_end(&place);
    return status;
}
