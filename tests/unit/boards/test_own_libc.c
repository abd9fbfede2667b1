/* What boards have instead of a C library, against this machine's: under other
 * names, as it is here as well. */

#include <math.h>

#include "tests/unit/test.h"

double own_sqrt(double x);
void *own_memcpy(void *to, const void *from, size_t size);
void *own_memmove(void *to, const void *from, size_t size);
void *own_memset(void *to, int value, size_t size);
int own_memcmp(const void *a, const void *b, size_t size);

static uint64_t random_bits(void) {
    static uint64_t x = 88172645463325252;
    x ^= x << 13;
    x ^= x >> 7;
    x ^= x << 17;
    return x;
}

static uint64_t bits_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static void check_root(double x) {
    double own = own_sqrt(x), theirs = sqrt(x);
    if (isnan(theirs))
        assert_true(isnan(own));
    else
        assert_int_equal(bits_of(own), bits_of(theirs));
}

TEST(test_own_sqrt_of_what_is_special) {
    static const double xs[] = {0.0,       -0.0,      1,        -1,
                                INFINITY,  -INFINITY, NAN,      0x1p-1074,
                                0x1p-1073, 0x1p-1022, 0x1p1023, 0x1.fp-1023};
    for (size_t i = 0; i < sizeof xs / sizeof xs[0]; i++) {
        check_root(xs[i]);
        check_root(nextafter(xs[i], INFINITY));
        check_root(nextafter(xs[i], -INFINITY));
    }
    for (int e = -1074; e < 1024; e++) {
        check_root(ldexp(1, e));
        check_root(nextafter(ldexp(1, e), 0));
        check_root(nextafter(ldexp(1, e), INFINITY));
    }
}

TEST(test_own_sqrt_of_squares_and_their_neighbours) {
    for (int i = 0; i < 100000; i++) {
        double root = (double)(random_bits() >> 38), square = root * root;
        check_root(square);
        check_root(nextafter(square, 0));
        check_root(nextafter(square, INFINITY));
    }
}

TEST(test_own_sqrt_of_anything) {
    for (int i = 0; i < 1000000; i++) {
        uint64_t bits = random_bits();
        double x;
        bits &= i % 8 == 0 ? ~UINT64_C(0) : UINT64_MAX >> 1;
        bits &= i % 16 == 1 ? UINT64_MAX >> 12 : ~UINT64_C(0);
        memcpy(&x, &bits, sizeof x);
        check_root(x);
    }
}

enum { ROOM = 96 };

static void fill(uint8_t bytes[ROOM]) {
    for (int i = 0; i < ROOM; i++)
        bytes[i] = (uint8_t)random_bits();
}

TEST(test_own_memory_moves) {
    uint8_t own[ROOM], theirs[ROOM], other[ROOM];
    for (size_t to = 0; to < 20; to++) {
        for (size_t from = 0; from < 20; from++) {
            for (size_t size = 0; size < ROOM - 20; size++) {
                fill(own);
                fill(other);
                memcpy(theirs, own, ROOM);
                memmove(theirs + to, theirs + from, size);
                assert_ptr_equal(own_memmove(own + to, own + from, size),
                                 own + to);
                assert_memory_equal(own, theirs, ROOM);
                memcpy(theirs + to, other + from, size);
                assert_ptr_equal(own_memcpy(own + to, other + from, size),
                                 own + to);
                assert_memory_equal(own, theirs, ROOM);
            }
        }
    }
}

TEST(test_own_memory_is_set) {
    uint8_t own[ROOM], theirs[ROOM];
    for (size_t at = 0; at < 20; at++) {
        for (size_t size = 0; size < ROOM - 20; size++) {
            int value = (int)(random_bits() % 1024) - 512;
            fill(own);
            memcpy(theirs, own, ROOM);
            memset(theirs + at, value, size);
            assert_ptr_equal(own_memset(own + at, value, size), own + at);
            assert_memory_equal(own, theirs, ROOM);
        }
    }
}

static int sign(int x) {
    return (x > 0) - (x < 0);
}

TEST(test_own_memory_is_compared) {
    uint8_t a[ROOM], b[ROOM];
    for (size_t at = 0; at < 20; at++) {
        for (size_t size = 1; size < ROOM - 20; size++) {
            fill(a);
            memcpy(b + at, a + 3, size);
            assert_int_equal(own_memcmp(a + 3, b + at, size), 0);
            for (size_t i = 0; i < size; i++) {
                b[at + i] ^= 0x81;
                assert_int_equal(sign(own_memcmp(a + 3, b + at, size)),
                                 sign(memcmp(a + 3, b + at, size)));
                b[at + i] ^= 0x81;
            }
        }
    }
}
