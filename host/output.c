#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BUFFER_BYTES = 1 << 20, PARTS_MAX = 8 };

/* The names of parts that a signal has to remove; NULL: none. */
static char *volatile parts[PARTS_MAX];

static const int endings[] = {SIGINT, SIGTERM, SIGHUP};
enum { ENDINGS = sizeof endings / sizeof endings[0] };

/* With its default action back, the signal ends the program on return. */
static void on_ending(int number)
{
    for (int i = 0; i < PARTS_MAX; i++) {
        if (parts[i] != NULL) {
            (void)unlink(parts[i]);
        }
    }
    (void)raise(number);
}

void host_output_guard(void)
{
    struct sigaction action = {.sa_handler = on_ending,
                               .sa_flags = (int)SA_RESETHAND};
    struct sigaction before;
    for (int i = 0; i < ENDINGS; i++) {
        if (sigaction(endings[i], NULL, &before) == 0 &&
            before.sa_handler == SIG_DFL) { /* nohup has it ignored */
            (void)sigaction(endings[i], &action, NULL);
        }
    }
    (void)signal(SIGPIPE, SIG_IGN);
    (void)signal(SIGXFSZ, SIG_IGN);
}

/* Holds signals off while names and files change together.  No other thread
 * lives while outputs are open. */
static void hold(sigset_t *before)
{
    sigset_t set;
    (void)sigemptyset(&set);
    for (int i = 0; i < ENDINGS; i++) {
        (void)sigaddset(&set, endings[i]);
    }
    (void)pthread_sigmask(SIG_BLOCK, &set, before);
}

static void release(const sigset_t *before)
{
    (void)pthread_sigmask(SIG_SETMASK, before, NULL);
}

/* Replaces `old` in the list by `new`. */
static void note(const char *old, char *new)
{
    for (int i = 0; i < PARTS_MAX; i++) {
        if (parts[i] == old) {
            parts[i] = new;
            return;
        }
    }
}

static int cannot_make(const char *path, int reason, struct host_error *error)
{
    return host_fail(error, HOST_INPUT,
                     "%s: cannot be written (%s); choose another place", path,
                     strerror(reason));
}

/* The name under which `writer` writes what will be `target`. */
static void part_name(char *name, size_t size, const char *target, pid_t writer)
{
    (void)snprintf(name, size, "%s.part-%ld", target, (long)writer);
}

void host_output_clean(const char *path, pid_t writer, uint64_t since_ns)
{
    char name[4096 + 32];
    struct stat status;
    char *target = realpath(path, NULL);
    part_name(name, sizeof name, target == NULL ? path : target, writer);
    (void)unlink(name);
    free(target);
    /* A change of name counts as one of the file. */
    if (stat(path, &status) == 0 && S_ISREG(status.st_mode) &&
        (uint64_t)status.st_ctim.tv_sec * 1000000000 +
                (uint64_t)status.st_ctim.tv_nsec >=
            since_ns) {
        (void)unlink(path);
    }
}

/* Opens a device or a pipe, for which nobody waits that does not come. */
static int open_in_place(struct host_output *out, bool pipe,
                         struct host_error *error)
{
    int wait = pipe ? O_NONBLOCK : 0;
    out->file = open(out->target, O_WRONLY | O_CLOEXEC | wait);
    if (out->file < 0 && pipe && errno == ENXIO) {
        return host_fail(error, HOST_INPUT,
                         "%s: nobody reads from this pipe; start its reader "
                         "first, or choose another place",
                         out->path);
    }
    if (out->file < 0 || (pipe && fcntl(out->file, F_SETFL, O_WRONLY) != 0)) {
        return cannot_make(out->path, errno, error);
    }
    return 0;
}

/* Opens a new file beside the target, or the target itself. */
static int open_file(struct host_output *out, struct host_error *error)
{
    struct stat status;
    sigset_t signals;
    out->target = realpath(out->path, NULL);
    if (out->target == NULL) {
        out->target = strdup(out->path); /* it is not there yet */
    }
    if (out->target == NULL) {
        return host_fail_memory(error, "an output");
    }
    bool there = stat(out->target, &status) == 0;
    if (there && S_ISDIR(status.st_mode)) {
        return cannot_make(out->path, EISDIR, error);
    }
    if (there && !S_ISREG(status.st_mode)) {
        return open_in_place(out, S_ISFIFO(status.st_mode), error);
    }
    if (there && access(out->target, W_OK) != 0) {
        return cannot_make(out->path, errno, error);
    }
    size_t size = strlen(out->target) + 32;
    out->temporary = malloc(size);
    if (out->temporary == NULL) {
        return host_fail_memory(error, "an output");
    }
    part_name(out->temporary, size, out->target, getpid());
    hold(&signals);
    out->file =
        open(out->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    int reason = errno;
    if (out->file >= 0) {
        note(NULL, out->temporary);
    }
    release(&signals);
    if (out->file < 0) {
        free(out->temporary);
        out->temporary = NULL; /* not ours to remove */
        return cannot_make(out->path, reason, error);
    }
    return 0;
}

int host_output_open(struct host_output *out, const char *path,
                     struct host_error *error)
{
    *out = (struct host_output){.path = path, .file = -1};
    out->buffer = malloc(BUFFER_BYTES);
    if (out->buffer == NULL) {
        host_fail_memory(error, "an output");
    } else if (strcmp(path, "-") == 0) {
        out->file = STDOUT_FILENO;
    } else {
        open_file(out, error);
    }
    if (error->code != 0) {
        host_output_close(out, 1, error);
    }
    return error->code;
}

int host_output_probe(const char *path, struct host_error *error)
{
    struct host_output out;
    struct stat status;
    if (host_output_open(&out, path, error) == 0) {
        struct host_error dropped = {.code = HOST_BROKEN}; /* remove it */
        if (fstat(out.file, &status) == 0 && S_ISFIFO(status.st_mode)) {
            out.file = -1; /* until the program ends */
        }
        (void)host_output_close(&out, 1, &dropped);
    }
    return error->code;
}

static void flush(struct host_output *out)
{
    for (size_t done = 0; done < out->used && out->failure == 0;) {
        ssize_t n = write(out->file, out->buffer + done, out->used - done);
        if (n >= 0) {
            done += (size_t)n;
        } else if (errno != EINTR) {
            out->failure = errno;
        }
    }
    out->used = 0;
}

void host_output_bytes(struct host_output *out, const void *bytes, size_t n)
{
    const char *from = bytes;
    while (n > 0) {
        size_t room = BUFFER_BYTES - out->used;
        size_t part = n < room ? n : room;
        memcpy(out->buffer + out->used, from, part);
        out->used += part;
        from += part;
        n -= part;
        if (out->used == BUFFER_BYTES) {
            flush(out);
        }
    }
}

void host_output_text(struct host_output *out, const char *text)
{
    host_output_bytes(out, text, strlen(text));
}

void host_output_unsigned(struct host_output *out, uint64_t value)
{
    char digits[20];
    size_t at = sizeof digits;
    do {
        digits[--at] = (char)('0' + value % 10);
        value /= 10;
    } while (value != 0);
    host_output_bytes(out, digits + at, sizeof digits - at);
}

void host_output_double(struct host_output *out, double value)
{
    char text[40];
    if (value == floor(value) && fabs(value) < 1e15) {
        if (signbit(value)) {
            host_output_text(out, "-");
        }
        host_output_unsigned(out, (uint64_t)fabs(value));
        return;
    }
    int n = snprintf(text, sizeof text, "%.17g", value);
    host_output_bytes(out, text, (size_t)n);
}

static void finish(struct host_output *out, struct host_error *error)
{
    if (out->file >= 0) {
        flush(out);
        if (out->file != STDOUT_FILENO && close(out->file) != 0 &&
            out->failure == 0) {
            out->failure = errno;
        }
        out->file = -1;
    }
    if (out->failure == EPIPE) {
        host_fail(error, HOST_INPUT,
                  "%s: its reader went away before the end (%s); let it read "
                  "on, or write to a file",
                  out->path, strerror(EPIPE));
    } else if (out->failure != 0) {
        host_fail(error, HOST_INPUT,
                  "%s: writing failed (%s); make room or choose another place",
                  out->path, strerror(out->failure));
    }
}

int host_output_close(struct host_output *out, size_t n,
                      struct host_error *error)
{
    sigset_t signals;
    for (size_t i = 0; i < n; i++) {
        finish(&out[i], error);
    }
    hold(&signals); /* all of them get their names, or none */
    for (size_t i = 0; i < n; i++) {
        if (out[i].temporary != NULL && error->code == 0 &&
            rename(out[i].temporary, out[i].target) != 0) {
            cannot_make(out[i].path, errno, error);
        } else if (out[i].temporary != NULL && error->code == 0) {
            note(out[i].temporary, NULL);
            free(out[i].temporary);
            out[i].temporary = NULL;
        }
    }
    for (size_t i = 0; i < n; i++) {
        if (out[i].temporary != NULL) {
            (void)unlink(out[i].temporary);
            note(out[i].temporary, NULL);
        }
        free(out[i].temporary);
        free(out[i].target);
        free(out[i].buffer);
        out[i] = (struct host_output){.file = -1};
    }
    release(&signals);
    return error->code;
}
