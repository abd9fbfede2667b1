/* reset, run, abort, wait: what changes what the cube does. */
#include <stdio.h>
#include <string.h>

#include "commands.h"

enum { RESET_US = 20000000, STEP_US = 100000, RUN_WAIT_US = 100000 };

/* --- reset ---------------------------------------------------------------- */

/* Those who do not answer, by their lines; who has none stays in `left`. */
static int pulse_lines(struct host_shell *shell, struct host_node_set *left) {
    const struct host_shell_place *place = shell->place;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        if (host_node_set_has(left, i) && place->has_line != NULL &&
            place->has_line(place->context, i)) {
            if (place->pulse(place->context, i, &shell->error) != 0) {
                return shell->error.code;
            }
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
            const struct host_visit_node *n = &shell->visit.node[i];
            if (host_node_set_has(set, i) &&
                !(n->there && n->starts != shell->starts[i])) {
                host_node_set_add(late, i);
            }
        }
        if (host_node_set_count(late) == 0) {
            break;
        }
        if (host_visit_round(&shell->visit, STEP_US, &shell->error) != 0) {
            return shell->error.code;
        }
    } while (m->now_us(m->context) < end);
    return 0;
}

static void tell_reset(struct host_shell *shell, unsigned node,
                       struct host_fold *fold, json_t *object) {
    (void)shell;
    host_fold_add(fold, node, "begun anew");
    (void)json_object_set_new(object, "reset", json_true());
}

int host_shell_reset(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct host_visit *visit = &shell->visit;
    struct host_node_set set, there = {{0}}, left = {{0}}, late;
    (void)count;
    if (host_shell_set(shell, words[0], &set) != 0 ||
        host_shell_ask(shell, &set, NODE_WHO, 0) != 0) {
        return shell->error.code;
    }
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        shell->starts[i] = visit->node[i].starts;
        if (host_node_set_has(&set, i)) {
            host_node_set_add(visit->node[i].answered ? &there : &left, i);
        }
    }
    if (pulse_lines(shell, &left) != 0 ||
        (host_node_set_count(&there) > 0 &&
         host_visit_restart(visit, &there, NODE_RESTART_PLAIN, &shell->error) !=
             0)) {
        return shell->error.code;
    }
    struct host_node_set due = set;
    for (unsigned i = 0; i < sizeof due.bits; i++) {
        due.bits[i] &= (uint8_t)~left.bits[i];
    }
    if (await_starts(shell, &due, &late) != 0) {
        return shell->error.code;
    }
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        shell->starts[i] = visit->node[i].starts; /* asked for: no news */
        visit->node[i].answered =
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
    if (shell->said[0] != '\0') {
        host_shell_note(shell, "%s", shell->said);
    }
    snprintf(shell->said, sizeof shell->said, "%s", host_shell_unnamed(text));
}

static int fail_run(struct host_shell *shell, int status) {
    if (shell->said[0] != '\0') {
        return host_fail(&shell->error, status, "%s", shell->said);
    }
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
    if (statistics != NULL) {
        (void)json_object_set_new(shell->object, "statistics", statistics);
    }
    int code = status == 0 ? 0 : fail_run(shell, status);
    if (status == 0 && shell->said[0] != '\0') {
        host_shell_note(shell, "%s", shell->said);
    }
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
    if (host_shell_open(shell, &shell->error) != 0) {
        return shell->error.code;
    }
    host_node_set_all(&all, shell->machine.nodes);
    int status = host_shell_ask(shell, &all, NODE_WHO, 0);
    if (status == 0 && place->prepare != NULL) {
        status = place->prepare(place->context, &shell->visit, &shell->error);
    }
    host_shell_leave_cube(shell);
    return status;
}

int host_shell_run(struct host_shell *shell, unsigned count,
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
                   shell->json, &shell->error) != 0) {
        return shell->error.code;
    }
    shell->running = true;
    if (behind) {
        host_shell_say(shell, "run: begun; abort ends it, wait waits for it");
        return 0;
    }
    return await_run(shell);
}

int host_shell_abort(struct host_shell *shell, unsigned count,
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

int host_shell_wait(struct host_shell *shell, unsigned count,
                    const char *const *words) {
    (void)count, (void)words;
    return shell->running ? await_run(shell) : 0;
}
