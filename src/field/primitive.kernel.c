/* Block, gradient and bounds kernels of the primitives.  Compiled once per
 * instruction set. */
#include "field/shape.h"

ZS_INLINE void fill_values(const zs_block_arguments *x, const shape_map *m, mapping *at,
                           shape *distance, shape_numbers s)
{
  const float *u = x->in[0], *v = x->in[1], *w = x->in[2];
  float *out = x->out;
  for (size_t i = 0, n = x->n; i < n; i += ZS_WIDTH)
    zs_lanes_store(out + i, s.r - distance(at(m, zs_lanes_load(u + i), zs_lanes_load(v + i),
                                              zs_lanes_load(w + i)),
                                           s));
}

ZS_INLINE void values(const zs_block_arguments *x, const zs_frame *frame, shape *distance,
                      shape_numbers s)
{
  shape_place place;
  find_place(x->data, frame, &place);
  const shape_map m = map_of(&place);
  if (place.kind == MOVED)
    fill_values(x, &m, moved, distance, s);
  else if (place.kind == AFFINE)
    fill_values(x, &m, affine, distance, s);
  else
    fill_values(x, &m, perspective, distance, s);
}

ZS_INLINE void fill_gradients(const zs_block_arguments *x, const shape_map *m, mapping *where,
                              shape *distance, shape_gradient *slope, shape_numbers s, bool root)
{
  const float *u = x->in[0], *v = x->in[1], *w = x->in[2];
  float *out = x->out;
  for (size_t i = 0, n = x->n; i < n; i += ZS_WIDTH) {
    const shape_point at =
      where(m, zs_lanes_load(u + i), zs_lanes_load(v + i), zs_lanes_load(w + i));
    const zs_lanes value = s.r - distance(at, s);
    shape_point g = slope(at, s);
    if (where == affine)
      g = by_inputs(m, g);
    if (!root) {
      zs_lanes row[3];
      for (unsigned k = 0; k < 3; k++) {
        const size_t offset = (size_t)(k + 1) * ZS_BLOCK + i;
        row[k] = term(g.x, u + offset) + term(g.y, v + offset) + term(g.z, w + offset);
      }
      g = (shape_point){row[0], row[1], row[2]};
    }
    zs_lanes_store(out + i, value);
    zs_lanes_store(out + ZS_BLOCK + i, g.x);
    zs_lanes_store(out + 2 * ZS_BLOCK + i, g.y);
    zs_lanes_store(out + 3 * ZS_BLOCK + i, g.z);
  }
}

ZS_INLINE void gradients(const zs_block_arguments *x, const zs_frame *frame, shape *distance,
                         shape_gradient *slope, shape_numbers s)
{
  shape_place place;
  find_place(x->data, frame, &place);
  const shape_map m = map_of(&place);
  if (place.kind == MOVED)
    fill_gradients(x, &m, moved, distance, slope, s, frame != NULL);
  else
    fill_gradients(x, &m, affine, distance, slope, s, frame != NULL);
}

/* ---- Tables ---------------------------------------------------------------------------------- */

/* `FRAME` is NULL for inputs in registers. */
#define KERNELS(NAME, FORM, FRAME) \
  static void NAME##FORM##_value(const zs_block_arguments *x) \
  { \
    const zs_primitive *p = x->data; \
    values(x, FRAME, NAME, numbers_of(NAME##_parameters(p->parameter))); \
  } \
  static void NAME##FORM##_gradient(const zs_block_arguments *x) \
  { \
    const zs_primitive *p = x->data; \
    gradients(x, FRAME, NAME, NAME##_gradient_at, numbers_of(NAME##_parameters(p->parameter))); \
  } \
  static void NAME##FORM##_bounds(const zs_bounds_arguments *x) \
  { \
    const zs_primitive *p = x->data; \
    ZS_FOR_PARTS(part) \
      zs_intervals_store(x->out, part, shape_range(p, x->in, part, FRAME, NAME, \
                                                   NAME##_parameters(p->parameter))); \
  }
#define BOTH_KERNELS(NAME) KERNELS(NAME, _registers, NULL) KERNELS(NAME, _root, x->frame)
BOTH_KERNELS(ball)
BOTH_KERNELS(tube)
BOTH_KERNELS(cuboid)
BOTH_KERNELS(cylinder)
BOTH_KERNELS(torus)
BOTH_KERNELS(capsule)

#define TABLE(SHAPE, NAME) \
  [ZS_PRIMITIVE_##SHAPE] = {{NAME##_registers_value, NAME##_registers_gradient, \
                             NAME##_registers_bounds}, \
                            {NAME##_root_value, NAME##_root_gradient, NAME##_root_bounds}},

const zs_primitive_table ZS_KERNELS(zs_primitive_kernels) = {
  TABLE(BALL, ball)
  TABLE(TUBE, tube)
  TABLE(CUBOID, cuboid)
  TABLE(CYLINDER, cylinder)
  TABLE(TORUS, torus)
  TABLE(CAPSULE, capsule)
};
