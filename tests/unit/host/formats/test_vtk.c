/* VTK's files of points, legacy and XML, in every coding that they have. */
#include <zlib.h>

#include "bytes.h"

TEST(vtk_legacy) {
    struct bytes b = {.n = 0};
    put_text(&b, "# vtk DataFile Version 3.0\ntitle # with a hash\nASCII\n"
                 "DATASET POLYDATA\nPOINTS 3 float\n-3 -2.5 -2 -1.5 -1\n"
                 "-.5 0 .5 1\nVERTICES 1 2\n1 0\n");
    expect_rows("a.vtk", &b, 3);
    for (int wide = 0; wide < 2; wide++) {
        b.n = 0;
        put_text(&b, "# vtk DataFile Version 5.1\ntitle\nBINARY\n"
                     "FIELD FieldData 1\nTIME 1 1 double\n");
        put_number(&b, 7, true, true);
        put_text(&b, "\nDATASET STRUCTURED_GRID\nDIMENSIONS 2 2 1\nPOINTS 4 ");
        put_text(&b, wide != 0 ? "double\n" : "float\n");
        put_values(&b, 12, wide != 0, true);
        expect_rows("a.vtk", &b, 4);
        expect_cuts_refused("a.vtk", &b, 0);
    }
    struct host_points points;
    struct host_error error = {0};
    const char *grid = "# vtk DataFile Version 2.0\nt\nASCII\n"
                       "DATASET RECTILINEAR_GRID\nDIMENSIONS 3 2 1\n"
                       "X_COORDINATES 3 float\n0 1 3\nY_COORDINATES 2 float\n"
                       "5 6\nZ_COORDINATES 1 float\n9\nPOINT_DATA 6\n";
    assert_int_equal(
        host_points_parse("a.vtk", grid, strlen(grid), &points, &error), 0);
    const double last[3] = {3, 6, 9};
    assert_int_equal(points.count, 6);
    assert_memory_equal(points.xyz + 15, last, sizeof last);
    host_points_free(&points);
    const char *image = "# vtk DataFile Version 2.0\nt\nASCII\n"
                        "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n"
                        "ORIGIN 1 2 3\nSPACING .5 1 2\nPOINT_DATA 8\n";
    const double corner[3] = {1.5, 3, 5};
    assert_int_equal(
        host_points_parse("a.vtk", image, strlen(image), &points, &error), 0);
    assert_int_equal(points.count, 8);
    assert_memory_equal(points.xyz + 21, corner, sizeof corner);
    host_points_free(&points);
    refused("a.vtk", "vtk\n", "a.vtk:1:1: the first line is not");
    refused("a.vtk",
            "# vtk DataFile Version 2.0\nt\nASCII\nDATASET POLYDATA\n"
            "POINTS 2 float\n1 2 3\n4 five 6\n",
            "a.vtk:7:3: 'five' is no number");
    refused("a.vtk",
            "# vtk DataFile Version 2.0\nt\nASCII\nDATASET POLYDATA\n"
            "POINTS 2 float\n1 2 3\n4 5 6 7 8 9\nPOINT_DATA 2\n",
            "a.vtk:7:7: a keyword is due after so many points");
    refused("a.vtk",
            "# vtk DataFile Version 2.0\nt\nASCII\n"
            "DATASET STRUCTURED_POINTS\nDIMENSIONS 99999 99999 99999\n",
            "more than 2^22");
}

/* One VTK XML file with its points coded in one of five ways. */
static void put_xml(struct bytes *b, int way, bool wide_header, bool packed,
                    bool big) {
    struct bytes raw = {.n = 0}, head = {.n = 0};
    put_values(&raw, 12, true, big);
    size_t word = wide_header ? 8 : 4;
    put_text(b, "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" "
                "version=\"1.0\" byte_order=\"");
    put_text(b, big ? "BigEndian" : "LittleEndian");
    put_text(b, wide_header ? "\" header_type=\"UInt64\"" : "\"");
    put_text(b, packed ? " compressor=\"vtkZLibDataCompressor\">" : ">");
    put_text(b, "\n<PolyData>\n<Piece NumberOfPoints=\"4\" "
                "NumberOfVerts=\"0\">\n<PointData><DataArray "
                "type=\"Float64\" Name=\"p\" format=\"ascii\">1 2 3 "
                "4</DataArray></PointData>\n<Points><DataArray "
                "type=\"Float64\" NumberOfComponents=\"3\" format=\"");
    if (packed) { /* two blocks: 64 bytes and 32 */
        uint8_t out[2][256];
        uLongf n[2] = {256, 256};
        assert_int_equal(compress(out[0], &n[0], raw.data, 64), Z_OK);
        assert_int_equal(compress(out[1], &n[1], raw.data + 64, 32), Z_OK);
        put_word(&head, 2, word, big);
        put_word(&head, 64, word, big);
        put_word(&head, 32, word, big);
        put_word(&head, n[0], word, big);
        put_word(&head, n[1], word, big);
        raw.n = 0;
        put(&raw, out[0], n[0]);
        put(&raw, out[1], n[1]);
    } else {
        put_word(&head, 96, word, big);
    }
    static const char after[] =
        "</DataArray></Points>\n</Piece>\n</PolyData>\n";
    static const char empty[] = "/></Points>\n</Piece>\n</PolyData>\n";
    if (way == 0) {
        put_text(b, "ascii\">\n-3 -2.5 -2 -1.5 -1 -.5 0 .5 1 1.5 2 2.5\n"
                    "<InformationKey name=\"RANGE\"><Value index=\"0\"> 7 "
                    "</Value></InformationKey>\n");
        put_text(b, after);
    } else if (way == 1 || way == 2) {
        put_text(b, "binary\">\n  ");
        if (way == 2 && !packed) { /* header and data in one */
            put(&head, raw.data, raw.n);
            raw.n = 0;
        }
        put_base64(b, head.data, head.n);
        put_base64(b, raw.data, raw.n);
        put_text(b, "\n");
        put_text(b, after);
    } else {
        put_text(b, "appended\" offset=\"3\"");
        put_text(b, empty);
        put_text(b, way == 3 ? "<AppendedData encoding=\"raw\">\n _xyz"
                             : "<AppendedData encoding=\"base64\">\n _xyz");
        if (way == 3) {
            put(b, head.data, head.n);
            put(b, raw.data, raw.n);
        } else {
            put_base64(b, head.data, head.n);
            put_base64(b, raw.data, raw.n);
        }
        put_text(b, "</AppendedData>\n");
    }
    put_text(b, "</VTKFile>\n");
}

TEST(vtk_xml_of_every_coding) {
    for (int way = 0; way < 5; way++) {
        for (int bits = 0; bits < 8; bits++) {
            struct bytes b = {.n = 0};
            put_xml(&b, way, (bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0);
            expect_rows("a.vtp", &b, 4);
            expect_rows("a.vtu", &b, 4);
            expect_rows("a.vts", &b, 4);
            for (int n = 3; n <= 5; n += 2) { /* points, says the piece */
                char *said = strstr((char *)b.data, "OfPoints=\"4\"");
                assert_non_null(said);
                said[10] = (char)('0' + n);
                struct host_points points;
                struct host_error error = {0};
                assert_int_equal(
                    host_points_parse("a.vtu", b.data, b.n, &points, &error),
                    HOST_INPUT);
                said[10] = '4';
            }
            size_t tail = way < 3 ? 3 : 30; /* blanks; or past the data */
            b.n -= tail;
            expect_cuts_refused("a.vtu", &b, b.n > 40 ? b.n - 40 : 0);
        }
    }
    refused("a.vtu",
            "<VTKFile>\n<Piece NumberOfPoints=\"1\"><Points>\n"
            "<DataArray type=\"Float32\" format=\"ascii\">\n1 2\nq "
            "</DataArray></Points></Piece></VTKFile>",
            "a.vtu:5:1: 'q' is no number");
    refused("a.vtu",
            "<VTKFile><Piece><Points><DataArray type=\"Int8\">1 2 3"
            "</DataArray><DataArray type=\"Int8\" format=\"binary\"/>"
            "</Points></Piece></VTKFile>",
            "there twice");
    static const char piece[] =
        "<VTKFile>\n<Piece %s>\n<Points>\n<DataArray type=\"Float64\" "
        "NumberOfComponents=\"%d\" format=\"ascii\">\n-3 -2.5 -2 -1.5 -1 -.5 "
        "0 .5 1 1.5 2 2.5\n</DataArray>\n</Points>\n</Piece>\n</VTKFile>\n";
    static const struct {
        const char *counts, *wrong;
        int components;
    } pieces[] = {
        {"NumberOfPoints=\"3\"", "a.vtu:8: the numbers in Points are not", 3},
        {"NumberOfPoints=\"5\"", "a.vtu:6:1: the file ends where", 3},
        {"NumberOfPoints=\"0\"", "a.vtu:8: the numbers in Points are not", 3},
        {"NumberOfPoints=\"4\"", "a.vtu:4: the points have not 3 comp", 2},
        {"Extent=\"0 1 0 2 0 0\"", "a.vtu:6:1: the file ends where", 3},
        {"Extent=\"0 0 0 0 0 0\"", "a.vtu:8: the numbers in Points are", 3},
        {"NumberOfPoints=\"4\"", NULL, 3},
        {"Extent=\"2 3 -1 0 5 5\"", NULL, 3},
        {"", NULL, 3},
    };
    for (size_t i = 0; i < sizeof pieces / sizeof pieces[0]; i++) {
        struct bytes b = {.n = 0};
        b.n = (size_t)snprintf((char *)b.data, sizeof b.data, piece,
                               pieces[i].counts, pieces[i].components);
        if (pieces[i].wrong != NULL)
            refused("a.vtu", (char *)b.data, pieces[i].wrong);
        else
            expect_rows("a.vts", &b, 4);
    }
    refused("a.vtu", "<VTKFile>\n<Piece>\n</VTKFile>\n", "a.vtu:3: mismatch");
    refused("a.vtu", "<VTKFile compressor=\"vtkLZ4DataCompressor\">\n",
            "a.vtu:1: a compressor");
}
