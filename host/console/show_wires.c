/* wires: the cube as its nodes see it, and what is wrong with it. */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "drawing.h"

static enum host_wire_state state_of(const struct node_link_state *link) {
    return link->dead                    ? HOST_WIRE_DEAD
           : link->state == LINK_REFUSED ? HOST_WIRE_WRONG
           : link->state == LINK_UP || link->state == LINK_SILENT
               ? HOST_WIRE_UP
               : HOST_WIRE_DOWN;
}

static void add_end(struct host_drawing *drawing, unsigned node, unsigned d,
                    const struct node_link_state *link) {
    unsigned lower = d < drawing->dimension ? node & ~(1u << d) : node;
    uint8_t *wire = &drawing->wire[lower][d];
    enum host_wire_state state = state_of(link);
    if (*wire == HOST_WIRE_UNKNOWN || state > *wire) {
        *wire = (uint8_t)state;
    }
}

static void gather(struct host_shell *shell, struct host_drawing *drawing) {
    struct node_link_state link = host_shell_own_link(shell);
    drawing->dimension = shell->machine.dimension;
    memset(drawing->wire, HOST_WIRE_UNKNOWN, sizeof drawing->wire);
    add_end(drawing, 0, drawing->dimension, &link);
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        const struct host_visit_node *n = &shell->visit.node[i];
        drawing->absent[i] = !n->answered;
        for (unsigned d = 0; n->answered && d < drawing->dimension &&
                             (d + 1) * sizeof link <= n->size;
             d++) {
            memcpy(&link, n->answer + d * sizeof link, sizeof link);
            add_end(drawing, i, d, &link);
        }
        if (n->answered) {
            host_shell_note_lost(shell, i);
        }
    }
}

static void say_line(void *context, const char *text) {
    host_shell_say(context, "%s", text);
}

/* Beyond what a person can see: a row a node, equal ones folded. */
static void tell_matrix(struct host_shell *shell,
                        const struct host_drawing *drawing) {
    struct host_fold fold = {0};
    char text[CUBE_LINKS_MAX + 1], heading[] = "0123456789";
    heading[drawing->dimension] = '\0';
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        host_drawing_row(drawing, i, text);
        host_fold_add(&fold, i, text);
    }
    host_fold_print(&fold, heading, say_line, shell);
    host_fold_free(&fold);
}

static void tell_drawing(struct host_shell *shell,
                         const struct host_drawing *drawing) {
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    if (out == NULL) {
        return;
    }
    host_drawing_draw(drawing, out);
    if (fclose(out) == 0) {
        for (char *p = text, *end; *p != '\0'; p = end + 1) {
            end = strchr(p, '\n');
            host_shell_say(shell, "%.*s", (int)(end - p), p);
        }
    }
    free(text);
}

/* "wrong wire: node 3 link 1" of an end of the wire that says so, or NULL. */
static const char *said_by_end(const struct host_shell *shell, unsigned node,
                               unsigned d, char *text, size_t size) {
    const struct host_visit_node *n = &shell->visit.node[node];
    struct node_link_state link;
    if (d == shell->machine.dimension) {
        link = host_shell_own_link(shell);
        return host_shell_state(&link, text, size);
    }
    if (!n->answered || (d + 1) * sizeof link > n->size) {
        return NULL;
    }
    memcpy(&link, n->answer + d * sizeof link, sizeof link);
    return state_of(&link) == HOST_WIRE_UP
               ? NULL
               : host_shell_state(&link, text, size);
}

/* Each wire that is not up; their number. */
static unsigned tell_faults(struct host_shell *shell,
                            const struct host_drawing *drawing, json_t *list) {
    unsigned faults = 0;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        for (unsigned d = 0; d <= drawing->dimension; d++) {
            char to[16] = "the host", text[64], own[64];
            bool host = d == drawing->dimension;
            unsigned peer = host ? 0 : i ^ 1u << d;
            const char *why = said_by_end(shell, i, d, own, sizeof own);
            if ((host ? i != 0 : peer < i) ||
                drawing->wire[i][d] == HOST_WIRE_UP) {
                continue;
            }
            if (why == NULL && !host) {
                why = said_by_end(shell, peer, d, own, sizeof own);
            }
            if (!host) {
                snprintf(to, sizeof to, "node %u", peer);
            }
            snprintf(text, sizeof text, "%s",
                     why == NULL ? "neither end answers" : why);
            host_shell_say(shell, "node %u link %u to %s: %s", i, d, to, text);
            (void)json_array_append_new(list, json_pack("{si si ss}", "node",
                                                        (int)i, "link", (int)d,
                                                        "state", text));
            faults++;
        }
    }
    return faults;
}

static int tell(struct host_shell *shell, const struct host_drawing *drawing) {
    json_t *list = json_array();
    char wrong[CUBE_FAULT_BYTES];
    if (drawing->dimension <= HOST_DRAWING_MAX) {
        tell_drawing(shell, drawing);
    } else {
        tell_matrix(shell, drawing);
    }
    unsigned faults = tell_faults(shell, drawing, list);
    bool crossed = cube_wiring_fault(shell->visit.cube, wrong);
    if (crossed) {
        host_shell_say(shell, "%s", wrong);
    }
    if (faults > 0) {
        host_shell_say(shell, "x dead  ! down  ? wrong  . nobody tells  (n) "
                              "does not answer");
    }
    if (shell->object != NULL) {
        (void)json_object_set_new(shell->object, "dimension",
                                  json_integer(drawing->dimension));
        (void)json_object_set(shell->object, "not_up", list);
    }
    json_decref(list);
    return faults == 0 ? 0
                       : host_fail(&shell->error, HOST_CUBE,
                                   "wires: %u %s not up; look at their plugs, "
                                   "and whether the nodes at both ends are on",
                                   faults, faults == 1 ? "is" : "are");
}

int host_shell_wires(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct host_node_set all;
    (void)count, (void)words;
    host_node_set_all(&all, shell->machine.nodes);
    if (host_shell_ask(shell, &all, NODE_LINKS, 0) != 0) {
        return shell->error.code;
    }
    struct host_drawing *drawing = calloc(1, sizeof *drawing);
    if (drawing == NULL) {
        return host_fail_memory(&shell->error, "the drawing");
    }
    gather(shell, drawing);
    int status = tell(shell, drawing);
    free(drawing);
    return status;
}
