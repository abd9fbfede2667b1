#include "terminal.h"

#include <errno.h>
#include <fcntl.h>
#include <histedit.h>
#include <limits.h>
#include <locale.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>
#include <wchar.h>

#include "host/base/create.h"
#include "host/base/progress.h"
#include "commands.h"
#include "host/base/error.h"

#define NAME "history"

static int folder = -1; /* -1: there is none */

static void find_folder(void) {
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    struct host_error error = {0};
    char path[PATH_MAX];
    int n = -1;
    if (state != NULL && state[0] == '/')
        n = snprintf(path, sizeof path, "%s/incode", state);
    else if (home != NULL && home[0] == '/')
        n = snprintf(path, sizeof path, "%s/.local/state/incode", home);
    if (n > 0 && n < (int)sizeof path)
        folder = host_folder_open_all(path, &error);
    if (error.code != 0)
        host_note("no history is kept: %s", error.text);
}

/* The newest lines alone, in place of all, once there are too many. */
static void shorten(FILE *file, size_t lines) {
    char other[64], *line = NULL;
    size_t room = 0, at = 0;
    snprintf(other, sizeof other, NAME ".%ld", (long)getpid());
    int fd = host_folder_file(folder, other, O_WRONLY | O_CREAT | O_EXCL);
    FILE *out = fd < 0 ? NULL : fdopen(fd, "w");
    if (out == NULL)
        return;
    rewind(file);
    while (getline(&line, &room, file) > 0)
        if (at++ + HOST_HISTORY_LINES >= lines)
            (void)fputs(line, out);
    free(line);
    if (fclose(out) != 0 || renameat(folder, other, folder, NAME) != 0)
        (void)unlinkat(folder, other, 0);
}

static void load(History *list) {
    HistEvent event;
    char *line = NULL;
    size_t room = 0, lines = 0;
    int fd = folder < 0 ? -1 : host_folder_file(folder, NAME, O_RDONLY);
    FILE *file = fd < 0 ? NULL : fdopen(fd, "r");
    if (file == NULL)
        return;
    for (ssize_t n; (n = getline(&line, &room, file)) > 0; lines++) {
        line[n - 1] = line[n - 1] == '\n' ? '\0' : line[n - 1];
        (void)history(list, &event, H_ENTER, line);
    }
    free(line);
    if (lines > 2 * HOST_HISTORY_LINES)
        shorten(file, lines);
    (void)fclose(file);
}

/* NULL: no memory.  Without a file, which is no error, it lasts as long as the
 * program. */
static History *host_history_open(void) {
    HistEvent event;
    History *list = history_init();
    if (list == NULL)
        return NULL;
    (void)history(list, &event, H_SETSIZE, HOST_HISTORY_LINES);
    (void)history(list, &event, H_SETUNIQUE, 1);
    find_folder();
    load(list);
    return list;
}

/* A line without its line feed, unless it is empty or the same as before. */
static void host_history_add(History *list, const char *line) {
    HistEvent event;
    bool same =
        history(list, &event, H_FIRST) == 0 && strcmp(event.str, line) == 0;
    if (same || line[strspn(line, " \t")] == '\0')
        return;
    (void)history(list, &event, H_ENTER, line);
    int fd = folder < 0 ? -1
                        : host_folder_file(folder, NAME,
                                           O_WRONLY | O_CREAT | O_APPEND);
    if (fd >= 0) {
        (void)dprintf(fd, "%s\n", line);
        (void)close(fd);
    }
}

static void host_history_close(History *list) {
    history_end(list);
    if (folder >= 0) {
        (void)close(folder);
        folder = -1;
    }
}

/* --- terminal ------------------------------------------------------------- */

enum {
    TEND_US = 20000,
    IDLE_MS = 100, /* between looks at the keyboard where nothing is tended */
    CHOICES = 1200,
    COLUMNS = 80,
    LEAVE = 2, /* interrupts of one command */
    FORCE = 3
};

static struct {
    EditLine *line;
    History *history;
    struct host_shell *shell;
    struct termios before; /* as the terminal was */
    bool editing, pictured;
    bool dumb;   /* moves no cursor */
    bool typed;  /* the line that was abandoned was not empty */
    bool warned; /* that a second Ctrl-C leaves */
    mbstate_t letters;
    uint64_t tended_us;
    volatile sig_atomic_t interrupts, resized, ending;
} t;

/* --- signals -------------------------------------------------------------- */

static void restore_terminal(void) {
    static const char gone[] = "\033[?1049l";
    if (t.pictured)
        (void)!write(STDOUT_FILENO, gone, sizeof gone - 1);
    (void)tcsetattr(STDIN_FILENO, TCSADRAIN, &t.before);
}

static void take_signal(int number) {
    if (number == SIGWINCH) {
        t.resized = 1;
        return;
    }
    if (number != SIGINT)
        t.ending = number;
    if (++t.interrupts >= FORCE) {
        restore_terminal();
        (void)signal(number, SIG_DFL);
        (void)raise(number);
    }
}

static const int signals[] = {SIGINT, SIGTERM, SIGHUP, SIGWINCH};
enum { SIGNALS = sizeof signals / sizeof signals[0] };

static void take_signals(struct sigaction before[SIGNALS]) {
    struct sigaction action = {.sa_handler = take_signal};
    for (unsigned i = 0; i < SIGNALS; i++)
        (void)sigaction(signals[i], &action, &before[i]);
}

/* --- what is shown -------------------------------------------------------- */

static unsigned columns(void *context) {
    struct winsize size;
    (void)context;
    bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col;
    return known ? size.ws_col : COLUMNS;
}

static unsigned rows(void) {
    struct winsize size;
    bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row;
    return known ? size.ws_row : 24;
}

static void show_line(void *context, const char *text) {
    (void)context;
    (void)printf("%s\n", text);
}

/* Above the line that is being edited, if there is one. */
static void show_note(void *context, const char *text) {
    (void)context;
    if (t.pictured)
        return; /* the next picture would cover it */
    (void)printf("%s* %s\n",
                 !t.editing ? ""
                 : t.dumb   ? "\n"
                            : "\r\033[K",
                 text);
    (void)fflush(stdout);
    if (t.editing)
        (void)el_set(t.line, EL_REFRESH);
}

static void show_host_note(const char *text) {
    show_note(NULL, text);
}

static void show_failed(void *context, const char *text) {
    (void)context;
    (void)fflush(stdout);
    (void)fprintf(stderr, "incode: %s\n", text);
}

static void end_pictures(void) {
    if (t.pictured) {
        (void)printf("\033[?1049l");
        (void)fflush(stdout);
        t.pictured = false;
    }
}

static bool show_picture(void *context, const char *text) {
    unsigned width = columns(NULL), left = rows() - 1;
    (void)context;
    if (text == NULL) {
        end_pictures();
        return false;
    }
    (void)printf("%s\033[H", t.pictured ? "" : "\033[?1049h");
    t.pictured = true;
    while (*text != '\0' && left-- > 0) {
        const char *end = strchrnul(text, '\n');
        int length = (int)(end - text);
        (void)printf("%.*s\033[K\r\n",
                     length < (int)width ? length : (int)width - 1, text);
        text = *end == '\0' ? end : end + 1;
    }
    (void)printf("\033[Jq leaves");
    (void)fflush(stdout);
    return true;
}

static bool key_waits(int wait_ms) {
    struct pollfd keys = {STDIN_FILENO, POLLIN, 0};
    return poll(&keys, 1, wait_ms) > 0;
}

/* While pictures are shown, q is as good as Ctrl-C. */
static bool interrupted(void *context) {
    char key;
    (void)context;
    while (t.pictured && key_waits(0) && read(STDIN_FILENO, &key, 1) == 1)
        if (key == 'q' || key == 'Q')
            return true;
    return t.interrupts > 0;
}

static const struct host_shell_sink sink = {
    NULL,         show_line, show_note,  show_failed,
    show_picture, columns,   interrupted};

const struct host_shell_sink *host_terminal_sink(void) {
    return &sink;
}

/* --- what is typed -------------------------------------------------------- */

/* A letter from the next byte; false: it takes more of them. */
static bool letter_of(char byte, wchar_t *letter) {
    size_t n = mbrtowc(letter, &byte, 1, &t.letters);
    if (n == (size_t)-2)
        return false;
    if (n == (size_t)-1) {
        memset(&t.letters, 0, sizeof t.letters);
        *letter = L'?';
    } else if (n == 0) {
        *letter = L'\0';
    }
    return true;
}

static bool has_typed(void) {
    const LineInfo *line = el_line(t.line);
    return line->lastchar > line->buffer;
}

static void tend(void) {
    host_shell_tend(t.shell, TEND_US);
    t.tended_us = host_now_us();
}

/* libedit's next letter: 1, 0 at the end, -1 for a line that is abandoned. */
static int next_letter(EditLine *line, wchar_t *letter) {
    char byte;
    for (;;) {
        if (t.interrupts > 0) {
            t.typed = has_typed();
            errno = EINTR;
            return -1;
        }
        if (t.resized) {
            t.resized = 0;
            el_resize(line);
            (void)printf(t.dumb ? "\n" : "\r\033[K");
            (void)fflush(stdout);
            (void)el_set(line, EL_REFRESH);
        }
        bool tended = t.shell->open || t.shell->running;
        if (tended && (host_now_us() - t.tended_us > TEND_US || !key_waits(0)))
            tend();
        if (!key_waits(tended ? 0 : IDLE_MS))
            continue;
        ssize_t n = read(STDIN_FILENO, &byte, 1);
        if (n == 1 && letter_of(byte, letter))
            return 1;
        if (n == 0 || (n < 0 && errno != EINTR && errno != EAGAIN))
            return 0;
    }
}

static void list_choices(char **words, unsigned count, size_t from) {
    unsigned widest = 0, width = columns(NULL), across, shown = 0;
    for (unsigned i = 0; i < count; i++) {
        unsigned length = (unsigned)strlen(words[i]);
        widest = length > widest ? length : widest;
    }
    across = width / (widest + 2) > 0 ? width / (widest + 2) : 1;
    (void)from;
    (void)printf("\n");
    for (unsigned i = 0; i < count; i++) {
        (void)printf("%-*s", (int)widest + 2, words[i]);
        if (++shown % across == 0 || i + 1 == count)
            (void)printf("\n");
    }
    (void)fflush(stdout);
}

static size_t common(char **words, unsigned count) {
    size_t length = strlen(words[0]);
    for (unsigned i = 1; i < count; i++) {
        size_t same = 0;
        while (same < length && words[i][same] == words[0][same])
            same++;
        length = same;
    }
    return length;
}

static unsigned char complete(EditLine *line, int key) {
    static char *words[CHOICES];
    char text[1024], more[1024];
    const LineInfo *info = el_line(line);
    size_t from = 0, typed = (size_t)(info->cursor - info->buffer);
    unsigned char result = CC_ERROR;
    (void)key;
    if (typed >= sizeof text)
        return CC_ERROR;
    memcpy(text, info->buffer, typed);
    text[typed] = '\0';
    unsigned count = host_shell_complete(t.shell, text, &from, words, CHOICES);
    if (count > 0) {
        size_t length = common(words, count), word = typed - from;
        bool whole = count == 1 && words[0][length - 1] != '/';
        snprintf(more, sizeof more, "%.*s%s", (int)(length - word),
                 words[0] + word, whole ? " " : "");
        if (more[0] != '\0') {
            result = el_insertstr(line, more) == 0 ? CC_REFRESH : CC_ERROR;
        } else {
            list_choices(words, count, from);
            result = CC_REDISPLAY;
        }
    }
    for (unsigned i = 0; i < count; i++)
        free(words[i]);
    return result;
}

static char *prompt(EditLine *line) {
    static char plain[] = "incode> ", running[] = "incode (run)> ",
                in_use[] = "incode (in use)> ";
    (void)line;
    return t.shell->running ? running : t.shell->in_use ? in_use : plain;
}

/* --- lines ---------------------------------------------------------------- */

static bool begin(struct host_shell *shell) {
    const char *name = getenv("TERM");
    (void)setlocale(LC_CTYPE, "");
    memset(&t, 0, sizeof t);
    t.shell = shell;
    t.dumb = name == NULL || strcmp(name, "dumb") == 0;
    (void)tcgetattr(STDIN_FILENO, &t.before);
    t.line = el_init("incode", stdin, stdout, stderr);
    t.history = host_history_open();
    if (t.line == NULL || t.history == NULL)
        return false;
    (void)el_set(t.line, EL_SIGNAL, 0);
    (void)el_set(t.line, EL_EDITOR, "emacs");
    (void)el_set(t.line, EL_PROMPT, prompt);
    (void)el_set(t.line, EL_HIST, history, t.history);
    (void)el_set(t.line, EL_ADDFN, "complete-word", "completes", complete);
    (void)el_set(t.line, EL_BIND, "^I", "complete-word", NULL);
    (void)el_source(t.line, NULL);
    (void)el_set(t.line, EL_GETCFN, next_letter);
    /* What is typed ahead waits whole, and unseen, until the command is done:
     * a terminal that gathers lines would drop what is too much for it. */
    (void)el_set(t.line, EL_SETTY, "-x", "-icanon", "-echo", NULL);
    return true;
}

/* False: the person leaves. */
static bool abandon_line(void) {
    bool again = t.warned && !t.typed;
    (void)printf("^C\n");
    if (!t.typed && !again)
        (void)printf("Ctrl-C again, or Ctrl-D, leaves\n");
    t.warned = !t.typed;
    t.interrupts = 0;
    return !again;
}

static void do_lines(void) {
    while (!t.shell->leaves && !t.ending) {
        int count = 0;
        t.editing = true;
        const char *line = el_gets(t.line, &count);
        t.editing = false;
        if (t.ending)
            break;
        if (line == NULL && t.interrupts > 0) {
            if (!abandon_line())
                break;
            continue;
        }
        if (line == NULL) {
            (void)printf("\n");
            break;
        }
        char *text = strndup(line, strcspn(line, "\n"));
        t.warned = false;
        if (text != NULL) {
            host_history_add(t.history, text);
            (void)host_shell_line(t.shell, text);
            end_pictures();
            (void)fflush(stdout);
        }
        free(text);
        t.shell->leaves = t.shell->leaves || t.interrupts >= LEAVE;
        t.interrupts = 0;
    }
}

/* A run behind is waited for, so that its end is seen. */
static void leave(void) {
    if (t.shell->running && !t.ending) {
        (void)printf("the run goes on; Ctrl-C ends it\n");
        (void)fflush(stdout);
    }
    host_shell_close(t.shell);
}

static void end(void) {
    if (t.line != NULL)
        el_end(t.line);
    if (t.history != NULL)
        host_history_close(t.history);
    restore_terminal();
}

int host_terminal_run(struct host_shell *shell, int *ending,
                      struct host_error *error) {
    struct sigaction before[SIGNALS];
    struct host_error first = {0};
    *ending = 0;
    if (!begin(shell)) {
        end();
        return host_fail_memory(error, "the line");
    }
    take_signals(before);
    host_note_to(show_host_note);
    int status = host_shell_open(shell, &first);
    if (status == HOST_USAGE || status == HOST_INPUT) {
        *error = first;
    } else {
        if (status != 0)
            show_failed(NULL, first.text);
        t.interrupts = 0;
        do_lines();
        leave();
        status = 0;
    }
    host_note_to(NULL);
    for (unsigned i = 0; i < SIGNALS; i++)
        (void)sigaction(signals[i], &before[i], NULL);
    end();
    *ending = t.ending;
    return status;
}
