/* Vectors against plain code, lane by lane, with infinities, signed zeros,
 * denormals and what is not a number; packs touch nothing beyond a vector. */
#include <stdbool.h>

#include "tests/unit/test.h"
#include <math.h>

#include "incode/predicates/simd.h"

enum {
    ROUNDS = 20000,
    D = INCODE_VD_LANES,
    F = INCODE_VF_LANES,
    OFFSETS = 5,
    GUARD = 0x5a
};

static uint64_t state;

static uint64_t draw(void) {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state * UINT64_C(0x9e3779b97f4a7c15);
}

static float draw_float(void) {
    static const float odd[] = {0,         -0.0F,   1,       -1,
                                INFINITY,  NAN,     1e-45F,  -1e-45F,
                                -INFINITY, 3.4e38F, 1.2e-38F};
    uint32_t bits = (uint32_t)(draw() >> 32);
    float value;
    if (bits % 3 == 0)
        return odd[draw() % (sizeof odd / sizeof odd[0])];
    memcpy(&value, &bits, sizeof value);
    return value;
}

static double draw_double(void) {
    uint64_t bits = draw();
    double value;
    if (bits % 2 == 0)
        return (double)draw_float();
    memcpy(&value, &bits, sizeof value);
    return value;
}

static bool same(double a, double b) {
    return (isnan(a) && isnan(b)) || (a == b && signbit(a) == signbit(b));
}

static int begin(void **unused) {
    (void)unused;
    state = 88172645463325252u;
    return 0;
}

TEST_WITH(doubles, begin, NULL) {
    _Alignas(INCODE_VECTOR) double x[D], y[D];
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < D; i++) {
            x[i] = draw_double();
            y[i] = draw() % 4 == 0 ? x[i] : draw_double();
        }
        incode_vd a = incode_vd_load(x), b = incode_vd_load(y);
        incode_vd max = incode_vd_max(a, b), min = incode_vd_min(a, b);
        incode_vd chosen = incode_vd_select(a <= b, a, b);
        uint32_t mask = incode_vd_mask(a < b);
        for (int i = 0; i < D; i++) {
            assert_true(same(max[i], x[i] > y[i] ? x[i] : y[i]));
            assert_true(same(min[i], x[i] < y[i] ? x[i] : y[i]));
            assert_true(same(chosen[i], x[i] <= y[i] ? x[i] : y[i]));
            assert_int_equal(mask >> i & 1, x[i] < y[i]);
        }
        assert_int_equal(mask & ~(uint32_t)INCODE_VD_ALL, 0);
    }
    assert_int_equal(incode_vd_mask(incode_vl_ones()), INCODE_VD_ALL);
    assert_true(same(incode_vd_all(-0.0)[D - 1], -0.0));
}

TEST_WITH(rows, begin, NULL) {
    for (int round = 0; round < ROUNDS; round++) {
        incode_vd row[D];
        double least[D];
        for (int k = 0; k < D; k++) {
            least[k] = INFINITY;
            for (int i = 0; i < D; i++) {
                double x = draw_double();
                row[k][i] = isnan(x) ? 0 : x;
                least[k] = row[k][i] < least[k] ? row[k][i] : least[k];
            }
        }
        incode_vd each = incode_vd_least_of_each(row);
        for (int k = 0; k < D; k++)
            assert_true(each[k] == least[k]);
    }
}

TEST_WITH(products, begin, NULL) {
    _Alignas(INCODE_VECTOR) double x[D], y[D];
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < D; i++) {
            x[i] = ldexp((double)(int64_t)draw(), (int)(draw() % 800) - 400);
            y[i] = ldexp((double)(int64_t)draw(), (int)(draw() % 800) - 400);
        }
        incode_vd error, p = incode_vd_two_product(incode_vd_load(x),
                                                   incode_vd_load(y), &error);
        for (int i = 0; i < D; i++) {
            assert_true(p[i] == x[i] * y[i]);
            assert_true(error[i] == fma(x[i], y[i], -p[i]));
        }
    }
}

TEST_WITH(floats, begin, NULL) {
    _Alignas(INCODE_VECTOR) float x[F], y[F];
    _Alignas(INCODE_VECTOR) int32_t known[F];
    for (int round = 0; round < ROUNDS; round++) {
        float least = INFINITY;
        for (int i = 0; i < F; i++) {
            x[i] = draw_float();
            y[i] = draw() % 4 == 0 ? x[i] : draw_float();
            known[i] = isnan(x[i]) ? 0 : -1;
            least = x[i] < least ? x[i] : least;
        }
        incode_vf a = incode_vf_load(x), b = incode_vf_load(y);
        incode_vf max = incode_vf_max(a, b), ratio = incode_vf_ratio(a, b);
        incode_vf number =
            incode_vf_select(incode_vi_load(known), a, incode_vf_all(INFINITY));
        uint32_t less = incode_vm_bits(incode_vf_less(a, b));
        assert_true(incode_vf_least_of(number) == least);
        for (int i = 0; i < F; i++) {
            float q = x[i] / y[i];
            assert_true(same(max[i], x[i] > y[i] ? x[i] : y[i]));
            assert_int_equal(less >> i & 1, x[i] < y[i]);
            if (isnormal(q) && fabsf(y[i]) > 1e-37F && fabsf(y[i]) < 1e37F)
                assert_true(fabsf(ratio[i] - q) <= fabsf(q) * 0x1p-13F);
        }
        assert_int_equal(less & ~(uint32_t)INCODE_VF_ALL, 0);
    }
}

TEST_WITH(whole_numbers, begin, NULL) {
    _Alignas(INCODE_VECTOR) uint32_t x[F], lo[F], span[F];
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < F; i++) {
            x[i] = (uint32_t)(draw() >> 32);
            lo[i] = draw() % 4 == 0 ? x[i] : (uint32_t)(draw() >> 32);
            span[i] = draw() % 4 == 0 ? x[i] - lo[i] : (uint32_t)(draw() >> 32);
        }
        incode_vi a = incode_vi_load(x), b = incode_vi_load(lo);
        incode_vm in = incode_vi_within(a, b, incode_vi_load(span));
        incode_vf one = incode_vf_all(1), two = incode_vf_all(2);
        incode_vf where = incode_vf_min_where(in, two, one);
        uint32_t equal = incode_vf_mask(a == b), within = incode_vm_bits(in);
        for (int i = 0; i < F; i++) {
            assert_int_equal(equal >> i & 1, x[i] == lo[i]);
            assert_int_equal(within >> i & 1, x[i] - lo[i] <= span[i]);
            assert_true(where[i] == (float)(2 - (within >> i & 1)));
            assert_int_equal((uint32_t)incode_vi_minus(a, b)[i], x[i] - lo[i]);
            assert_true(incode_vf_from(a)[i] == (float)(int32_t)x[i]);
        }
    }
    for (int i = 0; i < F; i++)
        assert_int_equal(incode_vi_count()[i], i);
}

/* What lies before byte `first` and from `last` on is as it was. */
static void assert_untouched(const uint8_t *bytes, size_t size, size_t first,
                             size_t last) {
    for (size_t i = 0; i < size; i++)
        assert_true((i >= first && i < last) || bytes[i] == GUARD);
}

TEST_WITH(packs, begin, NULL) {
    _Alignas(INCODE_VECTOR) int32_t x[F];
    _Alignas(INCODE_VECTOR) double y[D];
    for (int round = 0; round < ROUNDS; round++) {
        int32_t whole[2 * F + OFFSETS], cut[2 * D + OFFSETS];
        uint32_t count[2 * D + OFFSETS];
        double real[2 * D + OFFSETS];
        uint32_t mask = (uint32_t)(draw() >> 40) & INCODE_VF_ALL;
        size_t at = draw() % OFFSETS, n = at, m = at;
        memset(whole, GUARD, sizeof whole);
        memset(cut, GUARD, sizeof cut);
        memset(count, GUARD, sizeof count);
        memset(real, GUARD, sizeof real);
        for (int i = 0; i < F; i++)
            x[i] = (int32_t)(draw() >> 32);
        for (int i = 0; i < D; i++)
            y[i] = (double)(int64_t)draw() * 0x1.7p-33;
        incode_vi_pack(whole + at, mask, incode_vi_load(x));
        incode_vd_pack(real + at, mask & INCODE_VD_ALL, incode_vd_load(y));
        incode_pack_count(count + at, mask & INCODE_VD_ALL, 1000);
        incode_vd_cut(cut + at, incode_vd_load(y));
        for (int i = 0; i < F; i++)
            if ((mask >> i & 1) != 0)
                assert_int_equal(whole[n++], x[i]);
        for (int i = 0; i < D; i++) {
            assert_int_equal(cut[at + (size_t)i], (int32_t)y[i]);
            if ((mask >> i & 1) != 0) {
                assert_int_equal(count[m], 1000 + i);
                assert_true(real[m++] == y[i]);
            }
        }
        assert_untouched((void *)whole, sizeof whole, 4 * at, 4 * (at + F));
        assert_untouched((void *)real, sizeof real, 8 * at, 8 * (at + D));
        assert_untouched((void *)count, sizeof count, 4 * at, 4 * (at + D));
        assert_untouched((void *)cut, sizeof cut, 4 * at, 4 * (at + D));
    }
}
