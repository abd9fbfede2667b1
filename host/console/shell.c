#include "shell.h"

#include <histedit.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "host/base/text.h"

static void host_watch_init(struct host_watch *watch,
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

/* Stays valid as long as the watch stays where it is.  Where a person has
 * interrupted, its `check` fails with HOST_CUBE, and watch->cut is set. */
static struct host_machine host_watch_machine(struct host_watch *watch) {
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

/* --- shell ---------------------------------------------------------------- */

enum { LINE = 1024, RUN_WAIT_US = 100000 };

void host_shell_init(struct host_shell *shell,
                     const struct host_shell_place *place,
                     const struct host_shell_sink *sink, bool json) {
    memset(shell, 0, sizeof *shell);
    shell->place = place;
    shell->sink = sink;
    shell->json = json;
}

static void fill_in(char text[LINE], const char *format, va_list list) {
    char raw[LINE];
    (void)vsnprintf(raw, sizeof raw, format, list);
    host_text_printable(text, LINE, raw);
}

void host_shell_say(struct host_shell *shell, const char *format, ...) {
    char text[LINE];
    va_list list;
    if (shell->json)
        return;
    va_start(list, format);
    fill_in(text, format, list);
    va_end(list);
    shell->sink->line(shell->sink->context, text);
}

void host_shell_note(struct host_shell *shell, const char *format, ...) {
    char text[LINE];
    va_list list;
    va_start(list, format);
    fill_in(text, format, list);
    va_end(list);
    shell->sink->note(shell->sink->context, text);
}

/* --- the cube ------------------------------------------------------------- */

void host_shell_leave_cube(struct host_shell *shell) {
    if (!shell->open)
        return;
    host_session_close(&shell->session);
    shell->place->close(shell->place->context);
    free(shell->starts);
    free(shell->lost);
    shell->starts = NULL;
    shell->lost = NULL;
    shell->open = false;
}

int host_shell_open(struct host_shell *shell, struct host_error *error) {
    struct host_machine machine;
    if (shell->open)
        return 0;
    if (shell->place->open(shell->place->context, &machine, error) != 0)
        return error->code;
    host_watch_init(&shell->watch, &machine, shell->sink);
    shell->machine = host_watch_machine(&shell->watch);
    shell->starts = calloc(machine.nodes, sizeof shell->starts[0]);
    shell->lost = calloc(machine.nodes, CUBE_LINKS_MAX * sizeof shell->lost[0]);
    int status =
        shell->starts == NULL || shell->lost == NULL
            ? host_fail_memory(error, "the console")
            : host_session_open(&shell->session, &shell->machine, error);
    if (status != 0) {
        free(shell->starts);
        free(shell->lost);
        shell->place->close(shell->place->context);
        return status;
    }
    shell->open = true;
    shell->in_use = false;
    shell->wire_up = shell->wire_told = false;
    shell->noise = 0;
    shell->opened_us = shell->machine.now_us(shell->machine.context);
    return 0;
}

/* Frames that came on the host's own wire and were none. */
static uint64_t noise_of(const struct host_shell *shell) {
    const struct link_statistics *s =
        cube_link_statistics(shell->session.cube, 0);
    return s->bad_header + s->bad_crc + s->bad_code + s->resynchronised;
}

static void note_wire(struct host_shell *shell, uint64_t now_us) {
    enum link_state state = cube_link_state(shell->session.cube, 0);
    const struct host_machine *m = &shell->machine;
    bool up = state == LINK_UP;
    const char *doubt = m->doubt == NULL ? NULL : m->doubt(m->context, 0);
    if (up && !shell->wire_up && shell->wire_told) {
        host_shell_note(shell, "node 0 link %u: the host's wire is up again",
                        m->dimension);
    } else if (!up && shell->wire_up) {
        host_shell_note(shell, "node 0 link %u: the host's wire is down%s%s",
                        m->dimension, doubt == NULL ? "" : ": ",
                        doubt == NULL ? "" : doubt);
        shell->wire_told = true;
    }
    shell->wire_up = up;
    uint64_t noise = noise_of(shell);
    if (noise == shell->noise || now_us < shell->noted_us)
        return;
    char bytes[5 * HOST_WATCH_BYTES];
    host_watch_noise(&shell->watch, bytes, sizeof bytes);
    if (up) {
        host_shell_note(shell,
                        "node 0 link %u: %" PRIu64 " damaged frame%s on the "
                        "host's wire, %" PRIu64 " in all",
                        m->dimension, noise - shell->noise,
                        host_text_s(noise - shell->noise), noise);
    } else {
        host_shell_note(shell,
                        "node 0 link %u: the host's wire brings what is no "
                        "frame, %" PRIu64 " byte%s so far; the last: \"%s\"",
                        m->dimension, shell->watch.received,
                        host_text_s(shell->watch.received), bytes);
    }
    shell->noise = noise;
    shell->noted_us = now_us + 1000000;
}

/* What has happened to the cube since the last look at it. */
static void note_events(struct host_shell *shell) {
    uint64_t now_us = shell->machine.now_us(shell->machine.context);
    note_wire(shell, now_us);
    struct host_node_set again = {{0}};
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        uint32_t starts = shell->session.node[i].starts;
        if (starts != shell->starts[i] && shell->starts[i] != 0)
            host_node_set_add(&again, i);
        shell->starts[i] = starts;
    }
    if (host_node_set_count(&again) > 0) {
        char text[72];
        host_node_set_name(&again, text, sizeof text);
        host_shell_note(shell, "%s: begun anew", text);
    }
}

/* The session has ended by itself. */
static void lose_cube(struct host_shell *shell,
                      const struct host_error *error) {
    bool cut = shell->watch.cut;
    shell->watch.cut = false;
    if (cut)
        return;
    shell->in_use = shell->session.in_use;
    host_shell_note(shell, "%s", error->text);
    host_shell_leave_cube(shell);
}

static void note_line(void *context, const char *text) {
    host_shell_note(context, "%s", host_shell_unnamed(text));
}

/* Whether a run behind goes on. */
static bool tend_run(struct host_shell *shell, uint64_t wait_us) {
    const struct host_shell_place *place = shell->place;
    int status = 0;
    if (!place->look(place->context, &status, note_line, shell, wait_us))
        return true;
    shell->running = false;
    host_shell_note(shell, "run: ended with status %d", status);
    if (shell->first == 0)
        shell->first = status;
    return false;
}

void host_shell_tend(struct host_shell *shell, uint64_t wait_us) {
    struct host_error error = {0};
    if (shell->running) {
        (void)tend_run(shell, wait_us);
        return;
    }
    if (!shell->open)
        return;
    if (host_session_round(&shell->session, wait_us, &error) != 0) {
        lose_cube(shell, &error);
        return;
    }
    note_events(shell);
}

/* --- lines ---------------------------------------------------------------- */

static const char *command_name(const void *unused, unsigned i) {
    const struct host_shell_command *row = host_shell_command_row(i);
    (void)unused;
    return row == NULL ? NULL : row->name;
}

static int do_command(struct host_shell *shell, unsigned count,
                      const char *const *words) {
    const struct host_shell_command *command = shell->command;
    if (count < command->least || count > command->most) {
        return host_fail(&shell->error, HOST_USAGE, "%s: %s; give %s%s%s",
                         command->name,
                         count < command->least ? "too few arguments"
                                                : "an argument too many",
                         command->name, command->arguments[0] ? " " : "",
                         command->arguments);
    }
    if (command->need != HOST_SHELL_NO_CUBE && host_shell_reach(shell) != 0)
        return shell->error.code;
    int status = command->run(shell, count, words);
    if (shell->looking) {
        host_shell_look_end(shell);
    } else if (shell->open && shell->session.in_use && status != 0) {
        host_shell_leave_cube(shell); /* who has it is found at the next */
        shell->in_use = true;
    }
    return status;
}

static void tell_status(struct host_shell *shell, int status) {
    const struct host_shell_sink *sink = shell->sink;
    if (shell->object != NULL) {
        (void)json_object_set_new(shell->object, "status",
                                  json_integer(status));
        if (status != 0) {
            (void)json_object_set_new(shell->object, "error",
                                      json_string(shell->error.text));
        }
        char *text =
            json_dumps(shell->object, JSON_COMPACT | JSON_ENSURE_ASCII);
        if (text != NULL)
            sink->line(sink->context, text);
        free(text);
        json_decref(shell->object);
        shell->object = NULL;
    }
    if (status != 0 && shell->error.text[0] != '\0')
        sink->failed(sink->context, shell->error.text);
    if (shell->first == 0)
        shell->first = status;
}

int host_shell_fail(struct host_shell *shell, const char *command,
                    const struct host_error *error) {
    shell->error = *error;
    if (shell->json)
        shell->object = json_pack("{ss*}", "command", command);
    tell_status(shell, error->code);
    return error->code;
}

static int do_words(struct host_shell *shell, int count,
                    const char *const *words) {
    int status;
    memset(&shell->error, 0, sizeof shell->error);
    shell->watch.cut = false;
    shell->command = host_shell_command(words[0]);
    if (shell->json) {
        char name[64];
        host_text_printable(name, sizeof name, words[0]);
        shell->object = json_pack("{ss}", "command", name);
    }
    if (shell->command == NULL) {
        const char *near = host_text_nearest(words[0], command_name, NULL);
        status = host_fail(&shell->error, HOST_USAGE,
                           "%s: no such command; %s%s%shelp lists them",
                           words[0], near == NULL ? "" : "did you mean ",
                           near == NULL ? "" : near, near == NULL ? "" : "? ");
    } else {
        status = do_command(shell, (unsigned)count - 1, words + 1);
    }
    if (shell->watch.cut) {
        shell->watch.cut = false;
        memset(&shell->error, 0, sizeof shell->error);
        status = host_fail(&shell->error, HOST_CUBE,
                           "%s: interrupted; nothing of it goes on", words[0]);
    } else if (shell->open) {
        note_events(shell);
    }
    tell_status(shell, status);
    return status;
}

int host_shell_line(struct host_shell *shell, const char *line) {
    int count = 0, status = 0;
    const char **words = NULL;
    Tokenizer *tokens = tok_init(NULL);
    if (tokens == NULL)
        return HOST_BROKEN;
    int wrong = tok_str(tokens, line, &count, &words);
    for (int i = 0; wrong == 0 && i < count; i++)
        count = words[i][0] == '#' ? i : count;
    if (wrong != 0 || count > HOST_SHELL_WORDS) {
        memset(&shell->error, 0, sizeof shell->error);
        shell->object = shell->json ? json_object() : NULL;
        status = host_fail(&shell->error, HOST_USAGE, "%s: %s", line,
                           wrong != 0 ? "a quotation mark without its "
                                        "counterpart; close it"
                                      : "too many words; give fewer");
        tell_status(shell, status);
    } else if (count > 0) {
        status = do_words(shell, count, words);
    }
    tok_end(tokens);
    return status;
}

void host_shell_close(struct host_shell *shell) {
    bool told = false;
    while (shell->running && tend_run(shell, RUN_WAIT_US)) {
        if (!told && shell->sink->interrupted != NULL &&
            shell->sink->interrupted(shell->sink->context)) {
            told = true;
            shell->place->interrupt(shell->place->context);
        }
    }
    host_shell_leave_cube(shell);
}
