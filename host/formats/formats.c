#include "formats.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* A row a format: host_format_NAME of some file of this room, in the order in
 * which they are listed.  "-" is the first that has the use. */
#define FORMATS(ROW)                                                           \
    ROW(xyz)                                                                   \
    ROW(pts)                                                                   \
    ROW(csv)                                                                   \
    ROW(node)                                                                  \
    ROW(ele)                                                                   \
    ROW(ply)                                                                   \
    ROW(off)                                                                   \
    ROW(obj)                                                                   \
    ROW(stl)                                                                   \
    ROW(las)                                                                   \
    ROW(laz)                                                                   \
    ROW(e57)                                                                   \
    ROW(vtu)                                                                   \
    ROW(vtk)                                                                   \
    ROW(vtp)                                                                   \
    ROW(vts)                                                                   \
    ROW(vtkhdf)                                                                \
    ROW(msh)                                                                   \
    ROW(mesh)                                                                  \
    ROW(npy)                                                                   \
    ROW(plot3d)

#define DECLARE(name) extern const struct host_format host_format_##name;
#define POINT(name) &host_format_##name,
FORMATS(DECLARE)
static const struct host_format *const formats[] = {FORMATS(POINT)};

const struct host_format *host_format_row(unsigned i) {
    return i < sizeof formats / sizeof formats[0] ? formats[i] : NULL;
}

static bool has_use(const struct host_format *format, enum host_use use) {
    switch (use) {
    case HOST_READ_POINTS:
        return format->read_points != NULL;
    case HOST_WRITE_POINTS:
        return format->write_points != NULL;
    case HOST_READ_TETRAHEDRA:
        return format->read_tetrahedra != NULL;
    default:
        return format->write_tetrahedra != NULL;
    }
}

static bool ends_in(const char *path, size_t length, const char *extension) {
    size_t n = strlen(extension);
    return length > n && strncasecmp(path + length - n, extension, n) == 0;
}

const struct host_format *host_format_named(const char *path) {
    size_t length = strlen(path) - (host_is_packed(path) ? strlen(".gz") : 0);
    const struct host_format *f;
    for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++) {
        for (unsigned k = 0; f->extensions[k] != NULL; k++)
            if (ends_in(path, length, f->extensions[k]))
                return f;
    }
    return NULL;
}

static const struct host_format *first_with(enum host_use use) {
    const struct host_format *f;
    for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++)
        if (has_use(f, use))
            break;
    return f;
}

const struct host_format *host_format_of(const char *path, enum host_use use) {
    bool written = use == HOST_WRITE_POINTS || use == HOST_WRITE_TETRAHEDRA;
    if (strcmp(path, "-") == 0)
        return first_with(use);
    const struct host_format *f = host_format_named(path);
    return f == NULL || !has_use(f, use) || (written && host_is_packed(path))
               ? NULL
               : f;
}

const struct host_format *host_format_recognised(const uint8_t *data,
                                                 size_t bytes) {
    const struct host_format *f;
    for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++)
        if (f->recognises != NULL && f->recognises(data, bytes))
            break;
    return f;
}

/* --- for people ----------------------------------------------------------- */

struct text {
    char *at;
    size_t room; /* with the end of the string */
};

static void add(struct text *text, const char *words) {
    int n = snprintf(text->at, text->room, "%s", words);
    size_t used = (size_t)n < text->room ? (size_t)n : text->room - 1;
    text->at += used;
    text->room -= used;
}

static void add_extensions(struct text *text, const struct host_format *f) {
    for (unsigned k = 0; f->extensions[k] != NULL; k++) {
        add(text, k == 0 ? "" : " ");
        add(text, f->extensions[k]);
    }
}

void host_format_list(enum host_use use, char *text, size_t size) {
    struct text list = {text, size};
    text[0] = '\0';
    const struct host_format *f;
    const char *between = "";
    for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++) {
        if (has_use(f, use)) {
            add(&list, between);
            add_extensions(&list, f);
            between = " ";
        }
    }
}

static void add_beside(struct text *text, const struct host_format *f) {
    for (unsigned k = 0; f->beside[k] != NULL; k++) {
        add(text, k == 0                     ? "; with "
                  : f->beside[k + 1] == NULL ? " and "
                                             : ", ");
        add(text, f->beside[k]);
    }
    add(text, f->beside[0] != NULL ? " beside it" : "");
}

void host_format_help(enum host_use use, char *text, size_t size) {
    struct text list = {text, size};
    text[0] = '\0';
    const struct host_format *f;
    const char *between = "";
    for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++) {
        if (!has_use(f, use))
            continue;
        add(&list, between);
        add_extensions(&list, f);
        add(&list, " (");
        add(&list, f->name);
        if (use == HOST_WRITE_TETRAHEDRA)
            add_beside(&list, f);
        add(&list, ")");
        between = ", ";
    }
}

const struct host_format *host_format_told(const char *name, enum host_use use,
                                           struct host_error *error) {
    char path[64], list[HOST_FORMAT_LIST_MAX];
    int n =
        snprintf(path, sizeof path, "a%s%s", name[0] == '.' ? "" : ".", name);
    bool whole = n > 0 && (size_t)n < sizeof path;
    const struct host_format *f = whole ? host_format_of(path, use) : NULL;
    const struct host_format *named = whole ? host_format_named(path) : NULL;
    if (f != NULL)
        return f;
    if (named != NULL && named->unread != NULL) {
        host_fail(error, HOST_USAGE, "--format %s: %s", name, named->unread);
        return NULL;
    }
    host_format_list(use, list, sizeof list);
    host_fail(error, HOST_USAGE, "--format %s: no such format; allowed: %s%s",
              name, list,
              use == HOST_READ_POINTS ? ", and any of them with .gz" : "");
    return NULL;
}
