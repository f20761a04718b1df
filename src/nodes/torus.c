#include "nodes/common.h"

struct torus {
  double radius, tube;
  int axis;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct torus, radius, "radius", "1", ZS_RANGE_NOT_NEGATIVE,
            "radius of the circle in the middle of the tube"),
  ZS_LENGTH(struct torus, tube, "tube", "0.25", ZS_RANGE_POSITIVE, "radius of the tube"),
  ZS_AXIS(struct torus, axis, "axis of revolution"),
};

static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct torus *p = node->parameters;
  zs_coordinates along = zs_coordinates_along(at, p->axis);
  return zs_emit_primitive(compiler, ZS_PRIMITIVE_TORUS, (double[4]){p->radius, p->tube}, &along);
}

const zs_kind zs_kind_torus = {
  .name = "torus",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "a ring about the axis",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct torus),
  .children = ZS_CHILDREN_NONE,
  .formula = "tube - hypot(hypot(x, y) - radius, z)",
  .fused = fused,
};
