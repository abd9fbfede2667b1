/* Files for the tests of readers, made byte by byte, and what is expected of
 * them.
 *
 * Memory: 64 KiB a file. */
#ifndef TESTS_BYTES_H
#define TESTS_BYTES_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "host/formats/read.h"
#include "tests/unit/test.h"

/* A file's bytes, put together piece by piece. */
struct bytes {
    uint8_t data[1 << 16];
    size_t n;
};

static inline void put(struct bytes *b, const void *data, size_t n) {
    assert_true(b->n + n <= sizeof b->data);
    memcpy(b->data + b->n, data, n);
    b->n += n;
}

static inline void put_text(struct bytes *b, const char *text) {
    put(b, text, strlen(text));
}

static inline void put_word(struct bytes *b, uint64_t value, size_t size,
                            bool big) {
    for (size_t i = 0; i < size; i++) {
        uint8_t byte = (uint8_t)(value >> (8 * (big ? size - 1 - i : i)));
        put(b, &byte, 1);
    }
}

static inline void put_number(struct bytes *b, double value, bool wide,
                              bool big) {
    uint64_t bits;
    float single = (float)value;
    uint32_t low;
    memcpy(&bits, &value, sizeof bits);
    memcpy(&low, &single, sizeof low);
    put_word(b, wide ? bits : low, wide ? 8 : 4, big);
}

static inline double value_of(uint64_t i) {
    return (double)i * 0.5 - 3; /* exact in single precision */
}

static inline void put_values(struct bytes *b, uint64_t n, bool wide,
                              bool big) {
    for (uint64_t i = 0; i < n; i++)
        put_number(b, value_of(i), wide, big);
}

static inline void put_base64(struct bytes *b, const uint8_t *from, size_t n) {
    static const char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                "abcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < n; i += 3) {
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; k++)
            bits = bits << 8 | (i + k < n ? from[i + k] : 0u);
        for (size_t k = 0; k < 4; k++) {
            char c = i + k > n ? '=' : digit[bits >> (18 - 6 * k) & 63];
            put(b, &c, 1);
        }
    }
}

/* Expects n points with the values of value_of, row by row. */
static inline void expect_rows(const char *path, const struct bytes *b,
                               uint64_t n) {
    struct host_points points;
    struct host_error error = {0};
    if (host_points_parse(path, b->data, b->n, &points, &error) != 0)
        fail_msg("%s", error.text);
    assert_int_equal(points.count, n);
    for (uint64_t i = 0; i < 3 * n; i++)
        assert_true(points.xyz[i] == value_of(i));
    host_points_free(&points);
}

/* Every shorter file is refused, or (the end of a text may go) the same. */
static inline void expect_cuts_refused(const char *path, const struct bytes *b,
                                       size_t from) {
    for (size_t n = from; n < b->n; n++) {
        struct host_points points;
        struct host_error error = {0};
        assert_int_equal(host_points_parse(path, b->data, n, &points, &error),
                         HOST_INPUT);
        assert_non_null(strstr(error.text, path));
        assert_non_null(strstr(error.text, "; "));
    }
}

static inline void refused(const char *path, const char *text,
                           const char *expected) {
    struct host_points points;
    struct host_error error = {0};
    assert_int_equal(
        host_points_parse(path, text, strlen(text), &points, &error),
        HOST_INPUT);
    assert_null(points.xyz);
    if (strstr(error.text, expected) == NULL)
        fail_msg("expected '%s' in '%s'", expected, error.text);
    assert_null(strchr(error.text, '\n'));
    assert_non_null(strstr(error.text, "; "));
}

#endif
