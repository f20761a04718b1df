/* Vectors of doubles as wide as the instruction set being compiled for. */
#ifndef ZS_RBF_VECTOR_H
#define ZS_RBF_VECTOR_H

#include <stdint.h>
#if defined __SSE2__
#include <immintrin.h>
#else
#include <math.h>
#endif

#if defined __AVX512F__
enum { ZS_WIDTH = 8 };
#elif defined __AVX__
enum { ZS_WIDTH = 4 };
#else
enum { ZS_WIDTH = 2 };
#endif

typedef double zs_vector __attribute__((vector_size(ZS_WIDTH * sizeof(double))));
typedef int64_t zs_integers __attribute__((vector_size(ZS_WIDTH * sizeof(int64_t))));

static inline zs_vector zs_vector_root(zs_vector a)
{
#if defined __AVX512F__
  return (zs_vector)_mm512_sqrt_pd((__m512d)a);
#elif defined __AVX__
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
