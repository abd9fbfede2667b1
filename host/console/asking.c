/* What commands that ask a set of nodes share. */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "host/base/parse.h"

enum { BEGIN_US = 3000000 }; /* within which a cube is found */

int host_shell_set(struct host_shell *shell, const char *word,
                   struct host_node_set *set) {
    if (word == NULL) {
        host_node_set_all(set, shell->machine.nodes);
        return 0;
    }
    return host_node_set_parse(set, word, shell->machine.nodes, &shell->error);
}

int host_shell_node(struct host_shell *shell, const char *word,
                    unsigned *node) {
    uint64_t number;
    if (host_parse_number(word, 0, shell->machine.nodes - 1, &number) != 0) {
        return host_fail(&shell->error, HOST_USAGE,
                         "%s %s: no node of this cube; give 0 to %u",
                         shell->command->name, word, shell->machine.nodes - 1);
    }
    *node = (unsigned)number;
    return 0;
}

const void *host_shell_answer(const struct host_shell *shell, unsigned node,
                              size_t size) {
    const struct host_visit_node *n = &shell->visit.node[node];
    return n->answered && n->size >= size ? n->answer : NULL;
}

int host_shell_ask(struct host_shell *shell, const struct host_node_set *set,
                   enum node_question what, unsigned target) {
    struct host_visit *visit = &shell->visit;
    if (shell->looking) {
        return host_shell_look_ask(shell, set, what);
    }
    struct host_node_set there = {{0}};
    uint64_t age_us =
        shell->machine.now_us(shell->machine.context) - shell->opened_us;
    if (age_us < BEGIN_US &&
        host_visit_wait(visit, set, BEGIN_US - age_us, &shell->error) != 0) {
        return shell->error.code;
    }
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        visit->node[i].answered = false;
        if (host_node_set_has(set, i) && visit->node[i].there) {
            host_node_set_add(&there, i);
        }
    }
    return host_node_set_count(&there) == 0
               ? 0
               : host_visit_ask(visit, &there, what, target,
                                HOST_SHELL_ANSWER_US, &shell->error);
}

/* Why a node has not answered, and what to do next. */
static const char *reason_of(const struct host_shell *shell, unsigned node,
                             char text[HOST_SHELL_REASON]) {
    return shell->looking ? "no answer while another program has the cube; "
                            "look again in a moment"
                          : host_visit_reason(&shell->visit, node, text,
                                              HOST_SHELL_REASON);
}

static void tell_absent(struct host_shell *shell, unsigned node,
                        struct host_fold *fold, json_t *object) {
    char reason[HOST_SHELL_REASON];
    const char *why = reason_of(shell, node, reason);
    host_fold_add(fold, node, why);
    (void)json_object_set_new(object, "error", json_string(why));
}

static void say_line(void *context, const char *text) {
    host_shell_say(context, "%s", text);
}

int host_shell_fail_absent(struct host_shell *shell,
                           const struct host_node_set *set) {
    struct host_node_set absent = {{0}};
    unsigned first = CUBE_HOST;
    char names[72], reason[HOST_SHELL_REASON];
    for (unsigned i = shell->machine.nodes; i-- > 0;) {
        if (host_node_set_has(set, i) && !shell->visit.node[i].answered) {
            host_node_set_add(&absent, i);
            first = i;
        }
    }
    if (first == CUBE_HOST) {
        return 0;
    }
    host_node_set_name(&absent, names, sizeof names);
    return host_fail(&shell->error, HOST_CUBE, "%s: %s: %s", names,
                     shell->command->name, reason_of(shell, first, reason));
}

int host_shell_answers(struct host_shell *shell,
                       const struct host_node_set *set, const char *heading,
                       host_shell_tell *tell) {
    struct host_fold fold = {0};
    json_t *list = json_array();
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        if (!host_node_set_has(set, i)) {
            continue;
        }
        json_t *object = json_pack("{si}", "node", (int)i);
        if (shell->visit.node[i].answered) {
            tell(shell, i, &fold, object);
        } else {
            tell_absent(shell, i, &fold, object);
        }
        (void)json_array_append_new(list, object);
    }
    if (shell->object != NULL) {
        (void)json_object_set(shell->object, "nodes", list);
    }
    json_decref(list);
    host_fold_print(&fold, heading, say_line, shell);
    bool broken = fold.broken;
    host_fold_free(&fold);
    return broken ? host_fail_memory(&shell->error, "an answer")
                  : host_shell_fail_absent(shell, set);
}

int host_shell_ask_tell(struct host_shell *shell,
                        const struct host_node_set *set,
                        enum node_question what, const char *heading,
                        host_shell_tell *tell) {
    return host_shell_ask(shell, set, what, 0) != 0
               ? shell->error.code
               : host_shell_answers(shell, set, heading, tell);
}
