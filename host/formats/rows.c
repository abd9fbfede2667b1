#include "rows.h"

#include <ctype.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "csv.h"
#include "host/base/parallel.h"

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
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcasecmp(name, names[i].name) == 0)
            return names[i].type;
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
        for (size_t i = 0; i < n && !as_here; i++, from += stride)
            for (size_t d = 0; d < 3; d++)
                xyz[3 * i + d] = host_number_at(from + d * bytes, type, big);
        if (host_points_append(points, xyz, n, error) != 0)
            return error->code;
        rows -= n;
    }
    return 0;
}

int host_append_tetrahedron(struct host_tetrahedra *tets,
                            const uint64_t vertex[4],
                            const struct host_source *source,
                            struct host_error *error) {
    enum { READ_BYTES = 128 }; /* of a row, with what it was read from */
    uint32_t(*row)[4] = host_tetrahedra_room(tets, 1, error);
    if (row == NULL)
        return error->code;
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
    host_call_trim(READ_BYTES);
    return 0;
}

void host_put_whole(struct host_output *out, uint64_t value, size_t bytes,
                    bool big) {
    uint8_t byte[8];
    for (size_t i = 0; i < bytes; i++)
        byte[i] = (uint8_t)(value >> 8 * (big ? bytes - 1 - i : i));
    host_output_bytes(out, byte, bytes);
}

void host_put_double(struct host_output *out, double value, bool big) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    host_put_whole(out, bits, sizeof bits, big);
}

/* In blocks, for arrays that are put aside. */
static void put_bytes(struct host_output *out, const void *bytes, size_t n) {
    const size_t block = 1 << 16;
    for (size_t at = 0; at < n; at += block) {
        size_t some = n - at < block ? n - at : block;
        host_output_bytes(out, (const char *)bytes + at, some);
        host_call_trim(some);
    }
}

void host_put_words(struct host_output *out, const uint32_t *values, size_t n) {
    if (is_little) {
        put_bytes(out, values, n * sizeof *values);
        return;
    }
    for (size_t i = 0; i < n; i++)
        host_put_whole(out, values[i], sizeof values[i], false);
}

void host_put_doubles(struct host_output *out, const double *values, size_t n) {
    if (is_little) {
        put_bytes(out, values, n * sizeof *values);
        return;
    }
    for (size_t i = 0; i < n; i++)
        host_put_double(out, values[i], false);
}

/* --- rows ----------------------------------------------------------------- */

enum next { NEXT_FIELD, NEXT_EMPTY, NEXT_NONE };

/* Goes to the next field of the line; one with more than `most` delimiters
 * before it comes after an empty one. */
static enum next go_to_field(struct host_scan *s, unsigned most) {
    const char *c = s->at;
    for (unsigned delimiters = 0; c < s->end; c++) {
        if (*c == ',' || *c == ';') {
            if (++delimiters > most) {
                s->at = c;
                return NEXT_EMPTY;
            }
        } else if (*c != ' ' && *c != '\t' && *c != '\r') {
            s->at = c;
            return *c == '\n' || host_scan_is_comment(c, s->end) ? NEXT_NONE
                                                                 : NEXT_FIELD;
        }
    }
    s->at = c;
    return NEXT_NONE;
}

static int wrong_columns(struct host_scan *s, int columns, enum next next,
                         bool first, struct host_error *error) {
    static const char *const few[] = {
        "", "1 column where x, y and z are due; complete the line",
        "2 columns where x, y and z are due; complete the line"};
    return host_scan_fail(
        s, s->at, error,
        next == NEXT_EMPTY ? HOST_CSV_EMPTY
        : first && columns == 1
            ? "1 column where x, y and z are due; complete the line, or, where "
              "it counts the points, remove it or say --format pts"
            : few[columns]);
}

/* --- decimal commas ------------------------------------------------------- */

/* What is between two numbers of a line, to find decimal commas.  DECIMAL: a
 * comma alone, before a digit.  ZERO: before a 0 and another digit, with which
 * no whole number begins. */
enum { COMMA_NONE = 1, COMMA_DECIMAL = 2, COMMA_ZERO = 4 };

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

/* `to` is before `end`. */
static unsigned commas_between(const char *from, const char *to,
                               const char *end, bool coordinate) {
    if (to - from > 1 || *from != ',')
        return memchr(from, ',', (size_t)(to - from)) == NULL ? COMMA_NONE : 0;
    bool zero = coordinate && *to == '0' && end - to > 1 && is_digit(to[1]);
    return zero            ? COMMA_DECIMAL | COMMA_ZERO
           : is_digit(*to) ? COMMA_DECIMAL
                           : 0;
}

/* Commas of a line of more than three numbers. */
enum commas { COMMAS_PART, COMMAS_DOUBTFUL, COMMAS_DECIMAL };

/* For a line whose first comma is between two digits.  `1,2,3,4` may be either;
 * `1,5, 2,5, 3` is three numbers.  If a number is not whole, commas separate
 * columns. */
static enum commas commas_of(const char *at, const char *end) {
    unsigned alone = 0, other = 0;
    while (at < end && *at != '\n' && !host_scan_is_comment(at, end)) {
        const char *gap = at;
        while (at < end && strchr(" \t\r,;", *at) != NULL)
            at++;
        if (at == gap && !is_digit(*at) && *at != '-' && *at != '+')
            return COMMAS_PART;
        if (at == gap) {
            at++;
        } else if (at < end && *at != '\n' && !host_scan_is_comment(at, end)) {
            bool comma = at - gap == 1 && *gap == ',';
            alone += comma && is_digit(*at);
            other += !comma;
        }
    }
    return other == 0                 ? COMMAS_DOUBTFUL
           : other == 2 && alone >= 2 ? COMMAS_DECIMAL
                                      : COMMAS_PART;
}

/* Checks a line of more than three numbers, the first of them at `line`; seen:
 * what is between the first three. */
static int check_commas(struct host_scan *s, const char *line, unsigned seen,
                        struct host_points *points, struct host_error *error) {
    enum commas commas =
        (seen & COMMA_DECIMAL) == 0 ? COMMAS_PART : commas_of(line, s->end);
    if ((seen & COMMA_NONE) != 0 && (seen & COMMA_DECIMAL) != 0) {
        return host_scan_fail(s, s->at, error,
                              "more than 3 columns, parted by commas here and "
                              "by something else there; write decimal points, "
                              "or part all columns alike");
    }
    if (commas == COMMAS_DECIMAL ||
        (commas == COMMAS_DOUBTFUL && (seen & COMMA_ZERO) != 0)) {
        return host_scan_fail(s, s->at, error,
                              "more than 3 columns, all of whole numbers, by "
                              "commas that look like decimal ones; write "
                              "decimal points, or name the columns in a first "
                              "line");
    }
    points->doubtful =
        commas == COMMAS_DOUBTFUL && (points->count == 0 || points->doubtful);
    return 0;
}

int host_take_point(struct host_scan *s, bool is_csv,
                    struct host_points *points, struct host_error *error) {
    double xyz[3];
    unsigned most = is_csv ? 1 : UINT_MAX, commas = 0;
    enum next next = NEXT_NONE;
    const char *line = s->at;
    if (is_csv && host_csv_begins_empty(s))
        return wrong_columns(s, 0, NEXT_EMPTY, false, error);
    for (int d = 0; d < 3; d++) {
        if (host_scan_double(s, &xyz[d], error) != 0)
            return error->code;
        const char *end = s->at;
        next = go_to_field(s, most);
        if (next == NEXT_FIELD)
            commas |= commas_between(end, s->at, s->end, d < 2);
        if (d < 2 && next != NEXT_FIELD)
            return wrong_columns(s, d + 1, next, points->count == 0, error);
    }
    if (next != NEXT_NONE) {
        if (check_commas(s, line, commas, points, error) != 0)
            return error->code;
        points->wide = true;
        host_scan_next_line(s);
    } else {
        points->doubtful = false;
    }
    return host_points_append(points, xyz, 1, error);
}

int host_take_element(struct host_mesh *mesh, const uint64_t number[4],
                      uint64_t base, const struct host_source *source,
                      const struct host_scan *s, struct host_error *error) {
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

int host_take_section_end(struct host_scan *s, struct host_error *error) {
    return !host_scan_skip_blank_lines(s) || *s->at == '$' ||
                   isalpha((unsigned char)*s->at)
               ? 0
               : host_scan_fail(s, s->at, error,
                                "a row beyond the number that its section "
                                "begins with; correct that number, or remove "
                                "the row");
}

void host_put_line(struct host_output *out, const char *before, uint64_t number,
                   const char *after) {
    host_output_text(out, before);
    host_output_unsigned(out, number);
    host_output_text(out, after);
}

/* --- numbers -------------------------------------------------------------- */

enum { DOUBLE_BYTES = 40, DIGITS = 17 };

/* Doubles, besides integers, whose shortest decimals 128 bits can find. */
static const double fast_least = 1e-5, fast_most = 1e15;

/* The decimals that read back as a double, times a power of ten: all whole
 * numbers from least to most.  The double itself is `at` and a fraction. */
struct decimals {
    uint64_t least, most, at;
    enum { PART_NONE, PART_BELOW_HALF, PART_HALF, PART_ABOVE_HALF } part;
    int places; /* the power of ten */
};

/* value = m 2^-s.  A decimal within half a unit of m reads back as value: from
 * P - T / 2 to P + T / 2, for P = m T and T a power of ten, in units of 2^-s,
 * both ends included if m is even.  Below a power of two half of that
 * reads back.
 * With `places` such that 10^16 <= P 2^-s < 10^18, T is at most 10^22 and at
 * least 100, and P below 2^127. */
static struct decimals decimals_of(double value) {
    int exponent;
    uint64_t m = (uint64_t)ldexp(frexp(value, &exponent), DBL_MANT_DIG);
    int s = DBL_MANT_DIG - exponent;
    struct decimals d = {.places = DIGITS - 1 -
                                   (int)floor((exponent - 1) * 0.30102999566)};
    unsigned __int128 power = 1;
    for (int i = 0; i < d.places; i++)
        power *= 10;
    unsigned __int128 whole = m * power, mask = ((unsigned __int128)1 << s) - 1;
    unsigned __int128 high = whole + power / 2;
    unsigned __int128 low =
        whole - power / (m == UINT64_C(1) << (DBL_MANT_DIG - 1) ? 4 : 2);
    unsigned __int128 half = (mask + 1) / 2;
    bool closed = m % 2 == 0;
    d.most = (uint64_t)(high >> s) - (!closed && (high & mask) == 0);
    d.least = (uint64_t)((low + mask) >> s) + (!closed && (low & mask) == 0);
    d.at = (uint64_t)(whole >> s);
    unsigned __int128 part = whole & mask;
    d.part = part == 0     ? PART_NONE
             : part < half ? PART_BELOW_HALF
             : part > half ? PART_ABOVE_HALF
                           : PART_HALF;
    return d;
}

/* The multiple of the largest power of ten that reads back, without its zeros:
 * the nearest one, of two the even one. */
static uint64_t shortest(struct decimals *d) {
    uint64_t unit = 1;
    while (d->most / (10 * unit) * (10 * unit) >= d->least) {
        unit *= 10;
        d->places--;
    }
    uint64_t n = d->at / unit, rest = d->at % unit;
    bool odd = n % 2 != 0;
    bool up = unit == 1 ? d->part > PART_HALF || (d->part == PART_HALF && odd)
                        : rest > unit / 2 || (rest == unit / 2 &&
                                              (d->part != PART_NONE || odd));
    return (up || n * unit < d->least) && (n + 1) * unit <= d->most ? n + 1 : n;
}

/* n 10^-places, of more than 0 places. */
static size_t print_fixed(char *text, bool negative, uint64_t n, int places) {
    char digits[DOUBLE_BYTES];
    size_t at = sizeof digits;
    for (int i = 0; i < places || n > 0; i++, n /= 10) {
        if (i == places)
            digits[--at] = '.';
        digits[--at] = (char)('0' + n % 10);
    }
    if (sizeof digits - at == (size_t)places) {
        digits[--at] = '.';
        digits[--at] = '0';
    }
    if (negative)
        digits[--at] = '-';
    memcpy(text, digits + at, sizeof digits - at);
    return sizeof digits - at;
}

/* By trial, with at most 17 digits.  Normal numbers are tried from 15 digits
 * on, as a shorter decimal is one of 15 digits that ends in zeros.  Some powers
 * of two get 17 digits where 16 that are not the nearest would do. */
static size_t print_rare(char *text, double value) {
    int n = 0, digits = fabs(value) < DBL_MIN ? 1 : DBL_DIG;
    do {
        n = snprintf(text, DOUBLE_BYTES, "%.*g", digits, value);
    } while (digits++ < DIGITS && strtod(text, NULL) != value);
    return (size_t)n;
}

static void put_double(struct host_output *out, double value) {
    char text[DOUBLE_BYTES];
    double size = fabs(value);
    if (size < fast_most && size == floor(size)) {
        if (signbit(value))
            host_output_text(out, "-");
        host_output_unsigned(out, (uint64_t)size);
        return;
    }
    size_t n = 0;
    if (size >= fast_least && size < fast_most) {
        struct decimals d = decimals_of(size);
        uint64_t digits = shortest(&d);
        n = print_fixed(text, signbit(value) != 0, digits, d.places);
    } else {
        n = print_rare(text, value);
    }
    host_output_bytes(out, text, n);
}

void host_put_xyz(struct host_output *out, const double *xyz) {
    for (int d = 0; d < 3; d++) {
        put_double(out, xyz[d] + 0.0);
        if (d < 2)
            host_output_text(out, " ");
    }
}

void host_put_count(struct host_output *out, uint64_t count, int width) {
    char text[40];
    (void)snprintf(text, sizeof text, "%*llu\n", width,
                   (unsigned long long)count);
    host_output_text(out, text);
}

void host_put_rows(struct host_output *out, const struct host_row_writer *rows,
                   const struct host_points *points,
                   const struct host_tetrahedra *tets) {
    rows->head(out, points);
    rows->count(out, tets->count, 0);
    rows->rows(out, (const uint32_t(*)[4])tets->v, tets->count, 0);
    rows->tail(out);
}

void host_put_row(struct host_output *out, const uint32_t *v, int n,
                  uint64_t base) {
    for (int k = 0; k < n; k++) {
        host_output_text(out, " ");
        host_output_unsigned(out, v[k] + base);
    }
}

void host_put_points(struct host_output *out, const struct host_points *points,
                     const char *separator, bool numbered) {
    for (uint64_t i = 0; i < points->count; i++) {
        if (numbered) {
            host_output_unsigned(out, i + points->base);
            host_output_text(out, separator);
        }
        for (uint64_t d = 0; d < 3; d++) {
            put_double(out, points->xyz[3 * i + d]);
            host_output_text(out, d < 2 ? separator : "\n");
        }
    }
}
