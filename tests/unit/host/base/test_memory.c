/* How much memory is left, by control groups of both versions and by limits. */

#include "tests/unit/test.h"
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "host/base/memory.h"

static char directory[] = "/tmp/incode-memory-XXXXXX";

static int enter(void **unused) {
    (void)unused;
    return mkdtemp(directory) != NULL && chdir(directory) == 0 ? 0 : -1;
}

static int leave(void **unused) {
    (void)unused;
    char command[64];
    (void)snprintf(command, sizeof command, "rm -r %s", directory);
    return chdir("/") == 0 && system(command) == 0 ? 0 : -1;
}

static void put(const char *name, const char *text) {
    FILE *file = fopen(name, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

TEST(a_group_of_the_second_version) {
    assert_int_equal(mkdir("two", 0777), 0);
    assert_int_equal(mkdir("two/a", 0777), 0);
    assert_int_equal(mkdir("two/a/b", 0777), 0);
    put("list", "0::/a/b\n");
    assert_true(host_memory_in_groups("list", "two") == UINT64_MAX);
    put("two/a/b/memory.max", "max\n");
    put("two/a/b/memory.current", "7000\n");
    assert_true(host_memory_in_groups("list", "two") == UINT64_MAX);
    put("two/a/memory.max", "10000\n"); /* that above it counts */
    put("two/a/memory.current", "8000\n");
    assert_int_equal(host_memory_in_groups("list", "two"), 2000);
    put("two/a/memory.stat", "anon 7000\ninactive_file 500\nfile 600\n");
    assert_int_equal(host_memory_in_groups("list", "two"), 2500);
    put("two/a/b/memory.max", "6000\n"); /* lowered below what it has */
    assert_int_equal(host_memory_in_groups("list", "two"), 0);
}

TEST(a_group_of_the_first_version) {
    assert_int_equal(mkdir("one", 0777), 0);
    assert_int_equal(mkdir("one/memory", 0777), 0);
    put("list", "5:devices:/\n4:memory:/seen/from/outside\n0::/\n");
    put("one/memory/memory.limit_in_bytes", "30000\n");
    put("one/memory/memory.usage_in_bytes", "10000\n");
    put("one/memory/memory.stat", "inactive_file 7\ntotal_inactive_file 50\n");
    assert_int_equal(host_memory_in_groups("list", "one"), 20050);
    assert_true(host_memory_in_groups("absent", "one") == UINT64_MAX);
    put("list", "no list\n5:memory\n::\n");
    assert_true(host_memory_in_groups("list", "one") == UINT64_MAX);
}

static uint64_t mapped(const char *name) {
    char line[128];
    unsigned long long kib = 0;
    FILE *status = fopen("/proc/self/status", "r");
    assert_non_null(status);
    while (fgets(line, sizeof line, status) != NULL)
        if (strncmp(line, name, strlen(name)) == 0)
            (void)sscanf(line + strlen(name), "%llu", &kib);
    (void)fclose(status);
    return kib << 10;
}

/* A limit leaves what it is above that which is mapped already. */
static const uint64_t room = (uint64_t)48 << 20;

static void expect_room(uint64_t available) {
    assert_in_range(available, room - ((uint64_t)4 << 20), room);
}

TEST(a_limit) {
    struct rlimit limit, before;
    assert_true(host_memory_available() > room); /* or nothing is built here */
    assert_int_equal(getrlimit(RLIMIT_AS, &before), 0);
    limit = before;
    limit.rlim_cur = mapped("VmSize:") + room;
    assert_int_equal(setrlimit(RLIMIT_AS, &limit), 0);
    uint64_t available = host_memory_available();
    assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
    expect_room(available);
    assert_int_equal(getrlimit(RLIMIT_DATA, &before), 0);
    limit = before;
    limit.rlim_cur = mapped("VmData:") + room;
    assert_int_equal(setrlimit(RLIMIT_DATA, &limit), 0);
    available = host_memory_available();
    assert_int_equal(setrlimit(RLIMIT_DATA, &before), 0);
    expect_room(available);
}

TEST_GROUP(enter, leave)

/* Pages of address space that this process has. */
static unsigned long space(void) {
    unsigned long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    assert_non_null(file);
    assert_int_equal(fscanf(file, "%lu", &pages), 1);
    assert_int_equal(fclose(file), 0);
    return pages;
}

/* Sizes on both sides of those from which arrays have whole huge pages. */
TEST(an_array_that_has_grown_gives_all_of_it_back) {
    const size_t most = 4 << 20;
    (void)space();
    unsigned long before = space();
    for (size_t from = 1; from < most; from += from / 2 + 4095) {
        for (size_t to = from; to < most; to += to / 64 + 1000) {
            void *array = host_map(from);
            array = array == NULL ? NULL : host_remap(array, from, to);
            assert_non_null(array);
            host_unmap(array, to);
        }
    }
    assert_int_equal(space(), before);
}
