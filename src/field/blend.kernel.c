/* Block, gradient and bounds kernels of the blends.  Compiled once per
 * instruction set. */
#include "field/blend.h"

#include "field/interval.h"
#include "field/joint.h"

#include <math.h>

#if defined ZS_HAVE_LIBMVEC && defined __GNUC__ && !defined __clang__
/* glibc's vector variants, without asking for -ffast-math. */
#define VECTOR __attribute__((simd("notinbranch"), const))
VECTOR float expf(float);
VECTOR float logf(float);
#undef VECTOR
#endif

/* The data in single precision, with what can be worked out once per block. */
typedef struct numbers {
  float side;    /* 1: union, -1: intersection */
  float alpha, beta; /* R-functions: alpha, 1 - alpha^2 */
  float scale;   /* R-functions: 1 / (1 + alpha) */
  unsigned power; /* of a^2 + b^2 */
  float a0, b1, b2; /* displacement; reciprocals of a1, a2 */
  float k, factor; /* exponential: reach, and the profile's constant */
} numbers;

static numbers numbers_alpha(const zs_blend *p, double alpha)
{
  return (numbers){.side = (float)p->side,
                   .alpha = (float)alpha,
                   .beta = (float)(1 - alpha * alpha),
                   .scale = (float)(1 / (1 + alpha))};
}

static numbers r_alpha_numbers(const void *data)
{
  const zs_blend *p = data;
  return numbers_alpha(p, p->parameter[0]);
}

static numbers r_m_numbers(const void *data)
{
  const zs_blend *p = data;
  numbers c = numbers_alpha(p, 0);
  c.power = (unsigned)p->parameter[0] / 2;
  return c;
}

static numbers r_displaced_numbers(const void *data)
{
  const zs_blend *p = data;
  numbers c = numbers_alpha(p, 0);
  c.a0 = (float)p->parameter[0];
  /* Kept finite, so that 0 times it is 0. */
  c.b1 = (float)fmin(1 / p->parameter[1], 1e30);
  c.b2 = (float)fmin(1 / p->parameter[2], 1e30);
  return c;
}

/* ---- R-functions ---------------------------------------------------------- */

static inline float conjunction(float a, float b, numbers c, float *da, float *db)
{
  /* In terms of the operand of larger magnitude and their ratio t nothing
   * overflows and nothing cancels: the sign is exact. */
  const int a_big = fabsf(a) > fabsf(b);
  const float big = a_big ? a : b, small = a_big ? b : a;
  const float size = fabsf(big);
  const float t = size > 0 && size < INFINITY ? small / big : 0;
  const float u = 1 - c.alpha * t, q = sqrtf(u * u + c.beta * t * t);
  const float d = 1 + t + q;
  const float sign = big < 0 ? -1.0f : 1.0f;
  const float slope_big = c.scale * (1 - sign * u / q);
  const float slope_small = c.scale * (1 - sign * (t - c.alpha) / q);
  /* At the origin, a kink, this is the slope along a or b. */
  *da = a_big ? slope_big : slope_small;
  *db = a_big ? slope_small : slope_big;
  return big > 0 ? 2 * small / d : big * d * c.scale;
}

static inline float r_alpha(float a, float b, numbers c, float *da, float *db)
{
  const float s = -c.side;
  return s * conjunction(s * a, s * b, c, da, db);
}

/* x^n for n < 32, kept from vanishing and from overflowing so that the factor
 * never takes the other factor's sign away. */
static inline float small_power(float x, unsigned n)
{
  const float x2 = x * x, x4 = x2 * x2, x8 = x4 * x4, x16 = x8 * x8;
  float p = n & 1 ? x : 1;
  p *= n & 2 ? x2 : 1;
  p *= n & 4 ? x4 : 1;
  p *= n & 8 ? x8 : 1;
  p *= n & 16 ? x16 : 1;
  p = p > 1e-20f ? p : 1e-20f;
  return p < 3e38f ? p : 3e38f;
}

static inline float r_m(float a, float b, numbers c, float *da, float *db)
{
  const float r = r_alpha(a, b, c, da, db), w = a * a + b * b;
  const float p = small_power(w, c.power);
  /* d w^n = 2 n w^(n-1) (a, b); at w = 0 the power is flat or the factor is 0. */
  const float slope = w > 0 ? 2 * (float)c.power * (p / w) * r : 0;
  *da = *da * p + slope * a;
  *db = *db * p + slope * b;
  return r * p;
}

static inline float r_displaced(float a, float b, numbers c, float *da, float *db)
{
  const float u = a * c.b1, v = b * c.b2;
  const float shrink = 1 / (1 + u * u + v * v), rise = c.a0 * shrink;
  const float r = r_alpha(a, b, c, da, db);
  const float slope = shrink > 0 ? -2 * rise * shrink : 0;
  *da += shrink > 0 ? slope * u * c.b1 : 0;
  *db += shrink > 0 ? slope * v * c.b2 : 0;
  return r + rise;
}

/* ---- The exponential smooth maximum ------------------------------------------- */

/* The larger operand plus `rise`, whose derivative by the distance of the
 * operands is `slope`. */
static inline float risen(float a, float b, numbers c, float rise, float slope, float *da,
                          float *db)
{
  const int a_first = c.side > 0 ? a > b : a < b;
  *da = a_first ? 1 + slope : -slope;
  *db = a_first ? -slope : 1 + slope;
  return (a_first ? a : b) + c.side * rise;
}

static numbers smooth_exponential_numbers(const void *data)
{
  /* k/4 log2(1 + 2^(-4 d / k)) = log(1 + exp(-d / factor)) factor */
  const zs_blend *p = data;
  const double k = p->parameter[0];
  return (numbers){
    .side = (float)p->side, .k = (float)k, .factor = (float)(k / (4 * 0.69314718055994531))};
}

static inline float smooth_exponential(float a, float b, numbers c, float *da, float *db)
{
  const float d = fabsf(a - b), e = expf(-d / c.factor), s = 1 + e;
  const float rise = c.factor * logf(s);
  return risen(a, b, c, d < INFINITY ? rise : 0, d < INFINITY ? -e / s : 0, da, db);
}

/* ---- Blocks ------------------------------------------------------------------- */

#define VALUE_KERNEL(NAME) \
  static void NAME##_value(const zs_block_arguments *x) \
  { \
    const numbers c = NAME##_numbers(x->data); \
    const size_t n = x->n; \
    const float *in_a = x->in[0], *in_b = x->in[1]; \
    float *out = x->out; \
    _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
    { \
      float da, db; \
      out[i] = NAME(in_a[i], in_b[i], c, &da, &db); \
    } \
  }

#define GRADIENT_KERNEL(NAME) \
  static void NAME##_gradient(const zs_block_arguments *x) \
  { \
    const numbers c = NAME##_numbers(x->data); \
    const size_t n = x->n; \
    const float *in_a = x->in[0], *in_b = x->in[1]; \
    float *out = x->out; \
    _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
    { \
      float da, db; \
      const float v = NAME(in_a[i], in_b[i], c, &da, &db); \
      const float gx = da * in_a[ZS_BLOCK + i] + db * in_b[ZS_BLOCK + i]; \
      const float gy = da * in_a[2 * ZS_BLOCK + i] + db * in_b[2 * ZS_BLOCK + i]; \
      const float gz = da * in_a[3 * ZS_BLOCK + i] + db * in_b[3 * ZS_BLOCK + i]; \
      out[i] = v; \
      out[ZS_BLOCK + i] = gx; \
      out[2 * ZS_BLOCK + i] = gy; \
      out[3 * ZS_BLOCK + i] = gz; \
    } \
  }
VALUE_KERNEL(r_alpha)
VALUE_KERNEL(r_m)
VALUE_KERNEL(r_displaced)
VALUE_KERNEL(smooth_exponential)
GRADIENT_KERNEL(r_alpha)
GRADIENT_KERNEL(r_m)
GRADIENT_KERNEL(r_displaced)
GRADIENT_KERNEL(smooth_exponential)

/* The smooth joints that end. */
ZS_INLINE void joint_values(const zs_block_arguments *x, joint_numbers c, joint_profile *rise)
{
  const float *in_a = x->in[0], *in_b = x->in[1];
  float *out = x->out;
  for (size_t i = 0, n = x->n; i < n; i += ZS_WIDTH) {
    const zs_lanes a = zs_lanes_load(in_a + i), b = zs_lanes_load(in_b + i);
    zs_lanes_store(out + i, joined(a, b, c, rise));
  }
}

ZS_INLINE void joint_gradients(const zs_block_arguments *x, joint_numbers c, joint_profile *rise,
                            joint_slope *slope)
{
  const float *in_a = x->in[0], *in_b = x->in[1];
  float *out = x->out;
  for (size_t i = 0, n = x->n; i < n; i += ZS_WIDTH) {
    const zs_lanes a = zs_lanes_load(in_a + i), b = zs_lanes_load(in_b + i);
    const joint_weights weight =
      joint_weights_of(c.side > 0 ? a > b : a < b, slope(zs_lanes_absolute(a - b), c));
    zs_lanes_store(out + i, joined(a, b, c, rise));
    for (size_t row = ZS_BLOCK + i; row < 4 * ZS_BLOCK; row += ZS_BLOCK)
      zs_lanes_store(out + row, weight.a * zs_lanes_load(in_a + row) +
                                  weight.b * zs_lanes_load(in_b + row));
  }
}

#define JOINT_KERNELS(NAME) \
  static void smooth_##NAME##_value(const zs_block_arguments *x) \
  { \
    joint_values(x, NAME##_numbers(x->data), NAME##_rise); \
  } \
  static void smooth_##NAME##_gradient(const zs_block_arguments *x) \
  { \
    joint_gradients(x, NAME##_numbers(x->data), NAME##_rise, NAME##_slope); \
  } \
  static void smooth_##NAME##_bounds(const zs_bounds_arguments *x) \
  { \
    const zs_demand inputs = zs_smooth_##NAME.demand(x->data, x->demand); \
    ZS_FOR_PARTS(part) \
      zs_intervals_store(x->out, part, \
                         smooth_range(zs_intervals_load(x->in[0], part), \
                                      zs_intervals_load(x->in[1], part), NAME##_numbers(x->data), \
                                      x->demand, inputs, NAME##_rise, x->choice, part)); \
  }
JOINT_KERNELS(quadratic)
JOINT_KERNELS(cubic)
JOINT_KERNELS(circular)
JOINT_KERNELS(chamfer)


static void interpolation_value(const zs_block_arguments *x)
{
  const size_t n = x->n;
  const float *in_a = x->in[0], *in_b = x->in[1], *in_t = x->in[2];
  float *out = x->out;
#pragma omp simd
  for (size_t i = 0; i < n; i++) {
    const float a = in_a[i], b = in_b[i], t = in_t[i];
    const float mixed = (1 - t) * a + t * b;
    out[i] = t <= 0 ? a : t >= 1 ? b : mixed;
  }
}

static void interpolation_gradient(const zs_block_arguments *x)
{
  const size_t n = x->n;
  const float *in_a = x->in[0], *in_b = x->in[1], *in_t = x->in[2];
  float *out = x->out;
#pragma omp simd
  for (size_t i = 0; i < n; i++) {
    const float a = in_a[i], b = in_b[i], t = in_t[i];
    const int before = t <= 0, after = t >= 1;
    const float da = before ? 1 : after ? 0 : 1 - t, db = before ? 0 : after ? 1 : t;
    const float dt = before || after ? 0 : b - a;
    const float mixed = (1 - t) * a + t * b;
    const float gx =
      da * in_a[ZS_BLOCK + i] + db * in_b[ZS_BLOCK + i] + dt * in_t[ZS_BLOCK + i];
    const float gy =
      da * in_a[2 * ZS_BLOCK + i] + db * in_b[2 * ZS_BLOCK + i] + dt * in_t[2 * ZS_BLOCK + i];
    const float gz =
      da * in_a[3 * ZS_BLOCK + i] + db * in_b[3 * ZS_BLOCK + i] + dt * in_t[3 * ZS_BLOCK + i];
    out[i] = before ? a : after ? b : mixed;
    out[ZS_BLOCK + i] = gx;
    out[2 * ZS_BLOCK + i] = gy;
    out[3 * ZS_BLOCK + i] = gz;
  }
}

/* ---- Bounds ------------------------------------------------------------------- */

/* At opposite operands the steps' errors are divided by q = sqrt(2 + 2 alpha). */
static float r_alpha_ulps(numbers c)
{
  return 8 + 8 * sqrtf(c.scale);
}

/* An R-function grows with both operands. */
static zs_interval r_alpha_interval(zs_interval a, zs_interval b, numbers c)
{
  float unused;
  const float p = r_alpha(a.lo, b.lo, c, &unused, &unused);
  const float q = r_alpha(a.hi, b.hi, c, &unused, &unused);
  /* In a narrow interval the roundings may be the larger part. */
  return zs_interval_hull4(p, q, p, q, r_alpha_ulps(c));
}

/* The value kernel's arithmetic, without slopes. */
static inline zs_lanes r_alpha_lanes(zs_lanes a, zs_lanes b, numbers c)
{
  const zs_lanes zero = zs_lanes_all(0), one = zs_lanes_all(1), s = zs_lanes_all(-c.side);
  const zs_lanes x = s * a, y = s * b;
  const zs_lanes_mask x_big = zs_lanes_absolute(x) > zs_lanes_absolute(y);
  const zs_lanes big = zs_lanes_select(x_big, x, y), small = zs_lanes_select(x_big, y, x);
  const zs_lanes size = zs_lanes_absolute(big);
  const zs_lanes t =
    zs_lanes_select((size > zero) & (size < zs_lanes_all(INFINITY)), small / big, zero);
  const zs_lanes u = one - zs_lanes_all(c.alpha) * t;
  const zs_lanes d = one + t + zs_lanes_square_root(u * u + zs_lanes_all(c.beta) * t * t);
  return s * zs_lanes_select(big > zero, zs_lanes_all(2) * small / d,
                             big * d * zs_lanes_all(c.scale));
}

static zs_intervals r_alpha_range(zs_intervals a, zs_intervals b, numbers c)
{
  const zs_lanes p = r_alpha_lanes(a.lo, b.lo, c), q = r_alpha_lanes(a.hi, b.hi, c);
  const zs_lanes_mask known = zs_intervals_known(a) & zs_intervals_known(b) & (p == p) & (q == q);
  const zs_intervals range =
    zs_intervals_widened(zs_lanes_smaller(p, q), zs_lanes_larger(p, q), r_alpha_ulps(c));
  return zs_intervals_checked(range.lo, range.hi, known);
}

/* Where only the sign counts, it is that of the operands' maximum or minimum. */
static void r_alpha_bounds(const zs_bounds_arguments *x)
{
  const numbers c = r_alpha_numbers(x->data);
  zs_choice extremum = {.copy = {0}};
  ZS_FOR_PARTS(part)
  {
    const zs_intervals a = zs_intervals_load(x->in[0], part);
    const zs_intervals b = zs_intervals_load(x->in[1], part);
    if (zs_demand_is_sign(x->demand)) {
      extremum_range(a, b, c.side > 0, x->demand, &extremum, part);
      zs_set_bits(&extremum.simpler, part, zs_intervals_known(a) & zs_intervals_known(b));
    }
    zs_intervals_store(x->out, part, r_alpha_range(a, b, c));
  }
  for (int k = 0; k < 2; k++)
    x->choice->sign[k] = extremum.copy[k] | extremum.sign[k];
  x->choice->simpler = extremum.simpler;
}

static void r_m_bounds(const zs_bounds_arguments *x)
{
  const numbers c = r_m_numbers(x->data);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    zs_interval a = zs_interval_of_lane(x->in[0], l), b = zs_interval_of_lane(x->in[1], l);
    if (!zs_interval_known(a) || !zs_interval_known(b)) {
      zs_interval_to_lane(x->out, l, zs_interval_unknown());
      continue;
    }
    const zs_interval u = zs_interval_absolute(a), v = zs_interval_absolute(b);
    const float ulps = 4 + 4 * (float)c.power;
    zs_interval p = {small_power(u.lo * u.lo + v.lo * v.lo, c.power) * (1 - ulps * JOINT_UNIT),
                     small_power(u.hi * u.hi + v.hi * v.hi, c.power) * (1 + ulps * JOINT_UNIT)};
    /* The exact power may be beyond the least and the greatest that blocks use. */
    if (p.lo < 1e-19f)
      p.lo = 0;
    if (p.hi > 1e38f)
      p.hi = INFINITY;
    zs_interval_to_lane(x->out, l, zs_interval_multiply(r_alpha_interval(a, b, c), p));
  }
}

static void r_displaced_bounds(const zs_bounds_arguments *x)
{
  const numbers c = r_displaced_numbers(x->data);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    zs_interval a = zs_interval_of_lane(x->in[0], l), b = zs_interval_of_lane(x->in[1], l);
    if (!zs_interval_known(a) || !zs_interval_known(b)) {
      zs_interval_to_lane(x->out, l, zs_interval_unknown());
      continue;
    }
    zs_interval u = zs_interval_absolute(a), v = zs_interval_absolute(b);
    const float near = 1 / (1 + u.lo * u.lo * c.b1 * c.b1 + v.lo * v.lo * c.b2 * c.b2);
    const float far = 1 / (1 + u.hi * u.hi * c.b1 * c.b1 + v.hi * v.hi * c.b2 * c.b2);
    zs_interval rise = zs_interval_hull4(c.a0 * near, c.a0 * far, c.a0 * near, c.a0 * far, 8);
    zs_interval r = r_alpha_interval(a, b, c);
    /* The sum's rounding error is relative to the larger term. */
    const float slack = JOINT_UNIT * (fabsf(c.a0) + (fabsf(r.lo) < INFINITY ? fabsf(r.lo) : 0) +
                                (fabsf(r.hi) < INFINITY ? fabsf(r.hi) : 0));
    zs_interval sum = zs_interval_add(r, rise);
    zs_interval_to_lane(x->out, l, (zs_interval){sum.lo - slack, sum.hi + slack});
  }
}

/* This one never ends: there is nothing to choose. */
static void smooth_exponential_bounds(const zs_bounds_arguments *x)
{
  const numbers c = smooth_exponential_numbers(x->data);
  for (unsigned l = 0; l < ZS_LANES; l++) {
    zs_interval a = zs_interval_of_lane(x->in[0], l), b = zs_interval_of_lane(x->in[1], l);
    float unused;
    const float lo = smooth_exponential(a.lo, b.lo, c, &unused, &unused);
    const float hi = smooth_exponential(a.hi, b.hi, c, &unused, &unused);
    const float slack = 4 * JOINT_UNIT * c.k;
    zs_interval_to_lane(x->out, l,
                        zs_interval_known(a) && zs_interval_known(b)
                          ? zs_interval_widened(lo - slack, hi + slack, 2)
                          : zs_interval_unknown());
  }
}

static inline float mixed(float a, float b, float t)
{
  return t <= 0 ? a : t >= 1 ? b : (1 - t) * a + t * b;
}

static void interpolation_bounds(const zs_bounds_arguments *x)
{
  unsigned copy_a = 0, copy_b = 0;
  for (unsigned l = 0; l < ZS_LANES; l++) {
    zs_interval a = zs_interval_of_lane(x->in[0], l), b = zs_interval_of_lane(x->in[1], l), t = zs_interval_of_lane(x->in[2], l);
    const bool before = t.hi <= 0, after = t.lo >= 1;
    copy_a |= (unsigned)before << l;
    copy_b |= (unsigned)after << l;
    zs_interval r = zs_interval_unknown();
    if (before) {
      r = a;
    } else if (after) {
      r = b;
    } else if (zs_interval_known(a) && zs_interval_known(b) && zs_interval_known(t)) {
      const float lo[2] = {mixed(a.lo, b.lo, t.lo), mixed(a.lo, b.lo, t.hi)};
      const float hi[2] = {mixed(a.hi, b.hi, t.lo), mixed(a.hi, b.hi, t.hi)};
      const float slack =
        2 * JOINT_UNIT * (fmaxf(fabsf(a.lo), fabsf(a.hi)) + fmaxf(fabsf(b.lo), fabsf(b.hi)));
      r = zs_interval_hull4(lo[0] - slack, lo[1] - slack, hi[0] + slack, hi[1] + slack, 2);
    }
    zs_interval_to_lane(x->out, l, r);
  }
  x->choice->copy[0] = (uint16_t)copy_a;
  x->choice->copy[1] = (uint16_t)copy_b;
}

/* ---- Tables ------------------------------------------------------------------- */

#define TABLE(NAME) \
  const zs_kernels ZS_KERNELS(zs_##NAME##_kernels) = {NAME##_value, NAME##_gradient, NAME##_bounds};
TABLE(r_alpha)
TABLE(r_m)
TABLE(r_displaced)
TABLE(smooth_quadratic)
TABLE(smooth_cubic)
TABLE(smooth_circular)
TABLE(smooth_chamfer)
TABLE(smooth_exponential)
TABLE(interpolation)
