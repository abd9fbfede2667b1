/* incode_stream: its blocks together are the rows of incode_delaunay, in less
 * memory than the limit; each callback cancels; a disk that is full is an
 * error; two calls at once do not disturb each other. */
#include "tests/unit/test.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include "host/base/memory.h"
#include "host/library/incode.h"
#include "host/mesh/tetrahedra.h"

enum { MIB = 1 << 20, ODD = 1537 /* points that come at a time */ };

/* A caller: points of a sequence, what was made of them, and what ends it. */
struct caller {
    uint64_t points, given;
    uint64_t seed;
    uint64_t again; /* each so many repeats the one before; 0: none does */
    bool is_flat;
    uint64_t bad; /* row with an infinite coordinate, plus 1 */
    /* The call of each callback that is false; 0: none. */
    uint64_t points_max, tetrahedra_max, duplicates_max, progress_max;
    size_t claims; /* points more than there is room for */
    uint64_t calls[3], ticks;
    bool is_over; /* one has returned false: none is called again */
    struct host_tetrahedra tets;
    bool keeps;
    uint64_t count, sum; /* of tetrahedra: of no order */
    uint64_t duplicates;
};

static uint64_t mix(uint64_t h) {
    h = (h ^ h >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    h = (h ^ h >> 27) * UINT64_C(0x94d049bb133111eb);
    return h ^ h >> 31;
}

static double coordinate(const struct caller *c, uint64_t row, unsigned d) {
    if (c->again != 0 && row % c->again == c->again - 1)
        row--;
    if (row + 1 == c->bad)
        return d == 1 ? INFINITY : 0;
    return d == 2 && c->is_flat
               ? 1.0
               : (double)(mix(c->seed + 3 * row + d) >> 11) * 0x1p-53;
}

/* False at the call that ends all; most: which, 0: none does. */
static bool goes_on(struct caller *c, unsigned which, uint64_t most) {
    assert_false(c->is_over);
    c->is_over = ++c->calls[which] == most;
    return !c->is_over;
}

static bool give(void *context, double *xyz, size_t room, size_t *count) {
    struct caller *c = context;
    uint64_t left = c->points - c->given;
    *count = room < ODD ? room : ODD;
    *count = left < *count ? (size_t)left : *count;
    for (size_t i = 0; i < 3 * *count; i++)
        xyz[i] = coordinate(c, c->given + i / 3, (unsigned)(i % 3));
    c->given += *count;
    if (c->claims > 0)
        *count = room + c->claims;
    return goes_on(c, 0, c->points_max);
}

static uint64_t hash(const uint32_t v[4]) {
    uint64_t h = mix((uint64_t)v[0] << 32 | v[1]);
    return mix(h ^ ((uint64_t)v[2] << 32 | v[3]));
}

static bool take(void *context, const uint32_t (*v)[4], size_t count) {
    struct caller *c = context;
    struct host_error error = {0};
    assert_in_range(count, 1, 4096);
    for (size_t i = 0; i < count; i++)
        c->sum += hash(v[i]);
    c->count += count;
    if (c->keeps) {
        uint32_t(*to)[4] = host_tetrahedra_room(&c->tets, count, &error);
        memcpy(to, v, count * sizeof *v);
        host_tetrahedra_keep(&c->tets, count);
    }
    return goes_on(c, 1, c->tetrahedra_max);
}

static bool note(void *context, const uint32_t (*pair)[2], size_t count) {
    struct caller *c = context;
    for (size_t i = 0; i < count; i++) {
        assert_int_equal(pair[i][0] % c->again, c->again - 1);
        assert_int_equal(pair[i][1], pair[i][0] - 1);
    }
    c->duplicates += count;
    return goes_on(c, 2, c->duplicates_max);
}

static bool tick(void *context, double done) {
    struct caller *c = context;
    assert_true(done >= 0 && done <= 1);
    return ++c->ticks != c->progress_max; /* while others run, perhaps */
}

static enum incode_status stream(struct caller *c,
                                 const struct incode_options *options,
                                 struct incode_totals *out) {
    const struct incode_callbacks callbacks = {
        .points = give, .tetrahedra = take, .duplicates = note, .context = c};
    return incode_stream(&callbacks, options, out);
}

/* The rows of incode_delaunay, as sums, and if `c` keeps its own, compared. */
static void check_rows(struct caller *c) {
    double *xyz = malloc((size_t)c->points * 3 * sizeof *xyz);
    struct incode_tetrahedra t;
    uint64_t sum = 0;
    assert_non_null(xyz);
    for (uint64_t i = 0; i < 3 * c->points; i++)
        xyz[i] = coordinate(c, i / 3, (unsigned)(i % 3));
    assert_int_equal(incode_delaunay(xyz, c->points, NULL, &t), INCODE_OK);
    for (uint64_t i = 0; i < t.count; i++)
        sum += hash(t.vertex[i]);
    assert_int_equal(c->count, t.count);
    assert_int_equal(c->sum, sum);
    assert_int_equal(c->duplicates, t.duplicate_count);
    if (c->keeps) {
        struct host_digest made, wanted;
        const struct host_tetrahedra rows = {.v = t.vertex, .count = t.count};
        host_tetrahedra_sort(&c->tets);
        host_digest(&c->tets, &made);
        host_digest(&rows, &wanted);
        assert_string_equal(made.text, wanted.text);
        host_tetrahedra_free(&c->tets);
    }
    incode_tetrahedra_free(&t);
    free(xyz);
}

/* Sanitizers have memory of their own. */
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
static const bool is_sanitized = true;
#else
static const bool is_sanitized = false;
#endif

/* First, as it measures the most memory that this program has had. */
TEST(test_what_is_resident_is_limited) {
    const struct incode_options options = {.threads = 1,
                                           .memory_max = 24 * MIB};
    struct caller c = {.points = 300000, .again = 50};
    struct incode_totals out;
    uint64_t before = host_memory_peak();
    assert_int_equal(stream(&c, &options, &out), INCODE_OK);
    uint64_t grown = host_memory_peak() - before;
    assert_true(grown < 24 * MIB || is_sanitized);
    assert_int_equal(out.points, c.points);
    assert_int_equal(out.count, c.count);
    assert_int_equal(out.duplicate_count, c.duplicates);
    assert_true(out.scratch_max > 24 * MIB);
    check_rows(&c);
}

TEST(test_blocks_are_the_rows) {
    for (unsigned threads = 1; threads <= 4; threads++) {
        const struct incode_options options = {
            .threads = threads, .memory_max = threads % 2 * 64 * MIB};
        struct caller c = {.points = 20000, .again = 7, .keeps = true};
        struct incode_totals out;
        assert_int_equal(stream(&c, &options, &out), INCODE_OK);
        assert_int_equal(out.scratch_max > 0, threads % 2);
        check_rows(&c);
    }
}

static unsigned open_files(void) {
    unsigned count = 0;
    DIR *folder = opendir("/proc/self/fd");
    assert_non_null(folder);
    while (readdir(folder) != NULL)
        count++;
    (void)closedir(folder);
    return count;
}

TEST(test_each_callback_cancels) {
    const struct incode_options limited = {.threads = 2,
                                           .memory_max = 32 * MIB};
    for (unsigned which = 0; which < 4; which++)
        for (uint64_t most = 1; most < (which == 3 ? 2 : 8); most += 3) {
            struct caller c = {.points = 60000, .again = 2};
            struct incode_options options = limited;
            unsigned files = open_files();
            options.progress = which == 3 ? tick : NULL;
            options.context = &c;
            *(which == 0   ? &c.points_max
              : which == 1 ? &c.tetrahedra_max
              : which == 2 ? &c.duplicates_max
                           : &c.progress_max) = most;
            assert_int_equal(stream(&c, &options, NULL), INCODE_CANCELLED);
            assert_true(c.is_over || c.ticks == c.progress_max);
            assert_int_equal(open_files(), files);
        }
}

static enum incode_status of(struct caller c, uint64_t *at) {
    struct incode_totals out;
    enum incode_status status = stream(&c, NULL, &out);
    *at = out.at;
    return status;
}

TEST(test_points_that_have_no_tetrahedra) {
    uint64_t at;
    assert_int_equal(of((struct caller){.points = 0}, &at), INCODE_TOO_FEW);
    assert_int_equal(of((struct caller){.points = 3}, &at), INCODE_TOO_FEW);
    assert_int_equal(of((struct caller){.points = 6, .again = 2}, &at),
                     INCODE_TOO_FEW);
    assert_int_equal(of((struct caller){.points = 5000, .is_flat = true}, &at),
                     INCODE_FLAT);
    assert_int_equal(of((struct caller){.points = 5000, .bad = 4321}, &at),
                     INCODE_NOT_FINITE);
    assert_int_equal(at, 4320);
    assert_int_equal(of((struct caller){.points = 5000, .claims = 1}, &at),
                     INCODE_BAD_ARGUMENT);
}

TEST(test_arguments) {
    struct caller c = {.points = 100};
    struct incode_callbacks callbacks = {
        .points = give, .tetrahedra = take, .context = &c};
    struct incode_options options = {.memory_max = 16 * MIB - 1};
    assert_int_equal(incode_stream(NULL, NULL, NULL), INCODE_BAD_ARGUMENT);
    assert_int_equal(incode_stream(&callbacks, &options, NULL),
                     INCODE_NO_MEMORY);
    options = (struct incode_options){.flags = INCODE_HULL};
    assert_int_equal(incode_stream(&callbacks, &options, NULL),
                     INCODE_BAD_ARGUMENT);
    callbacks.reserved[3] = &c;
    assert_int_equal(incode_stream(&callbacks, NULL, NULL),
                     INCODE_BAD_ARGUMENT);
    callbacks = (struct incode_callbacks){.points = give, .context = &c};
    assert_int_equal(incode_stream(&callbacks, NULL, NULL),
                     INCODE_BAD_ARGUMENT);
    callbacks = (struct incode_callbacks){.tetrahedra = take, .context = &c};
    assert_int_equal(incode_stream(&callbacks, NULL, NULL),
                     INCODE_BAD_ARGUMENT);
    assert_int_equal(c.given, 0);
}

TEST(test_a_disk_that_takes_no_more) {
    const struct incode_options options = {.threads = 1,
                                           .memory_max = 16 * MIB};
    struct caller c = {.points = 200000};
    struct incode_callbacks callbacks = {.points = give,
                                         .tetrahedra = take,
                                         .context = &c,
                                         .scratch = "/absent"};
    struct incode_totals out;
    assert_int_equal(incode_stream(&callbacks, &options, &out), INCODE_IO);
    assert_int_equal(out.error, ENOENT);
    assert_int_equal(c.given, 0);

    struct rlimit before, small = {.rlim_cur = 4 * MIB};
    unsigned files = open_files();
    assert_true(signal(SIGXFSZ, SIG_IGN) != SIG_ERR);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small.rlim_max = before.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    callbacks.scratch = NULL;
    assert_int_equal(incode_stream(&callbacks, &options, &out), INCODE_IO);
    assert_int_equal(out.error, EFBIG);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    assert_int_equal(open_files(), files);
}

static void *stream_beside(void *context) {
    const struct incode_options options = {.threads = 2,
                                           .memory_max = 32 * MIB};
    assert_int_equal(stream(context, &options, NULL), INCODE_OK);
    return NULL;
}

TEST(test_two_calls_at_once) {
    struct caller one = {.points = 50000, .again = 50},
                  other = {.points = 60000, .seed = UINT64_C(1) << 40};
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, stream_beside, &other), 0);
    (void)stream_beside(&one);
    assert_int_equal(pthread_join(thread, NULL), 0);
    check_rows(&one);
    check_rows(&other);
}
