/* Vectors in space. */
#ifndef ZS_BASE_VECTOR3_H
#define ZS_BASE_VECTOR3_H

#include <math.h>
#include <stdbool.h>

static inline double zs_dot3(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* a - b */
static inline void zs_subtract3(const double a[3], const double b[3], double difference[3])
{
  for (int k = 0; k < 3; k++)
    difference[k] = a[k] - b[k];
}

/* a x b, which must not be where the product goes. */
static inline void zs_cross3(const double a[3], const double b[3], double product[3])
{
  for (int k = 0; k < 3; k++)
    product[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* To length 1; false when there is no direction, which leaves 0 0 0. */
static inline bool zs_normalise3(double v[3])
{
  const double length = sqrt(zs_dot3(v, v));
  for (int k = 0; k < 3; k++)
    v[k] = length > 0 ? v[k] / length : 0;
  return length > 0;
}

#endif
