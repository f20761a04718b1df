/* Boxes, or points of a block, as many at once as fill the widest vector of the
 * instruction set: explicit vectors, since loops over a few lanes are unrolled by
 * compilers before they could become one vector operation, and longer ones become
 * vector operations only as long as they are simple.  For *.kernel.c files only. */
#ifndef ZS_LANES_H
#define ZS_LANES_H

#include "field/operation.h"

#include <math.h>
#include <string.h>
#if defined __SSE2__
#include <immintrin.h>
#endif

/* For functions that are passed functions, constants at every call: all becomes
 * one loop. */
#define ZS_INLINE __attribute__((always_inline)) static inline

#if defined __AVX512F__
#define ZS_WIDTH 16
#elif defined __AVX__
#define ZS_WIDTH 8
#else
#define ZS_WIDTH 4
#endif

typedef float zs_lanes __attribute__((vector_size(4 * ZS_WIDTH), may_alias));
typedef int32_t zs_lanes_mask __attribute__((vector_size(4 * ZS_WIDTH))); /* by lane 0 or -1 */

/* The ZS_LANES boxes of a pass, and the samples of a lattice's row, are done part by
 * part: `part` is the first lane of each. */
#define ZS_FOR_PARTS(part) for (unsigned part = 0; part < ZS_LANES; part += ZS_WIDTH)

static inline zs_lanes zs_lanes_all(float x)
{
  return x - (zs_lanes){0};
}

/* 0, 1, 2 ... */
static inline zs_lanes zs_lanes_ascending(void)
{
  zs_lanes a;
  for (int l = 0; l < ZS_WIDTH; l++)
    a[l] = (float)l;
  return a;
}

static inline zs_lanes zs_lanes_select(zs_lanes_mask mask, zs_lanes yes, zs_lanes no)
{
  return (zs_lanes)((mask & (zs_lanes_mask)yes) | (~mask & (zs_lanes_mask)no));
}

/* NaN where the mask is not set. */
static inline zs_lanes zs_lanes_known(zs_lanes_mask mask, zs_lanes x)
{
  return (zs_lanes)((zs_lanes_mask)x | ~mask);
}

/* a < b ? a : b, and a > b ? a : b, which compilers do not recognize. */
static inline zs_lanes zs_lanes_smaller(zs_lanes a, zs_lanes b)
{
#if defined __AVX512F__
  return (zs_lanes)_mm512_min_ps((__m512)a, (__m512)b);
#elif defined __AVX__
  return (zs_lanes)_mm256_min_ps((__m256)a, (__m256)b);
#elif defined __SSE2__
  return (zs_lanes)_mm_min_ps((__m128)a, (__m128)b);
#else
  return zs_lanes_select(a < b, a, b);
#endif
}

static inline zs_lanes zs_lanes_larger(zs_lanes a, zs_lanes b)
{
#if defined __AVX512F__
  return (zs_lanes)_mm512_max_ps((__m512)a, (__m512)b);
#elif defined __AVX__
  return (zs_lanes)_mm256_max_ps((__m256)a, (__m256)b);
#elif defined __SSE2__
  return (zs_lanes)_mm_max_ps((__m128)a, (__m128)b);
#else
  return zs_lanes_select(a > b, a, b);
#endif
}

static inline zs_lanes zs_lanes_clamped(zs_lanes a, zs_lanes lo, zs_lanes hi)
{
  return zs_lanes_smaller(zs_lanes_larger(a, lo), hi);
}

static inline zs_lanes zs_lanes_absolute(zs_lanes a)
{
  return (zs_lanes)((zs_lanes_mask)a & INT32_MAX);
}

static inline zs_lanes zs_lanes_square_root(zs_lanes a)
{
#if defined __AVX512F__
  return (zs_lanes)_mm512_sqrt_ps((__m512)a);
#elif defined __AVX__
  return (zs_lanes)_mm256_sqrt_ps((__m256)a);
#elif defined __SSE2__
  return (zs_lanes)_mm_sqrt_ps((__m128)a);
#else
  for (int l = 0; l < ZS_WIDTH; l++)
    a[l] = sqrtf(a[l]);
  return a;
#endif
}

/* a b + c, rounded once where the machine can. */
static inline zs_lanes zs_lanes_multiply_add(zs_lanes a, zs_lanes b, zs_lanes c)
{
#if defined __AVX512F__
  return (zs_lanes)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
#elif defined __FMA__
  return (zs_lanes)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#else
  return a * b + c;
#endif
}

/* Blocks and bounds are aligned to whole vectors. */
static inline zs_lanes zs_lanes_load(const float *from)
{
  return *(const zs_lanes *)(const void *)from;
}

static inline void zs_lanes_store(float *to, zs_lanes a)
{
  *(zs_lanes *)(void *)to = a;
}

/* One bit per lane. */
static inline uint16_t zs_lanes_bits(zs_lanes_mask mask)
{
#if defined __AVX512DQ__
  return _mm512_movepi32_mask((__m512i)mask);
#elif defined __AVX__
  return (uint16_t)_mm256_movemask_ps((__m256)mask);
#elif defined __SSE2__
  return (uint16_t)_mm_movemask_ps((__m128)mask);
#else
  unsigned bits = 0;
  for (unsigned l = 0; l < ZS_WIDTH; l++)
    bits |= (unsigned)(mask[l] & 1) << l;
  return (uint16_t)bits;
#endif
}

/* Set the bits of a part, the first of which forgets what was there. */
static inline void zs_set_bits(uint16_t *bits, unsigned part, zs_lanes_mask mask)
{
  *bits = (uint16_t)((part ? *bits : 0) | zs_lanes_bits(mask) << part);
}

/* ---- Intervals ----------------------------------------------------------------
 *
 * The rules of interval.h, a vector at a time: NaN means unknown and stays
 * unknown, and ends are rounded outward. */

typedef struct zs_intervals {
  zs_lanes lo, hi;
} zs_intervals;

static inline zs_intervals zs_intervals_load(const zs_bounds *bounds, unsigned part)
{
  return (zs_intervals){zs_lanes_load(bounds->lo + part), zs_lanes_load(bounds->hi + part)};
}

static inline void zs_intervals_store(zs_bounds *bounds, unsigned part, zs_intervals a)
{
  zs_lanes_store(bounds->lo + part, a.lo);
  zs_lanes_store(bounds->hi + part, a.hi);
}

/* Unknown where not lo <= hi, or where the mask is not set. */
static inline zs_intervals zs_intervals_checked(zs_lanes lo, zs_lanes hi, zs_lanes_mask mask)
{
  mask &= lo <= hi;
  return (zs_intervals){zs_lanes_known(mask, lo), zs_lanes_known(mask, hi)};
}

static inline zs_lanes_mask zs_intervals_known(zs_intervals a)
{
  return a.lo <= a.hi;
}

static inline zs_intervals zs_intervals_widened(zs_lanes lo, zs_lanes hi, float ulps)
{
  const zs_lanes unit = zs_lanes_all(ulps * 1.2e-7f); /* a little over 2^-23 */
  const zs_lanes_mask known = lo <= hi;
  return zs_intervals_checked(lo - zs_lanes_absolute(lo) * unit, hi + zs_lanes_absolute(hi) * unit,
                              known);
}

static inline zs_intervals zs_intervals_add(zs_intervals a, zs_intervals b)
{
  return zs_intervals_widened(a.lo + b.lo, a.hi + b.hi, 1);
}

static inline zs_intervals zs_intervals_subtract(zs_intervals a, zs_intervals b)
{
  return zs_intervals_widened(a.lo - b.hi, a.hi - b.lo, 1);
}

static inline zs_intervals zs_intervals_multiply(zs_intervals a, zs_intervals b)
{
  const zs_lanes p = a.lo * b.lo, q = a.lo * b.hi, r = a.hi * b.lo, s = a.hi * b.hi;
  const zs_lanes_mask numbers = (p == p) & (q == q) & (r == r) & (s == s);
  zs_intervals all =
    zs_intervals_widened(zs_lanes_smaller(zs_lanes_smaller(p, q), zs_lanes_smaller(r, s)),
                         zs_lanes_larger(zs_lanes_larger(p, q), zs_lanes_larger(r, s)), 1);
  return zs_intervals_checked(all.lo, all.hi, numbers);
}

static inline zs_intervals zs_intervals_negate(zs_intervals a)
{
  return (zs_intervals){-a.hi, -a.lo};
}

static inline zs_intervals zs_intervals_absolute(zs_intervals a)
{
  const zs_lanes zero = zs_lanes_all(0);
  const zs_lanes below = zs_lanes_absolute(a.lo), above = zs_lanes_absolute(a.hi);
  const zs_lanes_mask around = (a.lo <= zero) & (a.hi >= zero);
  return zs_intervals_checked(zs_lanes_select(around, zero, zs_lanes_smaller(below, above)),
                              zs_lanes_larger(below, above), zs_intervals_known(a));
}

static inline zs_intervals zs_intervals_square(zs_intervals a)
{
  const zs_intervals m = zs_intervals_absolute(a);
  return zs_intervals_widened(m.lo * m.lo, m.hi * m.hi, 1);
}

static inline zs_intervals zs_intervals_square_root(zs_intervals a)
{
  const zs_intervals root =
    zs_intervals_widened(zs_lanes_square_root(a.lo), zs_lanes_square_root(a.hi), 1);
  return zs_intervals_checked(root.lo, root.hi, a.lo >= zs_lanes_all(0));
}

static inline zs_intervals zs_intervals_hypot(zs_intervals a, zs_intervals b)
{
  const zs_intervals m = zs_intervals_absolute(a), n = zs_intervals_absolute(b);
  return zs_intervals_widened(zs_lanes_square_root(m.lo * m.lo + n.lo * n.lo),
                              zs_lanes_square_root(m.hi * m.hi + n.hi * n.hi), 3);
}

/* Minimum and maximum are exact. */
static inline zs_intervals zs_intervals_minimum(zs_intervals a, zs_intervals b)
{
  return zs_intervals_checked(zs_lanes_smaller(a.lo, b.lo), zs_lanes_smaller(a.hi, b.hi),
                              zs_intervals_known(a) & zs_intervals_known(b));
}

static inline zs_intervals zs_intervals_maximum(zs_intervals a, zs_intervals b)
{
  return zs_intervals_checked(zs_lanes_larger(a.lo, b.lo), zs_lanes_larger(a.hi, b.hi),
                              zs_intervals_known(a) & zs_intervals_known(b));
}

static inline zs_intervals zs_intervals_select(zs_lanes_mask mask, zs_intervals yes,
                                               zs_intervals no)
{
  return (zs_intervals){zs_lanes_select(mask, yes.lo, no.lo), zs_lanes_select(mask, yes.hi, no.hi)};
}

#endif
