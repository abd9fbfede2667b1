/* Points in .ply, .npy and PLOT3D, made here byte by byte, of every coding. */
#include "bytes.h"
#include "tests/unit/reference.h"

TEST(ply_of_every_coding) {
    static const char *const codings[] = {"ascii", "binary_little_endian",
                                          "binary_big_endian"};
    for (int coding = 0; coding < 3; coding++) {
        for (int wide = 0; wide < 2; wide++) {
            struct bytes b = {.n = 0};
            put_text(&b, "ply\nformat ");
            put_text(&b, codings[coding]);
            put_text(&b, " 1.0\ncomment made here\n"
                         "element thing 2\nproperty list uchar int of\n"
                         "element vertex 4\nproperty uchar red\nproperty ");
            put_text(&b, wide != 0 ? "double x\nproperty double y\nproperty "
                                     "double z\nproperty short s\n"
                                   : "float x\nproperty float y\nproperty "
                                     "float32 z\nproperty int16 s\n");
            put_text(&b, "element face 1\nproperty list uchar int v\n"
                         "end_header\n");
            bool big = coding == 2;
            if (coding == 0) {
                put_text(&b, "2 7 8\n0\n9 -3 -2.5 -2 1\n9 -1.5 -1 -.5 1\n"
                             "9 0 .5 1 1\n9 1.5 2 2.5 ");
                expect_cuts_refused("a.ply", &b, 0);
                put_text(&b, "1\n3 0 1 2\n");
                expect_rows("a.ply", &b, 4);
                continue;
            }
            put_word(&b, 2, 1, big);
            put_word(&b, 7, 4, big);
            put_word(&b, 8, 4, big);
            put_word(&b, 0, 1, big);
            for (uint64_t i = 0; i < 12; i++) {
                if (i % 3 == 0)
                    put_word(&b, 200, 1, big);
                put_number(&b, value_of(i), wide != 0, big);
                if (i % 3 == 2)
                    put_word(&b, 1, 2, big);
            }
            put_word(&b, 3, 1, big);
            put_word(&b, 0, 4, big);
            put_word(&b, 1, 4, big);
            put_word(&b, 2, 4, big);
            expect_rows("a.ply", &b, 4);
            expect_cuts_refused("a.ply", &b, 0);
            put_text(&b, "\n");
            expect_rows("a.ply", &b, 4);
            put_word(&b, 0, 1, big);
            struct host_points points;
            struct host_error error = {0};
            assert_int_equal(
                host_points_parse("a.ply", b.data, b.n, &points, &error),
                HOST_INPUT);
            assert_non_null(strstr(error.text, "a.ply: more follows than"));
        }
    }
    refused("a.ply", "plx\n", "a.ply:1:1: the first line is not 'ply'");
    refused("a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
            "end_header\n1\n",
            "not all of x, y and z");
    refused("a.ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
            "property float y\nproperty float z\nend_header\n1 2 q\n",
            "a.ply:8:5: 'q' is no number");
}

/* Four vertices and two faces, of which the header tells otherwise. */
TEST(ply_is_as_long_as_it_says) {
    static const struct {
        int vertices, faces;
        const char *wrong;
    } heads[] = {
        {3, 2, "a.ply:14:4: a list of impossible length"},
        {4, 1, "a.ply:16:1: more follows than the rows"},
        {5, 2, "a.ply:15:7: a number beyond those that the header gives"},
        {4, 3, "a.ply:17:1: the file ends where a number is due"},
        {4, 2, NULL},
    };
    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        struct bytes b = {.n = 0};
        int n =
            snprintf((char *)b.data, sizeof b.data,
                     "ply\nformat ascii 1.0\ncomment made\nelement vertex %d\n"
                     "property float x\nproperty float y\nproperty float z\n"
                     "element face %d\nproperty list uchar int vertex_indices\n"
                     "end_header\n-3 -2.5 -2\n-1.5 -1 -.5\n0 .5 1 \n1.5 2 2.5\n"
                     "3 0 1 2\n3 0 1 3\n",
                     heads[i].vertices, heads[i].faces);
        b.n = (size_t)n;
        if (heads[i].wrong != NULL)
            refused("a.ply", (char *)b.data, heads[i].wrong);
        else
            expect_rows("a.ply", &b, 4);
    }
}

/* The beginning of an array of 5 rows. */
static void put_npy(struct bytes *b, int version, const char *type,
                    bool fortran, const char *columns) {
    char header[128];
    (void)snprintf(header, sizeof header,
                   "{'descr': '%s', 'fortran_order': %s, 'shape': (5, %s), }"
                   "%*s\n",
                   type, fortran ? "True" : "False", columns, 20, "");
    b->n = 0;
    put(b, "\x93NUMPY", 6);
    put_word(b, (uint64_t)version, 1, false);
    put_word(b, 0, 1, false);
    put_word(b, strlen(header), version == 1 ? 2 : 4, false);
    put_text(b, header);
}

TEST(npy_of_every_kind) {
    static struct bytes b;
    for (unsigned bits = 0; bits < 64; bits++) {
        bool big = (bits & 1) != 0, wide = (bits & 2) != 0;
        bool fortran = (bits & 4) != 0;
        const unsigned columns = 3 + bits / 16;
        char type[] = {big ? '>' : '<', 'f', wide ? '8' : '4', '\0'};
        char width[] = {(char)('0' + columns), '\0'};
        put_npy(&b, (bits & 8) != 0 ? 2 : 1, type, fortran, width);
        for (unsigned i = 0; i < 5 * columns; i++) {
            unsigned row = fortran ? i % 5 : i / columns;
            unsigned column = fortran ? i / 5 : i % columns;
            put_number(&b, column < 3 ? value_of(3 * row + column) : NAN, wide,
                       big);
        }
        expect_rows("a.npy", &b, 5);
        expect_cuts_refused("a.npy", &b, 0);
        struct host_points points;
        struct host_error error = {0};
        assert_int_equal(
            host_points_parse("a.npy", b.data, b.n, &points, &error), 0);
        assert_int_equal(points.wide, columns > 3);
        host_points_free(&points);
        put_word(&b, 0, 1, false);
        assert_int_equal(
            host_points_parse("a.npy", b.data, b.n, &points, &error),
            HOST_INPUT);
    }
}

/* Of another number of columns than points and tetrahedra have. */
TEST(npy_of_other_shapes) {
    static const struct {
        const char *type, *columns, *why;
    } wrong[] = {{"<f8", "2", "2 columns where"},
                 {"<i4", "4", "4 columns of whole numbers where"},
                 {"<f8", "2305843009213693952", "are due; the file is cut"},
                 {"<f8", "18446744073709551615", "are due; the file is cut"}};
    static struct bytes b;
    struct host_points points;
    struct host_tetrahedra tets;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct host_error error = {0};
        put_npy(&b, 1, wrong[i].type, false, wrong[i].columns);
        put_values(&b, 20, true, false);
        assert_int_equal(
            host_points_parse("a.npy", b.data, b.n, &points, &error),
            HOST_INPUT);
        assert_non_null(strstr(error.text, wrong[i].why));
    }
    for (int i = 0; i < 2; i++) { /* what was meant are its columns */
        struct host_error error = {0};
        const char *header = i == 0 ? "{'descr': '<f8', 'fortran_order': "
                                      "False, 'shape': (3, 7), }\n"
                                    : "{'descr': '<i8', 'fortran_order': "
                                      "True, 'shape': (3, 7), }\n";
        b.n = 0;
        put_text(&b, "\x93NUMPY\x01");
        put_word(&b, 0, 1, false);
        put_word(&b, strlen(header), 2, false);
        put_text(&b, header);
        put_values(&b, 21, true, false);
        assert_int_equal(
            host_points_parse("a.npy", b.data, b.n, &points, &error),
            HOST_INPUT);
        assert_non_null(strstr(error.text, "shape (3, 7), of which"));
        assert_non_null(strstr(error.text, "; save its transpose: numpy.save"));
    }
    struct host_error error = {0};
    put_npy(&b, 1, "<f8", false, "4");
    put_values(&b, 20, true, false);
    assert_int_equal(
        host_tetrahedra_parse("a.npy", b.data, b.n, &tets, NULL, &error),
        HOST_INPUT);
    assert_non_null(strstr(error.text, "4 columns of floating-point numbers"));
}

TEST(binary_nan_is_named) {
    struct bytes b = {.n = 0};
    put_text(&b, "ply\nformat binary_little_endian 1.0\nelement vertex 4\n"
                 "property float x\nproperty float y\nproperty float z\n"
                 "end_header\n");
    size_t start = b.n;
    put_values(&b, 12, false, false);
    b.n = start + 4 * 7;
    put_number(&b, NAN, false, false);
    b.n = start + 48;
    struct host_points points;
    struct host_error error = {0};
    assert_int_equal(host_points_parse("a.ply", b.data, b.n, &points, &error),
                     HOST_INPUT);
    assert_non_null(
        strstr(error.text, "a.ply: point 2 (counted from 0): y is NaN; "));
}

TEST(plot3d_of_every_variant) {
    for (int bits = 0; bits < 32; bits++) {
        bool big = (bits & 1) != 0, marks = (bits & 2) != 0;
        bool wide = (bits & 4) != 0, iblank = (bits & 16) != 0;
        uint64_t blocks = (bits & 8) != 0 ? 2 : 1;
        struct bytes b = {.n = 0};
        if (blocks == 2) {
            if (marks)
                put_word(&b, 4, 4, big);
            put_word(&b, blocks, 4, big);
            if (marks)
                put_word(&b, 4, 4, big);
        }
        if (marks)
            put_word(&b, 12 * blocks, 4, big);
        for (uint64_t k = 0; k < blocks; k++) {
            put_word(&b, 2, 4, big);
            put_word(&b, 3, 4, big);
            put_word(&b, 2 + k, 4, big);
        }
        if (marks)
            put_word(&b, 12 * blocks, 4, big);
        uint64_t first = 0;
        for (uint64_t k = 0; k < blocks; k++) {
            uint64_t n = 6 * (2 + k);
            uint64_t length = n * ((wide ? 24u : 12u) + (iblank ? 4u : 0u));
            if (marks)
                put_word(&b, length, 4, big);
            for (uint64_t i = 0; i < 3 * n; i++) {
                put_number(&b, value_of(3 * (first + i % n) + i / n), wide,
                           big);
            }
            for (uint64_t i = 0; iblank && i < n; i++)
                put_word(&b, 1, 4, big);
            if (marks)
                put_word(&b, length, 4, big);
            first += n;
        }
        expect_rows("a.p3d", &b, first);
        expect_rows("a.x", &b, first);
        /* Cut by whole words it may be another variant. */
        expect_cuts_refused("a.bin", &b, b.n - 3);
    }
}

/* Real files in more than one form hold the same points. */
TEST(real_data) {
    struct host_points points = {0};
    struct host_error error = {0};
    if (!reference_data("bluntfin.xyz.gz", &points)) {
        print_message("bluntfin.xyz.gz: not there\n");
        skip();
    }
    assert_int_equal(points.count, 40960);
    if (points.xyz == NULL) {
        fail();
        return;
    }
    /* as the original: big-endian single precision PLOT3D, 40 x 32 x 32 */
    size_t bytes = 12 + 12 * 40960;
    struct bytes b = {.n = 0};
    uint8_t *file = malloc(bytes + 64);
    assert_non_null(file);
    put_word(&b, 40, 4, true);
    put_word(&b, 32, 4, true);
    put_word(&b, 32, 4, true);
    memcpy(file, b.data, 12);
    for (uint64_t i = 0; i < 3 * 40960; i++) {
        b.n = 0;
        put_number(&b, points.xyz[3 * (i % 40960) + i / 40960], false, true);
        memcpy(file + 12 + 4 * i, b.data, 4);
    }
    struct host_points again;
    assert_int_equal(
        host_points_parse("bluntfinxyz.bin", file, bytes, &again, &error), 0);
    assert_int_equal(again.count, points.count);
    assert_memory_equal(again.xyz, points.xyz, 24 * points.count);
    free(file);
    host_points_free(&again);
    host_points_free(&points);
}
