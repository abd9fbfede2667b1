/* Points as text: in all its habits, and every kind of wrong input refused with
 * its place. */
#include "bytes.h"

TEST(numbers_are_correctly_rounded) {
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
            signbit(points.xyz[0]) != signbit(expected))
            fail_msg("%s: %.17g, not %.17g", text, points.xyz[0], expected);
        host_points_free(&points);
    }
    free(b);
}

/* Reads every beginning of a file, with nothing readable behind it. */
static void read_cuts(const char *path, const struct bytes *b) {
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

TEST(text_in_all_its_habits) {
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

/* A line of names, // before comments, lines that end in CR alone. */
TEST(text_of_other_tools) {
    static const struct {
        const char *path, *text;
        bool named;
    } files[] = {
        {"a.xyz", "x y z\n-3 -2.5 -2\n-1.5 -1 -.5\n", true},
        {"a.txt", "Z;Y;X\r\n-2;-2.5;-3\r\n-.5;-1;-1.5\r\n", true},
        {"-", " east north  height\n  -3\t-2.5  -2\n-1.5\t-1\t-.5", true},
        {"a.csv", "x,y,z\n-3,-2.5,-2\n-1.5,-1,-.5\n", false},
        {"a.xyz", "//X Y Z\n-3 -2.5 -2 // one\n // two\n-1.5 -1 -.5\n", false},
        {"a.csv", "// x\nx,y,z\n-3,-2.5,-2\n//\n-1.5,-1,-.5\n", false},
        {"a.xyz", "# made\r-3 -2.5 -2\r-1.5 -1 -.5\r", false},
        {"a.txt", "x y z\r\r-3 -2.5 -2\r-1.5 -1 -.5", true},
        {"a.xyz", "-3 -2.5 -2\r-1.5 -1 -.5\r\n", false},
        {"a.xyz", "-3 -2.5 -2\r\r\n-1.5 -1 -.5\r\r\n", false},
        {"a.csv", "x,y,z\r-3,-2.5,-2\r-1.5,-1,-.5\r", false},
        {"a.node", "2 3 0 0\r1 -3 -2.5 -2\r2 -1.5 -1 -.5\r", false}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        struct host_points points;
        struct host_error error = {0};
        struct bytes b = {.n = 0};
        put_text(&b, files[i].text);
        expect_rows(files[i].path, &b, 2);
        assert_int_equal(
            host_points_parse(files[i].path, b.data, b.n, &points, &error), 0);
        assert_memory_equal(b.data, files[i].text, b.n); /* not its to change */
        assert_int_equal(points.named, files[i].named);
        assert_false(points.wide);
        host_points_free(&points);
    }
    refused("a.xyz", "1 2 3\r4 5 six\r", "a.xyz:2:5: 'six' is no number; ");
    refused("a.xyz", "my points\n1 2 3\n", "; name the columns x, y and z, or");
    refused("a.xyz", "12\nwater\n1 2 3\n", "or, where it counts the points, ");
    refused("a.xyz", "1 2 3 /4\n5 6 // 7\n", "a.xyz:2:5: 2 columns");
}

/* Commas that are decimal ones are refused; where they may be columns, that is
 * noted. */
TEST(decimal_commas) {
    static const struct {
        const char *text;
        bool doubtful;
    } files[] = {{"0,1,0,2,0,3\n1,1,1,2,1,3\n", true},
                 {"12,40,7,255,0,0\n-1,2,-3,4\n", true},
                 {"0,1,0,2,0,3\n1,1,1,2.5,1,3\n", false},
                 {"1.5,1,0,2,0,3\n1,1,1,2,1,3\n", false},
                 {"12,40,7,255\n1,2,3\n", false},
                 {"1,2,3\n12,40,7,255\n", false},
                 {" 12, 40,  7,255\n100,200,  7,255\n", false},
                 {"10,20,30,x7\n1,2,3,4\n", false},
                 {"10;20;30;7,5\n1,2,3,4", false}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        struct host_points points;
        struct host_error error = {0};
        assert_int_equal(host_points_parse("a.csv", files[i].text,
                                           strlen(files[i].text), &points,
                                           &error),
                         0);
        assert_true(points.wide);
        assert_int_equal(points.doubtful, files[i].doubtful);
        host_points_free(&points);
    }
    static const char *const whole =
        "more than 3 columns, all of whole numbers";
    refused("a.csv", "1,5, 2,5, 3,5\n", "a.csv:1:8: more than 3 columns, all");
    refused("a.csv", "1,5, 2,5, 3\n", whole);
    refused("a.csv", "0,1,0,2,0,3\n1,05,1,2,3,4\n", "a.csv:2:8: more than 3");
    refused("a.txt", "1,5,2,05,3,5\n1,5,02,5,3,5 # x\n", whole);
    refused("a.csv", "x;y;z\n1,5;2,5;3,5\n", "write decimal points where");
}

/* The first three count, whatever the others hold and however many they are. */
TEST(columns_after_the_third) {
    static const struct {
        const char *path, *text;
        bool wide;
    } files[] = {
        {"a.xyz", "-3 -2.5 -2 255 0 0\n-1.5 -1 -.5 0 255 0\n", true},
        {"a.txt", "-3 -2.5 -2\n-1.5 -1 -.5 red 'or so' nan \\ \"\r\n", true},
        {"a.xyz", "-3,-2.5,-2,1,,,\n-1.5, -1, -.5 one, two # three\n", true},
        {"a.xyz", "-3\t-2.5 -2  7;8\n-1.5,-1,-.5,\n", true},
        {"a.csv", "-3,-2.5,-2,,\n-1.5,-1,-.5,\"a,b\",1e999\n", true},
        {"a.csv", "-3;-2.5;-2;7,5;8\n-1.5;-1;-.5", true},
        {"-", "-3 -2.5 -2 9\n-1.5 -1 -.5 9 9", true},
        {"a.xyz", "-3 -2.5 -2 # 9\n-1.5 -1 -.5,\n", false},
        {"a.csv", "x,y,z,r\n-3,-2.5,-2,9\n-1.5,-1,-.5,9\n", false}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        struct host_points points;
        struct host_error error = {0};
        struct bytes b = {.n = 0};
        put_text(&b, files[i].text);
        expect_rows(files[i].path, &b, 2);
        assert_int_equal(
            host_points_parse(files[i].path, b.data, b.n, &points, &error), 0);
        assert_int_equal(points.wide, files[i].wide);
        host_points_free(&points);
    }
}

TEST(text_faults_have_their_place) {
    refused("a.xyz", "1 2 3\n4 5 six\n", "a.xyz:2:5: 'six' is no number; ");
    refused("a.xyz", "1 2 3\n4 5 6x\n", "a.xyz:2:5: '6x' is no number; ");
    refused("a.xyz", "1 2 3\n\n4 nan 6\n", "a.xyz:3:3: NaN");
    refused("a.xyz", "1 2 3\n4 -NaN 6\n", "a.xyz:2:3: NaN");
    refused("a.xyz", "1 inf 3\n", "a.xyz:1:3: infinity");
    refused("a.xyz", "1 -Infinity 3\n", "a.xyz:1:3: infinity");
    refused("a.xyz", "1 1e999 3\n", "a.xyz:1:3: the number is too large");
    refused("a.xyz", "1 2\n", "a.xyz:1:4: 2 columns");
    refused("a.xyz", "1\n", "a.xyz:1:2: 1 column");
    refused("a.xyz", "1 2 3 4\n5 6\n", "a.xyz:2:4: 2 columns");
    refused("a.xyz", "1 2 3 4\n5 6 # 7\n", "a.xyz:2:5: 2 columns");
    refused("a.xyz", "1,5 2,5 3,5\n", "a.xyz:1:7: more than 3 columns, parted");
    refused("a.txt", "1 2,5 3\n", "a.txt:1:7: more than 3 columns, parted");
    refused("a.txt", "1 2 3,5\n", "a.txt:1:7: more than 3 columns, parted");
    refused("a.csv", "1,5;2,5;3,5\n", "a.csv:1:7: more than 3 columns, parted");
    refused("a.xyz", "0x1p3 2 3\n", "a.xyz:1:1: '0x1p3' is no number");
    refused("a.xyz", "1e 2 3\n", "a.xyz:1:1: '1e' is no number");
    refused("a.xyz", "1 2 - 3\n", "a.xyz:1:5: '-' is no number");
    refused("a.xyz", "1 2 3\nx y z\n",
            "a.xyz:2:1: 'x' is no number; correct "
            "it, or put # before");
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
    refused("a.csv", "1,2\n", "a.csv:1:4: 2 columns");
    refused("a.csv", "1,2,3,4\n5,6\n", "a.csv:2:4: 2 columns");
    refused("a.csv", "1,2,3,4\n5,,6,7\n", "a.csv:2:3: an empty field");
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
TEST(binary_is_no_text) {
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
        if (strstr(error.text, files[i].where) == NULL)
            fail_msg("%s, not %s", error.text, files[i].where);
    }
}

/* What a header counts is what there is. */
TEST(text_is_as_long_as_it_says) {
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
