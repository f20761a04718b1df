/* Block, gradient and bounds kernels of the primitives.  Compiled once per
 * instruction set. */
#include "field/primitive.h"

#include "field/row.h"

#include <math.h>

/* ---- Shapes ------------------------------------------------------------------
 *
 * f and, where `g` is used, its gradient in the primitive's own coordinates. */

typedef struct numbers {
  float a, b, c, r;
  float size; /* sum of those that are finite */
} numbers;

static inline float larger(float a, float b)
{
  return a > b ? a : b;
}

static inline float smaller(float a, float b)
{
  return a < b ? a : b;
}

/* 1 / length; 0 at the origin, where no direction leads away from it. */
static inline float reciprocal(float length)
{
  return length > 0 ? 1 / length : 0;
}

static inline float signed_like(float magnitude, float sign)
{
  return sign < 0 ? -magnitude : magnitude;
}

static inline float ball(float x, float y, float z, numbers s, float g[3])
{
  const float d = sqrtf(x * x + y * y + z * z), k = reciprocal(d);
  g[0] = -k * x;
  g[1] = -k * y;
  g[2] = -k * z;
  return s.r - d;
}

static inline float tube(float x, float y, float z, numbers s, float g[3])
{
  (void)z;
  const float d = sqrtf(x * x + y * y), k = reciprocal(d);
  g[0] = -k * x;
  g[1] = -k * y;
  g[2] = 0;
  return s.r - d;
}

static inline float cuboid(float x, float y, float z, numbers s, float g[3])
{
  const float u = fabsf(x) - s.a, v = fabsf(y) - s.b, w = fabsf(z) - s.c;
  const float p = larger(u, 0), q = larger(v, 0), t = larger(w, 0);
  const float vw = larger(v, w), m = larger(u, vw);
  const float d = sqrtf(p * p + q * q + t * t), k = reciprocal(d);
  /* Outside away from the nearest point; inside, and on a face, across the
   * nearest face. */
  const int outside = d > 0, by_u = u >= vw, by_v = v >= w;
  g[0] = -signed_like(outside ? k * p : by_u ? 1.0f : 0.0f, x);
  g[1] = -signed_like(outside ? k * q : by_u || !by_v ? 0.0f : 1.0f, y);
  g[2] = -signed_like(outside ? k * t : by_u || by_v ? 0.0f : 1.0f, z);
  return s.r - (smaller(m, 0) + d);
}

static inline float cylinder(float x, float y, float z, numbers s, float g[3])
{
  const float length = sqrtf(x * x + y * y), k = reciprocal(length);
  const float u = length - s.r, w = fabsf(z) - s.a;
  const float p = larger(u, 0), t = larger(w, 0);
  const float d = sqrtf(p * p + t * t), scale = reciprocal(d);
  const int outside = d > 0;
  const float across = outside ? scale * p : u >= w ? 1.0f : 0.0f;
  const float along = outside ? scale * t : u >= w ? 0.0f : 1.0f;
  g[0] = -across * k * x;
  g[1] = -across * k * y;
  g[2] = -signed_like(along, z);
  return -(smaller(larger(u, w), 0) + d);
}

static inline float torus(float x, float y, float z, numbers s, float g[3])
{
  const float length = sqrtf(x * x + y * y), k = reciprocal(length), u = length - s.a;
  const float d = sqrtf(u * u + z * z), scale = reciprocal(d);
  g[0] = -scale * u * k * x;
  g[1] = -scale * u * k * y;
  g[2] = -scale * z;
  return s.r - d;
}

static inline float capsule(float x, float y, float z, numbers s, float g[3])
{
  const float w = larger(fabsf(z) - s.a, 0);
  const float d = sqrtf(x * x + y * y + w * w), k = reciprocal(d);
  g[0] = -k * x;
  g[1] = -k * y;
  g[2] = -k * signed_like(w, z);
  return s.r - d;
}

static float sizes(double a, double b, double c, double d)
{
  const double p[4] = {fabs(a), fabs(b), fabs(c), fabs(d)};
  double sum = 0;
  for (int i = 0; i < 4; i++)
    sum += p[i] < (double)INFINITY ? p[i] : 0;
  return (float)sum;
}

static numbers ball_numbers(const double *p)
{
  return (numbers){.r = (float)p[0], .size = sizes(p[0], 0, 0, 0)};
}

static numbers tube_numbers(const double *p)
{
  return ball_numbers(p);
}

static numbers cuboid_numbers(const double *p)
{
  return (numbers){(float)p[0], (float)p[1], (float)p[2], (float)p[3],
                   sizes(p[0], p[1], p[2], p[3])};
}

static numbers cylinder_numbers(const double *p)
{
  return (numbers){.r = (float)p[0], .a = (float)p[1], .size = sizes(p[0], p[1], 0, 0)};
}

static numbers torus_numbers(const double *p)
{
  return (numbers){.a = (float)p[0], .r = (float)p[1], .size = sizes(p[0], p[1], 0, 0)};
}

static numbers capsule_numbers(const double *p)
{
  return cylinder_numbers(p);
}

/* ---- Blocks ---------------------------------------------------------------------- */

/* From the inputs to the primitive's own coordinates. */
typedef struct place {
  float c0, c1, c2;
  float k00, k01, k02, k10, k11, k12, k20, k21, k22;
  bool moved; /* only the constants matter: the rest is the identity */
} place;

static place place_of(const zs_row row[3])
{
  const place p = {row[0].constant, row[1].constant, row[2].constant,
                   row[0].k[0],     row[0].k[1],     row[0].k[2],
                   row[1].k[0],     row[1].k[1],     row[1].k[2],
                   row[2].k[0],     row[2].k[1],     row[2].k[2],
                   false};
  place q = p;
  q.moved = p.k00 == 1 && p.k11 == 1 && p.k22 == 1 && p.k01 == 0 && p.k02 == 0 && p.k10 == 0 &&
            p.k12 == 0 && p.k20 == 0 && p.k21 == 0;
  return q;
}

static place place_in_frame(const zs_primitive *primitive, const zs_frame *frame)
{
  zs_row row[3];
  for (int i = 0; i < 3; i++)
    row[i] = zs_row_in_frame(primitive->matrix + 4 * (size_t)i, frame);
  return place_of(row);
}

static place place_of_registers(const zs_primitive *primitive)
{
  zs_row row[3];
  for (int i = 0; i < 3; i++)
    row[i] = zs_row_of_registers(primitive->matrix + 4 * (size_t)i);
  return place_of(row);
}

#define LOOP(NAME, X, Y, Z) \
  _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
  { \
    float g[3]; \
    const float u = in_u[i], v = in_v[i], w = in_w[i]; \
    (void)u, (void)v, (void)w; \
    out[i] = NAME(X, Y, Z, s, g); \
  }

#define ROW(i) p.k##i##0 * u + p.k##i##1 * v + p.k##i##2 * w + p.c##i
#define PERSPECTIVE_ROW(i) p.c##i + w *(p.k##i##2 + u * p.k##i##0 + v * p.k##i##1)

/* g, by the primitive's coordinates, as row m of the chain rule: the derivatives
 * of the inputs are ku, kv, kw of the coordinates' rows. */
#define VALUE_KERNELS(NAME) \
  static void NAME##_at(const zs_block_arguments *x, place p, bool perspective) \
  { \
    const numbers s = NAME##_numbers(((const zs_primitive *)x->data)->parameter); \
    const size_t n = x->n; \
    const float *in_u = x->in[0], *in_v = x->in[1], *in_w = x->in[2]; \
    float *out = x->out; \
    if (perspective) { \
      LOOP(NAME, PERSPECTIVE_ROW(0), PERSPECTIVE_ROW(1), PERSPECTIVE_ROW(2)) \
    } else if (p.moved) { \
      LOOP(NAME, u + p.c0, v + p.c1, w + p.c2) \
    } else { \
      LOOP(NAME, ROW(0), ROW(1), ROW(2)) \
    } \
  } \
  static void NAME##_root_value(const zs_block_arguments *x) \
  { \
    NAME##_at(x, place_in_frame(x->data, x->frame), x->frame->perspective); \
  } \
  static void NAME##_value(const zs_block_arguments *x) \
  { \
    NAME##_at(x, place_of_registers(x->data), false); \
  }

#define GRADIENT_KERNELS(NAME) \
  static void NAME##_root_gradient(const zs_block_arguments *x) \
  { \
    const numbers s = NAME##_numbers(((const zs_primitive *)x->data)->parameter); \
    const place p = place_in_frame(x->data, x->frame); \
    const size_t n = x->n; \
    const float *in_u = x->in[0], *in_v = x->in[1], *in_w = x->in[2]; \
    float *out = x->out; \
    _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
    { \
      float g[3]; \
      const float u = in_u[i], v = in_v[i], w = in_w[i]; \
      out[i] = NAME(ROW(0), ROW(1), ROW(2), s, g); \
      out[ZS_BLOCK + i] = g[0] * p.k00 + g[1] * p.k10 + g[2] * p.k20; \
      out[2 * ZS_BLOCK + i] = g[0] * p.k01 + g[1] * p.k11 + g[2] * p.k21; \
      out[3 * ZS_BLOCK + i] = g[0] * p.k02 + g[1] * p.k12 + g[2] * p.k22; \
    } \
  } \
  static void NAME##_gradient(const zs_block_arguments *x) \
  { \
    const numbers s = NAME##_numbers(((const zs_primitive *)x->data)->parameter); \
    const place p = place_of_registers(x->data); \
    const size_t n = x->n; \
    const float *in_u = x->in[0], *in_v = x->in[1], *in_w = x->in[2]; \
    float *out = x->out; \
    _Pragma("omp simd") for (size_t i = 0; i < n; i++) \
    { \
      float g[3]; \
      const float u = in_u[i], v = in_v[i], w = in_w[i]; \
      const float f = NAME(ROW(0), ROW(1), ROW(2), s, g); \
      const float by_u = g[0] * p.k00 + g[1] * p.k10 + g[2] * p.k20; \
      const float by_v = g[0] * p.k01 + g[1] * p.k11 + g[2] * p.k21; \
      const float by_w = g[0] * p.k02 + g[1] * p.k12 + g[2] * p.k22; \
      CHAIN(1, gx) \
      CHAIN(2, gy) \
      CHAIN(3, gz) \
      out[i] = f; \
      out[ZS_BLOCK + i] = gx; \
      out[2 * ZS_BLOCK + i] = gy; \
      out[3 * ZS_BLOCK + i] = gz; \
    } \
  }

/* A factor that is 0 drops its input's derivative, which may be infinite. */
#define CHAIN(k, G) \
  const float G##_u = in_u[(k)*ZS_BLOCK + i], G##_v = in_v[(k)*ZS_BLOCK + i], \
              G##_w = in_w[(k)*ZS_BLOCK + i]; \
  const float G = (by_u != 0 ? by_u * G##_u : 0) + (by_v != 0 ? by_v * G##_v : 0) + \
                  (by_w != 0 ? by_w * G##_w : 0);

#define BLOCK_KERNELS(NAME) VALUE_KERNELS(NAME) GRADIENT_KERNELS(NAME)
BLOCK_KERNELS(ball)
BLOCK_KERNELS(tube)
BLOCK_KERNELS(cuboid)
BLOCK_KERNELS(cylinder)
BLOCK_KERNELS(torus)
BLOCK_KERNELS(capsule)

/* ---- Bounds ---------------------------------------------------------------------- */

/* The shapes over what |x|, |y| and |z| can be: they shrink with all of them, but
 * for the torus. */
static inline zs_intervals ball_range(const zs_intervals m[3], numbers s)
{
  const zs_lanes r = zs_lanes_all(s.r);
  return (zs_intervals){
    r - zs_lanes_square_root(m[0].hi * m[0].hi + m[1].hi * m[1].hi + m[2].hi * m[2].hi),
    r - zs_lanes_square_root(m[0].lo * m[0].lo + m[1].lo * m[1].lo + m[2].lo * m[2].lo)};
}

static zs_lanes lanes_hypot(zs_lanes a, zs_lanes b)
{
  return zs_lanes_square_root(a * a + b * b);
}

static inline zs_intervals tube_range(const zs_intervals m[3], numbers s)
{
  const zs_lanes r = zs_lanes_all(s.r);
  return (zs_intervals){r - lanes_hypot(m[0].hi, m[1].hi), r - lanes_hypot(m[0].lo, m[1].lo)};
}

/* The distance from a corner whose three coordinates, from the faces that meet
 * there, are given; negative behind all of them. */
static zs_lanes corner_distance(zs_lanes u, zs_lanes v, zs_lanes w)
{
  const zs_lanes zero = zs_lanes_all(0);
  const zs_lanes p = zs_lanes_larger(u, zero), q = zs_lanes_larger(v, zero),
                 t = zs_lanes_larger(w, zero);
  const zs_lanes most = zs_lanes_larger(u, zs_lanes_larger(v, w));
  return zs_lanes_smaller(most, zero) + zs_lanes_square_root(p * p + q * q + t * t);
}

static inline zs_intervals cuboid_range(const zs_intervals m[3], numbers s)
{
  const zs_lanes a = zs_lanes_all(s.a), b = zs_lanes_all(s.b), c = zs_lanes_all(s.c),
                 r = zs_lanes_all(s.r);
  return (zs_intervals){r - corner_distance(m[0].hi - a, m[1].hi - b, m[2].hi - c),
                        r - corner_distance(m[0].lo - a, m[1].lo - b, m[2].lo - c)};
}

static inline zs_intervals cylinder_range(const zs_intervals m[3], numbers s)
{
  const zs_lanes r = zs_lanes_all(s.r), h = zs_lanes_all(s.a);
  const zs_lanes far = lanes_hypot(m[0].hi, m[1].hi) - r, near = lanes_hypot(m[0].lo, m[1].lo) - r;
  const zs_lanes none = zs_lanes_all(-INFINITY);
  return (zs_intervals){-corner_distance(far, m[2].hi - h, none),
                        -corner_distance(near, m[2].lo - h, none)};
}

static inline zs_intervals capsule_range(const zs_intervals m[3], numbers s)
{
  const zs_lanes h = zs_lanes_all(s.a), zero = zs_lanes_all(0);
  const zs_intervals beyond = {zs_lanes_larger(m[2].lo - h, zero),
                               zs_lanes_larger(m[2].hi - h, zero)};
  return ball_range((zs_intervals[3]){m[0], m[1], beyond}, s);
}

static inline zs_intervals torus_range(const zs_intervals m[3], numbers s)
{
  const zs_lanes a = zs_lanes_all(s.a), r = zs_lanes_all(s.r), zero = zs_lanes_all(0);
  const zs_lanes least = lanes_hypot(m[0].lo, m[1].lo) - a,
                 most = lanes_hypot(m[0].hi, m[1].hi) - a;
  const zs_lanes near = zs_lanes_larger(zs_lanes_larger(least, -most), zero),
                 far = zs_lanes_larger(-least, most);
  return (zs_intervals){r - lanes_hypot(far, m[2].hi), r - lanes_hypot(near, m[2].lo)};
}

/* Whether a coordinate depends on several inputs. */
static bool is_turned(const zs_row row[3])
{
  for (int i = 0; i < 3; i++)
    if ((row[i].k[0] != 0) + (row[i].k[1] != 0) + (row[i].k[2] != 0) > 1)
      return true;
  return false;
}

/* How far the corners of the boxes are from their middles. */
static zs_lanes half_diagonal(const zs_bounds *const in[3])
{
  const zs_lanes half = zs_lanes_all(0.5f);
  zs_lanes square = zs_lanes_all(0);
  for (int k = 0; k < 3; k++) {
    const zs_intervals a = zs_intervals_load(in[k]);
    const zs_lanes reach = half * a.hi - half * a.lo;
    square += reach * reach;
  }
  return zs_lanes_square_root(square);
}

typedef zs_intervals range(const zs_intervals m[3], numbers s);

__attribute__((always_inline)) static inline zs_intervals bounds(const zs_bounds_arguments *x, const zs_row row[3],
                                  bool perspective, numbers s, range *of_shape)
{
  zs_intervals local[3], m[3];
  zs_lanes size = zs_lanes_all(0);
  zs_lanes_mask known = size == size;
  for (int i = 0; i < 3; i++) {
    local[i] = perspective ? zs_row_perspective_bounds(row[i], x->in)
                           : zs_row_bounds(row[i], x->in);
    m[i] = zs_intervals_absolute(local[i]);
    size += m[i].hi;
    known &= zs_intervals_known(m[i]);
  }
  zs_intervals f = of_shape(m, s);
  if (!perspective && is_turned(row)) {
    /* A turned box of inputs reaches less far than the box around it in the
     * primitive's coordinates: f changes by no more than the distance from the
     * middle. */
    const zs_lanes half = zs_lanes_all(0.5f);
    const zs_lanes reach =
      half_diagonal(x->in) * zs_lanes_all((float)((const zs_primitive *)x->data)->stretch);
    for (int i = 0; i < 3; i++) {
      const zs_lanes middle = half * local[i].lo + half * local[i].hi;
      m[i] = zs_intervals_absolute((zs_intervals){middle, middle});
    }
    const zs_intervals at_middle = of_shape(m, s);
    f.lo = zs_lanes_larger(at_middle.lo - reach, f.lo);
    f.hi = zs_lanes_smaller(at_middle.hi + reach, f.hi);
  }
  /* The errors of the coordinates, and of a dozen roundings on the way. */
  const zs_lanes slack = zs_lanes_all(8 * 1.2e-7f) * (size + zs_lanes_all(s.size));
  return zs_intervals_checked(f.lo - slack, f.hi + slack, known);
}

#define BOUNDS_KERNELS(NAME) \
  static void NAME##_root_bounds(const zs_bounds_arguments *x) \
  { \
    const zs_primitive *primitive = x->data; \
    zs_row row[3]; \
    for (int i = 0; i < 3; i++) \
      row[i] = zs_row_in_frame(primitive->matrix + 4 * (size_t)i, x->frame); \
    zs_intervals_store(x->out, bounds(x, row, x->frame->perspective, \
                                      NAME##_numbers(primitive->parameter), NAME##_range)); \
  } \
  static void NAME##_bounds(const zs_bounds_arguments *x) \
  { \
    const zs_primitive *primitive = x->data; \
    zs_row row[3]; \
    for (int i = 0; i < 3; i++) \
      row[i] = zs_row_of_registers(primitive->matrix + 4 * (size_t)i); \
    zs_intervals_store( \
      x->out, bounds(x, row, false, NAME##_numbers(primitive->parameter), NAME##_range)); \
  }
BOUNDS_KERNELS(ball)
BOUNDS_KERNELS(tube)
BOUNDS_KERNELS(cuboid)
BOUNDS_KERNELS(cylinder)
BOUNDS_KERNELS(torus)
BOUNDS_KERNELS(capsule)

#define TABLE(SHAPE, NAME) \
  [ZS_PRIMITIVE_##SHAPE] = {{NAME##_value, NAME##_gradient, NAME##_bounds}, \
                            {NAME##_root_value, NAME##_root_gradient, NAME##_root_bounds}},

const zs_primitive_table ZS_KERNELS(zs_primitive_kernels) = {
  TABLE(BALL, ball)
  TABLE(TUBE, tube)
  TABLE(CUBOID, cuboid)
  TABLE(CYLINDER, cylinder)
  TABLE(TORUS, torus)
  TABLE(CAPSULE, capsule)
};
