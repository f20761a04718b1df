/* Maxima, minima and their smoothed forms, a vector at a time: what the kernels of
 * joints and of chains are made of.  For *.kernel.c files only. */
#ifndef ZS_JOINT_H
#define ZS_JOINT_H

#include "field/blend.h"
#include "field/lanes.h"

/* A unit in the last place, a little over 2^-23. */
static const float JOINT_UNIT = 1.2e-7f;

/* ---- Profiles ------------------------------------------------------------------- */

typedef struct joint_numbers {
  float side;      /* a zs_blend_side */
  float k, factor; /* reach, and the profile's constant */
} joint_numbers;

static inline joint_numbers make_joint_numbers(const zs_blend *p, double factor)
{
  return (joint_numbers){(float)p->side, (float)p->parameter[0], (float)factor};
}

/* `base`, the larger operand of a union or the smaller of an intersection, moved by what
 * a joint adds or takes away at a distance d of its operands; and the derivative of
 * that amount by d. */
typedef zs_lanes joint_profile(zs_lanes base, zs_lanes d, joint_numbers c);
typedef zs_lanes joint_slope(zs_lanes d, joint_numbers c);

static inline zs_lanes joint_overlap(zs_lanes d, joint_numbers c)
{
  return zs_lanes_larger(zs_lanes_all(c.k) - d, zs_lanes_all(0));
}

static inline joint_numbers quadratic_numbers(const zs_blend *p)
{
  return make_joint_numbers(p, 0.25 / p->parameter[0]);
}

static inline zs_lanes quadratic_rise(zs_lanes base, zs_lanes d, joint_numbers c)
{
  const zs_lanes h = joint_overlap(d, c);
  return zs_lanes_multiply_add(h * zs_lanes_all(c.side * c.factor), h, base);
}

static inline zs_lanes quadratic_slope(zs_lanes d, joint_numbers c)
{
  return joint_overlap(d, c) * zs_lanes_all(-2 * c.factor);
}

static inline joint_numbers cubic_numbers(const zs_blend *p)
{
  return make_joint_numbers(p, 1 / p->parameter[0]);
}

static inline zs_lanes cubic_rise(zs_lanes base, zs_lanes d, joint_numbers c)
{
  const zs_lanes h = joint_overlap(d, c), u = h * zs_lanes_all(c.factor);
  return zs_lanes_multiply_add(h * zs_lanes_all(c.side / 6), u * u, base);
}

static inline zs_lanes cubic_slope(zs_lanes d, joint_numbers c)
{
  const zs_lanes u = joint_overlap(d, c) * zs_lanes_all(c.factor);
  return u * u * zs_lanes_all(-0.5f);
}

static inline joint_numbers circular_numbers(const zs_blend *p)
{
  return make_joint_numbers(p, 1 / p->parameter[0]);
}

static inline zs_lanes circular_rise(zs_lanes base, zs_lanes d, joint_numbers c)
{
  const zs_lanes one = zs_lanes_all(1), half = zs_lanes_all(0.5f);
  const zs_lanes t = zs_lanes_smaller(d * zs_lanes_all(c.factor), one);
  const zs_lanes root = zs_lanes_square_root(zs_lanes_all(2) - t * t);
  const zs_lanes part = zs_lanes_larger(one - half * t - half * root, zs_lanes_all(0));
  return zs_lanes_multiply_add(zs_lanes_all(c.side * c.k), part, base);
}

static inline zs_lanes circular_slope(zs_lanes d, joint_numbers c)
{
  const zs_lanes one = zs_lanes_all(1), half = zs_lanes_all(0.5f);
  const zs_lanes t = zs_lanes_smaller(d * zs_lanes_all(c.factor), one);
  return half * t / zs_lanes_square_root(zs_lanes_all(2) - t * t) - half;
}

static inline joint_numbers chamfer_numbers(const zs_blend *p)
{
  return make_joint_numbers(p, 0.5);
}

static inline zs_lanes chamfer_rise(zs_lanes base, zs_lanes d, joint_numbers c)
{
  return zs_lanes_multiply_add(zs_lanes_all(c.side / 2), joint_overlap(d, c), base);
}

static inline zs_lanes chamfer_slope(zs_lanes d, joint_numbers c)
{
  return zs_lanes_select(d < zs_lanes_all(c.k), zs_lanes_all(-0.5f), zs_lanes_all(0));
}

/* A sharp joint: the maximum or minimum itself. */
static inline joint_numbers extremum_numbers(const zs_blend *p)
{
  return make_joint_numbers(p, 0);
}

static inline zs_lanes extremum_rise(zs_lanes base, zs_lanes d, joint_numbers c)
{
  (void)d;
  (void)c;
  return base;
}

static inline zs_lanes extremum_slope(zs_lanes d, joint_numbers c)
{
  (void)d;
  (void)c;
  return zs_lanes_all(0);
}

/* The joint of a and b. */
ZS_INLINE zs_lanes joined(zs_lanes a, zs_lanes b, joint_numbers c, joint_profile *rise)
{
  return rise(c.side > 0 ? zs_lanes_larger(a, b) : zs_lanes_smaller(a, b),
              zs_lanes_absolute(a - b), c);
}

/* The derivatives of a joint by its operands; `slope` is that of its profile. */
typedef struct joint_weights {
  zs_lanes a, b;
} joint_weights;

static inline joint_weights joint_weights_of(zs_lanes_mask a_first, zs_lanes slope)
{
  const zs_lanes first = zs_lanes_all(1) + slope;
  return (joint_weights){zs_lanes_select(a_first, first, -slope),
                         zs_lanes_select(a_first, -slope, first)};
}

/* ---- Bounds -----------------------------------------------------------------------
 *
 * Of joints of a and b, with what can be left out.  `result` and `inputs` say where
 * those matter. */

/* An operand does as well where the other one loses whenever it matters, and where it
 * is beyond what matters by itself. */
static inline void choose_by_sign(zs_choice *choice, unsigned part, zs_intervals a, zs_intervals b,
                                  bool is_union, zs_demand result, zs_demand inputs)
{
  const zs_lanes_mask both = zs_intervals_known(a) & zs_intervals_known(b);
  const zs_lanes below = zs_lanes_all(-inputs.below), above = zs_lanes_all(inputs.above);
  const zs_lanes least = zs_lanes_all(-result.below), most = zs_lanes_all(result.above);
  const zs_lanes_mask a_idle = is_union ? a.hi < below : a.lo > above;
  const zs_lanes_mask b_idle = is_union ? b.hi < below : b.lo > above;
  const zs_lanes_mask a_decides = is_union ? a.lo > most : a.hi < least;
  const zs_lanes_mask b_decides = is_union ? b.lo > most : b.hi < least;
  zs_set_bits(&choice->sign[0], part, both & (b_idle | a_decides));
  zs_set_bits(&choice->sign[1], part, both & (a_idle | b_decides));
}

ZS_INLINE zs_intervals extremum_range(zs_intervals a, zs_intervals b, bool maximum,
                                      zs_demand result, zs_choice *choice, unsigned part)
{
  const zs_lanes_mask both = zs_intervals_known(a) & zs_intervals_known(b);
  zs_set_bits(&choice->copy[0], part, both & (maximum ? b.hi < a.lo : a.hi < b.lo));
  zs_set_bits(&choice->copy[1], part, both & (maximum ? a.hi < b.lo : b.hi < a.lo));
  choose_by_sign(choice, part, a, b, maximum, result, result);
  return maximum ? zs_intervals_maximum(a, b) : zs_intervals_minimum(a, b);
}

/* Smooth joints grow with both operands. */
ZS_INLINE zs_intervals smooth_range(zs_intervals a, zs_intervals b, joint_numbers c,
                                    zs_demand result, zs_demand inputs, joint_profile *rise,
                                    zs_choice *choice, unsigned part)
{
  const bool is_union = c.side > 0;
  const zs_lanes reach = zs_lanes_all(c.k);
  const zs_lanes_mask both = zs_intervals_known(a) & zs_intervals_known(b);
  const zs_lanes_mask a_copied = both & (is_union ? a.lo - b.hi >= reach : b.lo - a.hi >= reach);
  const zs_lanes_mask b_copied = both & (is_union ? b.lo - a.hi >= reach : a.lo - b.hi >= reach);
  zs_set_bits(&choice->copy[0], part, a_copied);
  zs_set_bits(&choice->copy[1], part, b_copied);
  choose_by_sign(choice, part, a, b, is_union, result, inputs);
  const zs_lanes slack = zs_lanes_all(4 * JOINT_UNIT * c.k);
  const zs_lanes lo = joined(a.lo, b.lo, c, rise);
  const zs_lanes hi = joined(a.hi, b.hi, c, rise);
  /* The correction's error is relative to the reach. */
  zs_intervals f = zs_intervals_widened(lo - slack, hi + slack, 2);
  f = zs_intervals_checked(f.lo, f.hi, both);
  return zs_intervals_select(a_copied, a, zs_intervals_select(b_copied, b, f));
}

#endif
