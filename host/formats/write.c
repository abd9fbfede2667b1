#include "write.h"

#include <stdio.h>
#include <string.h>

#include "formats.h"

int host_points_write(const char *path, const struct host_points *points,
                      struct host_error *error)
{
    struct host_output out;
    char list[HOST_FORMAT_LIST_MAX];
    const struct host_format *format = host_format_of(path, HOST_WRITE_POINTS);
    if (format == NULL) {
        host_format_list(HOST_WRITE_POINTS, list, sizeof list);
        return host_fail(error, HOST_USAGE,
                         "%s: no format of points to be written has this "
                         "extension; use %s, or -",
                         path, list);
    }
    if (host_output_open(&out, path, error) == 0) {
        format->write_points(&out, points);
        host_output_close(&out, 1, error);
    }
    return error->code;
}

int host_write_check(const char *path, struct host_error *error)
{
    char list[HOST_FORMAT_LIST_MAX];
    if (host_format_of(path, HOST_WRITE_TETRAHEDRA) != NULL) {
        return 0;
    }
    host_format_list(HOST_WRITE_TETRAHEDRA, list, sizeof list);
    return host_fail(error, HOST_USAGE,
                     "%s: no format of tetrahedra to be written has this "
                     "extension; use %s, or -",
                     path, list);
}

/* The extensions of the files that belong to the output `path`. */
static const char *const *beside_of(const char *path)
{
    static const char *const none[] = {NULL};
    const struct host_format *format =
        host_format_of(path, HOST_WRITE_TETRAHEDRA);
    return format == NULL || strcmp(path, "-") == 0 ? none : format->beside;
}

static unsigned count_of(const char *const *names)
{
    unsigned count = 0;
    while (names[count] != NULL) {
        count++;
    }
    return count;
}

const char *host_write_file(const char *path, unsigned k, char *name,
                            size_t size)
{
    const char *const *beside = beside_of(path);
    size_t length = strlen(path);
    if (strcmp(path, "-") == 0 || length + 8 > size || k > count_of(beside)) {
        return NULL;
    }
    if (k == 0) {
        return path;
    }
    const char *dot = strrchr(path, '.'); /* the format was known by it */
    (void)snprintf(name, size, "%.*s%s", (int)(dot - path), path,
                   beside[k - 1]);
    return name;
}

int host_write_probe(const char *path, struct host_error *error)
{
    char name[HOST_PATH_MAX];
    const char *file = path;
    for (unsigned k = 0; file != NULL && error->code == 0; k++) {
        file = k == 0 ? path : host_write_file(path, k, name, sizeof name);
        if (file != NULL) {
            host_output_probe(file, error);
        }
    }
    return error->code;
}

int host_write(const char *path, const struct host_points *points,
               const struct host_tetrahedra *tets, struct host_error *error)
{
    struct host_output out[HOST_BESIDE_MAX + 1];
    char names[HOST_BESIDE_MAX][HOST_PATH_MAX];
    const struct host_format *format =
        host_format_of(path, HOST_WRITE_TETRAHEDRA);
    unsigned beside = count_of(beside_of(path)), opened = 0;
    if (format == NULL) {
        return host_write_check(path, error);
    }
    /* Itself comes last: where it is, those beside it are. */
    for (; opened <= beside; opened++) {
        const char *file =
            opened == beside ? path
                             : host_write_file(path, opened + 1, names[opened],
                                               sizeof names[opened]);
        if (file == NULL) {
            host_fail(error, HOST_INPUT, "%s: too long a name; shorten it",
                      path);
            break;
        }
        if (host_output_open(&out[opened], file, error) != 0) {
            break;
        }
    }
    if (error->code == 0) {
        format->write_tetrahedra(&out[beside], beside > 0 ? out : NULL, points,
                                 tets, error);
    }
    return host_output_close(out, opened, error);
}
