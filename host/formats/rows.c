#include "rows.h"

#include <ctype.h>

#include "numbers.h"

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
