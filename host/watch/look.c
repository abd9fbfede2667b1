#include "look.h"

#include <errno.h>
#include <jansson.h>
#include <poll.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <unistd.h>

#include "host/base/clock.h"
#include "host/base/text.h"
#include "names.h"

enum {
    GREETING_US = 3000000,
    LINE_FIRST = 4096,
    ANSWER_MAX = 4 << 20 /* of 1,024 nodes, each with the longest answer */
};

static int fail_silent(const struct host_look *look, const char *what,
                       struct host_error *error) {
    char text[HOST_HOLDER_TEXT];
    return host_fail(error, HOST_CUBE,
                     "%s: %s; look again in a moment, and if it says nothing "
                     "then either, end it with: kill %ld",
                     host_holder_text(&look->holder, text, sizeof text), what,
                     (long)look->holder.pid);
}

/* --- lines ---------------------------------------------------------------- */

static bool make_room(struct host_look *l) {
    size_t room = l->room == 0 ? LINE_FIRST : 2 * l->room;
    char *line = room > ANSWER_MAX ? NULL : realloc(l->line, room);
    if (line == NULL) {
        return false;
    }
    l->line = line;
    l->room = room;
    return true;
}

/* Reads until the line is whole: 0, or HOST_CUBE. */
static int read_line(struct host_look *l, uint64_t wait_us,
                     struct host_error *error) {
    uint64_t begun_us = host_now_us(), passed_us = 0;
    l->used = 0;
    for (;; passed_us = host_now_us() - begun_us) {
        struct pollfd wait = {l->file, POLLIN, 0};
        if (passed_us >= wait_us) {
            return fail_silent(l, "has the cube, and does not answer", error);
        }
        if (poll(&wait, 1, (int)((wait_us - passed_us + 999) / 1000)) <= 0) {
            continue;
        }
        if (l->used == l->room && !make_room(l)) {
            return host_fail_memory(error, "an answer");
        }
        ssize_t n =
            recv(l->file, l->line + l->used, l->room - l->used, MSG_DONTWAIT);
        if (n < 0 && (errno == EAGAIN || errno == EINTR)) {
            continue;
        }
        if (n <= 0) {
            return host_fail(error, HOST_CUBE,
                             "who had the cube has ended; try again");
        }
        l->used += (size_t)n;
        if (l->line[l->used - 1] == '\n') {
            l->line[l->used - 1] = '\0';
            return 0;
        }
    }
}

/* A line's object, or NULL; *error is told. */
static json_t *read_object(struct host_look *l, uint64_t wait_us,
                           struct host_error *error) {
    char why[160], text[HOST_HOLDER_TEXT];
    if (read_line(l, wait_us, error) != 0) {
        return NULL;
    }
    json_t *object = json_loads(l->line, 0, NULL);
    const char *said = json_string_value(json_object_get(object, "error"));
    if (object == NULL) {
        (void)fail_silent(l, "has the cube, and says what is no answer", error);
    } else if (said != NULL) {
        host_text_printable(why, sizeof why, said);
        (void)host_fail(error, HOST_CUBE, "%s has the cube: %s",
                        host_holder_text(&l->holder, text, sizeof text), why);
        json_decref(object);
        object = NULL;
    }
    return object;
}

static uint64_t number(const json_t *object, const char *key) {
    json_int_t value = json_integer_value(json_object_get(object, key));
    return value > 0 ? (uint64_t)value : 0;
}

/* --- opening -------------------------------------------------------------- */

static int take_greeting(struct host_look *l, struct host_error *error) {
    json_t *object = read_object(l, GREETING_US, error);
    if (object == NULL) {
        return error->code;
    }
    uint64_t protocol = number(object, "protocol");
    uint64_t nodes = number(object, "nodes");
    l->dimension = (unsigned)number(object, "dimension");
    l->serial_baud = (uint32_t)number(object, "serial_baud");
    json_decref(object);
    if (protocol != NODE_PROTOCOL || nodes == 0 || nodes > CUBE_NODES_MAX ||
        l->dimension > CUBE_DIMENSION_MAX || nodes != 1u << l->dimension) {
        return fail_silent(l, "has the cube, and is of another version", error);
    }
    l->nodes = (unsigned)nodes;
    l->node = calloc(nodes, sizeof *l->node);
    l->answers = malloc(nodes * CUBE_PAYLOAD_MAX);
    if (l->node == NULL || l->answers == NULL) {
        return host_fail_memory(error, "the nodes' answers");
    }
    for (size_t i = 0; i < nodes; i++) {
        l->node[i].answer = l->answers + i * CUBE_PAYLOAD_MAX;
    }
    return 0;
}

int host_look_open(struct host_look *look, const char *wire,
                   struct host_error *error) {
    struct sockaddr_un address;
    socklen_t size = host_holder_address(wire, &address);
    char text[HOST_HOLDER_TEXT];
    memset(look, 0, sizeof *look);
    look->file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (look->file < 0) {
        return host_fail(error, HOST_BROKEN, "a socket: %s; close some files",
                         strerror(errno));
    }
    /* One that stands still would let nobody wait for a place in its queue. */
    struct timeval most = {GREETING_US / 1000000, 0};
    (void)setsockopt(look->file, SOL_SOCKET, SO_SNDTIMEO, &most, sizeof most);
    if (connect(look->file, (struct sockaddr *)&address, size) != 0 ||
        !host_holder_of(&look->holder, look->file)) {
        return host_fail(error, HOST_CUBE,
                         "%s: no program of this machine has it; is the cube "
                         "with a host elsewhere?",
                         wire);
    }
    /* Another user's program could invent what it says of the cube. */
    if (!host_holder_believed(&look->holder, wire)) {
        return host_fail(error, HOST_CUBE, "%s %s",
                         host_holder_text(&look->holder, text, sizeof text),
                         geteuid() != 0
                             ? "has the cube; ask them"
                             : "says that it has the cube, and does not have "
                               "its wire open; ask them, or end it");
    }
    return take_greeting(look, error);
}

/* --- asking --------------------------------------------------------------- */

static void take_answer(struct host_look *l, const char *key, const char *hex) {
    char *end;
    unsigned long node = strtoul(key, &end, 10);
    size_t size;
    if (*key == '\0' || *end != '\0' || node >= l->nodes || hex == NULL ||
        sodium_hex2bin(l->node[node].answer, CUBE_PAYLOAD_MAX, hex, strlen(hex),
                       NULL, &size, NULL) != 0) {
        return;
    }
    l->node[node].size = size;
    l->node[node].answered = true;
}

static int send_question(const struct host_look *l,
                         const struct host_node_set *set,
                         enum node_question what, struct host_error *error) {
    char nodes[HOST_LOOK_QUESTION_BYTES - 64], line[HOST_LOOK_QUESTION_BYTES];
    host_node_set_print(set, nodes, sizeof nodes);
    int size =
        snprintf(line, sizeof line, "{\"ask\":\"%s\",\"nodes\":\"%s\"}\n",
                 host_look_name(what), nodes);
    return send(l->file, line, (size_t)size, MSG_NOSIGNAL) == size
               ? 0
               : host_fail(error, HOST_CUBE,
                           "who had the cube has ended; try again");
}

int host_look_ask(struct host_look *look, const struct host_node_set *set,
                  enum node_question what, uint64_t wait_us,
                  struct host_error *error) {
    struct host_look *l = look;
    const char *key;
    json_t *value;
    for (unsigned i = 0; i < l->nodes; i++) {
        l->node[i].answered = false;
    }
    if (host_look_name(what) == NULL) {
        return host_fail(error, HOST_CUBE,
                         "that is not for those who look on; wait until the "
                         "cube is free");
    }
    if (send_question(l, set, what, error) != 0) {
        return error->code;
    }
    json_t *object = read_object(l, wait_us, error);
    if (object == NULL) {
        return error->code;
    }
    l->committed = number(object, "committed");
    l->bricks = number(object, "bricks");
    l->tetrahedra = number(object, "tetrahedra");
    json_object_foreach(json_object_get(object, "answers"), key, value) {
        take_answer(l, key, json_string_value(value));
    }
    json_decref(object);
    return 0;
}

void host_look_close(struct host_look *look) {
    if (look->file >= 0) {
        close(look->file);
    }
    free(look->line);
    free(look->node);
    free(look->answers);
    memset(look, 0, sizeof *look);
    look->file = -1;
}
