/* Vectors in the compiler's own extension, as wide as the processor's
 * registers: 64 bytes with AVX-512, 32 with AVX2, 16 with SSE2 and NEON, and a
 * double at a time on a processor without any.  Products and sums stay separate
 * operations (-ffp-contract=off); nothing computed here decides anything
 * without a rigorous error bound beside it. */
#ifndef INCODE_SIMD_H
#define INCODE_SIMD_H

#include <stdint.h>

#if defined(__AVX512DQ__) && defined(__AVX512VL__)
#define INCODE_AVX512
#elif defined(__AVX2__) && defined(__FMA__) && defined(__BMI2__)
#define INCODE_AVX2
#elif defined(__SSE2__)
#define INCODE_SSE2
#elif defined(__aarch64__)
#define INCODE_NEON
#else
#define INCODE_PLAIN
#endif

#if defined(INCODE_AVX512) || defined(INCODE_AVX2) || defined(INCODE_SSE2)
#include <immintrin.h>
#elif defined(INCODE_NEON)
#include <arm_neon.h>
#endif

#if defined(INCODE_AVX512)
#define INCODE_VECTOR 64
#elif defined(INCODE_AVX2)
#define INCODE_VECTOR 32
#elif defined(INCODE_PLAIN)
#define INCODE_VECTOR 8
#else
#define INCODE_VECTOR 16
#endif

typedef float incode_vf __attribute__((vector_size(INCODE_VECTOR), may_alias));
typedef int32_t incode_vi
    __attribute__((vector_size(INCODE_VECTOR), may_alias));
typedef int32_t incode_lane __attribute__((may_alias));
typedef uint32_t incode_vu
    __attribute__((vector_size(INCODE_VECTOR), may_alias));
typedef double incode_vd __attribute__((vector_size(INCODE_VECTOR), may_alias));
typedef int64_t incode_vl
    __attribute__((vector_size(INCODE_VECTOR), may_alias));

enum {
    INCODE_VF_LANES = INCODE_VECTOR / 4,
    INCODE_VD_LANES = INCODE_VECTOR / 8,
    INCODE_VF_ALL = (1 << INCODE_VF_LANES) - 1, /* a bit each */
    INCODE_VD_ALL = (1 << INCODE_VD_LANES) - 1
};

#define INCODE_INLINE static inline __attribute__((always_inline))

/* ---- from memory, and from one number ---- */

INCODE_INLINE incode_vd incode_vd_load(const double *p) {
    return *(const incode_vd *)p;
}

INCODE_INLINE incode_vf incode_vf_load(const float *p) {
    return *(const incode_vf *)p;
}

INCODE_INLINE incode_vi incode_vi_load(const void *p) {
    return *(const incode_vi *)p;
}

INCODE_INLINE incode_vd incode_vd_all(double a) {
    return a - (incode_vd){0};
}

INCODE_INLINE incode_vf incode_vf_all(float a) {
    return a - (incode_vf){0};
}

INCODE_INLINE incode_vi incode_vi_all(int32_t a) {
    return a - (incode_vi){0};
}

INCODE_INLINE incode_vl incode_vl_ones(void) {
    return ~(incode_vl){0};
}

/* 0, 1, 2, ... */
INCODE_INLINE incode_vi incode_vi_count(void) {
    static const int32_t count[16] __attribute__((aligned(64))) = {
        0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    return incode_vi_load(count);
}

INCODE_INLINE incode_vd incode_vd_count(void) {
    static const double count[8]
        __attribute__((aligned(64))) = {0, 1, 2, 3, 4, 5, 6, 7};
    return incode_vd_load(count);
}

/* ---- masks ---- */

/* One bit a lane, from a comparison's result (0 or -1 a lane). */
INCODE_INLINE uint32_t incode_vd_mask(incode_vl m) {
#if defined(INCODE_AVX512)
    return (uint32_t)_mm512_movepi64_mask((__m512i)m);
#elif defined(INCODE_AVX2)
    return (uint32_t)_mm256_movemask_pd((__m256d)m);
#elif defined(INCODE_SSE2)
    return (uint32_t)_mm_movemask_pd((__m128d)m);
#elif defined(INCODE_NEON)
    return (uint32_t)(m[0] & 1) | (uint32_t)(m[1] & 2);
#else
    return m[0] & 1;
#endif
}

INCODE_INLINE uint32_t incode_vf_mask(incode_vi m) {
#if defined(INCODE_AVX512)
    return (uint32_t)_mm512_movepi32_mask((__m512i)m);
#elif defined(INCODE_AVX2)
    return (uint32_t)_mm256_movemask_ps((__m256)m);
#elif defined(INCODE_SSE2)
    return (uint32_t)_mm_movemask_ps((__m128)m);
#elif defined(INCODE_NEON)
    return vaddvq_u32((uint32x4_t)(m & (incode_vi){1, 2, 4, 8}));
#else
    return (uint32_t)(m[0] & 1) | (uint32_t)(m[1] & 2);
#endif
}

/* Masks of lanes as the processor likes them: bits, or lanes of 0 and -1. */
#ifdef INCODE_AVX512
typedef __mmask16 incode_vm;
typedef __mmask8 incode_vdm;
#else
typedef incode_vi incode_vm;
typedef incode_vl incode_vdm;
#endif

INCODE_INLINE incode_vm incode_vf_less(incode_vf a, incode_vf b) {
#ifdef INCODE_AVX512
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
#else
    return a < b;
#endif
}

INCODE_INLINE incode_vdm incode_vd_less(incode_vd a, incode_vd b) {
#ifdef INCODE_AVX512
    return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_LT_OQ);
#else
    return a < b;
#endif
}

INCODE_INLINE uint32_t incode_vdm_bits(incode_vdm m) {
#ifdef INCODE_AVX512
    return m;
#else
    return incode_vd_mask(m);
#endif
}

INCODE_INLINE uint32_t incode_vm_bits(incode_vm m) {
#ifdef INCODE_AVX512
    return m;
#else
    return incode_vf_mask(m);
#endif
}

/* a - lo <= span, in whole numbers modulo 2^32. */
INCODE_INLINE incode_vm incode_vi_within(incode_vi a, incode_vi lo,
                                         incode_vi span) {
#ifdef INCODE_AVX512
    return _mm512_cmple_epu32_mask(_mm512_sub_epi32((__m512i)a, (__m512i)lo),
                                   (__m512i)span);
#else
    return (incode_vu)a - (incode_vu)lo <= (incode_vu)span;
#endif
}

/* m ? a : b in each lane. */
INCODE_INLINE incode_vd incode_vd_select(incode_vl m, incode_vd a,
                                         incode_vd b) {
#ifdef INCODE_AVX2
    return (incode_vd)_mm256_blendv_pd((__m256d)b, (__m256d)a, (__m256d)m);
#elif defined(INCODE_PLAIN)
    return m[0] != 0 ? a : b;
#else
    return (incode_vd)((m & (incode_vl)a) | (~m & (incode_vl)b));
#endif
}

INCODE_INLINE incode_vf incode_vf_select(incode_vi m, incode_vf a,
                                         incode_vf b) {
#ifdef INCODE_AVX2
    return (incode_vf)_mm256_blendv_ps((__m256)b, (__m256)a, (__m256)m);
#elif defined(INCODE_PLAIN)
    return (incode_vf){m[0] != 0 ? a[0] : b[0], m[1] != 0 ? a[1] : b[1]};
#else
    return (incode_vf)((m & (incode_vi)a) | (~m & (incode_vi)b));
#endif
}

/* The smaller of a and b in lanes of m, else a. */
INCODE_INLINE incode_vf incode_vf_min_where(incode_vm m, incode_vf a,
                                            incode_vf b) {
#ifdef INCODE_AVX512
    return (incode_vf)_mm512_mask_min_ps((__m512)a, m, (__m512)a, (__m512)b);
#else
    return incode_vf_select(m & (b < a), b, a);
#endif
}

/* ---- arithmetic ---- */

/* The larger and the smaller of two; the second where one is not a number. */
INCODE_INLINE incode_vd incode_vd_max(incode_vd a, incode_vd b) {
#if defined(INCODE_AVX512)
    return (incode_vd)_mm512_max_pd((__m512d)a, (__m512d)b);
#elif defined(INCODE_AVX2)
    return (incode_vd)_mm256_max_pd((__m256d)a, (__m256d)b);
#elif defined(INCODE_SSE2)
    return (incode_vd)_mm_max_pd((__m128d)a, (__m128d)b);
#elif defined(INCODE_PLAIN)
    return (incode_vd){a[0] > b[0] ? a[0] : b[0]};
#else
    return incode_vd_select(a > b, a, b);
#endif
}

INCODE_INLINE incode_vd incode_vd_min(incode_vd a, incode_vd b) {
#if defined(INCODE_AVX512)
    return (incode_vd)_mm512_min_pd((__m512d)a, (__m512d)b);
#elif defined(INCODE_AVX2)
    return (incode_vd)_mm256_min_pd((__m256d)a, (__m256d)b);
#elif defined(INCODE_SSE2)
    return (incode_vd)_mm_min_pd((__m128d)a, (__m128d)b);
#elif defined(INCODE_PLAIN)
    return (incode_vd){a[0] < b[0] ? a[0] : b[0]};
#else
    return incode_vd_select(a < b, a, b);
#endif
}

INCODE_INLINE incode_vf incode_vf_max(incode_vf a, incode_vf b) {
#if defined(INCODE_AVX512)
    return (incode_vf)_mm512_max_ps((__m512)a, (__m512)b);
#elif defined(INCODE_AVX2)
    return (incode_vf)_mm256_max_ps((__m256)a, (__m256)b);
#elif defined(INCODE_SSE2)
    return (incode_vf)_mm_max_ps((__m128)a, (__m128)b);
#elif defined(INCODE_PLAIN)
    return (incode_vf){a[0] > b[0] ? a[0] : b[0], a[1] > b[1] ? a[1] : b[1]};
#else
    return incode_vf_select(a > b, a, b);
#endif
}

INCODE_INLINE incode_vf incode_vf_min(incode_vf a, incode_vf b) {
#if defined(INCODE_AVX512)
    return (incode_vf)_mm512_min_ps((__m512)a, (__m512)b);
#elif defined(INCODE_AVX2)
    return (incode_vf)_mm256_min_ps((__m256)a, (__m256)b);
#elif defined(INCODE_SSE2)
    return (incode_vf)_mm_min_ps((__m128)a, (__m128)b);
#elif defined(INCODE_PLAIN)
    return (incode_vf){a[0] < b[0] ? a[0] : b[0], a[1] < b[1] ? a[1] : b[1]};
#else
    return incode_vf_select(a < b, a, b);
#endif
}

INCODE_INLINE float incode_vf_least_of(incode_vf a) {
#ifdef INCODE_AVX512
    return _mm512_reduce_min_ps((__m512)a);
#else
    float least = a[0];
    for (int i = 1; i < INCODE_VF_LANES; i++)
        least = a[i] < least ? a[i] : least;
    return least;
#endif
}

INCODE_INLINE double incode_vd_least_of(incode_vd a) {
#ifdef INCODE_AVX512
    return _mm512_reduce_min_pd((__m512d)a);
#else
    double least = a[0];
    for (int i = 1; i < INCODE_VD_LANES; i++)
        least = a[i] < least ? a[i] : least;
    return least;
#endif
}

/* The least of each of as many vectors as one has lanes, in their order. */
INCODE_INLINE incode_vd
incode_vd_least_of_each(const incode_vd a[INCODE_VD_LANES]) {
#if defined(INCODE_AVX512)
    __m512d b[4], c[2];
    for (int i = 0; i < 4; i++) {
        __m512d even = (__m512d)a[2 * i], odd = (__m512d)a[2 * i + 1];
        b[i] = _mm512_min_pd(_mm512_unpacklo_pd(even, odd),
                             _mm512_unpackhi_pd(even, odd));
    }
    for (int i = 0; i < 2; i++)
        c[i] =
            _mm512_min_pd(_mm512_shuffle_f64x2(b[2 * i], b[2 * i + 1], 0x88),
                          _mm512_shuffle_f64x2(b[2 * i], b[2 * i + 1], 0xdd));
    return (incode_vd)_mm512_min_pd(_mm512_shuffle_f64x2(c[0], c[1], 0x88),
                                    _mm512_shuffle_f64x2(c[0], c[1], 0xdd));
#elif defined(INCODE_AVX2)
    __m256d b[2];
    for (int i = 0; i < 2; i++) {
        __m256d even = (__m256d)a[2 * i], odd = (__m256d)a[2 * i + 1];
        b[i] = _mm256_min_pd(_mm256_unpacklo_pd(even, odd),
                             _mm256_unpackhi_pd(even, odd));
    }
    return (incode_vd)_mm256_min_pd(_mm256_permute2f128_pd(b[0], b[1], 0x20),
                                    _mm256_permute2f128_pd(b[0], b[1], 0x31));
#elif defined(INCODE_PLAIN)
    return a[0];
#else
    incode_vd even = {a[0][0], a[1][0]}, odd = {a[0][1], a[1][1]};
    return incode_vd_min(even, odd);
#endif
}

INCODE_INLINE incode_vf incode_vf_abs(incode_vf a) {
#ifdef INCODE_PLAIN
    return (incode_vf){__builtin_fabsf(a[0]), __builtin_fabsf(a[1])};
#else
    return (incode_vf)((incode_vi)a & incode_vi_all(INT32_MAX));
#endif
}

INCODE_INLINE incode_vd incode_vd_abs(incode_vd a) {
#ifdef INCODE_PLAIN
    return (incode_vd){__builtin_fabs(a[0])};
#else
    return incode_vd_max(a, -a);
#endif
}

/* About a / b. */
INCODE_INLINE incode_vf incode_vf_ratio(incode_vf a, incode_vf b) {
#ifdef INCODE_AVX512
    return a * (incode_vf)_mm512_rcp14_ps((__m512)b);
#else
    return a / b;
#endif
}

/* a * b + c: for what only proposes, or stands under an error bound. */
INCODE_INLINE incode_vf incode_vf_fma(incode_vf a, incode_vf b, incode_vf c) {
#if defined(INCODE_AVX512)
    return (incode_vf)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
#elif defined(INCODE_AVX2)
    return (incode_vf)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#elif defined(INCODE_NEON)
    return (incode_vf)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b);
#else
    return a * b + c;
#endif
}

INCODE_INLINE incode_vd incode_vd_fma(incode_vd a, incode_vd b, incode_vd c) {
#if defined(INCODE_AVX512)
    return (incode_vd)_mm512_fmadd_pd((__m512d)a, (__m512d)b, (__m512d)c);
#elif defined(INCODE_AVX2)
    return (incode_vd)_mm256_fmadd_pd((__m256d)a, (__m256d)b, (__m256d)c);
#elif defined(INCODE_NEON)
    return (incode_vd)vfmaq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b);
#else
    return a * b + c;
#endif
}

/* a b and, in *error, what its rounding lost: exact where nothing overflows or
 * underflows (Dekker, Numerische Mathematik 18, 1971). */
INCODE_INLINE incode_vd incode_vd_two_product(incode_vd a, incode_vd b,
                                              incode_vd *error) {
    incode_vd p = a * b;
#if defined(INCODE_AVX512)
    *error = (incode_vd)_mm512_fmsub_pd((__m512d)a, (__m512d)b, (__m512d)p);
#elif defined(INCODE_AVX2)
    *error = (incode_vd)_mm256_fmsub_pd((__m256d)a, (__m256d)b, (__m256d)p);
#elif defined(INCODE_NEON)
    *error =
        (incode_vd)vfmaq_f64((float64x2_t)-p, (float64x2_t)a, (float64x2_t)b);
#else
    incode_vd split = incode_vd_all(0x1p27 + 1), c = split * a, d = split * b;
    incode_vd ah = c - (c - a), bh = d - (d - b), al = a - ah, bl = b - bh;
    *error = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
#endif
    return p;
}

/* a - b modulo 2^32. */
INCODE_INLINE incode_vi incode_vi_minus(incode_vi a, incode_vi b) {
    return (incode_vi)((incode_vu)a - (incode_vu)b);
}

/* Whole numbers as floats. */
INCODE_INLINE incode_vf incode_vf_from(incode_vi a) {
    return __builtin_convertvector(a, incode_vf);
}

/* Numbers below 2^31, cut to whole ones. */
INCODE_INLINE void incode_vd_cut(int32_t *out, incode_vd a) {
#if defined(INCODE_AVX512)
    _mm256_storeu_si256((__m256i *)(void *)out,
                        _mm512_cvttpd_epi32((__m512d)a));
#elif defined(INCODE_AVX2)
    _mm_storeu_si128((__m128i *)(void *)out, _mm256_cvttpd_epi32((__m256d)a));
#else
    for (int i = 0; i < INCODE_VD_LANES; i++)
        out[i] = (int32_t)a[i];
#endif
}

/* As single precision has them; beyond its range, infinite. */
INCODE_INLINE void incode_vd_store_float(float *out, incode_vd a) {
#if defined(INCODE_AVX512)
    _mm256_store_ps(out, _mm512_cvtpd_ps((__m512d)a));
#elif defined(INCODE_AVX2)
    _mm_store_ps(out, _mm256_cvtpd_ps((__m256d)a));
#else
    for (uint32_t i = 0; i < INCODE_VD_LANES; i++)
        out[i] = (float)a[i];
#endif
}

/* ---- lanes whose bit is set, packed together ---- */

#ifdef INCODE_AVX2
/* Where lanes of four bytes come from: bytes 0 .. 7 of which `mask`, a byte of
 * ones each, keeps some. */
INCODE_INLINE __m256i incode_packing(uint64_t mask) {
    uint64_t kept = _pext_u64(UINT64_C(0x0706050403020100), mask);
    return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((int64_t)kept));
}
#endif

/* The rest of what is written, a whole vector, is undefined. */
INCODE_INLINE void incode_vi_pack(void *out, uint32_t mask, incode_vi a) {
#if defined(INCODE_AVX512)
    _mm512_storeu_si512(
        out, _mm512_maskz_compress_epi32((__mmask16)mask, (__m512i)a));
#elif defined(INCODE_AVX2)
    uint64_t bytes = _pdep_u64(mask, UINT64_C(0x0101010101010101)) * 0xff;
    _mm256_storeu_si256(
        out, _mm256_permutevar8x32_epi32((__m256i)a, incode_packing(bytes)));
#else
    incode_lane *to = out;
    for (uint32_t i = 0, n = 0; i < INCODE_VF_LANES; i++) {
        to[n] = a[i];
        n += mask >> i & 1;
    }
#endif
}

INCODE_INLINE void incode_vd_pack(double *out, uint32_t mask, incode_vd a) {
#ifdef INCODE_AVX512
    _mm512_storeu_pd(out, _mm512_maskz_compress_pd((__mmask8)mask, (__m512d)a));
#elif defined(INCODE_AVX2)
    uint64_t bytes = _pdep_u64(mask, UINT64_C(0x0001000100010001)) * 0xffff;
    _mm256_storeu_si256(
        (__m256i *)(void *)out,
        _mm256_permutevar8x32_epi32((__m256i)a, incode_packing(bytes)));
#else
    for (int i = 0, n = 0; i < INCODE_VD_LANES; i++) {
        out[n] = a[i];
        n += (int)(mask >> i & 1);
    }
#endif
}

/* first, first + 1, ... of the lanes of a vector of doubles. */
INCODE_INLINE void incode_pack_count(uint32_t *out, uint32_t mask,
                                     uint32_t first) {
#ifdef INCODE_AVX512
    __m256i lane = _mm256_add_epi32(_mm256_set1_epi32((int)first),
                                    _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
    _mm256_storeu_si256((__m256i *)(void *)out,
                        _mm256_maskz_compress_epi32((__mmask8)mask, lane));
#else
    for (uint32_t i = 0, n = 0; i < INCODE_VD_LANES; i++) {
        out[n] = first + i;
        n += mask >> i & 1;
    }
#endif
}

#endif
