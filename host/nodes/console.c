#include "console.h"

#include <stdio.h>
#include <string.h>

#include "host/base/progress.h"

enum { RECORD = 0xff };

/* Between what happened and the registers, in every board's report of a fault
 * (boards/bare/fault_text.c). */
#define RESTARTING "; restarting"

void host_console_init(struct host_console *console, unsigned node,
                       const char *board) {
    memset(console, 0, sizeof *console);
    console->node = node;
    console->board = board;
}

/* A record is whole.  Of a report its board's name is left out: here it has a
 * number, too. */
static void take(struct host_console *c) {
    char before[48];
    c->used -= c->used > 0 && c->text[c->used - 1] == ' ';
    c->text[c->used] = '\0';
    char *rest = strstr(c->text, RESTARTING);
    if (rest == NULL) {
        return;
    }
    *rest = '\0';
    rest += strlen(RESTARTING);
    int length = snprintf(before, sizeof before, "incode: %s: ", c->board);
    bool named = strncmp(c->text, before, (size_t)length) == 0;
    snprintf(c->fault, sizeof c->fault, "%s", c->text + (named ? length : 0));
    c->faults++;
    host_note("node %u (%s): its report of a fault: %s,%s; it starts again",
              c->node, c->board, c->fault, rest);
}

/* A byte that no text has makes a frame of a record. */
static void hear(struct host_console *c, uint8_t byte) {
    bool blank = byte == '\n' || byte == '\r' || byte == '\t' || byte == ' ';
    if (byte == 0) {
        if (c->at == HOST_CONSOLE_RECORD && c->used > 0) {
            take(c);
        }
        c->at = HOST_CONSOLE_ZERO;
    } else if (c->at == HOST_CONSOLE_ZERO) {
        c->at = byte == RECORD ? HOST_CONSOLE_RECORD : HOST_CONSOLE_OTHER;
        c->used = 0;
    } else if (c->at == HOST_CONSOLE_RECORD) {
        if (!blank && (byte < ' ' || byte > '~')) {
            c->at = HOST_CONSOLE_OTHER;
        } else if (c->used < HOST_CONSOLE_TEXT && (!blank || c->used > 0) &&
                   (!blank || c->text[c->used - 1] != ' ')) {
            c->text[c->used++] = blank ? ' ' : (char)byte;
        }
    }
}

void host_console_hear(struct host_console *console, const uint8_t *bytes,
                       size_t size) {
    for (size_t i = 0; i < size; i++) {
        hear(console, bytes[i]);
    }
}

static int pipe_send(void *context, const uint8_t *bytes, size_t size) {
    const struct host_console *c = context;
    return c->beneath.send(c->beneath.context, bytes, size);
}

static int pipe_receive(void *context, uint8_t *bytes, size_t size) {
    struct host_console *c = context;
    int got = c->beneath.receive(c->beneath.context, bytes, size);
    if (got > 0) {
        host_console_hear(c, bytes, (size_t)got);
    }
    return got;
}

struct link_pipe host_console_pipe(struct host_console *console,
                                   struct link_pipe beneath) {
    console->beneath = beneath;
    return (struct link_pipe){console, pipe_send, pipe_receive};
}

const char *host_console_fault(const struct host_console *console) {
    return console->faults == 0 ? NULL : console->fault;
}
