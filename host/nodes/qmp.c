#include "qmp.h"

#include <errno.h>
#include <jansson.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "host/base/clock.h"

void host_qmp_init(struct host_qmp *qmp, int fd) {
    memset(qmp, 0, sizeof *qmp);
    qmp->fd = fd;
    qmp->wait_us = HOST_QMP_US;
}

static int fail(struct host_error *error, const char *why) {
    return host_fail(error, HOST_CUBE,
                     "the emulator's monitor: %s; is the emulator stopped?",
                     why);
}

/* False: not before due_us. */
static bool wait_for(const struct host_qmp *qmp, short events,
                     uint64_t due_us) {
    uint64_t now = host_now_us();
    struct pollfd one = {.fd = qmp->fd, .events = events};
    return now < due_us &&
           poll(&one, 1, (int)((due_us - now + 999) / 1000)) > 0;
}

static int say(const struct host_qmp *qmp, const char *text, uint64_t due_us,
               struct host_error *error) {
    size_t size = strlen(text);
    while (size > 0) {
        ssize_t sent = send(qmp->fd, text, size, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0) {
            text += sent;
            size -= (size_t)sent;
        } else if (errno != EAGAIN && errno != EINTR) {
            return fail(error, strerror(errno));
        } else if (!wait_for(qmp, POLLOUT, due_us)) {
            return fail(error, "takes no request");
        }
    }
    return 0;
}

/* The next line as an object, which the caller frees; NULL with the error. */
static json_t *hear(struct host_qmp *qmp, uint64_t due_us,
                    struct host_error *error) {
    for (;;) {
        char *end = memchr(qmp->line, '\n', qmp->used);
        if (end != NULL) {
            size_t size = (size_t)(end - qmp->line);
            json_t *object =
                qmp->skipping ? NULL : json_loadb(qmp->line, size, 0, NULL);
            qmp->skipping = false;
            qmp->used -= size + 1;
            memmove(qmp->line, end + 1, qmp->used);
            if (object != NULL) {
                return object;
            }
            continue;
        }
        if (qmp->used == sizeof qmp->line) {
            qmp->skipping = true;
            qmp->used = 0;
        }
        ssize_t got = recv(qmp->fd, qmp->line + qmp->used,
                           sizeof qmp->line - qmp->used, MSG_DONTWAIT);
        if (got > 0) {
            qmp->used += (size_t)got;
        } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
            fail(error, got == 0 ? "closed" : strerror(errno));
            return NULL;
        } else if (!wait_for(qmp, POLLIN, due_us)) {
            fail(error, "no answer in time");
            return NULL;
        }
    }
}

/* Listens until an object has one of two members: 0 for the first, 1 for the
 * second, or -1 with the error. */
static int await(struct host_qmp *qmp, const char *good, const char *bad,
                 uint64_t due_us, struct host_error *error) {
    json_t *object;
    int found = -1;
    while (found < 0 && (object = hear(qmp, due_us, error)) != NULL) {
        if (json_object_get(object, good) != NULL) {
            found = 0;
        } else if (json_object_get(object, bad) != NULL) {
            found = 1;
        }
        json_decref(object);
    }
    return found;
}

static int request(struct host_qmp *qmp, const char *name, uint64_t due_us,
                   struct host_error *error) {
    char text[64];
    snprintf(text, sizeof text, "{\"execute\":\"%s\"}\n", name);
    if (say(qmp, text, due_us, error) != 0) {
        return error->code;
    }
    int answer = await(qmp, "return", "error", due_us, error);
    return answer <= 0 ? error->code : fail(error, "it refuses the request");
}

int host_qmp_ask(struct host_qmp *qmp, enum host_qmp_request what,
                 struct host_error *error) {
    static const char *const names[] = {[HOST_QMP_STOP] = "stop",
                                        [HOST_QMP_CONT] = "cont",
                                        [HOST_QMP_RESET] = "system_reset"};
    uint64_t due_us = host_now_us() + qmp->wait_us;
    error->code = 0;
    if (!qmp->ready) {
        if (await(qmp, "QMP", "QMP", due_us, error) < 0 ||
            request(qmp, "qmp_capabilities", due_us, error) != 0) {
            return error->code;
        }
        qmp->ready = true;
    }
    return request(qmp, names[what], due_us, error);
}

void host_qmp_forget(struct host_qmp *qmp) {
    qmp->ready = false;
    qmp->skipping = false;
    qmp->used = 0;
}
