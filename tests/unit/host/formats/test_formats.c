/* The table of formats: what it lists, and points in each format written and
 * read back, packed, or not to be had. */
#include <unistd.h>
#include <zlib.h>

#include "bytes.h"
#include "host/formats/output.h"
#include "host/formats/formats.h"
#include "host/formats/write.h"
#include "host/mesh/gen.h"

static const char *list_of(enum host_use use) {
    static char list[HOST_FORMAT_LIST_MAX];
    host_format_list(use, list, sizeof list);
    return list;
}

/* What help and messages say is what there is. */
TEST(listed) {
    char text[HOST_FORMAT_LIST_MAX], small[16];
    static const enum host_use uses[] = {HOST_READ_POINTS, HOST_WRITE_POINTS,
                                         HOST_READ_TETRAHEDRA,
                                         HOST_WRITE_TETRAHEDRA};
    const struct host_format *f;
    for (unsigned u = 0; u < sizeof uses / sizeof uses[0]; u++) {
        char all[HOST_FORMAT_LIST_MAX] = "";
        for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++) {
            const bool has[] = {f->read_points != NULL, f->write_points != NULL,
                                f->read_tetrahedra != NULL,
                                f->write_tetrahedra != NULL};
            for (unsigned k = 0; has[u] && f->extensions[k] != NULL; k++) {
                strcat(strcat(all, all[0] == '\0' ? "" : " "),
                       f->extensions[k]);
            }
        }
        assert_string_equal(list_of(uses[u]), all);
    }
    /* What the first of each list is, "-" is. */
    assert_memory_equal(list_of(HOST_READ_POINTS), ".xyz .txt ", 10);
    assert_memory_equal(list_of(HOST_WRITE_TETRAHEDRA), ".ele ", 5);
    host_format_help(HOST_WRITE_TETRAHEDRA, text, sizeof text);
    assert_non_null(strstr(
        text, ".ele (TetGen; with .node, .neigh and .face beside it), .vtu "));
    host_format_help(HOST_READ_POINTS, text, sizeof text);
    assert_non_null(
        strstr(text, ".xyz .txt (text), .pts (Leica), .csv (comma"));
    host_format_help(HOST_READ_POINTS, small, sizeof small);
    assert_memory_equal(small, text, sizeof small - 1);
    assert_int_equal(small[sizeof small - 1], '\0');
}

/* No extension is in two rows, nor ends another that is found before it. */
TEST(found_by_extension) {
    const struct host_format *f;
    for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++) {
        assert_non_null(f->name);
        assert_non_null(f->extensions[0]);
        assert_true(f->unread != NULL || f->read_points != NULL ||
                    f->read_tetrahedra != NULL || f->write_points != NULL ||
                    f->write_tetrahedra != NULL);
        for (unsigned k = 0; f->extensions[k] != NULL; k++) {
            char path[64];
            assert_int_equal(f->extensions[k][0], '.');
            (void)snprintf(path, sizeof path, "dir.off/a%s", f->extensions[k]);
            assert_ptr_equal(host_format_named(path), f);
            for (char *c = path; *c != '\0'; c++)
                *c = *c >= 'a' && *c <= 'z' ? (char)(*c - 32) : *c;
            strcat(path, ".Gz");
            assert_ptr_equal(host_format_named(path), f);
            assert_null(host_format_of(path, HOST_WRITE_POINTS));
            assert_null(host_format_of(path, HOST_WRITE_TETRAHEDRA));
        }
    }
    assert_null(host_format_named("a.pdf"));
    assert_null(host_format_named("a"));
    assert_null(host_format_named(".ply")); /* a name, no extension */
    assert_null(host_format_named("-"));
    assert_null(host_format_of("a.msh", HOST_READ_POINTS));
    assert_null(host_format_of("a.vts", HOST_WRITE_POINTS));
    assert_null(host_format_of("a.xyz", HOST_READ_TETRAHEDRA));
    assert_null(host_format_of("a.vtp", HOST_WRITE_TETRAHEDRA));
    f = host_format_named("a.xyz");
    assert_ptr_equal(host_format_of("-", HOST_READ_POINTS), f);
    assert_ptr_equal(host_format_of("-", HOST_WRITE_POINTS), f);
    f = host_format_named("a.ele");
    assert_ptr_equal(host_format_of("-", HOST_READ_TETRAHEDRA), f);
    assert_ptr_equal(host_format_of("-", HOST_WRITE_TETRAHEDRA), f);
}

/* By a name that an option gives, which is that of an extension. */
TEST(told_by_name) {
    struct host_error error = {0};
    const struct host_format *f;
    for (unsigned i = 0; (f = host_format_row(i)) != NULL; i++) {
        for (unsigned k = 0; f->read_points != NULL && f->extensions[k] != NULL;
             k++) {
            char name[32];
            const char *dotted = f->extensions[k];
            assert_ptr_equal(host_format_told(dotted, HOST_READ_POINTS, &error),
                             f);
            (void)snprintf(name, sizeof name, "%s.GZ", dotted + 1);
            assert_ptr_equal(host_format_told(name, HOST_READ_POINTS, &error),
                             f);
            assert_null(host_format_told(name, HOST_WRITE_POINTS, &error));
            assert_int_equal(error.code, HOST_USAGE);
            error = (struct host_error){0};
        }
    }
    static const char *const wrong[] = {"",    ".", "frob",         "gz",
                                        "ele", "-", "xyz.gz.gz.gz", "a b"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_null(host_format_told(wrong[i], HOST_READ_POINTS, &error));
        assert_int_equal(error.code, HOST_USAGE);
        assert_non_null(strstr(error.text, list_of(HOST_READ_POINTS)));
        error = (struct host_error){0};
    }
    assert_null(host_format_told("laz", HOST_READ_POINTS, &error));
    assert_non_null(strstr(error.text, "--format laz: LAS whose points "));
}

TEST(written_and_read_back) {
    char list[HOST_FORMAT_LIST_MAX];
    struct host_points points, again;
    struct host_error error = {0};
    assert_int_equal(host_gen("uniform", 1000, 2, &points, &error), 0);
    points.xyz[0] = 4.9e-324;
    points.xyz[1] = -1.7976931348623157e308;
    points.xyz[2] = -0.0;
    points.xyz[3] = 123456789012;
    points.base = 1;
    host_format_list(HOST_WRITE_POINTS, list, sizeof list);
    for (char *word = strtok(list, " "); word != NULL;
         word = strtok(NULL, " ")) {
        char path[64];
        (void)snprintf(path, sizeof path, "/tmp/incode-test-%ld%s",
                       (long)getpid(), word);
        assert_int_equal(host_points_write(path, &points, &error), 0);
        assert_int_equal(host_output_commit(&error), 0);
        assert_int_equal(host_points_read(path, &again, &error), 0);
        assert_int_equal(again.count, points.count);
        assert_memory_equal(again.xyz, points.xyz, 24 * points.count);
        assert_int_equal(again.base, strcmp(word, ".node") == 0 ? 1 : 0);
        host_points_free(&again);
        assert_int_equal(unlink(path), 0);
    }
    assert_int_equal(host_points_write("/tmp/a.stl", &points, &error),
                     HOST_USAGE);
    assert_non_null(strstr(error.text, "use .xyz .txt"));
    host_points_free(&points);
}

TEST(packed_files) {
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
        for (b.n = whole; b.n < whole + padding;)
            put_word(&b, 0, 1, false);
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

TEST(files_that_are_not_there) {
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
