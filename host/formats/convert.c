#include "convert.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "write.h"
#include "formats.h"
#include "host/formats/output.h"
#include "read.h"

/* Whether `out` leaves `in`, which is read, as it is. */
static int check_claims(const char *in, const char *out,
                        struct host_error *error) {
    struct host_claims claims = {0};
    host_claims_read(&claims, in, error);
    host_claims_write(&claims, "", out, NULL, error);
    host_claims_free(&claims);
    return error->code;
}

/* The extension of the file beside `path` that holds its points.  A format that
 * makes none has its points where that of standard input has them. */
static const char *points_extension(const char *path) {
    const struct host_format *f = host_format_named(path);
    if (f == NULL || f->beside[0] == NULL)
        f = host_format_of("-", HOST_READ_TETRAHEDRA);
    return f->beside[0];
}

/* The points of a file of tetrahedra that holds none: from the one beside it,
 * packed or not. */
static int points_beside(const char *in, const char *out,
                         struct host_points *points, struct host_error *error) {
    const char *extension = points_extension(in);
    size_t n = strlen(in) - (host_is_packed(in) ? strlen(".gz") : 0);
    size_t more = strlen(extension);
    char *name = malloc(n + more + sizeof ".gz");
    if (name == NULL)
        return host_fail_memory(error, "a name");
    memcpy(name, in, n);
    name[n] = '\0';
    char *end = strrchr(name, '.'); /* the format was known by it */
    end = end == NULL ? name + n : end;
    strcpy(end, extension);
    if (access(name, R_OK) != 0)
        strcpy(end + more, ".gz");
    if (access(name, R_OK) != 0) {
        end[more] = '\0';
        host_fail(error, HOST_INPUT,
                  "%s: it holds no points and there is no %s; put the points "
                  "there",
                  in, name);
    } else if (check_claims(name, out, error) == 0) {
        host_points_read(name, points, error);
    }
    free(name);
    return error->code;
}

/* Whether writing it takes no points: a file of rows with none beside it. */
static bool holds_rows_only(const char *path) {
    const struct host_format *f = host_format_named(path);
    return strcmp(path, "-") == 0 ||
           (f != NULL && f->rows_only && f->beside[0] == NULL);
}

static int convert_tetrahedra(const char *in, const char *out,
                              struct host_error *error) {
    struct host_tetrahedra tets;
    struct host_points points;
    if (host_tetrahedra_read(in, &tets, &points, error) != 0)
        return error->code;
    bool needed = !holds_rows_only(out);
    if (needed && points.count == 0)
        points_beside(in, out, &points, error);
    if (error->code == 0 &&
        (!needed || host_rows_check(in, &tets, &points, error) == 0)) {
        host_tetrahedra_sort(&tets);
        host_write(out, NULL, &points, &tets, error);
    }
    host_tetrahedra_free(&tets);
    host_points_free(&points);
    return error->code;
}

/* Formats that hold nothing but tetrahedra, on either side, decide. */
static bool holds_tetrahedra(const char *path) {
    const struct host_format *f = host_format_named(path);
    return f != NULL && f->read_points == NULL && f->write_points == NULL;
}

static bool takes_tetrahedra(const char *path) {
    const struct host_format *f = host_format_named(path);
    return f != NULL && f->write_points == NULL && f->write_tetrahedra != NULL;
}

/* Others may hold either. */
static bool has_tetrahedra(const char *path) {
    const struct host_format *f = host_format_named(path);
    if (f == NULL || f->read_tetrahedra == NULL)
        return false;
    struct host_tetrahedra tets;
    struct host_error error = {0};
    bool any =
        host_tetrahedra_read(path, &tets, NULL, &error) == 0 && tets.count > 0;
    host_tetrahedra_free(&tets);
    return any;
}

static int convert(const char *in, const char *format, const char *out,
                   struct host_error *error) {
    const struct host_format *to = host_format_named(out);
    bool either =
        to != NULL && to->write_points != NULL && to->write_tetrahedra != NULL;
    if (check_claims(in, out, error) != 0)
        return error->code;
    if (format == NULL && (holds_tetrahedra(in) || takes_tetrahedra(out) ||
                           (either && has_tetrahedra(in))))
        return convert_tetrahedra(in, out, error);
    struct host_points points;
    if (host_points_read_as(in, format, &points, error) == 0) {
        host_points_note(in, &points);
        host_points_write(out, &points, error);
        host_points_free(&points);
    }
    return error->code;
}

int host_convert(const char *in, const char *format, const char *out,
                 struct host_error *error) {
    (void)convert(in, format, out, error);
    return host_output_commit(error);
}
