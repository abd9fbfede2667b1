/* What a triangulator's setup may say, and the memory that it needs. */
#include <math.h>
#include <stdalign.h>

#include "incode/triangulator.h"
#include "tests/unit/test.h"

TEST(too_little_memory) {
    struct incode_setup setup = {.bricks = 10, .index = INCODE_KD};
    struct incode_outside outside = {0};
    size_t least = incode_arena_min(&setup);
    assert_in_range(least, 1, 512 << 10);
    void *arena = aligned_alloc(64, (least + 63) / 64 * 64);
    assert_non_null(arena);
    const char *why = NULL;
    assert_null(
        incode_triangulator_init(arena, least - 1024, &setup, &outside, &why));
    assert_non_null(why);
    assert_non_null(
        incode_triangulator_init(arena, least, &setup, &outside, &why));
    setup.bricks = 0;
    why = NULL;
    assert_null(incode_triangulator_init(arena, least, &setup, &outside, &why));
    assert_non_null(why);
    free(arena);
}

/* Each field of a setup, at its limits and past them. */
TEST(setup_limits) {
    const struct incode_setup good = {
        .bricks = 10, .index = INCODE_KD, .hi = {1, 1, 1}};
    struct incode_setup grid = good;
    grid.index = INCODE_GRID;
    grid.cells[0] = grid.cells[1] = grid.cells[2] = 8;
    assert_null(incode_setup_fault(&good));
    assert_null(incode_setup_fault(&grid));
#define EXPECT(fault, base, field, value)                                      \
    do {                                                                       \
        struct incode_setup s = (base);                                        \
        s.field = (value);                                                     \
        assert_int_equal(incode_setup_fault(&s) != NULL, fault);               \
    } while (0)
    EXPECT(true, good, bricks, 0);
    EXPECT(false, good, bricks, INCODE_NONE / INCODE_BRICK_POINTS);
    EXPECT(true, good, bricks, INCODE_NONE / INCODE_BRICK_POINTS + 1);
    EXPECT(false, good, index, INCODE_NAIVE);
    EXPECT(true, good, index, INCODE_KD + 1);
    EXPECT(false, good, face_rule, INCODE_FACE_PAPER);
    EXPECT(true, good, face_rule, INCODE_FACE_PAPER + 1);
    EXPECT(false, good, build, INCODE_BUILD_POINTS);
    EXPECT(true, good, build, INCODE_BUILD_POINTS + 1);
    EXPECT(false, good, owner_rule, INCODE_OWNER_LOWEST);
    EXPECT(true, good, owner_rule, INCODE_OWNER_LOWEST + 1);
    EXPECT(true, good, reserved2, 1);
    for (int d = 0; d < 3; d++) {
        EXPECT(false, good, lo[d], 1);
        EXPECT(true, good, lo[d], 1.5);
        EXPECT(true, good, lo[d], -INFINITY);
        EXPECT(true, good, hi[d], INFINITY);
        EXPECT(true, good, lo[d], NAN);
        EXPECT(true, good, hi[d], NAN);
        EXPECT(true, good, cells[d], 1);
        EXPECT(true, grid, cells[d], 0);
        EXPECT(false, grid, cells[d], 1 << 25);
        EXPECT(false, grid, cells[d], UINT32_MAX / 64);
        EXPECT(true, grid, cells[d], UINT32_MAX / 64 + 1);
        struct incode_setup line = grid;
        line.cells[0] = line.cells[1] = line.cells[2] = 1;
        EXPECT(false, line, cells[d], INCODE_CELLS_MAX);
        EXPECT(true, line, cells[d], INCODE_CELLS_MAX + 1u);
    }
#undef EXPECT
    struct incode_setup overflow = grid;
    overflow.cells[0] = overflow.cells[1] = overflow.cells[2] =
        INCODE_CELLS_MAX;
    assert_non_null(incode_setup_fault(&overflow));
    /* init says so before it writes a byte. */
    struct incode_outside outside = {0};
    alignas(64) uint8_t arena[64] = {0};
    static const uint8_t untouched[64];
    const char *why = NULL;
    assert_null(
        incode_triangulator_init(arena, 8 << 20, &overflow, &outside, &why));
    assert_string_equal(why, incode_setup_fault(&overflow));
    assert_memory_equal(arena, untouched, sizeof arena);
}
