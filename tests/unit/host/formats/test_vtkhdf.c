/* VTKHDF: one set of bytes for one set of tetrahedra, and files that are cut
 * short or damaged, which end as an error or are read, whatever HDF5's library
 * makes of them. */
#include <time.h>
#include <unistd.h>

#include "bytes.h"
#include "host/formats/output.h"
#include "host/formats/write.h"

enum { POINTS = 40, TETS = 30 };

/* A file of some tetrahedra; their points are those of put_values. */
static void put_file(struct bytes *b) {
    static double xyz[3 * POINTS];
    static uint32_t v[TETS][4];
    const struct host_points points = {.xyz = xyz, .count = POINTS};
    const struct host_tetrahedra tets = {.v = v, .count = TETS};
    struct host_error error = {0};
    char path[64];
    for (uint64_t i = 0; i < 3 * POINTS; i++)
        xyz[i] = value_of(i);
    for (uint32_t i = 0; i < 4 * TETS; i++)
        v[i / 4][i % 4] = i / 4 + i % 4;
    (void)snprintf(path, sizeof path, "/tmp/incode-test-%ld.hdf",
                   (long)getpid());
    if (host_write_check(path, &error) != 0 ||
        host_write(path, NULL, &points, &tets, &error) != 0 ||
        host_output_commit(&error) != 0)
        fail_msg("%s", error.text);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    b->n = fread(b->data, 1, sizeof b->data, file);
    assert_int_equal(fclose(file), 0);
    assert_int_equal(unlink(path), 0);
}

static int parse(const struct bytes *b, size_t bytes, uint64_t *count) {
    struct host_tetrahedra tets;
    struct host_points points;
    struct host_error error = {0};
    int code = host_tetrahedra_parse("a.vtkhdf", b->data, bytes, &tets, &points,
                                     &error);
    *count = tets.count;
    assert_int_equal(code, error.code);
    assert_true(code == 0 || code == HOST_INPUT);
    if (code != 0 && (strstr(error.text, "a.vtkhdf: ") != error.text ||
                      strstr(error.text, "; ") == NULL))
        fail_msg("%s", error.text);
    assert_true(code == 0 || (tets.count == 0 && points.count == 0));
    host_tetrahedra_free(&tets);
    host_points_free(&points);
    return code;
}

TEST(vtkhdf_is_one_set_of_bytes) {
    static struct bytes b, again;
    uint64_t count;
    time_t before = time(NULL); /* clock: no second of these is in the file */
    put_file(&b);
    put_file(&again);
    time_t after = time(NULL);
    for (size_t i = 0; i + 4 <= b.n; i++) {
        uint32_t word;
        memcpy(&word, b.data + i, sizeof word);
        assert_false((time_t)word >= before && (time_t)word <= after);
    }
    assert_int_equal(b.n, again.n);
    assert_memory_equal(b.data, again.data, b.n);
    expect_rows("a.vtkhdf", &b, POINTS);
    expect_rows("a.HDF", &b, POINTS);
    assert_int_equal(parse(&b, b.n, &count), 0);
    assert_int_equal(count, TETS);
}

TEST(vtkhdf_cut_short) {
    static struct bytes b;
    uint64_t count;
    put_file(&b);
    for (size_t n = 1; n < b.n; n += b.n / 16)
        assert_int_equal(parse(&b, n, &count), HOST_INPUT);
    assert_int_equal(parse(&b, b.n - 1, &count), HOST_INPUT);
}

/* What is not an array is in the first bytes. */
TEST(vtkhdf_damaged) {
    enum { FRAME = 4096, STEP = 61 };
    static struct bytes b;
    unsigned wrong = 0;
    uint64_t count;
    put_file(&b);
    for (size_t i = 0; i < FRAME; i += STEP) {
        uint8_t was = b.data[i];
        b.data[i] = (uint8_t)(i % 2 == 0 ? ~was : was + 1);
        wrong += parse(&b, b.n, &count) != 0;
        b.data[i] = was;
    }
    assert_true(wrong > 10);
    refused("a.hdf", "\211HDF\r\n\032\n", "a.hdf: no HDF5 file, or a damaged");
}
