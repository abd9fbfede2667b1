/* ping and trace: how long the ways of the cube take. */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "host/base/parse.h"
#include "transport/routes.h"

enum { PINGS = 5, PINGS_MAX = 1000000 };

/* --- ping ----------------------------------------------------------------- */

struct pings {
    unsigned sent, answered;
    uint32_t least, most;
    uint64_t sum;
};

/* A node after the other, so that no answer waits for another's. */
static int ping_node(struct host_shell *shell, unsigned node, unsigned times,
                     struct pings *p) {
    struct host_node_set one = {{0}};
    host_node_set_add(&one, node);
    for (unsigned i = 0; i < times; i++) {
        if (host_shell_ask(shell, &one, NODE_WHO, 0) != 0) {
            return shell->error.code;
        }
        const struct host_visit_node *n = &shell->visit.node[node];
        p->sent++;
        if (!n->answered) {
            return 0;
        }
        p->least =
            p->answered == 0 || n->rtt_us < p->least ? n->rtt_us : p->least;
        p->most = n->rtt_us > p->most ? n->rtt_us : p->most;
        p->sum += n->rtt_us;
        p->answered++;
    }
    return 0;
}

static void say_row(void *context, const char *text) {
    host_shell_say(context, "%s", text);
}

static void tell_pings(struct host_shell *shell, unsigned node,
                       const struct pings *p, struct host_fold *fold,
                       json_t *list) {
    char row[HOST_SHELL_REASON], least[HOST_SHELL_FIGURE],
        mean[HOST_SHELL_FIGURE], most[HOST_SHELL_FIGURE];
    json_t *object = json_pack("{si si si}", "node", (int)node, "sent",
                               (int)p->sent, "answered", (int)p->answered);
    if (p->answered > 0) {
        uint64_t average = p->sum / p->answered;
        snprintf(row, sizeof row, "%9s %9s %9s  %u of %u",
                 host_shell_time(p->least, least),
                 host_shell_time(average, mean), host_shell_time(p->most, most),
                 p->answered, p->sent);
        json_t *times =
            json_pack("{sI sI sI}", "min_us", (json_int_t)p->least, "avg_us",
                      (json_int_t)average, "max_us", (json_int_t)p->most);
        (void)json_object_update(object, times);
        json_decref(times);
    } else {
        (void)host_visit_reason(&shell->visit, node, row, sizeof row);
    }
    host_fold_add(fold, node, row);
    (void)json_array_append_new(list, object);
}

int host_shell_ping(struct host_shell *shell, unsigned count,
                    const char *const *words) {
    struct host_node_set set, all_came = {{0}};
    struct host_fold fold = {0};
    uint64_t times = PINGS;
    if (host_shell_set(shell, words[0], &set) != 0) {
        return shell->error.code;
    }
    if (count == 2 && host_parse_number(words[1], 1, PINGS_MAX, &times) != 0) {
        return host_fail(&shell->error, HOST_USAGE,
                         "ping %s: not a number of times; give 1 to %d",
                         words[1], PINGS_MAX);
    }
    json_t *list = json_array();
    int status = 0;
    for (unsigned i = 0; i < shell->machine.nodes && status == 0; i++) {
        struct pings p = {0};
        if (host_node_set_has(&set, i)) {
            status = ping_node(shell, i, (unsigned)times, &p);
            tell_pings(shell, i, &p, &fold, list);
            if (p.answered == times) {
                host_node_set_add(&all_came, i);
            }
        }
    }
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        shell->visit.node[i].answered = host_node_set_has(&all_came, i);
    }
    host_fold_print(&fold, "     LEAST      MEAN      MOST  ANSWERED", say_row,
                    shell);
    host_fold_free(&fold);
    if (shell->object != NULL) {
        (void)json_object_set(shell->object, "nodes", list);
    }
    json_decref(list);
    return status == 0 ? host_shell_fail_absent(shell, &set) : status;
}

/* --- trace ---------------------------------------------------------------- */

/* Asks `from` how long the way to `to` takes; UINT32_MAX: no answer. */
static int probe(struct host_shell *shell, unsigned from, unsigned to,
                 uint32_t *rtt_us) {
    struct host_node_set one = {{0}};
    struct node_probe answer;
    host_node_set_add(&one, from);
    *rtt_us = UINT32_MAX;
    if (host_shell_ask(shell, &one, NODE_PROBE, to) != 0) {
        return shell->error.code;
    }
    const void *bytes = host_shell_answer(shell, from, sizeof answer);
    if (bytes != NULL) {
        memcpy(&answer, bytes, sizeof answer);
        *rtt_us = answer.rtt_us;
    }
    return 0;
}

static void tell_hop(struct host_shell *shell, unsigned hop, unsigned node,
                     unsigned link, uint32_t rtt_us, uint32_t before,
                     json_t *list) {
    char all[HOST_SHELL_FIGURE], more[HOST_SHELL_FIGURE];
    if (rtt_us == UINT32_MAX) {
        host_shell_say(shell, "%3u  link %u  node %-4u  no answer", hop, link,
                       node);
    } else {
        bool later = rtt_us >= before;
        host_shell_say(
            shell, "%3u  link %u  node %-4u %9s  %s%s", hop, link, node,
            host_shell_time(rtt_us, all), later ? "+" : "-",
            host_shell_time(later ? rtt_us - before : before - rtt_us, more));
    }
    json_t *object = json_pack("{si si si}", "hop", (int)hop, "link", (int)link,
                               "node", (int)node);
    (void)json_object_set_new(object, "rtt_us",
                              rtt_us == UINT32_MAX ? json_null()
                                                   : json_integer(rtt_us));
    (void)json_array_append_new(list, object);
}

/* Hop by hop, each timed from A to there and back. */
static int walk(struct host_shell *shell, const struct routes *routes,
                unsigned a, unsigned b, json_t *list) {
    uint32_t before = 0, rtt_us = 0;
    unsigned at = a, hops = 0;
    while (at != b && hops < 2 * shell->machine.dimension + 2) {
        unsigned link = routes_way(routes, at, b);
        if (link >= shell->machine.dimension) {
            return host_fail(&shell->error, HOST_CUBE,
                             "trace %u %u: no way beyond node %u; look at the "
                             "wires of it and of node %u",
                             a, b, at, b);
        }
        at ^= 1u << link;
        if (probe(shell, a, at, &rtt_us) != 0) {
            return shell->error.code;
        }
        tell_hop(shell, ++hops, at, link, rtt_us, before, list);
        before = rtt_us == UINT32_MAX ? before : rtt_us;
    }
    return rtt_us != UINT32_MAX
               ? 0
               : host_fail(&shell->error, HOST_CUBE,
                           "trace %u %u: no answer from there; look whether it "
                           "runs: log %u",
                           a, b, b);
}

int host_shell_trace(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct routes routes;
    unsigned a, b;
    (void)count;
    if (host_shell_node(shell, words[0], &a) != 0 ||
        host_shell_node(shell, words[1], &b) != 0) {
        return shell->error.code;
    }
    void *memory = malloc(routes_bytes(shell->machine.dimension));
    if (memory == NULL) {
        return host_fail_memory(&shell->error, "the routes");
    }
    routes_init(&routes, memory, shell->machine.dimension);
    routes_find(&routes, cube_wiring(shell->visit.cube));
    json_t *list = json_array();
    host_shell_say(shell, "  0          node %u", a);
    int status = walk(shell, &routes, a, b, list);
    if (shell->object != NULL) {
        (void)json_object_set_new(shell->object, "tree",
                                  json_boolean(routes.tree));
        (void)json_object_set(shell->object, "hops", list);
    }
    if (routes.tree && a != b) {
        host_shell_say(shell, "along the tree that goes round dead wires");
    }
    json_decref(list);
    free(memory);
    return status;
}
