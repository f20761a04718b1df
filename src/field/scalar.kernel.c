/* Block, gradient and bounds kernels of the scalar functions and of linear
 * coordinate rows.  Compiled once per instruction set. */
#include "field/scalar.h"

#include "field/interval.h"
#include "field/joint.h"
#include "field/row.h"

#include <math.h>
#include <string.h>

#if defined ZS_HAVE_LIBMVEC && defined __GNUC__ && !defined __clang__
/* glibc's vector variants, without asking for -ffast-math. */
#define VECTOR __attribute__((simd("notinbranch"), const))
VECTOR float sinf(float);
VECTOR float cosf(float);
VECTOR float tanf(float);
VECTOR float asinf(float);
VECTOR float acosf(float);
VECTOR float atanf(float);
VECTOR float expf(float);
VECTOR float logf(float);
VECTOR float powf(float, float);
VECTOR float atan2f(float, float);
#undef VECTOR
#endif

/* Units in the last place that the elementary functions may be off. */
#define ELEMENTARY 8

static const float PI = 3.14159265f, HALF_PI = 1.57079633f;

/* ---- Values and derivatives --------------------------------------------- */

static inline float modulo(float a, float b)
{
  return a - b * floorf(a / b);
}

static inline float hypotenuse(float a, float b)
{
  return sqrtf(a * a + b * b);
}

/* NAME, value, derivative by a, derivative by b; v is the value. */
#define BINARY_FUNCTIONS(F) \
  F(ADD, a + b, 1, 1) \
  F(SUBTRACT, a - b, 1, -1) \
  F(MULTIPLY, a * b, b, a) \
  F(DIVIDE, a / b, 1 / b, -v / b) \
  F(POWER, powf(a, b), b * powf(a, b - 1), a > 0 ? v * logf(a) : 0) \
  F(MODULO, modulo(a, b), 1, -floorf(a / b)) \
  F(MINIMUM, a < b ? a : b, a < b, !(a < b)) \
  F(MAXIMUM, a > b ? a : b, a > b, !(a > b)) \
  F(ATAN2, atan2f(a, b), b / (a * a + b * b), -a / (a * a + b * b)) \
  F(HYPOT, hypotenuse(a, b), v > 0 ? a / v : 0, v > 0 ? b / v : 0) \
  F(LESS, a < b, 0, 0) \
  F(LESS_EQUAL, a <= b, 0, 0) \
  F(EQUAL, a == b, 0, 0) \
  F(NOT_EQUAL, a != b, 0, 0)

/* NAME, value, derivative.  Sine and cosine of one operand would be fused into
 * a scalar call: both derivatives shift the phase instead. */
#define UNARY_FUNCTIONS(F) \
  F(NEGATE, -a, -1) \
  F(ABSOLUTE, fabsf(a), a < 0 ? -1 : 1) \
  F(SQUARE, a * a, 2 * a) \
  F(SQUARE_ROOT, sqrtf(a), v > 0 ? 0.5f / v : 0) \
  F(EXPONENTIAL, expf(a), v) \
  F(LOGARITHM, logf(a), 1 / a) \
  F(SINE, sinf(a), sinf(a + HALF_PI)) \
  F(COSINE, cosf(a), cosf(a + HALF_PI)) \
  F(TANGENT, tanf(a), 1 + v * v) \
  F(ARC_SINE, asinf(a), 1 / sqrtf(1 - a * a)) \
  F(ARC_COSINE, acosf(a), -1 / sqrtf(1 - a * a)) \
  F(ARC_TANGENT, atanf(a), 1 / (1 + a * a)) \
  F(FLOOR, floorf(a), 0) \
  F(CEILING, ceilf(a), 0) \
  F(ROUND, floorf(a + 0.5f), 0) \
  F(SIGN, (float)(a > 0) - (float)(a < 0), 0)

/* One function of two operands in its three forms.  A factor that is 0 drops
 * its operand's derivative, which may be infinite on the side not taken. */
#define LOOP(A, B, VALUE) \
  _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
  { \
    const float a = A, b = B; \
    out[i] = VALUE; \
  }

/* Row k of the chain rule; both rows are loaded whatever is chosen, so that the
 * loop stays straight. */
#define CHAIN(k, USE_A, USE_B, G) \
  const float G##_a = in_a[(k)*ZS_BLOCK + i], G##_b = in_b[(k)*ZS_BLOCK + i]; \
  const float G = (USE_A && da != 0 ? da * G##_a : 0) + (USE_B && db != 0 ? db * G##_b : 0);

#define GRADIENT_LOOP(A, B, VALUE, DA, DB, USE_A, USE_B) \
  _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
  { \
    const float a = A, b = B, v = VALUE; \
    (void)b, (void)v; \
    const float da = (float)(DA), db = (float)(DB); \
    CHAIN(1, USE_A, USE_B, gx) \
    CHAIN(2, USE_A, USE_B, gy) \
    CHAIN(3, USE_A, USE_B, gz) \
    out[i] = v; \
    out[ZS_BLOCK + i] = gx; \
    out[2 * ZS_BLOCK + i] = gy; \
    out[3 * ZS_BLOCK + i] = gz; \
  }

#define BINARY_KERNELS(NAME, VALUE, DA, DB) \
  static void NAME##_value_0(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_a = x->in[0], *in_b = x->in[1]; \
    float *out = x->out; \
    LOOP(in_a[i], in_b[i], VALUE) \
  } \
  static void NAME##_value_1(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_a = x->in[0], constant = (float)*(const double *)x->data; \
    float *out = x->out; \
    LOOP(in_a[i], constant, VALUE) \
  } \
  static void NAME##_value_2(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_b = x->in[0], constant = (float)*(const double *)x->data; \
    float *out = x->out; \
    LOOP(constant, in_b[i], VALUE) \
  } \
  static void NAME##_gradient_0(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_a = x->in[0], *in_b = x->in[1]; \
    float *out = x->out; \
    GRADIENT_LOOP(in_a[i], in_b[i], VALUE, DA, DB, 1, 1) \
  } \
  static void NAME##_gradient_1(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_a = x->in[0], *in_b = in_a, constant = (float)*(const double *)x->data; \
    float *out = x->out; \
    GRADIENT_LOOP(in_a[i], constant, VALUE, DA, DB, 1, 0) \
  } \
  static void NAME##_gradient_2(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_b = x->in[0], *in_a = in_b, constant = (float)*(const double *)x->data; \
    float *out = x->out; \
    GRADIENT_LOOP(constant, in_b[i], VALUE, DA, DB, 0, 1) \
  }
BINARY_FUNCTIONS(BINARY_KERNELS)

#define UNARY_KERNELS(NAME, VALUE, DA) \
  static void NAME##_value(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_a = x->in[0]; \
    float *out = x->out; \
    _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
    { \
      const float a = in_a[i]; \
      out[i] = VALUE; \
    } \
  } \
  static void NAME##_gradient(const zs_block_arguments *x) \
  { \
    const size_t n = x->n; \
    const float *in_a = x->in[0], *in_b = in_a; \
    float *out = x->out; \
    GRADIENT_LOOP(in_a[i], 0, VALUE, DA, 0, 1, 0) \
  }
UNARY_FUNCTIONS(UNARY_KERNELS)

static void select_value(const zs_block_arguments *x)
{
  const float *c = x->in[0], *a = x->in[1], *b = x->in[2];
  float *out = x->out;
#pragma omp simd
  for (size_t i = 0; i < x->n; i++)
    out[i] = c[i] != 0 ? a[i] : b[i];
}

static void select_gradient(const zs_block_arguments *x)
{
  const float *c = x->in[0], *a = x->in[1], *b = x->in[2];
  float *out = x->out;
  for (size_t i = 0; i < x->n; i++) {
    const float *chosen = c[i] != 0 ? a : b;
    for (unsigned k = 0; k < 4; k++)
      out[k * ZS_BLOCK + i] = chosen[k * ZS_BLOCK + i];
  }
}

/* ---- Bounds --------------------------------------------------------------- */

/* Functions that are monotone in their only operand. */
static inline zs_interval monotone(zs_interval a, float at_lo, float at_hi, float ulps)
{
  return zs_interval_known(a) ? zs_interval_widened(at_lo, at_hi, ulps) : zs_interval_unknown();
}

/* Whether [lo, hi] holds a point of phase + period * integers; errs on yes. */
static inline bool meets(zs_interval a, double phase, double period)
{
  double slack = 1e-6 * (fabs((double)a.lo) + fabs((double)a.hi) + 1);
  return floor(((double)a.hi + slack - phase) / period) >=
         ceil(((double)a.lo - slack - phase) / period);
}

static zs_interval power(zs_interval a, zs_interval b)
{
  if (!zs_interval_known(a) || !zs_interval_known(b))
    return zs_interval_unknown();
  if (b.lo == b.hi && b.lo == floorf(b.lo) && fabsf(b.lo) < 1e6f) {
    float e = b.lo;
    if (e < 0 && !(a.lo > 0 || a.hi < 0))
      return zs_interval_unknown();
    if (fmodf(e, 2) == 0)
      a = zs_interval_absolute(a);
    float p = powf(a.lo, e), q = powf(a.hi, e);
    return zs_interval_hull4(p, q, p, q, ELEMENTARY);
  }
  if (!(a.lo >= 0) || (a.lo == 0 && b.lo <= 0))
    return zs_interval_unknown();
  return zs_interval_hull4(powf(a.lo, b.lo), powf(a.lo, b.hi), powf(a.hi, b.lo), powf(a.hi, b.hi),
                           ELEMENTARY);
}

static bool is_finite(zs_interval a)
{
  return fabsf(a.lo) < INFINITY && fabsf(a.hi) < INFINITY; /* no for NaN */
}

/* By an infinite divisor there is no remainder, nor of infinity. */
static zs_interval modulo_bounds(zs_interval a, zs_interval b)
{
  zs_interval q = zs_interval_divide(a, b);
  if (!is_finite(q) || !is_finite(b))
    return zs_interval_unknown();
  float below = floorf(q.lo), above = floorf(q.hi);
  if (below == above)
    return zs_interval_subtract(a, zs_interval_multiply(b, (zs_interval){below, below}));
  /* The remainder lies between 0 and b, up to the rounding of b * floor. */
  float slack = 4e-7f * (fabsf(a.lo) > fabsf(a.hi) ? fabsf(a.lo) : fabsf(a.hi));
  return zs_interval_widened((b.lo < 0 ? b.lo : 0) - slack, (b.hi > 0 ? b.hi : 0) + slack, 2);
}

/* a is y and b is x. */
static zs_interval atan2_bounds(zs_interval a, zs_interval b)
{
  if (!zs_interval_known(a) || !zs_interval_known(b))
    return zs_interval_unknown();
  const float all = 3.1415930f;
  if (b.lo <= 0 && a.lo <= 0 && a.hi >= 0)
    return (zs_interval){-all, all};
  return zs_interval_hull4(atan2f(a.lo, b.lo), atan2f(a.lo, b.hi), atan2f(a.hi, b.lo),
                           atan2f(a.hi, b.hi), ELEMENTARY);
}

static zs_interval tangent(zs_interval a)
{
  if (!zs_interval_known(a) || fabsf(a.lo) > 1e5f || fabsf(a.hi) > 1e5f || meets(a, PI / 2, PI))
    return zs_interval_unknown();
  zs_interval r = zs_interval_widened(tanf(a.lo), tanf(a.hi), ELEMENTARY);
  float steepest = 1 + fmaxf(r.lo * r.lo, r.hi * r.hi);
  float slack = 2.4e-7f * (fabsf(a.lo) + fabsf(a.hi)) * steepest;
  return (zs_interval){r.lo - slack, r.hi + slack};
}

static zs_interval truth(bool can_be_false, bool can_be_true)
{
  return (zs_interval){can_be_false ? 0 : 1, can_be_true ? 1 : 0};
}

static zs_interval less(zs_interval a, zs_interval b)
{
  bool k = zs_interval_known(a) && zs_interval_known(b);
  return truth(!k || a.hi >= b.lo, !k || a.lo < b.hi);
}

static zs_interval less_equal(zs_interval a, zs_interval b)
{
  bool k = zs_interval_known(a) && zs_interval_known(b);
  return truth(!k || a.hi > b.lo, !k || a.lo <= b.hi);
}

static zs_interval equal(zs_interval a, zs_interval b)
{
  bool k = zs_interval_known(a) && zs_interval_known(b);
  bool same = k && a.lo == a.hi && b.lo == b.hi && a.lo == b.lo;
  bool apart = k && (a.hi < b.lo || b.hi < a.lo);
  return truth(!same, !apart);
}

static zs_interval not_equal(zs_interval a, zs_interval b)
{
  zs_interval e = equal(a, b);
  return truth(e.hi == 1, e.lo == 0);
}

static zs_interval sign(zs_interval a)
{
  if (!zs_interval_known(a))
    return (zs_interval){-1, 1};
  return (zs_interval){(float)(a.lo > 0) - (float)(a.lo < 0), (float)(a.hi > 0) - (float)(a.hi < 0)};
}

static zs_interval arc(zs_interval a, float at_lo, float at_hi)
{
  return a.lo >= -1 && a.hi <= 1 ? monotone(a, at_lo, at_hi, ELEMENTARY) : zs_interval_unknown();
}

static zs_intervals divide(zs_intervals a, zs_intervals b)
{
  const zs_lanes zero = zs_lanes_all(0);
  const zs_lanes p = a.lo / b.lo, q = a.lo / b.hi, r = a.hi / b.lo, s = a.hi / b.hi;
  const zs_lanes_mask numbers = (p == p) & (q == q) & (r == r) & (s == s);
  const zs_intervals all =
    zs_intervals_widened(zs_lanes_smaller(zs_lanes_smaller(p, q), zs_lanes_smaller(r, s)),
                         zs_lanes_larger(zs_lanes_larger(p, q), zs_lanes_larger(r, s)), 1);
  return zs_intervals_checked(all.lo, all.hi, numbers & ((b.lo > zero) | (b.hi < zero)));
}

/* Those that are worth a vector at a time ... */
#define BINARY_LANES(F) \
  F(ADD, zs_intervals_add(a, b)) \
  F(DIVIDE, divide(a, b)) \
  F(SUBTRACT, zs_intervals_subtract(a, b)) \
  F(MULTIPLY, zs_intervals_multiply(a, b)) \
  F(HYPOT, zs_intervals_hypot(a, b))

#define UNARY_LANES(F) \
  F(NEGATE, zs_intervals_negate(a)) \
  F(ABSOLUTE, zs_intervals_absolute(a)) \
  F(SQUARE, zs_intervals_square(a)) \
  F(SQUARE_ROOT, zs_intervals_square_root(a))

/* ... and the others. */
#define BINARY_BOUNDS(F) \
  F(POWER, power(a, b)) \
  F(MODULO, modulo_bounds(a, b)) \
  F(ATAN2, atan2_bounds(a, b)) \
  F(LESS, less(a, b)) \
  F(LESS_EQUAL, less_equal(a, b)) \
  F(EQUAL, equal(a, b)) \
  F(NOT_EQUAL, not_equal(a, b))

#define UNARY_BOUNDS(F) \
  F(EXPONENTIAL, monotone(a, expf(a.lo), expf(a.hi), ELEMENTARY)) \
  F(LOGARITHM, a.lo >= 0 ? monotone(a, logf(a.lo), logf(a.hi), ELEMENTARY) : zs_interval_unknown()) \
  F(TANGENT, tangent(a)) \
  F(ARC_SINE, arc(a, asinf(a.lo), asinf(a.hi))) \
  F(ARC_COSINE, arc(a, acosf(a.hi), acosf(a.lo))) \
  F(ARC_TANGENT, monotone(a, atanf(a.lo), atanf(a.hi), ELEMENTARY)) \
  F(FLOOR, monotone(a, floorf(a.lo), floorf(a.hi), 0)) \
  F(CEILING, monotone(a, ceilf(a.lo), ceilf(a.hi), 0)) \
  F(ROUND, monotone(a, floorf(a.lo + 0.5f), floorf(a.hi + 0.5f), 0)) \
  F(SIGN, sign(a))

/* A constant as an interval that holds both its exact and its rounded value. */
static zs_interval constant_interval(const void *data)
{
  const double exact = *(const double *)data;
  const float rounded = (float)exact, error = fabsf(rounded) * 6e-8f + 1e-44f;
  return (zs_interval){(double)rounded > exact ? rounded - error : rounded,
                       (double)rounded < exact ? rounded + error : rounded};
}

static zs_intervals constant_intervals(const void *data)
{
  const zs_interval c = constant_interval(data);
  return (zs_intervals){zs_lanes_all(c.lo), zs_lanes_all(c.hi)};
}

#define BINARY_LANES_KERNELS(NAME, BOUNDS) \
  static void NAME##_bounds_0(const zs_bounds_arguments *x) \
  { \
    ZS_FOR_PARTS(part) \
    { \
      const zs_intervals a = zs_intervals_load(x->in[0], part); \
      const zs_intervals b = zs_intervals_load(x->in[1], part); \
      zs_intervals_store(x->out, part, BOUNDS); \
    } \
  } \
  static void NAME##_bounds_1(const zs_bounds_arguments *x) \
  { \
    ZS_FOR_PARTS(part) \
    { \
      const zs_intervals a = zs_intervals_load(x->in[0], part), b = constant_intervals(x->data); \
      zs_intervals_store(x->out, part, BOUNDS); \
    } \
  } \
  static void NAME##_bounds_2(const zs_bounds_arguments *x) \
  { \
    ZS_FOR_PARTS(part) \
    { \
      const zs_intervals a = constant_intervals(x->data), b = zs_intervals_load(x->in[0], part); \
      zs_intervals_store(x->out, part, BOUNDS); \
    } \
  }
BINARY_LANES(BINARY_LANES_KERNELS)

#define UNARY_LANES_KERNELS(NAME, BOUNDS) \
  static void NAME##_bounds(const zs_bounds_arguments *x) \
  { \
    ZS_FOR_PARTS(part) \
    { \
      const zs_intervals a = zs_intervals_load(x->in[0], part); \
      zs_intervals_store(x->out, part, BOUNDS); \
    } \
  }
UNARY_LANES(UNARY_LANES_KERNELS)

#define BINARY_BOUNDS_KERNELS(NAME, BOUNDS) \
  static void NAME##_bounds_0(const zs_bounds_arguments *x) \
  { \
    for (unsigned l = 0; l < ZS_LANES; l++) { \
      zs_interval a = zs_interval_of_lane(x->in[0], l), b = zs_interval_of_lane(x->in[1], l); \
      zs_interval_to_lane(x->out, l, BOUNDS); \
    } \
  } \
  static void NAME##_bounds_1(const zs_bounds_arguments *x) \
  { \
    zs_interval b = constant_interval(x->data); \
    for (unsigned l = 0; l < ZS_LANES; l++) { \
      zs_interval a = zs_interval_of_lane(x->in[0], l); \
      zs_interval_to_lane(x->out, l, BOUNDS); \
    } \
  } \
  static void NAME##_bounds_2(const zs_bounds_arguments *x) \
  { \
    zs_interval a = constant_interval(x->data); \
    for (unsigned l = 0; l < ZS_LANES; l++) { \
      zs_interval b = zs_interval_of_lane(x->in[0], l); \
      zs_interval_to_lane(x->out, l, BOUNDS); \
    } \
  }
BINARY_BOUNDS(BINARY_BOUNDS_KERNELS)

#define UNARY_BOUNDS_KERNELS(NAME, BOUNDS) \
  static void NAME##_bounds(const zs_bounds_arguments *x) \
  { \
    for (unsigned l = 0; l < ZS_LANES; l++) { \
      zs_interval a = zs_interval_of_lane(x->in[0], l); \
      zs_interval_to_lane(x->out, l, BOUNDS); \
    } \
  }
UNARY_BOUNDS(UNARY_BOUNDS_KERNELS)

/* Largest whole numbers, for |a| < 2^31. */
static inline zs_lanes lanes_floor(zs_lanes a)
{
  const zs_lanes whole =
    __builtin_convertvector(__builtin_convertvector(a, zs_lanes_mask), zs_lanes);
  return zs_lanes_select(whole > a, whole - zs_lanes_all(1), whole);
}

/* Where [a.lo, a.hi] holds a point of peak + 2 pi * integers; errs on yes. */
static inline zs_lanes_mask meets_peak(zs_intervals a, zs_lanes slack, float peak)
{
  const zs_lanes turns = zs_lanes_all(0.159154943f), shift = zs_lanes_all(peak);
  const zs_lanes below = lanes_floor((a.hi - shift) * turns + slack),
                 above = -lanes_floor((shift - a.lo) * turns + slack);
  return below >= above;
}

/* Of sine and cosine, from their values at the ends. */
static zs_intervals periodic_range(zs_intervals a, zs_intervals e, float peak)
{
  const zs_lanes one = zs_lanes_all(1), farthest = zs_lanes_all(1e5f);
  const zs_lanes size = zs_lanes_absolute(a.lo) + zs_lanes_absolute(a.hi);
  /* Far out single precision no longer tells where in the period it is; of infinity there is no
   * sine. */
  const zs_lanes_mask known = zs_intervals_known(a) & (size < zs_lanes_all(INFINITY));
  const zs_lanes_mask near = known & (size <= farthest);
  const zs_intervals b = {zs_lanes_select(near, a.lo, -one), zs_lanes_select(near, a.hi, one)};
  const zs_lanes slack = zs_lanes_all(3e-7f) * (zs_lanes_select(near, size, one) + zs_lanes_all(8));
  const zs_lanes lo = zs_lanes_select(meets_peak(b, slack, peak + PI) | ~near, -one,
                                      zs_lanes_smaller(e.lo, e.hi));
  const zs_lanes hi =
    zs_lanes_select(meets_peak(b, slack, peak) | ~near, one, zs_lanes_larger(e.lo, e.hi));
  /* Near a zero the error is relative to the argument, not to the value. */
  const zs_lanes error = zs_lanes_all(1.2e-7f) * (zs_lanes_select(near, size, one) + one) +
                         zs_lanes_all(ELEMENTARY * 1.2e-7f);
  return zs_intervals_checked(lo - error, hi + error, known);
}

/* `value` is the block kernel. */
static void periodic_bounds(const zs_bounds_arguments *x,
                            void (*value)(const zs_block_arguments *), float peak)
{
  zs_bounds at_ends;
  const zs_block_arguments ends = {.n = 2 * ZS_LANES,
                                   .in = {(const float *)(const void *)x->in[0]},
                                   .out = (float *)(void *)&at_ends};
  value(&ends);
  ZS_FOR_PARTS(part)
    zs_intervals_store(x->out, part, periodic_range(zs_intervals_load(x->in[0], part),
                                                    zs_intervals_load(&at_ends, part), peak));
}

static void SINE_bounds(const zs_bounds_arguments *x)
{
  periodic_bounds(x, SINE_value, HALF_PI);
}

static void COSINE_bounds(const zs_bounds_arguments *x)
{
  periodic_bounds(x, COSINE_value, 0);
}

/* A power with a constant exponent that is no whole number grows or falls all along; the
 * exponent is not exact in single precision, which counts most where powers are largest. */
static void power_constant_bounds(const zs_bounds_arguments *x)
{
  enum { INEXACT = 60 }; /* units in the last place */
  const zs_interval b = constant_interval(x->data);
  if ((b.lo == b.hi && b.lo == floorf(b.lo)) || !(b.lo > 0 || b.hi < 0)) {
    POWER_bounds_1(x);
    return;
  }
  zs_bounds at_ends;
  const zs_block_arguments ends = {.data = x->data,
                                   .n = 2 * ZS_LANES,
                                   .in = {(const float *)(const void *)x->in[0]},
                                   .out = (float *)(void *)&at_ends};
  POWER_value_1(&ends);
  ZS_FOR_PARTS(part)
  {
    const zs_lanes zero = zs_lanes_all(0);
    const zs_intervals a = zs_intervals_load(x->in[0], part);
    const zs_intervals e = zs_intervals_load(&at_ends, part);
    const zs_lanes_mask known = zs_intervals_known(a) & (b.lo > 0 ? a.lo >= zero : a.lo > zero);
    const zs_intervals range =
      zs_intervals_widened(zs_lanes_smaller(e.lo, e.hi), zs_lanes_larger(e.lo, e.hi),
                           ELEMENTARY + INEXACT);
    zs_intervals_store(x->out, part, zs_intervals_checked(range.lo, range.hi, known));
  }
}

/* Minimum and maximum of operands in registers. */
static inline void extremum(const zs_bounds_arguments *x, bool maximum)
{
  ZS_FOR_PARTS(part)
    zs_intervals_store(x->out, part,
                       extremum_range(zs_intervals_load(x->in[0], part),
                                      zs_intervals_load(x->in[1], part), maximum, x->demand,
                                      x->choice, part));
}

static void minimum_bounds(const zs_bounds_arguments *x)
{
  extremum(x, false);
}

static void maximum_bounds(const zs_bounds_arguments *x)
{
  extremum(x, true);
}

/* Against a constant: only the operand can be a copy. */
static inline void extremum_constant(const zs_bounds_arguments *x, bool maximum)
{
  const zs_intervals c = constant_intervals(x->data);
  const bool idle = maximum ? c.hi[0] < -x->demand.below : c.lo[0] > x->demand.above;
  ZS_FOR_PARTS(part)
  {
    const zs_intervals a = zs_intervals_load(x->in[0], part);
    const zs_lanes_mask known = zs_intervals_known(a);
    zs_set_bits(&x->choice->copy[0], part, known & (maximum ? c.hi < a.lo : a.hi < c.lo));
    if (idle)
      zs_set_bits(&x->choice->sign[0], part, known);
    zs_intervals_store(x->out, part,
                       maximum ? zs_intervals_maximum(a, c) : zs_intervals_minimum(a, c));
  }
}

static void minimum_constant_bounds(const zs_bounds_arguments *x)
{
  extremum_constant(x, false);
}

static void maximum_constant_bounds(const zs_bounds_arguments *x)
{
  extremum_constant(x, true);
}

static void select_bounds(const zs_bounds_arguments *x)
{
  unsigned copy_a = 0, copy_b = 0;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    zs_interval c = zs_interval_of_lane(x->in[0], l), a = zs_interval_of_lane(x->in[1], l), b = zs_interval_of_lane(x->in[2], l);
    bool is_true = c.lo > 0 || c.hi < 0, is_false = c.lo == 0 && c.hi == 0;
    copy_a |= (unsigned)is_true << l;
    copy_b |= (unsigned)is_false << l;
    zs_interval hull = zs_interval_known(a) && zs_interval_known(b)
                         ? (zs_interval){a.lo < b.lo ? a.lo : b.lo, a.hi > b.hi ? a.hi : b.hi}
                         : zs_interval_unknown();
    zs_interval_to_lane(x->out, l, is_true ? a : is_false ? b : hull);
  }
  x->choice->copy[1] = (uint16_t)copy_a;
  x->choice->copy[2] = (uint16_t)copy_b;
}

#define POWER_bounds_1 power_constant_bounds
#define MINIMUM_bounds_0 minimum_bounds
#define MINIMUM_bounds_1 minimum_constant_bounds
#define MINIMUM_bounds_2 minimum_constant_bounds
#define MAXIMUM_bounds_0 maximum_bounds
#define MAXIMUM_bounds_1 maximum_constant_bounds
#define MAXIMUM_bounds_2 maximum_constant_bounds

#define BINARY_ROW(NAME, VALUE, DA, DB) \
  [ZS_FUNCTION_##NAME] = {{NAME##_value_0, NAME##_gradient_0, NAME##_bounds_0}, \
                          {NAME##_value_1, NAME##_gradient_1, NAME##_bounds_1}, \
                          {NAME##_value_2, NAME##_gradient_2, NAME##_bounds_2}},
#define UNARY_ROW(NAME, VALUE, DA) \
  [ZS_FUNCTION_##NAME] = {{NAME##_value, NAME##_gradient, NAME##_bounds}},

const zs_scalar_table ZS_KERNELS(zs_scalar_kernels) = {
  BINARY_FUNCTIONS(BINARY_ROW)
  UNARY_FUNCTIONS(UNARY_ROW)
  [ZS_FUNCTION_SELECT] = {{select_value, select_gradient, select_bounds}},
};

/* ---- Linear rows ------------------------------------------------------------ */

/* out = c + sum of k[j] * in[j], leaving out the terms that are zero. */
static void combine(size_t n, float c, const float k[3], const float *const in[3], float *out)
{
  const float *p[3] = {in[0], in[0], in[0]};
  float q[3] = {0, 0, 0};
  unsigned terms = 0;
  for (int j = 0; j < 3; j++) {
    if (k[j] != 0) {
      p[terms] = in[j];
      q[terms++] = k[j];
    }
  }
  const float *a = p[0], *b = p[1], *d = p[2];
  const float ka = q[0], kb = q[1], kd = q[2];
  if (terms <= 1) {
#pragma omp simd
    for (size_t i = 0; i < n; i++)
      out[i] = ka * a[i] + c;
  } else if (terms == 2) {
#pragma omp simd
    for (size_t i = 0; i < n; i++)
      out[i] = ka * a[i] + kb * b[i] + c;
  } else {
#pragma omp simd
    for (size_t i = 0; i < n; i++)
      out[i] = ka * a[i] + kb * b[i] + kd * d[i] + c;
  }
}

static void linear_root_value(const zs_block_arguments *x)
{
  zs_row r = zs_row_in_frame(((const zs_linear *)x->data)->row, x->frame);
  if (!x->frame->perspective) {
    combine(x->n, r.constant, r.k, x->in, x->out);
    return;
  }
  const float *u = x->in[0], *v = x->in[1], *w = x->in[2];
  float *out = x->out;
#pragma omp simd
  for (size_t i = 0; i < x->n; i++)
    out[i] = r.constant + w[i] * (r.k[2] + u[i] * r.k[0] + v[i] * r.k[1]);
}

static void linear_root_gradient(const zs_block_arguments *x)
{
  zs_row r = zs_row_in_frame(((const zs_linear *)x->data)->row, x->frame);
  linear_root_value(x);
  for (unsigned k = 0; k < 3; k++)
    for (size_t i = 0; i < x->n; i++)
      x->out[(k + 1) * ZS_BLOCK + i] = r.k[k];
}

static void linear_root_bounds(const zs_bounds_arguments *x)
{
  zs_row r = zs_row_in_frame(((const zs_linear *)x->data)->row, x->frame);
  ZS_FOR_PARTS(part)
    zs_intervals_store(x->out, part,
                       x->frame->perspective ? zs_row_perspective_bounds(r, x->in, part)
                                             : zs_row_bounds(r, x->in, part));
}

static void linear_registers_value(const zs_block_arguments *x)
{
  const zs_row r = zs_row_of_registers(((const zs_linear *)x->data)->row);
  combine(x->n, r.constant, r.k, x->in, x->out);
}

static void linear_registers_gradient(const zs_block_arguments *x)
{
  const zs_row r = zs_row_of_registers(((const zs_linear *)x->data)->row);
  const float k0 = r.k[0], k1 = r.k[1], k2 = r.k[2];
  for (unsigned k = 0; k < 4; k++) {
    const float c = k ? 0 : r.constant;
    const float *a = x->in[0] + k * ZS_BLOCK, *b = x->in[1] + k * ZS_BLOCK,
                *d = x->in[2] + k * ZS_BLOCK;
    float *out = x->out + k * ZS_BLOCK;
#pragma omp simd
    for (size_t i = 0; i < x->n; i++) {
      /* Skipped terms may be infinite. */
      float p = k0 != 0 ? k0 * a[i] : 0, q = k1 != 0 ? k1 * b[i] : 0, s = k2 != 0 ? k2 * d[i] : 0;
      out[i] = p + q + s + c;
    }
  }
}

static void linear_registers_bounds(const zs_bounds_arguments *x)
{
  zs_row r = zs_row_of_registers(((const zs_linear *)x->data)->row);
  ZS_FOR_PARTS(part)
    zs_intervals_store(x->out, part, zs_row_bounds(r, x->in, part));
}

/* ---- Constants -------------------------------------------------------------- */

static void constant_value(const zs_block_arguments *x)
{
  const float constant = (float)*(const double *)x->data;
  for (size_t i = 0; i < x->n; i++)
    x->out[i] = constant;
}

static void constant_gradient(const zs_block_arguments *x)
{
  constant_value(x);
  memset(x->out + ZS_BLOCK, 0, 3 * ZS_BLOCK * sizeof(float));
}

static void constant_bounds(const zs_bounds_arguments *x)
{
  ZS_FOR_PARTS(part)
    zs_intervals_store(x->out, part, constant_intervals(x->data));
}

const zs_kernels ZS_KERNELS(zs_linear_root_kernels) = {linear_root_value, linear_root_gradient,
                                                       linear_root_bounds};
const zs_kernels ZS_KERNELS(zs_linear_registers_kernels) = {
  linear_registers_value, linear_registers_gradient, linear_registers_bounds};
const zs_kernels ZS_KERNELS(zs_constant_kernels) = {constant_value, constant_gradient,
                                                    constant_bounds};

/* Not -0, by which quotients have another sign. */
static uint16_t zero_lanes(const zs_bounds *f)
{
  unsigned lanes = 0;
  ZS_FOR_PARTS(l)
  {
    const zs_lanes_mask either = (zs_lanes_mask)zs_lanes_load(f->lo + l) |
                                 (zs_lanes_mask)zs_lanes_load(f->hi + l);
    lanes |= (unsigned)zs_lanes_bits(either == 0) << l;
  }
  return (uint16_t)lanes;
}

const zs_lanes_test ZS_KERNELS(zs_zero_lanes) = zero_lanes;
