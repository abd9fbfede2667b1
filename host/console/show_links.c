/* links: how each link of each node is, and what was lost on it. */
#include <inttypes.h>
#include <string.h>

#include "commands.h"

const char *host_shell_state(const struct node_link_state *link, char *text,
                             size_t size) {
    static const char *const states[] = {"down",   "opening", "up",   "silent",
                                         "closed", "closed",  "wrong"};
    static const char *const refusals[] = {"",           "another version",
                                           "wrong wire", "another cube",
                                           "no sizes",   "with another host"};
    bool refused = link->state == LINK_REFUSED &&
                   link->refusal < sizeof refusals / sizeof refusals[0];
    const char *state = link->state < sizeof states / sizeof states[0]
                            ? states[link->state]
                            : "?";
    if (link->dead) {
        snprintf(text, size, "dead");
    } else if (refused && link->refusal == LINK_WRONG_WIRE &&
               link->peer_node != CUBE_HOST) {
        snprintf(text, size, "wrong wire: node %u link %u", link->peer_node,
                 link->peer_port);
    } else if (refused && link->refusal == LINK_WRONG_WIRE) {
        snprintf(text, size, "wrong wire: the host");
    } else {
        snprintf(text, size, "%s", refused ? refusals[link->refusal] : state);
    }
    return text;
}

struct node_link_state host_shell_own_link(const struct host_shell *shell) {
    const struct cube *cube = shell->visit.cube;
    const struct link_statistics *s = cube_link_statistics(cube, 0);
    const struct link_peer *peer = cube_link_peer(cube, 0);
    uint64_t bad = s->bad_header + s->bad_crc + s->bad_code;
    return (struct node_link_state){
        .state = (uint8_t)cube_link_state(cube, 0),
        .refusal = (uint8_t)peer->refusal,
        .peer_port = peer->port,
        .dead = cube_link_is_dead(cube, 0),
        .peer_node = peer->node,
        .rtt_us = s->rtt_us,
        .frames_in = (uint32_t)s->frames_received,
        .frames_out = (uint32_t)s->frames_sent,
        .retransmitted = (uint32_t)s->retransmitted,
        .bad = (uint32_t)bad,
        .lost = (uint32_t)s->resynchronised,
        .bytes_in = s->bytes_received,
        .bytes_out = s->bytes_sent,
    };
}

void host_shell_note_lost(struct host_shell *shell, unsigned node) {
    const struct host_visit_node *n = &shell->visit.node[node];
    struct node_link_state link;
    for (unsigned d = 0; !shell->looking && d < CUBE_LINKS_MAX &&
                         (d + 1) * sizeof link <= n->size;
         d++) {
        struct host_shell_lost *before =
            &shell->lost[(size_t)node * CUBE_LINKS_MAX + d];
        memcpy(&link, n->answer + d * sizeof link, sizeof link);
        uint32_t lost = link.lost == UINT32_MAX ? 0 : link.lost;
        bool same = before->epoch == n->who.epoch && before->epoch != 0;
        if (same && lost != before->lost) {
            host_shell_note(shell,
                            "node %u link %u: %" PRIu32 " more bytes "
                            "lost: its driver had no room for them",
                            node, d, lost - before->lost);
        }
        if (same && link.bad != before->bad) {
            host_shell_note(shell,
                            "node %u link %u: %" PRIu32 " more damaged frames",
                            node, d, link.bad - before->bad);
        }
        *before = (struct host_shell_lost){n->who.epoch, link.bad, lost};
    }
}

static void tell_link(struct host_shell *shell, unsigned node, unsigned d,
                      const struct node_link_state *link,
                      struct host_fold *fold, json_t *list) {
    char text[160], state[48], rtt[HOST_SHELL_FIGURE], lost[HOST_SHELL_FIGURE];
    char in[HOST_SHELL_FIGURE], out[HOST_SHELL_FIGURE], to[8];
    bool known = link->lost != UINT32_MAX;
    (void)host_shell_state(link, state, sizeof state);
    snprintf(lost, sizeof lost, "%" PRIu32, link->lost);
    snprintf(to, sizeof to, "%u", d);
    if (node != CUBE_HOST && d == shell->machine.dimension) {
        snprintf(to, sizeof to, "host");
    }
    snprintf(text, sizeof text,
             "%-5s %-9s %9s %7s %7s %6" PRIu32 " %6" PRIu32 " %6s", to, state,
             link->rtt_us == 0 ? "-" : host_shell_time(link->rtt_us, rtt),
             host_shell_bytes(link->bytes_in, in),
             host_shell_bytes(link->bytes_out, out), link->retransmitted,
             link->bad, known ? lost : "-");
    host_fold_add(fold, node, text);
    json_t *object = json_pack(
        "{si ss sI sI sI sI sI sI sI}", "link", (int)d, "state", state,
        "rtt_us", (json_int_t)link->rtt_us, "frames_in",
        (json_int_t)link->frames_in, "frames_out", (json_int_t)link->frames_out,
        "retransmitted", (json_int_t)link->retransmitted, "bad",
        (json_int_t)link->bad, "bytes_in", (json_int_t)link->bytes_in,
        "bytes_out", (json_int_t)link->bytes_out);
    (void)json_object_set_new(object, "lost",
                              known ? json_integer(link->lost) : json_null());
    (void)json_array_append_new(list, object);
}

static void tell(struct host_shell *shell, unsigned node,
                 struct host_fold *fold, json_t *object) {
    const struct host_visit_node *n = &shell->visit.node[node];
    struct node_link_state link;
    json_t *list = json_array();
    for (unsigned d = 0; d < CUBE_LINKS_MAX && (d + 1) * sizeof link <= n->size;
         d++) {
        memcpy(&link, n->answer + d * sizeof link, sizeof link);
        tell_link(shell, node, d, &link, fold, list);
    }
    (void)json_object_set_new(object, "links", list);
    host_shell_note_lost(shell, node);
}

int host_shell_links(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct host_node_set set;
    struct host_fold own = {0};
    static const char heading[] =
        "LINK  STATE     ROUNDTRIP      IN     OUT  AGAIN    BAD   LOST";
    if (host_shell_set(shell, count == 0 ? NULL : words[0], &set) != 0) {
        return shell->error.code;
    }
    int status = host_shell_ask_tell(shell, &set, NODE_LINKS, heading, tell);
    if (shell->looking) {
        return status;
    }
    struct node_link_state link = host_shell_own_link(shell);
    json_t *list = json_array();
    tell_link(shell, CUBE_HOST, 0, &link, &own, list);
    if (own.count > 0) {
        host_shell_say(shell, "host   %s", own.row[0].text);
    }
    if (shell->object != NULL) {
        (void)json_object_set(shell->object, "host", json_array_get(list, 0));
    }
    json_decref(list);
    host_fold_free(&own);
    return status;
}
