#include "claims.h"

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/formats/target.h"
#include "write.h"

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
    if (is_standard(c)) {
        return fstat(c->input ? STDIN_FILENO : STDOUT_FILENO, &c->status) == 0;
    }
    if (stat(c->name, &c->status) == 0) {
        return true;
    }
    c->there = false;
    size_t length = (size_t)(last_name(c->target) - c->target);
    char *directory = length > 0 ? strndup(c->target, length) : strdup(".");
    bool found = directory != NULL && stat(directory, &c->status) == 0;
    free(directory);
    return found;
}

/* Devices, such as terminals, take what comes. */
static bool is_same(const struct host_claim *a, const struct host_claim *b) {
    if (!a->input && !b->input && is_standard(a) && is_standard(b)) {
        return true;
    }
    if (!a->known || !b->known || a->there != b->there ||
        a->status.st_dev != b->status.st_dev ||
        a->status.st_ino != b->status.st_ino) {
        return false;
    }
    return a->there ? S_ISREG(a->status.st_mode) || S_ISFIFO(a->status.st_mode)
                    : strcmp(last_name(a->target), last_name(b->target)) == 0;
}

static int refuse(const struct host_claim *c, const struct host_claim *other,
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
        if (grown == NULL) {
            return host_fail_memory(error, "the names of files");
        }
        claims->claim = grown;
        claims->capacity = capacity;
    }
    struct host_claim *c = &claims->claim[claims->count];
    *c = new;
    claims->count++;
    c->name = strdup(name);
    c->target = c->input ? strdup(name) : host_target(name);
    if (c->target == NULL && errno != ENOMEM) {
        c->target = strdup(name);
    }
    if (c->name == NULL || c->target == NULL) {
        return host_fail_memory(error, "the names of files");
    }
    c->known = look(c); /* where it is not, opening it will tell why */
    for (struct host_claim *other = claims->claim; other < c; other++) {
        if (!c->input && is_same(c, other)) {
            refuse(c, other, error);
        }
    }
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
        if (file != NULL && (k == 0 || !host_write_leaves(input, file))) {
            claim(claims, c, file, error);
        }
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
