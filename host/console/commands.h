/* The console's commands: a row each, from which help and completion come.  A
 * new one is a row and its function. */
#ifndef HOST_CONSOLE_COMMANDS_H
#define HOST_CONSOLE_COMMANDS_H

#include <stdio.h>

#include "fold.h"
#include "shell.h"

enum {
    HOST_SHELL_WORDS = 64, /* of a line */
    HOST_SHELL_ANSWER_US = 3000000,
    HOST_SHELL_REASON = 400 /* why a node is not there */
};

/* What may stand in an argument's place. */
enum host_shell_argument {
    HOST_SHELL_NOTHING,
    HOST_SHELL_SET,
    HOST_SHELL_NODE,
    HOST_SHELL_NUMBER,
    HOST_SHELL_COMMAND,
    HOST_SHELL_FILE, /* and so are all behind it */
    HOST_SHELL_ARGUMENTS = 2
};

/* What it takes of the cube. */
enum host_shell_need {
    HOST_SHELL_NO_CUBE,
    HOST_SHELL_LOOK, /* what nodes answer: a look at another program's, too */
    HOST_SHELL_CUBE
};

struct host_shell_command {
    const char *name, *arguments;
    const char *help;   /* in a line */
    const char *detail; /* what else there is to say, or NULL */
    unsigned least, most;
    enum host_shell_argument argument[HOST_SHELL_ARGUMENTS];
    enum host_shell_need need;
    /* Words behind the command's name.  What it returns is its status; why is
     * in shell->error. */
    int (*run)(struct host_shell *shell, unsigned count,
               const char *const *words);
};

/* NULL: there is none of that name. */
const struct host_shell_command *host_shell_command(const char *name);
const struct host_shell_command *host_shell_command_row(unsigned i);

int host_shell_nodes(struct host_shell *, unsigned, const char *const *);
int host_shell_links(struct host_shell *, unsigned, const char *const *);
int host_shell_stat(struct host_shell *, unsigned, const char *const *);
int host_shell_top(struct host_shell *, unsigned, const char *const *);
int host_shell_log(struct host_shell *, unsigned, const char *const *);
int host_shell_ping(struct host_shell *, unsigned, const char *const *);
int host_shell_trace(struct host_shell *, unsigned, const char *const *);
int host_shell_memory(struct host_shell *, unsigned, const char *const *);
int host_shell_wires(struct host_shell *, unsigned, const char *const *);

/* --- what they share ------------------------------------------------------ */

/* A line of the answer, or nothing where it is JSON. */
void host_shell_say(struct host_shell *shell, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* A line beside the answers. */
void host_shell_note(struct host_shell *shell, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* The set that a word names, all where it is NULL. */
int host_shell_set(struct host_shell *shell, const char *word,
                   struct host_node_set *set);

/* Gives the wires up, until a command needs them. */
void host_shell_leave_cube(struct host_shell *shell);

/* Gives nodes that have just begun a moment to answer, and then asks each that
 * is there. */
int host_shell_ask(struct host_shell *shell, const struct host_node_set *set,
                   enum node_question what, unsigned target);

/* How an answer is told: a row or a few, added to `fold`, and the fields of an
 * object. */
typedef void host_shell_tell(struct host_shell *shell, unsigned node,
                             struct host_fold *fold, json_t *object);

/* Asks the set, and tells the answers: HOST_CUBE where one has not answered. */
int host_shell_ask_tell(struct host_shell *shell,
                        const struct host_node_set *set,
                        enum node_question what, const char *heading,
                        host_shell_tell *tell);

/* Tells what is there; error for those of the set who have not answered. */
int host_shell_answers(struct host_shell *shell,
                       const struct host_node_set *set, const char *heading,
                       host_shell_tell *tell);

/* The cube for this command: its own, or a look at another program's. */
int host_shell_reach(struct host_shell *shell);
void host_shell_look_end(struct host_shell *shell);

/* What a run has said, without the name that a note and a failure have before
 * them anyway. */
const char *host_shell_unnamed(const char *text);

/* HOST_CUBE where one of the set has not answered, and why; else 0. */
int host_shell_fail_absent(struct host_shell *shell,
                           const struct host_node_set *set);

/* The answer of a node if it is that long at least, else NULL. */
const void *host_shell_answer(const struct host_shell *shell, unsigned node,
                              size_t size);

/* Bytes, microseconds and counts in few letters: "3.9M", "1.25 ms". */
enum { HOST_SHELL_FIGURE = 16 };
const char *host_shell_bytes(uint64_t bytes, char text[HOST_SHELL_FIGURE]);
const char *host_shell_count(uint64_t count, char text[HOST_SHELL_FIGURE]);
const char *host_shell_time(uint64_t us, char text[HOST_SHELL_FIGURE]);

/* "[####      ]", of so many cells. */
enum { HOST_SHELL_BAR = 64 };
const char *host_shell_bar(double part, unsigned cells,
                           char text[HOST_SHELL_BAR]);

#endif
