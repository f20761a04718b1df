/* A small deterministic generator for tests (splitmix64). */
#ifndef ZS_TEST_RANDOM_H
#define ZS_TEST_RANDOM_H

#include <stdint.h>

static inline uint64_t random_bits(uint64_t *state)
{
  uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15));
  z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
  return z ^ (z >> 31);
}

/* Uniform in [lo, hi). */
static inline double random_between(uint64_t *state, double lo, double hi)
{
  return lo + (hi - lo) * (double)(random_bits(state) >> 11) * 0x1p-53;
}

/* Uniform in 0 .. n - 1. */
static inline unsigned random_below(uint64_t *state, unsigned n)
{
  return (unsigned)(random_bits(state) % n);
}

#endif
