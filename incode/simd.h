/* Vectors of 64 bytes in the compiler's own vector extension: one AVX-512
 * register, two of AVX2, or plain code on a processor without any.  Products
 * and sums stay separate operations (-ffp-contract=off); nothing computed here
 * decides anything without a rigorous error bound beside it.
 *
 * Memory: none.  Work: constant.
 *
 *     incode_vd d = incode_vd_load(box->lo[0]) - incode_vd_all(v[0]);
 *     uint32_t near = incode_vd_mask(d < limit);
 */
#ifndef INCODE_SIMD_H
#define INCODE_SIMD_H

#include <stdint.h>

typedef float incode_vf __attribute__((vector_size(64), may_alias));
typedef int32_t incode_vi __attribute__((vector_size(64), may_alias));
typedef uint32_t incode_vu __attribute__((vector_size(64), may_alias));
typedef double incode_vd __attribute__((vector_size(64), may_alias));
typedef int64_t incode_vl __attribute__((vector_size(64), may_alias));

enum { INCODE_VF_LANES = 16, INCODE_VD_LANES = 8 };

#define INCODE_INLINE static inline __attribute__((always_inline))

#ifdef __AVX512DQ__
#include <immintrin.h>
#endif

INCODE_INLINE incode_vd incode_vd_load(const double *p)
{
    return *(const incode_vd *)p;
}

INCODE_INLINE incode_vf incode_vf_load(const float *p)
{
    return *(const incode_vf *)p;
}

INCODE_INLINE incode_vi incode_vi_load(const void *p)
{
    return *(const incode_vi *)p;
}

INCODE_INLINE incode_vd incode_vd_all(double a)
{
    return (incode_vd){a, a, a, a, a, a, a, a};
}

INCODE_INLINE incode_vf incode_vf_all(float a)
{
    return (incode_vf){a, a, a, a, a, a, a, a, a, a, a, a, a, a, a, a};
}

/* One bit a lane, from a comparison's result (0 or -1 a lane). */
INCODE_INLINE uint32_t incode_vd_mask(incode_vl m)
{
#ifdef __AVX512DQ__
    return (uint32_t)_mm512_movepi64_mask((__m512i)m);
#else
    uint32_t bits = 0;
    for (int i = 0; i < INCODE_VD_LANES; i++)
        bits |= (uint32_t)(m[i] & 1) << i;
    return bits;
#endif
}

INCODE_INLINE uint32_t incode_vf_mask(incode_vi m)
{
#ifdef __AVX512DQ__
    return (uint32_t)_mm512_movepi32_mask((__m512i)m);
#else
    uint32_t bits = 0;
    for (int i = 0; i < INCODE_VF_LANES; i++)
        bits |= (uint32_t)(m[i] & 1) << i;
    return bits;
#endif
}

/* Masks of 16 lanes as the processor likes them: bits, or lanes of 0 and -1. */
#ifdef __AVX512DQ__
typedef __mmask16 incode_vm;
#else
typedef incode_vi incode_vm;
#endif

INCODE_INLINE incode_vm incode_vf_less(incode_vf a, incode_vf b)
{
#ifdef __AVX512DQ__
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
#else
    return a < b;
#endif
}

INCODE_INLINE incode_vf incode_vf_pick(incode_vm m, incode_vf a, incode_vf b)
{
#ifdef __AVX512DQ__
    return (incode_vf)_mm512_mask_blend_ps(m, (__m512)b, (__m512)a);
#else
    return (incode_vf)((m & (incode_vi)a) | (~m & (incode_vi)b));
#endif
}

INCODE_INLINE incode_vi incode_vi_pick(incode_vm m, incode_vi a, incode_vi b)
{
#ifdef __AVX512DQ__
    return (incode_vi)_mm512_mask_blend_epi32(m, (__m512i)b, (__m512i)a);
#else
    return (m & a) | (~m & b);
#endif
}

INCODE_INLINE uint32_t incode_vm_bits(incode_vm m)
{
#ifdef __AVX512DQ__
    return m;
#else
    uint32_t bits = 0;
    for (int i = 0; i < INCODE_VF_LANES; i++)
        bits |= (uint32_t)(m[i] & 1) << i;
    return bits;
#endif
}

/* a - lo <= span, in whole numbers modulo 2^32. */
INCODE_INLINE incode_vm incode_vi_within(incode_vi a, incode_vi lo,
                                         incode_vi span)
{
#ifdef __AVX512DQ__
    return _mm512_cmple_epu32_mask(_mm512_sub_epi32((__m512i)a, (__m512i)lo),
                                   (__m512i)span);
#else
    return (incode_vu)a - (incode_vu)lo <= (incode_vu)span;
#endif
}

/* a - b modulo 2^32. */
INCODE_INLINE incode_vi incode_vi_minus(incode_vi a, incode_vi b)
{
    return (incode_vi)((incode_vu)a - (incode_vu)b);
}

/* Whole numbers as floats. */
INCODE_INLINE incode_vf incode_vf_from(incode_vi a)
{
    return __builtin_convertvector(a, incode_vf);
}

INCODE_INLINE incode_vi incode_vi_all(int32_t a)
{
    return (incode_vi){a, a, a, a, a, a, a, a, a, a, a, a, a, a, a, a};
}

/* Eight numbers below 2^31, cut to whole ones. */
INCODE_INLINE void incode_vd_cut(int32_t *out, incode_vd a)
{
#ifdef __AVX512DQ__
    _mm256_storeu_si256((__m256i *)(void *)out,
                        _mm512_cvttpd_epi32((__m512d)a));
#else
    for (int i = 0; i < INCODE_VD_LANES; i++)
        out[i] = (int32_t)a[i];
#endif
}

/* About a / b. */
INCODE_INLINE incode_vf incode_vf_ratio(incode_vf a, incode_vf b)
{
#ifdef __AVX512DQ__
    return a * (incode_vf)_mm512_rcp14_ps((__m512)b);
#else
    return a / b;
#endif
}

/* The smaller of a and b in lanes of m, else a. */
INCODE_INLINE incode_vf incode_vf_min_where(incode_vm m, incode_vf a,
                                            incode_vf b)
{
#ifdef __AVX512DQ__
    return (incode_vf)_mm512_mask_min_ps((__m512)a, m, (__m512)a, (__m512)b);
#else
    return incode_vf_pick(m & (b < a), b, a);
#endif
}

INCODE_INLINE float incode_vf_least_of(incode_vf a)
{
#ifdef __AVX512DQ__
    return _mm512_reduce_min_ps((__m512)a);
#else
    float least = a[0];
    for (int i = 1; i < INCODE_VF_LANES; i++)
        least = a[i] < least ? a[i] : least;
    return least;
#endif
}

/* m ? a : b in each lane. */
INCODE_INLINE incode_vd incode_vd_select(incode_vl m, incode_vd a, incode_vd b)
{
    return (incode_vd)((m & (incode_vl)a) | (~m & (incode_vl)b));
}

INCODE_INLINE incode_vf incode_vf_select(incode_vi m, incode_vf a, incode_vf b)
{
    return (incode_vf)((m & (incode_vi)a) | (~m & (incode_vi)b));
}

/* The larger and the smaller of two; the second where one is not a number. */
INCODE_INLINE incode_vd incode_vd_max(incode_vd a, incode_vd b)
{
#ifdef __AVX512DQ__
    return (incode_vd)_mm512_max_pd((__m512d)a, (__m512d)b);
#else
    return incode_vd_select(a > b, a, b);
#endif
}

INCODE_INLINE incode_vf incode_vf_max(incode_vf a, incode_vf b)
{
#ifdef __AVX512DQ__
    return (incode_vf)_mm512_max_ps((__m512)a, (__m512)b);
#else
    return incode_vf_select(a > b, a, b);
#endif
}

INCODE_INLINE incode_vd incode_vd_min(incode_vd a, incode_vd b)
{
#ifdef __AVX512DQ__
    return (incode_vd)_mm512_min_pd((__m512d)a, (__m512d)b);
#else
    return incode_vd_select(a < b, a, b);
#endif
}

/* a * b + c: for what only proposes, or stands under an error bound. */
INCODE_INLINE incode_vf incode_vf_fma(incode_vf a, incode_vf b, incode_vf c)
{
#ifdef __AVX512DQ__
    return (incode_vf)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
#else
    return a * b + c;
#endif
}

/* a b and, in *error, what its rounding lost: exact where nothing overflows or
 * underflows (Dekker, Numerische Mathematik 18, 1971). */
INCODE_INLINE incode_vd incode_vd_two_product(incode_vd a, incode_vd b,
                                              incode_vd *error)
{
    incode_vd p = a * b;
#ifdef __AVX512DQ__
    *error = (incode_vd)_mm512_fmsub_pd((__m512d)a, (__m512d)b, (__m512d)p);
#else
    incode_vd split = incode_vd_all(0x1p27 + 1), c = split * a, d = split * b;
    incode_vd ah = c - (c - a), bh = d - (d - b), al = a - ah, bl = b - bh;
    *error = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
#endif
    return p;
}

/* Lanes of eight whose bit is set, packed together; the rest is undefined. */
INCODE_INLINE void incode_vd_pack(double *out, uint32_t mask, incode_vd a)
{
#ifdef __AVX512DQ__
    _mm512_storeu_pd(out, _mm512_maskz_compress_pd((__mmask8)mask, (__m512d)a));
#else
    for (int i = 0, n = 0; i < INCODE_VD_LANES; i++) {
        out[n] = a[i];
        n += (int)(mask >> i & 1);
    }
#endif
}

/* Lanes of sixteen whose bit is set, packed together; the rest is undefined. */
INCODE_INLINE void incode_vi_pack(void *to, uint32_t mask, incode_vi a)
{
    uint32_t *out = to;
#ifdef __AVX512DQ__
    _mm512_storeu_si512(
        out, _mm512_maskz_compress_epi32((__mmask16)mask, (__m512i)a));
#else
    for (uint32_t i = 0, n = 0; i < INCODE_VF_LANES; i++) {
        out[n] = (uint32_t)a[i];
        n += mask >> i & 1;
    }
#endif
}

/* first, first + 1, ... of the lanes whose bit is set, packed together. */
INCODE_INLINE void incode_pack_count(uint32_t *out, uint32_t mask,
                                     uint32_t first)
{
#ifdef __AVX512DQ__
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

INCODE_INLINE incode_vf incode_vf_abs(incode_vf a)
{
    return (incode_vf)((incode_vi)a & incode_vi_all(INT32_MAX));
}

INCODE_INLINE incode_vd incode_vd_abs(incode_vd a)
{
    return incode_vd_max(a, -a);
}

#endif
