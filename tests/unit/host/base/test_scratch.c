/* Arrays that are put aside: what is resident stays below the limit, what they
 * hold stays, and a disk without room is an error. */
#include "tests/unit/test.h"
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include "host/base/error.h"
#include "host/base/memory.h"
#include "host/base/parallel.h"
#include "host/base/scratch.h"

enum { MIB = 1 << 20, WORDS = 8 << 20, BLOCK = 1 << 13, THREADS = 4 };

static struct host_scratch scratch;
static struct host_call call;
static uint64_t limit;

/* statm: pages of all address space, and those that are resident. */
static uint64_t resident(void) {
    char text[256];
    unsigned long long all, pages;
    int file = open("/proc/self/statm", O_RDONLY);
    ssize_t n = read(file, text, sizeof text - 1);
    assert_true(n > 0);
    text[n] = '\0';
    assert_int_equal(close(file), 0);
    assert_int_equal(sscanf(text, "%llu %llu", &all, &pages), 2);
    return pages * 4096;
}

/* Room for 16 MiB beyond what this program is. */
static int enter(void **unused) {
    struct host_error error = {0};
    (void)unused;
    limit = resident() + 16 * MIB;
    call = (struct host_call){
        .threads = THREADS, .memory_max = UINT64_MAX, .scratch = &scratch};
    if (host_scratch_begin(&scratch, "/tmp", limit, THREADS, &error) != 0)
        return -1;
    host_call_enter(&call);
    return 0;
}

static int leave(void **unused) {
    (void)unused;
    host_call_enter(NULL);
    assert_int_equal(scratch.arrays, 0);
    assert_int_equal(scratch.bytes, 0);
    assert_int_equal(call.memory, 0);
    host_scratch_end(&scratch);
    return 0;
}

struct sweep {
    uint64_t *word;
    bool reads;
    _Atomic unsigned wrong;
    _Atomic uint64_t most; /* resident */
};

/* Blocks in no order, so that pages come back in the middle. */
static void sweep(void *context, unsigned part) {
    struct sweep *s = context;
    size_t blocks = WORDS / THREADS / BLOCK, first = part * blocks;
    for (size_t k = 0; k < blocks; k++) {
        size_t from = (first + k * 37 % blocks) * BLOCK;
        for (size_t i = from; i < from + BLOCK; i++)
            if (!s->reads)
                s->word[i] = i * 3;
            else if (s->word[i] != i * 3)
                s->wrong++;
        host_call_trim(BLOCK * sizeof *s->word);
        uint64_t now = resident(), most = s->most;
        while (now > most &&
               !atomic_compare_exchange_strong(&s->most, &most, now)) {
        }
    }
}

TEST_WITH(test_what_is_resident_is_limited_and_nothing_is_lost, enter, leave) {
    struct sweep s = {.word = host_map(WORDS * sizeof(uint64_t))};
    assert_non_null(s.word);
    assert_int_equal(scratch.arrays, 1);
    host_fork_all(THREADS, sweep, &s);
    s.reads = true;
    host_fork_all(THREADS, sweep, &s);
    assert_int_equal(s.wrong, 0);
    assert_true(s.most < limit);
    host_unmap(s.word, WORDS * sizeof(uint64_t));
}

/* Threads that each touch less than what has them look. */
static void touch_little(void *context, unsigned part) {
    uint64_t *word = context;
    size_t words = scratch.step / 2 / sizeof *word;
    for (size_t i = 0; i < words; i++)
        word[part * words + i] = 1;
    host_call_trim(words * sizeof *word);
}

TEST_WITH(test_short_threads_are_counted_together, enter, leave) {
    uint64_t *word = host_map(WORDS * sizeof *word), most = 0;
    size_t a_turn = scratch.step / 2 * THREADS / sizeof *word;
    assert_non_null(word);
    for (size_t at = 0; at + a_turn <= WORDS; at += a_turn) {
        host_fork_all(THREADS, touch_little, word + at);
        uint64_t now = resident();
        most = now > most ? now : most;
    }
    assert_true(most < limit);
    host_unmap(word, WORDS * sizeof *word);
}

/* No page becomes resident, and both ways see the same. */
TEST_WITH(test_parts_go_through_the_file, enter, leave) {
    static uint64_t block[BLOCK];
    uint64_t *word = host_map(WORDS * sizeof *word);
    assert_non_null(word);
    uint64_t before = resident();
    for (size_t at = 0; at < WORDS; at += BLOCK) {
        for (size_t i = 0; i < BLOCK; i++)
            block[i] = (at + i) * 5;
        host_store(word + at, block, sizeof block);
    }
    for (size_t at = 0; at < WORDS; at += BLOCK) {
        host_fetch(block, word + at, sizeof block);
        assert_int_equal(block[7], (at + 7) * 5);
    }
    assert_true(resident() < before + MIB);
    assert_int_equal(word[WORDS - 1], (uint64_t)(WORDS - 1) * 5);
    word[12345] = 1;
    host_fetch(block, word + 12345, sizeof *block);
    assert_int_equal(block[0], 1);
    host_unmap(word, WORDS * sizeof *word);
    uint64_t *near = host_map_resident(MIB);
    assert_int_equal(scratch.arrays, 0);
    block[0] = 3;
    host_store(near, block, sizeof *block);
    assert_int_equal(near[0], 3);
    host_unmap(near, MIB);
}

TEST_WITH(test_an_array_grows_and_shrinks_with_what_it_holds, enter, leave) {
    size_t bytes = 4096, before = 0;
    unsigned char *array = NULL;
    while (bytes < 32 * MIB) { /* from memory to a file, which grows */
        unsigned char *grown = host_remap(array, before, bytes);
        assert_non_null(grown);
        for (size_t i = 0; i < before; i += 512)
            assert_int_equal(grown[i], i / 512 % 251);
        for (size_t i = (before + 511) / 512 * 512; i < bytes; i += 512)
            grown[i] = (unsigned char)(i / 512 % 251);
        array = grown;
        before = bytes;
        bytes = bytes * 3 / 2;
        host_call_trim(before);
    }
    assert_int_equal(scratch.arrays, 1);
    array = host_remap(array, before, 5000);
    assert_int_equal(scratch.bytes, 8192);
    assert_int_equal(array[4608], 9);
    array = host_remap(array, 5000, 2 * MIB);
    assert_int_equal(array[4608], 9);
    host_unmap(array, 2 * MIB);
}

TEST_WITH(test_what_comes_first_stays_in_memory, enter, leave) {
    scratch.memory_first = 8 * MIB;
    uint64_t *first = host_map(6 * MIB), *second = host_map(1 * MIB);
    assert_int_equal(scratch.arrays, 0);
    for (size_t i = 0; i < 6 * MIB / sizeof *first; i++)
        first[i] = i * 7;
    first = host_remap(first, 6 * MIB, 12 * MIB); /* beyond it */
    assert_int_equal(scratch.arrays, 1);
    for (size_t i = 0; i < 6 * MIB / sizeof *first; i++)
        assert_true(first[i] == i * 7);
    assert_int_equal(first[12 * MIB / sizeof *first - 1], 0);
    assert_true(resident() < limit);
    host_unmap(first, 12 * MIB);
    host_unmap(second, 1 * MIB);
}

TEST(test_a_limit_below_what_the_process_takes_is_an_error) {
    struct host_error error = {0};
    assert_int_equal(
        host_scratch_begin(&scratch, "/tmp", resident(), 1, &error),
        HOST_USAGE);
    assert_non_null(strstr(error.text, "this process takes"));
}

static void note_thread(void *thread) {
    *(pthread_t *)thread = pthread_self();
}

TEST(test_a_call_of_one_thread_has_one_beside_it) {
    struct host_call one = {.threads = 1, .memory_max = UINT64_MAX};
    struct host_fork fork = {0};
    pthread_t thread = {0};
    host_call_enter(&one);
    host_fork_start(&fork, note_thread, &thread);
    host_fork_join(&fork);
    assert_true(pthread_equal(thread, pthread_self()) != 0);
    host_fork_beside(&fork, note_thread, &thread);
    host_fork_join(&fork);
    assert_true(pthread_equal(thread, pthread_self()) == 0);
    host_call_enter(NULL);
}

TEST_WITH(test_a_disk_without_room_is_an_error, enter, leave) {
    struct rlimit before, small = {0};
    struct host_error error = {0};
    unsigned char *array = host_map(2 * MIB);
    assert_non_null(array);
    array[2 * MIB - 1] = 7;
    assert_true(signal(SIGXFSZ, SIG_IGN) != SIG_ERR);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small.rlim_cur = 3 * MIB;
    small.rlim_max = before.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    assert_null(host_map(4 * MIB));
    assert_null(host_remap(array, 2 * MIB, 4 * MIB));
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(host_fail_memory(&error, "the points"), HOST_INPUT);
    assert_non_null(strstr(error.text, "/tmp: no room for the points"));
    assert_non_null(strstr(error.text, "2097152 bytes beside the 2097152"));
    assert_non_null(strstr(error.text, "--scratch"));
    assert_int_equal(array[2 * MIB - 1], 7);
    host_unmap(array, 2 * MIB);
}

TEST(test_a_folder_that_takes_no_file_is_an_error) {
    struct host_error error = {0};
    assert_int_equal(
        host_scratch_begin(&scratch, "/absent", 16 * MIB, 1, &error),
        HOST_INPUT);
    assert_non_null(strstr(error.text, "/absent: no scratch file"));
}
