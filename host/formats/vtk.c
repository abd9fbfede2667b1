/* VTK's legacy files, text or binary (big-endian), all kinds of data set that
 * have points. */
#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "format.h"
#include "host/base/memory.h"
#include "rows.h"
#include "scan.h"
#include "read.h"

enum { ROW = 256 }; /* points of a grid appended at once */

/* Points that a few words may imply: a damaged file shall not fill memory. */
static const uint64_t grid_max = UINT64_C(1) << 22;

struct vtk {
    const struct host_source *source;
    struct host_mesh *mesh;
    struct host_scan scan;
    bool binary, points_done, cells_done;
    uint64_t dimension[3];
    double origin[3], spacing[3];
    bool is_image, has_dimension;
    double *axis[3]; /* of a rectilinear grid */
    uint64_t axis_count[3];
    uint64_t cells;
    bool has_offsets, has_connectivity, has_types;
    struct host_stream offsets, connectivity, types;
};

static int damaged(struct vtk *vtk, struct host_error *error,
                   const char *what) {
    return host_scan_fail(&vtk->scan, vtk->scan.at, error, what);
}

static int take_type(struct vtk *vtk, enum host_number *type,
                     struct host_error *error) {
    char word[64];
    host_scan_word(&vtk->scan, word, sizeof word);
    *type = host_number_named(word);
    return *type == HOST_NO_NUMBER
               ? damaged(vtk, error,
                         "an unknown type of number; use float or double")
               : 0;
}

/* The numbers that begin on the next line. */
static struct host_stream open_stream(struct vtk *vtk, enum host_number type) {
    host_scan_next_line(&vtk->scan);
    return (struct host_stream){.source = vtk->source,
                                .text = !vtk->binary,
                                .big = true,
                                .type = type,
                                .scan = vtk->scan,
                                .at = (const uint8_t *)vtk->scan.at,
                                .end = (const uint8_t *)vtk->scan.end};
}

static void close_stream(struct vtk *vtk, const struct host_stream *s) {
    vtk->scan.at = s->text ? s->scan.at : (const char *)s->at;
}

static int skip_numbers(struct vtk *vtk, enum host_number type, uint64_t count,
                        struct host_stream *start, struct host_error *error) {
    struct host_stream s = open_stream(vtk, type);
    if (start != NULL)
        *start = s;
    if (host_stream_skip(&s, count, error) == 0)
        close_stream(vtk, &s);
    return error->code;
}

static int take_three(struct vtk *vtk, double v[3], struct host_error *error) {
    for (int d = 0; d < 3; d++)
        if (host_scan_double(&vtk->scan, &v[d], error) != 0)
            return error->code;
    return 0;
}

static int take_dimensions(struct vtk *vtk, struct host_error *error) {
    for (int d = 0; d < 3; d++)
        if (host_scan_unsigned(&vtk->scan, UINT32_MAX - 1, &vtk->dimension[d],
                               error) != 0)
            return error->code;
    vtk->has_dimension = true;
    return 0;
}

/* What follows numbers is a keyword, or the file's end. */
static int check_keyword(struct vtk *vtk, struct host_error *error) {
    if (!host_scan_skip_blank_lines(&vtk->scan))
        return 0;
    const char *c = vtk->scan.at;
    while (c < vtk->scan.end && (isalpha((unsigned char)*c) || *c == '_'))
        c++;
    return c - vtk->scan.at >= 4 &&
                   (c == vtk->scan.end || isspace((unsigned char)*c))
               ? 0
               : damaged(vtk, error,
                         "a keyword is due after so many points; correct "
                         "their number");
}

static int take_points(struct vtk *vtk, struct host_error *error) {
    uint64_t count;
    enum host_number type;
    if (host_scan_unsigned(&vtk->scan, UINT32_MAX - 1, &count, error) != 0 ||
        take_type(vtk, &type, error) != 0)
        return error->code;
    struct host_stream s = open_stream(vtk, type);
    int code = vtk->mesh->points != NULL
                   ? host_stream_points(&s, count, vtk->mesh->points, error)
                   : host_stream_skip(&s, 3 * count, error);
    if (code == 0) {
        close_stream(vtk, &s);
        vtk->points_done = true;
        code = check_keyword(vtk, error);
    }
    return code;
}

static int take_axis(struct vtk *vtk, int d, struct host_error *error) {
    uint64_t count;
    enum host_number type;
    if (host_scan_unsigned(&vtk->scan, vtk->source->bytes, &count, error) !=
            0 ||
        take_type(vtk, &type, error) != 0)
        return error->code;
    if (vtk->axis[d] != NULL)
        return damaged(vtk, error, "an axis is there twice; remove one");
    vtk->axis_count[d] = count;
    vtk->axis[d] = host_map((size_t)count * sizeof(double));
    if (vtk->axis[d] == NULL)
        return host_fail_memory(error, "an axis of the grid");
    struct host_stream s = open_stream(vtk, type);
    for (uint64_t i = 0; i < count; i++)
        if (host_stream_next(&s, &vtk->axis[d][i], error) != 0)
            return error->code;
    close_stream(vtk, &s);
    return 0;
}

/* The places of a grid along one axis, as they are or made from its spacing. */
static int fill_axis(struct vtk *vtk, int d, uint64_t count,
                     struct host_error *error) {
    if (vtk->axis[d] != NULL)
        return 0;
    vtk->axis_count[d] = count;
    vtk->axis[d] = host_map((size_t)count * sizeof(double));
    if (vtk->axis[d] == NULL)
        return host_fail_memory(error, "an axis of the grid");
    for (uint64_t i = 0; i < count; i++)
        vtk->axis[d][i] = vtk->origin[d] + (double)i * vtk->spacing[d];
    return 0;
}

static int append_grid(struct vtk *vtk, const uint64_t n[3],
                       struct host_error *error) {
    uint64_t points = n[0];
    for (int d = 1; d < 3 && points != 0; d++)
        points = n[d] > grid_max / points ? grid_max + 1 : points * n[d];
    if (points == 0 || points > grid_max) {
        return damaged(vtk, error,
                       "the grid has no point or more than 2^22; correct its "
                       "dimensions, or list the points");
    }
    for (int d = 0; d < 3; d++)
        if (fill_axis(vtk, d, n[d], error) != 0)
            return error->code;
    double row[3 * ROW];
    for (uint64_t yz = 0; yz < n[1] * n[2]; yz++) {
        double y = vtk->axis[1][yz % n[1]], z = vtk->axis[2][yz / n[1]];
        for (uint64_t x = 0; x < n[0]; x += ROW) {
            uint64_t count = n[0] - x < ROW ? n[0] - x : ROW;
            for (uint64_t i = 0; i < count; i++) {
                row[3 * i] = vtk->axis[0][x + i];
                row[3 * i + 1] = y;
                row[3 * i + 2] = z;
            }
            if (host_points_append(vtk->mesh->points, row, count, error) != 0)
                return error->code;
        }
    }
    return 0;
}

/* Points of data sets that do not list them. */
static int implied_points(struct vtk *vtk, struct host_error *error) {
    if (vtk->axis[0] != NULL && vtk->axis[1] != NULL && vtk->axis[2] != NULL) {
        uint64_t n[3] = {vtk->axis_count[0], vtk->axis_count[1],
                         vtk->axis_count[2]};
        return append_grid(vtk, n, error);
    }
    if (vtk->is_image && vtk->has_dimension) {
        for (int d = 0; d < 3; d++) { /* a damaged file may have some */
            host_unmap(vtk->axis[d],
                       (size_t)vtk->axis_count[d] * sizeof(double));
            vtk->axis[d] = NULL;
        }
        return append_grid(vtk, vtk->dimension, error);
    }
    return host_source_fail(vtk->source, error,
                            "the data set has no points; give one with "
                            "POINTS, or a grid");
}

static int take_cells(struct vtk *vtk, struct host_error *error) {
    uint64_t count, size;
    enum host_number type = HOST_I32;
    if (host_scan_unsigned(&vtk->scan, UINT64_MAX / 64, &count, error) != 0 ||
        host_scan_unsigned(&vtk->scan, UINT64_MAX / 64, &size, error) != 0)
        return error->code;
    struct host_scan ahead = vtk->scan;
    host_scan_next_line(&ahead);
    if (!host_scan_take(&ahead, "OFFSETS")) { /* before version 5 */
        vtk->cells = count;
        vtk->has_connectivity = true;
        return skip_numbers(vtk, type, size, &vtk->connectivity, error);
    }
    vtk->scan = ahead;
    vtk->cells = count > 0 ? count - 1 : 0;
    vtk->has_offsets = true;
    if (take_type(vtk, &type, error) != 0 ||
        skip_numbers(vtk, type, count, &vtk->offsets, error) != 0)
        return error->code;
    if (!host_scan_skip_blank_lines(&vtk->scan) ||
        !host_scan_take(&vtk->scan, "CONNECTIVITY"))
        return damaged(vtk, error, "CONNECTIVITY is due here; correct it");
    vtk->has_connectivity = true;
    return take_type(vtk, &type, error) != 0
               ? error->code
               : skip_numbers(vtk, type, size, &vtk->connectivity, error);
}

static int take_cell_types(struct vtk *vtk, struct host_error *error) {
    uint64_t count;
    if (host_scan_unsigned(&vtk->scan, UINT64_MAX / 64, &count, error) != 0)
        return error->code;
    if (!vtk->has_connectivity || count != vtk->cells) {
        return damaged(vtk, error,
                       "cells and their types are not equally many; correct "
                       "the file");
    }
    vtk->has_types = true;
    return skip_numbers(vtk, HOST_I32, count, &vtk->types, error);
}

static int append_cells(struct vtk *vtk, struct host_error *error) {
    if (!vtk->has_types) {
        return host_source_fail(vtk->source, error,
                                "there are no cells; give an unstructured "
                                "grid of tetrahedra");
    }
    uint64_t zero;
    if (vtk->has_offsets && vtk->cells > 0 &&
        host_stream_whole(&vtk->offsets, &zero, error) != 0)
        return error->code;
    return host_stream_cells(
        &vtk->connectivity, vtk->has_offsets ? &vtk->offsets : NULL,
        &vtk->types, vtk->cells, 0, vtk->mesh->tets, error);
}

/* VERTICES and the like (only counted past), FIELD arrays, METADATA. */
static int skip_section(struct vtk *vtk, const char *word,
                        struct host_error *error) {
    uint64_t count, size, tuples;
    enum host_number type;
    if (strcasecmp(word, "FIELD") == 0) {
        char name[64];
        host_scan_word(&vtk->scan, name, sizeof name);
        if (host_scan_unsigned(&vtk->scan, 65536, &count, error) != 0)
            return error->code;
        for (; count > 0; count--) {
            if (!host_scan_skip_blank_lines(&vtk->scan)) {
                return damaged(vtk, error,
                               "the file is cut short; get it whole");
            }
            host_scan_word(&vtk->scan, name, sizeof name);
            if (host_scan_unsigned(&vtk->scan, UINT32_MAX, &size, error) != 0 ||
                host_scan_unsigned(&vtk->scan, UINT32_MAX, &tuples, error) !=
                    0 ||
                take_type(vtk, &type, error) != 0 ||
                skip_numbers(vtk, type, size * tuples, NULL, error) != 0)
                return error->code;
        }
        return 0;
    }
    if (strcasecmp(word, "METADATA") == 0) {
        do { /* to the first empty line */
            host_scan_next_line(&vtk->scan);
        } while (host_scan_more(&vtk->scan));
        return 0;
    }
    return damaged(vtk, error, "this keyword is not known here; correct it");
}

static int take_section(struct vtk *vtk, bool *done, struct host_error *error) {
    static const char *const axes[] = {"X_COORDINATES", "Y_COORDINATES",
                                       "Z_COORDINATES"};
    struct host_scan *s = &vtk->scan;
    for (int d = 0; d < 3; d++)
        if (host_scan_take(s, axes[d]))
            return take_axis(vtk, d, error);
    if (host_scan_take(s, "POINTS"))
        return take_points(vtk, error);
    if (host_scan_take(s, "DIMENSIONS"))
        return take_dimensions(vtk, error);
    if (host_scan_take(s, "ORIGIN"))
        return take_three(vtk, vtk->origin, error);
    if (host_scan_take(s, "SPACING") || host_scan_take(s, "ASPECT_RATIO"))
        return take_three(vtk, vtk->spacing, error);
    if (host_scan_take(s, "CELLS"))
        return take_cells(vtk, error);
    if (host_scan_take(s, "CELL_TYPES"))
        return take_cell_types(vtk, error);
    if (host_scan_take(s, "POINT_DATA") || host_scan_take(s, "CELL_DATA") ||
        host_scan_take(s, "VERTICES") || host_scan_take(s, "LINES") ||
        host_scan_take(s, "POLYGONS") || host_scan_take(s, "TRIANGLE_STRIPS")) {
        *done = true; /* nothing of interest follows */
        return 0;
    }
    const char *at = s->at;
    char word[64];
    host_scan_word(s, word, sizeof word);
    if (strcasecmp(word, "DATASET") == 0) {
        host_scan_word(s, word, sizeof word);
        vtk->is_image = strcasecmp(word, "STRUCTURED_POINTS") == 0;
        return 0;
    }
    if (strcasecmp(word, "FIELD") != 0 && strcasecmp(word, "METADATA") != 0)
        s->at = at;
    return skip_section(vtk, word, error);
}

static int read_header(struct vtk *vtk, struct host_error *error) {
    struct host_scan *s = &vtk->scan;
    if (vtk->source->bytes < 5 || memcmp(s->start, "# vtk", 5) != 0) {
        return damaged(vtk, error,
                       "the first line is not '# vtk DataFile'; give a legacy "
                       "VTK file");
    }
    host_scan_next_line(s);
    host_scan_next_line(s); /* the title */
    vtk->binary = host_scan_take(s, "BINARY");
    if (!vtk->binary && !host_scan_take(s, "ASCII"))
        return damaged(vtk, error, "ASCII or BINARY is due here; correct it");
    return 0;
}

static int read_sections(struct vtk *vtk, struct host_error *error) {
    bool done = false;
    while (!done && host_scan_skip_blank_lines(&vtk->scan)) {
        if (take_section(vtk, &done, error) != 0)
            return error->code;
        done = done || vtk->has_types ||
               (vtk->points_done && vtk->mesh->tets == NULL);
    }
    if (!vtk->points_done && vtk->mesh->points != NULL &&
        implied_points(vtk, error) != 0)
        return error->code;
    return vtk->mesh->tets != NULL ? append_cells(vtk, error) : 0;
}

static int read_vtk(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct vtk vtk = {
        .source = source,
        .mesh = mesh,
        .spacing = {1, 1, 1},
        .scan = host_scan_start(source->path, source->data, source->bytes)};
    if (read_header(&vtk, error) == 0)
        read_sections(&vtk, error);
    for (int d = 0; d < 3; d++)
        host_unmap(vtk.axis[d], (size_t)vtk.axis_count[d] * sizeof(double));
    return error->code;
}

static void write_points(struct host_output *out,
                         const struct host_points *points) {
    host_put_line(out,
                  "# vtk DataFile Version 3.0\nincode\nBINARY\n"
                  "DATASET POLYDATA\nPOINTS ",
                  points->count, " double\n");
    for (uint64_t i = 0; i < 3 * points->count; i++)
        host_put_double(out, points->xyz[i], true);
    host_output_text(out, "\n");
}

static int write_tetrahedra(struct host_output *out, struct host_output *beside,
                            const struct host_points *points,
                            const struct host_tetrahedra *tets,
                            struct host_error *error) {
    (void)beside;
    char text[160];
    if (points->count > INT32_MAX) {
        return host_fail(error, HOST_INPUT,
                         "%s: legacy VTK counts points in 31 bits; write .vtu",
                         out->path);
    }
    host_output_text(out, "# vtk DataFile Version 3.0\nincode\nBINARY\n"
                          "DATASET UNSTRUCTURED_GRID\n");
    (void)snprintf(text, sizeof text, "POINTS %llu double\n",
                   (unsigned long long)points->count);
    host_output_text(out, text);
    for (uint64_t i = 0; i < 3 * points->count; i++)
        host_put_double(out, points->xyz[i] + 0.0, true);
    unsigned long long words = 5 * tets->count;
    (void)snprintf(text, sizeof text, "\nCELLS %llu %llu\n",
                   (unsigned long long)tets->count, words);
    host_output_text(out, text);
    for (uint64_t i = 0; i < tets->count; i++) {
        host_put_whole(out, 4, 4, true);
        for (int k = 0; k < 4; k++)
            host_put_whole(out, tets->v[i][k], 4, true);
    }
    (void)snprintf(text, sizeof text, "\nCELL_TYPES %llu\n",
                   (unsigned long long)tets->count);
    host_output_text(out, text);
    for (uint64_t i = 0; i < tets->count; i++)
        host_put_whole(out, 10, 4, true);
    host_output_text(out, "\n");
    return error->code;
}

const struct host_format host_format_vtk = {
    .name = "legacy VTK",
    .extensions = {".vtk"},
    .read_points = read_vtk,
    .read_tetrahedra = read_vtk,
    .write_points = write_points,
    .write_tetrahedra = write_tetrahedra,
};
