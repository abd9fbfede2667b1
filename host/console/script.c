#include "script.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "host/base/progress.h"

enum { TEND_US = 20000, IDLE_MS = 1000 };

static volatile sig_atomic_t ending;

/* A second one finds the default action. */
static void interrupt(int number) {
    ending = number;
}

int host_script_ending(void) {
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

const struct host_shell_sink *host_script_sink(void) {
    static const struct host_shell_sink sink = {
        NULL, show_line, show_note, show_failed, NULL, NULL, interrupted};
    const struct sigaction action = {.sa_handler = interrupt,
                                     .sa_flags = (int)SA_RESETHAND};
    struct sigaction before;
    (void)sigaction(SIGINT, &action, NULL);
    (void)sigaction(SIGTERM, &action, NULL);
    if (sigaction(SIGHUP, NULL, &before) == 0 &&
        before.sa_handler != SIG_IGN) { /* as nohup has it */
        (void)sigaction(SIGHUP, &action, NULL);
    }
    return &sink;
}

/* Waits for bytes, and tends the cube; false: it was interrupted. */
static bool await_bytes(struct host_shell *shell, int file) {
    struct pollfd input = {file, POLLIN, 0};
    for (;;) {
        bool tended = shell->open || shell->running;
        int n = poll(&input, 1, tended ? 0 : IDLE_MS);
        if (ending != 0) {
            return false;
        }
        if (n > 0) {
            return true;
        }
        if (tended) {
            host_shell_tend(shell, TEND_US);
        }
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

int host_script_read(struct host_shell *shell, const char *name, int file,
                     struct host_error *error) {
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
