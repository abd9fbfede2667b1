/* Stanford's .ply, text or binary in either byte order. */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "format.h"
#include "rows.h"
#include "scan.h"

enum { PROPERTIES_MAX = 64, ELEMENTS_MAX = 16 };

struct property {
    enum host_number type;
    enum host_number count; /* of a list; HOST_NO_NUMBER otherwise */
};

struct element {
    uint64_t rows;
    bool vertex;
    int properties;
    struct property property[PROPERTIES_MAX];
    int axis[3]; /* properties x, y, z of the vertices, or -1 */
};

enum coding { TEXT, LITTLE, BIG, UNKNOWN };

struct ply {
    const struct host_source *source;
    enum coding coding;
    int elements;
    struct element element[ELEMENTS_MAX];
    struct host_scan scan; /* of the header, then of text */
    const uint8_t *at, *end;
};

static int damaged(struct ply *ply, struct host_error *error,
                   const char *what) {
    return host_scan_fail(&ply->scan, ply->scan.at, error, what);
}

static int header_property(struct ply *ply, struct host_error *error) {
    if (ply->elements == 0) {
        return damaged(ply, error,
                       "a property before any element; correct "
                       "the header");
    }
    struct element *e = &ply->element[ply->elements - 1];
    struct property p = {HOST_NO_NUMBER, HOST_NO_NUMBER};
    char word[64];
    host_scan_word(&ply->scan, word, sizeof word);
    if (strcmp(word, "list") == 0) {
        host_scan_word(&ply->scan, word, sizeof word);
        p.count = host_number_named(word);
        host_scan_word(&ply->scan, word, sizeof word);
        if (p.count == HOST_NO_NUMBER)
            return damaged(ply, error, "an unknown type; correct the header");
    }
    p.type = host_number_named(word);
    if (p.type == HOST_NO_NUMBER || e->properties == PROPERTIES_MAX) {
        return damaged(ply, error,
                       "an unknown type, or more than 64 properties; correct "
                       "the header");
    }
    host_scan_word(&ply->scan, word, sizeof word);
    for (int d = 0; d < 3; d++)
        if (word[0] == "xyz"[d] && word[1] == '\0' && p.count == HOST_NO_NUMBER)
            e->axis[d] = e->properties;
    e->property[e->properties++] = p;
    return 0;
}

static int header_element(struct ply *ply, struct host_error *error) {
    if (ply->elements == ELEMENTS_MAX)
        return damaged(ply, error, "more than 16 elements; remove some");
    struct element *e = &ply->element[ply->elements++];
    *e = (struct element){.axis = {-1, -1, -1}};
    char word[64];
    host_scan_word(&ply->scan, word, sizeof word);
    e->vertex = strcmp(word, "vertex") == 0;
    return host_scan_unsigned(&ply->scan, UINT32_MAX - 1, &e->rows, error);
}

static int header_format(struct ply *ply, struct host_error *error) {
    char word[64];
    host_scan_word(&ply->scan, word, sizeof word);
    ply->coding = strcmp(word, "ascii") == 0                  ? TEXT
                  : strcmp(word, "binary_little_endian") == 0 ? LITTLE
                  : strcmp(word, "binary_big_endian") == 0    ? BIG
                                                              : UNKNOWN;
    return ply->coding == UNKNOWN
               ? damaged(ply, error,
                         "the format is neither ascii nor binary; correct the "
                         "header")
               : 0;
}

static int read_header(struct ply *ply, struct host_error *error) {
    if (!host_scan_take(&ply->scan, "ply")) {
        return damaged(ply, error,
                       "the first line is not 'ply'; give a PLY file");
    }
    for (;;) {
        host_scan_next_line(&ply->scan);
        if (ply->scan.at == ply->scan.end) {
            return damaged(ply, error,
                           "the header has no end_header; get the file whole");
        }
        if (host_scan_take(&ply->scan, "end_header")) {
            if (ply->coding != TEXT) /* the rest has no lines */
                ply->scan.source = NULL;
            host_scan_next_line(&ply->scan);
            break;
        }
        int code =
            host_scan_take(&ply->scan, "format")    ? header_format(ply, error)
            : host_scan_take(&ply->scan, "element") ? header_element(ply, error)
            : host_scan_take(&ply->scan, "property")
                ? header_property(ply, error)
                : 0;
        if (code != 0)
            return code;
    }
    ply->at = (const uint8_t *)ply->scan.at;
    ply->end = (const uint8_t *)ply->scan.end;
    return ply->coding == UNKNOWN
               ? damaged(ply, error, "the header has no format line; add one")
               : 0;
}

static int cut_short(struct ply *ply, struct host_error *error, uint64_t row) {
    return host_fail(error, HOST_INPUT,
                     "%s: the file ends in row %llu of an element; it is cut "
                     "short, get it whole",
                     ply->source->path, (unsigned long long)row);
}

/* One number of a row, from text or bytes. */
static int take_number(struct ply *ply, enum host_number type, uint64_t row,
                       double *value, struct host_error *error) {
    if (ply->coding == TEXT)
        return host_scan_double_anywhere(&ply->scan, value, error);
    size_t bytes = host_number_bytes(type);
    while ((size_t)(ply->end - ply->at) < bytes)
        if (!host_source_more(ply->source, &ply->at, &ply->end))
            return cut_short(ply, error, row);
    *value = host_number_at(ply->at, type, ply->coding == BIG);
    ply->at += bytes;
    return 0;
}

static int take_list(struct ply *ply, const struct property *p, uint64_t row,
                     struct host_error *error) {
    double count = 0, skipped;
    if (take_number(ply, p->count, row, &count, error) != 0)
        return error->code;
    if (!(count >= 0 && count < 0x1p32 && count == floor(count))) {
        static const char what[] =
            "a list of impossible length; correct the header's numbers of "
            "rows, or get the file again";
        return ply->coding == TEXT ? damaged(ply, error, what)
                                   : host_source_fail(ply->source, error, what);
    }
    for (uint64_t i = (uint64_t)count; i > 0; i--)
        if (take_number(ply, p->type, row, &skipped, error) != 0)
            return error->code;
    return 0;
}

static int read_element(struct ply *ply, const struct element *e,
                        struct host_points *points, struct host_error *error) {
    for (uint64_t row = 0; row < e->rows && e->properties > 0; row++) {
        double value[PROPERTIES_MAX] = {0};
        for (int i = 0; i < e->properties; i++) {
            const struct property *p = &e->property[i];
            int code = p->count != HOST_NO_NUMBER
                           ? take_list(ply, p, row, error)
                           : take_number(ply, p->type, row, &value[i], error);
            if (code != 0)
                return code;
        }
        if (ply->coding == TEXT && host_scan_more(&ply->scan)) {
            return damaged(ply, error,
                           "a number beyond those that the header gives this "
                           "row; correct the header's properties and numbers "
                           "of rows");
        }
        if (e->vertex) {
            double xyz[3] = {value[e->axis[0]], value[e->axis[1]],
                             value[e->axis[2]]};
            if (host_points_append(points, xyz, 1, error) != 0)
                return error->code;
        }
    }
    return 0;
}

/* Nothing but white space may follow the last element. */
static int check_end(struct ply *ply, struct host_error *error) {
    static const char what[] = "more follows than the rows that the header "
                               "gives; correct its numbers of rows";
    if (ply->coding == TEXT)
        return host_scan_end(&ply->scan, error, what);
    do {
        while (ply->at < ply->end && isspace(*ply->at))
            ply->at++;
    } while (ply->at == ply->end &&
             host_source_more(ply->source, &ply->at, &ply->end));
    return ply->at == ply->end ? 0 : host_source_fail(ply->source, error, what);
}

static int read_ply(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct ply ply = {
        .source = source, .coding = UNKNOWN, .scan = host_scan_source(source)};
    if (read_header(&ply, error) != 0)
        return error->code;
    bool any = false;
    for (int i = 0; i < ply.elements; i++) {
        const struct element *e = &ply.element[i];
        if (e->vertex && (e->axis[0] < 0 || e->axis[1] < 0 || e->axis[2] < 0)) {
            return host_source_fail(source, error,
                                    "the vertices have not all of x, y and z; "
                                    "correct the header");
        }
        if (read_element(&ply, e, mesh->points, error) != 0)
            return error->code;
        any = any || e->vertex;
    }
    return any ? check_end(&ply, error)
               : host_source_fail(source, error,
                                  "there is no element 'vertex'; give points");
}

static void write_ply(struct host_output *out,
                      const struct host_points *points) {
    host_put_line(out, "ply\nformat binary_little_endian 1.0\nelement vertex ",
                  points->count,
                  "\nproperty double x\nproperty double y\n"
                  "property double z\nend_header\n");
    for (uint64_t i = 0; i < 3 * points->count; i++)
        host_put_double(out, points->xyz[i], false);
}

const struct host_format host_format_ply = {
    .name = "Stanford",
    .extensions = {".ply"},
    .read_points = read_ply,
    .pieces = true,
    .write_points = write_ply,
};
