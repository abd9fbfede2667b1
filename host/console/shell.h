/* The console without its terminal: takes a person's lines, has them done by a
 * cube that it sessions, gives lines back, or an object of JSON for each
 * command. Between two lines it has to be tended, for the cube's links wait for
 * nobody.
 *
 * Memory: the session's, 100 bytes a link, and what one answer takes; none of
 * it grows with time. */
#ifndef HOST_CONSOLE_SHELL_H
#define HOST_CONSOLE_SHELL_H

#include <jansson.h>

#include "host/service/machine.h"
#include "host/watch/look.h"
#include "host/cube/session.h"

/* A machine as it is, but that a person may cut its waits short, that what it
 * has to tell goes where the person reads, and that bytes which are no frame
 * can be shown. */

struct host_shell_sink;

enum { HOST_WATCH_BYTES = 48 };

struct host_watch {
    struct host_machine beneath;
    const struct host_shell_sink *sink;
    bool cut;          /* a wait was cut short */
    uint64_t received; /* bytes, in all */
    unsigned used;
    uint8_t last[HOST_WATCH_BYTES]; /* that came */
};

/* The last bytes that came, as a person can read them. */
void host_watch_noise(const struct host_watch *watch, char *text, size_t size);

/* Where the cube is, and what is beside it. */
struct host_shell_place {
    void *context;
    /* The wires: opened for as long as this console has the cube. */
    int (*open)(void *context, struct host_machine *machine,
                struct host_error *error);
    void (*close)(void *context);
    /* A line that resets the node's board: NULL, or `has_line` false: none. */
    bool (*has_line)(void *context, unsigned node);
    int (*pulse)(void *context, unsigned node, struct host_error *error);
    /* A run on the same cube, as another program that has the wires meanwhile;
     * NULL: there is none.  `prepare` sees the cube before.  `words`: those
     * behind "run".  behind: it does not have the terminal.  `look`: whether it
     * has ended, and then *status; lines that it has said go to `say`. */
    int (*prepare)(void *context, const struct host_session *session,
                   struct host_error *error);
    int (*run)(void *context, int count, const char *const *words, bool behind,
               bool json, struct host_error *error);
    bool (*look)(void *context, int *status,
                 void (*say)(void *context, const char *text), void *say_to,
                 uint64_t wait_us);
    void (*interrupt)(void *context);
    json_t *(*statistics)(void *context); /* of the run that has ended */
    /* The name of the host's first wire, by which it is found who has it:
     * HOST_WIRE_NAME bytes.  NULL, or false: it has none. */
    bool (*wire)(void *context, char *name);
};

/* Who reads. */
struct host_shell_sink {
    void *context;
    void (*line)(void *context, const char *text); /* of an answer */
    void (*note)(void *context, const char *text); /* what befalls the cube */
    void (*failed)(void *context, const char *text);
    /* A picture that is drawn over the one before, lines; false: enough; NULL:
     * no more come.  NULL instead of it: one has to do. */
    bool (*picture)(void *context, const char *text);
    unsigned (*columns)(void *context); /* NULL: 80 */
    bool (*interrupted)(void *context); /* since the last line; NULL: never */
};

/* What was lost on a link, as last told. */
struct host_shell_lost {
    uint32_t epoch, bad, lost;
};

struct host_shell {
    const struct host_shell_place *place;
    const struct host_shell_sink *sink;
    bool json;
    bool leaves; /* `exit` was said */
    int first;   /* status of the first line that failed; 0: none has */
    const struct host_shell_command *command; /* under way, or NULL */
    struct host_error error;                  /* of it */
    json_t *object;                           /* of it, where json */
    char said[1024]; /* where json, of a run: its last line; "": none */
    /* The cube, while this console has it. */
    bool open;
    bool running; /* `run .. &` has it */
    bool in_use;  /* another program has it */
    bool looking; /* on, at what that lets see, for one command: `machine` and
                     `session` have the nodes and their answers alone */
    struct host_look look;
    struct host_machine machine;
    struct host_watch watch;
    struct host_session session;
    uint64_t opened_us, noted_us;
    /* What was told of it. */
    bool wire_up, wire_told;
    uint64_t noise;
    uint32_t *starts;             /* of each node */
    struct host_shell_lost *lost; /* of each link of each node */
};

void host_shell_init(struct host_shell *shell,
                     const struct host_shell_place *place,
                     const struct host_shell_sink *sink, bool json);

/* Whether another program of this machine has the cube, as far as that can be
 * told before the wire is opened, and who: commands that look do so beside it.
 */
bool host_shell_is_held(const struct host_shell *shell,
                        struct host_holder *holder);

/* Opens the cube, which a line does as well: 0, or why not. */
int host_shell_open(struct host_shell *shell, struct host_error *error);

/* Does what the line says, and tells it: its status, which `first` keeps.  An
 * empty line, or one that is a remark behind #, is nothing. */
int host_shell_line(struct host_shell *shell, const char *line);

/* What is wrong beside all lines, told as if `command` had failed by it; NULL:
 * none is meant.  Its status. */
int host_shell_fail(struct host_shell *shell, const char *command,
                    const struct host_error *error);

/* A round without a line; sleeps up to wait_us. */
void host_shell_tend(struct host_shell *shell, uint64_t wait_us);

/* What may stand where the line ends: up to `room` words, each to be freed;
 * *from: bytes of the line before the word that they replace. */
unsigned host_shell_complete(struct host_shell *shell, const char *line,
                             size_t *from, char **words, unsigned room);

/* Waits for a run behind that is not over, and leaves the cube as it is. */
void host_shell_close(struct host_shell *shell);

#endif
