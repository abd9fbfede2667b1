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

INCODE_INLINE incode_vd incode_vd_abs(incode_vd a)
{
    return incode_vd_max(a, -a);
}

#endif
