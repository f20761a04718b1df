#include "nodes/kind.h"

struct circle {
  double radius;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct circle, radius, "radius", "1", ZS_RANGE_POSITIVE, "radius of the disc"),
};

static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct circle *p = node->parameters;
  return zs_emit_primitive(compiler, ZS_PRIMITIVE_TUBE, (double[4]){p->radius}, at);
}

const zs_kind zs_kind_circle = {
  .name = "circle",
  .family = ZS_FAMILY_SHAPE,
  .summary = "a disc about the origin of the x-y plane",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct circle),
  .children = ZS_CHILDREN_NONE,
  .formula = "radius - hypot(x, y)",
  .fused = fused,
};
