#include "commands.h"

#include <glob.h>
#include <histedit.h>
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
    for (unsigned i = 0; i < COMMANDS; i++) {
        if (strcmp(commands[i].name, name) == 0) {
            return &commands[i];
        }
    }
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
    if (one != NULL && one->detail != NULL) {
        host_shell_say(shell, "  %s", one->detail);
    }
    if (one == NULL) {
        host_shell_say(shell, "SET: nodes as 0-3,7, or all");
    }
    if (shell->object != NULL) {
        (void)json_object_set(shell->object, "commands", list);
    }
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
    for (unsigned i = 0; i < COMMANDS; i++) {
        offer(c, commands[i].name);
    }
}

/* The number behind the last comma or dash. */
static void offer_nodes(struct completion *c, unsigned nodes, bool set) {
    char text[300];
    const char *tail = c->word;
    for (const char *p = c->word; set && *p != '\0'; p++) {
        tail = *p == ',' || *p == '-' ? p + 1 : tail;
    }
    if (set && tail == c->word) {
        offer(c, "all");
    }
    if (tail - c->word > 200) {
        return;
    }
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
    if (strcmp(text, name) == 0 && strpbrk(name, " '\"\\#") == NULL) {
        offer(c, name);
    }
}

static void offer_files(struct completion *c) {
    char pattern[1024];
    size_t used = 0;
    glob_t found;
    for (const char *p = c->word; *p != '\0' && used + 4 < sizeof pattern;
         p++) {
        if (strchr("*?[\\", *p) != NULL) {
            pattern[used++] = '\\';
        }
        pattern[used++] = *p;
    }
    pattern[used++] = '*';
    pattern[used] = '\0';
    if (glob(pattern, GLOB_MARK, NULL, &found) == 0) {
        for (size_t i = 0; i < found.gl_pathc; i++) {
            offer_file(c, found.gl_pathv[i]);
        }
        globfree(&found);
    }
}

static void offer_argument(struct host_shell *shell, struct completion *c,
                           const char *name, unsigned place) {
    const struct host_shell_command *command = host_shell_command(name);
    unsigned nodes = shell->open ? shell->machine.nodes : 0;
    if (command == NULL || place >= command->most) {
        return;
    }
    enum host_shell_argument argument =
        command->argument[0] == HOST_SHELL_FILE ? HOST_SHELL_FILE
        : place < HOST_SHELL_ARGUMENTS          ? command->argument[place]
                                                : HOST_SHELL_NOTHING;
    if (argument == HOST_SHELL_SET || argument == HOST_SHELL_NODE) {
        offer_nodes(c, nodes, argument == HOST_SHELL_SET);
    } else if (argument == HOST_SHELL_COMMAND) {
        offer_commands(c);
    } else if (argument == HOST_SHELL_FILE) {
        offer_files(c);
    }
}

/* The word at the end of the line, as it is typed: what is quoted is not
 * completed. */
unsigned host_shell_complete(struct host_shell *shell, const char *line,
                             size_t *from, char **words, unsigned room) {
    size_t size = strlen(line);
    size_t begin = size;
    while (begin > 0 && strchr(" \t", line[begin - 1]) == NULL) {
        begin--;
    }
    struct completion c = {line + begin, words, 0, room};
    *from = begin;
    if (strpbrk(line, "'\"\\#") != NULL) {
        return 0;
    }
    char name[32] = "";
    unsigned place = 0;
    for (size_t i = 0; i < begin;) {
        size_t length = strcspn(line + i, " \t");
        if (length > 0 && name[0] == '\0') {
            snprintf(name, sizeof name, "%.*s", (int)length, line + i);
        } else if (length > 0) {
            place++;
        }
        i += length + strspn(line + i + length, " \t");
    }
    if (name[0] == '\0') {
        offer_commands(&c);
    } else {
        offer_argument(shell, &c, name, place);
    }
    return c.count;
}
