/* Wavefront's .obj, as text: its vertices (v) are the points, whatever follows
 * x, y and z; all other lines are passed over.  A backslash at the end of a
 * line joins the next one to it. */
#include <string.h>

#include "format.h"
#include "scan.h"

/* Whether the line goes on behind the backslash at hand; goes there if so. */
static bool take_continuation(struct host_scan *s) {
    const char *c = s->at;
    if (c == s->end || *c != '\\')
        return false;
    c++;
    c += c < s->end && *c == '\r';
    if (c < s->end && *c != '\n')
        return false;
    s->at = c < s->end ? c + 1 : c;
    return true;
}

static int take_number(struct host_scan *s, double *value,
                       struct host_error *error) {
    while (host_scan_more(s) && take_continuation(s)) {
    }
    struct host_scan word = *s; /* a backslash may end it */
    const char *c = s->at;
    while (c < s->end && strchr(" \t\r\n,;#\\", *c) == NULL)
        c++;
    word.end = c;
    if (word.at == c)
        word.end = s->end;
    if (host_scan_double(&word, value, error) != 0)
        return error->code;
    s->at = word.at;
    return 0;
}

/* What is left of the line, and of those that continue it.  A comment, which
 * may well end in the name of a folder, is not continued. */
static void pass_line(struct host_scan *s) {
    const char *begin, *c;
    do {
        begin = s->at;
        host_scan_next_line(s);
        c = s->at;
        c -= c > begin && c[-1] == '\n';
        c -= c > begin && c[-1] == '\r';
    } while (s->at < s->end && c > begin && c[-1] == '\\' &&
             memchr(begin, '#', (size_t)(c - begin)) == NULL);
}

static int read_obj(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct host_scan s = host_scan_source(source);
    while (host_scan_skip_blank_lines(&s)) {
        double xyz[3];
        if (host_scan_take(&s, "v") &&
            (take_number(&s, &xyz[0], error) != 0 ||
             take_number(&s, &xyz[1], error) != 0 ||
             take_number(&s, &xyz[2], error) != 0 ||
             host_points_append(mesh->points, xyz, 1, error) != 0))
            return error->code;
        pass_line(&s);
    }
    return 0;
}

const struct host_format host_format_obj = {
    .name = "Wavefront",
    .extensions = {".obj"},
    .read_points = read_obj,
    .pieces = true,
};
