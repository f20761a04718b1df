/* Vectors of doubles as wide as the instruction set being compiled for, for
 * *.kernel.c. */
#ifndef ZS_RBF_VECTOR_H
#define ZS_RBF_VECTOR_H

#include <stdint.h>
#include <string.h>
#if defined __SSE2__
#include <immintrin.h>
#else
#include <math.h>
#endif

#if defined __GNUC__ && !defined __clang__
/* For the rest of the file: multiply and add in one step.  That is safe, since
 * nothing is compared to the bit across instruction sets and bounds are widened
 * by far more; sums gain precision. */
#pragma GCC optimize("fp-contract=fast")
#endif

#define ZS_ALWAYS __attribute__((always_inline))

#if defined __AVX512F__
enum { ZS_WIDTH = 8 };
#elif defined __AVX__
enum { ZS_WIDTH = 4 };
#else
enum { ZS_WIDTH = 2 };
#endif

typedef double zs_vector __attribute__((vector_size(ZS_WIDTH * sizeof(double))));
typedef int64_t zs_integers __attribute__((vector_size(ZS_WIDTH * sizeof(int64_t))));
typedef uint64_t zs_bits __attribute__((vector_size(ZS_WIDTH * sizeof(uint64_t))));

/* Numbers that may not be aligned, one vector at a time: compilers copy several as bytes, by way
 * of memory. */
static inline ZS_ALWAYS zs_vector zs_vector_load(const double *from)
{
  zs_vector v;
  memcpy(&v, from, sizeof v);
  return v;
}

static inline ZS_ALWAYS void zs_vector_store(double *to, zs_vector v)
{
  memcpy(to, &v, sizeof v);
}

#if defined __AVX512F__
/* Square roots of 0 and of positive normal numbers, to the last bit or so: the
 * division unit takes longer than an estimate of 14 bits and Newton's steps. */
static inline zs_vector zs_vector_root(zs_vector a)
{
  const __mmask8 positive = _mm512_cmp_pd_mask((__m512d)a, _mm512_setzero_pd(), _CMP_GT_OQ);
  const zs_vector inverse = (zs_vector)_mm512_maskz_rsqrt14_pd(positive, (__m512d)a);
  zs_vector root = a * inverse, half = 0.5 * inverse, error = 0.5 - root * half;
  root += root * error;
  half += half * error;
  error = a - root * root;
  return root + error * half;
}
#else
static inline zs_vector zs_vector_root(zs_vector a)
{
#if defined __AVX__
  return (zs_vector)_mm256_sqrt_pd((__m256d)a);
#elif defined __SSE2__
  return (zs_vector)_mm_sqrt_pd((__m128d)a);
#else
  for (int i = 0; i < ZS_WIDTH; i++)
    a[i] = sqrt(a[i]);
  return a;
#endif
}
#endif

#endif
