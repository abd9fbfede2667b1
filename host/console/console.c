#include "console.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

#include "host/base/options.h"
#include "host/base/progress.h"
#include "place.h"
#include "script.h"
#include "terminal.h"

enum { LINES = 64, KEY_FILE = 512, KEY_JSON };

struct options {
    struct host_site_options site;
    const char *line[LINES]; /* of -c */
    unsigned lines;
    const char *file;
    bool json;
    struct host_error *error;
};

static const struct argp_option own_rows[] = {
    {NULL, 0, NULL, 0, "What is done:", 3},
    {"command", 'c', "LINE", 0,
     "Do this line, and the next, and leave; may be given several times", 3},
    {"file", KEY_FILE, "FILE", 0, "Do the lines of FILE, and leave", 3},
    {"json", KEY_JSON, NULL, 0, "Answer with an object of JSON a command", 3},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state) {
    struct options *o = state->input;
    switch (key) {
    case 'c':
        if (o->lines == LINES) {
            host_fail(o->error, HOST_USAGE,
                      "-c: more than %d lines; put them in a file, and give "
                      "--file FILE",
                      LINES);
        } else {
            o->line[o->lines++] = value;
        }
        return 0;
    case KEY_FILE:
        o->file = value;
        return 0;
    case KEY_JSON:
        o->json = true;
        return 0;
    case ARGP_KEY_ARG:
        host_fail(o->error, HOST_USAGE,
                  "%s: no argument of console; to do a command, write -c",
                  value);
        return 0;
    default:
        return host_site_option(&o->site, key, value, o->error);
    }
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
         i < o->lines && !shell->leaves && host_script_ending() == 0; i++) {
        (void)host_shell_line(shell, o->line[i]);
    }
    if (o->file != NULL && !shell->leaves && host_script_ending() == 0) {
        return read_file(shell, o->file, error);
    }
    return o->lines > 0 || o->file != NULL
               ? 0
               : host_script_read(shell, "standard input", STDIN_FILENO, error);
}

int host_console_command(int argc, char **argv, struct host_error *error) {
    static struct host_console_place place;
    static struct host_shell shell;
    struct options options = {.error = error};
    struct argp_option rows[HOST_OPTIONS_MAX];
    host_site_table(rows, own_rows);
    const struct argp argp = {
        rows,
        parse,
        "",
        "Looks at a cube, and tells its nodes what to do: help lists the "
        "commands. Without a terminal, lines come from standard input, and the "
        "status is that of the first that failed.",
        NULL,
        NULL,
        NULL};
    if (host_options_parse(&argp, argc, argv, 0, &options, error) != 0) {
        return error->code;
    }
    bool person = options.lines == 0 && options.file == NULL &&
                  isatty(STDIN_FILENO) && isatty(STDOUT_FILENO) &&
                  !options.json;
    int status, ending = 0;
    host_console_place_init(&place, &options.site);
    host_shell_init(&shell, &place.place,
                    person ? host_terminal_sink() : host_script_sink(),
                    options.json);
    status = host_site_check(&options.site, error);
    if (status == 0) {
        status = host_site_read(&options.site, error);
    }
    if (status == 0) {
        status = person ? host_terminal_run(&shell, &ending, error)
                        : do_script(&shell, &options, error);
    }
    if (status != 0 && options.json) {
        status = host_shell_fail(&shell, NULL, error);
        memset(error, 0, sizeof *error); /* it is told */
    }
    host_shell_close(&shell);
    host_console_place_end(&place);
    ending = person ? ending : host_script_ending();
    if (ending != 0) {
        (void)signal(ending, SIG_DFL);
        (void)raise(ending);
    }
    return status != 0 ? status : person ? 0 : shell.first;
}
