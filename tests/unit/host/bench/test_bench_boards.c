/* Where a board's instructions go, of a map and counts that are known. */
#include <unistd.h>

#include "host/bench/bench_boards.h"
#include "tests/unit/test.h"

/* As a linker writes it: what is left out before, long names on a line of their
 * own, sections that are no code behind. */
static const char map_text[] =
    "Discarded input sections\n\n"
    " .text.never    0x00000000       0x40 b/firmware/x/node/node.o\n\n"
    "Linker script and memory map\n\n"
    ".text           0x00000000      0x200\n"
    " .text.incode_orient3d\n"
    "                0x00000100       0x20 "
    "/incode/b/firmware/x/incode/predicates/p.o\n"
    " .text.cap      0x00000120       0x10 b/firmware/x/incode/apex/cap.o\n"
    " .text          0x00000140       0x40 /usr/lib/libgcc.a(_arm_muldf3.o)\n"
    " .rodata.names  0x00000180       0x40 b/firmware/x/node/node.o\n"
    " .debug_info    0x00000000      0x900 b/firmware/x/transport/link.o\n";

static char folder[] = "/tmp/incode-test.XXXXXX";
static char map[64], counts[64];

static void write_file(const char *path, const void *bytes, size_t size) {
    FILE *file = fopen(path, "wbe");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static int make_folder(void **state) {
    (void)state;
    if (mkdtemp(folder) == NULL)
        return -1;
    snprintf(map, sizeof map, "%s/x.map", folder);
    snprintf(counts, sizeof counts, "%s/7.count", folder);
    return 0;
}

static int remove_folder(void **state) {
    (void)state;
    (void)remove(map);
    (void)remove(counts);
    return rmdir(folder);
}

TEST(test_counts) {
    /* Address, instructions, times; behind the first of none, nothing counts,
     * nor does what is below the image, a loader. */
    static const uint64_t blocks[][3] = {
        {0x100, 3, 10}, {0x11e, 2, 5},   {0x120, 4, 1},
        {0x130, 1, 2},  {0x17e, 10, 10}, {0x190, 1, 1},
        {0, 1, 4},      {0, 0, 0},       {0x100, 1, 100000}};
    struct host_boards_row row = {.board = "x"};
    struct host_error error = {0};
    write_file(map, map_text, sizeof map_text - 1);
    write_file(counts, blocks, sizeof blocks);
    assert_int_equal(host_boards_count(map, folder, row.counted, &error), 0);
    assert_true(row.counted[HOST_ROOM_PREDICATES] == 40);
    assert_true(row.counted[HOST_ROOM_SEARCH] == 4);
    assert_true(row.counted[HOST_ROOM_DOUBLES] == 100);
    assert_true(row.counted[HOST_ROOM_NODE] == 0);
    assert_true(row.counted[HOST_ROOM_LINKS] == 0);
    assert_true(row.counted[HOST_ROOM_BOARD] == 3);
    assert_true(host_boards_share(&row, HOST_ROOM_DOUBLES) > 68.0 &&
                host_boards_share(&row, HOST_ROOM_DOUBLES) < 68.1);
    assert_int_equal(access(counts, F_OK), -1); /* they count once */
}

TEST(test_no_map) {
    double counted[HOST_ROOMS] = {0};
    struct host_error error = {0};
    write_file(map, "nothing\n", 8);
    assert_int_equal(host_boards_count(map, folder, counted, &error),
                     HOST_BROKEN);
    assert_non_null(strstr(error.text, "make firmware"));
}

TEST_GROUP(make_folder, remove_folder)
