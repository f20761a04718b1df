/* Interval arithmetic on single-precision pairs, rounded outward, for the
 * bounds kernels.  NaN in both ends means unknown and stays unknown.
 *
 * Results of correctly rounded operations are widened by one unit in the last
 * place, so that they hold for real numbers too; the elementary functions by
 * a few more, for vector libraries that promise only that. */
#ifndef ZS_INTERVAL_H
#define ZS_INTERVAL_H

#include "field/operation.h"

#include <math.h>

typedef struct zs_interval {
  float lo, hi;
} zs_interval;

static inline zs_interval zs_interval_of_lane(const zs_bounds *bounds, unsigned lane)
{
  return (zs_interval){bounds->lo[lane], bounds->hi[lane]};
}

static inline void zs_interval_to_lane(zs_bounds *bounds, unsigned lane, zs_interval value)
{
  bounds->lo[lane] = value.lo;
  bounds->hi[lane] = value.hi;
}

static inline bool zs_interval_known(zs_interval a)
{
  return a.lo <= a.hi;
}

static inline zs_interval zs_interval_unknown(void)
{
  return (zs_interval){NAN, NAN};
}

/* Widened by `ulps` units in the last place; unknown unless lo <= hi. */
static inline zs_interval zs_interval_widened(float lo, float hi, float ulps)
{
  const float unit = 1.2e-7f; /* a little over 2^-23 */
  if (!(lo <= hi))
    return zs_interval_unknown();
  lo -= fabsf(lo) * (ulps * unit);
  hi += fabsf(hi) * (ulps * unit);
  /* An infinite end on the wrong side has become NaN. */
  return lo <= hi ? (zs_interval){lo, hi} : zs_interval_unknown();
}

static inline float zs_min4(float a, float b, float c, float d)
{
  float m = a < b ? a : b, n = c < d ? c : d;
  return m < n ? m : n;
}

static inline float zs_max4(float a, float b, float c, float d)
{
  float m = a > b ? a : b, n = c > d ? c : d;
  return m > n ? m : n;
}

/* The hull of four candidate end points, unknown if one is NaN. */
static inline zs_interval zs_interval_hull4(float a, float b, float c, float d, float ulps)
{
  if (a != a || b != b || c != c || d != d)
    return zs_interval_unknown();
  return zs_interval_widened(zs_min4(a, b, c, d), zs_max4(a, b, c, d), ulps);
}

static inline zs_interval zs_interval_add(zs_interval a, zs_interval b)
{
  return zs_interval_widened(a.lo + b.lo, a.hi + b.hi, 1);
}

static inline zs_interval zs_interval_subtract(zs_interval a, zs_interval b)
{
  return zs_interval_widened(a.lo - b.hi, a.hi - b.lo, 1);
}

static inline zs_interval zs_interval_multiply(zs_interval a, zs_interval b)
{
  return zs_interval_hull4(a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi, 1);
}

static inline zs_interval zs_interval_divide(zs_interval a, zs_interval b)
{
  if (!(b.lo > 0 || b.hi < 0))
    return zs_interval_unknown();
  return zs_interval_hull4(a.lo / b.lo, a.lo / b.hi, a.hi / b.lo, a.hi / b.hi, 1);
}

static inline zs_interval zs_interval_negate(zs_interval a)
{
  return (zs_interval){-a.hi, -a.lo};
}

static inline zs_interval zs_interval_absolute(zs_interval a)
{
  if (a.lo >= 0)
    return a;
  if (a.hi <= 0)
    return zs_interval_negate(a);
  if (!(a.lo <= a.hi))
    return zs_interval_unknown();
  return (zs_interval){0, -a.lo > a.hi ? -a.lo : a.hi};
}

#endif
