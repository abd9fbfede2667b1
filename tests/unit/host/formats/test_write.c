/* Tetrahedra in every format: written and read back, converted, and every kind
 * of wrong input refused with its place. */
#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/formats/output.h"
#include "host/formats/convert.h"
#include "host/formats/read.h"
#include "host/formats/write.h"
#include "host/mesh/gen.h"
#include "tests/unit/reference.h"
#include "tests/unit/test.h"

struct folder {
    char name[64];
};

static struct folder make_folder(void) {
    struct folder f;
    strcpy(f.name, "/tmp/incode-tets-XXXXXX");
    assert_non_null(mkdtemp(f.name));
    return f;
}

static const char *in_folder(const struct folder *f, const char *name,
                             char path[128]) {
    (void)snprintf(path, 128, "%s/%s", f->name, name);
    return path;
}

/* Removes the folder; returns how many files were in it. */
static int remove_folder(const struct folder *f) {
    DIR *dir = opendir(f->name);
    assert_non_null(dir);
    int count = 0;
    for (struct dirent *e; (e = readdir(dir)) != NULL;) {
        char path[512];
        if (e->d_name[0] != '.') {
            (void)snprintf(path, sizeof path, "%s/%s", f->name, e->d_name);
            assert_int_equal(unlink(path), 0);
            count++;
        }
    }
    (void)closedir(dir);
    assert_int_equal(rmdir(f->name), 0);
    return count;
}

static void triangulate(struct host_points *points,
                        struct host_tetrahedra *tets) {
    struct host_error error = {0};
    *tets = (struct host_tetrahedra){0};
    assert_int_equal(host_gen("uniform", 200, 4, points, &error), 0);
    reference_delaunay(points->xyz, 200, tets);
    host_tetrahedra_sort(tets);
}

static void write_whole(const char *path, const struct host_points *points,
                        const struct host_tetrahedra *tets) {
    struct host_error error = {0};
    assert_int_equal(host_write(path, NULL, points, tets, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
}

TEST(written_and_read_back) {
    static const char *const names[] = {"a.vtu",    "a.vtk", "a.msh", "a.mesh",
                                        "a.vtkhdf", "a.npy", "a.ele"};
    struct host_points points, read;
    struct host_tetrahedra tets, again;
    struct host_error error = {0};
    struct folder folder = make_folder();
    triangulate(&points, &tets);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        for (uint32_t base = 0; base < 2; base++) {
            char path[128];
            points.base = base;
            in_folder(&folder, names[i], path);
            assert_int_equal(host_write_probe(path, NULL, &error), 0);
            write_whole(path, &points, &tets);
            if (host_tetrahedra_read(path, &again, &read, &error) != 0)
                fail_msg("%s", error.text);
            assert_int_equal(again.count, tets.count);
            assert_memory_equal(again.v, tets.v, 16 * tets.count);
            assert_int_equal(read.count, i < 5 ? 200 : 0);
            if (i < 5)
                assert_memory_equal(read.xyz, points.xyz, 24 * 200);
            host_tetrahedra_free(&again);
            host_points_free(&read);
        }
    }
    char path[128];
    in_folder(&folder, "a.node", path);
    assert_int_equal(host_points_read(path, &read, &error), 0);
    assert_int_equal(read.base, 1);
    assert_memory_equal(read.xyz, points.xyz, 24 * 200);
    host_points_free(&read);
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    assert_int_equal(remove_folder(&folder), 10);
}

/* .neigh and .face against all pairs of tetrahedra. */
TEST(neighbours_are_right) {
    struct host_points points;
    struct host_tetrahedra tets;
    struct folder folder = make_folder();
    char path[128];
    triangulate(&points, &tets);
    write_whole(in_folder(&folder, "a.ele", path), &points, &tets);
    FILE *neigh = fopen(in_folder(&folder, "a.neigh", path), "r");
    FILE *face = fopen(in_folder(&folder, "a.face", path), "r");
    assert_non_null(neigh);
    assert_non_null(face);
    unsigned long long count, four, number, facets, one;
    assert_int_equal(fscanf(neigh, "%llu %llu", &count, &four), 2);
    assert_int_equal(fscanf(face, "%llu %llu", &facets, &one), 2);
    assert_int_equal(count, tets.count);
    unsigned long long hull = 0;
    for (uint64_t i = 0; i < tets.count; i++) {
        assert_int_equal(fscanf(neigh, "%llu", &number), 1);
        assert_int_equal(number, i);
        for (uint32_t k = 0; k < 4; k++) {
            long long other, expected = -1;
            uint32_t f[3], g[3];
            assert_int_equal(fscanf(neigh, "%lld", &other), 1);
            host_facet_outward(tets.v[i], k, f);
            for (uint64_t j = 0; j < tets.count; j++) {
                for (uint32_t c = 0; c < 4 && j != i; c++) {
                    host_facet_outward(tets.v[j], c, g);
                    expected = reference_same(f, g) ? (long long)j : expected;
                }
            }
            assert_int_equal(other, expected);
            if (expected == -1) {
                unsigned long long n, v[3], marker;
                assert_int_equal(fscanf(face, "%llu %llu %llu %llu %llu", &n,
                                        &v[0], &v[1], &v[2], &marker),
                                 5);
                assert_int_equal(n, hull++);
                assert_true(v[0] == f[0] && v[1] == f[1] && v[2] == f[2]);
            }
        }
    }
    assert_int_equal(hull, facets);
    (void)fclose(neigh);
    (void)fclose(face);
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    assert_int_equal(remove_folder(&folder), 4);
}

TEST(failures_leave_nothing) {
    struct host_points points;
    struct host_tetrahedra tets;
    struct folder folder = make_folder();
    char path[128];
    triangulate(&points, &tets);
    /* A disk that fills: no file may grow past 1,000 bytes. */
    struct rlimit old, small = {1000, 1000};
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old), 0);
    small.rlim_max = old.rlim_max;
    (void)signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    static const char *const names[] = {"a.vtu", "a.ele", "a.npy"};
    int codes[3];
    struct host_error errors[3] = {{0}};
    for (int i = 0; i < 3; i++) {
        in_folder(&folder, names[i], path);
        codes[i] = host_write(path, NULL, &points, &tets, &errors[i]);
    }
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &old), 0);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(codes[i], HOST_INPUT);
        assert_non_null(strstr(errors[i].text, "writing failed"));
    }
    struct host_error error = {0};
    assert_int_equal(host_write("/nowhere/a.vtu", NULL, &points, &tets, &error),
                     HOST_INPUT);
    error = (struct host_error){0};
    assert_int_equal(host_write_probe("/nowhere/a.vtu", NULL, &error),
                     HOST_INPUT);
    error = (struct host_error){0};
    assert_int_equal(host_write_check("a.stl", &error), HOST_USAGE);
    assert_non_null(
        strstr(error.text, "use .ele .vtu .vtk .vtkhdf .hdf .msh "));
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    assert_int_equal(remove_folder(&folder), 0);
}

TEST(links_are_followed) {
    struct host_points points;
    struct host_tetrahedra tets, again;
    struct host_error error = {0};
    struct folder folder = make_folder();
    char target[128], link[128];
    triangulate(&points, &tets);
    in_folder(&folder, "target.npy", target);
    in_folder(&folder, "link.npy", link);
    write_whole(target, &points, &tets);
    host_tetrahedra_cut(&tets, 10);
    assert_int_equal(symlink(target, link), 0);
    write_whole(link, &points, &tets);
    struct stat status;
    assert_int_equal(lstat(link, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    assert_int_equal(host_tetrahedra_read(target, &again, NULL, &error), 0);
    assert_int_equal(again.count, 10);
    host_tetrahedra_free(&again);
    host_tetrahedra_free(&tets);
    host_points_free(&points);
    assert_int_equal(remove_folder(&folder), 2);
}

static void refused(const char *path, const char *text, const char *expected) {
    struct host_tetrahedra tets;
    struct host_error error = {0};
    assert_int_equal(
        host_tetrahedra_parse(path, text, strlen(text), &tets, NULL, &error),
        HOST_INPUT);
    if (strstr(error.text, expected) == NULL)
        fail_msg("expected '%s' in '%s'", expected, error.text);
    assert_non_null(strstr(error.text, "; "));
}

TEST(faults_have_their_place) {
    refused("a.ele", "2 4 0\n0 0 1 2 3\n1 0 1 2\n", "a.ele:3:8: fewer than 4");
    refused("a.ele", "2 4 0\n0 0 1 2 3\n", "a.ele:3:1: the file ends");
    refused("a.ele", "1 4 0\n0 0 1 2 x\n", "a.ele:2:9: a whole number is due");
    refused("a.ele", "1 4 0\n0 0 1 2 -3\n", "a.ele:2:9: a whole number");
    refused("a.ele", "1 10 0\n0 0 1 2 3\n", "other than 4 vertices");
    refused("a.ele", "1 4 0\n1 0 1 2 3\n", "a.ele:2:10: a vertex of this");
    refused("a.ele", "1 4 0\n0 0 1 2 99999999999\n",
            "a.ele:2:20: a vertex of this tetrahedron is no row of points");
    refused("a.ele", "1 4 0\n0 0 1 2 3\n# end\n1 0 1 2 4\n",
            "a.ele:4:1: a row beyond the number");
    refused("a.msh",
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Elements\n1\n"
            "1 4 2 1 1 1 2 3 4\n2 4 2 1 1 1 2 3 5\n$EndElements\n",
            "a.msh:7:1: a row beyond the number");
    static const char *const rows[] = {"1 4 2 1 1 1 2 3", "1 4 2 1", "1 4",
                                       "1"};
    static const int columns[] = {16, 8, 4, 2};
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char text[160], where[64];
        (void)snprintf(text, sizeof text,
                       "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Elements\n2\n"
                       "%s\n2 15 2 0 1 4\n$EndElements\n",
                       rows[i]);
        (void)snprintf(where, sizeof where,
                       "a.msh:6:%d: an element with fewer numbers", columns[i]);
        refused("a.msh", text, where);
    }
    refused("a.mesh",
            "MeshVersionFormatted 2\nDimension 3\nTetrahedra\n1\n"
            "1 2 3 4 0\n1 2 3 5 0\nEnd\n",
            "a.mesh:6:1: a row beyond the number");
    refused("a.vtu",
            "<VTKFile>\n<Piece NumberOfPoints=\"5\" NumberOfCells=\"1\">\n"
            "<Cells><DataArray type=\"Int32\" Name=\"connectivity\">0 1 2 3 "
            "0 1 2 4</DataArray><DataArray type=\"Int32\" Name=\"offsets\">4 "
            "8</DataArray><DataArray type=\"UInt8\" Name=\"types\">10 10"
            "</DataArray></Cells>\n</Piece></VTKFile>",
            "a.vtu:4: more cells than NumberOfCells");
    refused("a.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", "version 2");
    refused("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "$Elements");
    refused("a.mesh", "MeshVersionFormatted 2\nDimension 3\n",
            "no Tetrahedra section");
    refused("a.vtk",
            "# vtk DataFile Version 2.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n"
            "POINTS 1 float\n1 2 3\nCELLS 1 9\n8 0 0 0 0 0 0 0 0\n"
            "CELL_TYPES 1\n12\n",
            "no tetrahedron");
    refused("a.xyz", "1 2 3\n", "no format of tetrahedra");
}

TEST(other_writers_files) {
    static const char *const files[][2] = {
        {"a.vtk", "# vtk DataFile Version 5.1\nt\nASCII\n"
                  "DATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n"
                  "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\nMETADATA\nINFORMATION 0\n\n"
                  "CELLS 4 11\nOFFSETS vtktypeint64\n0 3 7 11\n"
                  "CONNECTIVITY vtktypeint64\n0 1 2 0 1 2 3\n1 2 3 4\n"
                  "CELL_TYPES 3\n5\n10\n10\n"},
        {"a.vtk", "# vtk DataFile Version 3.0\nt\nASCII\n"
                  "DATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n"
                  "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\nCELLS 3 14\n3 0 1 2\n"
                  "4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 3\n5\n10\n10\n"},
        {"a.vtu",
         "<VTKFile><UnstructuredGrid><Piece NumberOfPoints=\"5\" "
         "NumberOfCells=\"2\"><Points><DataArray type=\"Float32\" "
         "format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataArray></Points>"
         "<Cells><DataArray type=\"Int32\" Name=\"connectivity\" "
         "format=\"ascii\">0 1 2 3 1 2 3 4</DataArray><DataArray "
         "type=\"Int32\" Name=\"offsets\" format=\"ascii\">4 8</DataArray>"
         "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10"
         "</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"},
        {"a.ele", "# by hand\n2 4 1\n1 1 2 3 4 9\n2 2 3 4 5 9\n"},
        {"a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n"
                  "$EndNodes\n$Elements\n3\n1 2 2 0 1 1 2 3\n"
                  "7 4 2 0 1 1 2 3 4\n8 4 0 2 3 4 5\n$EndElements\n"},
        {"a.mesh", "MeshVersionFormatted 1\nDimension\n3\nVertices 1\n0 0 0 7\n"
                   "Triangles 1\n1 2 3 4\nTetrahedra 2\n1 2 3 4 0\n"
                   "2 3 4 5 0\nEnd\n"},
    };
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        struct host_tetrahedra tets;
        struct host_points points;
        struct host_error error = {0};
        if (host_tetrahedra_parse(files[i][0], files[i][1], strlen(files[i][1]),
                                  &tets, &points, &error) != 0)
            fail_msg("%zu: %s", i, error.text);
        const uint32_t expected[8] = {0, 1, 2, 3, 1, 2, 3, 4};
        assert_int_equal(tets.count, 2);
        assert_memory_equal(tets.v, expected, sizeof expected);
        host_tetrahedra_free(&tets);
        host_points_free(&points);
    }
}

TEST(conversion) {
    struct host_points points;
    struct host_tetrahedra tets, again;
    struct host_error error = {0};
    struct folder folder = make_folder();
    char a[128], b[128];
    triangulate(&points, &tets);
    in_folder(&folder, "a.ele", a);
    write_whole(a, &points, &tets);
    static const char *const chain[] = {"b.vtu",    "b.msh",  "b.vtk",
                                        "b.vtkhdf", "b.mesh", "b.npy"};
    for (size_t i = 0; i < sizeof chain / sizeof *chain; i++) {
        in_folder(&folder, chain[i], b);
        assert_int_equal(host_convert(a, NULL, b, &error), 0);
        strcpy(a, b);
    }
    assert_int_equal(host_tetrahedra_read(b, &again, NULL, &error), 0);
    assert_int_equal(again.count, tets.count);
    assert_memory_equal(again.v, tets.v, 16 * tets.count);
    host_tetrahedra_free(&again);
    /* .npy holds no points and there is no .node beside it */
    assert_int_equal(
        host_convert(b, NULL, in_folder(&folder, "c.vtu", a), &error),
        HOST_INPUT);
    error = (struct host_error){0};
    in_folder(&folder, "p.xyz", a);
    in_folder(&folder, "p.npy", b);
    assert_int_equal(host_points_write(a, &points, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    assert_int_equal(host_convert(a, NULL, b, &error), 0);
    struct host_points read;
    assert_int_equal(host_points_read(b, &read, &error), 0);
    assert_memory_equal(read.xyz, points.xyz, 24 * 200);
    host_points_free(&read);
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    assert_int_equal(remove_folder(&folder), 12);
}

/* --- coordinates as text -------------------------------------------------- */

/* What a point with this x has in an .xyz for it. */
static const char *printed(const char *path, const double *x, unsigned n,
                           char *text, size_t size) {
    struct host_points points = {0};
    struct host_error error = {0};
    for (unsigned i = 0; i < n; i++) {
        const double xyz[3] = {x[i], 0, 0};
        assert_int_equal(host_points_append(&points, xyz, 1, &error), 0);
    }
    assert_int_equal(host_points_write(path, &points, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    host_points_free(&points);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    size_t used = fread(text, 1, size - 1, file);
    assert_true(used < size - 1);
    text[used] = '\0';
    (void)fclose(file);
    return text;
}

/* The digits of a number, but for those that only place its point. */
static int significant(const char *number, char digits[64]) {
    int n = 0;
    for (; *number != '\0' && *number != 'e'; number++)
        if (*number >= (n == 0 ? '1' : '0') && *number <= '9')
            digits[n++] = *number;
    while (n > 0 && digits[n - 1] == '0')
        n--;
    digits[n] = '\0';
    return n;
}

/* The number reads back; none with fewer digits does, and with as many none is
 * nearer. */
static void check_number(const char *number, double x) {
    char other[64], digits[64], others[64];
    if (strtod(number, NULL) != x)
        fail_msg("%s, and not %.17g", number, x);
    int n = significant(number, digits);
    assert_true(n <= 17);
    if (n > 1) {
        (void)snprintf(other, sizeof other, "%.*e", n - 2, x);
        if (strtod(other, NULL) == x)
            fail_msg("%s, where %s does", number, other);
    }
    (void)snprintf(other, sizeof other, "%.*e", n > 0 ? n - 1 : 0, x);
    (void)significant(other, others);
    if (strtod(other, NULL) == x && strcmp(digits, others) != 0)
        fail_msg("%s, where %s is nearer", number, other);
}

/* Of many sizes; some of few digits, some next to powers of two. */
static void draw_numbers(double *x, int n, uint64_t *state) {
    for (int i = 0; i < n; i++) {
        *state = *state * 6364136223846793005u + 1442695040888963407u;
        double part = 1 + (double)(*state >> 12) * 0x1p-52;
        int exponent = (int)(*state % 71) - 18;
        if (i % 4 == 1) {
            double tens = i % 8 == 1 ? 1e3 : 1e7;
            part = floor(part * tens) / tens;
            exponent = 0;
        } else if (i % 64 == 2) {
            part = i % 128 == 2 ? 1 : 2 - 0x1p-52;
        } else if (i % 64 == 3) {
            exponent = (int)(*state >> 8 & 2047) - 1074;
        }
        x[i] = ldexp(part, exponent < 1023 ? exponent : 1023);
    }
}

TEST(fewest_digits) {
    enum { MANY = 4096, TEXT = 64 * MANY };
    static const struct {
        double x;
        const char *text;
    } known[] = {{512051.182, "512051.182"},
                 {0.1, "0.1"},
                 {-0.1, "-0.1"},
                 {1.0 / 3, "0.3333333333333333"},
                 {0.1 + 0.2, "0.30000000000000004"},
                 {-123.456, "-123.456"},
                 {0.00001, "0.00001"},
                 {0.00002345, "0.00002345"},
                 {0.000001, "1e-06"},
                 {5e-324, "5e-324"},
                 {-0.0, "-0"},
                 {1e15, "1e+15"},
                 {999999999999999.875, "999999999999999.9"},
                 {562949953421312.25, "562949953421312.2"},
                 {562949953421312.75, "562949953421312.8"},
                 {0.99999999999999989, "0.9999999999999999"},
                 {1.0000000000000002, "1.0000000000000002"},
                 {0x1p-10, "0.0009765625"},
                 {0x1p-16, "0.0000152587890625"},
                 {7e22, "7e+22"},
                 {1.7976931348623157e308, "1.7976931348623157e+308"}};
    struct folder folder = make_folder();
    char path[128], *text = malloc(TEXT), *line;
    double *x = malloc(MANY * sizeof *x);
    assert_true(text != NULL && x != NULL);
    in_folder(&folder, "a.xyz", path);
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        printed(path, &known[i].x, 1, text, TEXT);
        char expected[64];
        (void)snprintf(expected, sizeof expected, "%s 0 0\n", known[i].text);
        assert_string_equal(text, expected);
    }
    uint64_t state = 1;
    for (int round = 0; round < 40; round++) {
        draw_numbers(x, MANY, &state);
        line = (char *)printed(path, x, MANY, text, TEXT);
        for (int i = 0; i < MANY; i++) {
            char *end = strchr(line, ' ');
            assert_non_null(end);
            *end = '\0';
            check_number(line, x[i]);
            line = strchr(end + 1, '\n');
            assert_non_null(line);
            line++;
        }
    }
    free(x);
    free(text);
    assert_int_equal(remove_folder(&folder), 1);
}

/* The .node of the points stays as it is beside their .ele, whatever it is
 * called there; others are written. */
TEST(input_is_left) {
    struct host_points points;
    struct host_tetrahedra tets;
    struct host_error error = {0};
    struct folder folder = make_folder();
    struct stat before, after;
    char node[128], ele[128], name[128];
    triangulate(&points, &tets);
    in_folder(&folder, "a.node", node);
    in_folder(&folder, "a.ele", ele);
    assert_int_equal(host_points_write(node, &points, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    assert_int_equal(symlink("a.node", in_folder(&folder, "b.node", name)), 0);
    assert_int_equal(chmod(node, 0444), 0);
    assert_int_equal(stat(node, &before), 0);
    for (int i = 0; i < 2; i++) {
        in_folder(&folder, i == 0 ? "a.ele" : "b.ele", ele);
        assert_int_equal(host_write_probe(ele, node, &error), 0);
        assert_int_equal(host_write(ele, node, &points, &tets, &error), 0);
        assert_int_equal(host_output_commit(&error), 0);
    }
    assert_int_equal(stat(node, &after), 0);
    assert_int_equal(after.st_ino, before.st_ino);
    assert_int_equal(after.st_mtim.tv_nsec, before.st_mtim.tv_nsec);
    assert_true(host_write_leaves(node, name));
    assert_false(host_write_leaves(NULL, name));
    in_folder(&folder, "a.ele", ele); /* the points come from elsewhere */
    assert_int_equal(host_write(ele, ele, &points, &tets, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    assert_int_equal(stat(node, &after), 0);
    assert_int_not_equal(after.st_ino, before.st_ino);
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    assert_int_equal(remove_folder(&folder), 8);
}
