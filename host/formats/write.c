#include "write.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "formats.h"
#include "host/base/progress.h"

/* Reports that the extension of `path` names no format to write. */
static int refuse(const char *path, const char *what, enum host_use use,
                  struct host_error *error) {
    char list[HOST_FORMAT_LIST_MAX];
    struct stat status;
    size_t length = strlen(path);
    if ((length > 0 && path[length - 1] == '/') ||
        (stat(path, &status) == 0 && S_ISDIR(status.st_mode))) {
        return host_fail(error, HOST_USAGE,
                         "%s: it is a directory; name a file in it, by the "
                         "extension of its format",
                         path);
    }
    host_format_list(use, list, sizeof list);
    return host_fail(error, HOST_USAGE,
                     "%s: no format of %s to be written has this extension; "
                     "use %s, or -",
                     path, what, list);
}

int host_points_write_as(const char *path, const char *format,
                         const struct host_points *points,
                         struct host_error *error) {
    struct host_output out;
    const struct host_format *f =
        format == NULL ? host_format_of(path, HOST_WRITE_POINTS)
                       : host_format_told(format, HOST_WRITE_POINTS, error);
    if (f == NULL)
        return refuse(path, "points", HOST_WRITE_POINTS, error);
    host_progress_phase("writing", "MB");
    if (host_output_open(&out, path, error) == 0) {
        f->write_points(&out, points);
        host_output_close(&out, 1, error);
    }
    return error->code;
}

int host_points_write(const char *path, const struct host_points *points,
                      struct host_error *error) {
    return host_points_write_as(path, NULL, points, error);
}

int host_write_check(const char *path, struct host_error *error) {
    const struct host_format *f = host_format_of(path, HOST_WRITE_TETRAHEDRA);
    if (f == NULL)
        return refuse(path, "tetrahedra", HOST_WRITE_TETRAHEDRA, error);
    return f->check_output == NULL ? 0 : f->check_output(path, error);
}

/* The extension of file k of those that belong beside the output `path`; NULL:
 * there are not so many. */
static const char *beside(const char *path, unsigned k) {
    const struct host_format *format =
        host_format_of(path, HOST_WRITE_TETRAHEDRA);
    return format == NULL || strcmp(path, "-") == 0 || k >= HOST_BESIDE_MAX
               ? NULL
               : format->beside[k];
}

const char *host_write_file(const char *path, unsigned k, char *name,
                            size_t size) {
    size_t length = strlen(path);
    if (strcmp(path, "-") == 0 || length >= size)
        return NULL;
    if (k == 0)
        return path;
    const char *extension = beside(path, k - 1);
    const char *dot = strrchr(path, '.'); /* the format was known by it */
    if (extension == NULL || dot == NULL)
        return NULL;
    int n = snprintf(name, size, "%.*s%s", (int)(dot - path), path, extension);
    return n < 0 || (size_t)n >= size ? NULL : name;
}

bool host_write_leaves(const char *input, const char *name) {
    struct stat from, to;
    return input != NULL && strcmp(input, "-") != 0 && !host_is_packed(input) &&
           host_format_named(input) != NULL &&
           host_format_named(input) == host_format_named(name) &&
           stat(input, &from) == 0 && stat(name, &to) == 0 &&
           from.st_dev == to.st_dev && from.st_ino == to.st_ino;
}

void host_write_files(const char *const *path, unsigned count,
                      void (*act)(void *context, const char *file),
                      void *context) {
    char name[HOST_PATH_MAX];
    const char *file;
    for (unsigned i = 0; i < count; i++)
        for (unsigned k = 0;
             (file = host_write_file(path[i], k, name, sizeof name)) != NULL;
             k++)
            act(context, file);
}

int host_write_probe(const char *path, const char *input,
                     struct host_error *error) {
    char name[HOST_PATH_MAX];
    const char *file = path;
    for (unsigned k = 0; file != NULL && error->code == 0; k++) {
        file = k == 0 ? path : host_write_file(path, k, name, sizeof name);
        if (file != NULL && (k == 0 || !host_write_leaves(input, file)))
            host_output_probe(file, error);
    }
    return error->code;
}

int host_write(const char *path, const char *input,
               const struct host_points *points,
               const struct host_tetrahedra *tets, struct host_error *error) {
    struct host_output out[HOST_BESIDE_MAX + 1];
    char names[HOST_BESIDE_MAX][HOST_PATH_MAX];
    const struct host_format *format =
        host_format_of(path, HOST_WRITE_TETRAHEDRA);
    unsigned others = 0, opened = 0;
    if (format == NULL)
        return host_write_check(path, error);
    while (beside(path, others) != NULL)
        others++;
    host_progress_phase("writing", "MB");
    /* Itself comes last: where it is, those beside it are. */
    for (; opened <= others; opened++) {
        const char *file =
            opened == others ? path
                             : host_write_file(path, opened + 1, names[opened],
                                               sizeof names[opened]);
        if (file == NULL) {
            host_fail(error, HOST_INPUT, "%s: too long a name; shorten it",
                      path);
            break;
        }
        if (opened < others && host_write_leaves(input, file))
            out[opened] = (struct host_output){.path = file, .file = -1};
        else if (host_output_open(&out[opened], file, error) != 0)
            break;
    }
    if (error->code == 0) {
        format->write_tetrahedra(&out[others], others > 0 ? out : NULL, points,
                                 tets, error);
    }
    return host_output_close(out, opened, error);
}

/* --- blocks --------------------------------------------------------------- */

enum { COUNT_WIDTH = 12 }; /* of a number of tetrahedra */

bool host_rows_can(const char *path) {
    const struct host_format *f = host_format_of(path, HOST_WRITE_TETRAHEDRA);
    struct stat status;
    return f != NULL && f->rows != NULL && strcmp(path, "-") != 0 &&
           (stat(path, &status) != 0 || S_ISREG(status.st_mode));
}

int host_rows_open(struct host_row_output *rows, const char *path,
                   const struct host_points *points, struct host_error *error) {
    *rows = (struct host_row_output){
        .format = host_format_of(path, HOST_WRITE_TETRAHEDRA)};
    if (host_output_open(&rows->out, path, error) != 0)
        return error->code;
    rows->out.silent = true;
    rows->format->rows->head(&rows->out, points);
    rows->place = host_output_place(&rows->out);
    rows->format->rows->count(&rows->out, 0, COUNT_WIDTH);
    return 0;
}

void host_rows_put(struct host_row_output *rows, const uint32_t (*v)[4],
                   uint64_t count) {
    rows->format->rows->rows(&rows->out, v, count, rows->count);
    rows->count += count;
}

int host_rows_close(struct host_row_output *rows, struct host_error *error) {
    rows->format->rows->tail(&rows->out);
    host_output_return(&rows->out, rows->place);
    rows->format->rows->count(&rows->out, rows->count, COUNT_WIDTH);
    return host_output_close(&rows->out, 1, error);
}

/* --- target --------------------------------------------------------------- */

bool host_is_file(const struct stat *file, const char *name) {
    struct stat named;
    return lstat(name, &named) == 0 && named.st_dev == file->st_dev &&
           named.st_ino == file->st_ino;
}

/* The name without links of what the kernel has opened as `path`. */
static char *name_of(int opened, const char *path) {
    struct stat status;
    char *name = realpath(path, NULL); /* by hand: believed where it agrees */
    if (name != NULL &&
        (fstat(opened, &status) != 0 || !host_is_file(&status, name))) {
        free(name);
        errno = EAGAIN; /* the links have changed meanwhile */
        return NULL;
    }
    return name;
}

/* Of a link to where nothing is.  A file without any rights is nobody else's:
 * it was made here. */
static char *name_of_nothing(const char *path) {
    struct stat made;
    int file = open(path, O_WRONLY | O_CREAT | O_NONBLOCK | O_CLOEXEC, 0);
    if (file < 0)
        return NULL;
    char *name = name_of(file, path);
    int reason = errno;
    if (name != NULL && fstat(file, &made) == 0 && S_ISREG(made.st_mode) &&
        (made.st_mode & 0777) == 0 && made.st_size == 0)
        (void)unlink(name);
    (void)close(file);
    errno = reason;
    return name;
}

char *host_target(const char *path) {
    struct stat status;
    int file = open(path, O_PATH | O_CLOEXEC);
    if (file < 0 && errno == ENOENT) {
        return lstat(path, &status) == 0 ? name_of_nothing(path)
                                         : strdup(path); /* not there yet */
    }
    if (file < 0)
        return NULL;
    char *name = name_of(file, path);
    int reason = errno;
    (void)close(file);
    errno = reason;
    return name;
}

/* --- claims --------------------------------------------------------------- */

struct host_claim {
    const char *option, *path; /* as the user gave them */
    char *name;                /* of this file of theirs */
    char *target;              /* where that leads */
    struct stat status;        /* of the file, or of its directory */
    bool known, there, input;
};

static const char *last_name(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash == NULL ? path : slash + 1;
}

static bool is_standard(const struct host_claim *c) {
    return strcmp(c->name, "-") == 0;
}

/* False where nothing is at its name and no directory is there for it. */
static bool look(struct host_claim *c) {
    c->there = true;
    if (is_standard(c))
        return fstat(c->input ? STDIN_FILENO : STDOUT_FILENO, &c->status) == 0;
    if (stat(c->name, &c->status) == 0)
        return true;
    c->there = false;
    size_t length = (size_t)(last_name(c->target) - c->target);
    char *directory = length > 0 ? strndup(c->target, length) : strdup(".");
    bool found = directory != NULL && stat(directory, &c->status) == 0;
    free(directory);
    return found;
}

/* Devices, such as terminals, take what comes. */
static bool is_same(const struct host_claim *a, const struct host_claim *b) {
    if (!a->input && !b->input && is_standard(a) && is_standard(b))
        return true;
    if (!a->known || !b->known || a->there != b->there ||
        a->status.st_dev != b->status.st_dev ||
        a->status.st_ino != b->status.st_ino)
        return false;
    return a->there ? S_ISREG(a->status.st_mode) || S_ISFIFO(a->status.st_mode)
                    : strcmp(last_name(a->target), last_name(b->target)) == 0;
}

static int claims_refuse(const struct host_claim *c,
                         const struct host_claim *other,
                         struct host_error *error) {
    bool beside = strcmp(c->name, c->path) != 0;
    const char *what = other->input ? "would overwrite the input"
                       : strcmp(other->name, other->path) != 0
                           ? "is already written beside"
                           : "is already written for";
    return host_fail(error, HOST_USAGE, "%s%s: %s%s %s %s%s; give another name",
                     c->option, c->path,
                     is_standard(c) ? "standard output"
                     : beside       ? c->name
                                    : "it",
                     beside ? ", beside it," : "", what, other->option,
                     other->input && is_standard(other) ? "on standard input"
                                                        : other->path);
}

static int claim(struct host_claims *claims, struct host_claim new,
                 const char *name, struct host_error *error) {
    if (claims->count == claims->capacity) {
        unsigned capacity = 2 * claims->capacity + 8;
        void *grown = realloc(claims->claim, capacity * sizeof new);
        if (grown == NULL)
            return host_fail_memory(error, "the names of files");
        claims->claim = grown;
        claims->capacity = capacity;
    }
    struct host_claim *c = &claims->claim[claims->count];
    *c = new;
    claims->count++;
    c->name = strdup(name);
    c->target = c->input ? strdup(name) : host_target(name);
    if (c->target == NULL && errno != ENOMEM)
        c->target = strdup(name);
    if (c->name == NULL || c->target == NULL)
        return host_fail_memory(error, "the names of files");
    c->known = look(c); /* where it is not, opening it will tell why */
    for (struct host_claim *other = claims->claim; other < c; other++)
        if (!c->input && is_same(c, other))
            claims_refuse(c, other, error);
    return error->code;
}

int host_claims_read(struct host_claims *claims, const char *path,
                     struct host_error *error) {
    struct host_claim c = {.option = "", .path = path, .input = true};
    return claim(claims, c, path, error);
}

int host_claims_write(struct host_claims *claims, const char *option,
                      const char *path, const char *input,
                      struct host_error *error) {
    struct host_claim c = {.option = option, .path = path};
    char name[HOST_PATH_MAX];
    const char *file = path;
    for (unsigned k = 0; file != NULL && error->code == 0; k++) {
        file = k == 0 ? path : host_write_file(path, k, name, sizeof name);
        if (file != NULL && (k == 0 || !host_write_leaves(input, file)))
            claim(claims, c, file, error);
    }
    return error->code;
}

void host_claims_free(struct host_claims *claims) {
    for (unsigned i = 0; i < claims->count; i++) {
        free(claims->claim[i].name);
        free(claims->claim[i].target);
    }
    free(claims->claim);
    *claims = (struct host_claims){0};
}
