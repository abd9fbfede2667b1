/* A look at a cube that another program has, instead of one's own visit. */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "host/base/clock.h"

/* How long a run that has just begun may take to have the cube's wires. */
enum { HELD_US = 10000000, STEP_US = 50000 };

static uint64_t now_us(void *context) {
    (void)context;
    return host_now_us();
}

static int fail_held(struct host_shell *shell,
                     const struct host_holder *holder) {
    char text[HOST_HOLDER_TEXT];
    if (shell->running) {
        return host_fail(&shell->error, HOST_CUBE,
                         "%s: the run has the cube; abort ends it, wait waits "
                         "for it",
                         shell->command->name);
    }
    return host_fail(&shell->error, HOST_CUBE,
                     "%s: %s has the cube; look on with nodes, links, stat, "
                     "top, memory and log until it has ended",
                     shell->command->name,
                     host_holder_text(holder, text, sizeof text));
}

static int begin_look(struct host_shell *shell, const char *wire) {
    struct host_look *look = &shell->look;
    if (host_look_open(look, wire, &shell->error) != 0) {
        host_look_close(look);
        return shell->error.code;
    }
    memset(&shell->visit, 0, sizeof shell->visit);
    shell->machine = (struct host_machine){.nodes = look->nodes,
                                           .dimension = look->dimension,
                                           .serial_baud = look->serial_baud,
                                           .now_us = now_us};
    shell->visit.machine = &shell->machine;
    shell->visit.node = calloc(look->nodes, sizeof shell->visit.node[0]);
    if (shell->visit.node == NULL) {
        host_look_close(look);
        return host_fail_memory(&shell->error, "the nodes' answers");
    }
    shell->looking = true;
    return 0;
}

void host_shell_look_end(struct host_shell *shell) {
    free(shell->visit.node);
    memset(&shell->visit, 0, sizeof shell->visit);
    host_look_close(&shell->look);
    shell->looking = false;
}

/* The wire, and who has it. */
static bool is_held(const struct host_shell *shell, char wire[HOST_WIRE_NAME],
                    struct host_holder *holder) {
    const struct host_shell_place *place = shell->place;
    return place->wire != NULL && place->wire(place->context, wire) &&
           host_holder_find(holder, wire);
}

bool host_shell_is_held(const struct host_shell *shell,
                        struct host_holder *holder) {
    char wire[HOST_WIRE_NAME];
    return is_held(shell, wire, holder);
}

/* The same, once a run that has just begun has the wire, or has ended. */
static bool await_held(struct host_shell *shell, char wire[HOST_WIRE_NAME],
                       struct host_holder *holder) {
    const struct host_shell_sink *sink = shell->sink;
    uint64_t end_us = host_now_us() + HELD_US;
    bool held;
    while (!(held = is_held(shell, wire, holder)) && shell->running &&
           host_now_us() < end_us &&
           (sink->interrupted == NULL || !sink->interrupted(sink->context))) {
        host_shell_tend(shell, STEP_US);
    }
    return held;
}

int host_shell_reach(struct host_shell *shell) {
    char wire[HOST_WIRE_NAME];
    struct host_holder holder;
    if (shell->open) {
        return 0;
    }
    bool held = shell->command->need == HOST_SHELL_LOOK
                    ? await_held(shell, wire, &holder)
                    : is_held(shell, wire, &holder);
    shell->in_use = held && !shell->running;
    if (held && shell->command->need == HOST_SHELL_LOOK) {
        return begin_look(shell, wire);
    }
    if (held || shell->running) {
        return fail_held(shell, &holder);
    }
    return host_shell_open(shell, &shell->error);
}

int host_shell_look_ask(struct host_shell *shell,
                        const struct host_node_set *set,
                        enum node_question what) {
    const struct host_shell_sink *sink = shell->sink;
    if (host_look_ask(&shell->look, set, what, HOST_SHELL_ANSWER_US,
                      &shell->error) != 0) {
        return shell->error.code;
    }
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        struct host_visit_node *node = &shell->visit.node[i];
        const struct host_look_node *seen = &shell->look.node[i];
        node->answered = node->there = seen->answered;
        node->answer = seen->answer;
        node->size = seen->size;
        if (what == NODE_WHO && seen->answered &&
            seen->size == sizeof node->who) {
            memcpy(&node->who, seen->answer, sizeof node->who);
        }
    }
    if (sink->interrupted != NULL && sink->interrupted(sink->context)) {
        shell->watch.cut = true;
        return host_fail(&shell->error, HOST_CUBE, "interrupted");
    }
    return 0;
}
