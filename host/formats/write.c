#include "write.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

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
    if (f == NULL) {
        return refuse(path, "points", HOST_WRITE_POINTS, error);
    }
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
    return host_format_of(path, HOST_WRITE_TETRAHEDRA) != NULL
               ? 0
               : refuse(path, "tetrahedra", HOST_WRITE_TETRAHEDRA, error);
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
    if (strcmp(path, "-") == 0 || length >= size) {
        return NULL;
    }
    if (k == 0) {
        return path;
    }
    const char *extension = beside(path, k - 1);
    const char *dot = strrchr(path, '.'); /* the format was known by it */
    if (extension == NULL || dot == NULL) {
        return NULL;
    }
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

int host_write_probe(const char *path, const char *input,
                     struct host_error *error) {
    char name[HOST_PATH_MAX];
    const char *file = path;
    for (unsigned k = 0; file != NULL && error->code == 0; k++) {
        file = k == 0 ? path : host_write_file(path, k, name, sizeof name);
        if (file != NULL && (k == 0 || !host_write_leaves(input, file))) {
            host_output_probe(file, error);
        }
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
    if (format == NULL) {
        return host_write_check(path, error);
    }
    while (beside(path, others) != NULL) {
        others++;
    }
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
        if (opened < others && host_write_leaves(input, file)) {
            out[opened] = (struct host_output){.path = file, .file = -1};
        } else if (host_output_open(&out[opened], file, error) != 0) {
            break;
        }
    }
    if (error->code == 0) {
        format->write_tetrahedra(&out[others], others > 0 ? out : NULL, points,
                                 tets, error);
    }
    return host_output_close(out, opened, error);
}
