#include "shell.h"

#include <string.h>

#include "bare.h"
#include "console.h"

void bare_shell_init(struct bare_shell *shell, struct link_pipe beneath) {
    memset(shell, 0, sizeof *shell);
    shell->beneath = beneath;
}

/* --- what comes ----------------------------------------------------------- */

static bool is_letter(uint8_t byte) {
    uint8_t small = byte | 0x20;
    return small >= 'a' && small <= 'z';
}

static bool is_end(uint8_t byte) {
    return byte == '\r' || byte == '\n';
}

/* No line: the link has it. */
static void let_go(struct bare_shell *s) {
    memcpy(s->passed + s->passed_size, s->held, s->held_size);
    s->passed_size += s->held_size;
    s->held_size = 0;
}

static void end_line(struct bare_shell *s, unsigned size) {
    if (s->lines - s->lines_taken < BARE_SHELL_LINES) {
        char *line = s->line[s->lines++ % BARE_SHELL_LINES];
        memcpy(line, s->held, size);
        line[size] = '\0';
    }
    s->held_size = 0;
    s->at = BARE_SHELL_BETWEEN;
    s->hush_us = s->heard_us + BARE_SHELL_HUSH_US;
}

/* Whether what is held is still the beginning of a line.  An end alone may be a
 * frame's first byte: what follows tells, or that nothing does. */
static bool may_be_line(const struct bare_shell *s) {
    uint8_t last = s->held[s->held_size - 1];
    if (s->held_size == 1)
        return is_letter(last) || is_end(last);
    return s->held_size == 2 ? is_letter(s->held[0]) && is_letter(last)
                             : last >= ' ' && last <= '~';
}

static void rub_out(struct bare_shell *s) {
    s->held_size -= s->held_size > 2; /* two letters tell that it is a line */
}

static void hear(struct bare_shell *s, uint8_t byte) {
    enum { BACKSPACE = '\b', DELETE = 0x7f };
    if (s->at == BARE_SHELL_FRAME) {
        s->passed[s->passed_size++] = byte;
        if (byte == 0) {
            s->at = BARE_SHELL_BETWEEN;
            s->hush_us = 0; /* a program is there, nobody who types */
        }
        return;
    }
    bool second = s->ended && byte == '\n'; /* of CR and LF */
    s->ended = false;
    if (second || (s->held_size == 1 && is_end(s->held[0]) && is_end(byte))) {
        if (!second)
            end_line(s, 0);
        return;
    }
    if (s->held_size > 1 && (byte == BACKSPACE || byte == DELETE)) {
        rub_out(s);
        return;
    }
    s->held[s->held_size++] = byte;
    s->at = BARE_SHELL_TYPED;
    if (byte == 0) { /* noise, or no frame at all */
        let_go(s);
        s->at = BARE_SHELL_BETWEEN;
    } else if (s->held_size > 2 && is_end(byte)) {
        end_line(s, s->held_size - 1);
        s->ended = byte == '\r';
    } else if (!may_be_line(s) || s->held_size == BARE_SHELL_LINE) {
        let_go(s);
        s->at = BARE_SHELL_FRAME;
    }
}

/* Reads some, where the link has taken what was read before: how many bytes. */
static int read_some(struct bare_shell *s) {
    uint8_t bytes[BARE_SHELL_BYTES];
    int got = s->beneath.receive(s->beneath.context, bytes, sizeof bytes);
    s->passed_size = s->passed_taken = 0;
    if (got > 0)
        s->heard_us = board_now_us();
    for (int i = 0; i < got; i++)
        hear(s, bytes[i]);
    return got;
}

static int receive(void *context, uint8_t *bytes, size_t size) {
    struct bare_shell *s = context;
    size_t given = 0;
    while (given < size) {
        if (s->passed_taken == s->passed_size && read_some(s) <= 0)
            break;
        size_t left = s->passed_size - s->passed_taken;
        size_t now = left < size - given ? left : size - given;
        memcpy(bytes + given, s->passed + s->passed_taken, now);
        s->passed_taken += (unsigned)now;
        given += now;
    }
    return (int)given;
}

void bare_shell_alone(struct bare_shell *shell) {
    while (read_some(shell) > 0) {
    }
    shell->passed_size = shell->passed_taken = 0;
    shell->within = false; /* no link ends what was begun */
}

/* --- what goes ------------------------------------------------------------ */

static void say_on(struct bare_shell *s) {
    size_t left = s->said_size - s->said_sent;
    if (left > 0 && !s->within) {
        int taken = s->beneath.send(
            s->beneath.context, (const uint8_t *)s->said + s->said_sent, left);
        s->said_sent += taken > 0 ? (unsigned)taken : 0;
    }
    if (s->said_sent == s->said_size)
        s->said_size = s->said_sent = 0;
}

static int send(void *context, const uint8_t *bytes, size_t size) {
    struct bare_shell *s = context;
    int taken = (int)size;
    say_on(s);
    if (s->said_size > 0 && !s->within)
        return 0; /* first that */
    if (board_now_us() >= s->hush_us) {
        taken = s->beneath.send(s->beneath.context, bytes, size);
        s->within = taken > 0 ? bytes[taken - 1] != 0 : s->within;
    } else {
        s->within = false; /* what was begun is ended by the next record */
    }
    return taken;
}

struct link_pipe bare_shell_pipe(struct bare_shell *shell) {
    return (struct link_pipe){shell, send, receive};
}

bool bare_shell_line(struct bare_shell *shell, char line[BARE_SHELL_LINE + 1],
                     uint64_t now_us) {
    struct bare_shell *s = shell;
    bool silent = now_us - s->heard_us >= BARE_SHELL_SILENCE_US;
    if (silent && s->held_size == 1 && is_end(s->held[0])) {
        end_line(s, 0);
    } else if (silent && s->at == BARE_SHELL_TYPED) {
        s->hush_us = s->heard_us + BARE_SHELL_HUSH_US; /* it is being typed */
    } else if (silent && s->at == BARE_SHELL_FRAME) {
        s->at =
            BARE_SHELL_BETWEEN; /* its end was lost, or its begin was noise */
    }
    say_on(s);
    if (s->lines == s->lines_taken || s->said_size > 0)
        return false;
    memcpy(line, s->line[s->lines_taken++ % BARE_SHELL_LINES],
           sizeof s->line[0]);
    return true;
}

void bare_shell_say(struct bare_shell *shell, const char *text) {
    struct bare_shell *s = shell;
    unsigned at = s->said_size;
    if (at + 3 > BARE_SHELL_TEXT)
        return;
    s->said[at++] = '\0';
    s->said[at++] = (char)BARE_CONSOLE_MARK;
    while (*text != '\0' && at < BARE_SHELL_TEXT - 1)
        s->said[at++] = *text++;
    s->said[at++] = '\0';
    s->said_size = at;
}
