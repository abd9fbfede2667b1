#include "emulator.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <poll.h>
#include <sched.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "boards.h"
#include "host/base/error.h"

enum { ARGUMENTS_MAX = 64, ARGUMENT_BYTES = 2 * PATH_MAX + 128 };

extern char **environ;

/* --- what it needs -------------------------------------------------------- */

static int find_program(const struct host_bare *bare, char path[PATH_MAX],
                        struct host_error *error) {
    const char *folders = getenv("PATH");
    folders = folders == NULL ? "/usr/bin:/bin" : folders;
    while (*folders != '\0') {
        int length = (int)strcspn(folders, ":");
        int size =
            snprintf(path, PATH_MAX, "%.*s/%s", length, folders, bare->program);
        if (length > 0 && size < PATH_MAX && access(path, X_OK) == 0)
            return 0;
        folders += length + (folders[length] == ':');
    }
    return host_fail(error, HOST_CUBE,
                     "%s: not found in PATH, and it emulates the board %s; "
                     "install it with: apt-get install %s",
                     bare->program, bare->machine, bare->package);
}

/* Where `make firmware` and `make install` put it. */
static int find_image(const char *image, char path[PATH_MAX],
                      struct host_error *error) {
    static const char *const folders[] = {"firmware", "../lib/incode"};
    char here[PATH_MAX - 64];
    ssize_t length = readlink("/proc/self/exe", here, sizeof here - 1);
    here[length > 0 ? length : 0] = '\0';
    char *slash = strrchr(here, '/');
    if (slash == NULL) {
        return host_fail(error, HOST_BROKEN,
                         "/proc/self/exe: cannot be read; is /proc mounted?");
    }
    *slash = '\0';
    for (size_t i = 0; i < sizeof folders / sizeof folders[0]; i++) {
        snprintf(path, PATH_MAX, "%s/%s/%s", here, folders[i], image);
        if (access(path, R_OK) == 0)
            return 0;
    }
    return host_fail(error, HOST_CUBE,
                     "%s/firmware/%s: %s; make the board's firmware with: make "
                     "firmware",
                     here, image, strerror(errno));
}

int host_emulator_find(const struct host_bare *bare,
                       struct host_emulator *emulator,
                       struct host_error *error) {
    memset(emulator, 0, sizeof *emulator);
    emulator->bare = bare;
    emulator->flash.fd = emulator->qmp.fd = emulator->errors = -1;
    emulator->folder = -1;
    for (unsigned i = 0; i < HOST_UARTS_MAX; i++)
        emulator->uart[i].wire.fd = emulator->uart[i].log.fd = -1;
    if (find_program(bare, emulator->program, error) != 0 ||
        find_image(bare->image, emulator->image, error) != 0)
        return error->code;
    return find_image(bare->flash == HOST_FLASH_NONE ? bare->image
                                                     : bare->loader,
                      emulator->first, error);
}

bool host_firmware_find(const char *board, char path[PATH_MAX]) {
    const struct host_board *row = host_board_named(board);
    struct host_error error = {0};
    char here[PATH_MAX];
    if (row == NULL || row->bare == NULL ||
        find_image(row->bare->image, path, &error) != 0 ||
        getcwd(here, sizeof here) == NULL)
        return false;
    size_t above = strlen(here);
    if (strncmp(path, here, above) == 0 && path[above] == '/')
        memmove(path, path + above + 1, strlen(path + above + 1) + 1);
    return true;
}

/* --- its start ------------------------------------------------------------ */

/* The command's words, in the child. */
struct words {
    char *argv[ARGUMENTS_MAX + 1];
    char text[ARGUMENTS_MAX][ARGUMENT_BYTES];
    unsigned count;
};

static __attribute__((format(printf, 2, 3))) void add(struct words *w,
                                                      const char *format, ...) {
    va_list list;
    va_start(list, format);
    if (w->count < ARGUMENTS_MAX) {
        w->argv[w->count] = w->text[w->count];
        vsnprintf(w->text[w->count++], ARGUMENT_BYTES, format, list);
    }
    va_end(list);
}

static bool is_given(struct host_place place) {
    return place.fd >= 0 || place.path != NULL;
}

/* Behind the last word: a name of a file in a list of settings, where a comma
 * is written twice. */
static void add_file(struct words *w, const char *name,
                     struct host_place place) {
    char *text = w->text[w->count - 1];
    size_t used = strlen(text);
    used += (size_t)snprintf(text + used, ARGUMENT_BYTES - used, ",%s=", name);
    if (place.fd >= 0) {
        (void)fcntl(place.fd, F_SETFD, 0);
        snprintf(text + used, ARGUMENT_BYTES - used, "/proc/self/fd/%d",
                 place.fd);
        return;
    }
    for (const char *at = place.path; *at != '\0'; at++) {
        if (used + 3 > ARGUMENT_BYTES)
            break;
        text[used++] = *at;
        if (*at == ',')
            text[used++] = ',';
    }
    text[used] = '\0';
}

/* A device of characters: NAME, by which others name it. */
static void add_device(struct words *w, const char *name, unsigned number,
                       struct host_place wire, struct host_place log) {
    add(w, "-chardev");
    if (wire.fd >= 0) {
        (void)fcntl(wire.fd, F_SETFD, 0);
        add(w, "socket,id=%s%u,fd=%d", name, number, wire.fd);
    } else if (wire.path != NULL) {
        add(w, "socket,id=%s%u,server=on,wait=off", name, number);
        add_file(w, "path", wire);
    } else {
        add(w, "null,id=%s%u", name, number);
    }
    if (is_given(log)) {
        char *text = w->text[w->count - 1];
        add_file(w, "logfile", log);
        strncat(text, ",logappend=on", ARGUMENT_BYTES - strlen(text) - 1);
    }
}

static void add_flash(struct words *w, struct host_place flash, bool card) {
    if (is_given(flash) && card) {
        add(w, "-drive");
        add(w, "if=sd,format=raw");
        add_file(w, "file", flash);
    } else if (is_given(flash)) {
        strcat(w->text[w->count - 1], ",memory-backend=ram");
        add(w, "-object");
        add(w, "memory-backend-file,id=ram,share=on,size=%d", HOST_FLASH_BYTES);
        add_file(w, "mem-path", flash);
    }
}

/* The one of the processors that are allowed, in turn. */
static void stay_on_one(unsigned turn) {
    cpu_set_t allowed, one;
    CPU_ZERO(&one);
    if (sched_getaffinity(0, sizeof allowed, &allowed) != 0)
        return;
    turn %= (unsigned)CPU_COUNT(&allowed);
    for (size_t i = 0; i < CPU_SETSIZE; i++) {
        if (CPU_ISSET(i, &allowed) && turn-- == 0) {
            CPU_SET(i, &one);
            (void)sched_setaffinity(0, sizeof one, &one);
            return;
        }
    }
}

void host_emulator_become(const struct host_emulator *emulator, unsigned turn) {
    static struct words words;
    static const struct host_place none = {-1, NULL};
    const struct host_emulator *e = emulator;
    struct words *w = &words;
    (void)close_range(3, ~0u, CLOSE_RANGE_CLOEXEC);
    if (e->folder >= 0)
        (void)fcntl(e->folder, F_SETFD, 0);
    if (e->errors >= 0)
        (void)dup2(e->errors, STDERR_FILENO);
    add(w, "%s", e->bare->program);
    add(w, "-M");
    add(w, "%s", e->bare->machine);
    add_flash(w, e->flash, e->bare->flash == HOST_FLASH_CARD);
    add(w, "%s", e->bare->option);
    add(w, "%s", e->first);
    add(w, "-display");
    add(w, "none");
    add(w, "-nic");
    add(w, "none");
    for (unsigned i = 0; i < e->bare->uarts; i++) {
        add_device(w, "uart", i, e->uart[i].wire, e->uart[i].log);
        add(w, "-serial");
        add(w, "chardev:uart%u", i);
    }
    if (is_given(e->qmp)) {
        add_device(w, "monitor", 0, e->qmp, none);
        add(w, "-mon");
        add(w, "chardev=monitor0,mode=control");
    } else {
        add(w, "-monitor");
        add(w, "none");
    }
    stay_on_one(turn);
    execve(e->program, w->argv, environ);
}

/* --- qmp ------------------------------------------------------------------ */

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
            if (object != NULL)
                return object;
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
        if (json_object_get(object, good) != NULL)
            found = 0;
        else if (json_object_get(object, bad) != NULL)
            found = 1;
        json_decref(object);
    }
    return found;
}

static int request(struct host_qmp *qmp, const char *name, uint64_t due_us,
                   struct host_error *error) {
    char text[64];
    snprintf(text, sizeof text, "{\"execute\":\"%s\"}\n", name);
    if (say(qmp, text, due_us, error) != 0)
        return error->code;
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
            request(qmp, "qmp_capabilities", due_us, error) != 0)
            return error->code;
        qmp->ready = true;
    }
    return request(qmp, names[what], due_us, error);
}

void host_qmp_forget(struct host_qmp *qmp) {
    qmp->ready = false;
    qmp->skipping = false;
    qmp->used = 0;
}
