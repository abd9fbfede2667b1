#include "rows.h"

#include <ctype.h>
#include <limits.h>
#include <string.h>

#include "csv.h"
#include "numbers.h"

enum next { NEXT_FIELD, NEXT_EMPTY, NEXT_NONE };

/* Goes to the next field of the line; one with more than `most` delimiters
 * before it comes after an empty one. */
static enum next go_to_field(struct host_scan *s, unsigned most)
{
    const char *c = s->at;
    for (unsigned delimiters = 0; c < s->end; c++) {
        if (*c == ',' || *c == ';') {
            if (++delimiters > most) {
                s->at = c;
                return NEXT_EMPTY;
            }
        } else if (*c != ' ' && *c != '\t' && *c != '\r') {
            s->at = c;
            return *c == '\n' || *c == '#' ? NEXT_NONE : NEXT_FIELD;
        }
    }
    s->at = c;
    return NEXT_NONE;
}

static int wrong_columns(struct host_scan *s, int columns, enum next next,
                         struct host_error *error)
{
    static const char *const few[] = {
        "", "1 column where x, y and z are due; complete the line",
        "2 columns where x, y and z are due; complete the line"};
    return host_scan_fail(s, s->at, error,
                          next == NEXT_EMPTY ? HOST_CSV_EMPTY : few[columns]);
}

/* What stands between two numbers of a line, for the eye that looks for decimal
 * commas: those that are alone, before a digit. */
enum { COMMA_NONE = 1, COMMA_DECIMAL = 2 };

static unsigned commas_between(const char *from, const char *to)
{
    if (to - from == 1) {
        return *from != ','               ? COMMA_NONE
               : *to >= '0' && *to <= '9' ? COMMA_DECIMAL
                                          : 0;
    }
    return memchr(from, ',', (size_t)(to - from)) == NULL ? COMMA_NONE : 0;
}

int host_take_point(struct host_scan *s, bool is_csv,
                    struct host_points *points, struct host_error *error)
{
    double xyz[3];
    unsigned most = is_csv ? 1 : UINT_MAX, commas = 0;
    enum next next = NEXT_NONE;
    if (is_csv && host_csv_begins_empty(s)) {
        return wrong_columns(s, 0, NEXT_EMPTY, error);
    }
    for (int d = 0; d < 3; d++) {
        if (host_scan_double(s, &xyz[d], error) != 0) {
            return error->code;
        }
        const char *end = s->at;
        next = go_to_field(s, most);
        commas |= next == NEXT_FIELD ? commas_between(end, s->at) : 0;
        if (d < 2 && next != NEXT_FIELD) {
            return wrong_columns(s, d + 1, next, error);
        }
    }
    if (next != NEXT_NONE) {
        if (commas == (COMMA_NONE | COMMA_DECIMAL)) {
            return host_scan_fail(s, s->at, error,
                                  "more than 3 columns, parted by commas here "
                                  "and by something else there; write decimal "
                                  "points, or part all columns alike");
        }
        points->wide = true;
        host_scan_next_line(s);
    }
    return host_points_append(points, xyz, 1, error);
}

int host_take_element(struct host_mesh *mesh, const uint64_t number[4],
                      uint64_t base, const struct host_source *source,
                      const struct host_scan *s, struct host_error *error)
{
    uint64_t v[4];
    for (int k = 0; k < 4; k++) {
        v[k] = number[k] - base;
        if (number[k] < base || v[k] >= UINT32_MAX) {
            return host_scan_fail(s, s->at, error,
                                  "a vertex of this tetrahedron is no row of "
                                  "points; correct it");
        }
    }
    return mesh->tets == NULL
               ? 0
               : host_append_tetrahedron(mesh->tets, v, source, error);
}

int host_take_section_end(struct host_scan *s, struct host_error *error)
{
    return !host_scan_skip_blank_lines(s) || *s->at == '$' ||
                   isalpha((unsigned char)*s->at)
               ? 0
               : host_scan_fail(s, s->at, error,
                                "a row beyond the number that its section "
                                "begins with; correct that number, or remove "
                                "the row");
}

void host_put_line(struct host_output *out, const char *before, uint64_t number,
                   const char *after)
{
    host_output_text(out, before);
    host_output_unsigned(out, number);
    host_output_text(out, after);
}

void host_put_xyz(struct host_output *out, const double *xyz)
{
    for (int d = 0; d < 3; d++) {
        host_output_double(out, xyz[d] + 0.0);
        if (d < 2) {
            host_output_text(out, " ");
        }
    }
}

void host_put_row(struct host_output *out, const uint32_t *v, int n,
                  uint64_t base)
{
    for (int k = 0; k < n; k++) {
        host_output_text(out, " ");
        host_output_unsigned(out, v[k] + base);
    }
}

void host_put_points(struct host_output *out, const struct host_points *points,
                     const char *separator, bool numbered)
{
    for (uint64_t i = 0; i < points->count; i++) {
        if (numbered) {
            host_output_unsigned(out, i + points->base);
            host_output_text(out, separator);
        }
        for (uint64_t d = 0; d < 3; d++) {
            host_output_double(out, points->xyz[3 * i + d]);
            host_output_text(out, d < 2 ? separator : "\n");
        }
    }
}
