#include "offer.h"

#include <errno.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "node/version.h"

enum {
    TRY_US = 1000000,   /* between two tries for a place that another has */
    STALL_US = 5000000, /* of one who does not read */
    /* Who only finds out who has the cube calls too, and hangs up: their calls
     * are not to keep those out who look. */
    QUEUE_MAX = 64,
    CALLS_A_LOOK = 16
};

/* --- the place ------------------------------------------------------------ */

/* Who had the wire before may have the place still. */
static void take_place(struct host_offer *o, uint64_t now_us) {
    struct sockaddr_un address;
    socklen_t size = host_holder_address(o->wire, &address);
    o->tried_us = now_us;
    o->listener =
        socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (o->listener >= 0 &&
        (bind(o->listener, (struct sockaddr *)&address, size) != 0 ||
         listen(o->listener, QUEUE_MAX) != 0)) {
        close(o->listener);
        o->listener = -1;
    }
}

static void drop(struct host_offer *o, unsigned i) {
    struct host_looker *looker = &o->looker[i];
    close(looker->file);
    free(looker->out);
    memset(looker, 0, sizeof *looker);
    looker->file = -1;
    if (o->asked == (int)i)
        o->asked = -1; /* the answers come, and are nobody's */
}

/* --- what they are told --------------------------------------------------- */

/* A line of its own, whose text is freed with it.  NULL: no memory. */
static char *line_of(json_t *object) {
    char *text = json_dumps(object, JSON_COMPACT);
    size_t size = text == NULL ? 0 : strlen(text);
    char *line = text == NULL ? NULL : realloc(text, size + 2);
    json_decref(object);
    if (line == NULL) {
        free(text);
        return NULL;
    }
    memcpy(line + size, "\n", 2);
    return line;
}

/* Goes on as far as the looker reads. */
static void flush(struct host_offer *o, unsigned i, uint64_t now_us) {
    struct host_looker *looker = &o->looker[i];
    while (looker->out != NULL && looker->out_at < looker->out_size) {
        ssize_t n = send(looker->file, looker->out + looker->out_at,
                         looker->out_size - looker->out_at,
                         MSG_NOSIGNAL | MSG_DONTWAIT);
        if (n <= 0) {
            bool waits = n < 0 && (errno == EAGAIN || errno == EINTR);
            if (!waits || now_us - looker->moved_us > STALL_US)
                drop(o, i);
            return;
        }
        looker->out_at += (size_t)n;
        looker->moved_us = now_us;
    }
    free(looker->out);
    looker->out = NULL;
}

static void tell(struct host_offer *o, unsigned i, json_t *object,
                 uint64_t now_us) {
    struct host_looker *looker = &o->looker[i];
    looker->out = object == NULL ? NULL : line_of(object);
    if (looker->out == NULL) {
        drop(o, i);
        return;
    }
    looker->out_size = strlen(looker->out);
    looker->out_at = 0;
    looker->moved_us = now_us;
    flush(o, i, now_us);
}

static json_t *greeting(const struct host_offer *o) {
    return json_pack("{ss si si si sI}", "incode", NODE_VERSION, "protocol",
                     NODE_PROTOCOL, "nodes", (int)o->nodes, "dimension",
                     (int)o->dimension, "serial_baud",
                     (json_int_t)o->serial_baud);
}

static json_t *refusal(const char *why) {
    return json_pack("{ss}", "error", why);
}

/* --- who comes ------------------------------------------------------------ */

static void turn_away(int file, const char *why) {
    char *line = line_of(refusal(why));
    if (line != NULL)
        (void)!send(file, line, strlen(line), MSG_NOSIGNAL | MSG_DONTWAIT);
    free(line);
    close(file);
}

/* False: nobody else calls. */
static bool welcome(struct host_offer *o, uint64_t now_us) {
    int file = accept4(o->listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    struct ucred peer;
    socklen_t size = sizeof peer;
    if (file < 0)
        return false;
    if (getsockopt(file, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0 ||
        (peer.uid != geteuid() && peer.uid != 0)) {
        turn_away(file, "it is another user's; ask them");
        return true;
    }
    for (unsigned i = 0; i < HOST_LOOKERS_MAX; i++) {
        if (o->looker[i].file < 0) {
            o->looker[i].file = file;
            tell(o, i, greeting(o), now_us);
            return true;
        }
    }
    turn_away(file, "four programs look on already; end one of them");
    return true;
}

/* --- what they ask -------------------------------------------------------- */

/* 0, or -1: it is no question. */
static int read_question(const struct host_offer *o, const char *line,
                         struct host_watchers_question *question) {
    json_t *object = json_loads(line, 0, NULL);
    const char *ask = json_string_value(json_object_get(object, "ask"));
    const char *nodes = json_string_value(json_object_get(object, "nodes"));
    struct host_error error = {0};
    question->what = host_look_question(ask);
    int status = question->what == 0 ||
                         host_node_set_parse(&question->nodes,
                                             nodes == NULL ? "all" : nodes,
                                             o->nodes, &error) != 0
                     ? -1
                     : 0;
    json_decref(object);
    return status;
}

static void hear(struct host_offer *o, unsigned i, uint64_t now_us) {
    struct host_looker *looker = &o->looker[i];
    ssize_t n = recv(looker->file, looker->line + looker->used,
                     sizeof looker->line - looker->used, MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR))
        return;
    if (n <= 0) {
        drop(o, i);
        return;
    }
    looker->used += (size_t)n;
    char *end = memchr(looker->line, '\n', looker->used);
    if (end == NULL && looker->used < sizeof looker->line)
        return;
    if (end == NULL || end + 1 != looker->line + looker->used) {
        drop(o, i); /* one question at a time, and a short one */
        return;
    }
    *end = '\0';
    looker->used = 0;
    looker->asks = read_question(o, looker->line, &looker->question) == 0;
    if (!looker->asks) {
        tell(o, i, refusal("that is no question; see host/watch/look.h"),
             now_us);
    }
}

static void serve(struct host_offer *o, unsigned i, uint64_t now_us) {
    struct host_looker *looker = &o->looker[i];
    if (looker->file >= 0 && looker->out != NULL)
        flush(o, i, now_us);
    else if (looker->file >= 0 && !looker->asks && o->asked != (int)i)
        hear(o, i, now_us);
}

/* --- as the service sees it ----------------------------------------------- */

static bool ask(void *context, uint64_t now_us,
                struct host_watchers_question *question) {
    struct host_offer *o = context;
    if (o->listener < 0 && now_us - o->tried_us > TRY_US)
        take_place(o, now_us);
    for (unsigned k = 0; k < CALLS_A_LOOK && o->listener >= 0; k++)
        if (!welcome(o, now_us))
            break;
    for (unsigned i = 0; i < HOST_LOOKERS_MAX; i++)
        serve(o, i, now_us);
    for (unsigned k = 0; k < HOST_LOOKERS_MAX; k++) {
        unsigned i = (o->turn + k) % HOST_LOOKERS_MAX;
        if (o->looker[i].asks) {
            o->turn = (i + 1) % HOST_LOOKERS_MAX;
            o->looker[i].asks = false;
            o->asked = (int)i;
            o->answers = json_object();
            *question = o->looker[i].question;
            return true;
        }
    }
    return false;
}

static void answer(void *context, unsigned node, const uint8_t *data,
                   size_t size) {
    struct host_offer *o = context;
    char key[12], hex[2 * CUBE_PAYLOAD_MAX + 1];
    (void)sodium_bin2hex(hex, sizeof hex, data, size);
    snprintf(key, sizeof key, "%u", node);
    (void)json_object_set_new(o->answers, key, json_string(hex));
}

static void answered(void *context, uint64_t now_us,
                     const struct host_watchers_progress *progress) {
    struct host_offer *o = context;
    int asked = o->asked;
    o->asked = -1;
    if (asked < 0) {
        json_decref(o->answers);
    } else {
        tell(o, (unsigned)asked,
             json_pack("{ss sI sI sI so}", "ask",
                       host_look_name(o->looker[asked].question.what),
                       "committed", (json_int_t)progress->committed, "bricks",
                       (json_int_t)progress->bricks, "tetrahedra",
                       (json_int_t)progress->tetrahedra, "answers", o->answers),
             now_us);
    }
    o->answers = NULL;
}

static const char *holder(void *context) {
    struct host_offer *o = context;
    struct host_holder who;
    return host_holder_find(&who, o->wire)
               ? host_holder_text(&who, o->holder, sizeof o->holder)
               : NULL;
}

void host_offer_begin(struct host_offer *offer, const char *wire) {
    memset(offer, 0, sizeof *offer);
    snprintf(offer->wire, sizeof offer->wire, "%s", wire);
    offer->asked = -1;
    for (unsigned i = 0; i < HOST_LOOKERS_MAX; i++)
        offer->looker[i].file = -1;
    offer->watchers = (struct host_watchers){.context = offer,
                                             .ask = ask,
                                             .answer = answer,
                                             .answered = answered,
                                             .holder = holder};
    take_place(offer, 0);
}

void host_offer_machine(struct host_offer *offer,
                        const struct host_machine *machine) {
    offer->nodes = machine->nodes;
    offer->dimension = machine->dimension;
    offer->serial_baud = machine->serial_baud;
}

void host_offer_end(struct host_offer *offer) {
    if (offer->watchers.context == NULL)
        return; /* it has not begun */
    for (unsigned i = 0; i < HOST_LOOKERS_MAX; i++)
        if (offer->looker[i].file >= 0)
            drop(offer, i);
    if (offer->listener >= 0)
        close(offer->listener);
    json_decref(offer->answers);
    memset(offer, 0, sizeof *offer);
}
