/* Vectors as long as a fit has constraints (those of vector.h are of registers). */
#ifndef ZS_RBF_LONG_VECTOR_H
#define ZS_RBF_LONG_VECTOR_H

#include <stddef.h>

static inline double zs_long_dot(size_t n, const double *a, const double *b)
{
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (size_t i = 0; i < n; i++)
    sum += a[i] * b[i];
  return sum;
}

/* to += factor from; the two do not overlap. */
static inline void zs_long_add(size_t n, double factor, const double *from, double *to)
{
#pragma omp simd
  for (size_t i = 0; i < n; i++)
    to[i] += factor * from[i];
}

#endif
