/* The double-precision definitions of the primitives. */
#include "field/primitive.h"

#include <math.h>

/* An input's factor of 0 drops it, for it may be infinite. */
static void local_place(const zs_primitive *p, const double in[3], double at[3])
{
  for (int i = 0; i < 3; i++) {
    const double *row = p->matrix + 4 * (size_t)i;
    at[i] = row[3];
    for (int j = 0; j < 3; j++)
      at[i] += row[j] != 0 ? row[j] * in[j] : 0;
  }
}

static double ball(const double at[3], const double *p)
{
  return p[0] - hypot(hypot(at[0], at[1]), at[2]);
}

static double tube(const double at[3], const double *p)
{
  return p[0] - hypot(at[0], at[1]);
}

static double cuboid(const double at[3], const double *p)
{
  const double u = fabs(at[0]) - p[0], v = fabs(at[1]) - p[1], w = fabs(at[2]) - p[2];
  return p[3] - (fmin(fmax(u, fmax(v, w)), 0) + hypot(hypot(fmax(u, 0), fmax(v, 0)), fmax(w, 0)));
}

static double cylinder(const double at[3], const double *p)
{
  const double u = hypot(at[0], at[1]) - p[0], w = fabs(at[2]) - p[1];
  return -(fmin(fmax(u, w), 0) + hypot(fmax(u, 0), fmax(w, 0)));
}

static double torus(const double at[3], const double *p)
{
  return p[1] - hypot(hypot(at[0], at[1]) - p[0], at[2]);
}

static double capsule(const double at[3], const double *p)
{
  return p[0] - hypot(hypot(at[0], at[1]), fmax(fabs(at[2]) - p[1], 0));
}

#define REFERENCE(NAME) \
  static double NAME##_reference(const void *data, const double in[]) \
  { \
    const zs_primitive *p = data; \
    double at[3]; \
    local_place(p, in, at); \
    return NAME(at, p->parameter); \
  }
REFERENCE(ball)
REFERENCE(tube)
REFERENCE(cuboid)
REFERENCE(cylinder)
REFERENCE(torus)
REFERENCE(capsule)

static unsigned used(const void *data)
{
  const double *m = ((const zs_primitive *)data)->matrix;
  unsigned inputs = 0;
  for (unsigned j = 0; j < 3; j++)
    inputs |= (unsigned)(m[j] != 0 || m[4 + j] != 0 || m[8 + j] != 0) << j;
  return inputs;
}

#define OPERATION(SHAPE, NAME) \
  [ZS_PRIMITIVE_##SHAPE] = {{.name = #NAME " registers", .arity = 3, \
                             .data_size = sizeof(zs_primitive), .used = used, \
                             .kernels = kernels[ZS_PRIMITIVE_##SHAPE][0], \
                             .reference = NAME##_reference}, \
                            {.name = #NAME, .arity = 3, .data_size = sizeof(zs_primitive), .used = used, \
                             .kernels = kernels[ZS_PRIMITIVE_##SHAPE][1], \
                             .reference = NAME##_reference}},
#define LISTS(SHAPE) \
  [ZS_PRIMITIVE_##SHAPE] = {ZS_VARIANTS(zs_primitive_kernels, [ZS_PRIMITIVE_##SHAPE][0]), \
                            ZS_VARIANTS(zs_primitive_kernels, [ZS_PRIMITIVE_##SHAPE][1])},

typedef const zs_kernels *kernel_list[ZS_ISA_COUNT];
static const kernel_list kernels[ZS_PRIMITIVE_COUNT][2] = {
  LISTS(BALL) LISTS(TUBE) LISTS(CUBOID) LISTS(CYLINDER) LISTS(TORUS) LISTS(CAPSULE)
};

static const zs_operation operations[ZS_PRIMITIVE_COUNT][2] = {
  OPERATION(BALL, ball)
  OPERATION(TUBE, tube)
  OPERATION(CUBOID, cuboid)
  OPERATION(CYLINDER, cylinder)
  OPERATION(TORUS, torus)
  OPERATION(CAPSULE, capsule)
};

const zs_operation *zs_primitive_operation(zs_primitive_shape shape, bool root)
{
  return &operations[shape][root];
}

bool zs_primitive_of(const zs_operation *operation, zs_primitive_shape *shape, bool *root)
{
  for (unsigned s = 0; s < ZS_PRIMITIVE_COUNT; s++)
    for (unsigned r = 0; r < 2; r++)
      if (operation == &operations[s][r]) {
        *shape = (zs_primitive_shape)s;
        *root = r == 1;
        return true;
      }
  return false;
}
