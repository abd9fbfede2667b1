/* Every format of points: written and read back, or made here byte by byte;
 * every kind of wrong input: refused with its place. */
#include <unistd.h>
#include <zlib.h>

#include "host/mesh/gen.h"
#include "host/files/output.h"
#include "host/formats/write.h"
#include "host/files/source.h"
#include "bytes.h"
#include "tests/unit/reference.h"

/* --- Text ------------------------------------------------------------- */

static void numbers_are_correctly_rounded(void **unused)
{
    (void)unused;
    static const char *const hard[] = {
        "0",
        "-0",
        "1",
        "+1.5",
        ".5",
        "5.",
        "1e3",
        "1E-3",
        "1e22",
        "1e23",
        "9007199254740993",
        "9007199254740992.9999999999",
        "1e-19",
        "123456789012345678",
        "12345678901234567890",
        "4.9e-324",
        "2e-324",
        "1.7976931348623157e308",
        "2.2250738585072014e-308",
        "2.2250738585072011e-308",
        "0.1",
        "0.30000000000000004",
        "179769313486231570000000000000000000000000000000000000000000000000000",
        "0.000000000000000000000000000000000000000000000000000000000000000012",
        "6929495644600919.5",
        "3.518437208883201171875e13",
        "1448997445238699e0",
        "9214843084008499",
        "0.500000000000000166533453"};
    struct bytes *b = calloc(1, sizeof *b);
    assert_non_null(b);
    uint64_t state = 1;
    for (int i = 0; i < 200000; i++) {
        char text[128];
        if (i < (int)(sizeof hard / sizeof *hard)) {
            strcpy(text, hard[i]);
        } else {
            state = state * 6364136223846793005u + 1442695040888963407u;
            uint64_t m = state >> (state & 63);
            state = state * 6364136223846793005u + 1442695040888963407u;
            int places = (int)(state >> 59);
            (void)snprintf(text, sizeof text,
                           i % 3 == 0 ? "%llu.%llue%d" : "-%llu.%llu",
                           (unsigned long long)(m >> 20),
                           (unsigned long long)(m & 0xfffff), places - 16);
            if (i % 5 == 0) {
                (void)snprintf(text, sizeof text, "%llue-%d",
                               (unsigned long long)m, places);
            }
        }
        double expected = strtod(text, NULL);
        b->n = 0;
        put_text(b, text);
        put_text(b, " 1 2");
        struct host_points points;
        struct host_error error = {0};
        assert_int_equal(
            host_points_parse("a.xyz", b->data, b->n, &points, &error), 0);
        if (points.xyz[0] != expected ||
            signbit(points.xyz[0]) != signbit(expected)) {
            fail_msg("%s: %.17g, not %.17g", text, points.xyz[0], expected);
        }
        host_points_free(&points);
    }
    free(b);
}

/* Reads every beginning of a file, with nothing readable behind it. */
static void read_cuts(const char *path, const struct bytes *b)
{
    for (size_t n = 1; n < b->n; n++) {
        struct host_points points;
        struct host_error error = {0};
        uint8_t *copy = malloc(n);
        assert_non_null(copy);
        memcpy(copy, b->data, n);
        (void)host_points_parse(path, copy, n, &points, &error);
        host_points_free(&points);
        free(copy);
    }
}

static void text_in_all_its_habits(void **unused)
{
    (void)unused;
    struct bytes b = {.n = 0};
    put_text(&b, "\xef\xbb\xbf# a comment\r\n\r\n-3 -2.5\t-2 # behind\r\n"
                 "  -1.5,-1 , -.5\n\n\n0;.5e0;1D0");
    expect_rows("a.xyz", &b, 3);
    expect_rows("-", &b, 3);
    expect_rows("A.TXT", &b, 3);
    b.n = 0;
    put_text(&b, ",-3,,-2.5;,-2,,\n;;\n-1.5,;-1 -.5");
    expect_rows("a.xyz", &b, 2);
    b.n = 0;
    put_text(&b, "x,\"y [m]\",z\n-3,-2.5,-2\n");
    expect_rows("a.csv", &b, 1);
    static const char quoted[] =
        "name;Z (m);\"id, or none\";x [m];Y\n"
        "\"a;\"\"b\";-2;#1;-3;-2.5\n\n# between\n;\"-.5\" ; ;-1.5;-1;\n";
    static const char *const named[] = {
        "X,Y,Z\n-3,-2.5,-2\n-1.5,-1,-.5\n",
        "# made\n z , y, \"x\" \r\n-2,-2.5,-3\r\n-.5,-1,-1.5\r\n",
        "y x z\n-2.5 -3 -2\n  -1  -1.5\t-.5 # behind\n",
        quoted,
        "id  z   y/mm x\n0 -2  -2.5   -3\nb#c -.5 -1 -1.5  \n",
        "\xef\xbb\xbf,x,y,z\n0,-3,-2.5,-2\n,-1.5,-1,-.5\n",
        "east,north,height,\n-3,-2.5,-2\n-1.5,-1,-.5,\n",
        "t\tx\ty\tz\t\n\t-3\t-2.5\t-2\n1\t-1.5\t-1\t-.5\t\n",
        "x,y,z\n\"-3\",\"-2.5\" ,-2, # one, two\n-1.5,-1,-.5 # x, y, z\n",
        "x,y,z\n-3 -2.5 -2\r\n\r\n,,\r\n-1.5\t-1\t-.5\r\n",
        "x y z\n-3, -2.5, -2\n-1.5;-1;-.5;\n",
        "-3,-2.5,-2,\n-1.5 , -1 ;-.5 # behind\n",
        "  -3\t\t-2.5  -2\n -1.5 -1,-.5"};
    for (size_t i = 0; i < sizeof named / sizeof named[0]; i++) {
        b.n = 0;
        put_text(&b, named[i]);
        expect_rows("a.csv", &b, 2);
        read_cuts("a.csv", &b);
    }
    b.n = 0;
    put_text(&b, "# made by hand\n3 3 1 1\n1 -3 -2.5 -2 7 1\n"
                 "2 -1.5 -1 -.5 7 1\n 3 0 .5 1 7 1\n# end\n");
    expect_rows("a.node", &b, 3);
    b.n = 0;
    put_text(&b, "NOFF # with normals\n2 1 0\n-3 -2.5 -2 0 0 1\n"
                 "-1.5 -1 -.5 0 0 1\n3 0 1 0\n");
    expect_rows("a.off", &b, 2);
}

static void text_faults_have_their_place(void **unused)
{
    (void)unused;
    refused("a.xyz", "1 2 3\n4 5 six\n", "a.xyz:2:5: 'six' is no number; ");
    refused("a.xyz", "1 2 3\n4 5 6x\n", "a.xyz:2:5: '6x' is no number; ");
    refused("a.xyz", "1 2 3\n\n4 nan 6\n", "a.xyz:3:3: NaN");
    refused("a.xyz", "1 2 3\n4 -NaN 6\n", "a.xyz:2:3: NaN");
    refused("a.xyz", "1 inf 3\n", "a.xyz:1:3: infinity");
    refused("a.xyz", "1 -Infinity 3\n", "a.xyz:1:3: infinity");
    refused("a.xyz", "1 1e999 3\n", "a.xyz:1:3: the number is too large");
    refused("a.xyz", "1 2\n", "a.xyz:1:4: 2 columns");
    refused("a.xyz", "1\n", "a.xyz:1:2: 1 column");
    refused("a.xyz", "1 2 3 4\n", "a.xyz:1:7: more than 3 columns");
    refused("a.xyz", "0x1p3 2 3\n", "a.xyz:1:1: '0x1p3' is no number");
    refused("a.xyz", "1e 2 3\n", "a.xyz:1:1: '1e' is no number");
    refused("a.xyz", "1 2 - 3\n", "a.xyz:1:5: '-' is no number");
    refused("a.xyz", "x y z\n1 2 3\n", "a.xyz:1:1: 'x' is no number");
    refused("a.csv", "x,y,z\n1,2,q\n", "a.csv:2:5: 'q' is no number");
    refused("a.csv", "x,y\n1,2,3\n", "a.csv:1:1: the names of columns are");
    refused("a.csv", "a,b,c,d\n1,2,3\n", "a.csv:1:1: the names of columns");
    refused("a.csv", "x,y,X [m],z\n1,2,3,4\n", "a.csv:1:1: two columns");
    refused("a.csv", "x,y,z,t\n1,2,3,4\n5,6,7\n", "a.csv:3:5: more or fewer");
    refused("a.csv", "x,y,z,t\n1,2,3,4,5\n", "a.csv:2:9: more or fewer");
    refused("a.csv", "x,t,y,z\n1,2,3\n", "a.csv:2:5: more or fewer");
    refused("a.csv", "x,t,y,z\n1,2,,4\n", "a.csv:2:5: ");
    refused("a.csv", "x,t,y,z\n1,2,3 3,4\n", "a.csv:2:7: more than one number");
    refused("a.csv", "x,t,y,z\n1,2,3,q\n", "a.csv:2:7: 'q' is no number");
    refused("a.csv", "z,y,x\n1,2,3,4\n", "a.csv:2:7: more or fewer columns");
    refused("a.csv", "x,y,z\n1,,2,3\n", "a.csv:2:3: an empty field");
    refused("a.csv", "x y z\n4 5 6\n1,,2\n", "a.csv:3:3: an empty field");
    refused("a.csv", "x,y,z\n,1,2\n", "a.csv:2:1: an empty field");
    refused("a.csv", "x,y,z\n1,2,\"\"\n", "a.csv:2:6: an empty field");
    refused("a.csv", "x,y,z\n1,2, # 3\n", "a.csv:2:6: ");
    refused("a.csv", "x,y,z\n1,2,3,,\n", "a.csv:2:7: more or fewer columns");
    refused("a.csv", "x,y,z\n1,2 # 5,3\n", "a.csv:2:3: more or fewer columns");
    refused("a.csv", "x;y;z\n1,5;2\n", "a.csv:2:3: more than one number");
    refused("a.csv", "1,2,3\n1,,2,3\n", "a.csv:2:3: an empty field");
    refused("a.csv", "1,2,3\n1, ;2\n", "a.csv:2:4: an empty field");
    refused("a.csv", "1,2,3\n ,1,2,3\n", "a.csv:2:3: an empty field");
    refused("a.csv", "1,2,3,,\n", "a.csv:1:7: an empty field");
    refused("a.csv", "1,2\n", "a.csv:1:4: 2 columns");
    refused("a.csv", "1,2,3,4\n", "a.csv:1:7: more than 3 columns");
    refused("a.csv", "\"1\",\"2\",\"3\"\n", "a.csv:1:1: '\"1\"' is no number");
    refused("a.csv", "nan,nan,nan\n1,2,3\n", "a.csv:1:1: NaN is no");
    refused("a.csv", "inf;inf;inf\n1;2;3\n", "a.csv:1:1: infinity is no");
    refused("a.csv", "Infinity NaN INF\n1 2 3\n", "a.csv:1:1: infinity");
    refused("a.csv", "\"nan\",\"nan\",\"nan\"\n1,2,3\n",
            "a.csv:1:1: '\"nan\"'");
    refused("a.xyz", "# nothing\n", "holds no point");
    refused("a.xyz", "", "is empty");
    refused("-", "1 2 x\n", "stdin:1:5: 'x'");
    refused("a.pdf", "1 2 3\n", "no format of points");
    refused("a", "1 2 3\n", "no format of points");
    refused("a.node", "2 3 0 0\n1 1 2 3\n", "a.node:3:1: the file ends");
    refused("a.node", "2 2 0 0\n1 1 2\n", "not 3 dimensions");
    refused("a.node", "2 3 0 0\n1 1 2 3\n3 1 2 3\n", "a.node:3:2: points");
    refused("a.node", "2 3 0 0\n1 1 2\n", "a.node:2:6: the line ends");
    refused("a.off", "2 0 0\n", "the first word is not OFF");
    refused("a.off", "OFF\n2 0 0\n1 2 3\n", "a.off:4:1: the file ends");
    refused("a.off", "OFF BINARY\n", "binary OFF");
}

/* Bytes of zero are told as such, where they are. */
static void binary_is_no_text(void **unused)
{
    (void)unused;
    static const struct {
        const char *path, *bytes, *where;
        size_t n;
    } files[] = {{"a.xyz", "1 2 3\n4 5\0 6\n", "a.xyz:2:4: a NUL byte", 14},
                 {"a.xyz", "1 2 3\n\0\0\0\0", "a.xyz:2:1: a NUL byte", 10},
                 {"a.xyz", "1\0 \0002\0 \0003\0\n", "a.xyz:1:2: a NUL", 11},
                 {"a.csv", "x,y,t,z\n1,2,3,\0", "a.csv:2:7: a NUL byte", 15},
                 {"a.node", "2\0 3 0 0\n", "a.node:1:2: a NUL byte", 9}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        struct host_points points;
        struct host_error error = {0};
        assert_int_equal(host_points_parse(files[i].path, files[i].bytes,
                                           files[i].n, &points, &error),
                         HOST_INPUT);
        if (strstr(error.text, files[i].where) == NULL) {
            fail_msg("%s, not %s", error.text, files[i].where);
        }
    }
}

/* What a header counts is what there is. */
static void text_is_as_long_as_it_says(void **unused)
{
    (void)unused;
    struct bytes b = {.n = 0};
    refused("a.node", "2 3 0 0\n1 1 2 3\n2 1 2 4\n# end\n\n3 1 2 5\n",
            "a.node:6:1: a row beyond the number of points");
    put_text(&b, "# TetGen's\n\n 2  3  2  1\n\n  0 -3 -2.5 -2 9 9 1 # first\n"
                 "\n1 -1.5 -1 -.5 9 9 0\n\n# Generated by tetgen -pq\n");
    expect_rows("a.node", &b, 2);
    /* five vertices, of which the header tells of six or four */
    static const char off[] = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n"
                              "3 0 1 2\n3 0 1 3 255 0 0\n";
    static const struct {
        const char *head, *wrong;
    } heads[] = {
        {"6 2 0", "a.off:8:8: a vertex with more or fewer numbers"},
        {"5 3 0", "a.off:10:1: the file has fewer vertices or faces"},
        {"5 1 0", "a.off:9:1: a row beyond the numbers of vertices"},
        {"4 2 0", "a.off:9:1: a row beyond the numbers of vertices"},
        {"5 0 0", "a.off:8:1: a row beyond the numbers of vertices"},
    };
    for (size_t i = 0; i < sizeof heads / sizeof heads[0]; i++) {
        char text[256];
        (void)snprintf(text, sizeof text, "OFF\n%s\n%s", heads[i].head, off);
        refused("a.off", text, heads[i].wrong);
    }
    b.n = 0;
    put_text(&b, "COFF\n# made\n3 2\n\n-3 -2.5 -2 255 0 0 1\n"
                 "-1.5 -1 -.5 .5 1 1 # red\n0 .5 1 .5 1 1\n\n4 0 1\n2 0 0.5 "
                 "1 1\n3 0 1 2 7\n# end\n");
    refused("a.off", (char *)b.data, "a.off:6:20: a vertex with more or fewer");
    b.n = 0;
    put_text(&b, "COFF 3 2 0\n# made\n\n-3 -2.5 -2 255 0 0 1\n"
                 "-1.5 -1 -.5 .5 1 1 0# red\n0 .5 1 .5 1 1 0\n\n4 0 1 2 0 0.5 "
                 "1 1\n3 0 1 2\n\n# end\n");
    expect_rows("a.off", &b, 3);
}

/* --- Binary ----------------------------------------------------------- */

static void ply_of_every_coding(void **unused)
{
    (void)unused;
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
                if (i % 3 == 0) {
                    put_word(&b, 200, 1, big);
                }
                put_number(&b, value_of(i), wide != 0, big);
                if (i % 3 == 2) {
                    put_word(&b, 1, 2, big);
                }
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
static void ply_is_as_long_as_it_says(void **unused)
{
    (void)unused;
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
        if (heads[i].wrong != NULL) {
            refused("a.ply", (char *)b.data, heads[i].wrong);
        } else {
            expect_rows("a.ply", &b, 4);
        }
    }
}

static void npy_of_every_kind(void **unused)
{
    (void)unused;
    for (int bits = 0; bits < 16; bits++) {
        bool big = (bits & 1) != 0, wide = (bits & 2) != 0;
        bool fortran = (bits & 4) != 0;
        int version = (bits & 8) != 0 ? 2 : 1;
        struct bytes b = {.n = 0};
        char header[128];
        (void)snprintf(header, sizeof header,
                       "{'descr': '%cf%d', 'fortran_order': %s, 'shape': (5, "
                       "3), }%*s\n",
                       big ? '>' : '<', wide ? 8 : 4,
                       fortran ? "True" : "False", 20, "");
        put(&b, "\x93NUMPY", 6);
        put_word(&b, (uint64_t)version, 1, false);
        put_word(&b, 0, 1, false);
        put_word(&b, strlen(header), version == 1 ? 2 : 4, false);
        put_text(&b, header);
        for (uint64_t i = 0; i < 15; i++) {
            uint64_t at = fortran ? i % 5 * 3 + i / 5 : i;
            put_number(&b, value_of(at), wide, big);
        }
        expect_rows("a.npy", &b, 5);
        expect_cuts_refused("a.npy", &b, 0);
        put_word(&b, 0, 1, false);
        struct host_points points;
        struct host_error error = {0};
        assert_int_equal(
            host_points_parse("a.npy", b.data, b.n, &points, &error),
            HOST_INPUT);
    }
}

static void binary_nan_is_named(void **unused)
{
    (void)unused;
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

static void plot3d_of_every_variant(void **unused)
{
    (void)unused;
    for (int bits = 0; bits < 32; bits++) {
        bool big = (bits & 1) != 0, marks = (bits & 2) != 0;
        bool wide = (bits & 4) != 0, iblank = (bits & 16) != 0;
        uint64_t blocks = (bits & 8) != 0 ? 2 : 1;
        struct bytes b = {.n = 0};
        if (blocks == 2) {
            if (marks) {
                put_word(&b, 4, 4, big);
            }
            put_word(&b, blocks, 4, big);
            if (marks) {
                put_word(&b, 4, 4, big);
            }
        }
        if (marks) {
            put_word(&b, 12 * blocks, 4, big);
        }
        for (uint64_t k = 0; k < blocks; k++) {
            put_word(&b, 2, 4, big);
            put_word(&b, 3, 4, big);
            put_word(&b, 2 + k, 4, big);
        }
        if (marks) {
            put_word(&b, 12 * blocks, 4, big);
        }
        uint64_t first = 0;
        for (uint64_t k = 0; k < blocks; k++) {
            uint64_t n = 6 * (2 + k);
            uint64_t length = n * ((wide ? 24u : 12u) + (iblank ? 4u : 0u));
            if (marks) {
                put_word(&b, length, 4, big);
            }
            for (uint64_t i = 0; i < 3 * n; i++) {
                put_number(&b, value_of(3 * (first + i % n) + i / n), wide,
                           big);
            }
            for (uint64_t i = 0; iblank && i < n; i++) {
                put_word(&b, 1, 4, big);
            }
            if (marks) {
                put_word(&b, length, 4, big);
            }
            first += n;
        }
        expect_rows("a.p3d", &b, first);
        expect_rows("a.x", &b, first);
        /* Cut by whole words it may be another variant. */
        expect_cuts_refused("a.bin", &b, b.n - 3);
    }
}

/* --- Files ------------------------------------------------------------ */

static void written_and_read_back(void **unused)
{
    (void)unused;
    static const char *const extensions[] = {
        "xyz", "txt", "csv", "node", "ply", "off", "npy", "vtk", "vtu", "vtp"};
    struct host_points points, again;
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", 1000, 2, &points, &error), 0);
    points.xyz[0] = 4.9e-324;
    points.xyz[1] = -1.7976931348623157e308;
    points.xyz[2] = -0.0;
    points.xyz[3] = 123456789012;
    for (size_t i = 0; i < sizeof extensions / sizeof *extensions; i++) {
        char path[64];
        (void)snprintf(path, sizeof path, "/tmp/incode-test-%ld.%s",
                       (long)getpid(), extensions[i]);
        points.base = i % 2;
        assert_int_equal(host_points_write(path, &points, &error), 0);
        assert_int_equal(host_output_commit(&error), 0);
        assert_int_equal(host_points_read(path, &again, &error), 0);
        assert_int_equal(again.count, points.count);
        assert_memory_equal(again.xyz, points.xyz, 24 * points.count);
        assert_int_equal(again.base, i == 3 ? 1 : 0);
        host_points_free(&again);
        assert_int_equal(unlink(path), 0);
    }
    assert_int_equal(host_points_write("/tmp/a.stl", &points, &error),
                     HOST_USAGE);
    host_points_free(&points);
}

static void packed_files(void **unused)
{
    (void)unused;
    const char *text = "-3 -2.5 -2\n-1.5 -1 -.5\n";
    struct bytes b = {.n = 0};
    for (int member = 0; member < 2; member++) {
        z_stream z;
        memset(&z, 0, sizeof z);
        assert_int_equal(deflateInit2(&z, 6, Z_DEFLATED, 15 + 16, 8, 0), Z_OK);
        uint8_t plain[64];
        memcpy(plain, text, strlen(text) + 1);
        z.next_in = plain + 11 * member;
        z.avail_in = member == 0 ? 11 : (uInt)strlen(text) - 11;
        z.next_out = b.data + b.n;
        z.avail_out = 1000;
        assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
        b.n += z.total_out;
        (void)deflateEnd(&z);
    }
    expect_rows("a.xyz.gz", &b, 2);
    size_t whole = b.n;
    for (size_t padding = 1; padding <= 512; padding *= 8) {
        for (b.n = whole; b.n < whole + padding;) {
            put_word(&b, 0, 1, false);
        }
        expect_rows("a.xyz.gz", &b, 2);
    }
    struct host_points points;
    struct host_error error = {0};
    put_word(&b, 7, 1, false);
    assert_int_equal(
        host_points_parse("a.xyz.gz", b.data, b.n, &points, &error),
        HOST_INPUT);
    error = (struct host_error){0};
    b.n = whole - 3;
    assert_int_equal(
        host_points_parse("a.xyz.gz", b.data, b.n, &points, &error),
        HOST_INPUT);
    assert_non_null(strstr(error.text, "cut short"));
    refused("a.xyz.gz", "1 2 3\n4 5 6\n", "damaged");
    b.n = 0;
}

static void files_that_are_not_there(void **unused)
{
    (void)unused;
    struct host_points points;
    struct host_error error = {0};
    assert_int_equal(host_points_read("/nowhere/a.xyz", &points, &error),
                     HOST_INPUT);
    assert_non_null(strstr(error.text, "/nowhere/a.xyz: cannot be opened"));
    error = (struct host_error){0};
    char name[64];
    (void)snprintf(name, sizeof name, "/tmp/incode-dir-%ld.xyz",
                   (long)getpid());
    (void)unlink(name);
    assert_int_equal(host_points_read("/tmp/.", &points, &error), HOST_INPUT);
    error = (struct host_error){0};
    const struct host_points one = {.xyz = (double[3]){1, 2, 3}, .count = 1};
    assert_int_equal(host_points_write("/nowhere/a.xyz", &one, &error),
                     HOST_INPUT);
    assert_non_null(strstr(error.text, "cannot be written"));
    error = (struct host_error){0};
    if (access("/dev/full", W_OK) == 0) {
        assert_int_equal(symlink("/dev/full", name), 0);
        assert_int_equal(host_points_write(name, &one, &error), HOST_INPUT);
        assert_non_null(strstr(error.text, "writing failed"));
        assert_int_equal(unlink(name), 0);
    }
}

/* Real files in more than one form hold the same points. */
static void real_data(void **unused)
{
    (void)unused;
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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_correctly_rounded),
        cmocka_unit_test(text_in_all_its_habits),
        cmocka_unit_test(text_faults_have_their_place),
        cmocka_unit_test(binary_is_no_text),
        cmocka_unit_test(text_is_as_long_as_it_says),
        cmocka_unit_test(ply_is_as_long_as_it_says),
        cmocka_unit_test(ply_of_every_coding),
        cmocka_unit_test(npy_of_every_kind),
        cmocka_unit_test(binary_nan_is_named),
        cmocka_unit_test(plot3d_of_every_variant),
        cmocka_unit_test(written_and_read_back),
        cmocka_unit_test(packed_files),
        cmocka_unit_test(files_that_are_not_there),
        cmocka_unit_test(real_data),
    };
    return cmocka_run_group_tests_name("readers", tests, NULL, NULL);
}
