#include "numbers.h"

#include <string.h>
#include <strings.h>

static const struct {
    const char *name;
    enum host_number type;
} names[] = {
    {"double", HOST_F64},
    {"float64", HOST_F64},
    {"float", HOST_F32},
    {"float32", HOST_F32},
    {"char", HOST_I8},
    {"int8", HOST_I8},
    {"signed_char", HOST_I8},
    {"uchar", HOST_U8},
    {"uint8", HOST_U8},
    {"unsigned_char", HOST_U8},
    {"short", HOST_I16},
    {"int16", HOST_I16},
    {"ushort", HOST_U16},
    {"uint16", HOST_U16},
    {"unsigned_short", HOST_U16},
    {"int", HOST_I32},
    {"int32", HOST_I32},
    {"uint", HOST_U32},
    {"uint32", HOST_U32},
    {"unsigned_int", HOST_U32},
    {"long", HOST_I64},
    {"int64", HOST_I64},
    {"vtktypeint64", HOST_I64},
    {"vtkidtype", HOST_I32},
    {"unsigned_long", HOST_U64},
    {"uint64", HOST_U64},
    {"vtktypeint32", HOST_I32},
    {"vtktypeuint8", HOST_U8},
};

size_t host_number_bytes(enum host_number type) {
    static const size_t bytes[] = {8, 4, 1, 1, 2, 2, 4, 4, 8, 8, 0};
    return bytes[type];
}

enum host_number host_number_named(const char *name) {
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        if (strcasecmp(name, names[i].name) == 0) {
            return names[i].type;
        }
    }
    return HOST_NO_NUMBER;
}

static uint64_t bits_at(const uint8_t *from, size_t bytes, bool big) {
    uint64_t bits = 0;
    for (size_t i = 0; i < bytes; i++) {
        size_t shift = 8 * (big ? bytes - 1 - i : i);
        bits |= (uint64_t)from[i] << shift;
    }
    return bits;
}

static int64_t extended(uint64_t bits, size_t bytes) {
    uint64_t sign = bytes == 0 ? 0 : UINT64_C(1) << (8 * bytes - 1);
    return (int64_t)((bits ^ sign) - sign);
}

double host_number_at(const uint8_t *from, enum host_number type, bool big) {
    size_t bytes = host_number_bytes(type);
    uint64_t bits = bits_at(from, bytes, big);
    double d;
    float f;
    uint32_t low = (uint32_t)bits;
    switch (type) {
    case HOST_F64:
        memcpy(&d, &bits, sizeof d);
        return d;
    case HOST_F32:
        memcpy(&f, &low, sizeof f);
        return (double)f;
    case HOST_U8:
    case HOST_U16:
    case HOST_U32:
    case HOST_U64:
        return (double)bits;
    default:
        return (double)extended(bits, bytes);
    }
}

uint64_t host_whole_at(const uint8_t *from, enum host_number type, bool big) {
    size_t bytes = host_number_bytes(type);
    uint64_t bits = bits_at(from, bytes, big);
    if (type == HOST_F64 || type == HOST_F32) {
        double d = host_number_at(from, type, big);
        return d >= 0 && d < 0x1p53 ? (uint64_t)d : UINT64_MAX;
    }
    bool is_signed = type == HOST_I8 || type == HOST_I16 || type == HOST_I32 ||
                     type == HOST_I64;
    return is_signed && extended(bits, bytes) < 0 ? UINT64_MAX : bits;
}

static const bool is_little = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;

int host_append_numbers(struct host_points *points, const uint8_t *from,
                        uint64_t rows, size_t stride, enum host_number type,
                        bool big, struct host_error *error) {
    enum { ROWS = 512 };
    double xyz[3 * ROWS];
    size_t bytes = host_number_bytes(type);
    bool as_here = type == HOST_F64 && big != is_little && stride == 24;
    while (rows > 0) {
        size_t n = rows < ROWS ? (size_t)rows : ROWS;
        if (as_here) {
            memcpy(xyz, from, n * stride);
            from += n * stride;
        }
        for (size_t i = 0; i < n && !as_here; i++, from += stride) {
            for (size_t d = 0; d < 3; d++) {
                xyz[3 * i + d] = host_number_at(from + d * bytes, type, big);
            }
        }
        if (host_points_append(points, xyz, n, error) != 0) {
            return error->code;
        }
        rows -= n;
    }
    return 0;
}

int host_append_tetrahedron(struct host_tetrahedra *tets,
                            const uint64_t vertex[4],
                            const struct host_source *source,
                            struct host_error *error) {
    uint32_t(*row)[4] = host_tetrahedra_room(tets, 1, error);
    if (row == NULL) {
        return error->code;
    }
    for (int k = 0; k < 4; k++) {
        if (vertex[k] >= UINT32_MAX) {
            return host_fail(error, HOST_INPUT,
                             "%s: tetrahedron %llu has a vertex number that "
                             "is no row of points; correct it",
                             source->path, (unsigned long long)tets->count);
        }
        row[0][k] = (uint32_t)vertex[k];
    }
    host_tetrahedra_keep(tets, 1);
    return 0;
}

void host_put_whole(struct host_output *out, uint64_t value, size_t bytes,
                    bool big) {
    uint8_t byte[8];
    for (size_t i = 0; i < bytes; i++) {
        byte[i] = (uint8_t)(value >> 8 * (big ? bytes - 1 - i : i));
    }
    host_output_bytes(out, byte, bytes);
}

void host_put_double(struct host_output *out, double value, bool big) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    host_put_whole(out, bits, sizeof bits, big);
}

void host_put_words(struct host_output *out, const uint32_t *values, size_t n) {
    if (is_little) {
        host_output_bytes(out, values, n * sizeof *values);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        host_put_whole(out, values[i], sizeof values[i], false);
    }
}

void host_put_doubles(struct host_output *out, const double *values, size_t n) {
    if (is_little) {
        host_output_bytes(out, values, n * sizeof *values);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        host_put_double(out, values[i], false);
    }
}
