#include "nodes/common.h"

#include <math.h>

struct ellipsoid {
  double radii[3];
};

static const zs_attribute attributes[] = {
  {.name = "radii",
   .type = ZS_SCALE,
   .offset = offsetof(struct ellipsoid, radii),
   .initial = "1 1 1",
   .unit = "length",
   .range = ZS_RANGE_POSITIVE,
   .doc = "half the extent along x, y and z"},
};

/* The unit ball of the stretched coordinates. */
static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const double *r = ((const struct ellipsoid *)node->parameters)->radii;
  const double inverse[12] = {1 / r[0], 0, 0, 0, 0, 1 / r[1], 0, 0, 0, 0, 1 / r[2], 0};
  zs_coordinates stretched = zs_coordinates_affine(at, inverse);
  zs_value ball = zs_emit_primitive(compiler, ZS_PRIMITIVE_BALL, (double[4]){1}, &stretched);
  return zs_emit_scaled(compiler, ball, fmin(r[0], fmin(r[1], r[2])));
}

const zs_kind zs_kind_ellipsoid = {
  .name = "ellipsoid",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "an ellipsoid about the origin",
  .doc = "f is the distance of a unit ball, stretched with the space and multiplied by the "
         "smallest radius: never more than the distance, and equal to it at the ends of the "
         "shortest axis.",
  .trait = "distance bound",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct ellipsoid),
  .children = ZS_CHILDREN_NONE,
  .formula = "min(radii.x, min(radii.y, radii.z)) * "
             "(1 - hypot(hypot(x / radii.x, y / radii.y), z / radii.z))",
  .fused = fused,
};
