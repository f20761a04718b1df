/* Block, gradient and bounds kernels of the primitives.  Compiled once per
 * instruction set. */
#include "field/primitive.h"

#include "field/row.h"

#include <math.h>

/* ---- Numbers ---------------------------------------------------------------------- */

typedef struct numbers {
  zs_lanes a, b, c, r;
  zs_lanes size; /* sum of those that are finite */
} numbers;

static inline numbers make_numbers(double a, double b, double c, double r)
{
  const double p[4] = {fabs(a), fabs(b), fabs(c), fabs(r)};
  double sum = 0;
  for (int i = 0; i < 4; i++)
    sum += p[i] < (double)INFINITY ? p[i] : 0;
  return (numbers){zs_lanes_all((float)a), zs_lanes_all((float)b), zs_lanes_all((float)c),
                   zs_lanes_all((float)r), zs_lanes_all((float)sum)};
}

static inline numbers ball_numbers(const double *p)
{
  return make_numbers(0, 0, 0, p[0]);
}

static inline numbers tube_numbers(const double *p)
{
  return ball_numbers(p);
}

static inline numbers cuboid_numbers(const double *p)
{
  return make_numbers(p[0], p[1], p[2], p[3]);
}

static inline numbers cylinder_numbers(const double *p)
{
  return make_numbers(p[1], 0, 0, p[0]);
}

static inline numbers torus_numbers(const double *p)
{
  return make_numbers(p[0], 0, 0, p[1]);
}

static inline numbers capsule_numbers(const double *p)
{
  return cylinder_numbers(p);
}

/* ---- Shapes ------------------------------------------------------------------------- */

/* A point in a primitive's own coordinates. */
typedef struct point {
  zs_lanes x, y, z;
} point;

static inline zs_lanes length2(zs_lanes a, zs_lanes b)
{
  return zs_lanes_square_root(zs_lanes_multiply_add(a, a, b * b));
}

static inline zs_lanes length3(zs_lanes a, zs_lanes b, zs_lanes c)
{
  return zs_lanes_square_root(zs_lanes_multiply_add(a, a, zs_lanes_multiply_add(b, b, c * c)));
}

static inline zs_lanes positive(zs_lanes a)
{
  return zs_lanes_larger(a, zs_lanes_all(0));
}

static inline zs_lanes ball(point at, numbers s)
{
  return s.r - length3(at.x, at.y, at.z);
}

static inline zs_lanes tube(point at, numbers s)
{
  return s.r - length2(at.x, at.y);
}

static inline zs_lanes cuboid(point at, numbers s)
{
  const zs_lanes u = zs_lanes_absolute(at.x) - s.a, v = zs_lanes_absolute(at.y) - s.b,
                 w = zs_lanes_absolute(at.z) - s.c;
  const zs_lanes most = zs_lanes_larger(u, zs_lanes_larger(v, w));
  return s.r - (zs_lanes_smaller(most, zs_lanes_all(0)) +
                length3(positive(u), positive(v), positive(w)));
}

static inline zs_lanes cylinder(point at, numbers s)
{
  const zs_lanes u = length2(at.x, at.y) - s.r, w = zs_lanes_absolute(at.z) - s.a;
  return -(zs_lanes_smaller(zs_lanes_larger(u, w), zs_lanes_all(0)) +
           length2(positive(u), positive(w)));
}

static inline zs_lanes torus(point at, numbers s)
{
  return s.r - length2(length2(at.x, at.y) - s.a, at.z);
}

static inline zs_lanes capsule(point at, numbers s)
{
  return s.r - length3(at.x, at.y, positive(zs_lanes_absolute(at.z) - s.a));
}

/* ---- Their gradients ------------------------------------------------------------------ */

/* 1 / length; 0 at length 0, where no direction leads away. */
static inline zs_lanes reciprocal(zs_lanes length)
{
  const zs_lanes zero = zs_lanes_all(0);
  return zs_lanes_select(length > zero, zs_lanes_all(1) / length, zero);
}

static inline zs_lanes signed_like(zs_lanes magnitude, zs_lanes sign)
{
  return zs_lanes_select(sign < zs_lanes_all(0), -magnitude, magnitude);
}

static inline point ball_gradient_at(point at, numbers s)
{
  (void)s;
  const zs_lanes k = -reciprocal(length3(at.x, at.y, at.z));
  return (point){k * at.x, k * at.y, k * at.z};
}

static inline point tube_gradient_at(point at, numbers s)
{
  (void)s;
  const zs_lanes k = -reciprocal(length2(at.x, at.y));
  return (point){k * at.x, k * at.y, zs_lanes_all(0)};
}

/* Outside away from the nearest point; inside, and on a face, across the
 * nearest face. */
static inline point cuboid_gradient_at(point at, numbers s)
{
  const zs_lanes zero = zs_lanes_all(0), one = zs_lanes_all(1);
  const zs_lanes u = zs_lanes_absolute(at.x) - s.a, v = zs_lanes_absolute(at.y) - s.b,
                 w = zs_lanes_absolute(at.z) - s.c;
  const zs_lanes p = positive(u), q = positive(v), t = positive(w), d = length3(p, q, t);
  const zs_lanes k = reciprocal(d);
  const zs_lanes_mask outside = d > zero, by_u = u >= zs_lanes_larger(v, w),
                      by_v = ~by_u & (v >= w), by_w = ~by_u & ~by_v;
  return (point){-signed_like(zs_lanes_select(outside, k * p, zs_lanes_select(by_u, one, zero)), at.x),
                 -signed_like(zs_lanes_select(outside, k * q, zs_lanes_select(by_v, one, zero)), at.y),
                 -signed_like(zs_lanes_select(outside, k * t, zs_lanes_select(by_w, one, zero)), at.z)};
}

static inline point cylinder_gradient_at(point at, numbers s)
{
  const zs_lanes zero = zs_lanes_all(0), one = zs_lanes_all(1);
  const zs_lanes length = length2(at.x, at.y), k = reciprocal(length);
  const zs_lanes u = length - s.r, w = zs_lanes_absolute(at.z) - s.a;
  const zs_lanes p = positive(u), t = positive(w), d = length2(p, t), scale = reciprocal(d);
  const zs_lanes_mask outside = d > zero, by_u = u >= w;
  const zs_lanes across = -k * zs_lanes_select(outside, scale * p, zs_lanes_select(by_u, one, zero));
  const zs_lanes along = zs_lanes_select(outside, scale * t, zs_lanes_select(by_u, zero, one));
  return (point){across * at.x, across * at.y, -signed_like(along, at.z)};
}

static inline point torus_gradient_at(point at, numbers s)
{
  const zs_lanes length = length2(at.x, at.y), u = length - s.a;
  const zs_lanes scale = -reciprocal(length2(u, at.z)), across = scale * u * reciprocal(length);
  return (point){across * at.x, across * at.y, scale * at.z};
}

static inline point capsule_gradient_at(point at, numbers s)
{
  const zs_lanes w = positive(zs_lanes_absolute(at.z) - s.a);
  const zs_lanes k = -reciprocal(length3(at.x, at.y, w));
  return (point){k * at.x, k * at.y, k * signed_like(w, at.z)};
}

/* ---- Blocks --------------------------------------------------------------------------- */

/* From the inputs to the primitive's own coordinates. */
typedef struct map {
  zs_lanes constant[3], k[3][3];
  enum { MOVED, AFFINE, PERSPECTIVE } kind; /* MOVED: k is the identity */
} map;

/* The constants of a matrix that only moves, in a frame parallel to the scene. */
static inline void find_offset(const zs_primitive *primitive, const double origin[3],
                               zs_lanes offset[3])
{
  for (int i = 0; i < 3; i++)
    offset[i] = zs_lanes_all((float)(primitive->matrix[4 * i + 3] + origin[i]));
}

static inline void find_rows(const zs_primitive *primitive, const zs_frame *frame, zs_row row[3])
{
  for (int i = 0; i < 3; i++) {
    const double *of_matrix = primitive->matrix + 4 * (size_t)i;
    row[i] = frame ? zs_row_in_frame(of_matrix, frame) : zs_row_of_registers(of_matrix);
  }
}

static const double NOWHERE[3] = {0, 0, 0};

/* In a frame, or of registers when it is NULL. */
static inline void find_map(const zs_primitive *primitive, const zs_frame *frame, map *m)
{
  m->kind = frame && frame->perspective ? PERSPECTIVE : AFFINE;
  if (primitive->moved && (!frame || frame->parallel)) {
    m->kind = MOVED;
    find_offset(primitive, frame ? frame->origin : NOWHERE, m->constant);
    return;
  }
  zs_row row[3];
  find_rows(primitive, frame, row);
  for (int i = 0; i < 3; i++) {
    m->constant[i] = zs_lanes_all(row[i].constant);
    for (int j = 0; j < 3; j++)
      m->k[i][j] = zs_lanes_all(row[i].k[j]);
  }
}

static inline point moved(const map *m, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return (point){u + m->constant[0], v + m->constant[1], w + m->constant[2]};
}

static inline zs_lanes affine_row(const map *m, int i, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return zs_lanes_multiply_add(
    m->k[i][0], u,
    zs_lanes_multiply_add(m->k[i][1], v, zs_lanes_multiply_add(m->k[i][2], w, m->constant[i])));
}

static inline point affine(const map *m, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return (point){affine_row(m, 0, u, v, w), affine_row(m, 1, u, v, w), affine_row(m, 2, u, v, w)};
}

static inline zs_lanes perspective_row(const map *m, int i, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return m->constant[i] + w * (m->k[i][2] + u * m->k[i][0] + v * m->k[i][1]);
}

static inline point perspective(const map *m, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return (point){perspective_row(m, 0, u, v, w), perspective_row(m, 1, u, v, w),
                 perspective_row(m, 2, u, v, w)};
}

typedef zs_lanes shape(point at, numbers s);
typedef point shape_gradient(point at, numbers s);
typedef point mapping(const map *m, zs_lanes u, zs_lanes v, zs_lanes w);

/* The functions passed in are constants at every call: all becomes one loop. */
#define INLINE __attribute__((always_inline)) static inline

INLINE void fill_values(const zs_block_arguments *x, const map *m, mapping *at, shape *f, numbers s)
{
  const float *u = x->in[0], *v = x->in[1], *w = x->in[2];
  float *out = x->out;
  for (size_t i = 0, n = x->n; i < n; i += ZS_LANES)
    zs_lanes_store(
      out + i, f(at(m, zs_lanes_load(u + i), zs_lanes_load(v + i), zs_lanes_load(w + i)), s));
}

INLINE void values(const zs_block_arguments *x, const map *m, shape *f, numbers s)
{
  if (m->kind == MOVED)
    fill_values(x, m, moved, f, s);
  else if (m->kind == AFFINE)
    fill_values(x, m, affine, f, s);
  else
    fill_values(x, m, perspective, f, s);
}

/* The gradient by the inputs. */
static inline point by_inputs(const map *m, point g)
{
  return (point){g.x * m->k[0][0] + g.y * m->k[1][0] + g.z * m->k[2][0],
                 g.x * m->k[0][1] + g.y * m->k[1][1] + g.z * m->k[2][1],
                 g.x * m->k[0][2] + g.y * m->k[1][2] + g.z * m->k[2][2]};
}

/* A factor that is 0 drops its input's derivative, which may be infinite. */
static inline zs_lanes term(zs_lanes factor, const float *derivative)
{
  return (zs_lanes)((zs_lanes_mask)(factor * zs_lanes_load(derivative)) &
                    (factor != zs_lanes_all(0)));
}

INLINE void fill_gradients(const zs_block_arguments *x, const map *m, mapping *where, shape *f,
                           shape_gradient *slope, numbers s, bool root)
{
  const float *u = x->in[0], *v = x->in[1], *w = x->in[2];
  float *out = x->out;
  for (size_t i = 0, n = x->n; i < n; i += ZS_LANES) {
    const point at = where(m, zs_lanes_load(u + i), zs_lanes_load(v + i), zs_lanes_load(w + i));
    const zs_lanes value = f(at, s);
    point g = slope(at, s);
    if (where == affine)
      g = by_inputs(m, g);
    if (!root) {
      zs_lanes row[3];
      for (unsigned k = 0; k < 3; k++) {
        const size_t offset = (size_t)(k + 1) * ZS_BLOCK + i;
        row[k] = term(g.x, u + offset) + term(g.y, v + offset) + term(g.z, w + offset);
      }
      g = (point){row[0], row[1], row[2]};
    }
    zs_lanes_store(out + i, value);
    zs_lanes_store(out + ZS_BLOCK + i, g.x);
    zs_lanes_store(out + 2 * ZS_BLOCK + i, g.y);
    zs_lanes_store(out + 3 * ZS_BLOCK + i, g.z);
  }
}

INLINE void gradients(const zs_block_arguments *x, const map *m, shape *f, shape_gradient *slope,
                      numbers s, bool root)
{
  if (m->kind == MOVED)
    fill_gradients(x, m, moved, f, slope, s, root);
  else
    fill_gradients(x, m, affine, f, slope, s, root);
}

/* ---- Bounds ------------------------------------------------------------------------------ */

/* Over what |x|, |y| and |z| can be: all shapes but the torus shrink with each. */
INLINE zs_intervals falling_range(const zs_intervals m[3], shape *f, numbers s)
{
  return (zs_intervals){f((point){m[0].hi, m[1].hi, m[2].hi}, s),
                        f((point){m[0].lo, m[1].lo, m[2].lo}, s)};
}

static inline zs_intervals torus_range(const zs_intervals m[3], numbers s)
{
  const zs_lanes least = length2(m[0].lo, m[1].lo) - s.a, most = length2(m[0].hi, m[1].hi) - s.a;
  const zs_lanes near = positive(zs_lanes_larger(least, -most)),
                 far = zs_lanes_larger(-least, most);
  return (zs_intervals){s.r - length2(far, m[2].hi), s.r - length2(near, m[2].lo)};
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
  zs_lanes reach[3];
  for (int k = 0; k < 3; k++) {
    const zs_intervals a = zs_intervals_load(in[k]);
    reach[k] = half * a.hi - half * a.lo;
  }
  return length3(reach[0], reach[1], reach[2]);
}

/* The primitive's coordinates over the boxes of a matrix that only moves. */
static inline void moved_bounds(const zs_primitive *primitive, const zs_frame *frame,
                                const zs_bounds *const in[3], zs_intervals local[3])
{
  const zs_lanes slack = zs_lanes_all(4 * 1.2e-7f);
  zs_lanes offset[3];
  find_offset(primitive, frame ? frame->origin : NOWHERE, offset);
  for (int i = 0; i < 3; i++) {
    const zs_intervals a = zs_intervals_load(in[i]);
    const zs_lanes size =
      zs_lanes_absolute(offset[i]) +
      zs_lanes_larger(zs_lanes_absolute(a.lo), zs_lanes_absolute(a.hi));
    local[i] = (zs_intervals){a.lo + offset[i] - slack * size, a.hi + offset[i] + slack * size};
  }
}

/* A turned box of inputs reaches less far than the box around it in the
 * primitive's coordinates: f changes by no more than the distance from the
 * middle. */
INLINE zs_intervals narrowed(zs_intervals range, const zs_intervals local[3],
                             const zs_bounds_arguments *x, shape *f, numbers s)
{
  const zs_lanes half = zs_lanes_all(0.5f);
  const zs_lanes reach =
    half_diagonal(x->in) * zs_lanes_all((float)((const zs_primitive *)x->data)->stretch);
  const zs_lanes at_middle = f((point){half * local[0].lo + half * local[0].hi,
                                       half * local[1].lo + half * local[1].hi,
                                       half * local[2].lo + half * local[2].hi},
                               s);
  return (zs_intervals){zs_lanes_larger(at_middle - reach, range.lo),
                        zs_lanes_smaller(at_middle + reach, range.hi)};
}

/* `frame` is NULL for inputs in registers. */
INLINE void bounds(const zs_bounds_arguments *x, const zs_frame *frame, shape *f, numbers s)
{
  const zs_primitive *primitive = x->data;
  zs_intervals local[3], m[3];
  bool turned = false;
  if (primitive->moved && (!frame || frame->parallel)) {
    moved_bounds(primitive, frame, x->in, local);
  } else {
    zs_row row[3];
    find_rows(primitive, frame, row);
    turned = !(frame && frame->perspective) && is_turned(row);
    for (int i = 0; i < 3; i++)
      local[i] = frame && frame->perspective ? zs_row_perspective_bounds(row[i], x->in)
                                             : zs_row_bounds(row[i], x->in);
  }
  zs_lanes size = s.size;
  zs_lanes_mask known = size == size;
  for (int i = 0; i < 3; i++) {
    m[i] = zs_intervals_absolute(local[i]);
    size += m[i].hi;
    known &= zs_intervals_known(local[i]);
  }
  zs_intervals range = f == torus ? torus_range(m, s) : falling_range(m, f, s);
  if (turned)
    range = narrowed(range, local, x, f, s);
  /* The errors of the coordinates, and of a dozen roundings on the way. */
  const zs_lanes slack = zs_lanes_all(8 * 1.2e-7f) * size;
  zs_intervals_store(x->out, zs_intervals_checked(range.lo - slack, range.hi + slack, known));
}

/* ---- Tables ---------------------------------------------------------------------------------- */

#define KERNELS(NAME, FORM, FRAME) \
  static void NAME##FORM##_value(const zs_block_arguments *x) \
  { \
    map m; \
    find_map(x->data, FRAME, &m); \
    values(x, &m, NAME, NAME##_numbers(((const zs_primitive *)x->data)->parameter)); \
  } \
  static void NAME##FORM##_gradient(const zs_block_arguments *x) \
  { \
    map m; \
    find_map(x->data, FRAME, &m); \
    gradients(x, &m, NAME, NAME##_gradient_at, \
              NAME##_numbers(((const zs_primitive *)x->data)->parameter), FRAME != NULL); \
  } \
  static void NAME##FORM##_bounds(const zs_bounds_arguments *x) \
  { \
    bounds(x, FRAME, NAME, NAME##_numbers(((const zs_primitive *)x->data)->parameter)); \
  }
#define BOTH_KERNELS(NAME) KERNELS(NAME, _registers, NULL) KERNELS(NAME, _root, x->frame)
BOTH_KERNELS(ball)
BOTH_KERNELS(tube)
BOTH_KERNELS(cuboid)
BOTH_KERNELS(cylinder)
BOTH_KERNELS(torus)
BOTH_KERNELS(capsule)

#define TABLE(SHAPE, NAME) \
  [ZS_PRIMITIVE_##SHAPE] = {{NAME##_registers_value, NAME##_registers_gradient, NAME##_registers_bounds}, \
                            {NAME##_root_value, NAME##_root_gradient, NAME##_root_bounds}},

const zs_primitive_table ZS_KERNELS(zs_primitive_kernels) = {
  TABLE(BALL, ball)
  TABLE(TUBE, tube)
  TABLE(CUBOID, cuboid)
  TABLE(CYLINDER, cylinder)
  TABLE(TORUS, torus)
  TABLE(CAPSULE, capsule)
};
