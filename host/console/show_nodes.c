/* nodes: who is there, what is missing, and what to do next. */
#include <inttypes.h>
#include <limits.h>
#include <string.h>

#include "commands.h"
#include "host/base/text.h"
#include "host/nodes/emulator.h"
#include "node/roles/roles.h"

enum { WIRES_US = 10000000 }; /* for those of nodes that have just begun */

/* A field of fixed length, as a text that a terminal can be given. */
static const char *field(const uint8_t *bytes, size_t size, char *text) {
    size_t i = 0;
    for (; i < size && bytes[i] != 0; i++) {
        text[i] = (char)(bytes[i] >= ' ' && bytes[i] <= '~' ? bytes[i] : '?');
    }
    text[i] = '\0';
    return text;
}

static bool is_zero(const uint8_t *bytes, size_t size) {
    bool zero = true;
    for (size_t i = 0; i < size; i++) {
        zero = zero && bytes[i] == 0;
    }
    return zero;
}

static const char *hex(const uint8_t *bytes, size_t size, char *text) {
    for (size_t i = 0; i < size; i++) {
        snprintf(text + 2 * i, 3, "%02x", bytes[i]);
    }
    return text;
}

static void tell_who(struct host_shell *shell, unsigned node,
                     struct host_fold *fold, json_t *object) {
    static const char *const kinds[] = {"?", "process", "program", "loader"};
    const struct node_who *w = &shell->visit.node[node].who;
    const struct node_role *role = node_role_named(w->role);
    char board[NODE_BOARD_BYTES + 1], version[NODE_VERSION_BYTES + 1];
    char loader[NODE_VERSION_BYTES + 1];
    char digest[2 * NODE_DIGEST_BYTES + 1], serial[2 * NODE_SERIAL_BYTES + 1];
    char row[200], memory[HOST_SHELL_FIGURE], boot[12], wires[16];
    const char *kind = kinds[w->kind <= NODE_KIND_LOADER ? w->kind : 0];
    (void)field(w->board, sizeof w->board, board);
    (void)field(w->version, sizeof w->version, version);
    (void)field(w->loader, sizeof w->loader, loader);
    (void)hex(w->digest, sizeof w->digest, digest);
    (void)hex(w->serial, sizeof w->serial, serial);
    if (w->protocol != NODE_PROTOCOL) {
        snprintf(row, sizeof row,
                 "of another version: it speaks protocol %" PRIu32
                 ", this host %d; bring the same to both",
                 w->protocol, NODE_PROTOCOL);
        host_fold_add(fold, node, row);
        (void)json_object_set_new(object, "error", json_string(row));
        return;
    }
    bool looking = shell->looking; /* then links tells of wires */
    unsigned links = looking ? 0 : host_visit_links(&shell->visit, node);
    unsigned links_up = looking ? 0 : host_visit_links_up(&shell->visit, node);
    snprintf(boot, sizeof boot, "%" PRIu32, w->boot);
    snprintf(wires, sizeof wires, "%u of %u", links_up, links);
    if (links_up == links) {
        snprintf(wires, sizeof wires, looking ? "-" : "all");
    }
    snprintf(row, sizeof row, "%-12s %-8s %-10s %-8.8s %5s %c %7s  %-8s %s",
             board, kind, version,
             is_zero(w->digest, sizeof w->digest) ? "-" : digest,
             w->boot == 0 ? "-" : boot, HOST_FOLD_TIME,
             host_shell_bytes(w->memory, memory), wires,
             role == NULL ? "-" : role->name);
    host_fold_add_timed(fold, node, row, w->uptime_s);
    json_t *fields = json_pack(
        "{ss ss ss ss ss ss sI sI sI sI sI si si ss?}", "board", board, "kind",
        kind, "version", version, "loader", loader, "digest", digest, "serial",
        serial, "number", (json_int_t)w->number, "boot", (json_int_t)w->boot,
        "epoch", (json_int_t)w->epoch, "uptime_s", (json_int_t)w->uptime_s,
        "memory_bytes", (json_int_t)w->memory, "links", (int)links, "links_up",
        (int)links_up, "role", role == NULL ? NULL : role->name);
    (void)json_object_update(object, fields);
    json_decref(fields);
}

/* --- what is wrong between them ------------------------------------------- */

struct faults {
    struct host_shell *shell;
    json_t *list;
};

static void tell_fault(void *context, unsigned node, unsigned link,
                       const char *text) {
    struct faults *faults = context;
    host_shell_say(faults->shell, "%s", text);
    (void)json_array_append_new(faults->list,
                                json_pack("{si si ss}", "node", (int)node,
                                          "link", (int)link, "error", text));
}

static unsigned tell_faults(struct host_shell *shell) {
    struct faults faults = {shell, json_array()};
    unsigned count = host_visit_faults(&shell->visit, tell_fault, &faults);
    if (shell->object != NULL) {
        (void)json_object_set(shell->object, "wires", faults.list);
    }
    json_decref(faults.list);
    return count;
}

/* The image that these boards would be given, where they are of one kind and it
 * was built; what to put there, else. */
static const char *name_image(const struct host_shell *shell,
                              const struct host_node_set *set,
                              char path[PATH_MAX]) {
    char board[NODE_BOARD_BYTES + 1] = "", quoted[PATH_MAX];
    bool alike = true;
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        const struct node_who *w = &shell->visit.node[i].who;
        if (host_node_set_has(set, i)) {
            alike = alike &&
                    (board[0] == '\0' || strncmp(board, (const char *)w->board,
                                                 NODE_BOARD_BYTES) == 0);
            memcpy(board, w->board, NODE_BOARD_BYTES);
        }
    }
    if (!alike || !host_firmware_find(board, path) ||
        host_text_quote(quoted, sizeof quoted, path) != 0) {
        return "IMAGE";
    }
    return strcpy(path, quoted);
}

/* Nodes that are there, and would not run as they are. */
static void tell_next(struct host_shell *shell) {
    struct host_node_set loaders = {{0}}, worn = {{0}}, programs = {{0}};
    const struct node_who *first = NULL;
    bool mixed = false, process = false;
    const char *where = host_where(&shell->machine);
    char names[72], image[PATH_MAX];
    for (unsigned i = 0; i < shell->machine.nodes; i++) {
        const struct node_who *w = &shell->visit.node[i].who;
        if (!shell->visit.node[i].there || w->protocol != NODE_PROTOCOL) {
            continue;
        }
        if (w->kind == NODE_KIND_LOADER) {
            host_node_set_add(w->boot == 0 ? &worn : &loaders, i);
            continue;
        }
        process = process || w->kind == NODE_KIND_PROCESS;
        host_node_set_add(&programs, i);
        first = first == NULL ? w : first;
        mixed =
            mixed || memcmp(first->version, w->version, sizeof w->version) != 0;
    }
    if (host_node_set_count(&loaders) > 0) {
        host_node_set_name(&loaders, names, sizeof names);
        host_shell_say(shell,
                       "%s: in the boot loader, with no program running; "
                       "bring one with: incode flash %s %s",
                       names, where, name_image(shell, &loaders, image));
    }
    if (host_node_set_count(&worn) > 0) {
        host_node_set_name(&worn, names, sizeof names);
        host_shell_say(shell,
                       "%s: in the boot loader, as the flash takes no record "
                       "of a start; why: incode console %s -c 'log %s'",
                       names, where, strchr(names, ' ') + 1);
    }
    if (mixed && process) {
        host_shell_say(shell,
                       "the nodes run different versions; bring the same to "
                       "all with: incode deploy %s",
                       where);
    } else if (mixed) {
        host_shell_say(shell,
                       "the nodes run different versions; bring the same to "
                       "all with: incode flash %s %s",
                       where, name_image(shell, &programs, image));
    }
}

int host_shell_nodes(struct host_shell *shell, unsigned count,
                     const char *const *words) {
    struct host_node_set set;
    if (host_shell_set(shell, count == 0 ? NULL : words[0], &set) != 0) {
        return shell->error.code;
    }
    if (!shell->looking && (host_shell_ask(shell, &set, NODE_WHO, 0) != 0 ||
                            host_visit_settle_wires(&shell->visit, WIRES_US,
                                                    &shell->error) != 0)) {
        return shell->error.code;
    }
    int status = host_shell_ask_tell(
        shell, &set, NODE_WHO,
        "BOARD        RUNS     VERSION    IMAGE     BOOT        UP  MEMORY  "
        "LINKS    ROLE",
        tell_who);
    if (count > 0 || shell->looking) {
        return status;
    }
    unsigned faults = tell_faults(shell);
    tell_next(shell);
    return status != 0 || faults == 0
               ? status
               : host_fail(&shell->error, HOST_CUBE,
                           "nodes: all are there, and %u wire%s not as %s "
                           "should be; put right what is named above",
                           faults, faults == 1 ? " is" : "s are",
                           faults == 1 ? "it" : "they");
}
