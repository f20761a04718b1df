#include "nodes/common.h"

struct half_space {
  double normal[3], point[3];
};

static const zs_attribute attributes[] = {
  {.name = "normal",
   .type = ZS_VECTOR3,
   .offset = offsetof(struct half_space, normal),
   .initial = "0 0 1",
   .unit = "1",
   .range = ZS_RANGE_ANY,
   .doc = "direction out of the solid, of any length"},
  ZS_POINT(struct half_space, point, "point", "0 0 0", "a point of the plane"),
};

static bool check(const zs_node *node, zs_diag *diag)
{
  const struct half_space *p = node->parameters;
  return zs_node_check_direction(node, diag, "normal", p->normal);
}

static zs_value emit(zs_compiler *compiler, const zs_node *node, const zs_coordinates *at)
{
  const struct half_space *p = node->parameters;
  return zs_emit_half_space(compiler, at, p->normal, p->point);
}

const zs_kind zs_kind_half_space = {
  .name = "half-space",
  .family = ZS_FAMILY_PRIMITIVE,
  .summary = "everything on one side of a plane",
  .doc = "The normal points out of the solid: the default is everything below z = 0.",
  .trait = "exact distance",
  .attributes = attributes,
  .attribute_count = ZS_COUNT_OF(attributes),
  .parameters_size = sizeof(struct half_space),
  .children = ZS_CHILDREN_NONE,
  .formula = "((point.x - x) * normal.x + (point.y - y) * normal.y + (point.z - z) * normal.z) / "
             "hypot(hypot(normal.x, normal.y), normal.z)",
  .check = check,
  .emit = emit,
};
