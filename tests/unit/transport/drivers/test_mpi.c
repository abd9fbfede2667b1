/* Pipes over MPI, from a rank to itself: what goes in comes out, whole and in
 * order, room is bounded, the end is noticed, and sleep ends when it should. */
#define TEST_OWN_MAIN

#include <time.h>

#include "transport/drivers/mpi.h"
#include "tests/unit/test.h"

enum { TAG = 7 };

#ifdef INCODE_SANITIZED
/* Open MPI leaks by itself.  NOLINTNEXTLINE(bugprone-reserved-identifier) */
const char *__asan_default_options(void);
/* NOLINTNEXTLINE(bugprone-reserved-identifier) */
const char *__asan_default_options(void) {
    return "detect_leaks=0";
}
#endif

static struct mpi_place place;
static struct mpi_pipe end; /* both ends of its wire */

/* clock: for sleeps of at least a time, and of minutes less than one. */
static uint64_t clock_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

static int open_end(void **unused) {
    (void)unused;
    mpi_pipe_open(&end, &place, 0, TAG);
    return 0;
}

static int close_end(void **unused) {
    (void)unused;
    return mpi_place_part(&place, &end, 1, 120000000) ? 0 : -1;
}

/* Pieces of all sizes, read in others. */
TEST_WITH(bytes_come_out_as_they_went_in, open_end, close_end) {
    static uint8_t bytes[200000], got[sizeof bytes];
    struct link_pipe pipe = mpi_link_pipe(&end);
    size_t sent = 0, received = 0;
    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)(i * 2654435761u >> 13);
    for (size_t turn = 1; received < sizeof bytes; turn++) {
        size_t size = turn * 977 % 9000 + 1, room = turn * 613 % 5000 + 1;
        size = size < sizeof bytes - sent ? size : sizeof bytes - sent;
        assert_true(turn < 10000);
        int taken = pipe.send(pipe.context, bytes + sent, size);
        assert_in_range(taken, 0, size);
        sent += (size_t)taken;
        room = room < sizeof got - received ? room : sizeof got - received;
        int came = pipe.receive(pipe.context, got + received, room);
        assert_in_range(came, 0, room);
        received += (size_t)came;
    }
    assert_memory_equal(bytes, got, sizeof bytes);
}

TEST_WITH(a_pipe_that_is_not_read_takes_no_more, open_end, close_end) {
    static uint8_t bytes[MPI_PIPE_BYTES];
    struct link_pipe pipe = mpi_link_pipe(&end);
    size_t sent = 0, received = 0;
    int moved = 1;
    /* Its own receives are a part of the way. */
    for (unsigned i = 0; moved > 0; i++) {
        assert_true(i < 4 * MPI_PIPE_SLOTS);
        moved = pipe.send(pipe.context, bytes, sizeof bytes);
        sent += (size_t)moved;
    }
    assert_true(end.blocked);
    while ((moved = pipe.receive(pipe.context, bytes, sizeof bytes)) > 0)
        received += (size_t)moved;
    assert_int_equal(received, sent);
    assert_true(pipe.send(pipe.context, bytes, sizeof bytes) > 0);
    assert_false(end.blocked);
}

TEST_WITH(sleep_ends_with_time_or_bytes, open_end, close_end) {
    struct link_pipe pipe = mpi_link_pipe(&end);
    uint8_t byte = 1;
    uint64_t start = clock_us(); /* clock: sleep is no shorter, and ends
                                    minutes before what it was given */
    mpi_sleep(&place, &end, 1, NULL, 20000);
    assert_true(clock_us() - start >= 20000);
    assert_int_equal(pipe.send(pipe.context, &byte, 1), 1);
    start = clock_us();
    mpi_sleep(&place, &end, 1, NULL, 600000000);
    assert_true(clock_us() - start < 300000000);
    assert_int_equal(pipe.receive(pipe.context, &byte, 1), 1);
}

TEST_WITH(an_end_is_noticed, open_end, close_end) {
    struct link_pipe pipe = mpi_link_pipe(&end);
    uint8_t bytes[8] = "last";
    assert_int_equal(pipe.send(pipe.context, bytes, sizeof bytes), 8);
    mpi_pipe_end(&end);
    assert_int_equal(pipe.receive(pipe.context, bytes, sizeof bytes), 8);
    assert_int_equal(pipe.receive(pipe.context, bytes, sizeof bytes), 0);
    assert_int_equal(pipe.receive(pipe.context, bytes, sizeof bytes),
                     LINK_PIPE_CLOSED);
    assert_int_equal(pipe.send(pipe.context, bytes, sizeof bytes),
                     LINK_PIPE_CLOSED);
}

int main(int argc, char **argv) {
    MPI_Init(&argc, &argv);
    if (mpi_place_open(&place) != 0)
        return 1;
    int failed = test_run();
    mpi_place_close(&place);
    MPI_Finalize();
    return failed;
}
