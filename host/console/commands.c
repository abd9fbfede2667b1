#include "commands.h"

#include <glob.h>
#include <histedit.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/base/text.h"

static int help(struct host_shell *shell, unsigned count,
                const char *const *words);

static int leave(struct host_shell *shell, unsigned count,
                 const char *const *words) {
    (void)count, (void)words;
    shell->leaves = true;
    return 0;
}

static int host_shell_run(struct host_shell *shell, unsigned count,
                          const char *const *words);

static int host_shell_abort(struct host_shell *shell, unsigned count,
                            const char *const *words);

static int host_shell_wait(struct host_shell *shell, unsigned count,
                           const char *const *words);

static int host_shell_reset(struct host_shell *shell, unsigned count,
                            const char *const *words);

static const struct host_shell_command commands[] = {
    {"nodes",
     "[SET]",
     "who is there, what is missing, what to do next",
     NULL,
     0,
     1,
     {HOST_SHELL_SET},
     HOST_SHELL_LOOK,
     host_shell_nodes},
    {"links",
     "[SET]",
     "each link: its state, round trip, frames, what was lost",
     "AGAIN are frames that were sent again, BAD frames that came damaged, and "
     "LOST bytes for which a driver had no room, or which were no frame.",
     0,
     1,
     {HOST_SHELL_SET},
     HOST_SHELL_LOOK,
     host_shell_links},
    {"stat",
     "[SET]",
     "what each node has done since its start",
     NULL,
     0,
     1,
     {HOST_SHELL_SET},
     HOST_SHELL_LOOK,
     host_shell_stat},
    {"top",
     "[SET]",
     "memory, pages, front and link use, live; q leaves",
     "Without a terminal: once.",
     0,
     1,
     {HOST_SHELL_SET},
     HOST_SHELL_LOOK,
     host_shell_top},
    {"run",
     "POINTS [OPTION]... [&]",
     "triangulate on this cube: incode run",
     "With & at the end the console goes on beside it: nodes and top look on, "
     "abort ends it, wait waits for it.",
     1,
     HOST_SHELL_WORDS,
     {HOST_SHELL_FILE},
     HOST_SHELL_NO_CUBE,
     host_shell_run},
    {"abort",
     "",
     "end the run that this console has begun",
     NULL,
     0,
     0,
     {HOST_SHELL_NOTHING},
     HOST_SHELL_NO_CUBE,
     host_shell_abort},
    {"wait",
     "",
     "until that run has ended",
     NULL,
     0,
     0,
     {HOST_SHELL_NOTHING},
     HOST_SHELL_NO_CUBE,
     host_shell_wait},
    {"log",
     "[SET]",
     "what nodes say of themselves: last fault, last start",
     NULL,
     0,
     1,
     {HOST_SHELL_SET},
     HOST_SHELL_LOOK,
     host_shell_log},
    {"reset",
     "SET",
     "have nodes begin anew",
     "A node that does not answer is reset by its line, where the cube file "
     "names one.",
     1,
     1,
     {HOST_SHELL_SET},
     HOST_SHELL_CUBE,
     host_shell_reset},
    {"ping",
     "SET [TIMES]",
     "how long an answer takes, of 5 unless given",
     NULL,
     1,
     2,
     {HOST_SHELL_SET, HOST_SHELL_NUMBER},
     HOST_SHELL_CUBE,
     host_shell_ping},
    {"trace",
     "A B",
     "the way from node to node, hop by hop, with times",
     NULL,
     2,
     2,
     {HOST_SHELL_NODE, HOST_SHELL_NODE},
     HOST_SHELL_CUBE,
     host_shell_trace},
    {"memory",
     "[SET]",
     "what fills each node's memory",
     NULL,
     0,
     1,
     {HOST_SHELL_SET},
     HOST_SHELL_LOOK,
     host_shell_memory},
    {"wires",
     "",
     "a drawing of the cube, dead and wrong wires marked",
     NULL,
     0,
     0,
     {HOST_SHELL_NOTHING},
     HOST_SHELL_CUBE,
     host_shell_wires},
    {"help",
     "[COMMAND]",
     "this list, or more of one command",
     NULL,
     0,
     1,
     {HOST_SHELL_COMMAND},
     HOST_SHELL_NO_CUBE,
     help},
    {"exit",
     "",
     "leave; Ctrl-D does as well",
     NULL,
     0,
     0,
     {HOST_SHELL_NOTHING},
     HOST_SHELL_NO_CUBE,
     leave},
};

enum { COMMANDS = sizeof commands / sizeof commands[0], COLUMN = 28 };

const struct host_shell_command *host_shell_command_row(unsigned i) {
    return i < COMMANDS ? &commands[i] : NULL;
}

const struct host_shell_command *host_shell_command(const char *name) {
    for (unsigned i = 0; i < COMMANDS; i++)
        if (strcmp(commands[i].name, name) == 0)
            return &commands[i];
    return NULL;
}

static void tell_help(struct host_shell *shell,
                      const struct host_shell_command *command) {
    char usage[64];
    snprintf(usage, sizeof usage, "%s %s", command->name, command->arguments);
    host_shell_say(shell, "  %-*s%s", COLUMN, usage, command->help);
}

static int help(struct host_shell *shell, unsigned count,
                const char *const *words) {
    const struct host_shell_command *one =
        count == 0 ? NULL : host_shell_command(words[0]);
    if (count == 1 && one == NULL) {
        return host_fail(&shell->error, HOST_USAGE,
                         "help %s: no such command; help alone lists them",
                         words[0]);
    }
    json_t *list = json_array();
    for (unsigned i = 0; i < COMMANDS; i++) {
        if (one == NULL || one == &commands[i]) {
            tell_help(shell, &commands[i]);
            (void)json_array_append_new(
                list,
                json_pack("{ssssss}", "name", commands[i].name, "arguments",
                          commands[i].arguments, "help", commands[i].help));
        }
    }
    if (one != NULL && one->detail != NULL)
        host_shell_say(shell, "  %s", one->detail);
    if (one == NULL)
        host_shell_say(shell, "SET: nodes as 0-3,7, or all");
    if (shell->object != NULL)
        (void)json_object_set(shell->object, "commands", list);
    json_decref(list);
    return 0;
}

/* --- completion ----------------------------------------------------------- */

struct completion {
    const char *word; /* as far as it stands */
    char **words;
    unsigned count, room;
};

static void offer(struct completion *c, const char *candidate) {
    if (c->count < c->room &&
        strncmp(candidate, c->word, strlen(c->word)) == 0) {
        c->words[c->count] = strdup(candidate);
        c->count += c->words[c->count] != NULL;
    }
}

static void offer_commands(struct completion *c) {
    for (unsigned i = 0; i < COMMANDS; i++)
        offer(c, commands[i].name);
}

/* The number behind the last comma or dash. */
static void offer_nodes(struct completion *c, unsigned nodes, bool set) {
    char text[300];
    const char *tail = c->word;
    for (const char *p = c->word; set && *p != '\0'; p++)
        tail = *p == ',' || *p == '-' ? p + 1 : tail;
    if (set && tail == c->word)
        offer(c, "all");
    if (tail - c->word > 200)
        return;
    for (unsigned i = 0; i < nodes; i++) {
        snprintf(text, sizeof text, "%.*s%u", (int)(tail - c->word), c->word,
                 i);
        offer(c, text);
    }
}

/* What would have to be quoted, or does something to a terminal, is not
 * offered. */
static void offer_file(struct completion *c, const char *name) {
    char text[1024];
    host_text_printable(text, sizeof text, name);
    if (strcmp(text, name) == 0 && strpbrk(name, " '\"\\#") == NULL)
        offer(c, name);
}

static void offer_files(struct completion *c) {
    char pattern[1024];
    size_t used = 0;
    glob_t found;
    for (const char *p = c->word; *p != '\0' && used + 4 < sizeof pattern;
         p++) {
        if (strchr("*?[\\", *p) != NULL)
            pattern[used++] = '\\';
        pattern[used++] = *p;
    }
    pattern[used++] = '*';
    pattern[used] = '\0';
    if (glob(pattern, GLOB_MARK, NULL, &found) == 0) {
        for (size_t i = 0; i < found.gl_pathc; i++)
            offer_file(c, found.gl_pathv[i]);
        globfree(&found);
    }
}

static void offer_argument(struct host_shell *shell, struct completion *c,
                           const char *name, unsigned place) {
    const struct host_shell_command *command = host_shell_command(name);
    unsigned nodes = shell->open ? shell->machine.nodes : 0;
    if (command == NULL || place >= command->most)
        return;
    enum host_shell_argument argument =
        command->argument[0] == HOST_SHELL_FILE ? HOST_SHELL_FILE
        : place < HOST_SHELL_ARGUMENTS          ? command->argument[place]
                                                : HOST_SHELL_NOTHING;
    if (argument == HOST_SHELL_SET || argument == HOST_SHELL_NODE)
        offer_nodes(c, nodes, argument == HOST_SHELL_SET);
    else if (argument == HOST_SHELL_COMMAND)
        offer_commands(c);
    else if (argument == HOST_SHELL_FILE)
        offer_files(c);
}

/* The word at the end of the line, as it is typed: what is quoted is not
 * completed. */
unsigned host_shell_complete(struct host_shell *shell, const char *line,
                             size_t *from, char **words, unsigned room) {
    size_t size = strlen(line);
    size_t begin = size;
    while (begin > 0 && strchr(" \t", line[begin - 1]) == NULL)
        begin--;
    struct completion c = {line + begin, words, 0, room};
    *from = begin;
    if (strpbrk(line, "'\"\\#") != NULL)
        return 0;
    char name[32] = "";
    unsigned place = 0;
    for (size_t i = 0; i < begin;) {
        size_t length = strcspn(line + i, " \t");
        if (length > 0 && name[0] == '\0')
            snprintf(name, sizeof name, "%.*s", (int)length, line + i);
        else if (length > 0)
            place++;
        i += length + strspn(line + i + length, " \t");
    }
    if (name[0] == '\0')
        offer_commands(&c);
    else
        offer_argument(shell, &c, name, place);
    return c.count;
}

/* reset, run, abort, wait: what changes what the cube does. */

enum { RESET_US = 20000000, STEP_US = 100000, RUN_WAIT_US = 100000 };

/* --- reset ---------------------------------------------------------------- */

/* Those who do not answer, by their lines; who has none stays in `left`. */
static int pulse_lines(struct host_shell *shell, struct host_node_set *left) {
    const struct host_shell_place *place = shell->place;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        if (host_node_set_has(left, i) && place->has_line != NULL &&
            place->has_line(place->context, i)) {
            if (place->pulse(place->context, i, &shell->error) != 0)
                return shell->error.code;
            host_node_set_remove(left, i);
        }
    }
    return 0;
}

/* Until each has started since `starts`, which is the shell's own note. */
static int await_starts(struct host_shell *shell,
                        const struct host_node_set *set,
                        struct host_node_set *late) {
    const struct host_machine *m = &shell->machine;
    uint64_t end = m->now_us(m->context) + RESET_US;
    do {
        memset(late, 0, sizeof *late);
        for (unsigned i = 0; i < m->nodes; i++) {
            const struct host_session_node *n = &shell->session.node[i];
            if (host_node_set_has(set, i) &&
                !(n->there && n->starts != shell->starts[i]))
                host_node_set_add(late, i);
        }
        if (host_node_set_count(late) == 0)
            break;
        if (host_session_round(&shell->session, STEP_US, &shell->error) != 0)
            return shell->error.code;
    } while (m->now_us(m->context) < end);
    return 0;
}

static void tell_reset(struct host_shell *shell, unsigned node,
                       struct host_fold *fold, json_t *object) {
    (void)shell;
    host_fold_add(fold, node, "begun anew");
    (void)json_object_set_new(object, "reset", json_true());
}

static int host_shell_reset(struct host_shell *shell, unsigned count,
                            const char *const *words) {
    struct host_session *session = &shell->session;
    struct host_node_set set, there = {{0}}, left = {{0}}, late;
    (void)count;
    if (host_shell_set(shell, words[0], &set) != 0 ||
        host_shell_ask(shell, &set, NODE_WHO, 0) != 0)
        return shell->error.code;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        shell->starts[i] = session->node[i].starts;
        if (host_node_set_has(&set, i))
            host_node_set_add(session->node[i].answered ? &there : &left, i);
    }
    if (pulse_lines(shell, &left) != 0 ||
        (host_node_set_count(&there) > 0 &&
         host_session_restart(session, &there, NODE_RESTART_PLAIN,
                              &shell->error) != 0))
        return shell->error.code;
    struct host_node_set due = set;
    for (unsigned i = 0; i < sizeof due.bits; i++)
        due.bits[i] &= (uint8_t)~left.bits[i];
    if (await_starts(shell, &due, &late) != 0)
        return shell->error.code;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        shell->starts[i] = session->node[i].starts; /* asked for: no news */
        session->node[i].answered =
            host_node_set_has(&due, i) && !host_node_set_has(&late, i);
    }
    return host_shell_answers(shell, &set, NULL, tell_reset);
}

/* --- run, abort, wait ----------------------------------------------------- */

const char *host_shell_unnamed(const char *text) {
    static const char name[] = "incode: ";
    return strncmp(text, name, sizeof name - 1) == 0 ? text + sizeof name - 1
                                                     : text;
}

/* Where answers are objects, what a run says is noted but for the last line,
 * which tells why it failed, if it has. */
static void say_text(void *context, const char *text) {
    struct host_shell *shell = context;
    if (!shell->json) {
        host_shell_say(shell, "%s", text);
        return;
    }
    if (shell->said[0] != '\0')
        host_shell_note(shell, "%s", shell->said);
    snprintf(shell->said, sizeof shell->said, "%s", host_shell_unnamed(text));
}

static int fail_run(struct host_shell *shell, int status) {
    if (shell->said[0] != '\0')
        return host_fail(&shell->error, status, "%s", shell->said);
    return host_fail(&shell->error, status,
                     "run: it ended with status %d; what it says above tells "
                     "why",
                     status);
}

static int finish_run(struct host_shell *shell, int status) {
    const struct host_shell_place *place = shell->place;
    json_t *statistics = shell->object == NULL || place->statistics == NULL
                             ? NULL
                             : place->statistics(place->context);
    if (statistics != NULL)
        (void)json_object_set_new(shell->object, "statistics", statistics);
    int code = status == 0 ? 0 : fail_run(shell, status);
    if (status == 0 && shell->said[0] != '\0')
        host_shell_note(shell, "%s", shell->said);
    shell->said[0] = '\0';
    return code;
}

static int await_run(struct host_shell *shell) {
    const struct host_shell_place *place = shell->place;
    const struct host_shell_sink *sink = shell->sink;
    int status = 0;
    bool told = false;
    while (
        !place->look(place->context, &status, say_text, shell, RUN_WAIT_US)) {
        if (!told && sink->interrupted != NULL &&
            sink->interrupted(sink->context)) {
            told = true;
            place->interrupt(place->context);
        }
    }
    shell->running = false;
    return finish_run(shell, status);
}

/* The cube is left to the run, once all that will come has been seen. */
static int prepare_run(struct host_shell *shell) {
    const struct host_shell_place *place = shell->place;
    struct host_node_set all;
    if (host_shell_open(shell, &shell->error) != 0)
        return shell->error.code;
    host_node_set_all(&all, shell->machine.nodes);
    int status = host_shell_ask(shell, &all, NODE_WHO, 0);
    if (status == 0 && place->prepare != NULL)
        status = place->prepare(place->context, &shell->session, &shell->error);
    host_shell_leave_cube(shell);
    return status;
}

static int host_shell_run(struct host_shell *shell, unsigned count,
                          const char *const *words) {
    const struct host_shell_place *place = shell->place;
    bool behind = strcmp(words[count - 1], "&") == 0;
    if (shell->running) {
        return host_fail(&shell->error, HOST_CUBE,
                         "run: one goes on already; abort ends it, wait waits "
                         "for it");
    }
    if (place->run == NULL || (behind && count == 1)) {
        return host_fail(&shell->error, HOST_USAGE,
                         "run: %s; see incode run --help",
                         place->run == NULL ? "there is no program for it here"
                                            : "POINTS are missing");
    }
    if (prepare_run(shell) != 0 ||
        place->run(place->context, (int)(count - behind), words, behind,
                   shell->json, &shell->error) != 0)
        return shell->error.code;
    shell->running = true;
    if (behind) {
        host_shell_say(shell, "run: begun; abort ends it, wait waits for it");
        return 0;
    }
    return await_run(shell);
}

static int host_shell_abort(struct host_shell *shell, unsigned count,
                            const char *const *words) {
    const struct host_shell_place *place = shell->place;
    int status = 0;
    (void)count, (void)words;
    if (!shell->running) {
        return host_fail(&shell->error, HOST_USAGE,
                         "abort: this console has begun no run; one of another "
                         "program is ended there");
    }
    place->interrupt(place->context);
    while (
        !place->look(place->context, &status, say_text, shell, RUN_WAIT_US)) {
    }
    shell->running = false;
    host_shell_say(shell, "run: ended");
    return 0;
}

static int host_shell_wait(struct host_shell *shell, unsigned count,
                           const char *const *words) {
    (void)count, (void)words;
    return shell->running ? await_run(shell) : 0;
}
