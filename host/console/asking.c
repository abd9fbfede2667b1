/* What commands that ask a set of nodes share. */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "host/base/text.h"
#include "transport/routes.h"
#include "host/base/error.h"

enum { BEGIN_US = 3000000 }; /* within which a cube is found */

int host_shell_set(struct host_shell *shell, const char *word,
                   struct host_node_set *set) {
    if (word == NULL) {
        host_node_set_all(set, shell->machine.nodes);
        return 0;
    }
    return host_node_set_parse(set, word, shell->machine.nodes, &shell->error);
}

static int host_shell_node(struct host_shell *shell, const char *word,
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
    const struct host_session_node *n = &shell->session.node[node];
    return n->answered && n->size >= size ? n->answer : NULL;
}

static int host_shell_look_ask(struct host_shell *shell,
                               const struct host_node_set *set,
                               enum node_question what);

int host_shell_ask(struct host_shell *shell, const struct host_node_set *set,
                   enum node_question what, unsigned target) {
    struct host_session *session = &shell->session;
    if (shell->looking)
        return host_shell_look_ask(shell, set, what);
    struct host_node_set there = {{0}};
    uint64_t age_us =
        shell->machine.now_us(shell->machine.context) - shell->opened_us;
    if (age_us < BEGIN_US &&
        host_session_wait(session, set, BEGIN_US - age_us, &shell->error) != 0)
        return shell->error.code;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        session->node[i].answered = false;
        if (host_node_set_has(set, i) && session->node[i].there)
            host_node_set_add(&there, i);
    }
    return host_node_set_count(&there) == 0
               ? 0
               : host_session_ask(session, &there, what, target,
                                  HOST_SHELL_ANSWER_US, &shell->error);
}

/* Why a node has not answered, and what to do next. */
static const char *reason_of(const struct host_shell *shell, unsigned node,
                             char text[HOST_SHELL_REASON]) {
    return shell->looking ? "no answer while another program has the cube; "
                            "look again in a moment"
                          : host_session_reason(&shell->session, node, text,
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
        if (host_node_set_has(set, i) && !shell->session.node[i].answered) {
            host_node_set_add(&absent, i);
            first = i;
        }
    }
    if (first == CUBE_HOST)
        return 0;
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
        if (!host_node_set_has(set, i))
            continue;
        json_t *object = json_pack("{si}", "node", (int)i);
        if (shell->session.node[i].answered)
            tell(shell, i, &fold, object);
        else
            tell_absent(shell, i, &fold, object);
        (void)json_array_append_new(list, object);
    }
    if (shell->object != NULL)
        (void)json_object_set(shell->object, "nodes", list);
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

/* ping and trace: how long the ways of the cube take. */

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
        if (host_shell_ask(shell, &one, NODE_WHO, 0) != 0)
            return shell->error.code;
        const struct host_session_node *n = &shell->session.node[node];
        p->sent++;
        if (!n->answered)
            return 0;
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
        (void)host_session_reason(&shell->session, node, row, sizeof row);
    }
    host_fold_add(fold, node, row);
    (void)json_array_append_new(list, object);
}

int host_shell_ping(struct host_shell *shell, unsigned count,
                    const char *const *words) {
    struct host_node_set set, all_came = {{0}};
    struct host_fold fold = {0};
    uint64_t times = PINGS;
    if (host_shell_set(shell, words[0], &set) != 0)
        return shell->error.code;
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
            if (p.answered == times)
                host_node_set_add(&all_came, i);
        }
    }
    for (unsigned i = 0; i < shell->machine.nodes; i++)
        shell->session.node[i].answered = host_node_set_has(&all_came, i);
    host_fold_print(&fold, "     LEAST      MEAN      MOST  ANSWERED", say_row,
                    shell);
    host_fold_free(&fold);
    if (shell->object != NULL)
        (void)json_object_set(shell->object, "nodes", list);
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
    if (host_shell_ask(shell, &one, NODE_PROBE, to) != 0)
        return shell->error.code;
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
        if (probe(shell, a, at, &rtt_us) != 0)
            return shell->error.code;
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
    unsigned a = 0, b = 0;
    (void)count;
    if (host_shell_node(shell, words[0], &a) != 0 ||
        host_shell_node(shell, words[1], &b) != 0)
        return shell->error.code;
    void *memory = malloc(routes_bytes(shell->machine.dimension));
    if (memory == NULL)
        return host_fail_memory(&shell->error, "the routes");
    routes_init(&routes, memory, shell->machine.dimension);
    routes_find(&routes, cube_wiring(shell->session.cube));
    json_t *list = json_array();
    host_shell_say(shell, "  0          node %u", a);
    int status = walk(shell, &routes, a, b, list);
    if (shell->object != NULL) {
        (void)json_object_set_new(shell->object, "tree",
                                  json_boolean(routes.tree));
        (void)json_object_set(shell->object, "hops", list);
    }
    if (routes.tree && a != b)
        host_shell_say(shell, "along the tree that goes round dead wires");
    json_decref(list);
    free(memory);
    return status;
}

/* A look at a cube that another program has, instead of one's own session. */

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
    memset(&shell->session, 0, sizeof shell->session);
    shell->machine = (struct host_machine){.nodes = look->nodes,
                                           .dimension = look->dimension,
                                           .serial_baud = look->serial_baud,
                                           .now_us = now_us};
    shell->session.machine = &shell->machine;
    shell->session.node = calloc(look->nodes, sizeof shell->session.node[0]);
    if (shell->session.node == NULL) {
        host_look_close(look);
        return host_fail_memory(&shell->error, "the nodes' answers");
    }
    shell->looking = true;
    return 0;
}

void host_shell_look_end(struct host_shell *shell) {
    free(shell->session.node);
    memset(&shell->session, 0, sizeof shell->session);
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
           (sink->interrupted == NULL || !sink->interrupted(sink->context)))
        host_shell_tend(shell, STEP_US);
    return held;
}

int host_shell_reach(struct host_shell *shell) {
    char wire[HOST_WIRE_NAME];
    struct host_holder holder;
    if (shell->open)
        return 0;
    bool held = shell->command->need == HOST_SHELL_LOOK
                    ? await_held(shell, wire, &holder)
                    : is_held(shell, wire, &holder);
    shell->in_use = held && !shell->running;
    if (held && shell->command->need == HOST_SHELL_LOOK)
        return begin_look(shell, wire);
    if (held || shell->running)
        return fail_held(shell, &holder);
    return host_shell_open(shell, &shell->error);
}

static int host_shell_look_ask(struct host_shell *shell,
                               const struct host_node_set *set,
                               enum node_question what) {
    const struct host_shell_sink *sink = shell->sink;
    if (host_look_ask(&shell->look, set, what, HOST_SHELL_ANSWER_US,
                      &shell->error) != 0)
        return shell->error.code;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        struct host_session_node *node = &shell->session.node[i];
        const struct host_look_node *seen = &shell->look.node[i];
        node->answered = node->there = seen->answered;
        node->answer = seen->answer;
        node->size = seen->size;
        if (what == NODE_WHO && seen->answered &&
            seen->size == sizeof node->who)
            memcpy(&node->who, seen->answer, sizeof node->who);
    }
    if (sink->interrupted != NULL && sink->interrupted(sink->context)) {
        shell->watch.cut = true;
        return host_fail(&shell->error, HOST_CUBE, "interrupted");
    }
    return 0;
}

/* Figures in few letters, and bars. */

static const char *scaled(double value, double unit, const char *names,
                          char text[HOST_SHELL_FIGURE]) {
    unsigned power = 0;
    while (value >= 999.5 && names[power + 1] != '\0') {
        value /= unit;
        power++;
    }
    int digits = power == 0 || value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
    snprintf(text, HOST_SHELL_FIGURE, "%.*f%.*s", digits, value, power > 0,
             names + power);
    return text;
}

const char *host_shell_bytes(uint64_t bytes, char text[HOST_SHELL_FIGURE]) {
    return scaled((double)bytes, 1024, " KMGTPE", text);
}

const char *host_shell_count(uint64_t count, char text[HOST_SHELL_FIGURE]) {
    return scaled((double)count, 1000, " kMGTPE", text);
}

const char *host_shell_time(uint64_t us, char text[HOST_SHELL_FIGURE]) {
    if (us < 1000) {
        snprintf(text, HOST_SHELL_FIGURE, "%u us", (unsigned)us);
    } else if (us < 1000000) {
        snprintf(text, HOST_SHELL_FIGURE, "%.*f ms",
                 us < 10000    ? 2
                 : us < 100000 ? 1
                               : 0,
                 1e-3 * (double)us);
    } else {
        snprintf(text, HOST_SHELL_FIGURE, "%.2f s", 1e-6 * (double)us);
    }
    return text;
}

const char *host_shell_bar(double part, unsigned cells,
                           char text[HOST_SHELL_BAR]) {
    cells = cells + 3 < HOST_SHELL_BAR ? cells : HOST_SHELL_BAR - 3;
    part = part < 0.0 ? 0.0 : part < 1.0 ? part : 1.0;
    unsigned full = (unsigned)(part * cells + 0.5);
    full = full == 0 && part > 0.0 ? 1 : full;
    text[0] = '[';
    memset(text + 1, ' ', cells);
    memset(text + 1, '#', full);
    text[cells + 1] = ']';
    text[cells + 2] = '\0';
    return text;
}
