#include "output.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdio_ext.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/base/create.h"
#include "host/base/parallel.h"
#include "host/base/progress.h"
#include "write.h"

enum { BUFFER_BYTES = 1 << 20 };

/* A file beside the one that it will be.  While names change, it has a second
 * one, `made`, by which others know whose it is; what was there already has
 * `kept`. */
struct host_part {
    struct host_part *next;
    char *path;   /* as the user gave it */
    char *target; /* what it is in the end, links followed */
    char *name, *made, *kept;
    struct stat file;
    bool marked, named; /* it has its second name; it has its own */
    bool was, keeps;    /* something was there; that has its second name */
};

/* Those whose outputs are not done: what a signal has to remove. */
static struct host_part *volatile parts;

static const int endings[] = {SIGINT, SIGTERM, SIGHUP};
enum { ENDINGS = sizeof endings / sizeof endings[0] };

/* Of outputs: one was asked for; something went to one that is no file. */
static volatile sig_atomic_t asked, in_place;
static const char *volatile advice;

/* In a handler of signals: what has happened, and what is left. */
static void tell(int number) {
    char text[160] = "incode: ";
    strcat(text, number == SIGINT    ? "interrupted"
                 : number == SIGTERM ? "terminated"
                                     : "hung up");
    strcat(text, in_place != 0 ? "; what was written so far is not whole"
                 : asked != 0  ? "; no output was written"
                               : "");
    strcat(text, "\n");
    host_progress_erase();
    (void)!write(STDERR_FILENO, text, strlen(text));
    if (advice != NULL)
        (void)!write(STDERR_FILENO, advice, strlen(advice));
}

/* With its default action back, the signal ends the program on return. */
static void on_ending(int number) {
    for (struct host_part *part = parts; part != NULL; part = part->next)
        (void)unlink(part->name);
    tell(number);
    (void)raise(number);
}

void host_output_guard(void) {
    struct sigaction action = {.sa_handler = on_ending,
                               .sa_flags = (int)SA_RESETHAND};
    struct sigaction before;
    for (int i = 0; i < ENDINGS; i++)
        if (sigaction(endings[i], NULL, &before) == 0 &&
            before.sa_handler == SIG_DFL) /* nohup has it ignored */
            (void)sigaction(endings[i], &action, NULL);
    (void)signal(SIGPIPE, SIG_IGN);
    (void)signal(SIGXFSZ, SIG_IGN);
}

/* Holds signals off while the list and the files change together.  Other
 * threads take none (parallel.h). */
static void hold(sigset_t *before) {
    sigset_t set;
    (void)sigemptyset(&set);
    for (int i = 0; i < ENDINGS; i++)
        (void)sigaddset(&set, endings[i]);
    (void)pthread_sigmask(SIG_BLOCK, &set, before);
}

static void release(const sigset_t *before) {
    (void)pthread_sigmask(SIG_SETMASK, before, NULL);
}

/* What has its names is whole, whatever comes after. */
static void end_guard(void) {
    struct sigaction action;
    for (int i = 0; i < ENDINGS; i++)
        if (sigaction(endings[i], NULL, &action) == 0 &&
            action.sa_handler == on_ending)
            (void)signal(endings[i], SIG_IGN);
}

static int cannot_make(const char *path, int reason, struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s: cannot be written (%s); choose another place", path,
                     strerror(reason));
}

/* Beside `target`, of process `writer` and nobody else. */
static char *name_beside(const char *target, const char *what, pid_t writer) {
    char *name = NULL;
    return asprintf(&name, "%s.%s-%ld", target, what, (long)writer) < 0 ? NULL
                                                                        : name;
}

void host_output_clean(const char *path, pid_t writer) {
    struct stat status;
    char *target = host_target(path);
    char *name = target == NULL ? NULL : name_beside(target, "part", writer);
    char *kept = target == NULL ? NULL : name_beside(target, "kept", writer);
    char *made = target == NULL ? NULL : name_beside(target, "made", writer);
    if (name != NULL && kept != NULL && made != NULL) {
        (void)unlink(name);
        if (lstat(made, &status) == 0 && host_is_file(&status, target) &&
            rename(kept, target) != 0)
            (void)unlink(target);
        (void)unlink(kept);
        (void)unlink(made);
    }
    free(name);
    free(kept);
    free(made);
    free(target);
}

/* --- parts ---------------------------------------------------------------- */

static void free_part(struct host_part *part) {
    if (part != NULL) {
        free(part->path);
        free(part->target);
        free(part->name);
        free(part->made);
        free(part->kept);
        free(part);
    }
}

/* Takes `target` over. */
static struct host_part *make_part(const char *path, char *target) {
    struct host_part *part = calloc(1, sizeof *part);
    if (part == NULL) {
        free(target);
        return NULL;
    }
    part->path = strdup(path);
    part->target = target;
    part->name = name_beside(target, "part", getpid());
    part->made = name_beside(target, "made", getpid());
    part->kept = name_beside(target, "kept", getpid());
    if (part->path == NULL || part->name == NULL || part->made == NULL ||
        part->kept == NULL) {
        free_part(part);
        return NULL;
    }
    return part;
}

static bool is_ours(const char *name) {
    const struct host_part *part = parts;
    while (part != NULL && strcmp(part->name, name) != 0)
        part = part->next;
    return part != NULL;
}

/* Makes the part's file and notes it.  One that is there is of an earlier
 * process of this number, which was killed. */
static int open_part(struct host_part *part) {
    sigset_t signals;
    hold(&signals);
    int file = host_create(part->name, 0666);
    if (file < 0 && errno == EEXIST && !is_ours(part->name) &&
        unlink(part->name) == 0)
        file = host_create(part->name, 0666);
    int reason = errno;
    if (file >= 0)
        (void)fstat(file, &part->file);
    if (file >= 0 && parts == NULL) {
        parts = part;
    } else if (file >= 0) {
        struct host_part *before = parts;
        while (before->next != NULL)
            before = before->next;
        before->next = part;
    }
    release(&signals);
    errno = reason;
    return file;
}

static void drop_part(struct host_part *part) {
    sigset_t signals;
    hold(&signals);
    (void)unlink(part->name);
    if (parts == part) {
        parts = part->next;
    } else {
        struct host_part *before = parts;
        while (before->next != part)
            before = before->next;
        before->next = part->next;
    }
    free_part(part);
    release(&signals);
}

/* --- opening -------------------------------------------------------------- */

/* Opens a device or a pipe, for which nobody waits that does not come. */
static int open_in_place(struct host_output *out, bool pipe,
                         struct host_error *error) {
    int wait = pipe ? O_NONBLOCK : 0;
    out->file = open(out->path, O_WRONLY | O_CLOEXEC | wait);
    if (out->file < 0 && pipe && errno == ENXIO) {
        return host_fail(error, HOST_INPUT,
                         "%s: nobody reads from this pipe; start its reader "
                         "first, or choose another place",
                         out->path);
    }
    if (out->file < 0 || (pipe && fcntl(out->file, F_SETFL, O_WRONLY) != 0))
        return cannot_make(out->path, errno, error);
    return 0;
}

/* Opens a new file beside the target, or what is there in its place. */
static int open_file(struct host_output *out, struct host_error *error) {
    struct stat status;
    bool there = stat(out->path, &status) == 0;
    if (there && S_ISDIR(status.st_mode))
        return cannot_make(out->path, EISDIR, error);
    if (there && !S_ISREG(status.st_mode))
        return open_in_place(out, S_ISFIFO(status.st_mode), error);
    if (there && access(out->path, W_OK) != 0)
        return cannot_make(out->path, errno, error);
    char *target = host_target(out->path);
    if (target == NULL)
        return cannot_make(out->path, errno, error);
    struct host_part *part = make_part(out->path, target);
    if (part == NULL)
        return host_fail_memory(error, "an output");
    out->file = open_part(part);
    if (out->file < 0) {
        int reason = errno;
        free_part(part); /* its file is not ours to remove */
        return cannot_make(out->path, reason, error);
    }
    out->part = part;
    return 0;
}

int host_output_open(struct host_output *out, const char *path,
                     struct host_error *error) {
    *out = (struct host_output){.path = path, .file = -1};
    asked = 1;
    out->buffer = malloc(BUFFER_BYTES);
    if (out->buffer == NULL)
        host_fail_memory(error, "an output");
    else if (strcmp(path, "-") == 0)
        out->file = STDOUT_FILENO;
    else
        open_file(out, error);
    if (error->code != 0)
        host_output_close(out, 1, error);
    return error->code;
}

int host_output_probe(const char *path, struct host_error *error) {
    struct host_output out;
    struct stat status;
    if (host_output_open(&out, path, error) == 0) {
        struct host_error dropped = {.code = HOST_BROKEN}; /* remove it */
        if (fstat(out.file, &status) == 0 && S_ISFIFO(status.st_mode))
            out.file = -1; /* until the program ends */
        (void)host_output_close(&out, 1, &dropped);
    }
    return error->code;
}

void host_output_advice(const char *line) {
    advice = line;
}

void host_output_expect(void) {
    asked = 1;
}

/* --- writing -------------------------------------------------------------- */

static void put_out(struct host_output *out, const char *bytes, size_t size) {
    for (size_t done = 0; done < size && out->failure == 0;) {
        in_place = in_place != 0 || out->part == NULL;
        ssize_t n = write(out->file, bytes + done, size - done);
        if (n >= 0) {
            done += (size_t)n;
            out->written += (uint64_t)n;
            if (!out->silent)
                host_progress_add((uint64_t)n);
        } else if (errno != EINTR) {
            out->failure = errno;
        }
    }
}

static void flush(struct host_output *out) {
    put_out(out, out->buffer, out->used);
    host_call_trim(out->used); /* it was written from about as much */
    out->used = 0;
}

void host_output_bytes(struct host_output *out, const void *bytes, size_t n) {
    const char *from = bytes;
    while (n > 0) {
        bool whole = out->used == 0 && n >= BUFFER_BYTES;
        size_t room = BUFFER_BYTES - out->used;
        size_t part = n < room ? n : room;
        if (whole) { /* as it is, without a copy */
            put_out(out, from, part);
        } else {
            memcpy(out->buffer + out->used, from, part);
            out->used += part;
        }
        from += part;
        n -= part;
        if (out->used == BUFFER_BYTES)
            flush(out);
    }
}

void host_output_return(struct host_output *out, uint64_t place) {
    flush(out);
    if (out->failure == 0 && lseek(out->file, (off_t)place, SEEK_SET) < 0)
        out->failure = errno;
}

void host_output_unsigned(struct host_output *out, uint64_t value) {
    char digits[20];
    size_t at = sizeof digits;
    do {
        digits[--at] = (char)('0' + value % 10);
        value /= 10;
    } while (value != 0);
    host_output_bytes(out, digits + at, sizeof digits - at);
}

/* --- the end -------------------------------------------------------------- */

/* What a disk cannot take, it may say as late as this. */
static void finish(struct host_output *out, struct host_error *error) {
    if (out->file >= 0) {
        flush(out);
        if (out->file != STDOUT_FILENO && close(out->file) != 0 &&
            out->failure == 0)
            out->failure = errno;
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
                      struct host_error *error) {
    for (size_t i = 0; i < n; i++) {
        finish(&out[i], error);
        free(out[i].buffer);
    }
    for (size_t i = 0; i < n; i++) {
        if (out[i].part != NULL && error->code != 0)
            drop_part(out[i].part);
        out[i] = (struct host_output){.file = -1};
    }
    return error->code;
}

/* A second name, which one that was left there does not hinder. */
static bool name_also(const char *name, const char *other) {
    return link(name, other) == 0 ||
           (errno == EEXIST && unlink(other) == 0 && link(name, other) == 0);
}

/* Gives the part its name, and what is there a second one, so that it can have
 * its own back. */
static bool name_part(struct host_part *part) {
    part->keeps = name_also(part->target, part->kept);
    part->was = part->keeps || errno != ENOENT;
    part->marked = name_also(part->name, part->made);
    part->named = rename(part->name, part->target) == 0;
    return part->named;
}

static void forget_names(const struct host_part *part) {
    if (part->marked)
        (void)unlink(part->made);
    if (part->keeps)
        (void)unlink(part->kept);
}

/* The path of an output whose former file could not be kept; NULL: none.  A
 * file that somebody else has put there meanwhile stays. */
static const char *take_names_back(void) {
    const char *lost = NULL;
    for (struct host_part *part = parts; part != NULL; part = part->next) {
        if (part->named && host_is_file(&part->file, part->target) &&
            !(part->keeps && rename(part->kept, part->target) == 0)) {
            (void)unlink(part->target);
            lost = part->was && lost == NULL ? part->path : lost;
        }
        forget_names(part);
    }
    return lost;
}

/* All of them get their names, or none. */
static int name_all(struct host_error *error) {
    struct host_part *part = parts;
    while (part != NULL && name_part(part))
        part = part->next;
    if (part != NULL) {
        int reason = errno;
        const char *lost = take_names_back();
        return host_fail(error, HOST_INPUT,
                         "%s: cannot be written (%s)%s%s%s; choose another "
                         "place",
                         part->path, strerror(reason),
                         lost == NULL ? "" : ", and what was in ",
                         lost == NULL ? "" : lost,
                         lost == NULL ? "" : " before is lost");
    }
    while (parts != NULL) {
        part = parts;
        parts = part->next;
        forget_names(part);
        free_part(part);
    }
    return 0;
}

int host_output_commit(struct host_error *error) {
    sigset_t signals;
    hold(&signals);
    if (error->code == 0 && name_all(error) == 0)
        end_guard();
    while (parts != NULL)
        drop_part(parts);
    release(&signals);
    return error->code;
}

int host_output_sync(const char *path, struct host_error *error) {
    char above[HOST_PATH_MAX];
    struct stat about;
    const char *slash = strrchr(path, '/');
    (void)snprintf(above, sizeof above, "%.*s",
                   slash == NULL ? 1 : (int)(slash - path) + 1,
                   slash == NULL ? "." : path);
    if (stat(path, &about) != 0 || !S_ISREG(about.st_mode))
        return 0;
    const char *both[] = {path, above};
    for (int i = 0; i < 2 && error->code == 0; i++) {
        int file = open(both[i], O_RDONLY | O_CLOEXEC);
        if (file < 0 || (fsync(file) != 0 && errno != EINVAL))
            host_fail(error, HOST_INPUT,
                      "%s: may not be on the disk (%s); check the disk", path,
                      strerror(errno));
        if (file >= 0)
            (void)close(file);
    }
    return error->code;
}

int host_output_printed(struct host_error *error) {
    errno = 0;
    if (fflush(stdout) == 0 && ferror(stdout) == 0)
        return error->code;
    if (errno == 0) { /* an earlier write failed: one more says why */
        clearerr(stdout);
        (void)(putchar('\n') == EOF || fflush(stdout));
    }
    int reason = errno;
    if (reason == 0 && write(STDOUT_FILENO, "\n", 1) < 0)
        reason = errno; /* as an earlier write had it, of a longer text */
    __fpurge(stdout);   /* nor is it tried again */
    clearerr(stdout);
    return host_fail(error, HOST_INPUT, "standard output: %s; %s",
                     reason != 0 ? strerror(reason) : "writing failed",
                     reason == EPIPE   ? "let its reader read on"
                     : reason == EBADF ? "give an open one"
                                       : "make room and run again");
}
