/* Points in .pts, .obj, .stl and .las, made here line by line and byte by byte,
 * whole, cut short and wrong. */
#include "bytes.h"

static void expect_text(const char *path, const char *text, uint64_t n) {
    static struct bytes b;
    b.n = 0;
    put_text(&b, text);
    expect_rows(path, &b, n);
}

TEST(pts_with_and_without_a_count) {
    static const char *const two[] = {
        "2\n-3 -2.5 -2 55 52 44 65\n-1.5 -1 -.5 228 228 230 225\n",
        "  2 \r\n-3 -2.5 -2\r\n-1.5 -1 -.5 -1200\r\n\r\n",
        "-3 -2.5 -2 55\n-1.5 -1 -.5", "1\n-3 -2.5 -2 1\n1\n-1.5 -1 -.5 1\n",
        "0\n2\n-3 -2.5 -2 1\n-1.5 -1 -.5 1\n0\n"};
    for (size_t i = 0; i < sizeof two / sizeof two[0]; i++)
        expect_text("a.pts", two[i], 2);
    refused("a.pts", "3\n1 2 3\n4 5 6\n", "a.pts:4:1: fewer than the 3 points");
    refused("a.pts", "1\n1 2 3\n4 5 6\n", "a.pts:3:1: more than the 1 points");
    refused("a.pts", "2\n1 2 3\n2\n4 5 6\n", "a.pts:3:2: 1 column");
    refused("a.pts", "1 2 3\n1\n4 5 6\n", "a.pts:2:2: 1 column");
    refused("a.pts", "2.5\n1 2 3\n", "a.pts:1:4: 1 column");
    refused("a.pts", "0\n", "holds no point");
}

TEST(obj_of_every_habit) {
    static const char *const two[] = {
        ("# made here\nmtllib a.mtl\no v 1\nv -3 -2.5 -2\nv -1.5 -1 -.5\n"
         "vn 0 0 1\nvt 0 1\nvp 7 7 7\nf 1//1 2//1 1//1\n"),
        "v -3 -2.5 -2 1.0\r\nv -1.5 -1 -.5 0.5 0.25 1 # colours\r\n",
        "v \\\n-3 -2.5\\\n \\\r\n -2\nv\t-1.5 -1 -.5 \\\n 1.0\n",
        "f 1 2 \\\nv 7 7 7\nv -3 -2.5 -2\ng a \\\n\\\nv 8 8 8\nv -1.5 -1 -.5",
        "# C:\\models\\\nv -3 -2.5 -2 # C:\\\nv -1.5 -1 -.5\\",
        "\xef\xbb\xbfv -3 -2.5 -2\nusemtl a\\b\nv -1.5 -1 -.5\nend\n"};
    for (size_t i = 0; i < sizeof two / sizeof two[0]; i++)
        expect_text("a.obj", two[i], 2);
    refused("a.obj", "v 1 2 3\nv 1 2\n", "a.obj:2:6: the line ends where");
    refused("a.obj", "v 1 2 \\\nv 1 2 3\n", "a.obj:2:1: 'v' is no number");
    refused("a.obj", "v 1 2 nan\n", "a.obj:1:7: NaN");
    refused("a.obj", "v 1 2 3/4\n", "a.obj:1:7: '3/4' is no number");
    refused("a.obj", "v 1 2\\x 3\n", "a.obj:1:6: '\\x' is no number");
    refused("a.obj", "vn 1 2 3\n", "holds no point");
}

static const char facet[] = "facet normal 0 -nan 1e999\n  outer loop\n"
                            "    vertex -3 -2.5 -2\n    vertex -1.5 -1 -.5\n"
                            "    vertex 0 .5 1\n  endloop\nendfacet\n";

TEST(stl_as_text) {
    static const char *const forms[] = {
        "solid\n%sendsolid\n", "\r\nsolid a # solid\r\n%sEndSolid a\r\n",
        "solid a\nendsolid\nSOLID b\n%sendsolid b"};
    char text[512];
    for (size_t i = 0; i < sizeof forms / sizeof forms[0]; i++) {
        (void)snprintf(text, sizeof text, forms[i], facet);
        expect_text("a.stl", text, 3);
    }
    expect_text("a.stl",
                "solid\nfacet normal 0 0 1 outer loop vertex -3 -2.5 -2 vertex "
                "-1.5 -1 -.5 vertex 0 .5 1 endloop endfacet\nendsolid\n",
                3);
    struct bytes b = {.n = 0};
    (void)snprintf(text, sizeof text, forms[0], facet);
    put_text(&b, text);
    b.n -= 2; /* with "endsoli" */
    expect_cuts_refused("a.stl", &b, 0);
    refused("a.stl", "solid\nendsolid\n", "holds no point");
    refused("a.stl",
            "solid\nfacet normal 0 0 1\nouter loop\nvertex 1 2 3\n"
            "vertex 1 2 3\nendloop\n",
            "a.stl:6:1: 'vertex' is due, three times");
    refused("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 1 2 x\n",
            "a.stl:4:12: 'x' is no number");
    refused("a.stl", "solid\nvertex 1 2 3\n", "a.stl:2:1: 'facet' or");
    refused("a.stl", "v 1 2 3\n", "a.stl: neither text");
}

/* A header of any bytes, also those with which text begins. */
TEST(stl_in_binary) {
    static const char *const headers[] = {"made here", "solid made here\n", ""};
    for (size_t i = 0; i < sizeof headers / sizeof headers[0]; i++) {
        struct bytes b = {.n = 0};
        put_text(&b, headers[i]);
        while (b.n < 80)
            put_word(&b, ' ', 1, false);
        put_word(&b, 2, 4, false);
        for (uint64_t k = 0; k < 2; k++) {
            for (int d = 0; d < 3; d++)
                put_number(&b, NAN, false, false); /* a normal that is none */
            for (uint64_t n = 0; n < 9; n++)
                put_number(&b, value_of(9 * k + n), false, false);
            put_word(&b, 0xffff, 2, false); /* a colour, as some have it */
        }
        expect_rows("a.stl", &b, 6);
        expect_cuts_refused("a.stl", &b, 0);
        put_word(&b, 0, 1, false);
        struct host_points points;
        struct host_error error = {0};
        assert_int_equal(
            host_points_parse("a.stl", b.data, b.n, &points, &error),
            HOST_INPUT);
        if (i != 1) { /* which is told as text that goes wrong */
            assert_non_null(strstr(error.text, "185 bytes where 2 facets take "
                                               "184; "));
        }
    }
}

/* --- .las ----------------------------------------------------------------- */

static const unsigned lengths[] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

/* What a file says, and may say wrongly. */
struct las {
    unsigned minor, format, header, gap, length, rows;
    uint64_t few, many;
    bool signature;
};

static void put_zeros(struct bytes *b, size_t until) {
    while (b->n < until)
        put_word(b, 0, 1, false);
}

/* Records whose points are value_of: X / 1024 - 2^20 and the like. */
static void put_las(struct bytes *b, const struct las *las) {
    static const double scale = 0x1p-10, shift = -0x1p20;
    b->n = 0;
    put_text(b, "LASF");
    put_zeros(b, 24);
    put_word(b, 1, 1, false);
    put_word(b, las->minor, 1, false);
    put_text(b, "a system, and what has made this");
    put_zeros(b, 94);
    put_word(b, las->header, 2, false);
    put_word(b, las->header + las->gap, 4, false);
    put_word(b, 0, 4, false);
    put_word(b, las->format, 1, false);
    put_word(b, las->length, 2, false);
    put_word(b, las->few, 4, false);
    put_zeros(b, 131);
    for (int d = 0; d < 6; d++)
        put_number(b, d < 3 ? scale : shift, true, false);
    put_zeros(b, las->minor < 4 ? las->header : 247);
    if (las->minor == 4) {
        put_word(b, las->many, 8, false);
        put_zeros(b, las->header);
    }
    for (unsigned i = 0; i < las->gap; i++)
        put_word(b, 'g', 1, false);
    put(b, "\xdd\xcc", las->signature ? 2 : 0);
    for (unsigned i = 0; i < las->rows; i++) {
        const size_t end = b->n + las->length;
        for (unsigned d = 0; d < 3; d++) {
            double whole = (value_of(3 * i + d) - shift) / scale;
            put_word(b, (uint64_t)(int64_t)whole, 4, false);
        }
        while (b->n < end)
            put_word(b, 0xff, 1, false);
    }
}

TEST(las_of_every_version) {
    static struct bytes b;
    for (unsigned minor = 0; minor <= 4; minor++) {
        for (unsigned format = 0; format <= (minor < 4 ? 5 : 10); format++) {
            for (unsigned extra = 0; extra <= 7; extra += 7) {
                struct las las = {.minor = minor,
                                  .format = format,
                                  .header = minor < 3   ? 227
                                            : minor < 4 ? 235
                                                        : 375,
                                  .gap = 9 * extra,
                                  .length = lengths[format] + extra,
                                  .rows = 4,
                                  .few = format < 6 ? 4 : 0,
                                  .many = 4};
                put_las(&b, &las);
                expect_rows("a.las", &b, 4);
                expect_cuts_refused("a.las", &b, 0);
                put_text(&b, "what follows, as waveforms and others do");
                expect_rows("a.las", &b, 4);
            }
        }
    }
}

/* Rounded once by the product and once by the sum, in that order. */
TEST(las_is_rounded_as_specified) {
    static struct bytes b;
    const struct las las = {
        .minor = 2, .header = 227, .length = 20, .rows = 1, .few = 1};
    const double scale = 0.01, shift[] = {500000.1, -4.1e6, 1e-3};
    const int32_t whole[] = {INT32_MIN, 123456789, -1};
    put_las(&b, &las);
    b.n = 131;
    for (int d = 0; d < 6; d++)
        put_number(&b, d < 3 ? scale : shift[d - 3], true, false);
    b.n = 227;
    for (int d = 0; d < 3; d++)
        put_word(&b, (uint32_t)whole[d], 4, false);
    b.n += 8;
    struct host_points points;
    struct host_error error = {0};
    assert_int_equal(host_points_parse("a.las", b.data, b.n, &points, &error),
                     0);
    for (int d = 0; d < 3; d++) {
        volatile double product = whole[d] * scale;
        assert_true(points.xyz[d] == product + shift[d]);
    }
    host_points_free(&points);
}

/* Of 1.0, whose points begin behind a signature: within the offset or not. */
TEST(las_with_a_signature) {
    static struct bytes b;
    struct las las = {
        .header = 227, .length = 20, .rows = 3, .few = 3, .signature = true};
    put_las(&b, &las);
    expect_rows("a.las", &b, 3);
    b.data[96] = (uint8_t)(b.data[96] + 2);
    expect_rows("a.las", &b, 3);
}

TEST(las_that_is_wrong) {
    static const struct {
        struct las las;
        const char *why;
    } wrong[] = {
        {{.minor = 5, .header = 375, .length = 20}, "LAS 1.5, where 1.0 to"},
        {{.format = 11, .header = 227, .length = 99},
         "record format 11, where"},
        {{.format = 128, .header = 227, .length = 20}, "compressed, which"},
        {{.format = 67, .header = 227, .length = 34}, "laszip -i IN.laz"},
        {{.header = 200, .length = 20}, "a header of 200 bytes"},
        {{.minor = 4, .header = 227, .length = 20}, "a header of 227 bytes"},
        {{.format = 3, .header = 227, .length = 33}, "33 bytes each"},
        {{.header = 227, .length = 0}, ", 0 bytes each"},
        {{.header = 227, .length = 20, .rows = 2, .few = UINT32_MAX},
         "3 points where its header tells of 4294967295; "},
        {{.minor = 4, .header = 375, .length = 20, .many = UINT64_MAX},
         "0 points where its header tells of 18446744073709551615; "},
        {{.minor = 4, .header = 375, .length = 20, .few = 1, .many = 2},
         "tells of 1 points and of 2; "},
        {{.header = 227, .length = 20}, "holds no point"}};
    static struct bytes b;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct host_points points;
        struct host_error error = {0};
        put_las(&b, &wrong[i].las);
        put_zeros(&b, 300);
        assert_int_equal(
            host_points_parse("a.las", b.data, b.n, &points, &error),
            HOST_INPUT);
        if (strstr(error.text, wrong[i].why) == NULL)
            fail_msg("expected '%s' in '%s'", wrong[i].why, error.text);
    }
    refused("a.las", "1 2 3\n", "no LAS file");
}

/* Known by extension or by what the file begins with, packed or not. */
TEST(known_and_not_read) {
    static struct bytes b;
    refused("a.laz", "1 2 3\n", "a.laz: LAS whose points LASzip has compr");
    refused("a.LAZ.gz", "1 2 3\n", "pdal translate IN.laz OUT.las");
    refused("a.e57", "1 2 3\n", "a.e57: E57 (ASTM E2807), which is not read;");
    refused("a.E57.gz", "1 2 3\n", "pdal translate IN.e57 OUT.las");
    refused("a.xyz", "ASTM-E57", "a.xyz: E57 (ASTM E2807), which");
    refused("-", "ASTM-E57\1", "stdin: E57 (ASTM E2807), which");
    refused("a.npy", "ASTM-E5", "a.npy: ");
    for (unsigned mark = 0; mark < 256; mark += 64) {
        const struct las las = {
            .minor = 2, .format = (uint8_t)mark, .header = 227, .length = 20};
        struct host_points points;
        struct host_error error = {0};
        put_las(&b, &las);
        assert_int_equal(
            host_points_parse("a.ply", b.data, b.n, &points, &error),
            HOST_INPUT);
        assert_int_equal(strstr(error.text, "ply: LAS whose points") != NULL,
                         mark != 0);
        error = (struct host_error){0};
        assert_int_equal(
            host_points_parse("a.ply", b.data, 104, &points, &error),
            HOST_INPUT);
        assert_null(strstr(error.text, "LAS"));
    }
    struct host_tetrahedra tets;
    struct host_error error = {0};
    assert_int_equal(
        host_tetrahedra_parse("a.vtu", "ASTM-E57", 8, &tets, NULL, &error),
        HOST_INPUT);
    assert_non_null(strstr(error.text, "a.vtu: E57 (ASTM E2807), which"));
}
