/* Sections of a cube that is cut into tetrahedra cover its section once,
 * wherever the plane is; pictures show just that. */

#include "tests/unit/test.h"
#include <expat.h>
#include <math.h>
#include <png.h>
#include <stdbool.h>
#include <unistd.h>

#include "host/draw/picture.h"

enum { SIDE = 6, ROWS = SIDE + 1 };

static struct host_points points;
static struct host_tetrahedra tets;

/* Each small cube is six tetrahedra around its diagonal. */
static int make_cube(void **unused) {
    static const unsigned steps[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2},
                                         {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    static const uint32_t stride[3] = {ROWS * ROWS, ROWS, 1};
    struct host_error error = {0};
    (void)unused;
    for (uint32_t i = 0; i < ROWS * ROWS * ROWS; i++) {
        uint32_t at[3] = {i / stride[0], i / ROWS % ROWS, i % ROWS};
        double xyz[3] = {at[0], at[1], at[2]};
        if (host_points_append(&points, xyz, 1, &error) != 0)
            return -1;
        for (unsigned k = 0; k < 6; k++) {
            uint32_t(*v)[4] = host_tetrahedra_room(&tets, 1, &error);
            if (at[0] == SIDE || at[1] == SIDE || at[2] == SIDE || v == NULL)
                continue;
            (*v)[0] = i;
            for (unsigned d = 0; d < 3; d++)
                (*v)[d + 1] = (*v)[d] + stride[steps[k][d]];
            host_tetrahedra_keep(&tets, 1);
        }
    }
    return 0;
}

static int drop_cube(void **unused) {
    (void)unused;
    host_points_free(&points);
    host_tetrahedra_free(&tets);
    return 0;
}

/* Of one cell; every corner turns the same way. */
static double area_of(const struct host_cell *c) {
    double area = 0.0, turn = 0.0;
    for (unsigned k = 0; k < c->corners; k++) {
        const float *a = c->corner[k], *b = c->corner[(k + 1) % c->corners];
        const float *d = c->corner[(k + 2) % c->corners];
        double x = (double)(b[0] - a[0]), y = (double)(b[1] - a[1]);
        double u = (double)(d[0] - b[0]), v = (double)(d[1] - b[1]);
        double side = x * v - y * u;
        area += 0.5 * (double)(a[0] * b[1] - a[1] * b[0]);
        assert_true(side * turn >= -1e-12);
        turn = fabs(side) > fabs(turn) ? side : turn;
    }
    return fabs(area);
}

static double section_area(struct host_plane plane, double unit) {
    struct host_section section;
    struct host_error error = {0};
    double area = 0.0;
    assert_int_equal(host_section_make(&section, &points, &tets, plane, &error),
                     0);
    for (uint64_t i = 0; i < section.count; i++)
        area += area_of(&section.cells[i]);
    assert_true(section.extent[0] == SIDE * unit);
    assert_true(section.extent[1] == SIDE * unit);
    host_section_free(&section);
    return area;
}

TEST(test_covers_the_section_once) {
    /* The widest has sides that are no double any more. */
    static const double units[] = {1.0, 1e307, 4.9e-324, 5e307};
    static const double from[] = {0.0, 0.0, 0.0, -3.0};
    static const double at[] = {0.25,   1.0, 2.0, 3.3333333333333335,
                                5.9999, 6.0};
    double *xyz = points.xyz, scaled[3 * ROWS * ROWS * ROWS];
    points.xyz = scaled;
    for (size_t u = 0; u < sizeof units / sizeof units[0]; u++) {
        for (uint64_t i = 0; i < 3 * points.count; i++)
            scaled[i] = (xyz[i] + from[u]) * units[u];
        for (unsigned axis = 0; axis < 3; axis++) {
            for (size_t i = 0; i < sizeof at / sizeof at[0]; i++) {
                double z = (at[i] + from[u]) * units[u];
                z = z == 0.0 ? units[u] : z; /* a quarter of the least */
                struct host_plane plane = {axis, z};
                assert_true(fabs(section_area(plane, units[u]) - 1.0) < 1e-5);
            }
        }
    }
    points.xyz = xyz;
}

TEST(test_beside) {
    static const double at[] = {-1.0, 0.0, 6.0000001, 1e300};
    for (size_t i = 0; i < sizeof at / sizeof at[0]; i++) {
        struct host_section section;
        struct host_error error = {0};
        struct host_plane plane = {1, at[i]};
        assert_int_equal(
            host_section_make(&section, &points, &tets, plane, &error),
            HOST_INPUT);
        assert_non_null(strstr(error.text, "give a y between 0 and 6"));
        host_section_free(&section);
    }
}

TEST(test_default_plane) {
    struct host_plane plane = host_plane_through_middle(&points);
    assert_true(plane.axis == 2 && plane.at == 3.0);
    for (uint64_t i = 0; i < points.count; i++)
        points.xyz[3 * i] *= 0.5;
    plane = host_plane_through_middle(&points);
    assert_true(plane.axis == 0 && plane.at == 1.5);
    for (uint64_t i = 0; i < points.count; i++)
        points.xyz[3 * i] *= 2.0;
}

/* --- pictures ------------------------------------------------------------- */

/* What is written of the cube, `width` pixels wide; to be freed. */
static char *written(const char *name, unsigned width, long *bytes) {
    struct host_section section;
    struct host_error error = {0};
    struct host_output out;
    struct host_plane plane = {2, 2.5};
    char path[] = "/tmp/incode-draw-XXXXXX", file[64];
    assert_non_null(mkdtemp(path));
    snprintf(file, sizeof file, "%s/%s", path, name);
    assert_int_equal(host_section_make(&section, &points, &tets, plane, &error),
                     0);
    struct host_picture picture = host_picture_of(&section, width);
    assert_int_equal(picture.width, width);
    assert_int_equal(picture.height, width);
    assert_int_equal(host_output_open(&out, file, &error), 0);
    assert_int_equal(host_picture_format(file)->write(&out, &picture, &error),
                     0);
    assert_int_equal(host_output_close(&out, 1, &error), 0);
    assert_int_equal(host_output_commit(&error), 0);
    host_section_free(&section);
    FILE *from = fopen(file, "rb");
    assert_non_null(from);
    assert_int_equal(fseek(from, 0, SEEK_END), 0);
    *bytes = ftell(from);
    rewind(from);
    char *text = calloc(1, (size_t)*bytes + 1);
    assert_int_equal(fread(text, 1, (size_t)*bytes, from), *bytes);
    (void)fclose(from);
    assert_int_equal(unlink(file), 0);
    assert_int_equal(rmdir(path), 0);
    return text;
}

/* Of a path's cells, in the drawing's units. */
static double path_area(const char *d) {
    double area = 0.0, at[2] = {0, 0}, start[2] = {0, 0};
    char command = 0;
    while (*d != '\0') {
        double to[2] = {at[0], at[1]};
        d += strspn(d, " ");
        command = strchr("Mmlhvz", *d) != NULL ? *d++ : command;
        if (command == 'z')
            memcpy(to, start, sizeof to);
        else if (command != 'v')
            to[0] = strtod(d, (char **)&d) + (command == 'M' ? 0 : at[0]);
        if (command != 'z' && command != 'h')
            to[1] = strtod(d, (char **)&d) + (command == 'M' ? 0 : at[1]);
        if (command == 'm' || command == 'M') {
            memcpy(start, to, sizeof to);
        } else {
            area += 0.5 * ((at[0] - start[0]) * (to[1] - start[1]) -
                           (at[1] - start[1]) * (to[0] - start[0]));
        }
        memcpy(at, to, sizeof to);
        if (command == 'z')
            d += strspn(d, " ");
    }
    return area;
}

/* Cells of a path may turn either way: each is taken by itself. */
static double cells_area(const char *d) {
    double area = 0.0;
    assert_memory_equal(d, "M0 0m", 5);
    for (d += 4; *d == 'm';) {
        char cell[256] = "M0 0";
        size_t n = strcspn(d, "z") + 1;
        assert_true(n + 5 < sizeof cell);
        memcpy(cell + 4, d, n);
        area += fabs(path_area(cell));
        d += n;
    }
    assert_int_equal(*d, '\0');
    return area;
}

struct drawing {
    double area;
    unsigned paths, width;
};

static void XMLCALL on_element(void *context, const XML_Char *name,
                               const XML_Char **attributes) {
    struct drawing *drawing = context;
    for (; *attributes != NULL; attributes += 2) {
        if (strcmp(name, "path") == 0 && strcmp(attributes[0], "d") == 0) {
            drawing->area += cells_area(attributes[1]);
            drawing->paths++;
        } else if (strcmp(name, "svg") == 0 &&
                   strcmp(attributes[0], "width") == 0) {
            drawing->width = (unsigned)strtoul(attributes[1], NULL, 10);
        }
    }
}

static struct drawing parse_svg(const char *text, long bytes) {
    struct drawing drawing = {0};
    XML_Parser parser = XML_ParserCreate(NULL);
    XML_SetUserData(parser, &drawing);
    XML_SetElementHandler(parser, on_element, NULL);
    assert_int_equal(XML_Parse(parser, text, (int)bytes, 1), XML_STATUS_OK);
    XML_ParserFree(parser);
    return drawing;
}

TEST(test_svg) {
    long bytes;
    char *text = written("a.svg", 402, &bytes);
    struct drawing drawing = parse_svg(text, bytes);
    assert_int_equal(drawing.width, 402);
    assert_true(drawing.paths >= 1 && drawing.paths <= HOST_COLOURS);
    assert_true(fabs(drawing.area / (16.0 * 400 * 400) - 1.0) < 0.001);
    assert_true(bytes < SIDE * SIDE * 8 * 30);
    free(text);
}

/* Cells below a pixel are one path element a pixel, and no more. */
TEST(test_svg_merges) {
    struct host_cell cells[500];
    struct host_section section = {cells, 500, 0.0, {1, 1}, {1, 1}};
    struct host_picture picture = host_picture_of(&section, 102);
    struct host_output out;
    struct host_error error = {0};
    memset(cells, 0, sizeof cells);
    for (unsigned i = 0; i < 500; i++) {
        cells[i].corners = 3;
        cells[i].corner[1][0] = cells[i].corner[2][1] = i == 0 ? 1.0f : 0.004f;
    }
    assert_int_equal(host_output_open(&out, "/dev/null", &error), 0);
    assert_int_equal(host_picture_svg(&out, &picture, &error), 0);
    assert_int_equal(picture.merged, 499);
    assert_true(out.used < 500);
    assert_int_equal(host_output_close(&out, 1, &error), 0);
}

TEST(test_png) {
    enum { WIDTH = 122 };
    static png_byte pixels[WIDTH][WIDTH][3];
    png_image image = {.version = PNG_IMAGE_VERSION};
    long bytes;
    char *file = written("a.PNG", WIDTH, &bytes);
    assert_int_not_equal(
        png_image_begin_read_from_memory(&image, file, (size_t)bytes), 0);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, WIDTH);
    image.format = PNG_FORMAT_RGB;
    assert_int_not_equal(png_image_finish_read(&image, NULL, pixels, 0, NULL),
                         0);
    for (unsigned y = 0; y < WIDTH; y++) {
        for (unsigned x = 0; x < WIDTH; x++) {
            bool white = pixels[y][x][0] == 255 && pixels[y][x][2] == 255;
            bool inside = x > 1 && y > 1 && x + 2 < WIDTH && y + 2 < WIDTH;
            assert_false(inside && white);
        }
    }
    assert_int_equal(pixels[0][0][0], 255);
    free(file);
}

/* What is covered adds up, also where it reaches out of the raster. */
TEST(test_raster) {
    enum { N = 16 };
    static float pixels[N * N][HOST_CHANNELS];
    static const float one[HOST_CHANNELS] = {0, 0, 0, 1.0f, 0};
    struct host_raster raster = {N, N, pixels};
    double split[][3][2] = {{{-4, -4}, {20, -4}, {3.3, 7.1}},
                            {{20, -4}, {20, 20}, {3.3, 7.1}},
                            {{20, 20}, {-4, 20}, {3.3, 7.1}},
                            {{-4, 20}, {-4, -4}, {3.3, 7.1}}};
    double triangle[3][2] = {{2, 2}, {12, 2}, {2, 12}}, sum = 0.0;
    for (unsigned i = 0; i < 4; i++)
        host_raster_add(&raster, split[i], 3, one);
    for (unsigned i = 0; i < N * N; i++)
        assert_true(fabs((double)pixels[i][3] - 1.0) < 1e-6);
    memset(pixels, 0, sizeof pixels);
    host_raster_add(&raster, triangle, 3, one);
    for (unsigned i = 0; i < N * N; i++)
        sum += (double)pixels[i][3];
    assert_true(fabs(sum - 50.0) < 0.01);
}

TEST_GROUP(make_cube, drop_cube)
