/* The primitives' values, gradients and bounds, a vector at a time: what the
 * kernels of primitives and of chains of them are made of.  For *.kernel.c
 * files only. */
#ifndef ZS_SHAPE_H
#define ZS_SHAPE_H

#include "field/primitive.h"
#include "field/row.h"

#include <math.h>

/* ---- Numbers ---------------------------------------------------------------------- */

/* A primitive's parameters, by what they are in its formula. */
typedef struct shape_parameters {
  float a, b, c, r;
} shape_parameters;

static inline shape_parameters make_parameters(double a, double b, double c, double r)
{
  return (shape_parameters){(float)a, (float)b, (float)c, (float)r};
}

static inline float finite_size(float a)
{
  return fabsf(a) < INFINITY ? fabsf(a) : 0;
}

/* The sum of the sizes of those that are finite. */
static inline float size_of(shape_parameters p)
{
  return finite_size(p.a) + finite_size(p.b) + finite_size(p.c) + finite_size(p.r);
}

static inline shape_parameters ball_parameters(const double *p)
{
  return make_parameters(0, 0, 0, p[0]);
}

static inline shape_parameters tube_parameters(const double *p)
{
  return ball_parameters(p);
}

static inline shape_parameters cuboid_parameters(const double *p)
{
  return make_parameters(p[0], p[1], p[2], p[3]);
}

static inline shape_parameters cylinder_parameters(const double *p)
{
  return make_parameters(p[1], p[0], 0, 0);
}

static inline shape_parameters torus_parameters(const double *p)
{
  return make_parameters(p[0], 0, 0, p[1]);
}

static inline shape_parameters capsule_parameters(const double *p)
{
  return make_parameters(p[1], 0, 0, p[0]);
}

typedef struct shape_numbers {
  zs_lanes a, b, c, r;
} shape_numbers;

static inline shape_numbers numbers_of(shape_parameters p)
{
  return (shape_numbers){zs_lanes_all(p.a), zs_lanes_all(p.b), zs_lanes_all(p.c),
                         zs_lanes_all(p.r)};
}

/* ---- Shapes -------------------------------------------------------------------------
 *
 * The value of every one is r - distance from something inside it. */

/* A point in a primitive's own coordinates. */
typedef struct shape_point {
  zs_lanes x, y, z;
} shape_point;

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

static inline zs_lanes ball(shape_point at, shape_numbers s)
{
  (void)s;
  return length3(at.x, at.y, at.z);
}

static inline zs_lanes tube(shape_point at, shape_numbers s)
{
  (void)s;
  return length2(at.x, at.y);
}

static inline zs_lanes cuboid(shape_point at, shape_numbers s)
{
  const zs_lanes u = zs_lanes_absolute(at.x) - s.a, v = zs_lanes_absolute(at.y) - s.b,
                 w = zs_lanes_absolute(at.z) - s.c;
  const zs_lanes most = zs_lanes_larger(u, zs_lanes_larger(v, w));
  return zs_lanes_smaller(most, zs_lanes_all(0)) +
         length3(positive(u), positive(v), positive(w));
}

static inline zs_lanes cylinder(shape_point at, shape_numbers s)
{
  const zs_lanes u = length2(at.x, at.y) - s.b, w = zs_lanes_absolute(at.z) - s.a;
  return zs_lanes_smaller(zs_lanes_larger(u, w), zs_lanes_all(0)) +
         length2(positive(u), positive(w));
}

static inline zs_lanes torus(shape_point at, shape_numbers s)
{
  return length2(length2(at.x, at.y) - s.a, at.z);
}

static inline zs_lanes capsule(shape_point at, shape_numbers s)
{
  return length3(at.x, at.y, positive(zs_lanes_absolute(at.z) - s.a));
}

/* ---- Points that are far away ---------------------------------------------------------
 *
 * Whether the distance is more than t, told without a square root; some that are
 * further are not told. */

/* Squares with the signs of what they are of. */
static inline zs_lanes signed_square(zs_lanes t)
{
  return t * zs_lanes_absolute(t);
}

static inline zs_lanes_mask ball_beyond(shape_point at, shape_numbers s, zs_lanes t)
{
  (void)s;
  return at.x * at.x + at.y * at.y + at.z * at.z > signed_square(t);
}

static inline zs_lanes_mask tube_beyond(shape_point at, shape_numbers s, zs_lanes t)
{
  (void)s;
  return at.x * at.x + at.y * at.y > signed_square(t);
}

static inline zs_lanes_mask cuboid_beyond(shape_point at, shape_numbers s, zs_lanes t)
{
  const zs_lanes u = zs_lanes_absolute(at.x) - s.a, v = zs_lanes_absolute(at.y) - s.b,
                 w = zs_lanes_absolute(at.z) - s.c;
  return zs_lanes_larger(u, zs_lanes_larger(v, w)) > t;
}

/* Beyond t from a circle about the z axis, in the plane of both and outside of it. */
static inline zs_lanes_mask ring_beyond(shape_point at, shape_numbers s, zs_lanes t,
                                        zs_lanes radius)
{
  return tube_beyond(at, s, t + radius * 1.000001f);
}

static inline zs_lanes_mask cylinder_beyond(shape_point at, shape_numbers s, zs_lanes t)
{
  return (zs_lanes_absolute(at.z) - s.a > t) | ring_beyond(at, s, t, s.b);
}

static inline zs_lanes_mask torus_beyond(shape_point at, shape_numbers s, zs_lanes t)
{
  return (zs_lanes_absolute(at.z) > t) | ring_beyond(at, s, t, s.a);
}

static inline zs_lanes_mask capsule_beyond(shape_point at, shape_numbers s, zs_lanes t)
{
  return (zs_lanes_absolute(at.z) - s.a > t) | tube_beyond(at, s, t);
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

static inline shape_point ball_gradient_at(shape_point at, shape_numbers s)
{
  (void)s;
  const zs_lanes k = -reciprocal(length3(at.x, at.y, at.z));
  return (shape_point){k * at.x, k * at.y, k * at.z};
}

static inline shape_point tube_gradient_at(shape_point at, shape_numbers s)
{
  (void)s;
  const zs_lanes k = -reciprocal(length2(at.x, at.y));
  return (shape_point){k * at.x, k * at.y, zs_lanes_all(0)};
}

/* Outside away from the nearest point; inside, and on a face, across the
 * nearest face. */
static inline shape_point cuboid_gradient_at(shape_point at, shape_numbers s)
{
  const zs_lanes zero = zs_lanes_all(0), one = zs_lanes_all(1);
  const zs_lanes u = zs_lanes_absolute(at.x) - s.a, v = zs_lanes_absolute(at.y) - s.b,
                 w = zs_lanes_absolute(at.z) - s.c;
  const zs_lanes p = positive(u), q = positive(v), t = positive(w), d = length3(p, q, t);
  const zs_lanes k = reciprocal(d);
  const zs_lanes_mask outside = d > zero, by_u = u >= zs_lanes_larger(v, w),
                      by_v = ~by_u & (v >= w), by_w = ~by_u & ~by_v;
  const zs_lanes x = zs_lanes_select(outside, k * p, zs_lanes_select(by_u, one, zero));
  const zs_lanes y = zs_lanes_select(outside, k * q, zs_lanes_select(by_v, one, zero));
  const zs_lanes z = zs_lanes_select(outside, k * t, zs_lanes_select(by_w, one, zero));
  return (shape_point){-signed_like(x, at.x), -signed_like(y, at.y), -signed_like(z, at.z)};
}

static inline shape_point cylinder_gradient_at(shape_point at, shape_numbers s)
{
  const zs_lanes zero = zs_lanes_all(0), one = zs_lanes_all(1);
  const zs_lanes length = length2(at.x, at.y), k = reciprocal(length);
  const zs_lanes u = length - s.b, w = zs_lanes_absolute(at.z) - s.a;
  const zs_lanes p = positive(u), t = positive(w), d = length2(p, t), scale = reciprocal(d);
  const zs_lanes_mask outside = d > zero, by_u = u >= w;
  const zs_lanes from_axis = zs_lanes_select(outside, scale * p, zs_lanes_select(by_u, one, zero));
  const zs_lanes along = zs_lanes_select(outside, scale * t, zs_lanes_select(by_u, zero, one));
  const zs_lanes across = -k * from_axis;
  return (shape_point){across * at.x, across * at.y, -signed_like(along, at.z)};
}

static inline shape_point torus_gradient_at(shape_point at, shape_numbers s)
{
  const zs_lanes length = length2(at.x, at.y), u = length - s.a;
  const zs_lanes scale = -reciprocal(length2(u, at.z)), across = scale * u * reciprocal(length);
  return (shape_point){across * at.x, across * at.y, scale * at.z};
}

static inline shape_point capsule_gradient_at(shape_point at, shape_numbers s)
{
  const zs_lanes w = positive(zs_lanes_absolute(at.z) - s.a);
  const zs_lanes k = -reciprocal(length3(at.x, at.y, w));
  return (shape_point){k * at.x, k * at.y, k * signed_like(w, at.z)};
}

/* ---- Coordinates ------------------------------------------------------------------------ */

/* From the inputs to the primitive's own coordinates. */
typedef struct shape_place {
  zs_row row[3];
  enum { MOVED, AFFINE, PERSPECTIVE } kind; /* MOVED: only the constants differ */
} shape_place;

static inline void find_rows(const zs_primitive *primitive, const zs_frame *frame, zs_row row[3])
{
  for (int i = 0; i < 3; i++) {
    const double *of_matrix = primitive->matrix + 4 * (size_t)i;
    row[i] = frame ? zs_row_in_frame(of_matrix, frame) : zs_row_of_registers(of_matrix);
  }
}

/* Whether a primitive is only moved in the frame, or in registers when it is NULL. */
static inline bool is_moved(const zs_primitive *primitive, const zs_frame *frame)
{
  return primitive->moved && (!frame || frame->parallel);
}

/* The constants of the rows of a primitive that is only moved. */
static inline float offset_of(const zs_primitive *primitive, const zs_frame *frame, int i)
{
  return (float)(primitive->matrix[4 * i + 3] + (frame ? frame->origin[i] : 0));
}

static inline void find_place(const zs_primitive *primitive, const zs_frame *frame,
                              shape_place *place)
{
  if (is_moved(primitive, frame)) {
    place->kind = MOVED;
    for (int i = 0; i < 3; i++)
      place->row[i].constant = offset_of(primitive, frame, i);
  } else {
    place->kind = frame && frame->perspective ? PERSPECTIVE : AFFINE;
    find_rows(primitive, frame, place->row);
  }
}

typedef struct shape_map {
  zs_lanes constant[3], k[3][3];
} shape_map;

static inline shape_map map_of(const shape_place *place)
{
  shape_map m;
  for (int i = 0; i < 3; i++) {
    m.constant[i] = zs_lanes_all(place->row[i].constant);
    for (int j = 0; j < 3; j++)
      m.k[i][j] = zs_lanes_all(place->row[i].k[j]);
  }
  return m;
}

static inline shape_point moved(const shape_map *m, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return (shape_point){u + m->constant[0], v + m->constant[1], w + m->constant[2]};
}

static inline zs_lanes affine_row(const shape_map *m, int i, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return zs_lanes_multiply_add(
    m->k[i][0], u,
    zs_lanes_multiply_add(m->k[i][1], v, zs_lanes_multiply_add(m->k[i][2], w, m->constant[i])));
}

static inline shape_point affine(const shape_map *m, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return (shape_point){affine_row(m, 0, u, v, w), affine_row(m, 1, u, v, w),
                       affine_row(m, 2, u, v, w)};
}

static inline zs_lanes perspective_row(const shape_map *m, int i, zs_lanes u, zs_lanes v,
                                       zs_lanes w)
{
  return m->constant[i] + w * (m->k[i][2] + u * m->k[i][0] + v * m->k[i][1]);
}

static inline shape_point perspective(const shape_map *m, zs_lanes u, zs_lanes v, zs_lanes w)
{
  return (shape_point){perspective_row(m, 0, u, v, w), perspective_row(m, 1, u, v, w),
                       perspective_row(m, 2, u, v, w)};
}

typedef zs_lanes shape(shape_point at, shape_numbers s);
typedef zs_lanes_mask shape_beyond(shape_point at, shape_numbers s, zs_lanes t);
typedef shape_point shape_gradient(shape_point at, shape_numbers s);
typedef shape_point mapping(const shape_map *m, zs_lanes u, zs_lanes v, zs_lanes w);

/* The gradient by the inputs. */
static inline shape_point by_inputs(const shape_map *m, shape_point g)
{
  return (shape_point){g.x * m->k[0][0] + g.y * m->k[1][0] + g.z * m->k[2][0],
                       g.x * m->k[0][1] + g.y * m->k[1][1] + g.z * m->k[2][1],
                       g.x * m->k[0][2] + g.y * m->k[1][2] + g.z * m->k[2][2]};
}

/* A factor that is 0 drops its input's derivative, which may be infinite. */
static inline zs_lanes term(zs_lanes factor, const float *derivative)
{
  return (zs_lanes)((zs_lanes_mask)(factor * zs_lanes_load(derivative)) &
                    (factor != zs_lanes_all(0)));
}

/* ---- Bounds ------------------------------------------------------------------------------ */

/* Over what |x|, |y| and |z| can be: all values but the torus's fall with each. */
ZS_INLINE zs_intervals falling_range(const zs_intervals m[3], shape *distance, shape_numbers s)
{
  return (zs_intervals){s.r - distance((shape_point){m[0].hi, m[1].hi, m[2].hi}, s),
                        s.r - distance((shape_point){m[0].lo, m[1].lo, m[2].lo}, s)};
}

static inline zs_intervals torus_range(const zs_intervals m[3], shape_numbers s)
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
static zs_lanes half_diagonal(const zs_bounds *const in[3], unsigned part)
{
  const zs_lanes half = zs_lanes_all(0.5f);
  zs_lanes reach[3];
  for (int k = 0; k < 3; k++) {
    const zs_intervals a = zs_intervals_load(in[k], part);
    reach[k] = half * a.hi - half * a.lo;
  }
  return length3(reach[0], reach[1], reach[2]);
}

/* The primitive's coordinates over the boxes of a matrix that only moves. */
static inline void moved_bounds(const zs_primitive *primitive, const zs_frame *frame,
                                const zs_bounds *const in[3], unsigned part,
                                zs_intervals local[3])
{
  const zs_lanes slack = zs_lanes_all(4 * 1.2e-7f);
  for (int i = 0; i < 3; i++) {
    const zs_intervals a = zs_intervals_load(in[i], part);
    const zs_lanes offset = zs_lanes_all(offset_of(primitive, frame, i));
    const zs_lanes size = zs_lanes_absolute(offset) +
                          zs_lanes_larger(zs_lanes_absolute(a.lo), zs_lanes_absolute(a.hi));
    local[i] = (zs_intervals){a.lo + offset - slack * size, a.hi + offset + slack * size};
  }
}

/* A turned box of inputs reaches less far than the box around it in the
 * primitive's coordinates: f changes by no more than the distance from the
 * middle. */
ZS_INLINE zs_intervals narrowed(zs_intervals range, const zs_intervals local[3], zs_lanes reach,
                                shape *distance, shape_numbers s)
{
  const zs_lanes half = zs_lanes_all(0.5f);
  const shape_point middle = {half * local[0].lo + half * local[0].hi,
                              half * local[1].lo + half * local[1].hi,
                              half * local[2].lo + half * local[2].hi};
  const zs_lanes at_middle = s.r - distance(middle, s);
  return (zs_intervals){zs_lanes_larger(at_middle - reach, range.lo),
                        zs_lanes_smaller(at_middle + reach, range.hi)};
}

/* `frame` is NULL for inputs in registers. */
ZS_INLINE zs_intervals shape_range(const zs_primitive *primitive, const zs_bounds *const in[3],
                                   unsigned part, const zs_frame *frame, shape *distance,
                                   shape_parameters parameters)
{
  const shape_numbers s = numbers_of(parameters);
  zs_intervals local[3], m[3];
  bool turned = false;
  if (is_moved(primitive, frame)) {
    moved_bounds(primitive, frame, in, part, local);
  } else {
    zs_row row[3];
    find_rows(primitive, frame, row);
    turned = !(frame && frame->perspective) && is_turned(row);
    for (int i = 0; i < 3; i++)
      local[i] = frame && frame->perspective ? zs_row_perspective_bounds(row[i], in, part)
                                             : zs_row_bounds(row[i], in, part);
  }
  zs_lanes size = zs_lanes_all(size_of(parameters));
  zs_lanes_mask known = size == size;
  for (int i = 0; i < 3; i++) {
    m[i] = zs_intervals_absolute(local[i]);
    size += m[i].hi;
    known &= zs_intervals_known(local[i]);
  }
  zs_intervals range =
    distance == torus ? torus_range(m, s) : falling_range(m, distance, s);
  if (turned)
    range = narrowed(range, local,
                     half_diagonal(in, part) * zs_lanes_all((float)primitive->stretch), distance,
                     s);
  /* The errors of the coordinates, and of a dozen roundings on the way. */
  const zs_lanes slack = zs_lanes_all(8 * 1.2e-7f) * size;
  return zs_intervals_checked(range.lo - slack, range.hi + slack, known);
}

#endif
