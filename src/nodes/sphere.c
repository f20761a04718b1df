#include "nodes/kind.h"

struct sphere {
  double radius;
};

static const zs_attribute attributes[] = {
  ZS_LENGTH(struct sphere, radius, "radius", "1", ZS_RANGE_POSITIVE, "radius of the sphere"),
};

static zs_value fused(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct sphere *p = node->parameters;
  return zs_emit_primitive(compiler, ZS_PRIMITIVE_BALL, (double[4]){p->radius}, at);
}

const zs_kind zs_kind_sphere = {
  .name = "sphere",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "a ball about the origin",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct sphere),
  .children = ZS_CHILDREN_NONE,
  .formula = "radius - hypot(hypot(x, y), z)",
  .fused = fused,
};
