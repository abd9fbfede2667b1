/* The list of tetrahedra: canonical order against a plain sort, the digest
 * against a known one, every format written and read back. */
#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <signal.h>
#include <unistd.h>

#include <cmocka.h>

#include "host/formats/convert.h"
#include "host/mesh/gen.h"
#include "host/files/output.h"
#include "host/formats/read.h"
#include "host/formats/write.h"
#include "tests/unit/reference.h"

static uint64_t state = 3;

static uint32_t draw(uint32_t below)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((state >> 33) % below);
}

static void add(struct host_tetrahedra *tets, uint32_t a, uint32_t b,
                uint32_t c, uint32_t d)
{
    struct host_error error = {0};
    uint32_t(*row)[4] = host_tetrahedra_room(tets, 1, &error);
    assert_non_null(row);
    const uint32_t v[4] = {a, b, c, d};
    memcpy(*row, v, sizeof v);
    host_tetrahedra_keep(tets, 1);
}

/* Ascending vertices, then whether the row is an even permutation of them. */
static void key_of(const uint32_t v[4], uint32_t key[5])
{
    memcpy(key, v, 4 * sizeof *v);
    key[4] = 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3 - i; k++) {
            if (key[k] > key[k + 1]) {
                uint32_t t = key[k];
                key[k] = key[k + 1];
                key[k + 1] = t;
                key[4] ^= 1;
            }
        }
    }
}

static int compare_keys(const void *p, const void *q)
{
    const uint32_t *a = p, *b = q;
    for (int i = 0; i < 5; i++) {
        if (a[i] != b[i]) {
            return a[i] < b[i] ? -1 : 1;
        }
    }
    return 0;
}

static void check_sort(uint64_t n, uint32_t vertices, uint32_t crowd)
{
    struct host_tetrahedra tets = {0};
    uint32_t(*key)[5] = malloc(n * sizeof *key);
    assert_non_null(key);
    for (uint64_t i = 0; i < n; i++) {
        uint32_t a = i % 2 == 0 ? draw(vertices) : draw(crowd), b, c, d;
        do {
            b = i % 3 == 0 ? draw(crowd) : draw(vertices);
        } while (b == a);
        do {
            c = draw(vertices);
        } while (c == a || c == b);
        do {
            d = draw(vertices);
        } while (d == a || d == b || d == c);
        add(&tets, a, b, c, d);
        key_of(tets.v[i], key[i]);
    }
    qsort(key, n, sizeof *key, compare_keys);
    for (int again = 0; again < 2; again++) {
        host_tetrahedra_sort(&tets);
        for (uint64_t i = 0; i < n; i++) {
            uint32_t mine[5];
            const uint32_t *v = tets.v[i];
            key_of(v, mine);
            assert_memory_equal(mine, key[i], 4 * sizeof *mine);
            assert_true(v[0] == mine[0] && v[1] == mine[1]);
            /* of equal sets either orientation may come first */
            if ((i == 0 || memcmp(key[i], key[i - 1], 16) != 0) &&
                (i + 1 == n || memcmp(key[i], key[i + 1], 16) != 0)) {
                assert_int_equal(mine[4], key[i][4]);
            }
        }
    }
    host_tetrahedra_free(&tets);
    free(key);
}

static void order_is_canonical(void **unused)
{
    (void)unused;
    check_sort(1, 4, 4);
    check_sort(24, 4, 4);
    check_sort(1000, 12, 3);
    check_sort(1000, 4000000000u, 2);
    check_sort(100000, 300, 2);
    check_sort(200000, 70000, 2);
    check_sort(300000, 20000000, 5);
}

static void every_permutation_keeps_its_sign(void **unused)
{
    (void)unused;
    for (int code = 0; code < 256; code++) {
        uint32_t v[4] = {(uint32_t)code & 3, (uint32_t)code >> 2 & 3,
                         (uint32_t)code >> 4 & 3, (uint32_t)code >> 6};
        bool used[4] = {false};
        for (int i = 0; i < 4; i++) {
            used[v[i]] = true;
        }
        if (!used[0] || !used[1] || !used[2] || !used[3]) {
            continue;
        }
        struct host_tetrahedra tets = {0};
        uint32_t before[5];
        key_of(v, before);
        add(&tets, v[0], v[1], v[2], v[3]);
        host_tetrahedra_sort(&tets);
        const uint32_t even[4] = {0, 1, 2, 3}, odd[4] = {0, 1, 3, 2};
        assert_memory_equal(tets.v[0], before[4] == 0 ? even : odd, 16);
        host_tetrahedra_free(&tets);
    }
}

static void digests_are_known(void **unused)
{
    (void)unused;
    struct host_tetrahedra tets = {0};
    struct host_digest digest;
    host_digest(&tets, &digest);
    assert_string_equal(digest.text,
                        "sha256:e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b93"
                        "4ca495991b7852b855");
    add(&tets, 1, 0, 3, 2); /* of the one tetrahedron 0 1 2 3 */
    host_tetrahedra_sort(&tets);
    host_digest(&tets, &digest);
    assert_string_equal(digest.text,
                        "sha256:baed642339816affb3fe8719792d0e4ce82f12db72b737"
                        "3d244eaa65445800fe");
    host_tetrahedra_free(&tets);
}

static void mapping_and_cutting(void **unused)
{
    (void)unused;
    struct host_tetrahedra tets = {0};
    const uint32_t map[5] = {50, 40, 30, 20, 10};
    for (int i = 0; i < 1000; i++) {
        add(&tets, 0, 1, 2, 3 + (uint32_t)i % 2);
    }
    host_tetrahedra_map(&tets, map);
    for (int i = 0; i < 1000; i++) {
        const uint32_t expected[4] = {50, 40, 30, i % 2 == 0 ? 20 : 10};
        assert_memory_equal(tets.v[i], expected, 16);
    }
    host_tetrahedra_cut(&tets, 7);
    assert_int_equal(tets.count, 7);
    host_tetrahedra_cut(&tets, 9);
    assert_int_equal(tets.count, 7);
    host_tetrahedra_free(&tets);
}

/* --- Files ------------------------------------------------------------ */

struct folder {
    char name[64];
};

static struct folder make_folder(void)
{
    struct folder f;
    strcpy(f.name, "/tmp/incode-tets-XXXXXX");
    assert_non_null(mkdtemp(f.name));
    return f;
}

static const char *in_folder(const struct folder *f, const char *name,
                             char path[128])
{
    (void)snprintf(path, 128, "%s/%s", f->name, name);
    return path;
}

/* Removes the folder; returns how many files were in it. */
static int remove_folder(const struct folder *f)
{
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
                        struct host_tetrahedra *tets)
{
    struct host_error error = {0};
    *tets = (struct host_tetrahedra){0};
    assert_int_equal(host_gen("uniform", 200, 4, points, &error), 0);
    reference_delaunay(points->xyz, 200, tets);
    host_tetrahedra_sort(tets);
}

static void write_whole(const char *path, const struct host_points *points,
                        const struct host_tetrahedra *tets)
{
    struct host_error error = {0};
    assert_int_equal(host_write(path, points, tets, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
}

static void written_and_read_back(void **unused)
{
    (void)unused;
    static const char *const names[] = {"a.vtu",  "a.vtk", "a.msh",
                                        "a.mesh", "a.npy", "a.ele"};
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
            assert_int_equal(host_write_probe(path, &error), 0);
            write_whole(path, &points, &tets);
            if (host_tetrahedra_read(path, &again, &read, &error) != 0) {
                fail_msg("%s", error.text);
            }
            assert_int_equal(again.count, tets.count);
            assert_memory_equal(again.v, tets.v, 16 * tets.count);
            assert_int_equal(read.count, i < 4 ? 200 : 0);
            if (i < 4) {
                assert_memory_equal(read.xyz, points.xyz, 24 * 200);
            }
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
    assert_int_equal(remove_folder(&folder), 9);
}

/* .neigh and .face against all pairs of tetrahedra. */
static void neighbours_are_right(void **unused)
{
    (void)unused;
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

/* Beyond what numbers a neighbour: told before a tetrahedron is looked at. */
static void too_many_for_neighbours(void **unused)
{
    (void)unused;
    const struct host_tetrahedra tets = {.count = UINT32_MAX};
    struct host_adjacency adjacency;
    struct host_error error = {0};
    assert_int_equal(host_adjacency_make(&adjacency, &tets, 4, &error),
                     HOST_BROKEN);
    assert_non_null(strstr(error.text, "2^32 - 1 tetrahedra or more"));
    assert_non_null(strstr(error.text, "; do without these"));
}

static void failures_leave_nothing(void **unused)
{
    (void)unused;
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
        codes[i] = host_write(path, &points, &tets, &errors[i]);
    }
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &old), 0);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(codes[i], HOST_INPUT);
        assert_non_null(strstr(errors[i].text, "writing failed"));
    }
    struct host_error error = {0};
    assert_int_equal(host_write("/nowhere/a.vtu", &points, &tets, &error),
                     HOST_INPUT);
    error = (struct host_error){0};
    assert_int_equal(host_write_probe("/nowhere/a.vtu", &error), HOST_INPUT);
    error = (struct host_error){0};
    assert_int_equal(host_write_check("a.stl", &error), HOST_USAGE);
    assert_non_null(strstr(error.text, "use .ele .vtu .vtk .msh .mesh .npy"));
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    assert_int_equal(remove_folder(&folder), 0);
}

static void links_are_followed(void **unused)
{
    (void)unused;
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

static void refused(const char *path, const char *text, const char *expected)
{
    struct host_tetrahedra tets;
    struct host_error error = {0};
    assert_int_equal(
        host_tetrahedra_parse(path, text, strlen(text), &tets, NULL, &error),
        HOST_INPUT);
    if (strstr(error.text, expected) == NULL) {
        fail_msg("expected '%s' in '%s'", expected, error.text);
    }
    assert_non_null(strstr(error.text, "; "));
}

static void faults_have_their_place(void **unused)
{
    (void)unused;
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

static void other_writers_files(void **unused)
{
    (void)unused;
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
                                  &tets, &points, &error) != 0) {
            fail_msg("%zu: %s", i, error.text);
        }
        const uint32_t expected[8] = {0, 1, 2, 3, 1, 2, 3, 4};
        assert_int_equal(tets.count, 2);
        assert_memory_equal(tets.v, expected, sizeof expected);
        host_tetrahedra_free(&tets);
        host_points_free(&points);
    }
}

static void conversion(void **unused)
{
    (void)unused;
    struct host_points points;
    struct host_tetrahedra tets, again;
    struct host_error error = {0};
    struct folder folder = make_folder();
    char a[128], b[128];
    triangulate(&points, &tets);
    in_folder(&folder, "a.ele", a);
    write_whole(a, &points, &tets);
    static const char *const chain[] = {"b.vtu", "b.msh", "b.vtk", "b.mesh",
                                        "b.npy"};
    for (size_t i = 0; i < sizeof chain / sizeof *chain; i++) {
        in_folder(&folder, chain[i], b);
        assert_int_equal(host_convert(a, b, &error), 0);
        strcpy(a, b);
    }
    assert_int_equal(host_tetrahedra_read(b, &again, NULL, &error), 0);
    assert_int_equal(again.count, tets.count);
    assert_memory_equal(again.v, tets.v, 16 * tets.count);
    host_tetrahedra_free(&again);
    /* .npy holds no points and there is no .node beside it */
    assert_int_equal(host_convert(b, in_folder(&folder, "c.vtu", a), &error),
                     HOST_INPUT);
    error = (struct host_error){0};
    in_folder(&folder, "p.xyz", a);
    in_folder(&folder, "p.npy", b);
    assert_int_equal(host_points_write(a, &points, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    assert_int_equal(host_convert(a, b, &error), 0);
    struct host_points read;
    assert_int_equal(host_points_read(b, &read, &error), 0);
    assert_memory_equal(read.xyz, points.xyz, 24 * 200);
    host_points_free(&read);
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    assert_int_equal(remove_folder(&folder), 11);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(order_is_canonical),
        cmocka_unit_test(every_permutation_keeps_its_sign),
        cmocka_unit_test(digests_are_known),
        cmocka_unit_test(mapping_and_cutting),
        cmocka_unit_test(written_and_read_back),
        cmocka_unit_test(neighbours_are_right),
        cmocka_unit_test(too_many_for_neighbours),
        cmocka_unit_test(failures_leave_nothing),
        cmocka_unit_test(links_are_followed),
        cmocka_unit_test(faults_have_their_place),
        cmocka_unit_test(other_writers_files),
        cmocka_unit_test(conversion),
    };
    return cmocka_run_group_tests_name("tetrahedra", tests, NULL, NULL);
}
