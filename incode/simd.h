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

/* (p[i] - origin) * scale of 16 numbers, in single precision. */
INCODE_INLINE incode_vf incode_vf_relative(const double *p, incode_vd origin,
                                           incode_vd scale)
{
    incode_vd low = (incode_vd_load(p) - origin) * scale;
    incode_vd high = (incode_vd_load(p + INCODE_VD_LANES) - origin) * scale;
#ifdef __AVX512DQ__
    return (incode_vf)_mm512_insertf32x8(
        _mm512_castps256_ps512(_mm512_cvtpd_ps((__m512d)low)),
        _mm512_cvtpd_ps((__m512d)high), 1);
#else
    incode_vf out = incode_vf_all(0);
    for (int i = 0; i < INCODE_VD_LANES; i++) {
        out[i] = (float)low[i];
        out[i + INCODE_VD_LANES] = (float)high[i];
    }
    return out;
#endif
}

/* Lanes of sixteen whose bit is set, packed together; the rest is undefined. */
INCODE_INLINE void incode_vf_pack(float *out, uint32_t mask, incode_vf a)
{
#ifdef __AVX512DQ__
    _mm512_storeu_ps(out, _mm512_maskz_compress_ps((__mmask16)mask, (__m512)a));
#else
    for (uint32_t i = 0, n = 0; i < INCODE_VF_LANES; i++) {
        out[n] = a[i];
        n += mask >> i & 1;
    }
#endif
}

INCODE_INLINE void incode_vi_pack(uint32_t *out, uint32_t mask, incode_vi a)
{
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

/* The lane of the least value among those whose bit is set (mask != 0). */
INCODE_INLINE uint32_t incode_vf_least(incode_vf a, uint32_t mask)
{
#ifdef __AVX512DQ__
    __mmask16 m = (__mmask16)mask;
    float least = _mm512_mask_reduce_min_ps(m, (__m512)a);
    m = _mm512_mask_cmp_ps_mask(m, (__m512)a, _mm512_set1_ps(least),
                                _CMP_EQ_OQ);
    return m == 0 ? (uint32_t)__builtin_ctz(mask)
                  : (uint32_t)__builtin_ctz((uint32_t)m);
#else
    uint32_t best = (uint32_t)__builtin_ctz(mask);
    for (; mask != 0; mask &= mask - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(mask);
        if (a[i] < a[best])
            best = i;
    }
    return best;
#endif
}

INCODE_INLINE incode_vd incode_vd_abs(incode_vd a)
{
    return incode_vd_max(a, -a);
}

#endif
