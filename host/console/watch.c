#include "watch.h"

#include <stdio.h>
#include <string.h>

#include "shell.h"

void host_watch_init(struct host_watch *watch,
                     const struct host_machine *machine,
                     const struct host_shell_sink *sink) {
    memset(watch, 0, sizeof *watch);
    watch->beneath = *machine;
    watch->sink = sink;
}

static void keep(struct host_watch *w, const uint8_t *bytes, size_t size) {
    if (size > HOST_WATCH_BYTES) {
        bytes += size - HOST_WATCH_BYTES;
        size = HOST_WATCH_BYTES;
    }
    unsigned stay = HOST_WATCH_BYTES - (unsigned)size;
    stay = stay < w->used ? stay : w->used;
    memmove(w->last, w->last + w->used - stay, stay);
    memcpy(w->last + stay, bytes, size);
    w->used = stay + (unsigned)size;
}

void host_watch_noise(const struct host_watch *watch, char *text, size_t size) {
    size_t used = 0;
    text[0] = '\0';
    for (unsigned i = 0; i < watch->used && used + 5 < size; i++) {
        uint8_t c = watch->last[i];
        bool plain = c >= ' ' && c <= '~' && c != '\\';
        int put = c == '\n'   ? snprintf(text + used, size - used, "\\n")
                  : c == '\r' ? snprintf(text + used, size - used, "\\r")
                  : plain     ? snprintf(text + used, size - used, "%c", c)
                          : snprintf(text + used, size - used, "\\x%02x", c);
        used += (size_t)put;
    }
}

static int pipe_send(void *context, const uint8_t *bytes, size_t size) {
    const struct host_watch *w = context;
    return w->beneath.pipe.send(w->beneath.pipe.context, bytes, size);
}

static int pipe_receive(void *context, uint8_t *bytes, size_t size) {
    struct host_watch *w = context;
    int got = w->beneath.pipe.receive(w->beneath.pipe.context, bytes, size);
    if (got > 0) {
        w->received += (unsigned)got;
        keep(w, bytes, (size_t)got);
    }
    return got;
}

/* --- as a machine --------------------------------------------------------- */

static uint64_t now_us(void *context) {
    const struct host_watch *w = context;
    return w->beneath.now_us(w->beneath.context);
}

static void idle(void *context, uint64_t wait_us) {
    const struct host_watch *w = context;
    w->beneath.idle(w->beneath.context, wait_us);
}

static int check(void *context, struct host_error *error) {
    struct host_watch *w = context;
    if (w->sink->interrupted != NULL &&
        w->sink->interrupted(w->sink->context)) {
        w->cut = true;
        return host_fail(error, HOST_CUBE, "interrupted");
    }
    return w->beneath.check(w->beneath.context, error);
}

static unsigned restarts(void *context) {
    const struct host_watch *w = context;
    return w->beneath.restarts(w->beneath.context);
}

static bool kill_node(void *context, unsigned node) {
    const struct host_watch *w = context;
    return w->beneath.kill(w->beneath.context, node);
}

static const char *doubt(void *context, unsigned node) {
    const struct host_watch *w = context;
    return w->beneath.doubt(w->beneath.context, node);
}

static const char *start_line(void *context, unsigned node) {
    const struct host_watch *w = context;
    return w->beneath.start_line(w->beneath.context, node);
}

static const char *address(void *context, unsigned node) {
    const struct host_watch *w = context;
    return w->beneath.address(w->beneath.context, node);
}

static void rest(void *context, uint64_t rest_us) {
    const struct host_watch *w = context;
    w->beneath.rest(w->beneath.context, rest_us);
}

static bool ended(void *context) {
    const struct host_watch *w = context;
    return w->beneath.ended(w->beneath.context);
}

static void stop(void *context) {
    const struct host_watch *w = context;
    w->beneath.stop(w->beneath.context);
}

/* Links that are missing are shown where they are asked for. */
static void missing(void *context, unsigned node, unsigned link) {
    (void)context, (void)node, (void)link;
}

static void told(void *context, const char *line) {
    const struct host_watch *w = context;
    w->sink->note(w->sink->context, line);
}

struct host_machine host_watch_machine(struct host_watch *watch) {
    struct host_machine machine = watch->beneath;
    const struct host_machine *b = &watch->beneath;
    machine.context = watch;
    machine.pipe = (struct link_pipe){watch, pipe_send, pipe_receive};
    machine.wires[0] = machine.pipe;
    machine.missing = missing;
    machine.told = told;
    machine.now_us = now_us;
    machine.idle = idle;
    machine.check = check;
    machine.restarts = b->restarts == NULL ? NULL : restarts;
    machine.kill = b->kill == NULL ? NULL : kill_node;
    machine.doubt = b->doubt == NULL ? NULL : doubt;
    machine.start_line = b->start_line == NULL ? NULL : start_line;
    machine.address = b->address == NULL ? NULL : address;
    machine.rest = b->rest == NULL ? NULL : rest;
    machine.ended = b->ended == NULL ? NULL : ended;
    machine.stop = b->stop == NULL ? NULL : stop;
    return machine;
}
