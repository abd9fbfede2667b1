/* NumPy's .npy: points, of which (n,3) are of any kind of number and those with
 * more columns of floating-point ones; (m,4) tetrahedra of whole numbers. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "format.h"
#include "rows.h"

struct npy {
    enum host_number type;
    bool big, fortran;
    uint64_t rows, columns;
    size_t start; /* of the numbers */
};

static enum host_number type_of(char kind, int bytes) {
    static const struct {
        char kind;
        int bytes;
        enum host_number type;
    } kinds[] = {{'f', 8, HOST_F64}, {'f', 4, HOST_F32}, {'i', 8, HOST_I64},
                 {'i', 4, HOST_I32}, {'i', 2, HOST_I16}, {'i', 1, HOST_I8},
                 {'u', 8, HOST_U64}, {'u', 4, HOST_U32}, {'u', 2, HOST_U16},
                 {'u', 1, HOST_U8}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (kinds[i].kind == kind && kinds[i].bytes == bytes)
            return kinds[i].type;
    return HOST_NO_NUMBER;
}

/* Just past `key` and its colon, or NULL. */
static const char *value_of(const char *header, const char *key) {
    const char *at = strstr(header, key);
    if (at == NULL)
        return NULL;
    at += strlen(key);
    return *at == '\0' ? NULL : at + 1 + strspn(at + 1, ": ");
}

static bool parse_dictionary(const char *header, struct npy *npy) {
    const char *descr = value_of(header, "'descr'");
    const char *order = value_of(header, "'fortran_order'");
    const char *shape = value_of(header, "'shape'");
    if (descr == NULL || order == NULL || shape == NULL || *descr != '\'' ||
        *shape != '(')
        return false;
    npy->big = descr[1] == '>';
    if (descr[1] == '\0' || descr[2] == '\0')
        return false;
    npy->type = type_of(descr[2], atoi(descr + 3));
    npy->fortran = *order == 'T';
    char *end;
    npy->rows = strtoull(shape + 1, &end, 10);
    if (end == shape + 1 || *end != ',')
        return false;
    shape = end + 1;
    npy->columns = strtoull(shape, &end, 10);
    return end != shape && strspn(end, ", ") < 4 &&
           end[strspn(end, ", ")] == ')';
}

static int parse_header(const struct host_source *source, struct npy *npy,
                        struct host_error *error) {
    const uint8_t *data = source->data;
    if (source->bytes < 12 || memcmp(data, "\x93NUMPY", 6) != 0) {
        return host_source_fail(source, error,
                                "this is no NumPy file; write it with "
                                "numpy.save");
    }
    size_t prefix = data[6] == 1 ? 10 : 12;
    size_t length = (size_t)host_whole_at(
        data + 8, data[6] == 1 ? HOST_U16 : HOST_U32, false);
    char header[1024];
    if (length >= sizeof header || source->bytes - prefix < length) {
        return host_source_fail(source, error,
                                "the header is damaged; write the file again "
                                "with numpy.save");
    }
    memcpy(header, data + prefix, length);
    header[length] = '\0';
    npy->start = prefix + length;
    if (!parse_dictionary(header, npy)) {
        return host_source_fail(source, error,
                                "the array has not two dimensions; save one "
                                "of shape (n, 3), as a.reshape(-1, 3)");
    }
    if (npy->type == HOST_NO_NUMBER) {
        return host_source_fail(source, error,
                                "this kind of number is not read; save "
                                "float64, float32 or integers");
    }
    return 0;
}

static bool is_floating(const struct npy *npy) {
    return npy->type == HOST_F64 || npy->type == HOST_F32;
}

static int wrong_size(const struct host_source *source, const struct npy *npy,
                      uint64_t have, struct host_error *error) {
    return host_fail(error, HOST_INPUT,
                     "%s: %llu bytes of numbers where %llu rows of %llu "
                     "numbers are due; the file is cut short or damaged, "
                     "get it whole",
                     source->path, (unsigned long long)have,
                     (unsigned long long)npy->rows,
                     (unsigned long long)npy->columns);
}

/* Takes `rows` rows at `from`. */
typedef int taker(const struct host_source *source, const struct npy *npy,
                  const uint8_t *from, uint64_t rows, struct host_mesh *mesh,
                  struct host_error *error);

/* Takes all rows, as many at a time as are in the window.  A file that is held
 * whole has been checked to have just these rows; for another file the end
 * shows it.  Fortran's order needs the whole file. */
static int take_rows(const struct host_source *source, const struct npy *npy,
                     taker *take, struct host_mesh *mesh,
                     struct host_error *error) {
    const uint64_t row = host_number_bytes(npy->type) * npy->columns;
    const uint8_t *at = source->data + npy->start;
    const uint8_t *end = source->data + source->bytes;
    uint64_t left = npy->rows, taken = 0;
    bool more = source->feed != NULL;
    if (npy->fortran && host_source_all(source, &at, &end, error) != 0)
        return error->code;
    if (npy->columns > UINT32_MAX || (more && npy->rows > UINT32_MAX))
        return wrong_size(source, npy, (uint64_t)(end - at), error);
    if (!more || npy->fortran) {
        uint64_t have = (uint64_t)(end - at);
        return have / row < left || have != left * row
                   ? wrong_size(source, npy, have, error)
                   : take(source, npy, at, left, mesh, error);
    }
    while (more) {
        uint64_t n = (uint64_t)(end - at) / row;
        n = n < left ? n : left;
        if (take(source, npy, at, n, mesh, error) != 0)
            return error->code;
        at += n * row;
        left -= n;
        taken += n * row;
        more = (left > 0 || at == end) && host_source_more(source, &at, &end);
    }
    return left > 0 || at != end
               ? wrong_size(source, npy, taken + (uint64_t)(end - at), error)
               : 0;
}

static int take_points(const struct host_source *source, const struct npy *npy,
                       const uint8_t *from, uint64_t rows,
                       struct host_mesh *mesh, struct host_error *error) {
    size_t bytes = host_number_bytes(npy->type);
    (void)source;
    if (!npy->fortran) {
        return host_append_numbers(mesh->points, from, rows,
                                   (size_t)npy->columns * bytes, npy->type,
                                   npy->big, error);
    }
    for (uint64_t i = 0; i < rows; i++) {
        double xyz[3];
        for (uint64_t d = 0; d < 3; d++) {
            xyz[d] = host_number_at(from + (d * rows + i) * bytes, npy->type,
                                    npy->big);
        }
        if (host_points_append(mesh->points, xyz, 1, error) != 0)
            return error->code;
    }
    return 0;
}

static int take_tetrahedra(const struct host_source *source,
                           const struct npy *npy, const uint8_t *from,
                           uint64_t rows, struct host_mesh *mesh,
                           struct host_error *error) {
    size_t bytes = host_number_bytes(npy->type);
    for (uint64_t i = 0; i < rows; i++) {
        uint64_t v[4];
        for (uint64_t k = 0; k < 4; k++) {
            uint64_t at = npy->fortran ? k * rows + i : 4 * i + k;
            v[k] = host_whole_at(from + at * bytes, npy->type, npy->big);
        }
        if (host_append_tetrahedron(mesh->tets, v, source, error) != 0)
            return error->code;
    }
    return 0;
}

static int read_points(const struct host_source *source, const struct npy *npy,
                       struct host_mesh *mesh, struct host_error *error) {
    if (npy->rows == 3 && npy->columns > 3) {
        return host_fail(error, HOST_INPUT,
                         "%s: an array of shape (3, %llu), of which each row "
                         "would be a point; save its transpose: "
                         "numpy.save(FILE, a.T)",
                         source->path, (unsigned long long)npy->columns);
    }
    if (npy->columns < 3 || (npy->columns > 3 && !is_floating(npy))) {
        return host_fail(error, HOST_INPUT,
                         "%s: %llu columns%s where x, y and z are due; save an "
                         "array of shape (n, 3)",
                         source->path, (unsigned long long)npy->columns,
                         npy->columns > 3 ? " of whole numbers" : "");
    }
    mesh->points->wide = npy->columns > 3;
    return take_rows(source, npy, take_points, mesh, error);
}

static int read_tetrahedra(const struct host_source *source,
                           const struct npy *npy, struct host_mesh *mesh,
                           struct host_error *error) {
    if (npy->columns != 4 || is_floating(npy)) {
        return host_fail(error, HOST_INPUT,
                         "%s: %llu columns of %s numbers where 4 vertices are "
                         "due; save an array of integers of shape (m, 4)",
                         source->path, (unsigned long long)npy->columns,
                         is_floating(npy) ? "floating-point" : "whole");
    }
    return take_rows(source, npy, take_tetrahedra, mesh, error);
}

static int read_npy(const struct host_source *source, struct host_mesh *mesh,
                    struct host_error *error) {
    struct npy npy = {.type = HOST_NO_NUMBER};
    if (parse_header(source, &npy, error) != 0)
        return error->code;
    if (mesh->tets != NULL)
        return read_tetrahedra(source, &npy, mesh, error);
    return read_points(source, &npy, mesh, error);
}

/* The header of an array of `columns`, so long that numbers are aligned to 64.
 */
static void write_header(struct host_output *out, const char *type,
                         uint64_t rows, int columns) {
    char text[160];
    int n = snprintf(text, sizeof text,
                     "{'descr': '%s', 'fortran_order': False, "
                     "'shape': (%llu, %d), }",
                     type, (unsigned long long)rows, columns);
    int padded = (10 + n + 1 + 63) / 64 * 64 - 10;
    host_output_bytes(out, "\x93NUMPY\x01\x00", 8);
    host_put_whole(out, (uint64_t)padded, 2, false);
    host_output_text(out, text);
    for (; n < padded - 1; n++)
        host_output_text(out, " ");
    host_output_text(out, "\n");
}

static void write_points(struct host_output *out,
                         const struct host_points *points) {
    write_header(out, "<f8", points->count, 3);
    host_put_doubles(out, points->xyz, 3 * (size_t)points->count);
}

static void put_nothing(struct host_output *out) {
    (void)out;
}

static void put_no_points(struct host_output *out,
                          const struct host_points *points) {
    (void)out;
    (void)points;
}

/* It has 128 bytes, whatever the count. */
static void put_shape(struct host_output *out, uint64_t count, int width) {
    (void)width;
    write_header(out, "<u4", count, 4);
}

static void put_rows(struct host_output *out, const uint32_t (*v)[4],
                     uint64_t n, uint64_t first) {
    (void)first;
    if (n > 0)
        host_put_words(out, v[0], 4 * (size_t)n);
}

static const struct host_row_writer npy_rows = {put_no_points, put_shape,
                                                put_rows, put_nothing};

static int write_tetrahedra(struct host_output *out, struct host_output *beside,
                            const struct host_points *points,
                            const struct host_tetrahedra *tets,
                            struct host_error *error) {
    (void)beside;
    host_put_rows(out, &npy_rows, points, tets);
    return error->code;
}

const struct host_format host_format_npy = {
    .name = "NumPy",
    .extensions = {".npy"},
    .read_points = read_npy,
    .read_tetrahedra = read_npy,
    .pieces = true,
    .write_points = write_points,
    .write_tetrahedra = write_tetrahedra,
    .rows = &npy_rows,
    .rows_only = true,
};
